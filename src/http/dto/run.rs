//! A run as the client sends and sees it.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::http::dto::job::rfc3339;
use crate::jobs::codec::table::TableKind;
use crate::jobs::model::job::State as JobState;
use crate::jobs::run::head::RunColumn;
use crate::jobs::run::model::Run;

/// Rows to solve: a case, and columns of values that stand in place of some of its members.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RunRequest)]
#[allow(
    dead_code,
    reason = "the contract; bodies are read straight into columns"
)]
pub(crate) struct RunRequest {
    /// A case with one motion. Members that a column holds may be left out. Of `outputs` only `resultants`, `zones` and `gradients` are
    /// allowed.
    #[schema(value_type = Object)]
    template: Value,
    /// Columns of numbers or of texts, all of the same length. A JSON pointer such as `/load/normal_force_n` or a short name such as
    /// `normal_force_n` varies the case. Columns of places, times and sections, such as `km`, and those of `?carry=` are carried along to the
    /// answers; any other name is refused.
    columns: BTreeMap<String, Vec<CellValue>>,
}

/// A value of a column.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
#[allow(
    dead_code,
    reason = "the contract; bodies are read straight into columns"
)]
pub(crate) enum CellValue {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

/// A run: how far it is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Run)]
pub(crate) struct RunAnswer {
    /// Identifier of the run.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// Where the run stands. A run that was cancelled keeps the answers that were there; one is `failed` if no row could be tried.
    state: JobState,
    /// Free text of the client.
    name: Option<String>,
    /// Labels of the client.
    labels: BTreeMap<String, String>,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// End of the last row; null before it.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// The method asked for.
    method: String,
    /// Number of rows.
    rows: u64,
    /// Rows that are over.
    rows_done: u64,
    /// Rows of these that have no answer; the column `status` says why.
    rows_without_answer: u64,
    /// Share of the work that is done.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// The pieces in which the rows are solved.
    chunks: RunChunks,
    /// The columns that were sent.
    columns: Vec<SentColumn>,
    /// The columns of the answers, in their order.
    answers: Vec<AnswerColumn>,
    /// Where to go from here.
    links: BTreeMap<String, String>,
}

/// The pieces of a run.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunChunks {
    /// Number of pieces.
    count: u32,
    /// Rows of each but the last.
    rows: u32,
    queued: u64,
    running: u64,
    succeeded: u64,
    failed: u64,
    cancelled: u64,
}

/// A column that was sent.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SentColumn {
    /// Its name.
    name: String,
    /// The place in the case that it varies; null if it is carried along to the answers.
    pointer: Option<String>,
    /// What its numbers are multiplied by, from the unit of the column to that of the case.
    factor: f64,
    /// The unit that its title or a line of units names.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    unit: Option<String>,
}

/// A column of the answers.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct AnswerColumn {
    /// Its name.
    name: String,
    /// What it holds.
    kind: TableKind,
}

/// The columns of the answers of a run.
#[must_use]
pub(crate) fn answer_columns(run: &Run) -> Vec<AnswerColumn> {
    let columns = run.head.answers().into_iter();
    let column = |(name, kind)| AnswerColumn { name, kind };
    columns.map(column).collect()
}

impl From<Run> for RunAnswer {
    fn from(run: Run) -> Self {
        let state = run.state();
        let chunks = &run.chunks;
        let sent = |column: &RunColumn| SentColumn {
            name: column.name.clone(),
            pointer: column.pointer.clone(),
            factor: column.factor,
            unit: column.unit.clone(),
        };
        let own = format!("/v1/runs/{}", chunks.id);
        let links = ["results", "manifest", "totals", "cancel", "events"];
        let mut links: BTreeMap<String, String> = links
            .map(|name| (name.to_owned(), format!("{own}/{name}")))
            .into();
        links.insert("self".to_owned(), own);
        RunAnswer {
            id: chunks.id.to_string(),
            state,
            created_at: rfc3339(chunks.created_at),
            ended_at: chunks.last_ended_at.filter(|_| state.ended()).map(rfc3339),
            method: run.head.method.clone(),
            rows: run.head.rows,
            rows_done: run.rows_done(),
            rows_without_answer: run.without_answer,
            progress: run.progress,
            chunks: RunChunks {
                count: chunks.count,
                rows: run.head.chunk_rows,
                queued: chunks.in_state(JobState::Queued),
                running: chunks.in_state(JobState::Running),
                succeeded: chunks.in_state(JobState::Succeeded),
                failed: chunks.in_state(JobState::Failed),
                cancelled: chunks.in_state(JobState::Cancelled),
            },
            columns: run.head.columns.iter().map(sent).collect(),
            answers: answer_columns(&run),
            links,
            name: run.chunks.name,
            labels: run.chunks.labels,
        }
    }
}
