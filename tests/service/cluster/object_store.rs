//! Tests large results in an object store: every node reads them, and no result is lost when the store fails.

use std::sync::atomic::Ordering;

use serde_json::{Value, json};

use crate::cluster::faulty_server::FaultyServer;
use crate::cluster::seaweed::{railhead_at, server};
use crate::cluster::{node_by, said_by, tables, until};
use crate::support::{Service, large_case};

const PLACE: &str = "s3://results/of/tests";

/// Runs `doctor`. Returns whether its check of the result store passed, and its report on it.
fn doctor(port: u16, url: &str, place: &str) -> (bool, String) {
    let words = ["doctor", "--database-url", url, "--results-url", place];
    let (_, said) = said_by(&mut railhead_at(port), &words);
    let mut lines = said.lines();
    let line = lines.find(|line| line.contains("place of the results"));
    let line = line.unwrap_or_else(|| panic!("{said}"));
    (line.starts_with("ok"), line.to_owned())
}

async fn result(service: &Service, id: &str) -> (u16, Value) {
    let answer = service.ask(&format!("/v1/jobs/{id}/result")).await;
    (answer.status, answer.json)
}

/// Returns the number of requests in `/metrics`, summed over the series whose labels contain all these words.
async fn requests(service: &Service, labels: &[&str]) -> f64 {
    let text = service.ask("/metrics").await.text;
    let series = text.lines().filter(|line| {
        line.starts_with("railhead_result_store_requests_total")
            && labels.iter().all(|label| line.contains(label))
    });
    series
        .filter_map(|line| line.rsplit(' ').next()?.parse::<f64>().ok())
        .sum()
}

/// Asserts that a solution takes one request and the fields of one motion take two.
async fn assert_few_requests(service: &Service, id: &str) {
    let before = requests(service, &[]).await;
    assert_eq!(result(service, id).await.0, 200);
    let between = requests(service, &[]).await;
    let fields = format!("/v1/jobs/{id}/tractions?patch=0&point=3");
    service.get(&fields).await;
    let after = requests(service, &[]).await;
    assert!(
        between - before < 1.5 && after - between < 2.5,
        "{before}, {between}, {after}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn results_in_s3_survive_its_faults_and_are_read_at_every_node() {
    let (url, port) = (or_skip!(tables().await), or_skip!(server()));
    let way = FaultyServer::to(port).await;
    let faults = &way.faults;
    let port = way.address.port();
    let start = |role: &str| node_by(railhead_at(port), &url, role, &["--results-url", PLACE]);
    let [one, other, worker] = ["serve", "serve", "worker"].map(start);

    // With occasional faults, no client and no job is affected.
    faults.refused.store(4, Ordering::Relaxed);
    faults.cut.store(5, Ordering::Relaxed);
    let mut ids = Vec::new();
    for number in 0..4 {
        ids.push(one.submit(&large_case(&format!("case {number}"), 12)).await);
    }
    for id in &ids {
        let job = other.until(id, "succeeded").await;
        assert_eq!(job["attempt"], 1, "{job}");
        let (here, there) = (result(&one, id).await, result(&other, id).await);
        assert_eq!(here, there);
        assert!(here.0 == 200 && here.1["patches"].is_array(), "{here:?}");
        let fields = format!("/v1/jobs/{id}/tractions?patch=0&point=3");
        let parts = [one.get(&fields).await, other.get(&fields).await];
        assert!(parts[0] == parts[1] && parts[0].is_object());
    }
    assert!(faults.made.load(Ordering::Relaxed) > 5);
    let written = requests(&worker, &["PUT", "2xx"]).await;
    assert!(written >= 8.0, "{written}");
    assert!(requests(&one, &["GET"]).await > requests(&one, &["GET", "2xx"]).await);

    // With permanent faults, stored results are unavailable for the time being, and solved jobs wait.
    faults.refused.store(1, Ordering::Relaxed);
    let waiting = one.submit(&large_case("waiting", 12)).await;
    let answer = result(&other, &ids[0]).await;
    assert_eq!(
        (answer.0, &answer.1["type"]),
        (503, &json!("/problems/storage-unreachable"))
    );
    until("the result cannot be written", async || {
        worker.logged("could not be written yet") > 0
    })
    .await;
    faults.refused.store(0, Ordering::Relaxed);
    faults.cut.store(0, Ordering::Relaxed);
    let job = one.until(&waiting, "succeeded").await;
    assert_eq!(job["attempt"], 1, "{job}");
    assert_few_requests(&other, &waiting).await;

    let (well, said) = doctor(port, &url, PLACE);
    assert!(well && said.contains("written, read and removed"), "{said}");
    assert!(!doctor(port, &url, "s3://results/of/others").0);
}
