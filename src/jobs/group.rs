//! Small jobs in groups: claimed together, solved one after the other on the worker's thread, ended together.
//!
//! A small job is solved faster than a transaction is written, so one transaction serves many. The promises stay: each
//! job has its own fence, its own watch and its own end. A group that dies goes back to the queue uncounted and its
//! jobs are then taken one at a time, so that only a job that dies alone counts an attempt. Of identical jobs one is
//! solved.

use std::collections::{HashMap, HashSet};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant, SystemTime};

use tokio::sync::oneshot;
use tokio::time::{MissedTickBehavior, interval, sleep};
use tracing::Instrument;
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::job::State;
use crate::jobs::solver_thread::{Outcome, SolverThread, solve_guarded};
use crate::jobs::store::sqlite::groups::GroupBounds;
use crate::jobs::store::{Claim, Ending, StoredCase};
use crate::jobs::trace::Traced;
use crate::jobs::watch::{Reason, Watch};
use crate::jobs::worker::{
    PATIENCE, Registered, Verdict, Worker, heartbeat, judge, lease_ms, not_stored,
};

/// Largest sum of expected solve times in a group, in µs.
const GROUP_COST_US: u64 = 200_000;
/// A group that takes longer hands back what it has not begun.
const GROUP_TIME: Duration = Duration::from_millis(400);

/// One job of a group.
struct Member {
    claim: Claim,
    watch: Arc<Watch>,
    case: StoredCase,
    _registered: Registered,
}

impl Worker {
    /// Claims a job or a group of small ones and sees them to their end; `false` if nothing was queued.
    ///
    /// # Errors
    /// The database failed; claimed jobs are then taken back when their lease runs out.
    pub(super) async fn group_step(&mut self) -> Result<bool, JobsError> {
        let options = &self.shared.options;
        let bounds = GroupBounds {
            jobs: options.group_max.max(1),
            cost_us: GROUP_COST_US,
            workers: options.workers,
        };
        let (shared, lease) = (&self.shared, lease_ms(&self.shared));
        let skip = shared.underway().abandoned.clone();
        let mut claims = shared
            .store
            .claim_group(&self.name, shared.now_ms(), lease, bounds, &skip)
            .await?;
        if claims.is_empty() {
            return Ok(false);
        }
        if self.shared.options.cache {
            claims = self.answer_from_earlier(claims).await?;
        } else {
            claims.iter_mut().for_each(|claim| claim.reuse_key = None);
        }
        let twins = set_aside_twins(&mut claims);
        match claims.as_slice() {
            [] => {}
            [claim] if twins.is_empty() => {
                let span = tracing::info_span!("job", job = %claim.id, attempt = claim.attempt, method = claim.method);
                self.attempt(claim).instrument(span).await?;
            }
            _ => self.attempt_group(claims).await?,
        }
        self.answer_with(twins).await?;
        Ok(true)
    }

    /// Ends those of the claimed jobs whose result has been there since they were queued; returns the others.
    async fn answer_from_earlier(&self, claims: Vec<Claim>) -> Result<Vec<Claim>, JobsError> {
        let keys: Vec<_> = claims.iter().filter_map(|claim| claim.reuse_key).collect();
        let sources = self.shared.store.sources(&keys).await?;
        let (known, others): (Vec<_>, Vec<_>) = claims.into_iter().partition(|claim| {
            claim
                .reuse_key
                .is_some_and(|key| sources.contains_key(&key))
        });
        let pairs = known.into_iter().filter_map(|claim| {
            let source = *sources.get(&claim.reuse_key?)?;
            Some((claim, source))
        });
        self.answer_with(pairs.collect()).await?;
        Ok(others)
    }

