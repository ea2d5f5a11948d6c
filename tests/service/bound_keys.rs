//! Tests keys that are bound to labels: pages of every list, events, templates and profiles.

use std::collections::BTreeSet;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::runs::{columns, template};
use crate::server::{Setup, example};
use crate::support::case;

/// Creates a job, a batch or a run of the tenant with this label. Returns its id.
async fn make(guarded: &Guarded, list: &str, number: usize, label: &str) -> String {
    let (path, body) = match list {
        "jobs" => {
            let mut case = case(&format!("job {number}"));
            case["labels"] = json!({ "line": label, "km": number.to_string() });
            ("/v1/jobs".to_owned(), case)
        }
        "batches" => {
            let path = format!("/v1/batches?label=line:{label}&label=km:{number}");
            (path, json!([case(&format!("batch {number}"))]))
        }
        _ => {
            let path = format!("/v1/runs?label=line:{label}&label=km:{number}");
            (
                path,
                json!({ "template": template("table"), "columns": columns(2) }),
            )
        }
    };
    let made = guarded.post(&guarded.north, &path, &body);
    made.await.is(202).json["id"]
        .as_str()
        .expect("an id")
        .to_owned()
}

/// Reads a whole list with one entry per page and returns the ids.
async fn ids(guarded: &Guarded, key: &str, list: &str, filter: &str) -> Vec<String> {
    let mut ids = Vec::new();
    let mut next = Some(format!("/v1/{list}?limit=1{filter}"));
    while let Some(path) = next {
        let page = guarded.get(key, &path).await;
        assert_eq!(page.status, 200, "{path}: {}", page.text);
        let entries = page.json[list].as_array().expect("entries").iter();
        ids.extend(entries.map(|entry| entry["id"].as_str().expect("an id").to_owned()));
        let cursor = page.json["next_cursor"].as_str();
        next = cursor.map(|cursor| format!("/v1/{list}?limit=1{filter}&cursor={cursor}"));
        assert!(ids.len() < 20, "the list ends");
    }
    ids
}

#[tokio::test]
async fn a_bound_key_turns_the_pages_of_its_own_part_of_every_list() {
    let guarded = Guarded::start(Setup::idle(), |_| {}).await;
    for list in ["jobs", "batches", "runs"] {
        let mut own = BTreeSet::new();
        for number in 0..4 {
            own.insert(make(&guarded, list, number, "7").await);
            make(&guarded, list, number, "8").await;
        }
        let set = |ids: Vec<String>| ids.into_iter().collect::<BTreeSet<_>>();
        let seen = ids(&guarded, &guarded.line_7, list, "").await;
        assert_eq!(seen.len(), 4, "{list}: each once");
        assert_eq!(set(seen), own, "{list}");
        for filter in ["&label=line:7", "&label=km:2", "&label=km:2&label=line:7"] {
            let mut all = ids(&guarded, &guarded.north, list, filter).await;
            all.retain(|id| own.contains(id));
            let seen = ids(&guarded, &guarded.line_7, list, filter).await;
            assert_eq!(seen, all, "{list}{filter}");
            assert!(!seen.is_empty(), "{list}{filter}");
        }
        let foreign = ids(&guarded, &guarded.line_7, list, "&label=line:8").await;
        assert_eq!(foreign, Vec::<String>::new(), "{list}");
        // A cursor of the whole list is not valid for the restricted list.
        let page = guarded
            .get(&guarded.north, &format!("/v1/{list}?limit=1"))
            .await;
        let cursor = page.json["next_cursor"].as_str().expect("more");
        let path = format!("/v1/{list}?limit=1&cursor={cursor}");
        guarded.get(&guarded.line_7, &path).await.is(400);
    }
}

#[tokio::test]
async fn a_bound_key_hears_of_its_own_jobs_and_batches_alone() {
    let guarded = Guarded::start(Setup::idle(), |_| {}).await;
    let url = format!("http://{}/v1/events", guarded.server.address);
    let stream = reqwest::Client::new().get(url).bearer_auth(&guarded.line_7);
    let mut stream = stream.send().await.expect("an answer");
    let mut foreign = Vec::new();
    for list in ["jobs", "batches"] {
        foreign.push(make(&guarded, list, 1, "8").await);
        let own = make(&guarded, list, 1, "7").await;
        let mut text = String::new();
        while !text.contains(&own) {
            let piece = tokio::time::timeout(Duration::from_secs(60), stream.chunk());
            let piece = piece.await.expect("an event").expect("a piece");
            text.push_str(&String::from_utf8_lossy(&piece.expect("no end")));
        }
        for id in &foreign {
            assert!(!text.contains(id), "{text}");
        }
    }
}

