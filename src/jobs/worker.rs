//! Claim one job, solve it, record what became of it.
//!
//! The async side of a worker claims, renews the lease and finishes; the arithmetic runs on a thread of the worker's
//! own, so that a busy solver starves nobody. A lease is renewed only while the solver ticks: a heartbeat shall prove
//! that the solver moves, not that the process lives. A solver that does not listen any more is left behind with its
//! thread, and the worker goes on with a new one.

use std::pin::pin;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use tokio::sync::oneshot;
use tokio::time::{MissedTickBehavior, interval, sleep};
use tracing::{Instrument, Span};
use uuid::Uuid;

use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::remark::RemarkEntry;
use crate::jobs::Shared;
use crate::jobs::error::JobsError;
use crate::jobs::job::{Failure, FailureKind, Job, State};
use crate::jobs::results::Encoded;
use crate::jobs::solver_thread::{INTERNAL, Outcome, SolverThread, solve_guarded};
use crate::jobs::store::{Claim, Ending, Placed, Renewal, StoredCase};
use crate::jobs::trace::Traced;
use crate::jobs::watch::{Reason, Watch};
use crate::jobs::wishes::too_late;

/// How often an idle worker looks for jobs although nobody woke it.
const POLL: Duration = Duration::from_secs(1);
/// How long a solver that was told to stop may go on before its thread is left behind.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);
/// One worker with its solver thread.
#[derive(Debug)]
pub struct Worker {
    pub(super) shared: Arc<Shared>,
    pub(super) name: String,
    pub(super) thread: SolverThread,
}

/// What became of one [`Worker::step`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Nothing was queued.
    Idle,
    /// The job has ended in this state.
    Ended(Uuid, State),
    /// The job went back to the queue, its attempt uncounted.
    HandedBack(Uuid),
    /// The job had been given away; the outcome was discarded.
    Lost(Uuid),
}

impl Worker {
    pub(super) fn new(shared: Arc<Shared>, name: &str) -> Result<Worker, JobsError> {
        Ok(Worker {
            shared,
            name: name.to_owned(),
            thread: SolverThread::start(name)?,
        })
    }

    /// Steps until the service drains.
    pub(super) async fn run(mut self) {
        let shared = self.shared.clone();
        let recovered = shared.recovered.wait();
        let _ = shared.draining.run_until_cancelled(recovered).await;
        while !shared.draining.is_cancelled() {
            match self.group_step().await {
                Ok(false) => {}
                Ok(true) => continue,
                Err(error) => tracing::error!(worker = self.name, %error, "worker step failed"),
            }
            tokio::select! {
                () = shared.wake.notified() => {}
                () = sleep(POLL) => {}
                () = shared.draining.cancelled() => {}
            }
        }
    }

    /// Claims at most one job and sees it to its end, its return to the queue, or its loss.
    ///
    /// # Errors
    /// The database failed; a claimed job is then taken back when its lease runs out.
    pub async fn step(&mut self) -> Result<Step, JobsError> {
        let lease = lease_ms(&self.shared);
        let Some(claim) = self
            .shared
            .store
            .claim(&self.name, self.shared.now_ms(), lease)
            .await?
        else {
            return Ok(Step::Idle);
        };
        let span = tracing::info_span!("job", job = %claim.id, attempt = claim.attempt, method = claim.method);
        self.attempt(&claim).instrument(span).await
    }

    pub(super) async fn attempt(&mut self, claim: &Claim) -> Result<Step, JobsError> {
        let start = Instant::now();
        tracing::info!(worker = self.name, "job started");
        let watch = Arc::new(Watch::default());
        let _registered = Registered::new(&self.shared, claim.id, &watch);
        // Read after registering: a cancellation is either seen here or finds the watch.
        let mut cases = self.shared.store.cases(&[claim.id]).await?;
        let Some((case, cancel_requested)) = cases.remove(&claim.id) else {
            return Ok(Step::Lost(claim.id));
        };
        if cancel_requested {
            watch.stop(Reason::Cancel);
        }
        let outcome = self.solve(claim, &watch, case).await?;
        let step = self.record(claim, &watch, outcome).await?;
        let seconds = start.elapsed().as_secs_f64();
        match step {
            Step::Ended(_, state) => tracing::info!(state = state.name(), seconds, "job ended"),
            Step::HandedBack(_) => tracing::info!(seconds, "job handed back to the queue"),
            Step::Lost(_) | Step::Idle => {
                tracing::warn!(seconds, "job lost to another attempt, outcome discarded")
            }
        }
        Ok(step)
    }

