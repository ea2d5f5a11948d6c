//! Reading, following, cancelling and deleting jobs, batches, runs and evolutions, with the same handlers for each kind.

use std::convert::Infallible;

use axum::body::Body;
use axum::http::StatusCode;
use axum::response::sse::Event;
use axum::response::{IntoResponse, Response};
use axum::routing::{MethodRouter, delete, get, post};
use axum::{Extension, Json};
use futures_util::stream::{Stream, StreamExt, once, unfold};
use serde::Serialize;
use serde_json::{Value, json};
use utoipa::openapi::path::{OperationBuilder, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{SchemaFormat, Type};
use utoipa::openapi::{
    Content, HeaderBuilder, HttpMethod, ObjectBuilder, Paths, Ref, RefOr, Required,
    ResponseBuilder, Schema,
};
use utoipa::{IntoParams, PartialSchema, ToSchema};
use utoipa_axum::router::{OpenApiRouter, UtoipaMethodRouter};
use uuid::Uuid;

use crate::dto::{BatchAnswer, JobAnswer, RunAnswer};
use crate::extract::caller::{Caller, Credential, WorkPath, revoked, until_revoked};
use crate::problem::{ApiError, PlainProblems, ProblemKind, Result, describe};
use crate::render::format::Format;
use crate::render::row_tables::{Piece, stream};
use crate::routes::wait::{EventRequest, Wait, WaitQuery, changed, event};
use crate::state::AppState;
use railhead_jobs::Jobs;
use railhead_jobs::follow::Follower;
use railhead_jobs::model::{Kind, State as JobState};
use railhead_jobs::work::Work;
use railhead_tables::table::TableKind;
use railhead_tables::write::WriteError;

/// Data of an event of `/v1/events`, by the name of the event.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = TenantEvent)]
#[serde(untagged)]
pub(crate) enum WorkAnswer {
    /// `job` and `evolution`: the job or evolution as its own path returns it.
    Job(Box<JobAnswer>),
    /// `batch`: the batch as `/v1/batches/{id}` returns it.
    Batch(Box<BatchAnswer>),
    /// `run`: the run as `/v1/runs/{id}` returns it.
    Run(Box<RunAnswer>),
}

impl From<Work> for WorkAnswer {
    fn from(work: Work) -> WorkAnswer {
        match work {
            Work::Job(job) => WorkAnswer::Job(Box::new(JobAnswer::new(*job))),
            Work::Batch(batch) => WorkAnswer::Batch(Box::new((*batch).into())),
            Work::Run(run) => WorkAnswer::Run(Box::new((*run).into())),
        }
    }
}

/// Data of an event of a job or an evolution.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobEvent {
    /// State of the job.
    state: JobState,
    /// Rough progress.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Version number that grows with every change; also the id of the event.
    version: u64,
}

/// Returns `GET` and `DELETE` of one piece of work.
pub(crate) fn one(kind: Kind) -> OpenApiRouter<AppState> {
    let read = async |WorkPath { jobs, id }: WorkPath, wait: Wait| {
        await_end(&jobs, id, &wait).await?;
        let work = jobs.work(id).await?;
        Ok::<_, ApiError>(wait.tell_applied(Json(WorkAnswer::from(work)).into_response()))
    };
    let remove = async |WorkPath { jobs, id }: WorkPath| {
        jobs.delete(id).await?;
        Ok::<_, ApiError>(StatusCode::NO_CONTENT)
    };
    let noun = kind.noun();
    let applied = text_header("The wait that was applied, if one was requested");
    let found = answer(kind, &format!("The {noun}")).header("Preference-Applied", applied);
    let reading = operation(kind, "get", &format!("Returns {}.", a(kind)), &[])
        .parameters(Some(WaitQuery::into_params(|| Some(ParameterIn::Query))))
        .parameter(prefer())
        .response("200", found.build());
    let gone = ResponseBuilder::new().description(format!("The {noun} is deleted"));
    let summary = format!("Removes an ended {noun} with its jobs or rows, cases and results.");
    let removing = operation(kind, "delete", &summary, &[ProblemKind::not_ended(kind)])
        .response("204", gone.build());
    let reading = route(kind, "/{id}", HttpMethod::Get, reading, get(read));
    let removing = route(kind, "/{id}", HttpMethod::Delete, removing, delete(remove));
    OpenApiRouter::new().routes(reading).routes(removing)
}

