//! Tests that a data folder of an earlier version opens with all its data, even if the process dies during a start.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::csv_table::Csv;
use crate::server::{Answer, example, example_text};
use crate::support::{Service, case, pause, railhead};

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

struct Client<'a> {
    service: &'a Service,
    key: &'a str,
}

impl Client<'_> {
    async fn text(&self, path: &str) -> String {
        let request = self.service.request(Method::GET, path);
        Answer::to(request.bearer_auth(self.key)).await.is(200).text
    }

    async fn get(&self, path: &str) -> Value {
        serde_json::from_str(&self.text(path).await).unwrap()
    }

    /// Repeats a submission with its idempotency key.
    async fn send_again(&self, path: &str, key: &str, form: &str, body: String) -> Answer {
        let request = self.service.request(Method::POST, path).body(body);
        let request = request.bearer_auth(self.key).header("content-type", form);
        Answer::to(request.header("idempotency-key", key)).await
    }

    /// Repeats a submission. Returns the id in the answer, and whether the answer was a replay of the first one.
    async fn again(&self, path: &str, key: &str, form: &str, body: String) -> (Value, bool) {
        let answer = self.send_again(path, key, form, body).await;
        let replayed = answer.header("idempotency-replayed").is_some();
        assert!(answer.json["id"].is_string(), "{path}: {}", answer.text);
        (answer.json["id"].clone(), replayed)
    }

    /// Repeats a submission whose key now belongs to another digest. Asserts the conflict.
    async fn assert_conflict(&self, path: &str, key: &str, form: &str, body: String) {
        let answer = self.send_again(path, key, form, body).await.is(422);
        assert_eq!(answer.json["type"], "/problems/idempotency-conflict");
    }

    async fn until_ended(&self, path: &str) -> Value {
        loop {
            let now = self.get(path).await;
            if !now["ended_at"].is_null() && now["state"] != "running" && now["state"] != "queued" {
                return now;
            }
            pause().await;
        }
    }
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
    let key = text("key");
    let client = Client {
        service: &service,
        key: &key,
    };

    let result = client.get(&format!("/v1/jobs/{}/result", id("job"))).await;
    let force = |result: &Value| {
        result["patches"][0]["points"][0]["force_y_n"]
            .as_f64()
            .unwrap()
    };
    assert_eq!(force(&result), force(&expected["result"]));
    client.get(&format!("/v1/profiles/{}", id("profile"))).await;
    let batch = client
        .text(&format!("/v1/batches/{}/results?format=csv", id("batch")))
        .await;
    let run = client
        .text(&format!("/v1/runs/{}/results?format=csv", id("run")))
        .await;
    for (now, then) in [(batch, text("batch_results")), (run, text("run_results"))] {
        let (now, then) = (Csv::read(&now), Csv::read(&then));
        assert_eq!(now.column("force_x_n"), then.column("force_x_n"));
    }
    let row = client.get(&format!("/v1/runs/{}/rows/1", id("run"))).await;
    assert_eq!(row["case"]["load"]["normal_force_n"], json!(74000.0));

    // Repeated requests with their idempotency keys return the same jobs.
    let before = form;
    let form = "application/json";
    let spin = example("spin.case.json").to_string();
    assert_eq!(
        client.again("/v1/jobs", "job", form, spin).await,
        (json!(id("job")), true)
    );
    let table = "creepage_x,label:km,name\n0.001,1,first\n0.002,2,second\n".to_owned();
    // Digests of tables and rows have changed since schema version 7. A repeated key is then a conflict and never creates a second batch or run.
    let rows = example_text("run.json");
    let batch = format!("/v1/batches?template={}&name=table&label=line:7", id("job"));
    for (path, key_used, form, body) in [
        (batch.as_str(), "batch", "text/csv", table),
        ("/v1/runs?name=rows&label=line:7", "run", form, rows),
    ] {
        if before == 7 {
            client.assert_conflict(path, key_used, form, body).await;
        } else {
            let found = client.again(path, key_used, form, body).await;
            assert_eq!(found, (json!(id(key_used)), true));
        }
    }
    // Runs are not listed as batches, and batches are not listed as runs.
    for (kind, other) in [("batches", "runs"), ("runs", "batches")] {
        let listed = client.get(&format!("/v1/{kind}?limit=100")).await;
        let listed = listed[kind].as_array().unwrap();
        assert_eq!(listed.len(), 2, "{listed:?}");
        for entry in listed {
            let path = format!("/v1/{other}/{}", entry["id"].as_str().unwrap());
            let request = service.request(Method::GET, &path).bearer_auth(&key);
            assert_eq!(request.send().await.unwrap().status(), 404, "{path}");
        }
    }

    // Queued jobs are solved.
    for path in [
        format!("/v1/jobs/{}", id("running")),
        format!("/v1/jobs/{}", id("queued")),
        format!("/v1/batches/{}", id("queued_batch")),
        format!("/v1/runs/{}", id("queued_run")),
    ] {
        let ended = client.until_ended(&path).await;
        assert!(
            ended["state"] == "succeeded" || ended["states"]["succeeded"] == 2,
            "{ended}"
        );
    }
    let new = client
        .again("/v1/jobs", "new", form, case("new").to_string())
        .await;
    assert!(!new.1);

    assert_stored_bytes_go(&client, [id("run"), id("batch")]).await;
}

/// Asserts that stored bytes are counted, and that they are freed with their run and batch.
async fn assert_stored_bytes_go(client: &Client<'_>, [run, batch]: [String; 2]) {
    let stored = async || {
        client.get("/v1/me").await["used"]["stored_bytes"]
            .as_u64()
            .unwrap()
    };
    let before = stored().await;
    assert!(before > 10_000, "{before}");
    for path in [format!("/v1/runs/{run}"), format!("/v1/batches/{batch}")] {
        let request = client
            .service
            .request(Method::DELETE, &path)
            .bearer_auth(client.key);
        assert_eq!(request.send().await.unwrap().status(), 204);
    }
    assert!(stored().await < before);
}
