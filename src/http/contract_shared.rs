//! Writes what several operations of the contract share once, in `components`, with references to it.

use std::collections::BTreeMap;

use axum::http::StatusCode;
use serde_json::{Map, Value, json};

/// Moves headers, responses, parameters and examples that several operations have into `components`.
pub(super) fn share(document: &mut Value) {
    leave_out_double(document);
    for kind in [
        Kind::Headers,
        Kind::Responses,
        Kind::Parameters,
        Kind::Examples,
    ] {
        let mut uses: BTreeMap<String, usize> = BTreeMap::new();
        visit(document, kind, &mut |_, value| {
            *uses.entry(value.to_string()).or_default() += 1;
        });
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        let mut shared = Map::new();
        visit(document, kind, &mut |key, value| {
            let text = value.to_string();
            if uses[&text] < 2 {
                return;
            }
            let name = names.entry(text).or_insert_with(|| {
                let stem = kind.stem(key, value);
                let mut name = stem.clone();
                let mut number = 1;
                while shared.contains_key(&name) {
                    number += 1;
                    name = format!("{stem}{number}");
                }
                shared.insert(name.clone(), value.clone());
                name
            });
            let reference = format!("#/components/{}/{name}", kind.name());
            *value = json!({ "$ref": reference });
        });
        if !shared.is_empty() {
            document["components"][kind.name()] = shared.into();
        }
    }
}

/// Leaves out that numbers are of double precision: all are, as the head of the document says.
fn leave_out_double(value: &mut Value) {
    match value {
        Value::Object(members) => {
            if members
                .get("format")
                .is_some_and(|format| format == "double")
            {
                members.remove("format");
            }
            members.values_mut().for_each(leave_out_double);
        }
        Value::Array(items) => items.iter_mut().for_each(leave_out_double),
        _ => {}
    }
}

/// The contract as text: one line for each operation and each component.
pub(super) fn lines(document: &Value) -> String {
    let mut text = String::new();
    write(document, &[], &mut text);
    text.push('\n');
    text
}

fn write(value: &Value, path: &[&str], text: &mut String) {
    let opened = matches!(
        path,
        [] | ["paths" | "components"] | ["paths" | "components", _]
    );
    match value {
        Value::Object(members) if opened && !members.is_empty() => {
            text.push('{');
            for (place, (key, member)) in members.iter().enumerate() {
                text.push_str(if place == 0 { "\n" } else { ",\n" });
                text.push_str(&Value::from(key.as_str()).to_string());
                text.push_str(": ");
                write(member, &[path, &[key]].concat(), text);
            }
            text.push_str("\n}");
        }
        _ => text.push_str(&value.to_string()),
    }
}

/// A kind of component that operations share.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Headers,
    Responses,
    Parameters,
    Examples,
}

impl Kind {
    /// The member of `components`.
    fn name(self) -> &'static str {
        match self {
            Kind::Headers => "headers",
            Kind::Responses => "responses",
            Kind::Parameters => "parameters",
            Kind::Examples => "examples",
        }
    }

    /// The name of a component, which may get a number.
    fn stem(self, key: &str, value: &Value) -> String {
        let words = match self {
            Kind::Responses => {
                let status = key.parse().ok();
                let status = status.and_then(|code: u16| StatusCode::from_u16(code).ok());
                status
                    .and_then(|status| status.canonical_reason())
                    .unwrap_or(key)
            }
            Kind::Parameters => value["name"].as_str().unwrap_or(key),
            Kind::Headers | Kind::Examples => key,
        };
        let words = words.split(|letter: char| !letter.is_ascii_alphanumeric());
        let words = words.filter(|word| !word.is_empty());
        words
            .map(|word| word[..1].to_ascii_uppercase() + &word[1..])
            .collect()
    }
}

/// Calls `with` for everything of this kind in the operations, with its key.
fn visit(document: &mut Value, kind: Kind, with: &mut impl FnMut(&str, &mut Value)) {
    let paths = document["paths"].as_object_mut().into_iter().flatten();
    let operations = paths.flat_map(|(_, item)| item.as_object_mut().into_iter().flatten());
    for (_, operation) in operations {
        match kind {
            Kind::Responses => {
                for (status, response) in members(operation, "responses") {
                    with(status, response);
                }
            }
            Kind::Headers => {
                for (_, response) in members(operation, "responses") {
                    for (name, header) in members(response, "headers") {
                        with(name, header);
                    }
                }
            }
            Kind::Parameters => {
                let parameters = operation.get_mut("parameters");
                let parameters = parameters.and_then(Value::as_array_mut).into_iter();
                for parameter in parameters.flatten() {
                    with("parameter", parameter);
                }
            }
            Kind::Examples => {
                let body = operation.get_mut("requestBody");
                for (_, content) in body.into_iter().flat_map(|body| members(body, "content")) {
                    for (name, example) in members(content, "examples") {
                        with(name, example);
                    }
                }
            }
        }
    }
}

/// The members of the member `name` of an object; empty if there is no such member.
fn members<'v>(
    value: &'v mut Value,
    name: &str,
) -> impl Iterator<Item = (&'v String, &'v mut Value)> {
    let member = value.get_mut(name).and_then(Value::as_object_mut);
    member.into_iter().flatten()
}
