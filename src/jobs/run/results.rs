//! The answers of a run.
use bytes::Bytes;
use serde_json::Value;
use uuid::Uuid;

use crate::contact::evaluate::varied::case_of_row;
use crate::jobs::codec::parquet::TableReader;
use crate::jobs::codec::table::{RowTable, TableColumn};
use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::{Batch, ItemResult, Kind, State};
use crate::jobs::run::model::{Run, RunChunk, RunHead, parted, table_column};
use crate::jobs::sync::blocking;

impl Jobs {
    /// A run.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn run(&self, id: Uuid) -> Result<Run, JobsError> {
        let batch = self.batch(Kind::Rows, id).await?;
        self.with_head(batch).await
    }

    /// The run that a batch of rows is.
    ///
    /// # Errors
    /// As [`Jobs::run`].
    pub async fn with_head(&self, batch: Batch) -> Result<Run, JobsError> {
        let (_, there) = batch.ended();
        if there < u64::from(batch.count) {
            // Its first chunks have expired, or it is being deleted.
            return Err(JobsError::Expired);
        }
        let record = self.shared.store.run(&self.tenant, batch.id).await?;
        let record = record.ok_or(JobsError::BatchNotFound(Kind::Rows))?;
        let head = RunHead::read(&record.template, record.head.as_deref())?;
        Ok(Run::new(batch, head, &record))
    }
}

/// Chunks that are read from the table of jobs at once. Chosen by judgement: one statement for so many files, which take far longer.
const AT_ONCE: u32 = 64;

/// A chunk of a run and where its answers are.
#[derive(Debug, Clone, PartialEq)]
pub struct ChunkRef {
    /// Its place among the chunks, from 0.
    pub index: u64,
    /// The job that it is.
    pub job: Uuid,
    /// Where it stands.
    pub state: State,
    /// Why it has no answers, as a word; nothing if it has.
    pub why: Option<&'static str>,
    /// The key of its answers, if it has any.
    pub key: Option<String>,
}

impl Jobs {
    /// The chunks of a run from this one on, some of them; none behind the last.
    ///
    /// # Errors
    /// A failed database.
    pub async fn run_chunks(
        &self,
        run: Uuid,
        after: Option<Uuid>,
    ) -> Result<Vec<ChunkRef>, JobsError> {
        let store = &self.shared.store;
        let items = store.batch_items(&self.tenant, run, after, AT_ONCE, usize::MAX);
        let items = items.await?;
        let chunks = items.into_iter().map(|item| ChunkRef {
            index: u64::from(item.index),
            job: item.job.id,
            state: item.job.state,
            why: match item.job.state {
                State::Succeeded => None,
                State::Failed => Some(
                    item.job
                        .failure
                        .map_or("failed", |failure| failure.kind.name()),
                ),
                other => Some(other.name()),
            },
            key: match item.result {
                Some(ItemResult::Stored(key)) => Some(key),
                _ => None,
            },
        });
        Ok(chunks.collect())
    }

    /// The case that a row of a run stands for, and its answer as a table of one row if it is there.
    ///
    /// # Errors
    /// A failed store, or the run has gone.
    pub async fn run_row(
        &self,
        run: &Run,
        row: u64,
    ) -> Result<(Value, Option<RowTable>), JobsError> {
        let head = &run.head;
        let index = row / u64::from(head.chunk_rows.max(1));
        let mut last = None;
        let chunk = loop {
            let chunks = self.run_chunks(run.chunks.id, last).await?;
            last = Some(chunks.last().ok_or(JobsError::Expired)?.job);
            if let Some(chunk) = chunks.into_iter().find(|chunk| chunk.index == index) {
                break chunk;
            }
        };
        let place = usize::try_from(row - head.rows_of(index).start).unwrap_or(0);
        let sent = self.chunk_rows(head, chunk.job).await?;
        let (varied, _) = parted(head, sent);
        let case = case_of_row(&head.case, &varied, &head.profiles, place);
        let case = case.map_err(|(pointer, reason)| {
            JobsError::Damaged(format!("row {row} of a run: {pointer}: {reason}"))
        })?;
        let answer = match chunk.state.ended() {
            true => Some(self.chunk_answers(head, &chunk, None).await?),
            false => None,
        };
        Ok((case, answer.map(|table| table.cut(&(place..place + 1)))))
    }

    /// The answers of a chunk, those columns that `wanted` names, or all. Rows of a chunk without answers have its state as their status.
    ///
    /// # Errors
    /// The store failed, or the answers cannot be read.
    pub async fn chunk_answers(
        &self,
        head: &RunHead,
        chunk: &ChunkRef,
        wanted: Option<Vec<String>>,
    ) -> Result<RowTable, JobsError> {
        let Some(key) = &chunk.key else {
            return self.without_answers(head, chunk, wanted.as_deref()).await;
        };
        let file = self.shared.blobs.chunk_answers(key).await?;
        blocking(move || read_answers(file, wanted.as_deref())).await?
    }

    async fn without_answers(
        &self,
        head: &RunHead,
        chunk: &ChunkRef,
        wanted: Option<&[String]>,
    ) -> Result<RowTable, JobsError> {
        let rows = head.rows_of(chunk.index);
        let sent = self.chunk_rows(head, chunk.job).await?;
        let count = usize::try_from(rows.end - rows.start).unwrap_or(0);
        let mut columns = Vec::new();
        for (name, kind) in head.answers() {
            if wanted.is_some_and(|wanted| !wanted.contains(&name)) {
                continue;
            }
            let place = head.columns.iter().position(|column| column.name == name);
            let column = match (name.as_str(), place) {
                ("row", _) => TableColumn::Integers(rows.clone().map(u64::cast_signed).collect()),
                ("status", _) => {
                    TableColumn::Texts(vec![Some(chunk.why.unwrap_or("lost").to_owned()); count])
                }
                (_, Some(place)) if head.columns[place].pointer.is_none() => {
                    table_column(sent.columns[place].clone())
                }
                _ => kind.without_values(count),
            };
            columns.push((name, column));
        }
        Ok(RowTable { columns })
    }

    /// The rows of a chunk as they were sent.
    ///
    /// # Errors
    /// A failed database, or the run has gone.
    pub async fn chunk_rows(&self, head: &RunHead, job: Uuid) -> Result<RunChunk, JobsError> {
        let case = self.shared.store.case(&self.tenant, job).await?;
        RunChunk::read(&case.ok_or(JobsError::Expired)?.body, &head.columns)
    }
}

fn read_answers(file: Bytes, wanted: Option<&[String]>) -> Result<RowTable, JobsError> {
    let damaged = |error: &dyn std::fmt::Display| JobsError::Damaged(format!("answers: {error}"));
    let reader = TableReader::new(file).map_err(|error| damaged(&error))?;
    let wanted = |name: &str| wanted.is_none_or(|wanted| wanted.iter().any(|known| known == name));
    reader.read(0, wanted).map_err(|error| damaged(&error))
}
