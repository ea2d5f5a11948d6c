//! The contract: an OpenAPI 3.1 document made from the handlers and their types, with the examples of `api/examples`.

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde_json::Value;
use utoipa::OpenApi;
use utoipa::openapi::RefOr;
use utoipa::openapi::example::ExampleBuilder;
use utoipa::openapi::path::{ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::Type;
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityRequirement, SecurityScheme};
use utoipa::openapi::{HeaderBuilder, ObjectBuilder, Required, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;

use crate::http::examples::EXAMPLES;
use crate::http::problem::body::ProblemBody;
use crate::http::problem::catalogue::{describe, describe_together};
use crate::http::problem::kinds::ProblemKind;
use crate::http::{contract_forms, contract_shared};

#[derive(OpenApi)]
#[openapi(
    info(
        title = "railhead",
        description = "Rolling-contact stress service: describe how two bodies touch, press and roll, and get tractions, stick and slip zones and forces.\n\nUnits are part of every name: mm, N, MPa; creepages are dimensionless, spin is in 1/mm. x is along rolling, y to the left, z up; forces and tractions act on the lower body. Numbers are of double precision; times are RFC 3339 in UTC. Every failure is a problem (RFC 9457) with a `type` that explains itself.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "The service that answers this document")),
    tags(
        (name = "jobs", description = "Submit cases and follow them"),
        (name = "batches", description = "Many cases at once"),
        (name = "profiles", description = "Cross-sections that cases name"),
        (name = "runs", description = "Many rows over one case"),
        (name = "evolutions", description = "Profiles that wear under a traffic"),
        (name = "results", description = "What came out, part by part"),
        (name = "cases", description = "What can be asked"),
        (name = "service", description = "State of the service, its problems and this document")
    ),
    components(schemas(ProblemBody))
)]
struct Head;

/// The part of the document that no route carries.
pub(super) fn head() -> utoipa::openapi::OpenApi {
    Head::openapi()
}

/// Documents that every `GET` of these routes answers conditional requests.
pub(super) fn conditional<S: Clone + Send + Sync + 'static>(
    mut routes: OpenApiRouter<S>,
) -> OpenApiRouter<S> {
    let text = || Some(ObjectBuilder::new().schema_type(Type::String).build());
    for item in routes.get_openapi_mut().paths.paths.values_mut() {
        let Some(operation) = &mut item.get else {
            continue;
        };
        let given = ParameterBuilder::new()
            .name("If-None-Match")
            .parameter_in(ParameterIn::Header)
            .required(Required::False)
            .description(Some("Tags of answers that the client has"))
            .schema(text());
        operation
            .parameters
            .get_or_insert_default()
            .push(given.build().into());
        let responses = &mut operation.responses.responses;
        if let Some(RefOr::T(found)) = responses.get_mut("200") {
            let tag = HeaderBuilder::new()
                .schema(text())
                .description(Some("Digest of the answer, for `If-None-Match`"));
            found.headers.insert("ETag".to_owned(), tag.build().into());
        }
        let unchanged = ResponseBuilder::new().description("The client has this answer already");
        responses.insert("304".to_owned(), unchanged.build().into());
    }
    routes
}

/// The contract as JSON text, ending with a line break, made from what the routes say of themselves.
pub(super) fn text(mut document: utoipa::openapi::OpenApi) -> String {
    for path in ["/v1/jobs", "/v1/cases/check"] {
        add_examples(&mut document, path);
    }
    add_batches(&mut document);
    require_keys(&mut document);
    contract_forms::complete(&mut document);
    // Only a map with keys that are not strings cannot be written; the document has none.
    let mut document = serde_json::to_value(&document).unwrap_or_default();
    contract_shared::share(&mut document);
    contract_shared::lines(&document)
}

/// Returns the text of the contract, which is built on the first request for it.
#[derive(Debug, Clone, Copy)]
pub struct Document(pub fn() -> &'static str);

/// What requests of a tenant may be answered with, whatever they ask.
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
/// The same of requests that concern no tenant.
const COMMON_OPEN: &[ProblemKind] = &[
    ProblemKind::NotAcceptable,
    ProblemKind::Internal,
    ProblemKind::Overloaded,
];

/// Says of every operation on what belongs to a tenant that it may need a key, and that its work may have expired; and of every operation
/// which problems all have in common.
fn require_keys(document: &mut utoipa::openapi::OpenApi) {
    let scheme = HttpBuilder::new()
        .scheme(HttpAuthScheme::Bearer)
        .description(Some(
            "An API key; not needed where the service lets anybody in, as it does on loopback",
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

fn add_examples(document: &mut utoipa::openapi::OpenApi, path: &str) {
    for (name, summary, text) in EXAMPLES {
        let Ok(value) = serde_json::from_str::<Value>(text) else {
            continue;
        };
        add_example(document, path, "application/json", [name, summary], value);
    }
}

/// Shows a batch in the forms that need nothing else.
fn add_batches(document: &mut utoipa::openapi::OpenApi) {
    let cases = EXAMPLES.iter().take(2);
    let cases = cases.filter_map(|(_, _, text)| serde_json::from_str(text).ok());
    let cases: Vec<Value> = cases.collect();
    let lines: String = cases.iter().map(|case| format!("{case}\n")).collect();
    let path = "/v1/batches";
    let words = ["two", "Two cases"];
    add_example(document, path, "application/x-ndjson", words, lines.into());
    add_example(document, path, "application/json", words, cases.into());
}

fn add_example(
    document: &mut utoipa::openapi::OpenApi,
    path: &str,
    media: &str,
    [name, summary]: [&str; 2],
    value: Value,
) {
    let item = document.paths.paths.get_mut(path);
    let operation = item.and_then(|item| item.post.as_mut());
    let Some(RefOr::T(body)) = operation.and_then(|operation| operation.request_body.as_mut())
    else {
        return;
    };
    let Some(RefOr::T(content)) = body.content.get_mut(media) else {
        return;
    };
    let example = ExampleBuilder::new().summary(summary).value(Some(value));
    let example = RefOr::T(example.build());
    content.examples.insert(name.to_owned(), example);
}

/// This document.
#[utoipa::path(
    get,
    path = "/openapi.json",
    tag = "service",
    operation_id = "get_contract",
    responses((status = 200, description = "The contract in OpenAPI 3.1", body = Value))
)]
pub(super) async fn contract(State(Document(text)): State<Document>) -> Response {
    // The newline at the end is that of every answer.
    let text = text().trim_end();
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}