    /// Ends claimed jobs with the results of these others; where there is none, the job goes back to the queue.
    async fn answer_with(&self, pairs: Vec<(Claim, Uuid)>) -> Result<(), JobsError> {
        if pairs.is_empty() {
            return Ok(());
        }
        let shared = &self.shared;
        let from = shared.options.tracer.is_some().then(SystemTime::now);
        let ended = shared
            .write_patiently(|| shared.store.finish_with_sources(&pairs, shared.now_ms()))
            .await?;
        let ids: Vec<_> = ended.iter().copied().collect();
        shared.metrics.looked_up(ids.len() as u64, 0);
        if let Some(from) = from {
            let claims = pairs.iter().map(|(claim, _)| claim);
            for claim in claims.filter(|claim| ended.contains(&claim.id)) {
                if let Some(traced) = shared.traced(claim) {
                    traced.waited_until(from);
                    traced.stored(from, State::Succeeded.name());
                }
            }
        }
        shared.ended_cached(&ids);
        let back = pairs.into_iter().map(|(claim, _)| claim);
        let back: Vec<_> = back.filter(|claim| !ended.contains(&claim.id)).collect();
        let released = shared.store.release_to_be_solved(&back, shared.now_ms());
        self.note_released(&released.await?);
        Ok(())
    }

    async fn attempt_group(&mut self, claims: Vec<Claim>) -> Result<(), JobsError> {
        let start = Instant::now();
        let registered: Vec<_> = claims
            .into_iter()
            .map(|claim| {
                let watch = Arc::new(Watch::default());
                let registered = Registered::new(&self.shared, claim.id, &watch);
                (claim, watch, registered)
            })
            .collect();
        // Read after registering: a cancellation is either seen here or finds the watch.
        let ids: Vec<_> = registered.iter().map(|(claim, ..)| claim.id).collect();
        let mut cases = self.shared.store.cases(&ids).await?;
        let members = registered
            .into_iter()
            .filter_map(|(claim, watch, registered)| {
                let (case, cancel_requested) = cases.remove(&claim.id)?;
                if cancel_requested {
                    watch.stop(Reason::Cancel);
                }
                Some(Member {
                    claim,
                    watch,
                    case,
                    _registered: registered,
                })
            });
        let members: Vec<Member> = members.collect();
        let outcomes = self.solve_group(&members).await?;
        let solved = outcomes.len();
        let ended = self.record_group(&members, outcomes).await?;
        tracing::info!(
            worker = self.name,
            jobs = members.len(),
            solved,
            ended,
            seconds = start.elapsed().as_secs_f64(),
            "group ended"
        );
        Ok(())
    }

    /// Has the cases solved on the solver thread and keeps the leases meanwhile. Returns the outcomes of the first
    /// jobs; the others were not begun.
    async fn solve_group(&mut self, members: &[Member]) -> Result<Vec<Outcome>, JobsError> {
        let (reply, outcomes) = oneshot::channel();
        let begun = Arc::new(AtomicUsize::new(0));
        let task = {
            let (shared, begun) = (self.shared.clone(), begun.clone());
            let work: Vec<_> = members
                .iter()
                .map(|member| {
                    let traced = shared.traced(&member.claim);
                    (member.watch.clone(), member.case.clone(), traced)
                })
                .collect();
            Box::new(move || {
                let start = Instant::now();
                let mut outcomes = Vec::with_capacity(work.len());
                for (watch, case, traced) in work {
                    if start.elapsed() > GROUP_TIME || shared.stopping.is_cancelled() {
                        break;
                    }
                    begun.fetch_add(1, Ordering::AcqRel);
                    let solve = || solve_guarded(&shared, &watch, &case);
                    outcomes.push(Traced::solving(traced.as_ref(), solve));
                }
                // An abandoned group has nobody listening.
                let _ = reply.send(outcomes);
            })
        };
        if !self.thread.give(task) {
            self.thread = SolverThread::start(&self.name)?;
            return Ok(Vec::new());
        }
        let mut outcomes = pin!(outcomes);
        let mut beat = interval(heartbeat(&self.shared));
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut until = self.shared.now_ms().saturating_add(lease_ms(&self.shared));
        let mut seen = 0;
        let mut told = false;
        let mut patience = pin!(sleep(Duration::ZERO));
        loop {
            let mut lost = false;
            tokio::select! {
                biased;
                outcomes = &mut outcomes => return Ok(outcomes.unwrap_or_default()),
                _ = beat.tick() => {
                    let ticks = begun.load(Ordering::Acquire) as u64
                        + members.iter().map(|member| member.watch.ticks()).sum::<u64>();
                    if ticks != seen {
                        seen = ticks;
                        self.renew_group(members, &mut until).await;
                    }
                    lost = self.shared.now_ms() >= until;
                }
                () = self.shared.stopping.cancelled(), if !told => {}
                () = &mut patience, if told => {
                    tracing::warn!("the solver does not stop; its thread is left behind");
                    self.thread = SolverThread::start(&self.name)?;
                    return Ok(Vec::new());
                }
            }
            let stopping = self.shared.stopping.is_cancelled();
            if (stopping || lost) && !told {
                let reason = if lost { Reason::Lost } else { Reason::Shutdown };
                for member in members {
                    member.watch.stop(reason);
                }
                told = true;
                patience.set(sleep(PATIENCE));
            }
        }
    }

