//! What clients do: submit, wait, list, look, cancel, delete.

use reqwest::Method;
use serde_json::{Value, json};

use crate::results::{number, path_of};
use crate::server::{Server, Setup, example};
use crate::support::tick_forever;

#[tokio::test]
async fn every_example_is_solved_while_the_client_waits() {
    let server = Server::start().await;
    for file in ["hertz-steel", "spin", "pressure-grid", "sweep"] {
        let job = server.solve(&example(&format!("{file}.case.json"))).await;
        assert_eq!(job["state"], "succeeded", "{file}: {job:#}");
        assert_eq!(job["progress"], 1.0, "{file}");
        let path = path_of(&job);
        assert_eq!(
            server.read(&format!("{path}/result")).await,
            job["result"],
            "{file}: waiting and fetching agree"
        );
        let last = job["result"]["patches"][0]["points"]
            .as_array()
            .and_then(|points| points.last())
            .expect("a point");
        let sideways = file == "spin";
        let force = number(&last[if sideways { "force_y_n" } else { "force_x_n" }]);
        assert!(force.abs() > 100.0, "{file}: the force is {force}");
        assert!(number(&last["friction_power_n"]) > 0.0, "{file}");
        for name in ["created_at", "started_at", "ended_at"] {
            let time = job[name].as_str().expect("a time");
            assert!(
                time.ends_with('Z') && time.len() == "2026-01-31T09:30:00.000Z".len(),
                "{name} is {time}"
            );
        }
    }
}

#[tokio::test]
async fn wait_that_is_too_short_answers_the_job_as_it_is() {
    let server = Server::idle().await;
    for (place, (prefer, applied)) in [
        (Some("wait=0"), Some("wait=0")),
        (Some("respond-async"), None),
        (None, None),
    ]
    .into_iter()
    .enumerate()
    {
        let case = example("spin.case.json");
        let answer = server
            .send(Method::POST, "/v1/jobs", |request| {
                let request = request.json(&case);
                match prefer {
                    Some(prefer) => request.header("prefer", prefer),
                    None => request,
                }
            })
            .await;
        assert_eq!(answer.status, 202, "{}", answer.text);
        assert_eq!(answer.json["state"], "queued");
        assert_eq!(answer.header("preference-applied"), applied);
        assert_eq!(
            answer.header("location"),
            answer.json["links"]["self"].as_str()
        );
        assert_eq!(answer.header("retry-after"), Some("1"));
        let mut looked = server.read(&path_of(&answer.json)).await;
        let queue = looked.as_object_mut().expect("a job").remove("queue");
        let queue = queue.expect("a place in the queue");
        assert_eq!(queue["position"], place);
        assert_eq!(
            queue["starts_in_s"].as_f64() > Some(0.0),
            place > 0,
            "{queue}"
        );
        assert_eq!(looked, answer.json);
    }
}

#[tokio::test]
async fn case_comes_back_as_submitted() {
    let server = Server::idle().await;
    let case = example("hertz-steel.case.json");
    let path = server.submit(&case).await;
    assert_eq!(server.read(&format!("{path}/case")).await, case);
    let job = server.read(&path).await;
    assert_eq!(
        (&job["name"], &job["labels"]),
        (&case["name"], &case["labels"])
    );
    assert_eq!(job["batch_id"], Value::Null);
}

#[tokio::test]
async fn list_pages_through_all_jobs_newest_first() {
    let server = Server::idle().await;
    let mut case = example("spin.case.json");
    let mut submitted = Vec::new();
    for number in 0..5 {
        case["labels"] =
            json!({ "line": if number % 2 == 0 { "even" } else { "odd" }, "time": "12:30" });
        submitted.push(server.submit(&case).await);
    }
    submitted.reverse();
    let mut listed = Vec::new();
    let mut next = "/v1/jobs?limit=2".to_owned();
    loop {
        let page = server.read(&next).await;
        listed.extend(page["jobs"].as_array().expect("jobs").iter().map(path_of));
        let Some(cursor) = page["next_cursor"].as_str() else {
            break;
        };
        assert!(
            cursor
                .bytes()
                .all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_'),
            "{cursor}"
        );
        next = format!("/v1/jobs?limit=2&cursor={cursor}");
    }
    assert_eq!(listed, submitted);
    let count = async |query: &str| {
        let page = server.read(&format!("/v1/jobs?{query}")).await;
        page["jobs"].as_array().expect("jobs").len()
    };
    server.cancel(&submitted[0]).await;
    assert_eq!(count("state=cancelled").await, 1);
    assert_eq!(count("state=queued").await, 4);
    assert_eq!(count("label=line:odd").await, 2);
    assert_eq!(count("label=line:even&state=queued").await, 2);
    assert_eq!(
        count("label=time:12:30").await,
        5,
        "only the first colon divides"
    );
    let created = server.read(&submitted[4]).await["created_at"]
        .as_str()
        .expect("a time")
        .to_owned();
    assert_eq!(count(&format!("created_after={created}")).await, 5);
    assert_eq!(count(&format!("created_before={created}")).await, 0);
    assert_eq!(
        count("created_after=2000-01-01T00:00:00%2B02:00&created_before=2001-01-01T00:00:00Z")
            .await,
        0
    );
}

#[tokio::test]
async fn running_job_is_cancelled_on_request() {
    let setup = Setup::new().solving(|_, monitor| Err(tick_forever(monitor)));
    let server = setup.start().await;
    let path = server.submit(&example("spin.case.json")).await;
    server.until(&path, "running").await;
    let early = server.get(&format!("{path}/result")).await;
    assert_eq!(early.status, 409, "{}", early.text);
    assert_eq!(early.header("retry-after"), Some("1"));
    let answer = server.cancel(&path).await;
    assert!([200, 202].contains(&answer.status), "{}", answer.text);
    let ended = server.get_with(&path, "prefer", "wait=60").await;
    assert_eq!(ended.json["state"], "cancelled");
    assert!(ended.json["error"].is_null(), "{}", ended.text);
    let again = server.cancel(&path).await.is(200);
    assert_eq!(again.json["state"], "cancelled");
}

#[tokio::test]
async fn checking_a_case_tells_its_cost_and_makes_no_job() {
    let server = Server::idle().await;
    let check = async |file: &str| server.post("/v1/cases/check", &example(file)).await.json;
    let spin = check("spin.case.json").await;
    assert_eq!(
        spin["outputs"],
        json!(["resultants", "zones", "tractions", "pressure", "slip"])
    );
    assert!(
        number(&spin["estimate"]["bytes"]) > 0.0 && number(&spin["estimate"]["seconds"]) > 0.0,
        "{spin}"
    );
    let sweep = check("sweep.case.json").await;
    assert_eq!(sweep["motions"], 11);
    assert_ne!(sweep["digest"], spin["digest"]);
    assert_eq!(check("spin.case.json").await["digest"], spin["digest"]);
    assert_eq!(server.read("/v1/jobs").await["jobs"], json!([]));
}
