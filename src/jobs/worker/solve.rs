//! Tasks of a solver thread for one job: check, solve, encode.
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use bytes::Bytes;
use serde_json::json;
use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;

use crate::attempts::attempt::{
    Attempt, AttemptControl, Member, Outcomes, Phase, Solver, SolverThread, Task,
};
use crate::attempts::slices::{Ended, Outcome, SlicedTask, SlicedWork, Solved, Work};
use crate::codec::fields::encode;
use crate::codec::result::EncodedResult;
use crate::error::{JobsError, Result};
use crate::model::{Failure, FailureKind, Kind, Queue};
use crate::run::model::{REASON, REMARKS, RunChunk, RunHead, parted};
use crate::shared::Shared;
use crate::store::{Claim, SliceRecord, StoredCase};
use crate::sync::lock;
use crate::trace::JobTrace;
use crate::worker::{evolution, heartbeat};
use railhead_contact::error::SolveError;
use railhead_contact::evaluate::answer::RowsAnswer;
use railhead_contact::evaluate::many::solve_many;
use railhead_contact::evolution::task::Evolution;
use railhead_contact::monitor::Monitor;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::slices::joined;
use railhead_contact::solution::words::answer::{Fields, PatchFields, Solution};
use railhead_tables::parquet;
use railhead_tables::table::{RowTable, TableColumn};

/// Runs a task; a panic becomes a failure, and the thread stays usable.
pub(crate) fn solve_guarded(shared: &Shared, control: &AttemptControl, work: Work) -> Outcome {
    let done = catch_unwind(AssertUnwindSafe(|| match work {
        Work::New(stored, notes) => check_and_solve(shared, control, &stored, &notes),
        Work::Next(sliced) => solve_next(shared, control, sliced),
        Work::Join(sliced, parts) => join_parts(shared, control, sliced, &parts),
    }));
    let ended = done.unwrap_or_else(|payload| {
        // The message of a panic is for the log, not for clients.
        tracing::error!(reason = panic_text(payload.as_ref()), "the solver panicked");
        let detail = "the solver stopped on an internal error; the service's log has the reason";
        Ok(Outcome::Broken(Failure::new(FailureKind::Panic, detail)))
    });
    ended.unwrap_or_else(|early| *early)
}

fn check_and_solve(
    shared: &Shared,
    control: &AttemptControl,
    stored: &StoredCase,
    notes: &[SliceRecord],
) -> Ended {
    if stored.kind == Kind::Rows {
        return solve_chunk(shared, control, stored);
    }
    let case = stored.value().map_err(|error| error.to_string())?;
    let limits = &shared.options.limits;
    if stored.kind == Kind::Evolution {
        let sliced = SlicedWork::evolution(Evolution::check(&case, limits)?, notes);
        return solve_next(shared, control, Box::new(sliced));
    }
    let mut checked = (shared.engine.check)(&shared.engine.known, &case, limits)?;
    let limit = shared.options.time_limit;
    checked.run.time_limit = Some(checked.run.time_limit.map_or(limit, |time| time.min(limit)));
    let slices = (shared.engine.slices)(&checked);
    let sliced = SlicedWork::case(checked, slices, notes);
    solve_next(shared, control, Box::new(sliced))
}

/// Solves the next slice. If there is none, or the current state is unknown, the outcome requests the stored slices.
fn solve_next(shared: &Shared, control: &AttemptControl, mut sliced: Box<SlicedWork>) -> Ended {
    if sliced.waits_for_parts() {
        return Ok(Outcome::Slice { sliced, part: None });
    }
    let spent = sliced.spent;
    let (motions, spent, part) = match &mut sliced.task {
        SlicedTask::Case { checked, slices } => {
            let slice = slices[sliced.done as usize].clone();
            control.begin(spent);
            let solved = (shared.engine.solve)(checked, slice.clone(), control);
            let spent = control.pause();
            let (solution, fields) = solved.map_err(|error| Outcome::Unsolved {
                error,
                remarks: checked.remarks.clone(),
            })?;
            if slices.len() <= 1 {
                return whole(shared, checked, spent, solution, &fields);
            }
            (slice.end, spent, encoded(&solution, &fields)?)
        }
        SlicedTask::Evolution { task, state } => {
            evolution::advance(shared, control, task, state, spent)?
        }
    };
    let part = Some((sliced.record(motions, spent), part));
    Ok(Outcome::Slice { sliced, part })
}