    async fn renew_group(&self, members: &[Member], until: &mut i64) {
        let claims: Vec<_> = members.iter().map(|member| member.claim.clone()).collect();
        let (now, lease) = (self.shared.now_ms(), lease_ms(&self.shared));
        match self.shared.store.renew_group(&claims, now, lease).await {
            Ok(held) => {
                *until = now.saturating_add(lease);
                for member in members {
                    match held.get(&member.claim.id) {
                        Some(true) => member.watch.stop(Reason::Cancel),
                        Some(false) => {}
                        None => member.watch.stop(Reason::Lost),
                    }
                }
            }
            Err(error) => tracing::warn!(%error, "leases could not be renewed"),
        }
    }

    /// Writes down what became of a group; returns how many jobs ended.
    async fn record_group(
        &self,
        members: &[Member],
        outcomes: Vec<Outcome>,
    ) -> Result<usize, JobsError> {
        let from = self.shared.options.tracer.is_some().then(SystemTime::now);
        let mut ends = Vec::with_capacity(outcomes.len());
        let mut back: Vec<&Member> = members[outcomes.len()..]
            .iter()
            .filter(|member| member.watch.reason() != Some(Reason::Lost))
            .collect();
        for (member, outcome) in members.iter().zip(outcomes) {
            let ending = match judge(outcome, &member.watch) {
                Verdict::Lost => continue,
                Verdict::HandBack => {
                    back.push(member);
                    continue;
                }
                Verdict::End(ending) => ending,
                Verdict::Keep {
                    result,
                    remarks,
                    field_patches,
                } => match self.place(&member.claim, &member.watch, result).await {
                    Ok(result) => Ending::Succeeded {
                        remarks,
                        result,
                        field_patches,
                    },
                    Err(error) if error.trouble().is_some() => {
                        back.push(member);
                        continue;
                    }
                    Err(error) => not_stored(&error),
                },
            };
            ends.push((member.claim.clone(), ending));
        }
        let ended = self.finish_group(&ends).await?;
        for (claim, ending) in &ends {
            if ended.contains(&claim.id) {
                if let (Some(from), Some(traced)) = (from, self.shared.traced(claim)) {
                    traced.stored(from, ending.state().name());
                }
                self.shared.metrics.ending(ending);
                self.shared.announce(claim.id);
            }
        }
        let back: Vec<_> = back.iter().map(|member| member.claim.clone()).collect();
        self.hand_back_group(&back).await?;
        Ok(ended.len())
    }

    async fn hand_back_group(&self, claims: &[Claim]) -> Result<(), JobsError> {
        let now = self.shared.now_ms();
        self.note_released(&self.shared.store.release_group(claims, now).await?);
        Ok(())
    }

    fn note_released(&self, released: &[(Uuid, State)]) {
        for (id, state) in released.iter().filter(|(_, state)| state.ended()) {
            self.shared.metrics.ended(*state, 1);
            self.shared.announce(*id);
        }
    }

    /// Ends the jobs in the table; a database that fails for a while does not cost the results.
    async fn finish_group(&self, ends: &[(Claim, Ending)]) -> Result<HashSet<Uuid>, JobsError> {
        let shared = &self.shared;
        shared
            .write_patiently(|| shared.store.finish_group(ends, shared.now_ms()))
            .await
    }
}

/// Takes out jobs that are identical to an earlier one of the group; each with that one.
fn set_aside_twins(claims: &mut Vec<Claim>) -> Vec<(Claim, Uuid)> {
    let mut firsts = HashMap::new();
    let mut twins = Vec::new();
    claims.retain(|claim| {
        let Some(key) = claim.reuse_key else {
            return true;
        };
        let first = *firsts.entry(key).or_insert(claim.id);
        if first != claim.id {
            twins.push((claim.clone(), first));
        }
        first == claim.id
    });
    twins
}
