//! What a solver thread does for an evolution: steps up to the next record, again and again, then the whole answer.

use std::sync::Arc;

use bytes::Bytes;

use crate::contact::error::SolveError;
use crate::contact::evolution::task::{Evolution, SolveContext};
use crate::contact::solution::words::evolution::{EvolutionRecord, EvolutionState};
use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::attempts::outcome::Outcome;
use crate::jobs::attempts::slices::{SlicedEvolution, SlicedWork};
use crate::jobs::codec::result::EncodedResult;
use crate::jobs::error::JobsError;
use crate::jobs::shared::Shared;
use crate::jobs::store::ending::SliceRecord;
use crate::jobs::store::submission::StoredCase;

/// Checks an evolution, of which this is stored, and takes its next steps.
pub(crate) fn begin(
    shared: &Shared,
    control: &AttemptControl,
    stored: &StoredCase,
    notes: &[SliceRecord],
) -> Outcome {
    let request = match stored.value() {
        Ok(request) => request,
        Err(error) => return Outcome::internal(&error.to_string()),
    };
    let task = match Evolution::check(&request, &shared.options.limits) {
        Ok(task) => task,
        Err(error) => return Outcome::Refused(error),
    };
    control.set_memory_bytes(task.memory_bytes());
    advance(shared, control, SlicedEvolution::new(task, notes))
}

/// Takes the next steps, if it is known where to go on; otherwise the stored parts are wanted.
pub(crate) fn advance(
    shared: &Shared,
    control: &AttemptControl,
    mut evolution: SlicedEvolution,
) -> Outcome {
    if evolution.state.is_none() || evolution.is_over() {
        let sliced = Box::new(SlicedWork::Evolution(evolution));
        return Outcome::Slice { sliced, part: None };
    }
    let limit = shared.options.time_limit;
    if evolution.spent >= limit {
        return Outcome::Unsolved(SolveError::OutOfTime {
            limit_s: None,
            motions: None,
        });
    }
    let context = SolveContext {
        threads: shared.options.workers,
        operators: shared.engine.operators.clone(),
        known: Arc::clone(&shared.engine.known),
    };
    control.begin(evolution.spent);
    let solved = evolution.steps(&context, control);
    let spent = control.pause();
    let record = match solved {
        Ok(record) => record,
        Err(error) => return Outcome::Unsolved(error),
    };
    let texts = serde_json::to_vec(&record)
        .and_then(|record| Ok((record, serde_json::to_vec(&evolution.state)?)));
    let (record, state) = match texts {
        Ok(texts) => texts,
        Err(error) => {
            return Outcome::internal(&format!("a step cannot be written as JSON: {error}"));
        }
    };
    Outcome::Slice {
        part: Some((
            evolution.note(spent),
            EncodedResult {
                solution: Bytes::from(record),
                fields: Some(Bytes::from(state)),
            },
        )),
        sliced: Box::new(SlicedWork::Evolution(evolution)),
    }
}

/// Goes on from the stored parts, or puts them together where all is solved.
pub(crate) fn join(
    shared: &Shared,
    control: &AttemptControl,
    mut evolution: SlicedEvolution,
    parts: &[EncodedResult],
) -> Outcome {
    let read = match evolution.is_whole(parts.len()) {
        true => read(parts),
        false => Err(JobsError::Damaged("slices are missing".to_owned())),
    };
    let (state, records) = match read {
        Ok(read) => read,
        Err(error) => {
            tracing::error!(%error, "the slices of an evolution cannot be used; it is solved again");
            let mut sliced = SlicedWork::Evolution(evolution);
            sliced.begin_again();
            let sliced = Box::new(sliced);
            return Outcome::Slice { sliced, part: None };
        }
    };
    if !evolution.task.is_over(&state) {
        evolution.state = Some(state);
        return advance(shared, control, evolution);
    }
    let answer = evolution.task.answer(&state, records);
    let remarks = answer.remarks.clone();
    match serde_json::to_vec(&answer) {
        Ok(text) => Outcome::Solved {
            result: EncodedResult {
                solution: Bytes::from(text),
                fields: None,
            },
            remarks,
            field_patches: 0,
        },
        Err(error) => {
            Outcome::internal(&format!("an evolution cannot be written as JSON: {error}"))
        }
    }
}

/// The state after the last of stored parts, and all their records.
fn read(parts: &[EncodedResult]) -> Result<(EvolutionState, Vec<EvolutionRecord>), JobsError> {
    let damaged = |error: serde_json::Error| JobsError::Damaged(format!("a slice: {error}"));
    let mut records = Vec::new();
    for part in parts {
        let record: Option<EvolutionRecord> =
            serde_json::from_slice(&part.solution).map_err(damaged)?;
        records.extend(record);
    }
    let last = parts.last().and_then(|part| part.fields.as_ref());
    let last = last.ok_or_else(|| JobsError::Damaged("a slice without a state".to_owned()))?;
    Ok((serde_json::from_slice(last).map_err(damaged)?, records))
}
