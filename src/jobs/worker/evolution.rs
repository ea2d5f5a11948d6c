//! Tasks of a solver thread for an evolution: steps up to the next record, then the whole result.

use std::error::Error;
use std::sync::Arc;

use serde_json::Value;

use crate::attempts::attempt::AttemptControl;
use crate::attempts::slices::{Ended, Outcome, SlicedEvolution, SlicedWork, Solved};
use crate::codec::result::EncodedResult;
use crate::shared::Shared;
use crate::store::SliceRecord;
use railhead_contact::error::SolveError;
use railhead_contact::evolution::task::{Evolution, SolveContext};
use railhead_contact::solution::words::evolution::{EvolutionRecord, EvolutionState};

/// Maximum number of steps in one slice; a record ends it earlier.
const STEPS: u32 = 16;

/// Content of a slice: the record at its end, if any, and the state after it.
type Part = (Option<EvolutionRecord>, EvolutionState);

/// Checks an evolution with its stored slices, and takes the next steps.
pub(crate) fn begin(
    shared: &Shared,
    control: &AttemptControl,
    request: &Value,
    notes: &[SliceRecord],
) -> Ended {
    let task = Evolution::check(request, &shared.options.limits)?;
    advance(shared, control, SlicedEvolution::new(task, notes))
}

/// Takes the next steps. If there are none, or the state is unknown, the outcome requests the stored slices.
pub(crate) fn advance(
    shared: &Shared,
    control: &AttemptControl,
    mut evolution: SlicedEvolution,
) -> Ended {
    let state = evolution.state.take();
    let Some(state) = state.filter(|state| !evolution.task.is_over(state)) else {
        let sliced = Box::new(SlicedWork::Evolution(evolution));
        return Ok(Outcome::Slice { sliced, part: None });
    };
    if evolution.spent >= shared.options.time_limit {
        let limit = SolveError::OutOfTime {
            limit_s: None,
            motions: None,
        };
        return Err(limit.into());
    }
    let context = SolveContext {
        threads: shared.options.workers,
        operators: shared.engine.operators.clone(),
        known: Arc::clone(&shared.engine.known),
    };
    control.begin(evolution.spent);
    let solved = evolution.task.steps(&context, state, STEPS, control);
    let spent = control.pause();
    let (state, record) = solved?;
    let note = SliceRecord {
        number: evolution.done,
        motions: state.steps,
        digest: evolution.task.digest.clone(),
        spent,
    };
    let part = Some((note, EncodedResult::as_json(&(record, &state))?));
    evolution.state = Some(state);
    let sliced = Box::new(SlicedWork::Evolution(evolution));
    Ok(Outcome::Slice { sliced, part })
}

/// Continues from the stored slices, or joins them if all are solved.
pub(crate) fn join(
    shared: &Shared,
    control: &AttemptControl,
    mut evolution: SlicedEvolution,
    parts: &[EncodedResult],
) -> Ended {
    match read(parts, evolution.done) {
        Ok((state, records)) if evolution.task.is_over(&state) => {
            let answer = evolution.task.answer(&state, records);
            Ok(Outcome::Solved(Solved {
                result: EncodedResult::as_json(&answer)?,
                remarks: answer.remarks,
                field_patches: 0,
            }))
        }
        Ok((state, _)) => {
            evolution.state = Some(state);
            advance(shared, control, evolution)
        }
        Err(error) => {
            tracing::error!(%error, "the slices of an evolution cannot be used; it is solved again");
            evolution.begin_again();
            advance(shared, control, evolution)
        }
    }
}

/// Reads `count` stored slices: the state after the last one, and all records.
fn read(
    parts: &[EncodedResult],
    count: u32,
) -> Result<(EvolutionState, Vec<EvolutionRecord>), Box<dyn Error>> {
    let (mut last, mut records) = (None, Vec::new());
    for part in parts {
        let (record, state): Part = serde_json::from_slice(&part.solution)?;
        records.extend(record);
        last = Some(state);
    }
    let last = last.filter(|_| parts.len() == count as usize);
    Ok((last.ok_or("slices are missing")?, records))
}
