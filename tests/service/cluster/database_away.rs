//! Tests answers while the database cannot be reached, and recovery afterwards.

use std::time::{Duration, Instant};

use reqwest::{Method, RequestBuilder};

use crate::cluster::cable::Cable;
use crate::cluster::postgres::at_port;
use crate::cluster::{WITHIN, node, tables};
use crate::support::{Answer, Service, case, long_case};

/// Starts a node with a worker whose connection to the database passes through a proxy.
async fn node_at_a_cable(flags: &[&str]) -> Option<(Service, Cable)> {
    let url = tables().await?;
    let (with_port, port) = at_port(&url);
    let cable = Cable::to(port).await;
    let url = with_port(cable.address.port());
    let own = ["--workers", "1", "--lease-s", "30"];
    let service = node(&url, "serve", &[&own, flags].concat());
    Some((service, cable))
}

/// Asserts that an answer reports the unreachable database and does not mention disks.
async fn assert_unreachable(request: RequestBuilder) {
    let answer = Answer::to(request).await.is(503);
    assert!(answer.header("retry-after").is_some(), "{}", answer.text);
    assert_eq!(answer.json["type"], "/problems/storage-unreachable");
    let text = answer.text;
    assert!(
        text.contains("cannot be reached") && !text.contains("disk"),
        "{text}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn a_database_that_is_away_is_no_full_disk_and_costs_no_job() {
    let (service, cable) = or_skip!(node_at_a_cable(&[]).await);
    let done = service.submit(&case("done")).await;
    service.until(&done, "succeeded").await;
    let solving = service.submit(&long_case("solving", 1_000)).await;
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
        assert_unreachable(request).await;
    }

    cable.set_whole(true);
    service.until_ready().await;
    let job = service.until(&solving, "succeeded").await;
    assert_eq!(job["attempt"], 1, "{job}\n{}", service.log_text());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_way_that_swallows_everything_keeps_no_connection_and_no_request() {
    // With two connections, no request is served while one of them hangs.
    let (service, cable) = or_skip!(node_at_a_cable(&["--database-connections", "2"]).await);
    let done = service.submit(&case("done")).await;
    service.until(&done, "succeeded").await;

    // The pool tests a returned connection with a query that has no timeout (docs/scaling.md, "The database"). Wait until this test is over.
    tokio::time::sleep(Duration::from_millis(500)).await;
    cable.swallow();
    let asked = Instant::now();
    let job = service.request(Method::GET, &format!("/v1/jobs/{done}"));
    assert_unreachable(job).await;
    assert!(
        asked.elapsed() < WITHIN,
        "TCP gives up after a quarter of an hour"
    );
    cable.set_whole(true);
    service.until_ready().await;
    let later = service.submit(&case("later")).await;
    service.until(&later, "succeeded").await;
}
