//! Compares answers with the contract.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use serde_json::Value;

static CONTRACT: LazyLock<Value> = LazyLock::new(contract);

/// Returns the contract with references to shared responses, parameters and examples resolved.
pub fn contract() -> Value {
    let text = railhead::http::openapi_json();
    let mut document: Value = serde_json::from_str(&text).expect("the contract is JSON");
    let components = document["components"].clone();
    let mut paths = document["paths"].take();
    inline(&mut paths, &components);
    document["paths"] = paths;
    document
}

fn inline(value: &mut Value, components: &Value) {
    let reference = value
        .get("$ref")
        .and_then(Value::as_str)
        .and_then(|target| target.strip_prefix("#/components/"));
    if let Some(target) = reference.filter(|target| !target.starts_with("schemas/")) {
        let found = components.pointer(&format!("/{target}"));
        *value = found
            .unwrap_or_else(|| panic!("{target} is not in the contract"))
            .clone();
    }
    match value {
        Value::Object(members) => members
            .values_mut()
            .for_each(|member| inline(member, components)),
        Value::Array(items) => items.iter_mut().for_each(|item| inline(item, components)),
        _ => {}
    }
}

/// Asserts that the contract documents status, content type and every member of this answer. Refusals of unknown addresses, and pages for people,
/// are not checked.
pub fn assert_documented(
    method: &str,
    path: &str,
    status: u16,
    content_type: Option<&str>,
    body: &Value,
) {
    let called = format!("{method} {path}");
    let Some(operation) = operation(method, path) else {
        let pages = ["/docs/", "/page/"].map(|start| path.starts_with(start));
        let for_people = path == "/" || pages.contains(&true);
        assert!(
            status >= 400 || for_people || method == "HEAD",
            "{called} is answered and not in the contract"
        );
        return;
    };
    let mut response = &operation["responses"][status.to_string()];
    if response.is_null() && status >= 400 {
        response = &operation["responses"]["default"];
        let slug = body["type"]
            .as_str()
            .and_then(|name| name.strip_prefix("/problems/"));
        let meant = response["description"].as_str().expect("a description");
        let named = slug.is_some_and(|slug| meant.contains(&format!("`{slug}`")));
        assert!(
            named || body.is_null(),
            "{called} answered {status}, which the contract does not know: {body}"
        );
    }
    assert!(
        response.is_object(),
        "{called} answered {status}, which the contract does not know: {body}"
    );
    let Some(contents) = response["content"].as_object() else {
        assert_eq!(
            body,
            &Value::Null,
            "{called} answered {status} with a body, the contract has none"
        );
        return;
    };
    let media_type = content_type.and_then(|name| name.split(';').next());
    let content = media_type.and_then(|name| contents.get(name));
    let content = content.unwrap_or_else(|| {
        panic!("{called} answered {status} as {content_type:?}, not in the contract")
    });
    if body.is_null() && media_type.is_some_and(|name| !name.ends_with("/json")) {
        return;
    }
    let faults = faults(body, &content["schema"]);
    assert!(
        faults.is_empty(),
        "{called} answered {status} against the contract: {faults:#?}\n{body:#}"
    );
}

fn operation(method: &str, path: &str) -> Option<&'static Value> {
    let path = path.split('?').next().unwrap_or_default();
    let paths = CONTRACT["paths"].as_object().expect("paths");
    let item = paths.get(path).or_else(|| {
        let fits = |template: &str| {
            let (given, known): (Vec<&str>, Vec<&str>) =
                (path.split('/').collect(), template.split('/').collect());
            given.len() == known.len()
                && given
                    .iter()
                    .zip(&known)
                    .all(|(given, known)| known.starts_with('{') || given == known)
        };
        paths
            .iter()
            .find(|(template, _)| fits(template))
            .map(|(_, item)| item)
    })?;
    item.get(method.to_lowercase())
}

/// Returns the differences between a value and its schema as text. Supports the part of JSON Schema that the contract uses.
fn faults(value: &Value, schema: &Value) -> Vec<String> {
    let mut found = Vec::new();
    compare(value, schema, "", &mut found);
    found
}

