//! Tests shares of tenants: rates, quotas, scheduling.

use std::str::FromStr;

use axum::response::Response;
use railhead::http::{AddressRange, HttpOptions, Peer};
use railhead::jobs::{Jobs, Options};
use reqwest::Method;
use serde_json::{Value, json};
use tower::ServiceExt;

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::server::Setup;
use crate::support::{case, endless_case, loaded, pause};

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
        let answer = ask(&router, address, None).await;
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

/// Sends a request from this address, with a key if one is given.
async fn ask(router: &axum::Router, address: &str, key: Option<&str>) -> Response {
    let mut request = axum::http::Request::get("/v1/jobs").header("host", "localhost");
    if let Some(key) = key {
        request = request.header("authorization", format!("Bearer {key}"));
    }
    let mut request = request.body(axum::body::Body::empty()).unwrap();
    let peer = Peer(address.parse().unwrap());
    request.extensions_mut().insert(peer);
    router.clone().oneshot(request).await.unwrap()
}

async fn with_key(router: &axum::Router, address: &str, key: &str) -> u16 {
    ask(router, address, Some(key)).await.status().as_u16()
}

/// A key that does not exist.
const WRONG: &str = "rh_0123456789ab_0";

#[tokio::test]
async fn wrong_keys_lock_no_good_key_of_the_same_address_out() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let router = railhead::http::router(guarded.server.jobs.clone(), HttpOptions::default());
    let mut last = 0;
    for round in 0..100 {
        last = with_key(&router, "192.0.2.1", WRONG).await;
        let good = [&guarded.north, &guarded.south][round % 2];
        assert_eq!(with_key(&router, "192.0.2.1", good).await, 200, "{round}");
    }
    assert_eq!(last, 429);
    // A key that was not used before is accepted too, even with many concurrent look-ups.
    let wrong = (0..50).map(|_| with_key(&router, "192.0.2.1", WRONG));
    let wrong = futures_util::future::join_all(wrong);
    let good = with_key(&router, "192.0.2.1", &guarded.operator);
    let (wrong, good) = tokio::join!(wrong, good);
    assert_eq!((wrong, good), (vec![429; 50], 200));
}

#[tokio::test]
async fn clients_behind_a_trusted_proxy_are_counted_one_by_one() {
    let mut setup = Setup::new();
    setup.http.trusted_proxies = [AddressRange::from_str("127.0.0.0/8").unwrap()].into();
    setup.http.requests_per_second = 1;
    let proxied = Guarded::start(setup, |_| {}).await;
    let ask = async |guarded: &Guarded, header: (&'static str, &'static str), key: &str| {
        let shape =
            |request: reqwest::RequestBuilder| request.bearer_auth(key).header(header.0, header.1);
        let answer = guarded.server.send(Method::GET, "/v1/me", shape).await;
        answer.status
    };
    let told = ("x-forwarded-for", "192.0.2.1");
    let mut statuses = Vec::new();
    for _ in 0..25 {
        statuses.push(ask(&proxied, told, WRONG).await);
    }
    assert_eq!((statuses[0], statuses[24]), (401, 429), "{statuses:?}");
    let same = ("forwarded", "for=192.0.2.1;proto=https");
    assert_eq!(ask(&proxied, same, WRONG).await, 429);
    let other = ("x-forwarded-for", "192.0.2.1, 192.0.2.2");
    assert_eq!(ask(&proxied, other, WRONG).await, 401);
    assert_eq!(ask(&proxied, told, &proxied.north).await, 200);

    // The header is ignored if it does not come from a trusted proxy.
    let direct = Guarded::start(Setup::new(), |_| {}).await;
    for _ in 0..25 {
        assert_eq!(ask(&direct, told, WRONG).await, 401);
    }
}

#[tokio::test]
async fn a_flood_of_one_tenant_does_not_hold_up_another() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let flood: Vec<Value> = (1..=1000).map(|number| loaded(1000 + number)).collect();
    let batch = guarded
        .post(&guarded.north, "/v1/batches", &json!(flood))
        .await;
    let batch = batch.is(202).location();
    let job = guarded.submit(&guarded.south, &case("one")).await;
    guarded.until_ended(&guarded.south, &job).await;
    let batch = guarded.get(&guarded.north, &batch).await.json;
    let waiting = batch["states"]["queued"].as_u64().unwrap();
    assert!(waiting > 300, "the flood is still there: {batch}");
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
    guarded.cancel(north, &running).await;
    assert_eq!(guarded.until_ended(south, &job).await["state"], "succeeded");
    guarded.cancel(north, &waiting).await;
}
