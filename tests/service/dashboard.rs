//! Tests data for a dashboard: lists, batches, the event stream of a tenant, its identity.

use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};

use crate::batches::{small, small_loaded as case};
use crate::errors::assert_problem;
use crate::events::Reader;
use crate::evolutions::request as evolution;
use crate::results::path_of;
use crate::server::{Server, count, example, link};

#[tokio::test]
async fn a_list_is_narrowed_counted_and_not_sent_twice() {
    let server = Server::idle().await;
    for number in 0..4 {
        let mut crown = case(&format!("Crown {number}"), 50_000 + number);
        crown["labels"] = json!({ "time": "12:30" });
        server.submit(&crown).await;
    }
    let own = server.submit(&case("to be cancelled", 60_000)).await;
    let cancelled = own.rsplit('/').next().expect("an id");
    let path = format!("{own}/cancel");
    server.send(Method::POST, &path, |request| request).await;
    let all = server.get("/v1/jobs?limit=2").await;
    assert_eq!(all.json["total"], 5);
    assert_eq!(all.json["total_at_least"], Value::Null);
    let two = server
        .read("/v1/jobs?state=queued&state=cancelled&name=CROWN")
        .await;
    assert_eq!(count(&two["jobs"]), 4);
    assert_eq!(two["total_at_least"], 4);
    // Only the first colon of a label separates key and value. The `+` of an offset is written as `%2B`.
    for (query, expected) in [
        ("label=time:12:30", 4),
        ("label=time:12:30&state=cancelled", 0),
        ("created_after=2000-01-01T00:00:00%2B02:00", 5),
        ("created_before=2001-01-01T00:00:00Z", 0),
    ] {
        let found = server.read(&format!("/v1/jobs?{query}")).await;
        assert_eq!(count(&found["jobs"]), expected, "{query}");
    }
    let slim = server
        .read("/v1/jobs?fields=id,state&state=cancelled")
        .await;
    assert_eq!(
        slim["jobs"],
        json!([{ "id": cancelled, "state": "cancelled" }])
    );
    let since = server.read(&own).await["updated_at"].clone();
    let changed = format!("/v1/jobs?updated_after={}", since.as_str().expect("a time"));
    let changed = server.read(&changed).await;
    assert_eq!(changed["jobs"][0]["id"], cancelled);
    let tag = all.header("etag").expect("a tag").to_owned();
    let again = |request: reqwest::RequestBuilder| request.header("if-none-match", tag);
    let again = server.send(Method::GET, "/v1/jobs?limit=2", again).await;
    assert_eq!((again.status, again.bytes.len()), (304, 0));
    for (query, word) in [
        ("fields=colour", "fields"),
        ("state=new", "state"),
        ("label=x", "label"),
        ("name=", "name"),
    ] {
        let answer = server.get(&format!("/v1/jobs?{query}")).await;
        assert_problem(&answer, 400, "bad-query", word);
    }
}

#[tokio::test]
async fn batches_have_names_and_labels_and_are_listed() {
    let server = Server::start().await;
    let cases = json!([case("a", 50_001), case("b", 50_002)]);
    let path = "/v1/batches?name=Timetable%202026&label=line:A12&label=km:37.2";
    let batch = server.post(path, &cases).await.json;
    let own = link(&batch, "self").to_owned();
    server.get(&format!("{own}/results?wait=60")).await;
    let shown = server.read(&own).await;
    assert_eq!(shown["name"], "Timetable 2026");
    assert_eq!(shown["labels"], json!({ "line": "A12", "km": "37.2" }));
    assert_eq!(
        (&shown["state"], shown["ended_at"].is_string()),
        (&json!("ended"), true)
    );
    server
        .post("/v1/batches", &json!([case("c", 50_003)]))
        .await;
    let all = server.read("/v1/batches").await;
    assert_eq!(
        (all["batches"].as_array().map(Vec::len), &all["total"]),
        (Some(2), &json!(2))
    );
    assert_eq!(all["batches"][1], shown);
    for query in [
        "name=timetable",
        "label=line:A12",
        "label=line:A12&label=km:37.2",
    ] {
        let found = server.read(&format!("/v1/batches?{query}")).await;
        assert_eq!(found["batches"], json!([shown]), "{query}");
    }
    let page = server.get("/v1/batches?limit=1").await;
    let cursor = page.json["next_cursor"].as_str().expect("a cursor");
    let link = format!("</v1/batches?limit=1&cursor={cursor}>; rel=\"next\"");
    assert_eq!(page.header("link"), Some(link.as_str()));
    let next = server
        .read(&format!("/v1/batches?limit=1&cursor={cursor}"))
        .await;
    assert_eq!(
        (&next["batches"], &next["next_cursor"]),
        (&json!([shown]), &Value::Null)
    );
    for query in ["label=a:1&label=a:2", "label=nocolon", "name=%0A"] {
        let answer = server.post(&format!("/v1/batches?{query}"), &cases).await;
        assert_problem(&answer, 400, "bad-query", "");
    }
}

