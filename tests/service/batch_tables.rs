//! Tables of cases: columns by name or pointer, faults by line.

use serde_json::json;

use crate::batches::{send, small};
use crate::errors::assert_problem;
use crate::server::Server;

async fn template(server: &Server) -> String {
    format!("?template={}", server.keep(&small("template")).await)
}

#[tokio::test]
async fn faults_of_a_table_are_named_by_line() {
    let server = Server::idle().await;
    let query = template(&server).await;
    let table =
        "normal_force_n,creepage_x\n80000,0.001\n-5,0.001\n80000\n\"8\n0000\",0\n80000,fast\n";
    let answer = send(&server, &query, "text/csv", table.to_owned()).await;
    assert_problem(&answer, 422, "faulty-batch", "4 of 5");
    let faults = answer.json["errors"].as_array().expect("errors");
    let found: Vec<_> = faults
        .iter()
        .map(|fault| {
            (
                fault["line"].as_u64().expect("a line"),
                fault["pointer"].as_str().expect("a pointer"),
            )
        })
        .collect();
    assert_eq!(
        found,
        [
            (3, "/1/load/normal_force_n"),
            (4, "/2"),
            (5, "/3/load/normal_force_n"),
            (7, "/4/motion/creepage_x")
        ]
    );
    let taken = send(
        &server,
        &format!("{query}&on_invalid=skip"),
        "text/csv",
        table.to_owned(),
    )
    .await;
    assert_eq!(
        (taken.status, &taken.json["count"], &taken.json["rejected"]),
        (202, &json!(1), &json!(4))
    );
    for (query, table, status, kind, word) in [
        (query.as_str(), "speed\n3\n", 422, "faulty-table", "`speed`"),
        (query.as_str(), "name;b\nx;3\n", 422, "faulty-table", "`b`"),
        (query.as_str(), "", 422, "faulty-batch", "no case"),
        (query.as_str(), "name\n", 422, "faulty-batch", "no case"),
        ("", "name\nx\n", 400, "bad-query", "template"),
        ("?template=x", "name\nx\n", 400, "bad-query", "template"),
        (
            "?template=0198c0de-0000-7000-8000-000000000000",
            "name\nx\n",
            404,
            "job-not-found",
            "",
        ),
    ] {
        let answer = send(&server, query, "text/csv", table.to_owned()).await;
        assert_problem(&answer, status, kind, word);
    }
    let answer = send(&server, &query, "application/json", "[]".to_owned()).await;
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