/// Waits for the end of work if the request asks for it.
///
/// # Errors
/// The id is unknown, or the key of the request is revoked in the meantime.
pub(crate) async fn await_end(jobs: &Jobs, id: Uuid, wait: &Wait) -> Result<()> {
    let waited = wait.hold(jobs, async |at_most| jobs.wait_for(id, at_most).await);
    if let Some(ended) = waited.await? {
        ended?;
    }
    Ok(())
}

/// Formats of the results of batches and runs.
pub(crate) const RESULT_FORMATS: &[Format] =
    &[Format::Ndjson, Format::Csv, Format::Arrow, Format::Parquet];

/// Returns a response that streams a table, until the key of the request is revoked. `name` is the name of the file.
///
/// # Errors
/// The head of the table cannot be written.
pub(crate) fn table_answer(
    (jobs, key): (Jobs, Option<Extension<Credential>>),
    (format, name): (Format, &str),
    columns: &[(String, TableKind)],
    pieces: impl Stream<Item = Result<Piece, WriteError>> + Send + 'static,
) -> Result<Response> {
    let text = stream(format, columns, pieces);
    let text = text.map_err(ApiError::internal)?;
    let revoked = revoked(jobs, key.map(|Extension(key)| key));
    Ok(format.answer(name, Body::from_stream(until_revoked(text, revoked))))
}

/// Returns `POST …/cancel`.
pub(crate) fn cancel(kind: Kind) -> OpenApiRouter<AppState> {
    let stop = async |WorkPath { jobs, id }: WorkPath| {
        let work = jobs.cancel(id).await?;
        let status = match work.ended() {
            true => StatusCode::OK,
            false => StatusCode::ACCEPTED,
        };
        Ok::<_, ApiError>((status, Json(WorkAnswer::from(work))))
    };
    let noun = kind.noun();
    let summary = format!(
        "Cancels {}. Parts that have ended keep their results.",
        a(kind)
    );
    let ended = answer(kind, &format!("The {noun} has ended"));
    let stopping_soon = answer(kind, "Running solves will stop shortly");
    let stopping = operation(kind, "cancel", &summary, &[])
        .response("200", ended.build())
        .response("202", stopping_soon.build());
    let route = route(kind, "/{id}/cancel", HttpMethod::Post, stopping, post(stop));
    OpenApiRouter::new().routes(route)
}

/// Returns `GET …/events`, which streams changes as server-sent events.
///
/// The service has no state per client: the next event is created when the connection is ready for it. The id of an event identifies the
/// version that it reported, so that `Last-Event-ID` resumes after lost connections and after restarts of the service.
pub(crate) fn events(kind: Kind) -> OpenApiRouter<AppState> {
    let noun = kind.noun();
    let about = match kind {
        Kind::Case => {
            "Events are named `state`; their data is JSON with `state`, `progress` and `version`. Changes in quick succession are \
             merged. The first event is sent at once, unless `Last-Event-ID` is its id; the stream closes after the final state, \
             and when the service shuts down. If the client has received the last event, the response is `204`, which tells an \
             `EventSource` not to reconnect."
                .to_owned()
        }
        Kind::Evolution => "Like the events of a job.".to_owned(),
        _ => format!(
            "Like the events of a job; their data is the {noun} as `/v1/{}/{{id}}` returns it.",
            kind.nouns()
        ),
    };
    let seen = header_parameter("Last-Event-ID", "Id of the last event received");
    let stream = Content::new(Some(Ref::from_schema_name(event_name(kind))));
    let sent = ResponseBuilder::new()
        .description("One event per change")
        .content("text/event-stream", stream);
    let over = format!("The {noun} has ended and the client has received the last event");
    let following = operation(kind, "follow", &format!("Follows {}.", a(kind)), &[])
        .description(Some(about))
        .parameter(seen)
        .response("200", sent.build())
        .response("204", ResponseBuilder::new().description(over).build());
    let get = get(follow);
    let (mut schemas, paths, handler) =
        route(kind, "/{id}/events", HttpMethod::Get, following, get);
    let data = match kind {
        Kind::Case | Kind::Evolution => "JobEvent",
        _ => answer_name(kind),
    };
    schemas.push((event_name(kind), event_schema(data, "`state`")));
    OpenApiRouter::new().routes((schemas, paths, handler))
}

