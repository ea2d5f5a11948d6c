//! One turn of a worker: claimed jobs are solved, and their outcomes are recorded.
//!
//! A turn is a job or a group of small ones. The asynchronous part claims and finishes; the solver runs on a separate
//! thread. A sweep yields to other jobs between its slices. A solve that does not reach the end of a slice in time
//! continues; once all workers run such solves, the spare worker serves jobs that are expected to be short. A solver that
//! ignores a stop request is abandoned with its thread, and the worker continues with a new thread.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval_at};

use crate::attempts::attempt::{Attempt, Counted, Phase, SolverThread, StopReason};
use crate::attempts::slices::Work;
use crate::error::Result;
use crate::store::{ClaimedCase, ReleaseReason};
use crate::worker::pool::{StepReport, Worker};
use crate::worker::solve;

/// How long a solver may continue after a stop request before its thread is abandoned.
const STOP_TIMEOUT: Duration = Duration::from_secs(2);

/// How often a worker checks whether other work waits for the solver.
const YIELD_CHECK_INTERVAL: Duration = Duration::from_millis(200);

impl Worker {
    pub(crate) async fn turn(
        &mut self,
        attempt: &mut Attempt,
        step: &mut StepReport,
    ) -> Result<()> {
        let start = Instant::now();
        self.read_cases(attempt, step).await?;
        attempt.set_aside_duplicates();
        attempt.turn_began = start;
        // A sweep returns here after each slice.
        while !attempt.to_solve().is_empty() {
            self.begin(attempt).await?;
            let working = self.shared.metrics.working();
            attempt.lease.solving(true);
            let over = self.until_over(attempt, step).await;
            attempt.lease.solving(false);
            drop(working);
            over?;
            attempt.close();
            self.thread = attempt.take_thread().or(self.thread.take());
            self.record(attempt, step).await?;
        }
        self.record(attempt, step).await?;
        let seconds = start.elapsed().as_secs_f64();
        let worker = &self.name;
        if let [member] = attempt.members.as_slice() {
            let (job, attempt) = (member.claim.id, member.claim.attempt);
            let ended = step.ended.first();
            let state = ended.map_or("not ended", |(_, state)| state.name());
            tracing::info!(%job, attempt, worker, seconds, state, "job ended");
        } else {
            let (jobs, ended) = (attempt.members.len(), step.ended.len());
            tracing::info!(worker, jobs, ended, seconds, "group ended");
        }
        Ok(())
    }

    async fn begin(&mut self, attempt: &mut Attempt) -> Result<()> {
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
        solve::begin(&self.shared, attempt, thread, work);
        Ok(())
    }

    /// Waits until the solver has ended, and stops it when its time is up. Members of a group that were not begun within a
    /// slice return to the queue.
    async fn until_over(&self, attempt: &mut Attempt, step: &mut StepReport) -> Result<()> {
        let shared = &self.shared;
        let (start, mut charged) = (Instant::now(), Instant::now());
        let slice = shared.options.slice;
        let period = YIELD_CHECK_INTERVAL.min(slice.max(Duration::from_millis(1)));
        let mut check = interval_at((start + period).into(), period);
        check.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told: Option<Instant> = None;
        // A stopped member whose solver continues, and since when.
        let mut unwanted: Option<(usize, Instant)> = None;
        let mut long: Option<Counted> = None;
        let lost = attempt.lease.0.lost.clone();
        let over = attempt.over();
        loop {
            tokio::select! {
                biased;
                () = over.cancelled() => break,
                () = shared.stopping.cancelled(), if told.is_none() => {
                    attempt.stop(StopReason::Shutdown);
                    told = Some(Instant::now());
                }
                () = lost.cancelled(), if told.is_none() => told = Some(Instant::now()),
                _ = check.tick() => {
                    attempt.take_outcomes();
                    shared.turns.charge(&attempt.queue, charged.elapsed(), attempt.was_begun);
                    charged = Instant::now();
                    unwanted = attempt.unwanted().map(|member| {
                        let same = unwanted.filter(|(before, _)| *before == member);
                        same.unwrap_or_else(|| (member, Instant::now()))
                    });
                    let mut since = told.into_iter().chain(unwanted.map(|(_, since)| since));
                    if since.any(|since| since.elapsed() >= STOP_TIMEOUT) {
                        tracing::warn!("the solver does not stop; its thread is abandoned");
                        self.abandon_thread(attempt.abandon());
                        break;
                    }
                    if told.is_none() && long.is_none() && attempt.turn_began.elapsed() >= slice
                        && (attempt.has_more_to_begin() || self.somebody_waits().await) {
                        attempt.close();
                        self.record(attempt, step).await?;
                        if self.spare {
                            attempt.stop(StopReason::TooLong);
                        }
                        // Once all workers run such solves, the spare worker begins.
                        long = Some(Counted::new(&shared.long_solves));
                        shared.wake_spare.notify_one();
                    }
                }
            }
        }
        shared
            .turns
            .charge(&attempt.queue, charged.elapsed(), attempt.was_begun);
        attempt.spent += start.elapsed();
        Ok(())
    }

    /// Whether a job that has just stored a slice returns to the queue. It does so only after half of its time slice, when
    /// the next slice would probably exceed it.
    pub(crate) async fn makes_room(&self, attempt: &Attempt) -> bool {
        let slice = self.shared.options.slice;
        attempt.turn_began.elapsed() >= slice / 2 && (self.spare || self.somebody_waits().await)
    }

    /// Whether other jobs wait in the queues.
    async fn somebody_waits(&self) -> bool {
        let shared = &self.shared;
        let queues = shared.store.queues();
        !shared.draining.is_cancelled() && queues.await.is_ok_and(|queues| !queues.is_empty())
    }

    /// Abandons the thread of a solver that does not stop. Only the end of the process ends such threads, so too many of
    /// them shut the service down.
    fn abandon_thread(&self, thread: Option<SolverThread>) {
        let Some(thread) = thread else { return };
        let shared = &self.shared;
        // The thread drops its reference when it ends.
        let _ = thread.left.set(Counted::new(&shared.abandoned));
        drop(thread);
        let left = shared.abandoned.load(Ordering::Acquire);
        let most = shared.options.abandoned_max;
        tracing::error!(left, most, "a solver thread was abandoned");
        if left > most {
            shared.broken.cancel();
        }
    }

    /// Releases the jobs of an attempt after the store has failed.
    pub(crate) async fn give_up(&mut self, attempt: &mut Attempt) {
        attempt.stop(StopReason::Shutdown);
        if attempt.solver.is_some() {
            let over = attempt.over();
            let ended = tokio::time::timeout(STOP_TIMEOUT, over.cancelled()).await;
            if ended.is_err() {
                self.abandon_thread(attempt.abandon());
            } else {
                attempt.take_outcomes();
                self.thread = attempt.take_thread();
            }
        }
        let held = attempt.claims(|phase| !matches!(phase, Phase::Done));
        let mut step = StepReport::default();
        let released = self.release(attempt, &held, ReleaseReason::NotBegun, &mut step);
        if let Err(error) = released.await {
            tracing::warn!(%error, "claimed jobs could not be returned; their leases will expire");
        }
    }
}
