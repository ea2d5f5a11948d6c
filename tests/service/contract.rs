//! Tests that the contract is up to date and complete, and that it agrees with the service.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::schema::contract as document;

/// The path of the committed contract. `railhead openapi` prints the current one.
const COMMITTED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/api/openapi.json");

/// Returns every operation of the contract with its title `METHOD path`.
fn operations(document: &Value) -> Vec<(String, &Value)> {
    let mut all = Vec::new();
    for (path, item) in document["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("a path item") {
            all.push((format!("{} {path}", method.to_uppercase()), operation));
        }
    }
    all
}

/// Calls `visit` with every value below `value` and its JSON pointer.
fn walk<'a>(value: &'a Value, pointer: &str, visit: &mut dyn FnMut(&str, &'a Value)) {
    visit(pointer, value);
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                let name = name.replace('~', "~0").replace('/', "~1");
                walk(member, &format!("{pointer}/{name}"), visit);
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                walk(item, &format!("{pointer}/{index}"), visit);
            }
        }
        _ => {}
    }
}

#[test]
fn committed_contract_is_the_generated_one() {
    let generated = railhead::http::openapi_json();
    let committed = std::fs::read_to_string(COMMITTED).expect("api/openapi.json is committed");
    let differing = committed
        .lines()
        .zip(generated.lines())
        .enumerate()
        .find(|(_, (old, new))| old != new);
    assert!(
        committed == generated,
        "api/openapi.json is out of date (first difference: {differing:?}); \
         run `cargo run -- openapi > api/openapi.json`"
    );
}

#[test]
fn contract_is_openapi_3_1_with_title_version_and_licence() {
    let document = document();
    assert!(
        document["openapi"]
            .as_str()
            .is_some_and(|version| version.starts_with("3.1.")),
        "{}",
        document["openapi"]
    );
    assert_eq!(document["info"]["title"], "railhead");
    assert_eq!(document["info"]["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(document["info"]["license"]["name"], "MIT OR Apache-2.0");
}

#[test]
fn every_response_and_parameter_is_described() {
    let document = document();
    let described = |value: &Value| {
        value["description"]
            .as_str()
            .is_some_and(|text| !text.is_empty())
    };
    for (name, operation) in operations(&document) {
        assert!(
            described(operation) || operation["summary"].is_string(),
            "{name} says nothing about itself"
        );
        for (status, response) in operation["responses"].as_object().expect("responses") {
            assert!(described(response), "{name} does not describe its {status}");
        }
        for parameter in operation["parameters"].as_array().into_iter().flatten() {
            assert!(
                described(parameter),
                "{name} does not describe its parameter {}",
                parameter["name"]
            );
        }
    }
}

#[test]
fn every_failure_is_a_problem() {
    let document = document();
    let problem = serde_json::json!({ "$ref": "#/components/schemas/Problem" });
    for (name, operation) in operations(&document) {
        for (status, response) in operation["responses"].as_object().expect("responses") {
            if status.starts_with(['4', '5', 'd']) {
                let schema = &response["content"]["application/problem+json"]["schema"];
                assert_eq!(
                    schema, &problem,
                    "{name} answers {status} with something else"
                );
            }
        }
    }
}

#[test]
fn operation_ids_are_unique_and_path_parameters_declared() {
    let document = document();
    let mut seen = BTreeSet::new();
    for (name, operation) in operations(&document) {
        let id = operation["operationId"].as_str().expect("an operation id");
        assert!(seen.insert(id.to_owned()), "{id} names two operations");
        let declared: BTreeSet<&str> = operation["parameters"]
            .as_array()
            .into_iter()
            .flatten()
            .filter(|parameter| parameter["in"] == "path")
            .map(|parameter| {
                assert_eq!(parameter["required"], true, "{name}");
                parameter["name"].as_str().expect("a name")
            })
            .collect();
        let in_path: BTreeSet<&str> = name
            .split('{')
            .skip(1)
            .filter_map(|rest| rest.split('}').next())
            .collect();
        assert_eq!(declared, in_path, "{name}");
    }
}

#[test]
fn every_reference_leads_somewhere_and_every_schema_is_used() {
    let document = document();
    let mut used = BTreeSet::new();
    walk(&document, "", &mut |pointer, value| {
        // Examples contain names of the client, not references.
        if pointer.ends_with("/$ref") && !pointer.contains("/examples/") {
            let target = value.as_str().expect("a reference is a string");
            let inside = target
                .strip_prefix('#')
                .unwrap_or_else(|| panic!("{target} leads outside the document"));
            assert!(
                document.pointer(inside).is_some(),
                "{pointer} leads to {target}, which does not exist"
            );
            used.insert(target.to_owned());
        }
    });
    for name in document["components"]["schemas"]
        .as_object()
        .expect("schemas")
        .keys()
    {
        assert!(
            used.contains(&format!("#/components/schemas/{name}")),
            "nothing uses the schema {name}"
        );
    }
}

#[test]
fn every_case_example_that_can_be_solved_is_shown() {
    let document = document();
    let content =
        &document["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]["application/json"];
    let mut shown = 0;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("api/examples");
    for entry in std::fs::read_dir(folder).expect("api/examples") {
        let path = entry.expect("an entry").path();
        let file = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let Some(name) = file
            .strip_suffix(".case.json")
            .filter(|name| *name != "faulty")
        else {
            continue;
        };
        let text = std::fs::read_to_string(&path).expect("an example");
        let case: Value = serde_json::from_str(&text).expect("an example is JSON");
        assert_eq!(content["examples"][name]["value"], case, "{file}");
        shown += 1;
    }
    assert_eq!(
        content["examples"].as_object().expect("examples").len(),
        shown,
        "an example has no file"
    );
}
