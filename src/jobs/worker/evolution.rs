//! Tasks of a solver thread for an evolution: steps up to the next record, then the whole result.

use std::sync::Arc;
use std::time::Duration;

use crate::attempts::attempt::AttemptControl;
use crate::attempts::slices::{Outcome, Solved};
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::shared::Shared;
use railhead_contact::error::SolveError;
use railhead_contact::evolution::task::{Evolution, SolveContext};
use railhead_contact::solution::words::evolution::{EvolutionRecord, EvolutionState};

/// Maximum number of steps in one slice; a record ends it earlier.
const STEPS: u32 = 16;

/// Content of a slice: the record at its end, if any, and the state after it.
type Part = (Option<EvolutionRecord>, EvolutionState);

/// Takes the next steps from `state`, which it updates, after a solver time of `spent`. Returns the number of steps so far,
/// the solver time, and the slice.
pub(crate) fn advance(
    shared: &Shared,
    control: &AttemptControl,
    task: &Evolution,
    state: &mut Option<EvolutionState>,
    spent: Duration,
) -> Result<(usize, Duration, EncodedResult), Box<Outcome>> {
    let limit = shared.options.time_limit;
    let before = state.take().unwrap_or_else(|| task.begin());
    let context = SolveContext {
        threads: shared.options.workers,
        operators: shared.engine.operators.clone(),
        known: Arc::clone(&shared.engine.known),
    };
    control.begin(spent);
    let solved = if spent < limit {
        task.steps(&context, before, STEPS, control)
    } else {
        let out_of_time = SolveError::OutOfTime {
            limit_s: Some(limit.as_secs_f64()),
            motions: None,
        };
        Evolution::end_early(&before, out_of_time).map(|state| (state, None))
    };
    let spent = control.pause();
    let (after, record) = solved?;
    let part = EncodedResult::as_json(&(record, &after))?;
    let steps = after.steps as usize;
    *state = Some(after);
    Ok((steps, spent, part))
}

/// Reads the current state from the stored slices. Returns the result if all are solved.
pub(crate) fn join(
    task: &Evolution,
    state: &mut Option<EvolutionState>,
    parts: &[EncodedResult],
) -> Result<Option<Solved>> {
    let damaged = |reason: String| JobsError::Damaged(format!("a slice: {reason}"));
    let mut records = Vec::new();
    for part in parts {
        let read = serde_json::from_slice(&part.solution);
        let (record, after): Part = read.map_err(|error| damaged(error.to_string()))?;
        records.extend(record);
        *state = Some(after);
    }
    let Some(last) = state.as_ref().filter(|state| task.is_over(state)) else {
        return Ok(None);
    };
    let answer = task.answer(last, records);
    Ok(Some(Solved {
        result: EncodedResult::as_json(&answer).map_err(damaged)?,
        remarks: answer.remarks,
        field_patches: 0,
    }))
}
