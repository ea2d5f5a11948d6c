//! Tests access with keys to resources of the same tenant and of other tenants.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use railhead::contact;
use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::runs::{columns, template};
use crate::server::{Answer, Server, Setup, example};
use crate::support::{case, loaded};

#[tokio::test]
async fn without_a_good_key_there_is_no_answer() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let server = &guarded.server;
    let half = &guarded.north[..guarded.north.len() - 1];
    let (id, _) = guarded.north[3..].split_once('_').unwrap();
    let others_secret = format!("rh_{id}_{}", guarded.south.rsplit('_').next().unwrap());
    for header in [
        None,
        Some(String::new()),
        Some("Bearer".to_owned()),
        Some("Basic YTpi".to_owned()),
        Some("Bearer rh_".to_owned()),
        Some("Bearer rh_000000000000_00".to_owned()),
        Some(format!("Bearer {half}")),
        Some(format!("Bearer {others_secret}")),
        Some(format!("Bearer {}0", guarded.north)),
    ] {
        for path in ["/v1/jobs", "/v1/jobs/x/result", "/metrics"] {
            let answer = server
                .send(Method::GET, path, |request| match &header {
                    Some(header) => request.header("authorization", header),
                    None => request,
                })
                .await;
            assert_problem(&answer, 401, "unauthorized", "");
            let scheme = answer.header("www-authenticate").unwrap_or_default();
            assert!(scheme.starts_with("Bearer"), "{header:?}: {scheme}");
        }
    }
    for open in [
        "/healthz",
        "/readyz",
        "/openapi.json",
        "/problems",
        "/v1/methods",
        "/v1/remarks",
    ] {
        assert_eq!(server.get(open).await.status, 200, "{open}");
    }
    assert_eq!(guarded.get(&guarded.north, "/v1/jobs").await.status, 200);
    let lower = |request: reqwest::RequestBuilder| {
        request.header("authorization", format!("bearer {}", guarded.north))
    };
    let answer = server.send(Method::GET, "/v1/jobs", lower).await;
    assert_eq!(answer.status, 200, "the case of the scheme does not matter");
}

#[tokio::test]
async fn a_bad_key_is_refused_also_where_none_is_needed() {
    let server = Server::idle().await;
    let answer = server
        .send(Method::GET, "/v1/jobs", |request| {
            request.bearer_auth("rh_000000000000_00")
        })
        .await;
    assert_problem(&answer, 401, "unauthorized", "not known");
}

/// A job id that does not exist.
const NOBODY: &str = "01890000-0000-7000-8000-000000000000";

/// Returns method and path of every operation of the contract on one job, batch or run with this id.
fn operations_on(kind: &str, id: &str) -> Vec<(Method, String)> {
    let contract: Value = serde_json::from_str(&railhead::http::openapi_json()).unwrap();
    let prefix = format!("/v1/{kind}/{{id}}");
    let paths = contract["paths"].as_object().unwrap().iter();
    let mut found = Vec::new();
    for (path, item) in paths.filter(|(path, _)| path.starts_with(&prefix)) {
        for method in [Method::GET, Method::POST, Method::DELETE] {
            if item.get(method.as_str().to_lowercase()).is_some() {
                found.push((method, path.replace("{id}", id)));
            }
        }
    }
    assert!(found.len() >= 3, "{found:?}");
    found
}

/// Asserts that requests for resources of another tenant and for unknown ids have the same answer.
async fn assert_foreign_is_unknown(
    guarded: &Guarded,
    key: &str,
    foreign: Vec<(Method, String)>,
    unknown: Vec<(Method, String)>,
) {
    for ((method, foreign), (_, unknown)) in foreign.into_iter().zip(unknown) {
        let what = format!("{method} {foreign}");
        let foreign = guarded.send(key, method.clone(), &foreign, None).await;
        let unknown = guarded.send(key, method, &unknown, None).await;
        assert_eq!(foreign.status, 404, "{what}: {}", foreign.text);
        let told = |answer: &Answer| {
            let mut problem = answer.json.clone();
            problem.as_object_mut().unwrap().remove("instance");
            problem
        };
        assert_eq!(told(&foreign), told(&unknown), "{what}");
    }
}

