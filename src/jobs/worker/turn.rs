//! One turn of a worker: solve for a slice of time, and record what became of the jobs.
//!
//! A turn is either a new claim, of a job or of a group of small ones, or a solve that waits at its pause point. The async side
//! claims and finishes; the arithmetic runs on a thread of the attempt's own, one at a time for each worker. When a slice
//! is over and somebody else waits, the solver is held at its pause point and the worker takes the next turn. A solver that does
//! not stop when told to is left behind with its thread, and the worker goes on with a new one.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval};

use crate::jobs::attempts::attempt::{Attempt, Phase};
use crate::jobs::attempts::attempt_control::StopReason;
use crate::jobs::attempts::outcome::Work;
use crate::jobs::attempts::solver_thread::{Counted, SolverThread};
use crate::jobs::error::JobsError;
use crate::jobs::shared::Shared;
use crate::jobs::storage_fault::StoragePlace;
use crate::jobs::store::claim::ReleaseReason;
use crate::jobs::store::submission::ClaimedCase;
use crate::jobs::worker::begin;
use crate::jobs::worker::pool::{StepReport, Turn, Worker};

/// How long a solver that was told to stop may go on before its thread is left behind.
const STOP_TIMEOUT: Duration = Duration::from_secs(2);

/// How often a worker checks whether other work waits for the solver.
const YIELD_CHECK_INTERVAL: Duration = Duration::from_millis(200);

