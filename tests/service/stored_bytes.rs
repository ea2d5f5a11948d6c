//! Tests that stored bytes of a tenant are counted and limited, and that templates are stored once.

use railhead::jobs::store::{BatchBegun, NewBatch, QueueBounds};
use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::server::{Answer, Setup, example};
use crate::store::{StoreKind, Table, conformance, new_batch};
use crate::support::case;

/// Returns a case of about this many bytes, most of which are the points of its gap.
fn large(bytes: u32) -> Value {
    let mut case = example("paper-figure-3.case.json");
    let points = bytes / 16;
    let y = |point: u32| -12.0 + 24.0 * f64::from(point) / f64::from(points - 1);
    case["contact"]["gap_mm"] = (0..points).map(|point| y(point).powi(2) / 600.0).collect();
    case["contact"]["y_mm"] = (0..points).map(y).collect();
    case["motion"] = json!({ "creepage_x": 0.001 });
    case["outputs"] = json!(["resultants"]);
    case
}

async fn table(guarded: &Guarded, path: &str, rows: &str) -> Answer {
    let body = format!("creepage_x\n{rows}\n");
    guarded
        .post_as(&guarded.north, path, "text/csv", body)
        .await
}

async fn stored(guarded: &Guarded, key: &str) -> u64 {
    let me = guarded.get(key, "/v1/me").await.json;
    me["used"]["stored_bytes"].as_u64().unwrap()
}

#[tokio::test]
async fn a_template_is_stored_once_and_goes_with_its_last_user() {
    let guarded = Guarded::start(Setup::idle(), |_| {}).await;
    let key = &guarded.north;
    let template = large(15_000);
    let bytes = template.to_string().len() as u64;
    let job = guarded.submit(key, &template).await;
    let query = format!("?template={}", job.rsplit('/').next().unwrap());
    let before = stored(&guarded, key).await;
    assert!(before >= bytes, "{before}");
    let mut users = Vec::new();
    for (number, route) in ["/v1/runs", "/v1/batches"]
        .into_iter()
        .cycle()
        .take(20)
        .enumerate()
    {
        let answer = table(
            &guarded,
            &format!("{route}{query}"),
            &format!("0.00{number}"),
        )
        .await
        .is(202);
        users.push(answer.location());
    }
    let after = stored(&guarded, key).await;
    // The template is stored once for batches and once for runs.
    assert!(after - before < 3 * bytes, "{before} {after} {bytes}");
    for path in &users {
        assert_eq!(guarded.get(key, path).await.status, 200);
        guarded.cancel(key, path).await;
        guarded.send(key, Method::DELETE, path, None).await.is(204);
    }
    assert_eq!(stored(&guarded, key).await, before);
    assert_eq!(stored(&guarded, &guarded.south).await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn beyond_its_stored_bytes_a_tenant_submits_nothing_and_loses_nothing() {
    let guarded = Guarded::start(Setup::new(), |options| {
        options.tenant_stored_max_bytes = Some(60_000);
    })
    .await;
    let key = &guarded.north;
    let quota = guarded.get(key, "/v1/me").await.json["quota"].clone();
    assert_eq!(quota["stored_bytes"], 60_000);
    let mut paths = Vec::new();
    let refused = loop {
        let mut next = example("spin.case.json");
        next["outputs"] = json!(["resultants", "zones"]);
        next["motion"]["creepage_x"] = json!(1e-5 * paths.len() as f64);
        let answer = guarded.post(key, "/v1/jobs", &next).await;
        if answer.status != 202 {
            break answer;
        }
        let path = answer.location();
        guarded.until_ended(key, &path).await;
        paths.push(path);
        assert!(paths.len() < 100);
    };
    let refuse = |answer: &Answer| assert_problem(answer, 507, "stored-quota-exceeded", "60000");
    refuse(&refused);
    let first = paths[0].rsplit('/').next().unwrap();
    refuse(&table(&guarded, &format!("/v1/batches?template={first}"), "0.1").await);
    refuse(&table(&guarded, &format!("/v1/runs?template={first}"), "0.1").await);
    // Stored work remains, other tenants continue, and freed space can be used.
    for path in &paths {
        guarded.get(key, &format!("{path}/result")).await.is(200);
    }
    guarded
        .submit(&guarded.south, &case("of another tenant"))
        .await;
    for path in &paths {
        guarded.send(key, Method::DELETE, path, None).await;
    }
    assert_eq!(stored(&guarded, key).await, 0);
    guarded.submit(key, &case("afterwards")).await;
}

#[tokio::test]
async fn chunks_of_runs_count_for_their_tenant() {
    let guarded = Guarded::start(Setup::idle(), |options| options.tenant_queue_max = 3).await;
    let key = &guarded.north;
    let run = example("run.json");
    for used in 1..=2 {
        guarded.post(key, "/v1/runs", &run).await.is(202);
        let me = guarded.get(key, "/v1/me").await.json["used"].clone();
        assert_eq!(
            (&me["queued"], &me["jobs"]["queued"]),
            (&json!(used), &json!(used))
        );
    }
    guarded.submit(key, &case("the last")).await;
    for (path, body) in [("/v1/runs", &run), ("/v1/jobs", &case("too many"))] {
        let answer = guarded.post(key, path, body).await;
        assert_problem(&answer, 429, "quota-exceeded", "3 jobs");
    }
    guarded
        .submit(&guarded.south, &case("of another tenant"))
        .await;
}

async fn one_body_serves_all_batches_of_a_tenant_with_this_template(kind: StoreKind) {
    let table = Table::new(kind).await;
    let store = &table.store;
    let with_template = |tenant: &str| NewBatch {
        template: Some(vec![b'x'; 1000].into()),
        bytes: 10,
        ..new_batch(tenant, 1)
    };
    let mut begun = Vec::new();
    for tenant in ["north", "north", "north", "south"] {
        let batch = with_template(tenant);
        let done = store
            .begin_batch(&batch, &|_| false, QueueBounds::NONE)
            .await;
        assert_eq!(done.unwrap(), BatchBegun::Created);
        begun.push(batch.id);
    }
    let stored = async |tenant: &str| store.usage(tenant).await.unwrap().stored_bytes;
    assert_eq!((stored("north").await, stored("south").await), (1000, 1000));
    // The template is stored already. Another template, or one more byte of cases, would exceed the limit.
    let bounds = |stored| QueueBounds {
        stored: Some(stored),
        ..QueueBounds::NONE
    };
    let refused = store
        .begin_batch(&with_template("north"), &|_| false, bounds(1009))
        .await;
    assert!(matches!(refused.unwrap(), BatchBegun::Refused(_)));
    let fits = with_template("north");
    let done = store.begin_batch(&fits, &|_| false, bounds(1010)).await;
    assert_eq!(done.unwrap(), BatchBegun::Created);
    begun.push(fits.id);
    for id in begun {
        assert!(store.drop_batch(id, 9).await.unwrap());
    }
    assert_eq!((stored("north").await, stored("south").await), (0, 0));
}

conformance!(one_body_serves_all_batches_of_a_tenant_with_this_template);
