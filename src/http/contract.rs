//! The contract: an OpenAPI 3.1 document generated from the handlers and their types, with the examples of `api/examples`.

use std::collections::{BTreeMap, BTreeSet};

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value, json};
use utoipa::OpenApi;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{RefOr, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;

use crate::dto::BatchReceipt;
use crate::problem::{ProblemBody, ProblemKind, describe, describe_together};
use crate::routes::work::{JobEvent, WorkAnswer, header_parameter, text_header};
use crate::state::Document;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "railhead",
        description = "Rolling-contact stress service. A case describes how two bodies touch, press and roll; the result has tractions, stick and slip zones and forces.\n\nNames include the unit: mm, N, MPa. Creepages are dimensionless, spin is in 1/mm. x is along rolling, y to the left, z up. Forces and tractions act on the lower body. Numbers have double precision; times are RFC 3339 in UTC. Failures are problems (RFC 9457); their `type` is a path with an explanation.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "This service")),
    tags(
        (name = "jobs", description = "Submit cases and follow them"),
        (name = "batches", description = "Many cases at once"),
        (name = "profiles", description = "Cross-sections that cases name"),
        (name = "runs", description = "Many rows, each a variation of one case"),
        (name = "evolutions", description = "Profiles that wear under a traffic"),
        (name = "results", description = "Results, part by part"),
        (name = "cases", description = "Checks of cases, and their possible values"),
        (name = "service", description = "State of the service, its problems and this document")
    ),
    components(schemas(ProblemBody, WorkAnswer, BatchReceipt, JobEvent))
)]
struct Head;

/// Returns the document without routes.
pub(super) fn head() -> utoipa::openapi::OpenApi {
    Head::openapi()
}

/// Documents conditional requests for every `GET` of these routes.
pub(super) fn conditional<S: Clone + Send + Sync + 'static>(
    mut routes: OpenApiRouter<S>,
) -> OpenApiRouter<S> {
    for item in routes.get_openapi_mut().paths.paths.values_mut() {
        let Some(operation) = &mut item.get else {
            continue;
        };
        let about = "Values of `ETag` that the client has stored";
        let given = header_parameter("If-None-Match", about).build();
        let parameters = operation.parameters.get_or_insert_default();
        parameters.push(given.into());
        let responses = &mut operation.responses.responses;
        if let Some(RefOr::T(found)) = responses.get_mut("200") {
            let tag = text_header("Digest of the response, for `If-None-Match`");
            found.headers.insert("ETag".to_owned(), tag.into());
        }
        let unchanged = ResponseBuilder::new()
            .description("The response that the client has stored is still valid");
        responses.insert("304".to_owned(), unchanged.build().into());
    }
    routes
}

/// Returns the contract as JSON text that ends with a line break, from the document of all routes.
pub(super) fn text(mut document: utoipa::openapi::OpenApi) -> String {
    require_keys(&mut document);
    // Serialisation fails only for maps with keys that are not strings, which the document does not have.
    let mut document = serde_json::to_value(&document).unwrap_or_default();
    add_examples(&mut document);
    complete(&mut document["components"]["schemas"]);
    share(&mut document);
    lines(&document)
}

/// Problems that every request of a tenant can have.
const COMMON: &[ProblemKind] = &[
    ProblemKind::BadHeader,
    ProblemKind::Unauthorized,
    ProblemKind::Forbidden,
    ProblemKind::CrossSite,
    ProblemKind::HostNotAllowed,
    ProblemKind::NotAcceptable,
    ProblemKind::TooManyRequests,
    ProblemKind::Internal,
    ProblemKind::Overloaded,
    ProblemKind::StorageUnwritable,
    ProblemKind::StorageUnreachable,
    ProblemKind::StorageFull,
];
/// Problems that every request without a tenant can have.
const COMMON_OPEN: &[ProblemKind] = &[
    ProblemKind::NotAcceptable,
    ProblemKind::Internal,
    ProblemKind::Overloaded,
];

