//! Tests documents of the service about itself: capabilities, contract, tour.

use serde_json::{Value, json};

use crate::server::{Server, example, example_text};

/// Returns the names in a list, sorted.
fn words(list: &Value) -> Vec<String> {
    let mut words: Vec<String> = list
        .as_array()
        .expect("a list")
        .iter()
        .map(|item| item["name"].as_str().expect("a name").to_owned())
        .collect();
    words.sort();
    words
}

/// Returns the values of an enumeration in a schema, sorted.
fn enumerated(schema: &Value) -> Vec<String> {
    if let Some(told) = schema["discriminator"]["mapping"].as_object() {
        return told.keys().cloned().collect();
    }
    let variants = schema["oneOf"]
        .as_array()
        .cloned()
        .unwrap_or_else(|| vec![schema.clone()]);
    let words = variants.iter().flat_map(|variant| {
        let word = variant["const"].as_str().map(|word| vec![json!(word)]);
        word.or_else(|| variant["enum"].as_array().cloned())
            .unwrap_or_else(|| panic!("no words in {variant}"))
    });
    let mut words: Vec<String> = words
        .map(|word| word.as_str().expect("a word").to_owned())
        .collect();
    words.sort();
    words
}

#[tokio::test]
async fn methods_name_every_word_of_the_contract() {
    let server = Server::idle().await;
    let abilities = server.read("/v1/methods").await;
    let contract: Value = server.read("/openapi.json").await;
    let schemas = &contract["components"]["schemas"];
    assert_eq!(words(&abilities["methods"]), enumerated(&schemas["Method"]));
    assert_eq!(
        words(&abilities["contacts"]),
        enumerated(&schemas["Contact"])
    );
    assert_eq!(words(&abilities["outputs"]), enumerated(&schemas["Output"]));
    let defaults = |list: &Value| {
        words(&Value::Array(
            list.as_array()
                .expect("a list")
                .iter()
                .filter(|item| item["default"] == true)
                .cloned()
                .collect(),
        ))
    };
    let mut case = example("sweep.case.json");
    case.as_object_mut().expect("an object").remove("outputs");
    case.as_object_mut().expect("an object").remove("solver");
    let checked = server.post("/v1/cases/check", &case).await.json;
    assert_eq!(json!(defaults(&abilities["outputs"])), checked["outputs"]);
    assert_eq!(
        json!(defaults(&abilities["methods"])),
        json!([checked["method"]])
    );
    for contact in abilities["contacts"].as_array().expect("contacts") {
        let file = match contact["name"].as_str() {
            Some("radii") => "hertz-steel.case.json",
            Some("ellipse") => "spin.case.json",
            Some("gap_profile") => "uic60-crown.case.json",
            Some("gap_grid") => "two-patches.case.json",
            Some("profiles") => "wheel-rail.case.json",
            Some("wheelset") => "wheelset.case.json",
            Some("pressure_grid") => "pressure-grid.case.json",
            other => panic!("{other:?} has no example"),
        };
        let mut case = example(file);
        case.as_object_mut().expect("an object").remove("load");
        let status = server.post("/v1/cases/check", &case).await.status;
        let needs_load = contact["needs_load"] == true;
        assert_eq!(status == 422, needs_load, "{contact}: {status}");
    }
}

#[tokio::test]
async fn readable_contract_needs_no_other_server() {
    let server = Server::idle().await;
    let page = server.get("/docs/").await.is(200);
    let mut assets = 0;
    for part in page
        .text
        .split(['"', '\''])
        .filter(|part| part.ends_with(".js") || part.ends_with(".css"))
    {
        assert!(!part.contains("//"), "{part} is on another server");
        let asset = server
            .get(&format!("/docs/{}", part.trim_start_matches("./")))
            .await;
        assert_eq!(asset.status, 200, "{part}");
        assets += 1;
    }
    assert!(assets >= 3, "{}", page.text);
    let start = server.get("/docs/swagger-initializer.js").await.text;
    assert!(
        start.contains("/openapi.json") && start.contains("\"validatorUrl\": \"none\""),
        "{start}"
    );
    assert_eq!(
        server.get("/openapi.json").await.text,
        railhead::http::openapi_json()
    );
}

#[tokio::test]
async fn request_id_is_taken_over_or_made() {
    let server = Server::idle().await;
    let answer = server.get_with("/healthz", "x-request-id", "abc-1").await;
    assert_eq!(answer.header("x-request-id"), Some("abc-1"));
    let (one, two) = (server.get("/v1/jobs").await, server.get("/nowhere").await);
    assert!(one.header("x-request-id").is_some_and(|id| id.len() == 36));
    assert_ne!(
        one.header("x-request-id"),
        two.header("x-request-id"),
        "every request has its own"
    );
}

#[tokio::test]
async fn tour_uses_existing_examples_and_routes() {
    let server = Server::idle().await;
    let tour = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/api/README.md"))
        .expect("the tour");
    for file in tour
        .split(['@', '`', ' ', '"', '\'', '\n', '(', ')'])
        .filter(|word| word.starts_with("api/examples/") && word.ends_with(".json"))
    {
        assert!(
            !example_text(file.trim_start_matches("api/examples/")).is_empty(),
            "{file}"
        );
    }
    let contract = server.read("/openapi.json").await;
    let known = contract["paths"].as_object().expect("paths");
    let mut called = 0;
    for line in tour.lines().filter(|line| line.contains("curl ")) {
        let Some((_, rest)) = line.split_once("localhost:8080") else {
            continue;
        };
        let path = rest
            .split(['"', '\'', ' ', '?'])
            .next()
            .expect("a path")
            .replace("$JOB", "/v1/jobs/{id}")
            .replace("$BATCH", "/v1/batches/{id}")
            .replace("$RUN", "/v1/runs/{id}");
        assert!(
            known.contains_key(&path),
            "{line}: the contract has no {path}"
        );
        called += 1;
    }
    assert!(called >= 5, "the tour calls {called} routes only");
}

#[tokio::test]
async fn remarks_are_explained_and_those_of_an_answer_are_among_them() {
    let server = Server::idle().await;
    let kinds = server.read("/v1/remarks").await;
    let kinds = kinds.as_array().expect("a list");
    assert!(kinds.len() > 10);
    for kind in kinds {
        for member in ["code", "severity", "meaning", "advice", "example"] {
            assert!(kind[member].is_string(), "{kind}");
        }
    }
    let mut case = example("hertz-steel.case.json");
    case["friction"]["coefficient"] = json!(1.5);
    let checked = server.post("/v1/cases/check", &case).await.json;
    let remark = &checked["remarks"][0];
    assert_eq!(remark["pointer"], "/friction/coefficient");
    assert_eq!(remark["coefficient"], 1.5);
    let listed = kinds.iter().find(|kind| kind["code"] == remark["code"]);
    assert_eq!(listed.expect("its kind")["severity"], remark["severity"]);
}