/// The key of another tenant gives no access. A key of the same tenant that is bound to another label gives none either.
#[tokio::test]
async fn what_belongs_to_others_is_answered_like_what_does_not_exist() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let (north, south) = (&guarded.north, &guarded.south);
    let rows = json!({ "template": template("table"), "columns": columns(3) });
    for (kind, body) in [
        ("jobs", case("north's")),
        ("batches", json!([case("n1"), loaded(50_000)])),
        ("runs", rows),
        ("evolutions", crate::evolutions::request(1)),
    ] {
        let list = format!("/v1/{kind}");
        let made = guarded.post(north, &list, &body).await;
        let path = made.is(202).location();
        let id = path.rsplit('/').next().unwrap();
        if kind != "evolutions" {
            guarded.until_ended(north, &path).await;
        }
        for key in [south, &guarded.line_7] {
            let (foreign, unknown) = (operations_on(kind, id), operations_on(kind, NOBODY));
            assert_foreign_is_unknown(&guarded, key, foreign, unknown).await;
            let seen = guarded.get(key, &list).await;
            assert_eq!(seen.json[kind], json!([]), "{kind}");
        }
        // The refused requests changed nothing.
        assert_eq!(guarded.get(north, &path).await.status, 200);
        if kind == "batches" {
            for query in ["state=succeeded", "label=line:A12", &format!("batch={id}")] {
                let list = format!("/v1/jobs?{query}");
                let seen = async |key: &str| {
                    let page = guarded.get(key, &list).await.is(200).json;
                    page["jobs"].as_array().unwrap().len()
                };
                assert!(seen(north).await >= 2, "{list}");
                assert_eq!(seen(south).await, 0, "{list}");
            }
        }
    }
    let page = guarded.get(north, "/v1/jobs?limit=1").await.json;
    let cursor = page["next_cursor"].as_str().unwrap();
    let path = format!("/v1/jobs?limit=1&cursor={cursor}");
    assert_eq!(guarded.get(south, &path).await.json["jobs"], json!([]));

    let mut wheel_on_rail = example("wheel-rail.case.json");
    let rail = wheel_on_rail["contact"]["rail"].clone();
    let kept = guarded.post(north, "/v1/profiles", &rail);
    let kept = kept.await.json;
    let on = |digest: &str| {
        let path = format!("/v1/profiles/{digest}");
        vec![(Method::GET, path.clone()), (Method::DELETE, path)]
    };
    let digest = kept["digest"].as_str().expect("a digest");
    assert_foreign_is_unknown(&guarded, south, on(digest), on(&"0".repeat(64))).await;
    assert_eq!(guarded.get(north, &on(digest)[0].1).await.status, 200);
    let seen = guarded.get(south, "/v1/profiles").await;
    assert_eq!(seen.json["profiles"], json!([]));
    wheel_on_rail["contact"]["rail"] = json!({ "profile": digest });
    let named = guarded.post(south, "/v1/jobs", &wheel_on_rail);
    assert_problem(&named.await, 422, "faulty-case", "fault");
}

#[tokio::test]
async fn tenants_share_neither_results_nor_idempotency_keys() {
    let solves = Arc::new(AtomicUsize::new(0));
    let counter = solves.clone();
    let setup = Setup::new().solving(move |problem, monitor| {
        counter.fetch_add(1, Ordering::SeqCst);
        contact::solve(problem, monitor)
    });
    let guarded = Guarded::start(setup, |_| {}).await;
    let mut jobs = BTreeSet::new();
    for (round, cached) in [(1, false), (2, true)] {
        for key in [&guarded.north, &guarded.south] {
            let path = guarded.submit(key, &case("the same")).await;
            assert_eq!(
                guarded.until_ended(key, &path).await["cached"],
                cached,
                "{round}"
            );
        }
    }
    assert_eq!(solves.load(Ordering::SeqCst), 2, "one per tenant");
    for key in [&guarded.north, &guarded.south] {
        for _ in 0..2 {
            let keyed = |request: reqwest::RequestBuilder| {
                let request = request.bearer_auth(key).header("idempotency-key", "k");
                request.json(&case("keyed"))
            };
            let answer = guarded.server.send(Method::POST, "/v1/jobs", keyed).await;
            jobs.insert(answer.location());
        }
    }
    assert_eq!(jobs.len(), 2);
}

#[tokio::test]
async fn figures_of_the_whole_service_are_for_the_operator() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let answer = guarded.get(&guarded.north, "/metrics").await;
    assert_problem(&answer, 403, "forbidden", "operator");
    let answer = guarded.get(&guarded.operator, "/metrics").await.is(200);
    assert!(!answer.text.contains("north"), "no tenant is named");
}

/// Every path of the contract with a parameter names a job, batch, run, evolution or profile, or concerns no tenant. All operations on the former
/// are tested below.
#[test]
fn whatever_has_an_id_belongs_to_something_of_a_tenant() {
    let contract: Value = serde_json::from_str(&railhead::http::openapi_json()).unwrap();
    let paths = contract["paths"].as_object().unwrap().keys();
    let others: Vec<&String> = paths
        .filter(|path| path.contains('{'))
        .filter(|path| {
            let tried = [
                "jobs/{id}",
                "batches/{id}",
                "runs/{id}",
                "evolutions/{id}",
                "profiles/{digest}",
            ];
            !tried
                .iter()
                .any(|tried| path.starts_with(&format!("/v1/{tried}")))
        })
        .collect();
    assert_eq!(
        others,
        ["/problems/{name}"],
        "give the new ones a test of foreign keys"
    );
}