/// Documents keys and expiry for the operations of a tenant, and the common problems for all operations.
fn require_keys(document: &mut utoipa::openapi::OpenApi) {
    let scheme = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some(
            "An API key; not needed if the service accepts requests without one, as it does on loopback",
        ))
        .build();
    let components = document.components.get_or_insert_default();
    components.add_security_scheme("key", SecurityScheme::Http(scheme));
    document.security = Some(vec![
        SecurityRequirement::new("key", Vec::<String>::new()),
        SecurityRequirement::default(),
    ]);
    for (path, item) in &mut document.paths.paths {
        let operations = [&mut item.get, &mut item.post, &mut item.delete];
        for operation in operations.into_iter().filter_map(Option::as_mut) {
            let id = operation.operation_id.as_deref().unwrap_or_default();
            let tags = operation.tags.as_deref().unwrap_or_default();
            let open = tags.iter().any(|tag| tag == "service")
                && !["get_metrics", "get_me"].contains(&id)
                || ["list_methods", "list_remarks", "list_examples"].contains(&id);
            let common = match open {
                true => COMMON_OPEN,
                false => COMMON,
            };
            if open {
                operation.security = Some(Vec::new());
            }
            let responses = &mut operation.responses.responses;
            if !open && path.contains("{id}") {
                responses.extend(describe(&[ProblemKind::Expired]));
            }
            responses.insert("default".to_owned(), describe_together(common));
        }
    }
}

/// Adds the examples to the routes that take a case, and two of them to the submission of a batch, in JSON and in NDJSON.
fn add_examples(document: &mut Value) {
    let mut add = |path: &str, media: &str, [name, summary]: [&str; 2], value: Value| {
        let body = &mut document["paths"][path]["post"]["requestBody"];
        let example = json!({ "summary": summary, "value": value });
        body["content"][media]["examples"][name] = example;
    };
    let json = "application/json";
    let mut cases: Vec<Value> = Vec::new();
    for (name, summary, text) in EXAMPLES {
        let case: Value = serde_json::from_str(text).unwrap_or_default();
        for path in ["/v1/jobs", "/v1/cases/check"] {
            add(path, json, [name, summary], case.clone());
        }
        cases.push(case);
    }
    cases.truncate(2);
    let lines: String = cases.iter().map(|case| format!("{case}\n")).collect();
    let (path, words) = ("/v1/batches", ["two", "Two cases"]);
    add(path, "application/x-ndjson", words, lines.into());
    add(path, json, words, cases.into());
}

/// Returns this document.
#[utoipa::path(
    get,
    path = "/openapi.json",
    tag = "service",
    operation_id = "get_contract",
    responses((status = 200, description = "The contract in OpenAPI 3.1", body = Value))
)]
pub(super) async fn contract(State(Document(text)): State<Document>) -> Response {
    // A layer appends the line break to every response.
    let text = text().trim_end();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}

macro_rules! examples {
    ($($name:literal: $summary:literal;)*) => {
        [$((
            $name,
            $summary,
            include_str!(concat!("../../api/examples/", $name, ".case.json")),
        )),*]
    };
}

/// The examples: name, summary and text.
pub(super) const EXAMPLES: [(&str, &str, &str); 18] = examples! {
    "hertz-steel": "A wheel on a rail by its radii, with both creepages and spin";
    "spin": "An ellipse with lateral creepage and spin";
    "uic60-crown": "A wheel on a UIC60-like crown of arcs, as a measured gap; region and pressure are computed";
    "area-132re-crown": "A coned wheel on an AREA-132RE-like crown, touching beside the middle";
    "two-patches": "A gap on a grid with two contact patches";
    "wheel-rail": "A wheel on a rail by their cross-sections, under a vertical force, with the motion of the wheelset";
    "wheel-rail-flange": "A wheel on a rail by their cross-sections, touching at the gauge corner and at the flange";
    "guard-rail": "A wheel on a rail with a guard rail beside it, which the back of the flange touches";
    "wheelset": "A wheelset on both rails at three shifts, rolling freely, with its equivalent conicity";
    "maintenance": "Damage of a rail by one wheel: stresses below the worst point, wear and fatigue, temperatures";
    "friction": "A creep curve of a wet rail: friction that falls with slip, and a layer between the bodies";
    "unlike-bodies": "A soft roller driving on steel: bodies whose pressure and tractions depend on each other";
    "rolling": "Rolling that changes: a shift, driving, then braking, each depending on the one before";
    "pressure-grid": "A given pressure over a patch of any shape";
    "sweep": "A creep curve: many motions on the same patch";
    "paper-figure-3": "Slip and stick under longitudinal creepage and several spins, as figure 3 of Liu and Hsu, on a patch without symmetry";
    "paper-figure-4": "Slip and stick under pure spin, down to separate poles, as their figure 4";
    "paper-figure-5": "Force and moment against longitudinal creepage, as their figure 5";
};