async fn follow(WorkPath { jobs, id }: WorkPath, request: EventRequest) -> Result<Response> {
    let work = jobs.work(id).await?;
    let seen = request.seen.clone();
    if work.ended() && seen.as_deref() == Some(&work.version()) {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let events = unfold((jobs.clone(), Some(seen)), move |(jobs, seen)| async move {
        let (event, seen) = next_event(&jobs, id, seen?).await?;
        Some((event, (jobs, seen)))
    });
    request.answer(jobs, events)
}

/// Returns the next event and the version that it reports; `None` after the final event.
async fn next_event(
    jobs: &Jobs,
    id: Uuid,
    seen: Option<String>,
) -> Option<(Result<Event, Infallible>, Option<Option<String>>)> {
    let work = changed(jobs.changed_since(id, seen.as_deref()).await)?;
    let (version, ended) = (work.version(), work.ended());
    let event = match work {
        Work::Job(job) => {
            let data = JobEvent {
                state: job.state,
                progress: job.progress,
                version: job.version,
            };
            event("state", &version, &data)
        }
        work => event("state", &version, &WorkAnswer::from(work)),
    };
    Some((Ok(event?), (!ended).then_some(Some(version))))
}

/// Returns the noun of a kind with its article, such as `a job`.
fn a(kind: Kind) -> String {
    let article = match kind {
        Kind::Evolution => "an",
        _ => "a",
    };
    format!("{article} {}", kind.noun())
}

/// Returns the name of the schema of a response.
pub(crate) fn answer_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Case | Kind::Evolution => "Job",
        Kind::Cases => "Batch",
        Kind::Rows => "Run",
    }
}

fn event_name(kind: Kind) -> String {
    format!("{}EventSent", answer_name(kind))
}

/// Returns the schema of an event with these names, whose data has the schema `data`.
pub(crate) fn event_schema(data: &str, names: &str) -> RefOr<Schema> {
    let holds = format!("#/components/schemas/{data}");
    schema(json!({
        "type": "object",
        "description": "Fields of one server-sent event",
        "required": ["event", "id", "data"],
        "properties": {
            "event": { "type": "string", "description": names },
            "id": { "type": "string", "description": "Id to send as `Last-Event-ID`" },
            "retry": { "type": "integer", "description": "Milliseconds to wait before reconnecting" },
            "data": {
                "type": "string", "description": "Data of the event, as JSON", "contentMediaType": "application/json",
                "contentSchema": { "$ref": holds },
            },
        },
    }))
}

/// Returns an operation on one piece of work.
fn operation(kind: Kind, verb: &str, summary: &str, more: &[ProblemKind]) -> OperationBuilder {
    let id = text().format(Some(SchemaFormat::Custom("uuid".to_owned())));
    let id = ParameterBuilder::new()
        .name("id")
        .parameter_in(ParameterIn::Path)
        .required(Required::True)
        .description(Some(format!("Id of the {}", kind.noun())))
        .schema(Some(id));
    let problems = [&[ProblemKind::BadQuery, ProblemKind::not_found(kind)], more].concat();
    let mut operation = OperationBuilder::new()
        .operation_id(Some(format!("{verb}_{}", kind.noun())))
        .tag(kind.nouns())
        .summary(Some(summary))
        .parameter(id);
    for (status, response) in describe(&problems) {
        operation = operation.response(status, response);
    }
    operation
}

