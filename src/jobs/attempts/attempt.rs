//! Attempts at claimed jobs: solver threads, controls and leases.
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, Weak, mpsc};
use std::time::{Duration, Instant};

use tokio::sync::OwnedMutexGuard;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::attempts::slices::{Outcome, SlicedWork};
use crate::error::{JobsError, Result};
use crate::model::Queue;
use crate::store::{Claim, ClaimedCase};
use crate::sync::lock;
use railhead_contact::monitor::{Monitor, Stop};

/// Blocks of at least this size, in bytes, are returned to the system when they are freed. By default glibc raises this
/// limit to 32 MiB with the blocks that it sees freed, and keeps smaller ones. 400 mixed cases on four workers peak at 351
/// to 361 MB by default, and at 255 to 261 MB with the numbers below, for 7 % more processor time (`cargo bench --bench
/// load -- memory`, two and three runs; 1 MiB for this one costs more).
const BLOCK_BYTES: i32 = 4 << 20;
/// Free memory at the end of a heap, in bytes, from which on it is returned to the system.
const FREE_BYTES: i32 = 32 << 20;
/// Environment variables that override these settings.
const VARIABLES: [&str; 4] = [
    "GLIBC_TUNABLES",
    "MALLOC_ARENA_MAX",
    "MALLOC_MMAP_THRESHOLD_",
    "MALLOC_TRIM_THRESHOLD_",
];

/// Bounds the freed memory that the process keeps, unless the environment configures it. The number of heaps is the number
/// of cores; the default is eight per core. To be called before other threads start.
#[cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    expect(unsafe_code, reason = "a function of the C library")
)]
pub fn bound_heap() {
    if VARIABLES
        .iter()
        .any(|name| std::env::var_os(name).is_some())
    {
        return;
    }
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let heaps = i32::try_from(cores.max(2)).unwrap_or(i32::MAX);
        // SAFETY: the function takes numbers, and locks what it changes.
        unsafe {
            libc::mallopt(libc::M_ARENA_MAX, heaps);
            libc::mallopt(libc::M_MMAP_THRESHOLD, BLOCK_BYTES);
            libc::mallopt(libc::M_TRIM_THRESHOLD, FREE_BYTES);
        }
    }
}

/// Returns free pages to the system. glibc keeps pages between blocks that are in use: about 100 MB after 900 motions of a
/// creep map, whose operators are allocated between permanent blocks.
#[cfg_attr(
    all(target_os = "linux", target_env = "gnu"),
    expect(unsafe_code, reason = "a function of the C library")
)]
pub(crate) fn give_memory_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the function takes a number, touches free memory only and locks every arena while it does.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Tasks of at least this length return free memory to the system, which walks the whole heap.
const LONG: Duration = Duration::from_secs(1);

/// Stack of a solver thread.
const STACK_BYTES: usize = 16 << 20;

/// A task of a solver thread.
pub(crate) type Task = Box<dyn FnOnce() + Send>;

/// A thread that runs tasks one after the other until its handle is dropped.
#[derive(Debug)]
pub(crate) struct SolverThread {
    tasks: mpsc::Sender<Task>,
    /// Set when the thread is abandoned; it counts as abandoned until it ends.
    pub(crate) left: Arc<OnceLock<Counted>>,
}

/// Counts one in a shared counter until it is dropped.
#[derive(Debug)]
pub(crate) struct Counted(Arc<AtomicUsize>);

impl Counted {
    /// Counts one in this counter.
    pub(crate) fn new(counter: &Arc<AtomicUsize>) -> Counted {
        counter.fetch_add(1, Ordering::AcqRel);
        Counted(counter.clone())
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl SolverThread {
    /// Starts a thread with this name.
    pub(crate) fn start(name: &str) -> Result<SolverThread> {
        let (tasks, todo) = mpsc::channel::<Task>();
        let left = Arc::new(OnceLock::new());
        let until_the_end = left.clone();
        std::thread::Builder::new()
            .name(name.to_owned())
            .stack_size(STACK_BYTES)
            .spawn(move || {
                while let Ok(task) = todo.recv() {
                    let began = Instant::now();
                    task();
                    if began.elapsed() >= LONG {
                        give_memory_back();
                    }
                }
                drop(until_the_end);
            })
            .map_err(JobsError::Thread)?;
        Ok(SolverThread { tasks, left })
    }

    /// Runs a task on the thread; `false` if the thread has ended.
    pub(crate) fn give(&self, task: Task) -> bool {
        self.tasks.send(task).is_ok()
    }
}

/// Why a running solve was stopped. The first reason is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The client cancelled the job.
    Cancel,
    /// The service shuts down; the job returns to the queue.
    Shutdown,
    /// The lease was lost; the outcome is discarded.
    Lost,
    /// The deadline of the job has passed.
    Deadline,
    /// A job that was expected to be short takes too long; it returns to the queue.
    TooLong,
}

/// Control of one attempt at a job. The solver ticks; the worker reads the progress and stops it.
#[derive(Debug, Default)]
pub struct AttemptControl {
    reason: OnceLock<StopReason>,
    ticks: AtomicU64,
    progress: AtomicU64,
    clock: Mutex<SolveClock>,
    taken_up: AtomicBool,
}

/// Elapsed time of a solve, without pauses.
#[derive(Debug, Default)]
struct SolveClock {
    /// Time before the current period.
    spent: Duration,
    /// Start of the current period; `None` while paused.
    since: Option<Instant>,
}

impl AttemptControl {
    /// Marks the job as started by the solver thread.
    pub fn mark_started(&self) {
        self.taken_up.store(true, Ordering::Release);
    }

