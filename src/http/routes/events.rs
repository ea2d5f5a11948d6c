//! `/v1/jobs/{id}/events`, `/v1/batches/{id}/events` and `/v1/runs/{id}/events`: changes as they happen, as server-sent events.
//!
//! Nothing is kept for a client: the next event is made when the connection takes it. The id of an event says what was
//! seen, so `Last-Event-ID` resumes over lost connections and restarts of the service alike.

use std::convert::Infallible;

use axum::http::StatusCode;
use axum::response::sse::Event;
use axum::response::{IntoResponse, Response};
use futures_util::stream::unfold;
use serde::Serialize;
use serde_json::json;
use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::Type;
use utoipa::openapi::{ObjectBuilder, RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};
use uuid::Uuid;

use crate::http::dto::batch::BatchAnswer;
use crate::http::dto::run::RunAnswer;
use crate::http::extract::ids::{BatchId, JobId, RunId};
use crate::http::problem::error::ApiError;
use crate::http::routes::batches::GetBatchProblems;
use crate::http::routes::event_stream::{EventRequest, changed, event};
use crate::http::routes::jobs::GetProblems;
use crate::http::routes::runs::GetRunProblems;
use crate::jobs::Jobs;
use crate::jobs::model::job::{Job, State as JobState};
use crate::jobs::model::kind::Kind;

/// The data of an event of a job.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobEvent {
    /// Where the job stands.
    state: JobState,
    /// Rough progress.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Grows with every change; also the id of the event.
    version: u64,
}

/// One event of the stream of a job, in the contract.
pub(crate) struct JobEventSent;

/// One event of the stream of a batch, in the contract.
pub(crate) struct BatchEventSent;

impl PartialSchema for JobEventSent {
    fn schema() -> RefOr<Schema> {
        event_schema::<JobEvent>("`state`")
    }
}

impl ToSchema for JobEventSent {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        // Only its data leads to it, in a way that is not followed.
        schemas.push((JobEvent::name().into_owned(), JobEvent::schema()));
        JobEvent::schemas(schemas);
    }
}

impl PartialSchema for BatchEventSent {
    fn schema() -> RefOr<Schema> {
        event_schema::<BatchAnswer>("`state`")
    }
}

impl ToSchema for BatchEventSent {}

/// One event of the stream of a run, in the contract.
pub(crate) struct RunEventSent;

impl PartialSchema for RunEventSent {
    fn schema() -> RefOr<Schema> {
        event_schema::<RunAnswer>("`state`")
    }
}

impl ToSchema for RunEventSent {}

/// An event line by line, called so; its data is `T` as JSON text.
pub(crate) fn event_schema<T: ToSchema>(names: &str) -> RefOr<Schema> {
    let text = |what: &str| {
        let text = ObjectBuilder::new().schema_type(Type::String);
        text.description(Some(what))
    };
    let holds = json!({ "$ref": format!("#/components/schemas/{}", T::name()) });
    let data = text("What changed, as JSON")
        .content_media_type("application/json")
        .extensions(Some(Extensions::from_iter([("contentSchema", holds)])));
    let retry = ObjectBuilder::new()
        .schema_type(Type::Integer)
        .description(Some("Milliseconds after which to connect again"));
    let event = ObjectBuilder::new()
        .description(Some("One event of the stream, line by line"))
        .property("event", text(names))
        .required("event")
        .property("id", text("What was seen, for `Last-Event-ID`"))
        .required("id")
        .property("retry", retry)
        .property("data", data)
        .required("data");
    event.into()
}

impl JobEvent {
    fn of(job: &Job) -> Self {
        JobEvent {
            state: job.state,
            progress: job.progress,
            version: job.version,
        }
    }
}