    /// Has the case solved on the solver thread, and keeps the lease meanwhile.
    async fn solve(
        &mut self,
        claim: &Claim,
        watch: &Arc<Watch>,
        case: StoredCase,
    ) -> Result<Outcome, JobsError> {
        let (reply, outcome) = oneshot::channel();
        let task = {
            let (shared, watch, span) = (self.shared.clone(), watch.clone(), Span::current());
            let traced = shared.traced(claim);
            Box::new(move || {
                let solve = || solve_guarded(&shared, &watch, &case);
                let outcome = span.in_scope(|| Traced::solving(traced.as_ref(), solve));
                // An abandoned attempt has nobody listening.
                let _ = reply.send(outcome);
            })
        };
        if !self.thread.give(task) {
            // The thread is gone, which no panic of a solver can do; the attempt counts, a new thread takes over.
            self.thread = SolverThread::start(&self.name)?;
            return Ok(Outcome::Broken(Failure::new(
                FailureKind::Internal,
                "the solver thread had died",
            )));
        }
        let mut outcome = pin!(outcome);
        let mut beat = interval(heartbeat(&self.shared));
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut held = Lease::new(&self.shared);
        let mut told = false;
        let mut patience = pin!(sleep(Duration::ZERO));
        loop {
            tokio::select! {
                biased;
                outcome = &mut outcome => {
                    return Ok(outcome.unwrap_or_else(|_| Outcome::Broken(Failure::new(
                        FailureKind::Panic,
                        "the solver thread died",
                    ))));
                }
                _ = beat.tick() => self.beat(claim, watch, &mut held).await,
                () = self.shared.stopping.cancelled(), if !told => {}
                () = &mut patience, if told => {
                    tracing::warn!("the solver does not stop; its thread is left behind");
                    self.thread = SolverThread::start(&self.name)?;
                    return Ok(Outcome::Abandoned);
                }
            }
            let stopping = self.shared.stopping.is_cancelled();
            if stopping {
                watch.stop(Reason::Shutdown);
            }
            // A cancelled solver may take its time, the lease bounds it; otherwise nobody waits for ever.
            let give_up = stopping || held.lost;
            if give_up && !told {
                told = true;
                patience.set(sleep(PATIENCE));
            }
        }
    }

    /// One heartbeat: renews the lease if the solver has moved, gives up if the lease is over.
    async fn beat(&self, claim: &Claim, watch: &Watch, held: &mut Lease) {
        let ticks = watch.ticks();
        if ticks == held.ticks {
            if self.shared.now_ms() >= held.until {
                held.lose(watch);
            }
            return;
        }
        let now = self.shared.now_ms();
        let lease = lease_ms(&self.shared);
        match self
            .shared
            .store
            .renew(claim, watch.progress(), now, lease)
            .await
        {
            Ok(Renewal::Held { cancel_requested }) => {
                held.ticks = ticks;
                held.until = now.saturating_add(lease);
                if cancel_requested {
                    watch.stop(Reason::Cancel);
                }
            }
            Ok(Renewal::Lost) => held.lose(watch),
            Err(error) => tracing::warn!(%error, "lease could not be renewed"),
        }
    }

    /// Writes down what became of an attempt.
    async fn record(
        &self,
        claim: &Claim,
        watch: &Watch,
        outcome: Outcome,
    ) -> Result<Step, JobsError> {
        let traced = self
            .shared
            .traced(claim)
            .map(|traced| (traced, SystemTime::now()));
        let ending = match judge(outcome, watch) {
            Verdict::Lost => return Ok(Step::Lost(claim.id)),
            Verdict::HandBack => return self.hand_back(claim).await,
            Verdict::End(ending) => ending,
            Verdict::Keep {
                result,
                remarks,
                field_patches,
            } => match self.place(claim, watch, result).await {
                Ok(result) => Ending::Succeeded {
                    remarks,
                    result,
                    field_patches,
                },
                // The service stops while the disk takes nothing.
                Err(error) if error.trouble().is_some() => return self.hand_back(claim).await,
                Err(error) => not_stored(&error),
            },
        };
        let Some(job) = self.finish(claim, &ending).await? else {
            return Ok(Step::Lost(claim.id));
        };
        if let Some((traced, from)) = traced {
            traced.stored(from, job.state.name());
        }
        self.shared.metrics.ending(&ending);
        self.shared.announce(claim.id);
        Ok(Step::Ended(job.id, job.state))
    }

    /// Puts a result where it is kept: a small one goes into the database with the end of its job.
    pub(super) async fn place(
        &self,
        claim: &Claim,
        watch: &Watch,
        result: Encoded,
    ) -> Result<Placed, JobsError> {
        if result.bytes() <= self.shared.options.small_result_max_bytes {
            return Ok(Placed::Table(result));
        }
        // A slow disk shall not cost the lease of a long solve; should it be lost all the same, the end of the job is
        // fenced. After a short solve the lease is as good as new.
        if watch.elapsed() >= heartbeat(&self.shared) {
            let lease = lease_ms(&self.shared);
            let renewal =
                self.shared
                    .store
                    .renew(claim, watch.progress(), self.shared.now_ms(), lease);
            if let Err(error) = renewal.await {
                tracing::warn!(%error, "lease could not be renewed");
            }
        }
        let bytes = result.bytes() as u64;
        let shared = &self.shared;
        let folder = shared
            .write_patiently(|| shared.results.put(claim, result.clone()))
            .await?;
        Ok(Placed::Folder(folder, bytes))
    }