/// Describes a response with JSON of this schema.
pub(crate) fn json_answer(schema: &str, description: &str) -> ResponseBuilder {
    let content = Content::new(Some(Ref::from_schema_name(schema)));
    ResponseBuilder::new()
        .description(description)
        .content(Format::Json.media_type(), content)
}

fn answer(kind: Kind, description: &str) -> ResponseBuilder {
    json_answer(answer_name(kind), description)
}

/// Returns a schema of the contract from its JSON. A test compares the contract with the committed one.
pub(crate) fn schema(json: Value) -> RefOr<Schema> {
    serde_json::from_value(json).unwrap_or_else(|_| Schema::default().into())
}

/// Returns the schema of a text.
pub(crate) fn text() -> ObjectBuilder {
    ObjectBuilder::new().schema_type(Type::String)
}

/// Describes a response header with a text.
pub(crate) fn text_header(description: &str) -> utoipa::openapi::Header {
    let header = HeaderBuilder::new().schema(Some(text()));
    header.description(Some(description)).build()
}

/// Describes an optional request header with a text.
pub(crate) fn header_parameter(name: &str, about: &str) -> ParameterBuilder {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(about))
        .schema(Some(text()))
}

/// Describes `Prefer: wait=N` of a request.
pub(crate) fn prefer() -> ParameterBuilder {
    header_parameter("Prefer", "`wait=N`, as `?wait=N` (RFC 7240)").example(Some("wait=10".into()))
}

/// Returns a route below the resource of a kind.
pub(crate) fn route(
    kind: Kind,
    below: &str,
    method: HttpMethod,
    operation: OperationBuilder,
    handler: MethodRouter<AppState>,
) -> UtoipaMethodRouter<AppState> {
    let mut paths = Paths::new();
    let path = format!("/v1/{}{below}", kind.nouns());
    paths.add_path_operation(path, vec![method], operation.build());
    (Vec::new(), paths, handler)
}

/// An event of the stream of a tenant, in the contract.
pub(crate) struct TenantEventSent;

impl PartialSchema for TenantEventSent {
    fn schema() -> RefOr<Schema> {
        event_schema(
            "TenantEvent",
            "`start`, `job`, `evolution`, `batch` or `run`",
        )
    }
}

impl ToSchema for TenantEventSent {}

/// Follows all changes of the tenant: jobs that were submitted alone, evolutions, batches and runs.
///
/// The first event is `start`. To miss no change, connect first and read the lists after `start`. Each `job`, `evolution`, `batch` or `run`
/// event contains the changed resource; a batch or run also reports its jobs or rows. Changes in quick succession are merged; after
/// `Last-Event-ID` some events may repeat. Deletions are not reported. The stream ends when the service shuts down.
#[utoipa::path(
    get,
    path = "/v1/events",
    tag = "jobs",
    operation_id = "follow_all",
    params(("Last-Event-ID" = Option<String>, Header, description = "Id of the last event received: the stream continues from there")),
    responses((status = 200, description = "One event per change", content((TenantEventSent = "text/event-stream"))), PlainProblems)
)]
pub(crate) async fn follow_all(Caller(jobs): Caller, request: EventRequest) -> Result<Response> {
    let seen = request.seen.as_ref().and_then(|text| text.parse().ok());
    let follower = jobs.follow(seen);
    let start = event("start", &follower.since().to_string(), &json!({}));
    let changes = unfold(follower, next);
    let events = once(std::future::ready(start)).filter_map(std::future::ready);
    request.answer(jobs, events.map(Ok).chain(changes))
}

async fn next(mut follower: Follower) -> Option<(Result<Event, Infallible>, Follower)> {
    let (work, since) = changed(follower.next().await)?;
    let event = event(
        work.kind().noun(),
        &since.to_string(),
        &WorkAnswer::from(work),
    );
    Some((Ok(event?), follower))
}