    /// Marks the job as not started, or not resumed.
    pub fn reset_started(&self) {
        self.taken_up.store(false, Ordering::Release);
    }

    /// Whether the solver thread has started the job.
    #[must_use]
    pub fn is_started(&self) -> bool {
        self.taken_up.load(Ordering::Acquire)
    }

    /// Starts the clock of the solve at the time spent before. `contact` compares it with the time limit of the case. No
    /// effect while the clock runs.
    pub fn begin(&self, spent: Duration) {
        let mut clock = lock(&self.clock);
        if clock.since.is_none() {
            *clock = SolveClock {
                spent,
                since: Some(Instant::now()),
            };
        }
    }

    /// Stops the clock and returns the total time spent.
    pub fn pause(&self) -> Duration {
        let spent = self.elapsed();
        *lock(&self.clock) = SolveClock { spent, since: None };
        spent
    }

    /// Stops the solver at its next tick.
    pub fn stop(&self, reason: StopReason) {
        // The first reason is kept.
        let _ = self.reason.set(reason);
    }

    /// Why the solver was stopped, if it was.
    #[must_use]
    pub fn reason(&self) -> Option<StopReason> {
        self.reason.get().copied()
    }

    /// Number of ticks of the solver. A constant number means that the solver makes no progress.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Acquire)
    }

    /// Progress as last reported, from 0 to 1.
    #[must_use]
    pub fn progress(&self) -> f64 {
        f64::from_bits(self.progress.load(Ordering::Acquire))
    }
}

impl Monitor for AttemptControl {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.ticks.fetch_add(1, Ordering::AcqRel);
        if progress.is_finite() {
            self.progress
                .store(progress.clamp(0.0, 1.0).to_bits(), Ordering::Release);
        }
        if self.reason().is_some() {
            return ControlFlow::Break(Stop::Cancelled);
        }
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        let clock = lock(&self.clock);
        clock.spent + clock.since.map_or(Duration::ZERO, |since| since.elapsed())
    }
}

/// The leases of an attempt. They are renewed until this is dropped.
#[derive(Debug)]
pub(crate) struct GroupLease(pub(crate) Arc<HeldLeases>);

#[derive(Debug, Default)]
pub(crate) struct HeldLeases {
    pub(crate) leases: Mutex<Vec<(Claim, Arc<AttemptControl>)>>,
    /// Whether a solver runs, which has to tick.
    pub(crate) solving: AtomicBool,
    /// Number of solves that ended; each counts as a tick.
    pub(crate) solved: AtomicU64,
    /// Number of ticks at the last renewal.
    pub(crate) seen: AtomicU64,
    /// Expiry of the leases, by the steady clock in ms.
    pub(crate) until: AtomicI64,
    /// Cancelled when the leases expire because the solver makes no progress.
    pub(crate) lost: CancellationToken,
}

/// All leases of this process.
#[derive(Debug, Default)]
pub(crate) struct AllLeases(Mutex<Vec<Weak<HeldLeases>>>);

impl AllLeases {
    /// Adds the leases of an attempt.
    pub(crate) fn add(&self, held: &Arc<HeldLeases>) {
        lock(&self.0).push(Arc::downgrade(held));
    }

    /// The leases of current attempts.
    pub(crate) fn held(&self) -> Vec<Arc<HeldLeases>> {
        let mut all = lock(&self.0);
        all.retain(|held| held.strong_count() > 0);
        all.iter().filter_map(Weak::upgrade).collect()
    }

    /// The jobs of current attempts.
    pub(crate) fn ids(&self) -> Vec<Uuid> {
        let held = self.held();
        let ids = held.iter().flat_map(|held| {
            let leases = held.leases();
            leases.iter().map(|(claim, _)| claim.id).collect::<Vec<_>>()
        });
        ids.collect()
    }

    /// Stops the solver of a job; `false` if this process does not run it.
    pub(crate) fn stop(&self, id: Uuid, reason: StopReason) -> bool {
        let mut found = false;
        for held in self.held() {
            for (_, control) in held.leases().iter().filter(|(claim, _)| claim.id == id) {
                control.stop(reason);
                found = true;
            }
        }
        found
    }
}