/// Joins the stored slices if all are solved, or else continues from them.
fn join_parts(
    shared: &Shared,
    control: &AttemptControl,
    mut sliced: Box<SlicedWork>,
    parts: &[EncodedResult],
) -> Ended {
    let spent = sliced.spent;
    let joined = match &mut sliced.task {
        _ if parts.len() != sliced.done as usize => {
            Err(JobsError::Damaged("slices are missing".to_owned()))
        }
        SlicedTask::Case { checked, .. } => match join(parts, || control.tick(1.0).is_continue()) {
            Ok(Some((solution, fields))) => {
                return whole(shared, checked, spent, solution, &fields);
            }
            Ok(None) => {
                return Ok(Outcome::Unsolved {
                    error: SolveError::Cancelled,
                    remarks: sliced.remarks(),
                });
            }
            Err(error) => Err(error),
        },
        SlicedTask::Evolution { task, state } => evolution::join(task, state, parts),
    };
    match joined {
        Ok(Some(solved)) => return Ok(Outcome::Solved(solved)),
        Ok(None) => {}
        Err(error) => {
            tracing::error!(%error, "the stored slices cannot be used; the job is solved again");
            sliced.begin_again();
        }
    }
    solve_next(shared, control, sliced)
}

/// The outcome of a case that is solved completely.
fn whole(
    shared: &Shared,
    checked: &CheckedCase,
    spent: Duration,
    solution: Solution,
    fields: &Fields,
) -> Ended {
    let method = checked.run.method_asked;
    shared
        .metrics
        .solved(method, &solution, spent.as_secs_f64());
    Ok(Outcome::Solved(Solved {
        result: encoded(&solution, fields)?,
        field_patches: u32::try_from(fields.patches.len()).unwrap_or(u32::MAX),
        remarks: solution.remarks,
    }))
}

/// Encodes a solution, or a part of one, for storage.
fn encoded(solution: &Solution, fields: &Fields) -> Result<EncodedResult, String> {
    let packed = match fields.patches.len() {
        0 => None,
        _ => Some(encode(fields).map_err(|e| format!("the fields cannot be packed: {e}"))?),
    };
    Ok(EncodedResult {
        fields: packed.map(Bytes::from),
        ..EncodedResult::as_json(solution)?
    })
}

/// Joins the parts of a solution in the order of their slices, of which there is at least one. `go_on` is called before each
/// part.
///
/// # Errors
/// A part cannot be read, or does not match the others. `None` if `go_on` returned `false`.
fn join(parts: &[EncodedResult], go_on: impl Fn() -> bool) -> Result<Option<(Solution, Fields)>> {
    let mut patches = None;
    let answers = parts.iter().map(|part| {
        if !go_on() {
            return Err(None);
        }
        let (solution, fields) = read(part).map_err(Some)?;
        let own = [solution.patches.len(), fields.patches.len()];
        if *patches.get_or_insert(own) != own {
            let reason = "the slices of a sweep have different patches";
            return Err(Some(JobsError::Damaged(reason.to_owned())));
        }
        Ok((solution, fields))
    });
    joined(answers).map_or_else(|error| error.map_or(Ok(None), Err), |whole| Ok(Some(whole)))
}

fn read(part: &EncodedResult) -> Result<(Solution, Fields)> {
    let damaged = |error: serde_json::Error| JobsError::Damaged(format!("a slice: {error}"));
    let solution: Solution = serde_json::from_slice(&part.solution).map_err(damaged)?;
    let patches = match &part.fields {
        None => Vec::new(),
        Some(_) => (0..solution.patches.len())
            .map(|patch| part.patch_fields(patch, None))
            .collect::<Result<Vec<PatchFields>>>()?,
    };
    Ok((solution, Fields { patches }))
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message")
}