/// Schemas of requests; the schemas that they refer to are requests too.
const REQUESTS: [&str; 4] = ["Case", "CaseWithOptions", "EvaluateRequest", "TableUpload"];

/// Names for the unnamed alternatives of a schema, in order.
const ALTERNATIVES: [(&str, &[&str]); 6] = [
    (
        "Contact",
        &[
            "RadiiContact",
            "EllipseContact",
            "GapProfileContact",
            "GapGridContact",
            "PressureGridContact",
            "ProfilesContact",
            "WheelsetContact",
        ],
    ),
    (
        "Motions",
        &[
            "SweepMotions",
            "HistoryMotion",
            "WheelsetMotion",
            "WheelsetMotions",
        ],
    ),
    ("Material", &["TwoMaterials"]),
    ("Field", &["CellField"]),
    ("GridAxis", &["AxisRange"]),
    ("Thermal", &["ThermalOfTwo"]),
];

/// Schemas whose alternatives have a discriminator: this member.
const DISCRIMINATORS: [(&str, &str); 1] = [("Contact", "type")];

/// Least and largest number of members of a schema.
const MEMBERS: [(&str, usize, Option<usize>); 3] = [
    ("AskedMotion", 1, None),
    ("Load", 1, Some(2)),
    ("Sweep", 1, None),
];

/// Members that are arrays of this many numbers, or arrays of such arrays.
const TUPLES: [(&str, &str, usize); 38] = [
    ("ArchardFigures", "speeds_mm_per_s", 2),
    ("CrossSection", "guard_rail_points_mm", 2),
    ("CrossSection", "points_mm", 2),
    ("EquivalentConicity", "turns_mm", 2),
    ("FirstTouch", "rail_mm", 2),
    ("FirstTouch", "track_mm", 3),
    ("FirstTouch", "wheel_mm", 2),
    ("GradientErrors", "by_normal_force", 3),
    ("GradientErrors", "force_x_n", 3),
    ("GradientErrors", "force_y_n", 3),
    ("GradientErrors", "moment_z_n_mm", 3),
    ("Gradients", "by_normal_force", 3),
    ("Gradients", "force_x_n", 3),
    ("Gradients", "force_y_n", 3),
    ("Gradients", "moment_z_n_mm", 3),
    ("KnownPatch", "extent_mm", 4),
    ("KnownPatch", "semi_axes_mm", 2),
    ("Outlines", "patch", 2),
    ("Outlines", "slip", 2),
    ("Outlines", "stick", 2),
    ("MotionRegion", "extent_mm", 4),
    ("PatchSolution", "extent_mm", 4),
    ("PatchSolution", "semi_axes_mm", 2),
    ("PlacedProfiles", "rail_mm", 2),
    ("PlacedProfiles", "wheel_mm", 2),
    ("Position", "origin_track_mm", 3),
    ("Position", "rail_mm", 2),
    ("Position", "track_mm", 3),
    ("Position", "wheel_mm", 2),
    ("ProfileQuality", "y_mm", 2),
    ("RemarkEntry", "also_at_points", 2),
    ("SectionQuality", "y_mm", 2),
    ("StressPoint", "at_mm", 3),
    ("StressPoint", "principal_mpa", 3),
    ("StressPoint", "shear_direction", 3),
    ("StressPoint", "shear_plane_normal", 3),
    ("Subsurface", "points_mm", 3),
    ("TemperatureSummary", "at_mm", 2),
];

/// Adds what derived schemas lack: names of alternatives, discriminators, closed requests, numbers of members, lengths of arrays.
fn complete(schemas: &mut Value) {
    name_alternatives(schemas);
    for (name, member) in DISCRIMINATORS {
        add_discriminator(schemas, name, member);
    }
    for name in reached(schemas) {
        close(&mut schemas[name]);
    }
    for (name, least, most) in MEMBERS {
        schemas[name]["minProperties"] = least.into();
        if let Some(most) = most {
            schemas[name]["maxProperties"] = most.into();
        }
    }
    for (name, member, length) in TUPLES {
        fix_length(&mut schemas[name]["properties"][member], length);
    }
}

