//! A batch as the client sends and sees it.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Case;
use crate::http::dto::job::rfc3339;
use crate::http::problem::body::Fault;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::job::State as JobState;
use crate::jobs::model::submit_options::Priority;

/// The cases of a batch.
#[derive(ToSchema)]
#[schema(min_items = 1, max_items = 200_000)]
#[expect(
    dead_code,
    reason = "the form of a body that is cut into cases while it arrives"
)]
pub(crate) struct Cases(Vec<BatchElement>);

/// A case, alone or with options of its own.
#[derive(ToSchema)]
#[serde(untagged)]
#[expect(
    dead_code,
    reason = "the form of a body that is cut into cases while it arrives"
)]
pub(crate) enum BatchElement {
    /// The case alone.
    Case(Case),
    /// The case with options in place of those of the batch.
    WithOptions(CaseWithOptions),
}

/// A case with options in place of those of its batch.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "the form of a body that is cut into cases while it arrives"
)]
pub(crate) struct CaseWithOptions {
    /// The case.
    case: Case,
    /// Which of the queued jobs of the tenant are solved first.
    #[schema(nullable = false)]
    priority: Option<Priority>,
    /// Seconds from now within which the job must have ended.
    #[schema(nullable = false, minimum = 1, maximum = 2_592_000)]
    deadline_s: Option<u32>,
}

/// A batch that was accepted, with the faults of cases that were left out.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchReceipt {
    #[serde(flatten)]
    pub batch: BatchAnswer,
    /// The faults of the cases that were left out, those of the first 1000; none unless the request said `on_invalid=skip`.
    pub errors: Vec<Fault>,
}

/// A batch: how far it is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Batch)]
pub(crate) struct BatchAnswer {
    /// Identifier of the batch.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// Where the batch stands.
    state: BatchState,
    /// Free text of the client.
    name: Option<String>,
    /// Labels of the client; those of its cases are with the jobs.
    labels: BTreeMap<String, String>,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// End of the last job; null until every job has ended.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// Number of jobs made.
    count: u32,
    /// Number of faulty cases that were left out.
    rejected: u32,
    /// Number of jobs in each state.
    states: BatchStates,
    /// Share of the jobs that have ended.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Every job has ended.
    pub ended: bool,
    /// Where to go from here.
    links: BTreeMap<String, String>,
}

/// Where a batch stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub(crate) enum BatchState {
    /// No job has begun.
    Queued,
    /// Some jobs have begun, and not all have ended.
    Running,
    /// Every job has ended.
    Ended,
}

/// Number of jobs in each state.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchStates {
    queued: u64,
    running: u64,
    succeeded: u64,
    failed: u64,
    cancelled: u64,
}

impl From<Batch> for BatchAnswer {
    fn from(batch: Batch) -> Self {
        let (ended, all) = batch.ended();
        #[expect(clippy::cast_precision_loss, reason = "far fewer jobs than 2^53")]
        let progress = if all == 0 {
            1.0
        } else {
            ended as f64 / all as f64
        };
        let state = match (ended, batch.in_state(JobState::Running)) {
            (ended, _) if ended == all => BatchState::Ended,
            (0, 0) => BatchState::Queued,
            _ => BatchState::Running,
        };
        let ended_at = batch.last_ended_at.filter(|_| ended == all);
        BatchAnswer {
            id: batch.id.to_string(),
            state,
            created_at: rfc3339(batch.created_at),
            ended_at: ended_at.map(rfc3339),
            count: batch.count,
            rejected: batch.rejected,
            states: BatchStates {
                queued: batch.in_state(JobState::Queued),
                running: batch.in_state(JobState::Running),
                succeeded: batch.in_state(JobState::Succeeded),
                failed: batch.in_state(JobState::Failed),
                cancelled: batch.in_state(JobState::Cancelled),
            },
            progress,
            ended: ended == all,
            links: links(&batch),
            name: batch.name,
            labels: batch.labels,
        }
    }
}

fn links(batch: &Batch) -> BTreeMap<String, String> {
    let own = format!("/v1/batches/{}", batch.id);
    BTreeMap::from([
        ("results".to_owned(), format!("{own}/results")),
        ("cancel".to_owned(), format!("{own}/cancel")),
        ("events".to_owned(), format!("{own}/events")),
        ("jobs".to_owned(), format!("/v1/jobs?batch={}", batch.id)),
        ("self".to_owned(), own),
    ])
}
