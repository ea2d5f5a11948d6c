//! Keys made and revoked beside the real program, what its start refuses, and what browsers are told.

use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::{Duration, Instant};

use reqwest::Method;
use serde_json::{Value, json};

use crate::server::Server;
use crate::support::{Service, endless_case, pause, railhead};

fn keys(data_dir: &Path, args: &[&str]) -> Output {
    let mut command = railhead();
    let command = command.arg("keys").args(args);
    command.arg("--data-dir").arg(data_dir).output().unwrap()
}

fn make_key(data_dir: &Path, tenant: &str) -> String {
    let made = keys(
        data_dir,
        &["create", "--tenant", tenant, "--name", "a test"],
    );
    assert!(made.status.success(), "{made:?}");
    let text = String::from_utf8(made.stdout).unwrap();
    let key = text.trim().to_owned();
    assert_eq!(key.len(), "rh_".len() + 12 + 1 + 64, "{text:?}");
    key
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .flat_map(|path| {
            if path.is_dir() {
                files_below(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

#[tokio::test]
async fn a_key_works_at_once_and_is_refused_seconds_after_it_was_revoked() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &["--anonymous", "loopback"]);
    // Made beside the running service.
    let key = make_key(folder.path(), "north");
    let ask = async || {
        let request = service.request(Method::GET, "/v1/jobs").bearer_auth(&key);
        request.send().await.unwrap().status()
    };
    assert_eq!(ask().await, 200);
    let id = key.split('_').nth(1).unwrap();
    let revoked = keys(folder.path(), &["revoke", id]);
    assert!(revoked.status.success(), "{revoked:?}");
    let since = Instant::now();
    while ask().await != 401 {
        assert!(since.elapsed() < Duration::from_secs(60), "still accepted");
        pause().await;
    }
    let list = String::from_utf8(keys(folder.path(), &["list"]).stdout).unwrap();
    let line = list.lines().find(|line| line.starts_with(id)).unwrap();
    let columns: Vec<&str> = line.split('\t').collect();
    assert_eq!((columns[1], columns[5]), ("north", "-"), "{line}");
    assert_ne!(columns[3], "-", "{line}");
    let unknown = keys(folder.path(), &["revoke", "000000000000"]);
    assert_eq!(unknown.status.code(), Some(1));

    // The secret is nowhere: not in the list, not in the log, not in the data folder.
    let secret = key.rsplit('_').next().unwrap();
    assert!(!list.contains(secret));
    assert!(!service.log_text().contains(secret));
    for file in files_below(folder.path()) {
        let bytes = std::fs::read(&file).unwrap();
        let found = bytes
            .windows(secret.len())
            .any(|part| part == secret.as_bytes());
        assert!(!found, "{}", file.display());
    }
}

/// What a request with a key is answered.
async fn ask(
    service: &Service,
    key: &str,
    (method, path): (Method, &str),
    body: Option<&Value>,
) -> (u16, Value) {
    let request = service.request(method, path).bearer_auth(key);
    let request = match body {
        Some(body) => request.json(body),
        None => request,
    };
    let answer = request.send().await.unwrap();
    let status = answer.status().as_u16();
    (status, answer.json().await.unwrap_or(Value::Null))
}

/// A key of everything that the tenant `north` has, and one that is bound to line 7.
fn key_and_bound_key(folder: &Path) -> (String, String) {
    let flags = ["create", "--tenant", "north", "--label", "line:7"];
    let made = String::from_utf8(keys(folder, &flags).stdout).unwrap();
    (make_key(folder, "north"), made.trim().to_owned())
}

/// Rows of a run.
fn rows() -> Value {
    let mut template = crate::support::case("rows");
    template["outputs"] = json!(["resultants"]);
    json!({ "template": template, "columns": { "/friction/coefficient": [0.2, 0.3] } })
}

#[tokio::test]
async fn a_key_bound_to_a_label_opens_nothing_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &[]);
    let (all, bound) = key_and_bound_key(folder.path());
    let case = crate::support::case("on a line");
    let submit = async |key: &str| {
        let request = service.request(Method::POST, "/v1/jobs").bearer_auth(key);
        let request = request.header("idempotency-key", "one-of-all").json(&case);
        let answer = request.send().await.unwrap();
        let status = answer.status().as_u16();
        (status, answer.json::<Value>().await.unwrap())
    };
    let (status, other) = submit(&all).await;
    assert_eq!(status, 202, "{other}");
    // The same case and the same key of idempotency: nothing of another line may be answered.
    let (status, conflict) = submit(&bound).await;
    assert_eq!(status, 422, "{conflict}");
    let other = other["links"]["self"].as_str().unwrap();
    let (_, batch) = {
        let cases = json!([case]);
        ask(&service, &all, (Method::POST, "/v1/batches"), Some(&cases)).await
    };
    let batch = batch["links"]["self"].as_str().unwrap();
    let rows = rows();
    let (_, run) = ask(&service, &all, (Method::POST, "/v1/runs"), Some(&rows)).await;
    let run = run["links"]["self"].as_str().unwrap();
    for (method, path) in [
        (Method::GET, run),
        (Method::GET, &format!("{run}/results")),
        (Method::GET, &format!("{run}/manifest")),
        (Method::GET, &format!("{run}/totals")),
        (Method::POST, &format!("{run}/cancel")),
        (Method::DELETE, run),
        (Method::GET, other),
        (Method::GET, &format!("{other}/case")),
        (Method::GET, &format!("{other}/result")),
        (Method::GET, &format!("{other}/events")),
        (Method::POST, &format!("{other}/cancel")),
        (Method::DELETE, other),
        (Method::GET, batch),
        (Method::GET, &format!("{batch}/results")),
        (Method::POST, &format!("{batch}/cancel")),
        (Method::DELETE, batch),
    ] {
        let (status, _) = ask(&service, &bound, (method.clone(), path), None).await;
        assert_eq!(status, 404, "{method} {path}");
    }
    for list in ["jobs", "batches", "runs"] {
        let path = format!("/v1/{list}");
        let (_, page) = ask(&service, &bound, (Method::GET, &path), None).await;
        assert_eq!(page[list], json!([]));
    }
}

#[tokio::test]
async fn a_key_bound_to_a_label_gives_it_to_what_it_makes() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &[]);
    let (all, bound) = key_and_bound_key(folder.path());
    let mut foreign = crate::support::case("on a line");
    foreign["labels"] = json!({ "line": "8" });
    let mut own = foreign.clone();
    own["labels"] = json!({ "km": "12.4" });
    let cases = json!([foreign, own]);
    let (status, refused) = ask(
        &service,
        &bound,
        (Method::POST, "/v1/jobs"),
        Some(&cases[0]),
    )
    .await;
    assert_eq!(status, 422, "{refused}");
    assert_eq!(refused["errors"][0]["pointer"], "/labels/line", "{refused}");
    let path = "/v1/batches?on_invalid=skip";
    let (status, batch) = ask(&service, &bound, (Method::POST, path), Some(&cases)).await;
    assert_eq!((status, &batch["rejected"]), (202, &json!(1)), "{batch}");
    for key in [&bound, &all] {
        let get = async |path| ask(&service, key, (Method::GET, path), None).await.1;
        let jobs = get("/v1/jobs").await;
        let labels = &jobs["jobs"][0]["labels"];
        assert_eq!(*labels, json!({ "line": "7", "km": "12.4" }), "{jobs}");
        let batches = get("/v1/batches").await;
        let labels = &batches["batches"][0]["labels"];
        assert_eq!(*labels, json!({ "line": "7" }), "{batches}");
    }
    let (_, run) = ask(&service, &bound, (Method::POST, "/v1/runs"), Some(&rows())).await;
    assert_eq!(run["labels"], json!({ "line": "7" }), "{run}");
    let (_, me) = ask(&service, &bound, (Method::GET, "/v1/me"), None).await;
    assert_eq!(me["labels"], json!({ "line": "7" }));
}

