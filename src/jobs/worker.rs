//! Take whose turn it is, solve for a slice of time, record what became of it.
//!
//! A turn is either a new claim, of a job or of a group of small ones, or a solve that waits at its gate. The async side
//! claims and finishes; the arithmetic runs on a thread of the attempt's own, one at a time for each worker. When a slice
//! is over and somebody else waits, the solver is held at its gate and the worker takes the next turn. A solver that does
//! not listen any more is left behind with its thread, and the worker goes on with a new one.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use tokio::time::{MissedTickBehavior, interval, sleep};
use uuid::Uuid;

use crate::jobs::Shared;
use crate::jobs::attempt::{Attempt, Phase};
use crate::jobs::error::JobsError;
use crate::jobs::job::State;
use crate::jobs::solver_thread::{SolverThread, Work};
use crate::jobs::store::{Claim, ClaimRequest, Release, Which};
use crate::jobs::turns::{Long, Spent};
use crate::jobs::watch::Reason;

/// How often an idle worker looks for jobs although nobody woke it.
const POLL: Duration = Duration::from_secs(1);
/// How long a solver that was told to stop may go on before its thread is left behind.
const PATIENCE: Duration = Duration::from_secs(2);
/// Largest sum of expected solve times in a group, in µs.
const GROUP_COST_US: u64 = 200_000;
/// How often a worker looks whether somebody waits for the solver.
const LOOK_ROUND: Duration = Duration::from_millis(200);

/// One worker. It has at most one solver at work.
#[derive(Debug)]
pub struct Worker {
    pub(super) shared: Arc<Shared>,
    name: String,
    /// A thread without work.
    thread: Option<SolverThread>,
}

/// What became of one [`Worker::step`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Step {
    /// There was something to be done.
    pub busy: bool,
    /// Jobs that ended, with their states.
    pub ended: Vec<(Uuid, State)>,
    /// Jobs that went back to the queue, their attempts uncounted.
    pub handed_back: Vec<Uuid>,
    /// Jobs that had been given away; their outcomes were discarded.
    pub lost: Vec<Uuid>,
    /// Jobs whose solve waits for its next turn.
    pub parked: Vec<Uuid>,
}

/// How a turn ended.
enum Turn {
    /// The solver is done, or was left behind.
    Over,
    /// The solver waits at its gate.
    Held,
}

impl Worker {
    pub(super) fn new(shared: Arc<Shared>, name: &str) -> Result<Worker, JobsError> {
        Ok(Worker {
            thread: Some(SolverThread::start(name)?),
            shared,
            name: name.to_owned(),
        })
    }

    /// Steps until the service drains and nothing waits at a gate.
    pub(super) async fn run(mut self) {
        let shared = self.shared.clone();
        let recovered = shared.recovered.wait();
        let _ = shared.draining.run_until_cancelled(recovered).await;
        while !shared.draining.is_cancelled() || shared.turns.parked().0 > 0 {
            match self.step().await {
                Ok(step) if step.busy => continue,
                Ok(_) => {}
                Err(error) => tracing::error!(worker = self.name, %error, "worker step failed"),
            }
            tokio::select! {
                () = shared.wake.notified() => {}
                () = sleep(POLL) => {}
                () = shared.draining.cancelled() => {}
            }
        }
    }

    /// Takes one turn and sees what was claimed for it to its end, its return to the queue, its loss, or its gate.
    ///
    /// # Errors
    /// The database failed; claimed jobs are given back if that is possible, or taken back when their leases run out.
    pub async fn step(&mut self) -> Result<Step, JobsError> {
        let Some(mut attempt) = self.next_turn().await? else {
            return Ok(Step::default());
        };
        let mut step = Step {
            busy: true,
            ..Step::default()
        };
        let done = self.turn(&mut attempt, &mut step).await;
        match done {
            Ok(Turn::Held) => {
                let held = attempt.claims(|phase| matches!(phase, Phase::Solving));
                step.parked = held.iter().map(|claim| claim.id).collect();
                attempt.on = Spent::Parked;
                self.shared.turns.park(attempt);
                self.shared.wake.notify_one();
            }
            Ok(Turn::Over) => {}
            Err(error) => {
                self.give_up(&mut attempt).await;
                return Err(error);
            }
        }
        Ok(step)
    }