fn compare(value: &Value, schema: &Value, at: &str, found: &mut Vec<String>) {
    let schema = resolve(schema);
    if let Some(choices) = schema["oneOf"].as_array() {
        let all: Vec<Vec<String>> = choices.iter().map(|choice| faults(value, choice)).collect();
        let fitting = all.iter().filter(|faults| faults.is_empty()).count();
        if fitting != 1 {
            found.push(format!(
                "{at}: fits {fitting} of {} choices: {all:?}",
                choices.len()
            ));
        }
        return;
    }
    if let Some(words) = schema["enum"].as_array()
        && !words.contains(value)
    {
        found.push(format!("{at}: {value} is none of {words:?}"));
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::String(name) => vec![name],
        Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    if !types.is_empty() && !types.iter().any(|name| is_of(value, name)) {
        found.push(format!("{at}: {value} is not of type {types:?}"));
        return;
    }
    match value {
        Value::Object(members) => compare_object(members, schema, at, found),
        Value::Array(items) if schema["items"].is_object() => {
            for (index, item) in items.iter().enumerate() {
                compare(item, &schema["items"], &format!("{at}/{index}"), found);
            }
        }
        Value::Number(number) => {
            let number = number.as_f64().expect("a number");
            let below = schema["minimum"]
                .as_f64()
                .is_some_and(|limit| number < limit);
            if below
                || schema["maximum"]
                    .as_f64()
                    .is_some_and(|limit| number > limit)
            {
                found.push(format!("{at}: {number} is out of range"));
            }
        }
        _ => {}
    }
}

fn compare_object(
    members: &serde_json::Map<String, Value>,
    schema: &Value,
    at: &str,
    found: &mut Vec<String>,
) {
    let mut known = BTreeSet::new();
    let open = gather(schema, members, at, &mut known, found);
    for name in members
        .keys()
        .filter(|name| !open && !known.contains(*name))
    {
        found.push(format!("{at}: the member `{name}` is not in the contract"));
    }
}

/// Compares the members with a schema and the schemas in its `allOf`. Returns whether other members are allowed.
fn gather(
    schema: &Value,
    members: &serde_json::Map<String, Value>,
    at: &str,
    known: &mut BTreeSet<String>,
    found: &mut Vec<String>,
) -> bool {
    let schema = resolve(schema);
    let mut open = schema["additionalProperties"].is_object()
        || !(schema["properties"].is_object() || schema["allOf"].is_array());
    for part in schema["allOf"].as_array().into_iter().flatten() {
        open |= gather(part, members, at, known, found);
    }
    for name in schema["required"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
    {
        if !members.contains_key(name) {
            found.push(format!("{at}: the member `{name}` is missing"));
        }
    }
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        known.insert(name.clone());
        if let Some(member) = members.get(name) {
            compare(member, property, &format!("{at}/{name}"), found);
        }
    }
    if schema["additionalProperties"].is_object() {
        for (name, member) in members {
            compare(
                member,
                &schema["additionalProperties"],
                &format!("{at}/{name}"),
                found,
            );
        }
    }
    open
}

fn resolve(schema: &Value) -> &Value {
    match schema["$ref"].as_str() {
        Some(target) => CONTRACT
            .pointer(target.trim_start_matches('#'))
            .expect("the reference leads somewhere"),
        None => schema,
    }
}

fn is_of(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => false,
    }
}

#[test]
fn a_wrong_answer_is_noticed() {
    let job = &serde_json::json!({ "$ref": "#/components/schemas/Problem" });
    let right =
        serde_json::json!({ "type": "/problems/x", "title": "x", "status": 404, "detail": "x" });
    assert_eq!(faults(&right, job), Vec::<String>::new());
    for (member, wrong) in [
        ("status", serde_json::json!(200)),
        ("title", serde_json::json!(1)),
        ("extra", serde_json::json!(1)),
    ] {
        let mut answer = right.clone();
        answer[member] = wrong;
        assert_eq!(faults(&answer, job).len(), 1, "{answer}");
    }
    assert_eq!(faults(&serde_json::json!({ "type": "x" }), job).len(), 3);
}