/// Solves a chunk of rows; its answers are a Parquet file.
pub(crate) fn solve_chunk(shared: &Shared, control: &AttemptControl, stored: &StoredCase) -> Ended {
    let (head, chunk) = read_rows(stored).map_err(|error| error.to_string())?;
    let first_row = chunk.first_row;
    let (varied, carried) = parted(&head, chunk);
    let task = shared.rows_task(&head.case, &varied, &head.profiles);
    control.begin(Duration::ZERO);
    let solve =
        |checked: &CheckedCase, monitor: &dyn Monitor| shared.engine.solve_whole(checked, monitor);
    let solved = solve_many(&task, &solve, control);
    control.pause();
    let answer = solved?;
    let rows = answer.status.len();
    let without = answer.without_answer();
    shared.metrics.rows_ended(&answer);
    let file = parquet::encode(&table(&head, first_row, carried, &answer));
    let file = file.map_err(|error| format!("a chunk of rows cannot be written: {error}"))?;
    Ok(Outcome::Solved(Solved {
        result: EncodedResult {
            solution: Bytes::from(json!({ "rows": rows, "without_answer": without }).to_string()),
            fields: Some(Bytes::from(file)),
        },
        remarks: Vec::new(),
        field_patches: u32::try_from(without).unwrap_or(u32::MAX),
    }))
}

fn read_rows(stored: &StoredCase) -> Result<(RunHead, RunChunk)> {
    let head = RunHead::read(
        stored.template.as_deref().unwrap_or_default(),
        stored.head.as_deref(),
    )?;
    let chunk = RunChunk::read(&stored.body, &head.columns)?;
    Ok((head, chunk))
}

/// The answers, with the columns of [`RunHead::answers`].
fn table(
    head: &RunHead,
    first_row: u64,
    carried: Vec<(String, TableColumn)>,
    answer: &RowsAnswer,
) -> RowTable {
    let count = answer.status.len();
    let rows = (first_row..).take(count);
    let rows = TableColumn::Integers(rows.map(u64::cast_signed).collect());
    let texts = |text: &dyn Fn(usize) -> Option<String>| {
        let texts = (0..count).map(|row| text(row).filter(|text| !text.is_empty()));
        TableColumn::Texts(texts.collect())
    };
    let mut columns = vec![("row".to_owned(), rows)];
    columns.extend(carried);
    let status = texts(&|row| Some(answer.status[row].name().to_owned()));
    columns.push(("status".to_owned(), status));
    let method = texts(&|row| Some(answer.method(row)?.name().to_owned()));
    columns.push(("method".to_owned(), method));
    let numbers = answer.numbers.iter().map(|(_, numbers)| numbers.clone());
    let numbers = head.numbers.iter().cloned().zip(numbers);
    columns.extend(numbers.map(|(name, values)| (name, TableColumn::Numbers(values))));
    if head.with_reasons {
        let reasons = texts(&|row| Some(answer.reason(row)));
        columns.push((REASON.to_owned(), reasons));
    }
    if head.with_remarks {
        let remarks = texts(&|row| Some(answer.remarks(row).to_owned()));
        columns.push((REMARKS.to_owned(), remarks));
    }
    RowTable { columns }
}

/// After this time a group releases the jobs that it has not begun.
const GROUP_TIME: Duration = Duration::from_millis(400);

/// Creates an attempt at claimed jobs, whose leases are renewed from now on.
pub(crate) fn new_attempt(
    shared: &Arc<Shared>,
    queue: Queue,
    claims: Vec<Claim>,
    suspect: Option<OwnedMutexGuard<()>>,
) -> Attempt {
    let was_begun = claims.iter().any(|claim| claim.slices > 0);
    let members: Vec<Member> = claims
        .into_iter()
        .map(|claim| Member {
            claim,
            control: Arc::default(),
            phase: Phase::Solving,
            case: None,
            sliced: None,
        })
        .collect();
    let held = members
        .iter()
        .map(|one| (one.claim.clone(), one.control.clone()));
    Attempt {
        queue,
        lease: heartbeat::keep(shared, held.collect()),
        members,
        _suspect: suspect,
        was_begun,
        turn_began: Instant::now(),
        spent: Duration::ZERO,
        solver: None,
    }
}