impl GroupLease {
    /// Sets whether a solver runs, which has to tick.
    pub(crate) fn solving(&self, solving: bool) {
        self.0.solving.store(solving, Ordering::Release);
    }
}

impl Drop for GroupLease {
    fn drop(&mut self) {
        // An abandoned solver thread may keep the rest.
        self.0.leases().clear();
    }
}

impl HeldLeases {
    pub(crate) fn leases(&self) -> MutexGuard<'_, Vec<(Claim, Arc<AttemptControl>)>> {
        lock(&self.leases)
    }

    pub(crate) fn ticks(&self) -> u64 {
        let ticks: u64 = self
            .leases()
            .iter()
            .map(|(_, control)| control.ticks())
            .sum();
        ticks + self.solved.load(Ordering::Acquire)
    }
}

/// One claimed job of an attempt.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) claim: Claim,
    pub(crate) control: Arc<AttemptControl>,
    pub(crate) phase: Phase,
    /// The case, until it is passed to a thread.
    pub(crate) case: Option<ClaimedCase>,
    /// The state between two slices, once it is known.
    pub(crate) sliced: Option<Box<SlicedWork>>,
}

/// Phase of a claimed job.
#[derive(Debug)]
pub(crate) enum Phase {
    /// To be solved, or being solved.
    Solving,
    /// The solve has ended.
    Solved(Outcome),
    /// Not begun; returns to the queue.
    NotBegun,
    /// Equal to this earlier job of the group, whose result it gets.
    WaitingFor(Uuid),
    /// Ended or released.
    Done,
}

/// Claimed jobs, and the thread that solves them one after the other.
#[derive(Debug)]
pub(crate) struct Attempt {
    pub(crate) queue: Queue,
    pub(crate) members: Vec<Member>,
    pub(crate) lease: GroupLease,
    /// Held if a job of the attempt ran when a process crashed: this process solves no other such job at the same time.
    pub(crate) _suspect: Option<OwnedMutexGuard<()>>,
    /// Whether the job is a sweep that was in the queue between two of its slices.
    pub(crate) was_begun: bool,
    /// Start of the attempt's time slice.
    pub(crate) turn_began: Instant,
    /// Solver time since the last start of the thread.
    pub(crate) spent: Duration,
    pub(crate) solver: Option<Solver>,
}

/// Outcomes that the thread has produced, with the indices of their members.
pub(crate) type Outcomes = Arc<Mutex<Vec<(usize, Outcome)>>>;

/// A solver thread at work.
#[derive(Debug)]
pub(crate) struct Solver {
    pub(crate) thread: SolverThread,
    pub(crate) outcomes: Outcomes,
    /// Cancelled when there will be no more outcomes.
    pub(crate) over: CancellationToken,
    /// Set to prevent the start of further members.
    pub(crate) closed: Arc<Mutex<bool>>,
}

impl Attempt {
    /// The indices of the members that are to be solved.
    pub(crate) fn to_solve(&self) -> Vec<usize> {
        let members = self.members.iter().enumerate();
        let solving = members.filter(|(_, member)| matches!(member.phase, Phase::Solving));
        solving.map(|(place, _)| place).collect()
    }

    /// Moves the available outcomes to the members.
    pub(crate) fn take_outcomes(&mut self) {
        if let Some(solver) = &self.solver {
            let mut outcomes = lock(&solver.outcomes);
            for (place, outcome) in outcomes.drain(..) {
                self.members[place].phase = Phase::Solved(outcome);
            }
        }
    }

    /// Cancelled when there will be no more outcomes.
    pub(crate) fn over(&self) -> CancellationToken {
        if let Some(solver) = &self.solver {
            return solver.over.clone();
        }
        let none = CancellationToken::new();
        none.cancel();
        none
    }

    /// Prevents the start of further members; those that the thread has not started return to the queue.
    pub(crate) fn close(&mut self) {
        if let Some(solver) = &self.solver {
            *lock(&solver.closed) = true;
        }
        self.take_outcomes();
        for member in &mut self.members {
            let solving = member.control.is_started() && member.sliced.is_none();
            if matches!(member.phase, Phase::Solving) && !solving {
                member.phase = Phase::NotBegun;
            }
        }
    }

    /// Ends members that are being solved as abandoned. Returns the thread, which is to be abandoned.
    pub(crate) fn abandon(&mut self) -> Option<SolverThread> {
        self.close();
        for member in &mut self.members {
            if matches!(member.phase, Phase::Solving) {
                member.phase = Phase::Solved(Outcome::Abandoned);
            }
        }
        self.take_thread()
    }

