//! The lines of the results of a batch, made while the client takes them. Small results are read a page at a time. A large one is passed
//! on from its file as NDJSON; for a table it is read whole, and its memory is counted until its lines have been sent.

use std::collections::VecDeque;
use std::sync::Arc;

use axum::BoxError;
use axum::body::Bytes;
use futures_util::stream::{self, BoxStream, Stream, StreamExt, TryStreamExt, try_unfold};
use serde::Serialize;
use tokio::time::Instant;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::answer::Solution;
use crate::http::dto::result::JobResult;
use crate::http::limits::memory::Memory;
use crate::http::limits::tenant_semaphore::Permit;
use crate::http::problem::body::ProblemBody;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::http::render::batch_table::Columns;
use crate::http::render::row_tables::RowWriter;
use crate::jobs::Jobs;
use crate::jobs::batch::results::{OpenedItem, PAGE_BYTES};
use crate::jobs::codec::table::RowTable;
use crate::jobs::error::JobsError;
use crate::jobs::model::batch::{BatchItem, ItemFault, ItemResult};
use crate::jobs::model::job::State as JobState;
use crate::jobs::sync::blocking;

/// What a reader holds of small results: those of a page, and the text written of them.
pub(crate) const STREAM_BYTES: usize = 2 * PAGE_BYTES;
/// How many jobs are read the first time.
pub(crate) const FIRST_PAGE_JOBS: u32 = 50;
/// Most jobs read at once.
const PAGE_JOBS: u32 = 500;
/// Motions of a large result written at once.
const POINTS: usize = 64;

/// What lines are made from.
pub(crate) struct Source {
    pub jobs: Jobs,
    pub memory: Memory,
    /// Columns of the table; none for NDJSON.
    pub columns: Option<Arc<Columns>>,
}

/// Some lines.
pub(crate) enum Piece {
    Text(Bytes),
    Table(RowTable),
}

type Pieces = BoxStream<'static, Result<Piece, BoxError>>;

/// The lines of a batch from some place on.
pub(crate) struct Lines {
    pub source: Source,
    pub batch: Uuid,
    /// Until then jobs that have not ended are waited for.
    pub until: Option<Instant>,
    /// The job of the last line.
    pub after: Option<Uuid>,
    /// States of the jobs that have lines; all if there is none.
    pub states: Vec<JobState>,
    /// Jobs to read at once.
    pub page: u32,
    /// Jobs that have been read and not yet been written.
    pub read: VecDeque<BatchItem>,
    /// The rest of a large line.
    pub large: Option<Pieces>,
}

impl Lines {
    /// The text, written by `writer`.
    pub(crate) fn text(
        self,
        writer: RowWriter,
    ) -> impl Stream<Item = Result<Bytes, BoxError>> + Send {
        let pieces = Box::pin(try_unfold(self, Lines::next));
        try_unfold(Some((pieces, writer)), async |state| {
            let Some((mut pieces, mut writer)) = state else {
                return Ok(None);
            };
            let (text, rest) = match pieces.try_next().await? {
                Some(Piece::Text(text)) => (text, Some((pieces, writer))),
                Some(Piece::Table(table)) => (writer.write(table)?.into(), Some((pieces, writer))),
                None => (writer.finish()?.into(), None),
            };
            Ok(Some((text, rest)))
        })
    }

    async fn next(mut self) -> Result<Option<(Piece, Lines)>, BoxError> {
        loop {
            if let Some(large) = &mut self.large {
                match large.try_next().await? {
                    Some(piece) => return Ok(Some((piece, self))),
                    None => self.large = None,
                }
            }
            let large = |item: &BatchItem| matches!(item.result, Some(ItemResult::Stored(_)));
            if self.read.is_empty() && !self.read_page().await? {
                return Ok(None);
            }
            match self.read.front() {
                None => {}
                Some(item) if large(item) => {
                    if let Some(item) = self.read.pop_front() {
                        self.large = Some(self.source.open_large(item).await?);
                    }
                }
                Some(_) => {
                    let small = self.read.iter().take_while(|item| !large(item)).count();
                    let small: Vec<BatchItem> = self.read.drain(..small).collect();
                    let columns = self.source.columns.clone();
                    let written = blocking(move || match columns {
                        Some(columns) => Ok(Piece::Table(table_of_small(&columns, &small))),
                        None => Ok(Piece::Text(write_ndjson(&small)?.into())),
                    });
                    let written: Result<_, JobsError> = written.await?;
                    return Ok(Some((written?, self)));
                }
            }
        }
    }

