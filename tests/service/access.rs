//! Who may do what? Tenants, quotas, rates, turns.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use railhead::contact;
use railhead::http::{HttpOptions, Peer};
use railhead::jobs::keys::keyring::Keyring;
use railhead::jobs::{Jobs, Options};
use reqwest::Method;
use serde_json::{Value, json};
use tower::ServiceExt;

use crate::errors::assert_problem;
use crate::server::{Answer, Server, Setup};
use crate::support::{case, endless_case, pause};

/// A service with keys of two tenants and of the operator.
struct Guarded {
    server: Server,
    north: String,
    south: String,
    operator: String,
}

impl Guarded {
    async fn start(mut setup: Setup, change: impl FnOnce(&mut Options)) -> Guarded {
        change(&mut setup.options);
        setup.http.anonymous = false;
        let keys = Keyring::open(&setup.options.data_dir).await.unwrap();
        let make = async |tenant: &str| keys.create(tenant, None).await.unwrap().1;
        let (north, south) = (make("north").await, make("south").await);
        let operator = make("operator").await;
        let server = setup.start().await;
        Guarded {
            server,
            north,
            south,
            operator,
        }
    }

    async fn send(&self, key: &str, method: Method, path: &str, body: Option<&Value>) -> Answer {
        let shape = |request: reqwest::RequestBuilder| {
            let request = request.bearer_auth(key);
            match body {
                Some(body) => request.json(body),
                None => request,
            }
        };
        self.server.send(method, path, shape).await
    }

    async fn get(&self, key: &str, path: &str) -> Answer {
        self.send(key, Method::GET, path, None).await
    }

    async fn submit(&self, key: &str, case: &Value) -> String {
        let answer = self.send(key, Method::POST, "/v1/jobs", Some(case)).await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        answer.header("location").unwrap().to_owned()
    }

    async fn batch(&self, key: &str, cases: &[Value]) -> String {
        let cases = json!(cases);
        let answer = self
            .send(key, Method::POST, "/v1/batches", Some(&cases))
            .await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        answer.header("location").unwrap().to_owned()
    }

    async fn until_ended(&self, key: &str, path: &str) -> Value {
        loop {
            let job = self.get(key, path).await.json;
            if job["state"] != "queued" && job["state"] != "running" {
                return job;
            }
            pause().await;
        }
    }
}

fn loaded(newtons: u32) -> Value {
    let mut case = case("one of many");
    case["load"]["normal_force_n"] = json!(newtons);
    case
}

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

/// Every operation on one job or batch that the contract has, with the id put in.
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

#[tokio::test]
async fn what_belongs_to_another_tenant_is_answered_like_what_does_not_exist() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let (north, south) = (&guarded.north, &guarded.south);
    let job = guarded.submit(north, &case("north's")).await;
    let batch = guarded.batch(north, &[case("n1"), loaded(50_000)]).await;
    assert_eq!(guarded.until_ended(north, &job).await["state"], "succeeded");
    let results = guarded
        .get(north, &format!("{batch}/results?wait=60"))
        .await;
    assert_eq!(results.text.lines().count(), 2);

    let nobody = "01890000-0000-7000-8000-000000000000";
    for (kind, path) in [("jobs", &job), ("batches", &batch)] {
        let id = path.rsplit('/').next().unwrap();
        for ((method, foreign), (_, unknown)) in operations_on(kind, id)
            .into_iter()
            .zip(operations_on(kind, nobody))
        {
            let foreign = guarded.send(south, method.clone(), &foreign, None).await;
            let unknown = guarded.send(south, method.clone(), &unknown, None).await;
            assert_eq!(foreign.status, 404, "{method} {kind}: {}", foreign.text);
            let told = |answer: &Answer| {
                let mut problem = answer.json.clone();
                problem.as_object_mut().unwrap().remove("instance");
                problem
            };
            assert_eq!(told(&foreign), told(&unknown));
        }
    }
    // Nothing of what was tried has touched them.
    assert_eq!(
        guarded.get(north, &format!("{job}/result")).await.status,
        200
    );
    let batch_id = batch.rsplit('/').next().unwrap();
    for list in [
        "/v1/jobs".to_owned(),
        "/v1/jobs?state=succeeded".to_owned(),
        "/v1/jobs?label=line:A12".to_owned(),
        "/v1/jobs?label=line:A12&state=succeeded".to_owned(),
        format!("/v1/jobs?batch={batch_id}"),
    ] {
        let seen = async |key: &str| {
            let page = guarded.get(key, &list).await;
            assert_eq!(page.status, 200, "{list}: {}", page.text);
            page.json["jobs"].as_array().unwrap().len()
        };
        assert!(seen(north).await >= 2, "{list}");
        assert_eq!(seen(south).await, 0, "{list}");
    }
    let page = guarded.get(north, "/v1/jobs?limit=1").await.json;
    let cursor = page["next_cursor"].as_str().unwrap();
    let page = guarded
        .get(south, &format!("/v1/jobs?limit=1&cursor={cursor}"))
        .await;
    assert_eq!(page.json["jobs"], json!([]));
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
            jobs.insert(answer.header("location").unwrap().to_owned());
        }
    }
    assert_eq!(jobs.len(), 2);
}