#[tokio::test]
async fn a_client_learns_who_it_is_and_what_it_uses() {
    let server = Server::idle().await;
    server.submit(&small("one")).await;
    let me = server.read("/v1/me").await;
    assert_eq!(me["tenant"], "anonymous");
    assert_eq!(me["used"]["queued"], 1);
    assert_eq!(
        me["used"]["jobs"],
        json!({ "queued": 1, "running": 0, "succeeded": 0, "failed": 0, "cancelled": 0 })
    );
    let methods = server.read("/v1/methods").await;
    assert_eq!(me["quota"]["queued"], methods["limits"]["queue_max"]);
    assert_eq!(
        me["limits"]["streams_max"],
        methods["limits"]["streams_max"]
    );
}

#[tokio::test]
async fn a_job_and_its_result_can_be_waited_for() {
    let server = Server::start().await;
    let own = server.submit(&example("spin.case.json")).await;
    let waiting = |request: reqwest::RequestBuilder| request.header("prefer", "wait=60");
    let paths = [format!("{own}/result"), own];
    let (result, job) = tokio::join!(
        server.send(Method::GET, &paths[0], waiting),
        server.send(Method::GET, &paths[1], waiting)
    );
    assert_eq!(
        (result.status, &job.json["state"]),
        (200, &json!("succeeded"))
    );
    assert!(result.json["patches"].is_array());
    for answer in [&result, &job] {
        assert_eq!(answer.header("preference-applied"), Some("wait=60"));
    }
}

#[tokio::test]
async fn one_stream_tells_all_work_and_goes_on_where_it_was() {
    let server = Server::start().await;
    let before = server.solve(&case("before", 70_000)).await["id"].clone();
    tokio::time::sleep(Duration::from_millis(2_100)).await;
    let mut events = Reader::open(&server, "/v1/events", None).await;
    let start = events.next().await.expect("the first");
    assert_eq!(start.name, "start");
    let ended = |data: &Value| data["ended_at"].is_string();
    let job = server.solve(&case("alone", 70_001)).await["id"].clone();
    let seen = events.until(&job, ended).await.id;
    let cases = json!([case("x", 70_002), case("y", 70_003)]);
    let mut batch = Value::Null;
    for (name, path, body) in [
        ("batch", "/v1/batches", cases),
        ("run", "/v1/runs", example("run.json")),
        ("evolution", "/v1/evolutions", evolution(1)),
    ] {
        let work = server.post(path, &body).await.is(202);
        if name == "evolution" {
            server.cancel(&work.location()).await;
        }
        let last = events.until(&work.json["id"], ended).await;
        assert_eq!(
            (last.name.as_str(), &last.data["links"]["self"]),
            (name, &json!(work.location()))
        );
        if name == "run" {
            assert_eq!(last.data["rows_done"], 4);
        }
        if name == "batch" {
            batch = work.json["id"].clone();
        }
    }
    // A second stream that starts after the last event of the first one has the events of the batch and no earlier events.
    let mut later = Reader::open(&server, "/v1/events", Some(&seen)).await;
    assert_eq!(later.next().await.expect("the first").name, "start");
    let told = |data: &Value| {
        assert_ne!(data["id"], before);
        ended(data)
    };
    later.until(&batch, told).await;
    assert!(seen.parse::<i64>().expect("a moment") >= start.id.parse().expect("a moment"));
}

#[tokio::test]
async fn wait_that_is_too_short_answers_the_job_as_it_is() {
    let server = Server::idle().await;
    let headers = [
        ("prefer", "wait=0", Some("wait=0")),
        ("prefer", "respond-async", None),
        ("accept", "*/*", None),
    ];
    let case = example("spin.case.json");
    for (place, (name, value, applied)) in headers.into_iter().enumerate() {
        let answer = server.post_with("/v1/jobs", name, value, &case).await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        assert_eq!(answer.json["state"], "queued");
        assert_eq!(answer.header("preference-applied"), applied);
        assert_eq!(
            answer.header("location"),
            answer.json["links"]["self"].as_str()
        );
        assert_eq!(answer.header("retry-after"), Some("1"));
        let path = path_of(&answer.json);
        let mut looked = server.read(&path).await;
        let queue = looked.as_object_mut().expect("a job").remove("queue");
        let queue = queue.expect("a place in the queue");
        assert_eq!(queue["position"], place);
        assert_eq!(
            queue["starts_in_s"].as_f64() > Some(0.0),
            place > 0,
            "{queue}"
        );
        assert_eq!(looked, answer.json);
        assert_eq!(server.read(&format!("{path}/case")).await, case);
    }
}
