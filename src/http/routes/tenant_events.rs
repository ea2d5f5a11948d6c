//! `/v1/events`: everything of the tenant in one stream of server-sent events.

use std::convert::Infallible;

use axum::response::Response;
use axum::response::sse::Event;
use futures_util::StreamExt;
use futures_util::stream::{once, unfold};
use serde::Serialize;
use serde_json::json;
use utoipa::openapi::{RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

use crate::http::dto::batch::BatchAnswer;
use crate::http::dto::job::JobAnswer;
use crate::http::dto::run::RunAnswer;
use crate::http::problem::catalogue::PlainProblems;
use crate::http::problem::error::ApiError;
use crate::http::routes::event_stream::{EventRequest, changed, event};
use crate::http::routes::work::{WorkAnswer, event_schema};
use crate::jobs::changes::Follower;

/// What an event of `/v1/events` tells, one by the name of the event.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "names the data of an event in the contract")]
pub(crate) enum TenantEvent {
    /// `job` and `evolution`: the job or evolution as its own address answers it.
    Job(Box<JobAnswer>),
    /// `batch`: the batch as `/v1/batches/{id}` answers it.
    Batch(Box<BatchAnswer>),
    /// `run`: the run as `/v1/runs/{id}` answers it.
    Run(Box<RunAnswer>),
}

/// One event of the stream, in the contract.
pub(crate) struct TenantEventSent;

impl PartialSchema for TenantEventSent {
    fn schema() -> RefOr<Schema> {
        event_schema(
            "TenantEvent",
            "`start`, `job`, `evolution`, `batch` or `run`",
        )
    }
}

impl ToSchema for TenantEventSent {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((TenantEvent::name().into_owned(), TenantEvent::schema()));
        TenantEvent::schemas(schemas);
    }
}

/// Follows everything of the tenant: jobs that were submitted alone, evolutions, batches and runs.
///
/// The first event is `start`. To miss no change, connect first and read the lists after `start`. Each `job`, `evolution`, `batch` or `run` event
/// carries the changed resource as its route returns it; jobs of a batch and rows of a run are reported through these. Changes in quick succession are merged into one
/// event; after `Last-Event-ID` some events may repeat. Deletions are not reported. The stream ends when the service shuts down.
#[utoipa::path(
    get,
    path = "/v1/events",
    tag = "jobs",
    operation_id = "follow_all",
    params(("Last-Event-ID" = Option<String>, Header, description = "Id of the last event that was seen: the stream goes on from there")),
    responses((status = 200, description = "One event per change", content((TenantEventSent = "text/event-stream"))), PlainProblems)
)]
pub(crate) async fn follow(request: EventRequest) -> Result<Response, ApiError> {
    let seen = request.seen.as_ref().and_then(|text| text.parse().ok());
    let follower = request.jobs.follow(seen);
    let start = event("start", &follower.since().to_string(), &json!({}));
    let changes = unfold(follower, next);
    let events = once(std::future::ready(start)).filter_map(std::future::ready);
    request.answer(events.map(Ok).chain(changes))
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