/// Passes tasks for the members with these indices to a thread.
pub(crate) fn begin(
    shared: &Arc<Shared>,
    attempt: &mut Attempt,
    thread: SolverThread,
    work: Vec<(usize, Work)>,
) {
    attempt.spent = Duration::ZERO;
    let outcomes = Outcomes::default();
    let over = CancellationToken::new();
    let closed = Arc::new(Mutex::new(false));
    let work: Vec<_> = work
        .into_iter()
        .map(|(place, work)| {
            let member = &attempt.members[place];
            member.control.reset_started();
            let traced = JobTrace::of(shared.options.tracer.as_ref(), &member.claim);
            (place, member.control.clone(), work, traced)
        })
        .collect();
    let task: Task = {
        let (shared, closed) = (shared.clone(), closed.clone());
        let (lease, over) = (attempt.lease.0.clone(), over.clone().drop_guard());
        let outcomes = outcomes.clone();
        Box::new(move || {
            let _over = over;
            let start = Instant::now();
            for (number, (place, control, work, traced)) in work.into_iter().enumerate() {
                let late = number > 0 && start.elapsed() > GROUP_TIME;
                {
                    let closed = lock(&closed);
                    if late || *closed || shared.stopping.is_cancelled() {
                        break;
                    }
                    control.mark_started();
                }
                let from_queue = matches!(work, Work::New(..));
                let solve = || solve_guarded(&shared, &control, work);
                let outcome = JobTrace::solving(traced.as_ref(), from_queue, solve);
                let mut outcomes = lock(&outcomes);
                outcomes.push((place, outcome));
                lease.solved.fetch_add(1, Ordering::AcqRel);
            }
        })
    };
    if thread.give(task) {
        attempt.solver = Some(Solver {
            thread,
            outcomes,
            over,
            closed,
        });
        return;
    }
    // The thread has ended, which no panic of a solver causes.
    let died = || Failure::new(FailureKind::Internal, "the solver thread had died");
    for place in attempt.to_solve() {
        attempt.members[place].phase = Phase::Solved(Outcome::Broken(died()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attempts::slices::tests::checked_case;
    use crate::engine::Engine;
    use railhead_contact::monitor::Unmonitored;

    #[test]
    fn parts_read_from_where_they_were_stored_are_the_answer_bit_for_bit() {
        let checked = checked_case();
        let engine = Engine::contact();
        let mut parts = Vec::new();
        let solved = [0..3, 3..5, 5..7].map(|cut| {
            let (solution, fields) = (engine.solve)(&checked, cut, &Unmonitored).unwrap();
            parts.push(EncodedResult {
                solution: Bytes::from(serde_json::to_vec(&solution).unwrap()),
                fields: Some(Bytes::from(encode(&fields).unwrap())),
            });
            Ok::<_, SolveError>((solution, fields))
        });
        let (solution, fields) = join(&parts, || true).unwrap().unwrap();
        let (expected, expected_fields) = joined(solved).unwrap();
        assert_eq!(solution.total.len(), 7);
        assert_eq!(
            serde_json::to_vec(&solution).unwrap(),
            serde_json::to_vec(&expected).unwrap()
        );
        assert_eq!(encode(&fields).unwrap(), encode(&expected_fields).unwrap());
        assert!(join(&parts, || false).unwrap().is_none());
        parts[1].fields = None;
        assert!(matches!(join(&parts, || true), Err(JobsError::Damaged(_))));
        parts[1].solution = Bytes::from_static(b"{");
        assert!(join(&parts, || true).is_err());
    }
}