    /// Ends the job in the table; a database that fails for a while does not cost the result.
    async fn finish(&self, claim: &Claim, ending: &Ending) -> Result<Option<Job>, JobsError> {
        let shared = &self.shared;
        shared
            .write_patiently(|| shared.store.finish(claim, ending, shared.now_ms()))
            .await
    }

    pub(super) async fn hand_back(&self, claim: &Claim) -> Result<Step, JobsError> {
        Ok(
            match self
                .shared
                .store
                .release(claim, self.shared.now_ms())
                .await?
            {
                Some(state) if state.ended() => {
                    self.shared.metrics.ended(state, 1);
                    self.shared.announce(claim.id);
                    Step::Ended(claim.id, state)
                }
                Some(_) => Step::HandedBack(claim.id),
                None => Step::Lost(claim.id),
            },
        )
    }
}

/// What follows from the outcome of an attempt.
pub(super) enum Verdict {
    /// There is an answer to keep.
    Keep {
        result: Encoded,
        remarks: Vec<RemarkEntry>,
        field_patches: u32,
    },
    /// The job ends without one.
    End(Ending),
    /// The job goes back to the queue, its attempt uncounted.
    HandBack,
    /// The lease is gone.
    Lost,
}

/// What follows from the outcome of an attempt.
pub(super) fn judge(outcome: Outcome, watch: &Watch) -> Verdict {
    let failed = |reason: String| {
        tracing::error!(reason, "a job fails inside the service");
        Verdict::End(Ending::Failed(Failure::new(
            FailureKind::Internal,
            INTERNAL,
        )))
    };
    match outcome {
        Outcome::Solved { .. } if watch.reason() == Some(Reason::Lost) => Verdict::Lost,
        Outcome::Solved {
            result,
            remarks,
            field_patches,
        } => Verdict::Keep {
            result,
            remarks,
            field_patches,
        },
        Outcome::Unsolved(SolveError::Cancelled) | Outcome::Abandoned => match watch.reason() {
            Some(Reason::Cancel) => Verdict::End(Ending::Cancelled),
            Some(Reason::Shutdown) => Verdict::HandBack,
            Some(Reason::Lost) => Verdict::Lost,
            Some(Reason::Deadline) => Verdict::End(Ending::Failed(too_late())),
            None => failed("the solver stopped although nobody asked it to".to_owned()),
        },
        Outcome::Unsolved(error) => match Failure::of_solve(&error) {
            Some(failure) => Verdict::End(Ending::Failed(failure)),
            None => failed(error.to_string()),
        },
        Outcome::Refused(error) => {
            failed(format!("the stored case is no longer accepted: {error}"))
        }
        Outcome::Broken(failure) => Verdict::End(Ending::Failed(failure)),
    }
}

/// The end of a job whose result could not be stored.
pub(super) fn not_stored(error: &JobsError) -> Ending {
    tracing::error!(%error, "result could not be stored");
    let detail = "the result could not be stored; the service's log has the reason";
    Ending::Failed(Failure::new(FailureKind::Internal, detail))
}

/// The lease as the worker knows it.
struct Lease {
    ticks: u64,
    until: i64,
    lost: bool,
}

impl Lease {
    fn new(shared: &Shared) -> Lease {
        Lease {
            ticks: 0,
            until: shared.now_ms().saturating_add(lease_ms(shared)),
            lost: false,
        }
    }

    /// The lease is over, also for a solver that was told to stop for another reason before.
    fn lose(&mut self, watch: &Watch) {
        self.lost = true;
        watch.stop(Reason::Lost);
    }
}

/// An entry in the list of running attempts, as long as it lives.
pub(super) struct Registered {
    shared: Arc<Shared>,
    id: Uuid,
    watch: Arc<Watch>,
}

impl Registered {
    pub(super) fn new(shared: &Arc<Shared>, id: Uuid, watch: &Arc<Watch>) -> Registered {
        shared.running().insert(id, watch.clone());
        Registered {
            shared: shared.clone(),
            id,
            watch: watch.clone(),
        }
    }
}

impl Drop for Registered {
    fn drop(&mut self) {
        let mut running = self.shared.running();
        // Another worker may have taken the job over meanwhile; its entry stays.
        if running
            .get(&self.id)
            .is_some_and(|watch| Arc::ptr_eq(watch, &self.watch))
        {
            running.remove(&self.id);
        }
    }
}

/// Time between two heartbeats of a worker, and between two looks of the reaper.
pub(super) fn heartbeat(shared: &Shared) -> Duration {
    (shared.options.lease / 3).max(Duration::from_millis(1))
}

pub(super) fn lease_ms(shared: &Shared) -> i64 {
    i64::try_from(shared.options.lease.as_millis()).unwrap_or(i64::MAX)
}