    /// Reads more jobs; false at the end of the batch.
    async fn read_page(&mut self) -> Result<bool, JobsError> {
        let (items, last) = self
            .source
            .jobs
            .batch_items(self.batch, self.after, self.page, self.until, &self.states)
            .await?;
        let Some(last) = last else {
            return Ok(false);
        };
        self.after = Some(last);
        let read = u32::try_from(items.len()).unwrap_or(PAGE_JOBS);
        self.page = match self.states.is_empty() {
            true => (2 * read).clamp(4, PAGE_JOBS),
            false => PAGE_JOBS,
        };
        self.read = items.into();
        Ok(true)
    }
}

impl Source {
    /// The lines of a job whose result is large.
    async fn open_large(&self, item: BatchItem) -> Result<Pieces, BoxError> {
        let id = item.job.id;
        let opened = match &item.result {
            Some(ItemResult::Stored(key)) => self.jobs.open_item(id, key).await,
            _ => Err(ItemFault::Unreadable),
        };
        let without = |error: ProblemBody| match &self.columns {
            Some(columns) => {
                let mut table = columns.empty();
                columns.add_without_result(&mut table, &item, &error.detail);
                Ok::<_, BoxError>(one(Piece::Table(table)))
            }
            None => {
                let mut text = Vec::new();
                write_json(&mut text, &Front::of(&item, Some(error)))?;
                text.push(b'\n');
                Ok(one(Piece::Text(text.into())))
            }
        };
        let (bytes, solution) = match opened {
            Ok(opened) => opened,
            Err(fault) => return without(told(&item, fault)),
        };
        let Some(columns) = self.columns.clone() else {
            return Ok(ndjson_of(&item, solution)?);
        };
        // The text and what is read from it.
        let needed = 2 * bytes;
        if !self.memory.has_room_for(needed) {
            let detail = format!(
                "the result of {bytes} bytes takes more memory than a table may (`--tenant-request-memory-mb`); ask for NDJSON"
            );
            return without(problem(&item, ProblemKind::Overloaded, detail));
        }
        match self.read_large(needed, (bytes, solution)).await? {
            Some((solution, share)) => Ok(table_of(columns, item, solution, share)),
            None => without(told(&item, ItemFault::Unreadable)),
        }
    }

    /// The solution and its memory; nothing if the text is none.
    async fn read_large(
        &self,
        needed: usize,
        (bytes, mut pieces): OpenedItem,
    ) -> Result<Option<(Solution, Option<Permit>)>, BoxError> {
        let refused = |error: ApiError| BoxError::from(error.detail().to_owned());
        let turn = self.memory.rendering(self.jobs.tenant(), needed).await;
        let turn = turn.map_err(refused)?;
        let mut text = Vec::with_capacity(bytes);
        while let Some(piece) = pieces.try_next().await? {
            text.extend_from_slice(&piece);
        }
        text.push(b'}');
        let read = move || Ok(serde_json::from_slice::<Solution>(&text).ok());
        let read = turn.run(read, move |_| bytes).await;
        let (solution, share) = read.map_err(refused)?;
        Ok(solution.map(|solution| (solution, share)))
    }
}

fn one(piece: Piece) -> Pieces {
    stream::iter([Ok(piece)]).boxed()
}

/// A line of NDJSON; `solution` is an object whose closing brace is missing.
fn ndjson_of(
    item: &BatchItem,
    solution: BoxStream<'static, Result<Bytes, JobsError>>,
) -> Result<Pieces, JobsError> {
    let mut front = Vec::new();
    open_line(&mut front, item)?;
    let mut tail = Vec::new();
    close_line(&mut tail, item)?;
    let middle = solution.map_ok(Piece::Text).map_err(BoxError::from);
    let [front, tail] = [front, tail].map(|text| one(Piece::Text(text.into())));
    Ok(front.chain(middle).chain(tail).boxed())
}

/// The lines of one job, some motions at a time.
fn table_of(
    columns: Arc<Columns>,
    item: BatchItem,
    solution: Solution,
    share: Option<Permit>,
) -> Pieces {
    let held = (columns, item, solution, share);
    let lines = try_unfold((0, held), |(start, held)| async move {
        let (columns, item, solution, _) = &held;
        let end = (start + POINTS).min(solution.total.len());
        if start == end {
            return Ok(None);
        }
        let mut table = columns.empty();
        columns.add(&mut table, item, solution, start..end);
        Ok(Some((Piece::Table(table), (end, held))))
    });
    lines.boxed()
}