/// Disallows additional members in a schema and in the schemas written inside it.
fn close(schema: &mut Value) {
    let Value::Object(members) = schema else {
        return;
    };
    if members.contains_key("properties") {
        let more = members.entry("additionalProperties");
        more.or_insert(false.into());
    }
    for (name, part) in members {
        match (name.as_str(), part) {
            ("properties", Value::Object(parts)) => parts.values_mut().for_each(close),
            ("oneOf", Value::Array(parts)) => parts.iter_mut().for_each(close),
            ("items", part) => close(part),
            _ => {}
        }
    }
}

/// Moves the unnamed alternatives of schemas into components of their own.
fn name_alternatives(schemas: &mut Value) {
    for (choice, names) in ALTERNATIVES {
        let Some(forms) = schemas[choice]["oneOf"].as_array_mut() else {
            continue;
        };
        // Some clients take the first alternative whose required members are present.
        forms.sort_by_key(|form| form.get("required").is_none());
        let unnamed = forms
            .iter_mut()
            .filter(|form| form.get("properties").is_some());
        let named: Vec<(&str, Value)> = std::iter::zip(names, unnamed)
            .map(|(name, form)| {
                let leading = json!({ "$ref": format!("#/components/schemas/{name}") });
                (*name, std::mem::replace(form, leading))
            })
            .collect();
        for (name, form) in named {
            schemas[name] = form;
        }
    }
}

/// Adds the discriminator of a schema: the word of a member that selects each alternative.
fn add_discriminator(schemas: &mut Value, choice: &str, member: &str) {
    let mut mapping = Map::new();
    for form in references(&schemas[choice]["oneOf"]) {
        let words = schemas[&form]["properties"][member]["enum"].as_array();
        if let Some([Value::String(word)]) = words.map(Vec::as_slice) {
            let place = format!("#/components/schemas/{form}");
            mapping.insert(word.clone(), place.into());
        }
    }
    schemas[choice]["discriminator"] = json!({ "propertyName": member, "mapping": mapping });
}

/// Returns the names of the schemas of requests and of all schemas that they refer to.
fn reached(schemas: &Value) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    let mut next: Vec<String> = REQUESTS.map(str::to_owned).into();
    while let Some(name) = next.pop() {
        if let Some(schema) = schemas.get(&name)
            && seen.insert(name)
        {
            next.extend(references(schema));
        }
    }
    seen
}

/// Returns the names of the schemas that a part of the document refers to directly.
fn references(part: &Value) -> Vec<String> {
    match part {
        Value::Object(members) => {
            let target = members.get("$ref").and_then(Value::as_str);
            let own = target.and_then(|target| Some(target.rsplit_once('/')?.1.to_owned()));
            let inner = members.values().flat_map(references);
            own.into_iter().chain(inner).collect()
        }
        Value::Array(items) => items.iter().flat_map(references).collect(),
        _ => Vec::new(),
    }
}

/// Sets the length of the innermost array.
fn fix_length(schema: &mut Value, length: usize) {
    let items = schema["items"].clone();
    if items.get("items").is_some() {
        return fix_length(&mut schema["items"], length);
    }
    schema["prefixItems"] = vec![items; length].into();
    schema["minItems"] = length.into();
    // `items: false` means the same, but some generators of clients cannot read it.
    schema["maxItems"] = length.into();
}

/// Moves headers, responses, parameters and examples that several operations have into `components`.
fn share(document: &mut Value) {
    remove_double(document);
    for (kind, path) in SHARED {
        let path: Vec<&str> = path.split('/').collect();
        let mut uses: BTreeMap<String, usize> = BTreeMap::new();
        visit(document, &path, "", &mut |_, value| {
            *uses.entry(value.to_string()).or_default() += 1;
        });
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        let mut shared = Map::new();
        visit(document, &path, "", &mut |key, value| {
            let text = value.to_string();
            if uses[&text] < 2 {
                return;
            }
            let name = names.entry(text).or_insert_with(|| {
                let stem = stem(kind, key, value);
                let mut name = stem.clone();
                let mut number = 1;
                while shared.contains_key(&name) {
                    number += 1;
                    name = format!("{stem}{number}");
                }
                shared.insert(name.clone(), value.clone());
                name
            });
            let reference = format!("#/components/{kind}/{name}");
            *value = json!({ "$ref": reference });
        });
        if !shared.is_empty() {
            document["components"][kind] = shared.into();
        }
    }
}