#[tokio::test]
async fn a_bound_key_uses_profiles_by_their_digests_and_neither_lists_nor_deletes_them() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let (north, bound) = (&guarded.north, &guarded.line_7);
    let mut wheel_on_rail = example("wheel-rail.case.json");
    let rail = wheel_on_rail["contact"]["rail"].clone();
    let kept = guarded.post(north, "/v1/profiles", &rail).await;
    let path = kept.location();
    for (method, path) in [
        (Method::GET, "/v1/profiles"),
        (Method::DELETE, path.as_str()),
    ] {
        let refused = guarded.send(bound, method, path, None).await;
        assert_problem(&refused, 403, "forbidden", "line:7");
    }
    let read = guarded.get(bound, &path).await;
    assert_eq!((read.status, &read.json), (200, &rail));
    let wheel = wheel_on_rail["contact"]["wheel"].clone();
    let own = guarded.post(bound, "/v1/profiles", &wheel).await.is(201);
    wheel_on_rail["contact"]["rail"] = json!({ "profile": kept.json["digest"] });
    wheel_on_rail["contact"]["wheel"] = json!({ "profile": own.json["digest"] });
    let job = guarded.submit(bound, &wheel_on_rail).await;
    assert_eq!(guarded.get(bound, &job).await.status, 200);
    let listed = guarded.get(north, "/v1/profiles").await;
    let listed = listed.json["profiles"].as_array().map(Vec::len);
    assert_eq!(listed, Some(2), "nothing was deleted");
}

#[tokio::test]
async fn templates_of_another_tenant_or_line_are_not_found() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let foreign = make(&guarded, "jobs", 1, "8").await;
    let own = make(&guarded, "jobs", 1, "7").await;
    let (bound, south) = (&guarded.line_7, &guarded.south);
    for path in ["/v1/batches", "/v1/runs", "/v1/evaluate"] {
        for (key, template, refused) in [
            (bound, &foreign, true),
            (south, &foreign, true),
            (bound, &own, false),
        ] {
            let path = format!("{path}?template={template}");
            let table = "/friction/coefficient,creepage_x\n0.3,0.001\n";
            let answer = guarded.post_as(key, &path, "text/csv", table).await;
            assert_eq!(answer.status == 404, refused, "{path}: {}", answer.text);
        }
    }
}

#[tokio::test]
async fn a_bound_key_gives_its_label_to_what_it_makes() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let bound = &guarded.line_7;
    let post = async |path: &str, body: &Value| guarded.post(bound, path, body).await;
    let mut foreign = case("on a line");
    foreign["labels"] = json!({ "line": "8" });
    let mut own = foreign.clone();
    own["labels"] = json!({ "km": "12.4" });
    let refused = post("/v1/jobs", &foreign).await;
    assert_problem(&refused, 422, "faulty-case", "/labels/line");
    let cases = json!([foreign, own]);
    let batch = post("/v1/batches?on_invalid=skip", &cases).await;
    assert_eq!(batch.is(202).json["rejected"], 1);
    for key in [bound, &guarded.north] {
        let jobs = guarded.get(key, "/v1/jobs").await;
        let labels = &jobs.json["jobs"][0]["labels"];
        assert_eq!(*labels, json!({ "line": "7", "km": "12.4" }));
        let batches = guarded.get(key, "/v1/batches").await;
        assert_eq!(batches.json["batches"][0]["labels"], json!({ "line": "7" }));
    }
    let rows = json!({ "template": template("table"), "columns": columns(2) });
    let run = post("/v1/runs", &rows).await;
    assert_eq!(run.json["labels"], json!({ "line": "7" }), "{}", run.text);
    let me = guarded.get(bound, "/v1/me").await;
    assert_eq!(me.json["labels"], json!({ "line": "7" }));
}

/// A bound key that repeats the case and the idempotency key of a job of another line does not receive that job.
#[tokio::test]
async fn a_bound_key_is_not_answered_with_a_job_of_others() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let case = case("on a line");
    for (key, status) in [(&guarded.north, 202), (&guarded.line_7, 422)] {
        let shape = |request: reqwest::RequestBuilder| {
            let request = request.bearer_auth(key).header("idempotency-key", "k");
            request.json(&case)
        };
        let sent = guarded.server.send(Method::POST, "/v1/jobs", shape);
        sent.await.is(status);
    }
}
