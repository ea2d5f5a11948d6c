//! Rows of runs in every form that they may be sent in, and more of them than is allowed.

use railhead::jobs::codec::arrow::ArrowWriter;
use railhead::jobs::codec::parquet::encode;
use railhead::jobs::codec::table::{RowTable, TableColumn};
use reqwest::Method;
use serde_json::json;

use crate::errors::assert_problem;
use crate::runs::{columns, ended, template};
use crate::server::{Server, Setup};

/// The same rows as a table in some form.
fn table() -> RowTable {
    RowTable {
        columns: vec![
            (
                "normal_force_n".to_owned(),
                TableColumn::Numbers(vec![5e4, 6e4, 7e4]),
            ),
            (
                "/motion/creepage_x".to_owned(),
                TableColumn::Numbers(vec![1e-3, 0.0, -2e-3]),
            ),
            (
                "section".to_owned(),
                TableColumn::Texts(["a", "b", "a"].map(str::to_owned).to_vec()),
            ),
        ],
    }
}

#[tokio::test]
async fn the_same_rows_are_answered_alike_whatever_form_they_come_in() {
    let server = Server::start().await;
    let job = server
        .submit(&{
            let mut case = template("table");
            case["load"]["normal_force_n"] = json!(1e5);
            case
        })
        .await;
    let kinds: Vec<_> = table()
        .columns
        .iter()
        .map(|(name, column)| (name.clone(), column.kind()))
        .collect();
    let mut arrow = ArrowWriter::new(Vec::new(), &kinds).expect("a stream");
    arrow.write(table()).expect("a batch");
    arrow.finish().expect("the end");
    let csv = "normal_force_n,/motion/creepage_x,section\n5e4,1e-3,a\n6e4,0,b\n7e4,-2e-3,a\n";
    let ndjson = "{\"normal_force_n\":5e4,\"/motion/creepage_x\":1e-3,\"section\":\"a\"}\n\
                  {\"normal_force_n\":6e4,\"/motion/creepage_x\":0,\"section\":\"b\"}\n\
                  {\"normal_force_n\":7e4,\"/motion/creepage_x\":-2e-3,\"section\":\"a\"}\n";
    let mut answers = Vec::new();
    for (form, body) in [
        ("text/csv", csv.as_bytes().to_vec()),
        ("application/x-ndjson", ndjson.as_bytes().to_vec()),
        (
            "application/vnd.apache.arrow.stream",
            std::mem::take(arrow.inner_mut()),
        ),
        (
            "application/vnd.apache.parquet",
            encode(&table()).expect("a file"),
        ),
    ] {
        let path = format!("/v1/runs?template={}", &job[9..]);
        let send =
            |request: reqwest::RequestBuilder| request.header("content-type", form).body(body);
        let answer = server.send(Method::POST, &path, send).await;
        assert_eq!(answer.status, 202, "{form}: {}", answer.text);
        let run = answer.header("location").expect("a location").to_owned();
        ended(&server, &run).await;
        answers.push(server.get(&format!("{run}/results?format=csv")).await.text);
    }
    assert!(
        answers[0]
            .lines()
            .nth(1)
            .is_some_and(|line| line.starts_with("0,a,ok,table,")),
        "{}",
        answers[0]
    );
    assert!(
        answers.iter().all(|answer| *answer == answers[0]),
        "{answers:#?}"
    );
}

#[tokio::test]
async fn more_rows_or_bytes_than_allowed_are_refused() {
    let mut setup = Setup::new();
    setup.working = false;
    (setup.http.run_max_rows, setup.http.run_max_bytes) = (100, 4096);
    let server = setup.start().await;
    let body = json!({ "template": template("table"), "columns": columns(101) });
    assert_problem(
        &server.post("/v1/runs", &body).await,
        413,
        "body-too-large",
        "run-max-rows",
    );
    let mut case = template("table");
    case["load"]["normal_force_n"] = json!(1e5);
    let job = server.submit(&case).await;
    let send = |request: reqwest::RequestBuilder| {
        request
            .header("content-type", "text/csv")
            .body("creepage_x\n".repeat(1000))
    };
    let answer = server
        .send(
            Method::POST,
            &format!("/v1/runs?template={}", &job[9..]),
            send,
        )
        .await;
    assert_problem(&answer, 413, "body-too-large", "4096");
    let send = |request: reqwest::RequestBuilder| {
        request.header("content-type", "text/csv").body("a\n1\n")
    };
    assert_problem(
        &server.send(Method::POST, "/v1/runs", send).await,
        400,
        "bad-query",
        "template",
    );
}