#[tokio::test]
async fn a_key_that_may_only_read_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &["--anonymous", "always"]);
    let own = make_key(folder.path(), "north");
    let flags = ["create", "--tenant", "north", "--read-only"];
    let made = String::from_utf8(keys(folder.path(), &flags).stdout).unwrap();
    let reader = made.trim();
    let ask = async |key: &str, method: Method, path: &str, body: Option<&Value>| {
        ask(&service, key, (method, path), body).await
    };
    let case = crate::support::case("shown in a hall");
    let (status, job) = ask(&own, Method::POST, "/v1/jobs", Some(&case)).await;
    assert_eq!(status, 202);
    let path = job["links"]["self"].as_str().unwrap();
    for read in [path, "/v1/jobs", "/v1/me", &format!("{path}/case")] {
        assert_eq!(ask(reader, Method::GET, read, None).await.0, 200, "{read}");
    }
    let checked = ask(reader, Method::POST, "/v1/cases/check", Some(&case)).await;
    assert_eq!(checked.0, 200);
    let cases = Value::Array(vec![case.clone()]);
    for (method, changed, body) in [
        (Method::POST, "/v1/jobs".to_owned(), Some(&case)),
        (Method::POST, "/v1/batches".to_owned(), Some(&cases)),
        (Method::POST, format!("{path}/cancel"), None),
        (Method::DELETE, path.to_owned(), None),
    ] {
        let (status, problem) = ask(reader, method, &changed, body).await;
        assert_eq!(
            (status, &problem["type"]),
            (403, &Value::from("/problems/forbidden")),
            "{changed}"
        );
    }
    let listed = String::from_utf8(keys(folder.path(), &["list"]).stdout).unwrap();
    let may = |key: &str| {
        let id = key.split('_').nth(1).unwrap();
        let line = listed.lines().find(|line| line.starts_with(id)).unwrap();
        line.split('\t').nth(4).unwrap().to_owned()
    };
    assert_eq!(
        (may(&own), may(reader)),
        ("all".to_owned(), "read".to_owned())
    );
}

