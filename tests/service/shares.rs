//! How much of the service may one client take? Rates, quotas, turns.

use railhead::http::{HttpOptions, Peer};
use railhead::jobs::{Jobs, Options};
use reqwest::Method;
use serde_json::{Value, json};
use tower::ServiceExt;

use crate::errors::assert_problem;
use crate::guarded::{Guarded, loaded};
use crate::server::Setup;
use crate::support::{case, endless_case, pause};

#[tokio::test]
async fn a_key_that_asks_too_often_is_told_when_to_come_back() {
    let mut setup = Setup::new();
    setup.http.requests_per_second = 1;
    let guarded = Guarded::start(setup, |_| {}).await;
    let mut statuses = Vec::new();
    for _ in 0..6 {
        let answer = guarded.get(&guarded.north, "/v1/jobs").await;
        let left = answer.header("ratelimit").expect("what is left");
        assert_eq!(
            answer.header("ratelimit-policy"),
            Some("\"requests\";q=2;w=2")
        );
        if answer.status == 429 {
            assert_problem(&answer, 429, "too-many-requests", "");
            assert!(left.starts_with("\"requests\";r=0;t="), "{left}");
            let wait: u32 = answer.header("retry-after").unwrap().parse().unwrap();
            assert!((1..=2).contains(&wait), "{wait}");
        }
        statuses.push(answer.status);
    }
    assert_eq!(statuses[..2], [200, 200]);
    assert!(statuses.contains(&429), "{statuses:?}");
    assert_eq!(guarded.get(&guarded.south, "/v1/jobs").await.status, 200);
}

#[tokio::test]
async fn an_address_without_a_key_may_ask_so_often_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = Jobs::open(Options::new(folder.path())).await.unwrap();
    let options = HttpOptions {
        requests_per_second: 1,
        ..HttpOptions::default()
    };
    let router = railhead::http::router(jobs, options);
    let ask = async |address: &str| {
        let mut request = axum::http::Request::get("/v1/jobs")
            .header("host", "localhost")
            .body(axum::body::Body::empty())
            .unwrap();
        let peer = Peer(address.parse().unwrap());
        request.extensions_mut().insert(peer);
        let answer = router.clone().oneshot(request).await.unwrap();
        let later = answer.headers().contains_key("retry-after");
        (answer.status().as_u16(), later)
    };
    for _ in 0..2 {
        assert_eq!(ask("192.0.2.1").await, (200, false));
    }
    assert_eq!(ask("192.0.2.1").await, (429, true));
    assert_eq!(ask("192.0.2.2").await, (200, false), "somebody else");
    for _ in 0..9 {
        assert_eq!(ask("127.0.0.1").await, (200, false), "this machine");
    }
}

#[tokio::test]
async fn an_address_may_try_so_many_wrong_keys_and_no_more() {
    let folder = tempfile::tempdir().unwrap();
    let jobs = Jobs::open(Options::new(folder.path())).await.unwrap();
    let router = railhead::http::router(jobs, HttpOptions::default());
    let ask = async |address: &str| {
        let mut request = axum::http::Request::get("/v1/jobs")
            .header("host", "localhost")
            .header("authorization", "Bearer rh_0123456789ab_0")
            .body(axum::body::Body::empty())
            .unwrap();
        let peer = Peer(address.parse().unwrap());
        request.extensions_mut().insert(peer);
        let answer = router.clone().oneshot(request).await.unwrap();
        answer.status().as_u16()
    };
    let mut statuses = Vec::new();
    for _ in 0..30 {
        statuses.push(ask("192.0.2.1").await);
    }
    assert_eq!((statuses[0], statuses[29]), (401, 429), "{statuses:?}");
    assert_eq!(ask("192.0.2.2").await, 401, "somebody else");
}

#[tokio::test]
async fn a_tenant_may_have_so_many_queued_jobs_and_no_more() {
    let mut setup = Setup::new();
    setup.working = false;
    let guarded = Guarded::start(setup, |options| options.tenant_queue_max = 2).await;
    let (north, south) = (&guarded.north, &guarded.south);
    let first = guarded.submit(north, &case("1")).await;
    guarded.submit(north, &case("2")).await;
    for (path, body) in [("/v1/jobs", case("3")), ("/v1/batches", json!([case("3")]))] {
        let answer = guarded.send(north, Method::POST, path, Some(&body)).await;
        assert_problem(&answer, 429, "quota-exceeded", "2 jobs");
        assert!(answer.header("retry-after").is_some());
    }
    guarded.submit(south, &case("of another tenant")).await;
    let cancelled = guarded
        .send(north, Method::POST, &format!("{first}/cancel"), None)
        .await;
    assert_eq!(cancelled.status, 200);
    guarded.submit(north, &case("has room again")).await;
}

#[tokio::test]
async fn a_flood_of_one_tenant_does_not_hold_up_another() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let flood: Vec<Value> = (1..=3000).map(|number| loaded(1000 + number)).collect();
    let batch = guarded.batch(&guarded.north, &flood).await;
    let job = guarded.submit(&guarded.south, &case("one")).await;
    guarded.until_ended(&guarded.south, &job).await;
    let batch = guarded.get(&guarded.north, &batch).await.json;
    let waiting = batch["states"]["queued"].as_u64().unwrap();
    assert!(waiting > 1000, "the flood is still there: {batch}");
}

#[tokio::test]
async fn long_jobs_of_one_tenant_leave_the_next_turn_to_another() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let (north, south) = (&guarded.north, &guarded.south);
    let running = guarded.submit(north, &endless_case("runs")).await;
    while guarded.get(north, &running).await.json["state"] != "running" {
        pause().await;
    }
    let waiting = guarded.submit(north, &endless_case("was here first")).await;
    let job = guarded.submit(south, &case("came later")).await;
    guarded
        .send(north, Method::POST, &format!("{running}/cancel"), None)
        .await;
    assert_eq!(guarded.until_ended(south, &job).await["state"], "succeeded");
    guarded
        .send(north, Method::POST, &format!("{waiting}/cancel"), None)
        .await;
}
