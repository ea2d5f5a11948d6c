//! Reads the answers of a run.
use bytes::Bytes;
use serde_json::Value;
use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::{BatchItem, State};
use crate::run::model::{Run, RunChunk, RunHead, parted, table_column};
use crate::sync::blocking;
use railhead_contact::evaluate::varied::case_of_row;
use railhead_tables::parquet::TableReader;
use railhead_tables::table::{RowTable, TableColumn};

impl Jobs {
    /// The case of a row, and its answer as a table of one row if its chunk has ended.
    ///
    /// # Errors
    /// A failed store, or the run has gone.
    pub async fn run_row(&self, run: &Run, row: u64) -> Result<(Value, Option<RowTable>)> {
        let head = &run.head;
        let mut chunks = self.items(run.chunks.id);
        let (chunk, place) = loop {
            let chunk = chunks.next().await?.ok_or(JobsError::Expired)?;
            let rows = head.rows_of(chunk.index);
            if rows.contains(&row) {
                let place = usize::try_from(row - rows.start).unwrap_or(0);
                break (chunk, place);
            }
        };
        let sent = self.chunk_rows(head, chunk.job.id).await?;
        let (varied, _) = parted(head, sent);
        let case = case_of_row(&head.case, &varied, &head.profiles, place);
        let case = case.map_err(|(pointer, reason)| {
            JobsError::Damaged(format!("row {row} of a run: {pointer}: {reason}"))
        })?;
        let answer = match chunk.job.state.ended() {
            true => Some(self.chunk_answers(head, &chunk, None).await?),
            false => None,
        };
        Ok((case, answer.map(|table| table.cut(&(place..place + 1)))))
    }

    /// The answers of a chunk with the columns `wanted`, or all columns. In a chunk without a result, the status of each
    /// row is the state of the chunk.
    ///
    /// # Errors
    /// The store failed, or the answers cannot be read.
    pub async fn chunk_answers(
        &self,
        head: &RunHead,
        chunk: &BatchItem,
        wanted: Option<Vec<String>>,
    ) -> Result<RowTable> {
        let Some(key) = &chunk.key else {
            return self.without_answers(head, chunk, wanted.as_deref()).await;
        };
        let file = self.shared.blobs.chunk_answers(key).await?;
        blocking(move || read_answers(file, wanted.as_deref())).await?
    }

    async fn without_answers(
        &self,
        head: &RunHead,
        chunk: &BatchItem,
        wanted: Option<&[String]>,
    ) -> Result<RowTable> {
        let rows = head.rows_of(chunk.index);
        let sent = self.chunk_rows(head, chunk.job.id).await?;
        let count = usize::try_from(rows.end - rows.start).unwrap_or(0);
        let status = match (chunk.job.state, &chunk.job.failure) {
            (State::Succeeded, _) => "lost",
            (State::Failed, Some(failure)) => failure.kind.name(),
            (state, _) => state.name(),
        };
        let mut columns = Vec::new();
        for (name, kind) in head.answers() {
            if wanted.is_some_and(|wanted| !wanted.contains(&name)) {
                continue;
            }
            let place = head.columns.iter().position(|column| column.name == name);
            let column = match (name.as_str(), place) {
                ("row", _) => TableColumn::Integers(rows.clone().map(u64::cast_signed).collect()),
                ("status", _) => TableColumn::Texts(vec![Some(status.to_owned()); count]),
                (_, Some(place)) if head.columns[place].pointer.is_none() => {
                    table_column(sent.columns[place].clone())
                }
                _ => kind.without_values(count),
            };
            columns.push((name, column));
        }
        Ok(RowTable { columns })
    }

    /// The submitted rows of a chunk.
    ///
    /// # Errors
    /// A failed database, or the run has gone.
    pub async fn chunk_rows(&self, head: &RunHead, job: Uuid) -> Result<RunChunk> {
        let case = self.shared.store.case(&self.tenant, job).await?;
        RunChunk::read(&case.ok_or(JobsError::Expired)?.body, &head.columns)
    }
}

fn read_answers(file: Bytes, wanted: Option<&[String]>) -> Result<RowTable> {
    let damaged = |error: &dyn std::fmt::Display| JobsError::Damaged(format!("answers: {error}"));
    let reader = TableReader::new(file).map_err(|error| damaged(&error))?;
    let wanted = |name: &str| wanted.is_none_or(|wanted| wanted.iter().any(|known| known == name));
    reader.read(0, wanted).map_err(|error| damaged(&error))
}
