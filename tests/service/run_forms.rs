//! Rows of runs in every form that they may be sent in, and more of them than is allowed.

use railhead::jobs::codec::arrow::ArrowWriter;
use railhead::jobs::codec::parquet::encode;
use railhead::jobs::codec::table::{RowTable, TableColumn};
use reqwest::Method;
use serde_json::json;

use crate::errors::assert_problem;
use crate::runs::{columns, ended, template};
use crate::server::{Answer, Server, Setup};

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
                TableColumn::Texts(["a", "b", "a"].map(|text| Some(text.to_owned())).to_vec()),
            ),
        ],
    }
}

#[tokio::test]
async fn the_same_rows_are_answered_alike_whatever_form_they_come_in() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
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
        let path = format!("/v1/runs?template={template}");
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
    let template = kept_template(&server).await;
    let send = |request: reqwest::RequestBuilder| {
        request
            .header("content-type", "text/csv")
            .body("creepage_x\n".repeat(1000))
    };
    let answer = server
        .send(Method::POST, &format!("/v1/runs?template={template}"), send)
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

/// The id of a job whose case rows by the table are filled into.
async fn kept_template(server: &Server) -> String {
    let mut case = template("table");
    case["load"]["normal_force_n"] = json!(1e5);
    let job = server.submit(&case).await;
    job.rsplit('/').next().expect("an id").to_owned()
}

/// Sends a table in CSV over a template.
async fn send_table(server: &Server, template: &str, table: &'static str) -> Answer {
    let path = format!("/v1/runs?template={template}");
    let csv =
        |request: reqwest::RequestBuilder| request.header("content-type", "text/csv").body(table);
    server.send(Method::POST, &path, csv).await
}

/// A table as a simulation writes it, and the same rows in the words of this service.
#[tokio::test]
async fn a_table_of_a_simulation_is_read_with_its_units() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    let tables = [
        (
            "",
            "normal_force_n,creepage_x,spin_per_mm,time\n5e4,1e-3,4e-4,0.1\n6e4,-2e-3,-3e-4,0.2\n",
        ),
        (
            "",
            "Normal force;longitudinal creepage;spin;time\n[kN];[%];[1/m];[s]\n50;0,1;0,4;0,1\n60;-0,2;-0,3;0,2\n",
        ),
        (
            "&column=Fz:normal_force%20%5BkN%5D&column=nu.x:creepage_x&column=phi:spin%20%5B1/m%5D",
            "Fz\tnu.x\tphi\ttime\n50\t0.001\t0.4\t0.1\n60\t-0.002\t-0.3\t0.2\n",
        ),
    ];
    let mut answers = Vec::new();
    for (query, table) in tables {
        let sent = send_table(&server, &format!("{template}{query}"), table).await;
        assert_eq!(sent.status, 202, "{}", sent.text);
        assert_eq!(sent.json["columns"][0]["pointer"], "/load/normal_force_n");
        let factor = if query.is_empty() && table.starts_with("normal") {
            1.0
        } else {
            1e3
        };
        assert_eq!(sent.json["columns"][0]["factor"], factor);
        let run = sent.header("location").expect("a location").to_owned();
        assert_eq!(ended(&server, &run).await["rows_without_answer"], 0);
        let results = format!("{run}/results?format=ndjson&columns=time,force_x_n,normal_force_n");
        answers.push(crate::runs::lines(&server.get(&results).await));
    }
    for other in &answers[1..] {
        for (row, same) in answers[0].iter().zip(other) {
            assert_eq!(row["time"], same["time"]);
            let [force, other] = [row, same].map(|row| row["force_x_n"].as_f64().expect("a force"));
            assert!((force / other - 1.0).abs() < 1e-12, "{row} {same}");
        }
    }
}

#[tokio::test]
async fn a_table_whose_units_are_not_clear_is_refused() {
    let server = Server::start().await;
    let template = kept_template(&server).await;
    for (query, table, words) in [
        (
            "",
            "normal_force_n,spin\n5e4,0.4\n",
            ["`spin`", "has no unit"],
        ),
        (
            "",
            "normal_force_n,yaw [grad]\n5e4,0.4\n",
            ["`yaw [grad]`", "mrad"],
        ),
        (
            "&column=Q:creepage_x",
            "normal_force_n,q\n5e4,0.4\n",
            ["`Q`", "no title"],
        ),
    ] {
        let refused = send_table(&server, &format!("{template}{query}"), table).await;
        assert_problem(&refused, 422, "faulty-table", words[0]);
        assert!(
            words.iter().all(|word| refused.text.contains(word)),
            "{}",
            refused.text
        );
    }
}
