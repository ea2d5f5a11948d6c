//! Tests a table and its template in one request, as `multipart/form-data`.

use reqwest::Method;
use serde_json::{Value, json};

use crate::batches::{results, small};
use crate::errors::assert_problem;
use crate::runs::template;
use crate::server::{Answer, Server};

const BOUNDARY: &str = "a-boundary";

/// Returns a body with these parts, each with its head.
fn body(parts: &[(&str, &str)]) -> String {
    let parts = parts.iter();
    let parts = parts.map(|(head, text)| {
        format!("--{BOUNDARY}\r\nContent-Disposition: form-data; {head}\r\n\r\n{text}\r\n")
    });
    parts.collect::<String>() + &format!("--{BOUNDARY}--\r\n")
}

pub async fn upload(server: &Server, path: &str, parts: &[(&str, &str)]) -> Answer {
    let body = body(parts);
    let kind = format!("multipart/form-data; boundary={BOUNDARY}");
    server.post_as(path, &kind, body).await
}

#[tokio::test]
async fn a_table_with_its_template_is_answered_like_one_over_a_job() {
    let server = Server::start().await;
    let case = small("template");
    let id = server.keep(&case).await;
    let table = "label:km,normal_force_n,/motion/creepage_x\n37.2,80000,0.002\n37.4,90000,0\n";
    let path = format!("/v1/batches?template={id}");
    let over_job = server.post_as(&path, "text/csv", table).await.is(202);
    let case = case.to_string();
    let parts = [
        ("name=\"template\"; filename=\"case.json\"", case.as_str()),
        // Programs that do not know the format of a file send this content type.
        (
            "name=\"table\"; filename=\"rows.CSV\"\r\nContent-Type: application/octet-stream",
            table,
        ),
    ];
    let alone = upload(&server, "/v1/batches", &parts).await.is(202);
    let [expected, found] = [
        results(&server, &over_job.json, "?wait=60").await,
        results(&server, &alone.json, "?wait=60").await,
    ];
    assert_eq!(found.len(), 2);
    for (expected, found) in expected.iter().zip(&found) {
        assert_eq!(found["labels"], expected["labels"]);
        assert!(found["result"].is_object(), "{found}");
        assert_eq!(found["result"]["patches"], expected["result"]["patches"]);
    }
}

#[tokio::test]
async fn parts_that_are_missing_or_wrong_are_named() {
    let server = Server::idle().await;
    let case = template("auto").to_string();
    let template = ("name=\"template\"", case.as_str());
    let table = ("name=\"table\"", "normal_force_n\n5e4\n");
    for (parts, said) in [
        (vec![], "nothing where the part `template` is expected"),
        (
            vec![table, template],
            "`table` where the part `template` is expected",
        ),
        (vec![template], "nothing where the part `table` is expected"),
        (
            vec![template, ("name=\"rows\"", "1")],
            "`rows` where the part `table` is expected",
        ),
    ] {
        for path in ["/v1/runs", "/v1/batches"] {
            let answer = upload(&server, path, &parts).await;
            assert_problem(&answer, 422, "faulty-table", said);
        }
    }
    for path in ["/v1/runs", "/v1/batches", "/v1/evaluate"] {
        for (name, text) in [
            ("table", table.1),
            ("template", &case),
            ("on_invalid", "skip"),
        ] {
            let more = format!("name=\"{name}\"");
            let answer = upload(&server, path, &[template, table, (&more, text)]).await;
            let said = format!("the part `{name}` after the table; allowed are");
            assert_problem(&answer, 422, "faulty-table", &said);
        }
    }
    for kind in ["runs", "batches"] {
        let kept = server.get(&format!("/v1/{kind}")).await.is(200);
        assert_eq!(kept.json[kind], json!([]));
    }
    let broken = upload(&server, "/v1/runs", &[("name=\"template\"", "{"), table]).await;
    assert_problem(&broken, 400, "malformed-json", "");
    let job = uuid::Uuid::nil();
    let twice = upload(
        &server,
        &format!("/v1/runs?template={job}"),
        &[template, table],
    )
    .await;
    assert_problem(&twice, 400, "bad-query", "leave `?template=` out");
    let kind = "multipart/form-data";
    let bare = server
        .post_as("/v1/runs", kind, body(&[template, table]))
        .await;
    assert_problem(&bare, 415, "unsupported-media-type", "boundary");
    let faulty: Value = json!({ "load": {} });
    let faulty = faulty.to_string();
    let faulty = upload(
        &server,
        "/v1/runs",
        &[("name=\"template\"", &faulty), table],
    )
    .await;
    assert_problem(&faulty, 422, "faulty-case", "");
}

#[tokio::test]
async fn a_batch_and_a_run_can_be_waited_for_as_a_job_can() {
    let server = Server::start().await;
    let prefer = |body: Value| {
        move |request: reqwest::RequestBuilder| request.header("prefer", "wait=60").json(&body)
    };
    let rows = json!({ "template": template("auto"), "columns": { "normal_force_n": [5e4, 6e4] } });
    for (path, body) in [
        ("/v1/jobs", small("waits")),
        ("/v1/batches", json!([small("one"), small("two")])),
        ("/v1/runs", rows),
    ] {
        let asked = server.post(&format!("{path}?wait=60"), &body).await;
        assert_eq!(asked.status, 200, "{path}: {}", asked.text);
        assert_eq!(asked.header("preference-applied"), None);
        let preferred = server.send(Method::POST, path, prefer(body.clone())).await;
        assert_eq!(preferred.status, 200, "{path}: {}", preferred.text);
        assert_eq!(preferred.header("preference-applied"), Some("wait=60"));
        for answer in [&asked, &preferred] {
            let ended = ["succeeded", "ended"].map(|state| json!(state));
            assert!(
                ended.contains(&answer.json["state"]),
                "{path}: {}",
                answer.text
            );
        }
        let location = asked.location();
        let wrong = server.get(&format!("{location}?wait=soon")).await;
        assert_problem(&wrong, 400, "bad-query", "from 0 to 3600");
        let unknown = server.get(&format!("{location}?wait=1&pause=1")).await;
        assert_problem(&unknown, 400, "bad-query", "`pause`");
    }
}

#[tokio::test]
async fn answers_in_tables_are_saved_under_names_of_their_own() {
    let server = Server::start().await;
    let batch = server
        .post("/v1/batches?wait=60", &json!([small("one")]))
        .await;
    let rows = json!({ "template": template("auto"), "columns": { "normal_force_n": [5e4] } });
    let run = server.post("/v1/runs?wait=60", &rows).await;
    for (answer, kind, format) in [
        (&batch, "batch", "csv"),
        (&batch, "batch", "ndjson"),
        (&run, "run", "parquet"),
        (&run, "run", "arrow"),
    ] {
        let path = answer.header("location").expect("a location");
        let id = path.rsplit('/').next().expect("an id");
        let results = server.get(&format!("{path}/results?format={format}")).await;
        let expected = format!("attachment; filename=\"{kind}-{id}.{format}\"");
        assert_eq!(
            results.header("content-disposition"),
            Some(expected.as_str())
        );
    }
}