/// Removes the format `double` of numbers, which the head of the document states for all of them.
fn remove_double(value: &mut Value) {
    match value {
        Value::Object(members) => {
            if members
                .get("format")
                .is_some_and(|format| format == "double")
            {
                members.remove("format");
            }
            members.values_mut().for_each(remove_double);
        }
        Value::Array(items) => items.iter_mut().for_each(remove_double),
        _ => {}
    }
}

/// Returns the contract as text, with one line for each operation and each component.
fn lines(document: &Value) -> String {
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

/// Components that operations share: the member of `components`, and the path of their uses; `*` is any member or entry.
const SHARED: [(&str, &str); 4] = [
    ("headers", "paths/*/*/responses/*/headers/*"),
    ("responses", "paths/*/*/responses/*"),
    ("parameters", "paths/*/*/parameters/*"),
    ("examples", "paths/*/*/requestBody/content/*/examples/*"),
];

/// Returns the name of a component, to which a number may be appended.
fn stem(kind: &str, key: &str, value: &Value) -> String {
    let reason = || {
        StatusCode::from_u16(key.parse().ok()?)
            .ok()?
            .canonical_reason()
    };
    let words = match kind {
        "responses" => reason(),
        "parameters" => value["name"].as_str(),
        _ => None,
    };
    let words = words.unwrap_or(key);
    let words = words.split(|letter: char| !letter.is_ascii_alphanumeric());
    let words = words.filter(|word| !word.is_empty());
    words
        .map(|word| word[..1].to_ascii_uppercase() + &word[1..])
        .collect()
}

/// Calls `with` for every value at a path of [`SHARED`], with its key.
fn visit(value: &mut Value, path: &[&str], key: &str, with: &mut dyn FnMut(&str, &mut Value)) {
    let [first, rest @ ..] = path else {
        return with(key, value);
    };
    match value {
        Value::Object(members) => {
            let members = members.iter_mut();
            for (name, member) in members.filter(|(name, _)| *first == "*" || *name == first) {
                visit(member, rest, name, with);
            }
        }
        Value::Array(items) => items
            .iter_mut()
            .for_each(|item| visit(item, rest, key, with)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    fn document() -> Value {
        serde_json::from_str(crate::DOCUMENT.0()).unwrap()
    }

    #[test]
    fn every_entry_of_the_tables_is_there() {
        let document = document();
        let schemas = &document["components"]["schemas"];
        for name in ALTERNATIVES.iter().flat_map(|(_, names)| *names) {
            assert!(schemas[name].is_object(), "{name}");
        }
        for (name, member, length) in TUPLES {
            let text = schemas[name]["properties"][member].to_string();
            assert!(
                text.contains(&format!("\"minItems\":{length}")),
                "{name}.{member}: {text}"
            );
        }
        for (choice, member) in DISCRIMINATORS {
            let schema = &schemas[choice];
            let told = &schema["discriminator"];
            assert_eq!(told["propertyName"], member);
            let forms = schema["oneOf"].as_array().unwrap().len();
            assert_eq!(told["mapping"].as_object().unwrap().len(), forms);
        }
    }

    /// Finds the objects below a schema that have members but allow others.
    fn open(schema: &Value, found: &mut Vec<Value>) {
        match schema {
            Value::Object(members) => {
                if members.contains_key("properties")
                    && members.get("additionalProperties") != Some(&Value::Bool(false))
                {
                    found.push(schema.clone());
                }
                members.values().for_each(|member| open(member, found));
            }
            Value::Array(items) => items.iter().for_each(|item| open(item, found)),
            _ => {}
        }
    }

    #[test]
    fn requests_say_that_they_have_no_unknown_members() {
        let document = document();
        let schemas = &document["components"]["schemas"];
        let (mut seen, mut next) = (BTreeSet::new(), Vec::new());
        for operation in [
            &document["paths"]["/v1/jobs"],
            &document["paths"]["/v1/batches"],
        ] {
            next.extend(references(&operation["post"]["requestBody"]));
        }
        while let Some(name) = next.pop() {
            if seen.insert(name.clone()) {
                next.extend(references(&schemas[&name]));
            }
        }
        assert!(seen.len() > 20, "{seen:?}");
        for name in seen {
            let mut found = Vec::new();
            open(&schemas[&name], &mut found);
            assert!(found.is_empty(), "{name}: {found:?}");
        }
    }
}