impl Worker {
    pub(crate) async fn turn(
        &mut self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<Turn, JobsError> {
        let start = Instant::now();
        if !attempt.begun() {
            self.read_cases(attempt, step).await?;
            attempt.set_aside_duplicates();
        }
        attempt.turn_began = start;
        // A sliced case comes back after each slice.
        let turn = loop {
            let turn = self.solve(attempt).await?;
            attempt.close();
            if matches!(turn, Turn::Over) {
                self.thread = attempt.take_thread().or(self.thread.take());
            }
            self.record(attempt, step).await?;
            if matches!(turn, Turn::Held) || attempt.to_solve().is_empty() {
                break turn;
            }
        };
        let seconds = start.elapsed().as_secs_f64();
        let worker = &self.name;
        match (attempt.members.as_slice(), &turn) {
            ([member], Turn::Over) => {
                let (job, attempt) = (member.claim.id, member.claim.attempt);
                let state = step
                    .ended
                    .first()
                    .map_or("not ended", |(_, state)| state.name());
                tracing::info!(%job, attempt, worker, seconds, state, "job ended");
            }
            ([member], Turn::Held) => {
                tracing::debug!(job = %member.claim.id, worker, seconds, "job waits for its next turn");
            }
            (members, _) => {
                let (jobs, ended) = (members.len(), step.ended.len());
                tracing::info!(worker, jobs, ended, seconds, "group ended");
            }
        }
        Ok(turn)
    }

    /// Lets the solver work for one slice of time, or for as long as no other work waits.
    async fn solve(&mut self, attempt: &mut Attempt) -> Result<Turn, JobsError> {
        let shared = self.shared.clone();
        if attempt.to_solve().is_empty() {
            return Ok(Turn::Over);
        }
        // Shared by all that is solved, except by what may have killed a process before.
        let _alone = if attempt.suspect {
            let _waits = WaitingSuspect::new(&shared);
            SolveGuard::Alone(shared.solo.clone().write_owned().await)
        } else {
            SolveGuard::Beside(shared.solo.clone().read_owned().await)
        };
        if attempt.begun() || attempt.suspect {
            let solving = attempt.claims(|phase| matches!(phase, Phase::Solving));
            shared
                .write_with_retries(StoragePlace::Table, || {
                    shared.store.set_solving(&solving, true)
                })
                .await?;
        }
        if !attempt.begun() {
            self.begin(attempt).await?;
        }
        let _working = shared.metrics.working();
        attempt.lease.solving(true);
        attempt.pause_point.open();
        let turn = self.until_over(attempt).await;
        attempt.lease.solving(false);
        if matches!(turn, Turn::Held) {
            attempt.close();
            let held = attempt.claims(|phase| matches!(phase, Phase::Solving));
            shared
                .write_with_retries(StoragePlace::Table, || {
                    shared.store.set_solving(&held, false)
                })
                .await?;
        }
        Ok(turn)
    }

    async fn begin(&mut self, attempt: &mut Attempt) -> Result<(), JobsError> {
        let places = attempt.to_solve();
        let mut work = Vec::with_capacity(places.len());
        for place in places {
            let member = &mut attempt.members[place];
            if let Some(sliced) = member.sliced.take() {
                work.push((place, self.next_of(member.claim.id, sliced).await?));
                continue;
            }
            match member.case.take() {
                Some(ClaimedCase {
                    case,
                    cancel_requested,
                    ..
                }) => {
                    if cancel_requested {
                        member.control.stop(StopReason::Cancel);
                    }
                    let notes = match member.claim.slices {
                        0 => Vec::new(),
                        _ => self.shared.store.slices(member.claim.id).await?,
                    };
                    work.push((place, Work::New(case, notes)));
                }
                None => member.phase = Phase::Done,
            }
        }
        let thread = match self.thread.take() {
            Some(thread) => thread,
            None => SolverThread::start(&self.name)?,
        };
        begin::begin(&self.shared, attempt, thread, work);
        Ok(())
    }

    /// Waits until the solver is done or is held at its pause point; stops or holds it when its time is up.
    async fn until_over(&self, attempt: &mut Attempt) -> Turn {
        let shared = &self.shared;
        let spent = attempt.on;
        let (start, mut charged) = (Instant::now(), Instant::now());
        let turn_began = attempt.turn_began;
        let slice = shared.options.slice;
        let mut check = interval(YIELD_CHECK_INTERVAL.min(slice.max(Duration::from_millis(1))));
        check.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told: Option<Instant> = None;
        // The member that was told to stop, and since when its solver has gone on all the same.
        let mut unwanted: Option<(usize, Instant)> = None;
        let mut closed = false;
        let pause_point = attempt.pause_point.clone();
        let lost = attempt.lease.lost().clone();
        let over = attempt.over();
        let turn = loop {
            tokio::select! {
                biased;
                () = over.cancelled() => break Turn::Over,
                () = pause_point.reached(), if closed => break Turn::Held,
                () = shared.stopping.cancelled(), if told.is_none() => {
                    attempt.stop(StopReason::Shutdown);
                    pause_point.open();
                    (told, closed) = (Some(Instant::now()), false);
                }
                () = lost.cancelled(), if told.is_none() => told = Some(Instant::now()),
                _ = check.tick() => {
                    attempt.take_outcomes();
                    shared.turns.charge(&attempt.queue, charged.elapsed(), spent);
                    charged = Instant::now();
                    unwanted = attempt.unwanted().map(|member| {
                        let same = unwanted.filter(|(before, _)| *before == member);
                        same.unwrap_or_else(|| (member, Instant::now()))
                    });
                    let mut since = told.into_iter().chain(unwanted.map(|(_, since)| since));
                    if since.any(|since| since.elapsed() >= STOP_TIMEOUT) {
                        tracing::warn!("the solver does not stop; its thread is left behind");
                        self.leave_behind(attempt.abandon());
                        break Turn::Over;
                    }
                    if told.is_none() && !closed && turn_began.elapsed() >= slice
                        && (attempt.has_more_to_begin() || self.somebody_waits().await) {
                        closed = self.hold(attempt);
                    }
                }
            }
        };
        shared
            .turns
            .charge(&attempt.queue, charged.elapsed(), spent);
        attempt.spent += start.elapsed();
        turn
    }

    /// Whether a case that has just stored a slice goes back to the queue. It does so only after half of its time has passed: then the
    /// next slice would probably be interrupted.
    pub(crate) async fn makes_room(&self, attempt: &Attempt) -> bool {
        let slice = self.shared.options.slice;
        attempt.turn_began.elapsed() >= slice / 2 && self.somebody_waits().await
    }

    /// Closes the pause point, if one more solver may wait. If not, the solver goes on, or, where all pause points are taken, gives a job back that was
    /// claimed because it was expected to be short.
    fn hold(&self, attempt: &Attempt) -> bool {
        let options = &self.shared.options;
        let (parked, bytes) = self.shared.turns.parked();
        if parked >= options.parked_max {
            attempt.stop_begun(StopReason::TooLong);
            return false;
        }
        if bytes.saturating_add(attempt.memory_bytes()) > options.parked_bytes_max {
            return false;
        }
        attempt.pause_point.close();
        true
    }

    /// Does other work wait for the solver?
    async fn somebody_waits(&self) -> bool {
        let shared = &self.shared;
        if shared.suspects_waiting.load(Ordering::Acquire) > 0 {
            return true;
        }
        if shared.draining.is_cancelled() {
            return shared.turns.parked().0 > 0;
        }
        shared.turns.parked().0 > 0
            || shared
                .store
                .queues()
                .await
                .is_ok_and(|queues| !queues.is_empty())
    }

    /// Leaves a thread behind whose solver does not stop. Nothing but the end of the process ends such threads, so that too many of
    /// them shut the service down.
    fn leave_behind(&self, thread: Option<SolverThread>) {
        let Some(thread) = thread else { return };
        let shared = &self.shared;
        let left = shared.abandoned.fetch_add(1, Ordering::AcqRel) + 1;
        // The thread drops the other end of this with itself.
        let _ = thread.left.set(Counted(shared.abandoned.clone()));
        drop(thread);
        let most = shared.options.abandoned_max;
        tracing::error!(left, most, "a solver thread was left behind");
        if left > most {
            shared.broken.cancel();
        }
    }

    /// Releases what is still held after the store has failed.
    pub(crate) async fn give_up(&mut self, attempt: &mut Attempt) {
        attempt.stop(StopReason::Shutdown);
        attempt.pause_point.open();
        if attempt.begun() {
            let over = attempt.over();
            let ended = tokio::time::timeout(STOP_TIMEOUT, over.cancelled()).await;
            if ended.is_err() {
                self.leave_behind(attempt.abandon());
            } else {
                attempt.take_outcomes();
                self.thread = attempt.take_thread();
            }
        }
        let held = attempt.claims(|phase| !matches!(phase, Phase::Done));
        let mut step = StepReport::default();
        let released = self.release(attempt, &held, ReleaseReason::NotBegun, &mut step);
        if let Err(error) = released.await {
            tracing::warn!(%error, "claimed jobs could not be given back; their leases will run out");
        }
    }
}

/// The right to solve: beside others, or alone.
enum SolveGuard {
    Beside(#[expect(dead_code, reason = "held")] tokio::sync::OwnedRwLockReadGuard<()>),
    Alone(#[expect(dead_code, reason = "held")] tokio::sync::OwnedRwLockWriteGuard<()>),
}

/// A suspect waits to be solved alone, so that the others make room.
struct WaitingSuspect(Arc<Shared>);

impl WaitingSuspect {
    fn new(shared: &Arc<Shared>) -> WaitingSuspect {
        shared.suspects_waiting.fetch_add(1, Ordering::AcqRel);
        WaitingSuspect(shared.clone())
    }
}

impl Drop for WaitingSuspect {
    fn drop(&mut self) {
        self.0.suspects_waiting.fetch_sub(1, Ordering::AcqRel);
    }
}