/// Follows a job.
///
/// Events are called `state`; their data is JSON with `state`, `progress` and `version`, their id is the version. The
/// first event comes at once with the job as it is, unless `Last-Event-ID` says that it was seen; the stream closes after the final
/// state, and when the service shuts down. An ended job whose last event was seen is answered with `204`, which tells
/// an `EventSource` not to connect again.
#[utoipa::path(
    get,
    path = "/v1/jobs/{id}/events",
    tag = "jobs",
    operation_id = "follow_job",
    params(
        ("id" = String, Path, description = "Id of the job", format = "uuid"),
        ("Last-Event-ID" = Option<String>, Header, description = "Id of the last event that was seen")
    ),
    responses(
        (status = 200, description = "One event per change", content((JobEventSent = "text/event-stream"))),
        (status = 204, description = "The job has ended and the client has seen it"),
        GetProblems
    )
)]
pub(crate) async fn job(request: EventRequest, JobId(id): JobId) -> Result<Response, ApiError> {
    let jobs = request.jobs.clone();
    let job = jobs.get(id).await?;
    let seen = request.seen.as_ref().and_then(|text| text.parse().ok());
    if job.state.ended() && seen == Some(job.version) {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    request.answer(unfold(Some(seen), move |seen| {
        let jobs = jobs.clone();
        async move { next_of_job(&jobs, id, seen?).await }
    }))
}

/// The next event of a job and what has then been seen; nothing after the final one.
async fn next_of_job(
    jobs: &Jobs,
    id: Uuid,
    seen: Option<u64>,
) -> Option<(Result<Event, Infallible>, Option<Option<u64>>)> {
    let job = changed(jobs.job_changed_since(id, seen).await)?;
    let event = event("state", &job.version.to_string(), &JobEvent::of(&job))?;
    let next = (!job.state.ended()).then_some(Some(job.version));
    Some((Ok(event), next))
}

/// Follows a batch.
///
/// Events are called `state`; their data is the batch as `/v1/batches/{id}` answers it. Changes in quick succession are merged into
/// one event. Otherwise these events work like those of a job.
#[utoipa::path(
    get,
    path = "/v1/batches/{id}/events",
    tag = "batches",
    operation_id = "follow_batch",
    params(
        ("id" = String, Path, description = "Id of the batch", format = "uuid"),
        ("Last-Event-ID" = Option<String>, Header, description = "Id of the last event that was seen")
    ),
    responses(
        (status = 200, description = "One event per change", content((BatchEventSent = "text/event-stream"))),
        (status = 204, description = "Every job has ended and the client has seen it"),
        GetBatchProblems
    )
)]
pub(crate) async fn batch(
    request: EventRequest,
    BatchId(id): BatchId,
) -> Result<Response, ApiError> {
    follow(request, Kind::Cases, id).await
}

/// Follows a run.
///
/// Events are called `state`; their data is the run as `/v1/runs/{id}` answers it, whenever one of its pieces has begun or ended. Otherwise as the
/// events of a job.
#[utoipa::path(
    get,
    path = "/v1/runs/{id}/events",
    tag = "runs",
    operation_id = "follow_run",
    params(
        ("id" = String, Path, description = "Id of the run", format = "uuid"),
        ("Last-Event-ID" = Option<String>, Header, description = "Id of the last event that was seen")
    ),
    responses(
        (status = 200, description = "One event per change", content((RunEventSent = "text/event-stream"))),
        (status = 204, description = "The run has ended and the client has seen it"),
        GetRunProblems
    )
)]
pub(crate) async fn run(request: EventRequest, RunId(id): RunId) -> Result<Response, ApiError> {
    follow(request, Kind::Rows, id).await
}

async fn follow(request: EventRequest, kind: Kind, id: Uuid) -> Result<Response, ApiError> {
    let jobs = request.jobs.clone();
    let batch = jobs.batch(kind, id).await?;
    let (tag, (ended, all)) = (batch.change_tag(), batch.ended());
    if kind == Kind::Rows {
        // Refused if some of its chunks have expired.
        jobs.with_head(batch).await?;
    }
    let seen = request.seen.clone();
    if ended == all && seen.as_deref() == Some(&tag) {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    request.answer(unfold(Some(seen), move |seen| {
        let jobs = jobs.clone();
        async move { next_of_batch(&jobs, kind, id, seen?).await }
    }))
}

async fn next_of_batch(
    jobs: &Jobs,
    kind: Kind,
    id: Uuid,
    seen: Option<String>,
) -> Option<(Result<Event, Infallible>, Option<Option<String>>)> {
    let batch = changed(jobs.batch_changed_since(kind, id, seen.as_deref()).await)?;
    let (mark, (ended, all)) = (batch.change_tag(), batch.ended());
    let event = if kind == Kind::Rows {
        let run = changed(jobs.with_head(batch).await.map(Some))?;
        event("state", &mark, &RunAnswer::from(run))?
    } else {
        event("state", &mark, &BatchAnswer::from(batch))?
    };
    Some((Ok(event), (ended < all).then_some(Some(mark))))
}
