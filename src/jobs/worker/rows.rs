//! What a solver thread does for a chunk of rows.

use std::time::Duration;

use bytes::Bytes;
use serde_json::json;

use crate::contact::evaluate::many::{ManyTask, solve_many};
use crate::contact::evaluate::many_answer::ManyAnswer;
use crate::contact::monitor::Monitor;
use crate::contact::problem::checked_case::CheckedCase;
use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::attempts::outcome::{Ended, Outcome};
use crate::jobs::codec::parquet::encode;
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::codec::table::{RowTable, TableColumn};
use crate::jobs::error::JobsError;
use crate::jobs::run::chunk::{RunChunk, parted};
use crate::jobs::run::head::{REASON, RunHead};
use crate::jobs::shared::Shared;
use crate::jobs::store::submission::StoredCase;

/// Solves a chunk; its answers are a Parquet file.
pub(crate) fn solve_chunk(shared: &Shared, control: &AttemptControl, stored: &StoredCase) -> Ended {
    let (head, chunk) = read(stored).map_err(|error| error.to_string())?;
    let first_row = chunk.first_row;
    let (varied, carried) = parted(&head, chunk);
    let limits = &shared.options.limits;
    let task = ManyTask {
        case: &head.case,
        columns: &varied,
        profiles: &head.profiles,
        known: &shared.engine.known,
        limits,
        time_limit: shared.options.time_limit,
    };
    control.begin(Duration::ZERO);
    let solve =
        |checked: &CheckedCase, monitor: &dyn Monitor| shared.engine.solve_whole(checked, monitor);
    let solved = solve_many(&task, &solve, control);
    control.pause();
    let answer = solved?;
    let rows = answer.status.len();
    let without = answer.without_answer();
    shared.metrics.rows_ended(&answer);
    let file = encode(&table(&head, first_row, carried, answer));
    let file = file.map_err(|error| format!("a chunk of rows cannot be written: {error}"))?;
    Ok(Outcome::Solved {
        result: EncodedResult {
            solution: Bytes::from(json!({ "rows": rows, "without_answer": without }).to_string()),
            fields: Some(Bytes::from(file)),
        },
        remarks: Vec::new(),
        field_patches: u32::try_from(without).unwrap_or(u32::MAX),
    })
}

fn read(stored: &StoredCase) -> Result<(RunHead, RunChunk), JobsError> {
    let head = RunHead::read(
        stored.template.as_deref().unwrap_or_default(),
        stored.head.as_deref(),
    )?;
    let chunk = RunChunk::read(&stored.body, &head.columns)?;
    Ok((head, chunk))
}

/// The answers in the order of [`RunHead::answers`].
fn table(
    head: &RunHead,
    first_row: u64,
    carried: Vec<(String, TableColumn)>,
    answer: ManyAnswer,
) -> RowTable {
    let rows = (first_row..).take(answer.status.len());
    let rows = TableColumn::Integers(rows.map(u64::cast_signed).collect());
    let status = answer.status.iter();
    let status = status.map(|status| Some(status.name().to_owned()));
    let method = answer.method.iter();
    let method = method.map(|method| method.map(|method| method.name().to_owned()));
    let mut columns = vec![("row".to_owned(), rows)];
    columns.extend(carried);
    columns.push(("status".to_owned(), TableColumn::Texts(status.collect())));
    columns.push(("method".to_owned(), TableColumn::Texts(method.collect())));
    let numbers = head.numbers.iter().cloned().zip(answer.numbers);
    columns.extend(numbers.map(|(name, values)| (name, TableColumn::Numbers(values))));
    if head.with_reasons {
        let reasons = answer.reason.into_iter();
        let reasons = reasons.map(|reason| Some(reason).filter(|reason| !reason.is_empty()));
        columns.push((REASON.to_owned(), TableColumn::Texts(reasons.collect())));
    }
    RowTable { columns }
}