#[tokio::test]
async fn figures_of_the_whole_service_are_for_the_operator() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let answer = guarded.get(&guarded.north, "/metrics").await;
    assert_problem(&answer, 403, "forbidden", "operator");
    let answer = guarded.get(&guarded.operator, "/metrics").await;
    assert_eq!(answer.status, 200);
    assert!(!answer.text.contains("north"), "no tenant is named");
}

#[tokio::test]
async fn a_key_that_asks_too_often_is_told_when_to_come_back() {
    let mut setup = Setup::new();
    setup.http.requests_per_second = 1;
    let guarded = Guarded::start(setup, |_| {}).await;
    let mut statuses = Vec::new();
    for _ in 0..6 {
        let answer = guarded.get(&guarded.north, "/v1/jobs").await;
        if answer.status == 429 {
            assert_problem(&answer, 429, "too-many-requests", "");
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

/// Every path of the contract with a parameter belongs to a job or a batch, whose operations are all tried below, or
/// concerns no tenant.
#[test]
fn whatever_has_an_id_belongs_to_a_job_or_a_batch() {
    let contract: Value = serde_json::from_str(&railhead::http::openapi_json()).unwrap();
    let paths = contract["paths"].as_object().unwrap().keys();
    let others: Vec<&String> = paths
        .filter(|path| path.contains('{'))
        .filter(|path| !path.starts_with("/v1/jobs/{id}") && !path.starts_with("/v1/batches/{id}"))
        .collect();
    assert_eq!(
        others,
        ["/problems/{name}"],
        "give the new ones a test of foreign keys"
    );
}

#[tokio::test]
async fn ids_of_another_tenant_open_nothing_by_other_ways_either() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let (north, south) = (&guarded.north, &guarded.south);
    let path = guarded.submit(north, &case("north's")).await;
    guarded.until_ended(north, &path).await;
    let job = path.rsplit('/').next().unwrap();
    for query in [
        "tractions?format=npz",
        "tractions?grid=5x5&format=csv",
        "zones?format=vtk",
        "pressure?patch=7",
        "plot.svg?field=traction",
        "plot.png?width=300",
        "resultants?format=csv",
    ] {
        let answer = guarded.get(south, &format!("{path}/{query}")).await;
        assert_problem(&answer, 404, "job-not-found", "");
    }
    let tag = guarded.get(north, &format!("{path}/result")).await;
    let tag = tag.header("etag").unwrap().to_owned();
    for (name, value) in [("last-event-id", "3"), ("if-none-match", &tag)] {
        let part = if name == "if-none-match" {
            "result"
        } else {
            "events"
        };
        let shape =
            |request: reqwest::RequestBuilder| request.bearer_auth(south).header(name, value);
        let answer = guarded
            .server
            .send(Method::GET, &format!("{path}/{part}"), shape)
            .await;
        assert_problem(&answer, 404, "job-not-found", "");
    }
    let batches = format!("/v1/batches?template={job}");
    let table = async |key: &str| {
        let shape = |request: reqwest::RequestBuilder| {
            let request = request.bearer_auth(key).header("content-type", "text/csv");
            request.body("name\nx\n")
        };
        guarded.server.send(Method::POST, &batches, shape).await
    };
    assert_problem(&table(south).await, 404, "job-not-found", "");
    assert_eq!(table(north).await.status, 202);
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
