//! Tests keys that are created and revoked while the real program runs, refusals at its start, and headers for browsers.

use std::path::Path;
use std::process::Output;
use std::time::{Duration, Instant};

use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::server::{Answer, Server};
use crate::support::{Service, endless_case, files_below, pause, railhead};

fn keys(data_dir: &Path, args: &[&str]) -> Output {
    let mut command = railhead();
    let command = command.arg("keys").args(args);
    command.arg("--data-dir").arg(data_dir).output().unwrap()
}

/// Runs a `keys` command. Returns standard output, and panics if the command fails.
fn said(data_dir: &Path, args: &[&str]) -> String {
    let done = keys(data_dir, args);
    assert!(done.status.success(), "{done:?}");
    String::from_utf8(done.stdout).unwrap()
}

fn make_key(data_dir: &Path, tenant: &str) -> String {
    let text = said(
        data_dir,
        &["create", "--tenant", tenant, "--name", "a test"],
    );
    let key = text.trim().to_owned();
    assert_eq!(key.len(), "rh_".len() + 12 + 1 + 64, "{text:?}");
    key
}

fn id_of(key: &str) -> &str {
    key.split('_').nth(1).unwrap()
}

/// Returns the columns of a key in the list.
fn listed<'a>(list: &'a str, key: &str) -> Vec<&'a str> {
    let line = list.lines().find(|line| line.starts_with(id_of(key)));
    line.unwrap().split('\t').collect()
}

#[tokio::test]
async fn a_key_works_at_once_and_is_refused_seconds_after_it_was_revoked() {
    let (folder, service) = Service::fresh(&["--anonymous", "loopback"]);
    // The key is created while the service runs.
    let key = make_key(folder.path(), "north");
    let jobs = || (Method::GET, "/v1/jobs");
    let ask = async || ask(&service, &key, jobs(), None).await.status;
    assert_eq!(ask().await, 200);
    said(folder.path(), &["revoke", id_of(&key)]);
    let since = Instant::now();
    while ask().await != 401 {
        assert!(since.elapsed() < Duration::from_secs(60), "still accepted");
        pause().await;
    }
    let list = said(folder.path(), &["list"]);
    let columns = listed(&list, &key);
    assert_eq!((columns[1], columns[5]), ("north", "-"), "{list}");
    assert_ne!(columns[3], "-", "{list}");
    let unknown = keys(folder.path(), &["revoke", "000000000000"]);
    assert_eq!(unknown.status.code(), Some(1));

    // The secret appears neither in the list, nor in the log, nor in the data folder.
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

/// Sends a request with a key.
async fn ask(
    service: &Service,
    key: &str,
    (method, path): (Method, &str),
    body: Option<&Value>,
) -> Answer {
    let request = service.request(method, path).bearer_auth(key);
    Answer::to(match body {
        Some(body) => request.json(body),
        None => request,
    })
    .await
}

#[tokio::test]
async fn a_key_that_may_only_read_changes_nothing() {
    let (folder, service) = Service::fresh(&["--anonymous", "always"]);
    let own = make_key(folder.path(), "north");
    let flags = ["create", "--tenant", "north", "--read-only"];
    let made = said(folder.path(), &flags);
    let reader = made.trim();
    let ask = async |key: &str, method: Method, path: &str, body: Option<&Value>| {
        ask(&service, key, (method, path), body).await
    };
    let case = crate::support::case("shown in a hall");
    let job = ask(&own, Method::POST, "/v1/jobs", Some(&case)).await;
    let path = &job.is(202).location();
    for read in [path, "/v1/jobs", "/v1/me", &format!("{path}/case")] {
        ask(reader, Method::GET, read, None).await.is(200);
    }
    let checked = ask(reader, Method::POST, "/v1/cases/check", Some(&case));
    checked.await.is(200);
    let cases = json!([case]);
    for (method, changed, body) in [
        (Method::POST, "/v1/jobs".to_owned(), Some(&case)),
        (Method::POST, "/v1/batches".to_owned(), Some(&cases)),
        (Method::POST, format!("{path}/cancel"), None),
        (Method::DELETE, path.to_owned(), None),
    ] {
        let refused = ask(reader, method, &changed, body).await;
        assert_problem(&refused, 403, "forbidden", "");
    }
    let list = said(folder.path(), &["list"]);
    let may = [&own, reader].map(|key| listed(&list, key)[4]);
    assert_eq!(may, ["all", "read"]);
}

#[tokio::test]
async fn a_revoked_key_ends_the_streams_that_it_opened() {
    let (folder, service) = Service::fresh(&[]);
    let key = make_key(folder.path(), "north");
    let cases = json!([endless_case("long")]);
    let batch = ask(&service, &key, (Method::POST, "/v1/batches"), Some(&cases));
    let batch = batch.await.is(202).location();
    let mut open = Vec::new();
    for part in ["events", "results?wait=600"] {
        let request = service.request(Method::GET, &format!("{batch}/{part}"));
        open.push(request.bearer_auth(&key).send().await.unwrap());
    }
    said(folder.path(), &["revoke", id_of(&key)]);
    // The event stream ends. The stream of result lines breaks off.
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
    let mistyped = folder.path().join("mistyped");
    let refused = keys(&mistyped, &["create", "--tenant", "a"]);
    assert_eq!(refused.status.code(), Some(1));
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
        service.logged("everyone who can reach this address can use the service without a key"),
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
    Answer::to(proxied.header("via", "1.1 proxy")).await.is(401);
    service.kill();
    let service = Service::start(folder.path(), &["--listen", "0.0.0.0:0"]);
    assert_eq!(service.logged(open), 0);
    service.ask("/v1/jobs").await.is(401);
    let known = ask(&service, &key, (Method::GET, "/v1/jobs"), None);
    known.await.is(200);
}

#[tokio::test]
async fn only_pages_of_listed_origins_may_read_answers() {
    let folder = tempfile::tempdir().unwrap();
    let listed = "HTTPS://A.example:443, http://localhost:3000";
    let service = Service::start(folder.path(), &["--cors-origin", listed]);
    for (origin, allowed) in [
        ("https://a.example", true),
        ("http://localhost:3000", true),
        ("https://b.example", false),
        ("http://a.example", false),
    ] {
        for method in [Method::GET, Method::OPTIONS] {
            // `OPTIONS` is the preflight request of a browser.
            let request = service.request(method, "/v1/jobs").header("origin", origin);
            let request = request.header("access-control-request-method", "POST");
            let headers = "authorization,content-type";
            let request = request.header("access-control-request-headers", headers);
            let answer = Answer::to(request).await;
            let told = answer.header("access-control-allow-origin");
            assert_eq!(told, allowed.then_some(origin));
        }
    }
    let mut bad = railhead();
    let bad = bad.args(["serve", "--cors-origin", "*"]).output().unwrap();
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
        for (name, value) in [
            ("x-content-type-options", Some("nosniff")),
            ("x-frame-options", Some("DENY")),
            ("referrer-policy", Some("no-referrer")),
            ("access-control-allow-origin", None),
        ] {
            assert_eq!(answer.header(name), value, "{name} of {path}");
        }
        let policy = answer.header("content-security-policy").unwrap_or_default();
        assert!(
            policy.contains("frame-ancestors 'none'"),
            "{path}: {policy}"
        );
    }
}
