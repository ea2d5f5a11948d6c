//! One job as the client sees it.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::remark::entry::RemarkEntry;
use crate::http::dto::result::JobResult;
use crate::http::problem::body::ProblemBody;
use crate::jobs::model::job::{Job, QueuePlace, State as JobState};
use crate::jobs::model::kind::Kind;
use crate::jobs::model::submit_options::Priority;

/// A job as the client sees it. Times are RFC 3339 in UTC with milliseconds.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Job)]
pub(crate) struct JobAnswer {
    /// Identifier; sorts by time of submission.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// Where the job stands.
    state: JobState,
    /// Free text of the case.
    name: Option<String>,
    /// Labels of the case.
    labels: BTreeMap<String, String>,
    /// The batch that the job belongs to; null for a job submitted alone.
    #[schema(format = "uuid")]
    batch_id: Option<String>,
    /// Its place among the queued jobs of the tenant.
    priority: Priority,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// Time of the last change, progress aside.
    #[schema(format = "date-time")]
    updated_at: String,
    /// Start of the current or last attempt; null while queued.
    #[schema(format = "date-time")]
    started_at: Option<String>,
    /// End of the job; null before it.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// When the job fails if it has not ended by then; null where no deadline was set.
    #[schema(format = "date-time")]
    deadline_at: Option<String>,
    /// When the job will be removed with its result; null before its end, and where ended jobs are kept for ever.
    #[schema(format = "date-time")]
    expires_at: Option<String>,
    /// Attempts since the last slice of the job was stored, the current one included.
    attempt: u32,
    /// The result was computed for an identical case before, so nothing was solved.
    cached: bool,
    /// Rough progress. A queued job of which some slices are solved keeps theirs.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Its place among the queued jobs; only where one job is looked at, as long as it is queued and not too far behind.
    #[serde(skip_serializing_if = "Option::is_none")]
    queue: Option<QueuePlace>,
    /// What the client should know before using the numbers.
    remarks: Vec<RemarkEntry>,
    /// Why the job failed; null unless it did.
    error: Option<ProblemBody>,
    /// Where to go from here.
    links: BTreeMap<String, String>,
    /// The result; only in the answer to `Prefer: wait`, when the job succeeded in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<JobResult>,
}

impl JobAnswer {
    /// Shows a job.
    #[must_use]
    pub(crate) fn new(job: Job) -> Self {
        let error = job
            .failure
            .as_ref()
            .map(|failure| ProblemBody::of_job(&job, failure));
        JobAnswer {
            id: job.id.to_string(),
            state: job.state,
            links: links(&job),
            name: job.name,
            labels: job.labels,
            batch_id: job.batch_id.map(|id| id.to_string()),
            priority: job.priority,
            created_at: rfc3339(job.created_at),
            updated_at: rfc3339(job.updated_at),
            started_at: job.started_at.map(rfc3339),
            ended_at: job.ended_at.map(rfc3339),
            deadline_at: job.deadline.map(rfc3339),
            expires_at: job.expires_at.map(rfc3339),
            attempt: job.attempt,
            cached: job.cached,
            progress: job.progress,
            queue: job.queue,
            remarks: job.remarks,
            error,
            result: None,
        }
    }
}

/// What can be done with a job in its present state.
fn links(job: &Job) -> BTreeMap<String, String> {
    let (own, asked) = match job.kind {
        Kind::Evolution => (format!("/v1/evolutions/{}", job.id), "request"),
        _ => (format!("/v1/jobs/{}", job.id), "case"),
    };
    let mut links = BTreeMap::from([(asked.to_owned(), format!("{own}/{asked}"))]);
    links.insert("events".to_owned(), format!("{own}/events"));
    if job.state == JobState::Succeeded {
        links.insert("result".to_owned(), format!("{own}/result"));
    }
    if !job.state.ended() {
        links.insert("cancel".to_owned(), format!("{own}/cancel"));
    }
    links.insert("self".to_owned(), own);
    links
}

/// Milliseconds since 1970 as RFC 3339 in UTC, for example `2026-01-31T09:30:00.000Z`.
pub(crate) fn rfc3339(epoch_ms: i64) -> String {
    jiff::Timestamp::from_millisecond(epoch_ms)
        .map_or_else(|_| epoch_ms.to_string(), |time| format!("{time:.3}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_milliseconds_and_are_in_utc() {
        assert_eq!(rfc3339(1_769_851_800_000), "2026-01-31T09:30:00.000Z");
        assert_eq!(rfc3339(1_769_851_800_007), "2026-01-31T09:30:00.007Z");
    }
}