/// The lines of jobs with small results.
fn table_of_small(columns: &Columns, items: &[BatchItem]) -> RowTable {
    let mut table = columns.empty();
    for item in items {
        let solution = match &item.result {
            Some(ItemResult::Solution(text)) => serde_json::from_slice::<Solution>(text).ok(),
            _ => None,
        };
        if let Some(solution) = solution {
            columns.add(&mut table, item, &solution, 0..solution.total.len());
            continue;
        }
        let error = failure(item).map(|problem| problem.detail);
        let error = error.unwrap_or_else(|| match item.result {
            Some(_) => UNREADABLE.to_owned(),
            None => String::new(),
        });
        columns.add_without_result(&mut table, item, &error);
    }
    table
}

/// Writes lines of NDJSON of jobs with small results. A stored solution is passed on as it is, without reading it.
fn write_ndjson(items: &[BatchItem]) -> Result<Vec<u8>, JobsError> {
    let mut out = Vec::with_capacity(items.len() * 2048);
    for item in items {
        let Some(ItemResult::Solution(solution)) = &item.result else {
            write_json(&mut out, &Front::of(item, failure(item)))?;
            out.push(b'\n');
            continue;
        };
        let open = solution.strip_suffix(b"}").ok_or_else(|| {
            JobsError::Damaged(format!("solution of job {} is no object", item.job.id))
        })?;
        open_line(&mut out, item)?;
        out.extend_from_slice(open);
        close_line(&mut out, item)?;
    }
    Ok(out)
}

/// The part of a line before the result.
#[derive(Serialize)]
struct Front<'a> {
    index: u32,
    id: String,
    name: Option<&'a str>,
    labels: &'a std::collections::BTreeMap<String, String>,
    state: JobState,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ProblemBody>,
}

impl Front<'_> {
    fn of(item: &BatchItem, error: Option<ProblemBody>) -> Front<'_> {
        let job = &item.job;
        Front {
            index: item.index,
            id: job.id.to_string(),
            name: job.name.as_deref(),
            labels: &job.labels,
            state: job.state,
            error,
        }
    }
}

/// Writes what stands before a solution.
fn open_line(out: &mut Vec<u8>, item: &BatchItem) -> Result<(), JobsError> {
    write_json(out, &Front::of(item, None))?;
    // The object is continued: its closing brace makes way.
    out.pop();
    out.extend_from_slice(b",\"result\":");
    Ok(())
}

/// Writes what stands behind a solution without its closing brace.
fn close_line(out: &mut Vec<u8>, item: &BatchItem) -> Result<(), JobsError> {
    let outputs: Vec<Output> = serde_json::from_str(&item.outputs).unwrap_or_default();
    let tail = JobResult::tail(item.job.id, item.job.cached, &outputs);
    let tail = tail.map_err(|error| JobsError::Damaged(error.detail().to_owned()))?;
    out.extend_from_slice(tail.as_bytes());
    out.extend_from_slice(b"}\n");
    Ok(())
}

fn write_json<T: Serialize>(out: &mut Vec<u8>, value: &T) -> Result<(), JobsError> {
    serde_json::to_writer(out, value).map_err(|error| JobsError::Damaged(error.to_string()))
}

const UNREADABLE: &str = "the stored result cannot be read";

/// Why a job that has ended has no result.
fn failure(item: &BatchItem) -> Option<ProblemBody> {
    let job = &item.job;
    Some(ProblemBody::of_job(job, job.failure.as_ref()?))
}

/// Why the result of a succeeded job is not shown.
fn told(item: &BatchItem, fault: ItemFault) -> ProblemBody {
    match fault {
        ItemFault::Gone => {
            let detail = "the job was removed with its result while the results were read";
            problem(item, ProblemKind::Expired, detail)
        }
        ItemFault::Unreadable => problem(item, ProblemKind::Internal, UNREADABLE),
    }
}

fn problem(item: &BatchItem, kind: ProblemKind, detail: impl Into<String>) -> ProblemBody {
    let mut problem = ProblemBody::new(kind, detail);
    problem.instance = Some(format!("/v1/jobs/{}", item.job.id));
    problem
}