    /// Takes the thread, which has nothing more to do.
    pub(crate) fn take_thread(&mut self) -> Option<SolverThread> {
        self.solver.take().map(|solver| solver.thread)
    }

    /// Whether some members wait for another member of this attempt. A sweep that is about to begin its next slice waits
    /// for nobody.
    pub(crate) fn has_more_to_begin(&self) -> bool {
        let solving = self.to_solve();
        let waits = |index: &usize| !self.members[*index].control.is_started();
        solving.len() > 1 && solving.iter().any(waits)
    }

    /// Stops every member.
    pub(crate) fn stop(&self, reason: StopReason) {
        for member in &self.members {
            member.control.stop(reason);
        }
    }

    /// The member that is being solved, if it was cancelled or its deadline has passed.
    pub(crate) fn unwanted(&self) -> Option<usize> {
        self.members.iter().position(|member| {
            let reason = member.control.reason();
            matches!(member.phase, Phase::Solving)
                && member.control.is_started()
                && matches!(reason, Some(StopReason::Cancel | StopReason::Deadline))
        })
    }

    /// Claims of the members in certain phases.
    pub(crate) fn claims(&self, is: impl Fn(&Phase) -> bool) -> Vec<Claim> {
        let members = self.members.iter().filter(|member| is(&member.phase));
        members.map(|member| member.claim.clone()).collect()
    }

    /// Marks members as done, whose leases are not renewed any more.
    pub(crate) fn done(&mut self, ids: &[Uuid]) {
        let mut leases = self.lease.0.leases();
        leases.retain(|(claim, _)| !ids.contains(&claim.id));
        drop(leases);
        for member in &mut self.members {
            if ids.contains(&member.claim.id) {
                member.phase = Phase::Done;
            }
        }
    }

    /// Lets members wait for an earlier member with an equal case.
    pub(crate) fn set_aside_duplicates(&mut self) {
        let mut firsts = HashMap::new();
        for member in &mut self.members {
            let Some(key) = member.claim.cache_key else {
                continue;
            };
            if !matches!(member.phase, Phase::Solving) {
                continue;
            }
            let first = *firsts.entry(key).or_insert(member.claim.id);
            if first != member.claim.id {
                member.phase = Phase::WaitingFor(first);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Kind;

    #[test]
    fn the_first_reason_to_stop_stays() {
        let control = AttemptControl::default();
        assert_eq!(control.tick(0.5), ControlFlow::Continue(()));
        control.stop(StopReason::Cancel);
        control.stop(StopReason::Shutdown);
        assert_eq!(control.reason(), Some(StopReason::Cancel));
        assert_eq!(control.tick(0.6), ControlFlow::Break(Stop::Cancelled));
        assert_eq!(control.ticks(), 2);
    }

    #[test]
    fn the_clock_counts_the_solve_and_what_was_spent_before() {
        let control = AttemptControl::default();
        assert_eq!(control.elapsed(), Duration::ZERO);
        let before = Duration::from_secs(100);
        control.begin(before);
        let first = control.elapsed();
        control.begin(Duration::ZERO);
        assert!(first >= before && control.elapsed() >= first);
        let spent = control.pause();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(control.elapsed(), spent, "nothing is solved meanwhile");
        control.begin(spent);
        assert!(control.elapsed() >= spent);
    }

    #[test]
    fn progress_stays_a_fraction() {
        let control = AttemptControl::default();
        let _ = control.tick(7.0);
        assert!((control.progress() - 1.0).abs() < f64::EPSILON);
        let _ = control.tick(f64::NAN);
        assert!((control.progress() - 1.0).abs() < f64::EPSILON);
    }

    fn attempt(jobs: u32) -> Attempt {
        let claim = || Claim {
            id: Uuid::now_v7(),
            attempt: 1,
            lease_token: 1,
            method: "auto".to_owned(),
            traceparent: None,
            cache_key: None,
            suspect: false,
            slices: 0,
        };
        let member = |claim: Claim| Member {
            claim,
            control: Arc::default(),
            phase: Phase::Solving,
            case: None,
            sliced: None,
        };
        Attempt {
            queue: Queue {
                tenant: "t".into(),
                kind: Kind::Case,
            },
            members: (0..jobs).map(|_| member(claim())).collect(),
            lease: GroupLease(Arc::default()),
            _suspect: None,
            was_begun: false,
            turn_began: Instant::now(),
            spent: Duration::ZERO,
            solver: None,
        }
    }

    #[tokio::test]
    async fn a_sweep_between_two_slices_waits_behind_nobody() {
        let alone = attempt(1);
        assert!(
            !alone.has_more_to_begin(),
            "its thread has yet to come to it"
        );
        let group = attempt(2);
        group.members[0].control.mark_started();
        assert!(group.has_more_to_begin());
        group.members[1].control.mark_started();
        assert!(!group.has_more_to_begin());
    }
}