    /// What to work on next, by the turns of the tenants.
    async fn next_turn(&self) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        let turns = &shared.turns;
        if let Some(attempt) = turns.resume_stopped() {
            return Ok(Some(attempt));
        }
        if shared.draining.is_cancelled() {
            return Ok(turns.resume_any());
        }
        let tenants = shared.store.queued_tenants().await?;
        let slice = shared.options.slice;
        for tenant in turns.order(tenants) {
            let long_first = turns.queue_had_its_share(&tenant, slice);
            if long_first && let Some(attempt) = self.next_long(&tenant).await? {
                return Ok(Some(attempt));
            }
            let claims = self.claim(&tenant, Which::New).await?;
            if !claims.is_empty() {
                return Ok(Some(Attempt::new(shared, tenant, claims)));
            }
            if let Some(attempt) = self.next_long(&tenant).await? {
                return Ok(Some(attempt));
            }
        }
        Ok(None)
    }

    /// A solve of a tenant that waits for its next turn, at its gate or in the queue.
    async fn next_long(&self, tenant: &Arc<str>) -> Result<Option<Attempt>, JobsError> {
        let shared = &self.shared;
        for long in shared.turns.long_ones(tenant) {
            match long {
                Long::Parked => {
                    if let Some(attempt) = shared.turns.resume(tenant) {
                        return Ok(Some(attempt));
                    }
                }
                Long::Begun => {
                    let claims = self.claim(tenant, Which::Begun).await?;
                    if !claims.is_empty() {
                        return Ok(Some(Attempt::new(shared, tenant.clone(), claims)));
                    }
                }
            }
        }
        Ok(None)
    }

    async fn claim(&self, tenant: &str, which: Which) -> Result<Vec<Claim>, JobsError> {
        let shared = &self.shared;
        let options = &shared.options;
        let full = shared.turns.parked().0 >= options.parked_max;
        let slice_us = u64::try_from(options.slice.as_micros()).unwrap_or(u64::MAX);
        let skip = shared.underway().closed_to_workers();
        let request = ClaimRequest {
            worker: &self.name,
            tenant,
            which,
            jobs: options.group_max.max(1),
            cost_us: GROUP_COST_US,
            // With no gate free, only what should be done, or come to its next cut, within a slice.
            each_slice_us: full.then_some(slice_us),
            workers: options.workers,
            lease_until: shared.lease_until(),
            now: shared.now_ms(),
            late_before: shared.now_ms().saturating_sub(shared.leap().ms),
            skip: &skip,
        };
        let mut claims = shared.store.claim(&request).await?;
        if !options.cache {
            claims.iter_mut().for_each(|claim| claim.reuse_key = None);
        }
        Ok(claims)
    }

    async fn turn(&mut self, attempt: &mut Attempt, step: &mut Step) -> Result<Turn, JobsError> {
        let start = Instant::now();
        if !attempt.begun() {
            self.answer_known(attempt, step).await?;
            attempt.set_aside_twins();
        }
        attempt.turn_began = start;
        // A sweep comes back with every slice.
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

    /// Has the solver work for a slice, or for as long as nobody else waits.
    async fn solve(&mut self, attempt: &mut Attempt) -> Result<Turn, JobsError> {
        let shared = self.shared.clone();
        if attempt.to_solve().is_empty() {
            return Ok(Turn::Over);
        }
        // Shared by all that is solved, except by what may have killed a process before.
        let _alone = if attempt.suspect {
            let _waits = SuspectWaits::new(&shared);
            Solo::Alone(shared.solo.clone().write_owned().await)
        } else {
            Solo::Beside(shared.solo.clone().read_owned().await)
        };
        if attempt.begun() || attempt.suspect {
            let solving = attempt.claims(|phase| matches!(phase, Phase::Solving));
            shared.store.set_solving(&solving, true).await?;
        }
        if !attempt.begun() {
            self.begin(attempt).await?;
        }
        let _working = shared.metrics.working();
        attempt.keeper.solving(true);
        attempt.gate.open();
        let turn = self.until_over(attempt).await;
        attempt.keeper.solving(false);
        if matches!(turn, Turn::Held) {
            attempt.close();
            let held = attempt.claims(|phase| matches!(phase, Phase::Solving));
            shared.store.set_solving(&held, false).await?;
        }
        Ok(turn)
    }

    async fn begin(&mut self, attempt: &mut Attempt) -> Result<(), JobsError> {
        let places = attempt.to_solve();
        let members = places.iter().map(|place| &attempt.members[*place]);
        let new = members.filter(|member| member.sweep.is_none());
        let ids: Vec<_> = new.map(|member| member.claim.id).collect();
        // Read after registering: a cancellation is either seen here or finds the watch.
        let mut cases = self.shared.store.cases(&ids).await?;
        let mut work = Vec::with_capacity(places.len());
        for place in places {
            let member = &mut attempt.members[place];
            if let Some(sweep) = member.sweep.take() {
                work.push((place, self.next_of(member.claim.id, sweep).await?));
                continue;
            }
            match cases.remove(&member.claim.id) {
                Some((case, cancel_requested)) => {
                    if cancel_requested {
                        member.watch.stop(Reason::Cancel);
                    }
                    let notes = match member.claim.slices {
                        0 => Vec::new(),
                        _ => self.shared.store.slice_notes(member.claim.id).await?,
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
        attempt.begin(&self.shared, thread, work);
        Ok(())
    }

    /// Waits until the solver is done or held, and sees to it that one of them comes.
    async fn until_over(&self, attempt: &mut Attempt) -> Turn {
        let shared = &self.shared;
        let spent = attempt.on;
        let (start, mut charged) = (Instant::now(), Instant::now());
        let turn_began = attempt.turn_began;
        let slice = shared.options.slice;
        let mut look = interval(LOOK_ROUND.min(slice.max(Duration::from_millis(1))));
        look.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = None;
        let mut closed = false;
        let gate = attempt.gate.clone();
        let lost = attempt.keeper.lost().clone();
        let turn = loop {
            tokio::select! {
                biased;
                more = attempt.next_outcome() => if !more {
                    break Turn::Over;
                },
                () = gate.reached(), if closed => break Turn::Held,
                () = shared.stopping.cancelled(), if told.is_none() => {
                    attempt.stop(Reason::Shutdown);
                    gate.open();
                    (told, closed) = (Some(Instant::now()), false);
                }
                () = lost.cancelled(), if told.is_none() => told = Some(Instant::now()),
                _ = look.tick() => {
                    shared.turns.charge(&attempt.tenant, charged.elapsed(), spent);
                    charged = Instant::now();
                    if told.is_some_and(|since| since.elapsed() >= PATIENCE) {
                        tracing::warn!("the solver does not stop; its thread is left behind");
                        attempt.abandon(shared);
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
            .charge(&attempt.tenant, charged.elapsed(), spent);
        attempt.spent += start.elapsed();
        turn
    }

    /// Shall a sweep that is at a cut go back to the queue? It has had a good part of a slice by then, so that the next is
    /// hardly ever interrupted within one of its own.
    pub(super) async fn makes_room(&self, attempt: &Attempt) -> bool {
        let slice = self.shared.options.slice;
        attempt.turn_began.elapsed() >= slice / 2 && self.somebody_waits().await
    }

    /// Closes the gate, if there is room for one more solver that waits; a job that came although there was none, because
    /// it was thought to be short, goes back.
    fn hold(&self, attempt: &Attempt) -> bool {
        let options = &self.shared.options;
        let (parked, bytes) = self.shared.turns.parked();
        if parked >= options.parked_max {
            attempt.stop_begun(Reason::TooLong);
            return false;
        }
        if bytes.saturating_add(attempt.memory_bytes()) > options.parked_bytes_max {
            return false;
        }
        attempt.gate.close();
        true
    }

    /// Is there anything else that could have the solver?
    async fn somebody_waits(&self) -> bool {
        let shared = &self.shared;
        if shared.suspects_waiting.load(Ordering::Acquire) > 0 {
            return true;
        }
        if shared.draining.is_cancelled() {
            return shared.turns.parked().0 > 0;
        }
        shared.turns.parked().0 > 0 || shared.store.queued(None).await.is_ok_and(|jobs| jobs > 0)
    }

    /// Gives back what is still held after the table failed in between.
    async fn give_up(&mut self, attempt: &mut Attempt) {
        attempt.stop(Reason::Shutdown);
        attempt.gate.open();
        if attempt.begun() {
            let ended = async { while attempt.next_outcome().await {} };
            if tokio::time::timeout(PATIENCE, ended).await.is_err() {
                attempt.abandon(&self.shared);
            } else {
                self.thread = attempt.take_thread();
            }
        }
        let held = attempt.claims(|phase| !matches!(phase, Phase::Done));
        let mut step = Step::default();
        let released = self.release(attempt, &held, Release::NotBegun, &mut step);
        if let Err(error) = released.await {
            tracing::warn!(%error, "claimed jobs could not be given back; their leases will run out");
        }
    }
}

/// The right to solve: beside others, or alone.
enum Solo {
    Beside(#[expect(dead_code, reason = "held")] tokio::sync::OwnedRwLockReadGuard<()>),
    Alone(#[expect(dead_code, reason = "held")] tokio::sync::OwnedRwLockWriteGuard<()>),
}

/// Somebody waits to solve alone, so that others make room.
struct SuspectWaits(Arc<Shared>);

impl SuspectWaits {
    fn new(shared: &Arc<Shared>) -> SuspectWaits {
        shared.suspects_waiting.fetch_add(1, Ordering::AcqRel);
        SuspectWaits(shared.clone())
    }
}

impl Drop for SuspectWaits {
    fn drop(&mut self) {
        self.0.suspects_waiting.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Time between two heartbeats of a worker, and between two looks of the reaper.
pub(super) fn heartbeat(shared: &Shared) -> Duration {
    (shared.options.lease / 3).max(Duration::from_millis(1))
}
