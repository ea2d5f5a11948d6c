//! Tests tables of cases: columns by name or pointer, and errors by line.

use serde_json::{Value, json};

use crate::batches::{results, send, small};
use crate::errors::assert_problem;
use crate::server::Server;
use crate::table_forms::send_rows;

async fn template(server: &Server) -> String {
    format!("?template={}", server.keep(&small("template")).await)
}

#[tokio::test]
async fn faults_of_a_table_are_named_by_line() {
    let server = Server::idle().await;
    let query = template(&server).await;
    let table =
        "normal_force_n,creepage_x\n80000,0.001\n-5,0.001\n80000\n\"8\n0000\",0\n80000,fast\n";
    let answer = send(&server, &query, "text/csv", table).await;
    assert_problem(&answer, 422, "faulty-batch", "4 of 5");
    let faults = answer.json["errors"].as_array().expect("errors");
    let found = faults
        .iter()
        .map(|fault| json!([fault["line"], fault["pointer"]]));
    let expected = json!([
        [3, "/1/load/normal_force_n"],
        [4, "/2"],
        [5, "/3/load/normal_force_n"],
        [7, "/4/motion/creepage_x"]
    ]);
    assert_eq!(found.collect::<Value>(), expected);
    let skip = format!("{query}&on_invalid=skip");
    let taken = send(&server, &skip, "text/csv", table).await.is(202);
    let counts = ["count", "rejected"].map(|name| &taken.json[name]);
    assert_eq!(counts, [1, 4]);
    let unknown = format!("?template={}", uuid::Uuid::nil());
    for (query, table, status, kind, word) in [
        (query.as_str(), "speed\n3\n", 422, "faulty-table", "`speed`"),
        (query.as_str(), "name;b\nx;3\n", 422, "faulty-table", "`b`"),
        (query.as_str(), "", 422, "faulty-batch", "no case"),
        (query.as_str(), "name\n", 422, "faulty-batch", "no case"),
        ("", "name\nx\n", 400, "bad-query", "template"),
        ("?template=x", "name\nx\n", 400, "bad-query", "template"),
        (&*unknown, "name\nx\n", 404, "job-not-found", ""),
    ] {
        let answer = send(&server, query, "text/csv", table).await;
        assert_problem(&answer, status, kind, word);
    }
    let answer = send(&server, &query, "application/json", "[]").await;
    assert_problem(&answer, 400, "bad-query", "text/csv");
}

#[tokio::test]
async fn names_and_labels_have_no_control_characters() {
    let server = Server::idle().await;
    for (pointer, value) in [
        ("/name", json!("a\nb")),
        ("/name", json!("a\u{1b}[2J")),
        ("/labels", json!({ "a:b": "c" })),
        ("/labels", json!({ "a": "b\u{0}" })),
        ("/labels", json!({ "a\t": "b" })),
    ] {
        let mut case = small("plain");
        *case.pointer_mut(pointer).expect("a member") = value;
        let answer = server.post("/v1/jobs", &case).await;
        assert_problem(&answer, 422, "faulty-case", "1 fault");
    }
}

/// Numbers are parsed in the same way as in runs.
#[tokio::test]
async fn numbers_may_have_a_plus_sign() {
    let server = Server::idle().await;
    let query = template(&server).await;
    let table = "normal_force_n,creepage_x,deadline_s,/solver/mesh/strips\n+100000,+.5e-3,+60,+6\n";
    let batch = send(&server, &query, "text/csv", table).await;
    let batch = batch.is(202);
    let jobs = results(&server, &batch.json, "").await;
    let case = server
        .read(&format!(
            "/v1/jobs/{}/case",
            jobs[0]["id"].as_str().expect("an id")
        ))
        .await;
    assert_eq!(case["load"]["normal_force_n"], 100_000);
    assert_eq!(case["motion"]["creepage_x"], 0.5e-3);
    let table = "normal_force_n,creepage_x\n+100000,+.5e-3\n";
    let run = send_rows(&server, &query[10..], "text/csv", table).await;
    assert_eq!(run.is(202).json["rows"], 1);
}

#[tokio::test]
async fn a_table_that_is_not_utf8_says_so() {
    let server = Server::idle().await;
    let query = template(&server).await;
    let utf16 = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        let table = "\u{feff}normal_force_n\n80000\n";
        table.encode_utf16().flat_map(bytes).collect()
    };
    let wide = "the table is UTF-16, not UTF-8";
    let (first, second) = (b"name,speed_\xb5\nx,1\n", b"creepage_x,name\n0.001,\xb0\n");
    for (body, said) in [
        (utf16(u16::to_le_bytes), wide),
        (utf16(u16::to_be_bytes), wide),
        (first.to_vec(), "not UTF-8, as its line 1 shows"),
        (second.to_vec(), "not UTF-8, as its line 2 shows"),
    ] {
        for kind in ["batches", "runs", "evaluate"] {
            let path = format!("/v1/{kind}{query}");
            let answer = server.post_as(&path, "text/csv", body.clone()).await;
            assert_problem(&answer, 422, "faulty-table", said);
        }
    }
}
