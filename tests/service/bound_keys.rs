//! Keys that are bound to labels: every kind of list page by page, events, templates and profiles.

use std::collections::BTreeSet;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::guarded::Guarded;
use crate::runs::{columns, template};
use crate::server::{Setup, example};
use crate::support::case;

/// A job, a batch or a run of the tenant with this label; its id.
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
    let made = guarded
        .send(&guarded.north, Method::POST, &path, Some(&body))
        .await;
    assert_eq!(made.status, 202, "{}", made.text);
    made.json["id"].as_str().expect("an id").to_owned()
}

/// The ids of a whole list, one entry a page.
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
    let mut setup = Setup::new();
    setup.working = false;
    let guarded = Guarded::start(setup, |_| {}).await;
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
        // A cursor of the whole list is none of the narrowed one.
        let page = guarded
            .get(&guarded.north, &format!("/v1/{list}?limit=1"))
            .await;
        let cursor = page.json["next_cursor"].as_str().expect("more");
        let path = format!("/v1/{list}?limit=1&cursor={cursor}");
        let refused = guarded.get(&guarded.line_7, &path).await;
        assert_eq!(refused.status, 400, "{}", refused.text);
    }
}

#[tokio::test]
async fn a_bound_key_hears_of_its_own_jobs_and_batches_alone() {
    let mut setup = Setup::new();
    setup.working = false;
    let guarded = Guarded::start(setup, |_| {}).await;
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
    let kept = guarded
        .send(north, Method::POST, "/v1/profiles", Some(&rail))
        .await;
    let path = kept.header("location").expect("a path").to_owned();
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
    let own = guarded
        .send(bound, Method::POST, "/v1/profiles", Some(&wheel))
        .await;
    assert_eq!(own.status, 201, "{}", own.text);
    wheel_on_rail["contact"]["rail"] = json!({ "profile": kept.json["digest"] });
    wheel_on_rail["contact"]["wheel"] = json!({ "profile": own.json["digest"] });
    let job = guarded.submit(bound, &wheel_on_rail).await;
    assert_eq!(guarded.get(bound, &job).await.status, 200);
    let listed = guarded.get(north, "/v1/profiles").await;
    let listed = listed.json["profiles"].as_array().map(Vec::len);
    assert_eq!(listed, Some(2), "nothing was deleted");
}

#[tokio::test]
async fn a_bound_key_takes_no_template_of_others() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let foreign = make(&guarded, "jobs", 1, "8").await;
    let own = make(&guarded, "jobs", 1, "7").await;
    for path in ["/v1/batches", "/v1/runs", "/v1/evaluate"] {
        for (template, refused) in [(&foreign, true), (&own, false)] {
            let path = format!("{path}?template={template}");
            let shape = |request: reqwest::RequestBuilder| {
                let request = request.bearer_auth(&guarded.line_7);
                let request = request.header("content-type", "text/csv");
                request.body(
                    "friction_coefficient,creepage_x\n0.3,0.001\n"
                        .replace("friction_coefficient", "/friction/coefficient"),
                )
            };
            let answer = guarded.server.send(Method::POST, &path, shape).await;
            assert_eq!(answer.status == 404, refused, "{path}: {}", answer.text);
        }
    }
}

#[tokio::test]
async fn usage_tells_the_labels_of_a_bound_key() {
    let guarded = Guarded::start(Setup::new(), |_| {}).await;
    let me: Value = guarded.get(&guarded.line_7, "/v1/me").await.json;
    assert_eq!(me["labels"], json!({ "line": "7" }));
}