#[tokio::test]
async fn a_revoked_key_ends_the_streams_that_it_opened() {
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &[]);
    let key = make_key(folder.path(), "north");
    let request = service
        .request(Method::POST, "/v1/batches")
        .bearer_auth(&key);
    let batch: Value = request
        .json(&[endless_case("long")])
        .send()
        .await
        .unwrap()
        .json()
        .await
        .unwrap();
    let mut open = Vec::new();
    for path in ["events", "results"] {
        let link = batch["links"][path].as_str().unwrap();
        let request = service.request(
            Method::GET,
            &format!("{link}?wait=600").replace("events?wait=600", "events"),
        );
        open.push(request.bearer_auth(&key).send().await.unwrap());
    }
    let revoked = keys(folder.path(), &["revoke", key.split('_').nth(1).unwrap()]);
    assert!(revoked.status.success(), "{revoked:?}");
    // The stream of events ends, lines of results break off.
    for (answer, complete) in open.into_iter().zip([true, false]) {
        assert_eq!(answer.status(), 200);
        let ended = tokio::time::timeout(Duration::from_secs(15), answer.bytes());
        let ended = ended.await.expect("the end of the stream");
        assert_eq!(ended.is_ok(), complete);
    }
}

#[test]
fn reading_keys_makes_no_data_folder() {
    let folder = tempfile::tempdir().unwrap();
    for name in [".", "mistyped"] {
        let place = folder.path().join(name);
        for asked in [&["list"][..], &["revoke", "0123456789ab"]] {
            let answer = keys(&place, asked);
            assert_eq!(answer.status.code(), Some(1), "{answer:?}");
        }
    }
    assert_eq!(
        keys(
            &folder.path().join("mistyped"),
            &["create", "--tenant", "a"]
        )
        .status
        .code(),
        Some(1)
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[tokio::test]
async fn a_service_that_nobody_or_everybody_could_use_says_so_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let serve = |flags: &[&str]| {
        let mut command = railhead();
        command.args(["serve", "--data-dir"]).arg(folder.path());
        command.args(flags).output().unwrap()
    };
    for flags in [
        &["--listen", "0.0.0.0:0"][..],
        &["--listen", "127.0.0.1:0", "--anonymous", "never"],
    ] {
        let refused = serve(flags);
        assert_eq!(refused.status.code(), Some(1));
        let text = String::from_utf8(refused.stderr).unwrap();
        for word in ["no API key", "keys create --tenant", "--anonymous always"] {
            assert!(text.contains(word), "{text}");
        }
    }
    let everywhere = ["--listen", "0.0.0.0:0", "--anonymous", "always"];
    let service = Service::start(folder.path(), &everywhere);
    service.get("/v1/jobs").await;
    assert_eq!(
        service.logged("whoever reaches this address may use the service without a key"),
        1
    );
    service.kill();

    let open = "there are keys, and requests from this machine need none; behind a proxy use `--anonymous never`";
    let service = Service::start(folder.path(), &[]);
    assert_eq!(service.logged(open), 0);
    service.kill();
    let key = make_key(folder.path(), "north");
    let service = Service::start(folder.path(), &[]);
    assert_eq!(service.logged(open), 1);
    let proxied = service.request(Method::GET, "/v1/jobs");
    let proxied = proxied.header("via", "1.1 proxy").send().await.unwrap();
    assert_eq!(proxied.status(), 401);
    service.kill();
    let service = Service::start(folder.path(), &["--listen", "0.0.0.0:0"]);
    assert_eq!(service.logged(open), 0);
    let request = || service.request(Method::GET, "/v1/jobs");
    assert_eq!(request().send().await.unwrap().status(), 401);
    let known = request().bearer_auth(&key).send().await.unwrap();
    assert_eq!(known.status(), 200);
}

#[tokio::test]
async fn only_pages_of_listed_origins_may_read_answers() {
    let folder = tempfile::tempdir().unwrap();
    let listed = "https://a.example,http://localhost:3000";
    let service = Service::start(folder.path(), &["--cors-origin", listed]);
    for (origin, allowed) in [
        ("https://a.example", true),
        ("http://localhost:3000", true),
        ("https://b.example", false),
        ("http://a.example", false),
    ] {
        let get = service
            .request(Method::GET, "/v1/jobs")
            .header("origin", origin);
        let preflight = service
            .request(Method::OPTIONS, "/v1/jobs")
            .header("origin", origin)
            .header("access-control-request-method", "POST")
            .header(
                "access-control-request-headers",
                "authorization,content-type",
            );
        for request in [get, preflight] {
            let answer = request.send().await.unwrap();
            let header = answer.headers().get("access-control-allow-origin");
            let told = header.map(|value| value.to_str().unwrap());
            assert_eq!(told, allowed.then_some(origin));
        }
    }
    let mut command = railhead();
    let bad = command
        .args(["serve", "--cors-origin", "*"])
        .output()
        .unwrap();
    assert_eq!(bad.status.code(), Some(2));
}

#[tokio::test]
async fn browsers_are_told_to_be_careful_with_every_answer() {
    let server = Server::idle().await;
    for path in [
        "/v1/jobs",
        "/v1/jobs/none",
        "/nothing",
        "/docs/",
        "/metrics",
        "/openapi.json",
    ] {
        let answer = server.get(path).await;
        assert_eq!(
            answer.header("x-content-type-options"),
            Some("nosniff"),
            "{path}"
        );
        assert_eq!(answer.header("x-frame-options"), Some("DENY"), "{path}");
        assert_eq!(
            answer.header("referrer-policy"),
            Some("no-referrer"),
            "{path}"
        );
        let policy = answer.header("content-security-policy").unwrap_or_default();
        assert!(
            policy.contains("frame-ancestors 'none'"),
            "{path}: {policy}"
        );
        assert_eq!(answer.header("access-control-allow-origin"), None, "{path}");
    }
}
