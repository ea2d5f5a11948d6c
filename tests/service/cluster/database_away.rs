//! What do clients hear while the database cannot be reached, and does everything go on afterwards?

use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;
use reqwest::{Method, RequestBuilder};
use serde_json::Value;

use crate::cluster::cable::Cable;
use crate::cluster::postgres::{at_port, database};
use crate::support::{Service, case, long_case, pause};

/// Ends of a guard: something hangs.
const WITHIN: Duration = Duration::from_secs(60);

/// The status, the kind of problem and its text.
async fn problem(request: RequestBuilder) -> (u16, String, String) {
    let answer = request.send().await.unwrap();
    let status = answer.status().as_u16();
    let waits = answer.headers().contains_key("retry-after");
    let problem: Value = answer.json().await.unwrap();
    assert!(waits, "{problem}");
    let word = |key: &str| problem[key].as_str().unwrap_or_default().to_owned();
    (status, word("type"), word("title") + " " + &word("detail"))
}

#[tokio::test(flavor = "multi_thread")]
async fn a_database_that_is_away_is_no_full_disk_and_costs_no_job() {
    let Some(url) = database().await else {
        return;
    };
    migrate(&url).await.unwrap();
    let (with_port, port) = at_port(&url);
    let cable = Cable::to(port).await;
    let url = with_port(cable.address.port());
    let folder = tempfile::tempdir().unwrap();
    let flags = ["--database-url", &url, "--workers", "1", "--cache", "false"];
    let service = Service::start(folder.path(), &flags);
    let done = service.submit(&case("done")).await;
    service.until(&done, "succeeded").await;
    let solving = service.submit(&long_case("solving", 60)).await;
    service.until(&solving, "running").await;

    cable.set_whole(false);
    let job = format!("/v1/jobs/{done}");
    let posted = service
        .request(Method::POST, "/v1/jobs")
        .json(&case("refused"));
    for request in [
        service.request(Method::GET, &job),
        service.request(Method::GET, &format!("{job}/result")),
        service.request(Method::GET, "/readyz"),
        posted,
    ] {
        let (status, kind, text) = problem(request).await;
        assert_eq!(
            (status, kind.as_str()),
            (503, "/problems/storage-unreachable"),
            "{text}"
        );
        assert!(
            text.contains("cannot be reached") && !text.contains("disk"),
            "{text}"
        );
    }

    cable.set_whole(true);
    let since = Instant::now();
    loop {
        let answer = service
            .request(Method::GET, "/readyz")
            .send()
            .await
            .unwrap();
        if answer.status() == 200 {
            break;
        }
        assert!(since.elapsed() < WITHIN, "it is not ready again");
        pause().await;
    }
    let job = service.until(&solving, "succeeded").await;
    assert_eq!(job["attempt"], 1, "{job}\n{}", service.log_text());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_way_that_swallows_everything_keeps_no_connection_and_no_request() {
    let Some(url) = database().await else {
        return;
    };
    migrate(&url).await.unwrap();
    let (with_port, port) = at_port(&url);
    let cable = Cable::to(port).await;
    let url = with_port(cable.address.port());
    let folder = tempfile::tempdir().unwrap();
    // Two connections: no request is served while one of them is kept.
    let flags = [
        "--database-url",
        &url,
        "--workers",
        "1",
        "--database-connections",
        "2",
    ];
    let service = Service::start(folder.path(), &flags);
    let done = service.submit(&case("done")).await;
    service.until(&done, "succeeded").await;

    // The pool tests a connection that is given back by a question without an end (docs/scaling.md, "The database"): not at this moment.
    tokio::time::sleep(Duration::from_millis(500)).await;
    cable.swallow();
    let asked = Instant::now();
    let job = service.request(Method::GET, &format!("/v1/jobs/{done}"));
    let (status, kind, text) = problem(job).await;
    assert_eq!(
        (status, kind.as_str()),
        (503, "/problems/storage-unreachable"),
        "{text}"
    );
    assert!(
        asked.elapsed() < WITHIN,
        "TCP gives up after a quarter of an hour"
    );
    cable.set_whole(true);
    let since = Instant::now();
    while service
        .request(Method::GET, "/readyz")
        .send()
        .await
        .unwrap()
        .status()
        != 200
    {
        assert!(since.elapsed() < WITHIN, "it is not ready again");
        pause().await;
    }
    let later = service.submit(&case("later")).await;
    service.until(&later, "succeeded").await;
}
