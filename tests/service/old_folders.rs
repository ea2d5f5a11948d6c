//! Tests that a data folder of an earlier version opens with all its data, even if the process dies during a start.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::csv_table::Csv;
use crate::server::{Answer, example, example_text};
use crate::support::{Service, case, railhead};

/// Unpacks a data folder of a schema version. Returns it with the answers of the program that wrote it.
fn of_form(form: u32) -> (TempDir, Value) {
    let folder = tempfile::tempdir().unwrap();
    let archive = format!("tests/data/data-folder-form-{form}.tar.gz");
    let archive = Path::new(env!("CARGO_MANIFEST_DIR")).join(archive);
    let unpacked = Command::new("tar")
        .arg("-xzf")
        .arg(archive)
        .arg("-C")
        .arg(folder.path())
        .status();
    assert!(unpacked.unwrap().success());
    let expected = std::fs::read_to_string(folder.path().join("expected.json")).unwrap();
    (folder, serde_json::from_str(&expected).unwrap())
}

/// Repeats a submission with its idempotency key.
async fn send_again(
    service: &Service,
    (path, key): (&str, &str),
    form: &str,
    body: String,
) -> Answer {
    let request = service.request(Method::POST, path).body(body);
    let request = request.header("content-type", form);
    Answer::to(request.header("idempotency-key", key)).await
}

/// Asserts whether the answer to a repeated submission is a replay, and returns the id in it.
fn assert_replayed(answer: Answer, replayed: bool) -> Value {
    let header = answer.header("idempotency-replayed");
    assert_eq!(header.is_some(), replayed, "{}", answer.text);
    assert!(answer.json["id"].is_string(), "{}", answer.text);
    answer.json["id"].clone()
}

/// Above the number of starts of a test: each start that is killed takes one attempt of the jobs in the folder.
const ATTEMPTS: [&str; 2] = ["--attempts-max", "20"];

/// Starts and kills the service several times, because a process may die at any moment of its first starts.
fn kill_while_starting(folder: &Path) {
    for ms in [0, 5, 20, 50, 100, 200] {
        let mut program = railhead();
        program
            .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
            .arg(folder)
            .args(ATTEMPTS);
        let mut started = program
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(ms));
        started.kill().unwrap();
        started.wait().unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_of_form_7_opens_with_all_that_is_in_it() {
    opens_with_all_that_is_in_it(7).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_folder_of_form_8_opens_with_all_that_is_in_it() {
    opens_with_all_that_is_in_it(8).await;
}

async fn opens_with_all_that_is_in_it(form: u32) {
    let (folder, expected) = of_form(form);
    kill_while_starting(folder.path());
    let [option, attempts] = ATTEMPTS;
    let service = Service::start(folder.path(), &["--workers", "1", option, attempts]);
    let text = |name: &str| expected[name].as_str().unwrap().to_owned();
    let id = text;
    let service = service.with_key(&text("key"));

    let result = service.get(&format!("/v1/jobs/{}/result", id("job"))).await;
    let force = |result: &Value| {
        result["patches"][0]["points"][0]["force_y_n"]
            .as_f64()
            .unwrap()
    };
    assert_eq!(force(&result), force(&expected["result"]));
    let profile = format!("/v1/profiles/{}", id("profile"));
    service.get(&profile).await;
    for (kind, work) in [("batches", "batch"), ("runs", "run")] {
        let path = format!("/v1/{kind}/{}/results?format=csv", id(work));
        let now = Csv::read(&service.ask(&path).await.is(200).text);
        let then = Csv::read(&text(&format!("{work}_results")));
        assert_eq!(now.column("force_x_n"), then.column("force_x_n"));
    }
    let row = service.get(&format!("/v1/runs/{}/rows/1", id("run"))).await;
    assert_eq!(row["case"]["load"]["normal_force_n"], json!(74000.0));

    // Repeated requests with their idempotency keys return the same jobs.
    let before = form;
    let form = "application/json";
    let spin = example("spin.case.json").to_string();
    let job = send_again(&service, ("/v1/jobs", "job"), form, spin).await;
    assert_eq!(assert_replayed(job, true), id("job"));
    let table = "creepage_x,label:km,name\n0.001,1,first\n0.002,2,second\n".to_owned();
    // Digests of tables and rows have changed since schema version 7. A repeated key is then a conflict and never creates a second batch or run.
    let rows = example_text("run.json");
    let batch = format!("/v1/batches?template={}&name=table&label=line:7", id("job"));
    for (path, key_used, form, body) in [
        (batch.as_str(), "batch", "text/csv", table),
        ("/v1/runs?name=rows&label=line:7", "run", form, rows),
    ] {
        let answer = send_again(&service, (path, key_used), form, body).await;
        if before == 7 {
            let conflict = &answer.is(422).json["type"];
            assert_eq!(conflict, "/problems/idempotency-conflict");
        } else {
            assert_eq!(assert_replayed(answer, true), id(key_used));
        }
    }
    // Runs are not listed as batches, and batches are not listed as runs.
    for (kind, other) in [("batches", "runs"), ("runs", "batches")] {
        let listed = service.get(&format!("/v1/{kind}?limit=100")).await;
        let listed = listed[kind].as_array().unwrap();
        assert_eq!(listed.len(), 2, "{listed:?}");
        for entry in listed {
            let path = format!("/v1/{other}/{}", entry["id"].as_str().unwrap());
            service.ask(&path).await.is(404);
        }
    }

    // Queued jobs are solved.
    for path in [
        format!("/v1/jobs/{}", id("running")),
        format!("/v1/jobs/{}", id("queued")),
        format!("/v1/batches/{}", id("queued_batch")),
        format!("/v1/runs/{}", id("queued_run")),
    ] {
        let ended = service.get(&format!("{path}?wait=240")).await;
        assert!(
            ended["state"] == "succeeded" || ended["states"]["succeeded"] == 2,
            "{ended}"
        );
    }
    let new = case("new").to_string();
    assert_replayed(
        send_again(&service, ("/v1/jobs", "new"), form, new).await,
        false,
    );
    assert_stored_bytes_go(&service, [id("run"), id("batch")]).await;
}

/// Asserts that stored bytes are counted, and that they are freed with their run and batch.
async fn assert_stored_bytes_go(service: &Service, [run, batch]: [String; 2]) {
    let stored = async || {
        service.get("/v1/me").await["used"]["stored_bytes"]
            .as_u64()
            .unwrap()
    };
    let before = stored().await;
    assert!(before > 10_000, "{before}");
    for path in [format!("/v1/runs/{run}"), format!("/v1/batches/{batch}")] {
        let request = service.request(Method::DELETE, &path);
        Answer::to(request).await.is(204);
    }
    assert!(stored().await < before);
}
