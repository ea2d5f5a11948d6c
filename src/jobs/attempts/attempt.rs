//! One attempt at claimed jobs: its thread, its control, its lease.
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

/// Blocks of at least this size, in bytes, are given back when they are freed. Left alone, glibc raises this limit to 32 MiB with the
/// blocks that it sees freed, and keeps what is below. 400 mixed cases on four workers peak at 351 to 361 MB then, and at 255 to
/// 261 MB with these three numbers, for 7 % more processor time (`cargo bench --bench load -- memory`, two and three runs; 1 MiB instead of the
/// first costs more).
const BLOCK_BYTES: i32 = 4 << 20;
/// Free memory at the end of a heap, in bytes, from which on it is given back.
const FREE_BYTES: i32 = 32 << 20;
/// Environment variables by which an operator sets the same.
const VARIABLES: [&str; 4] = [
    "GLIBC_TUNABLES",
    "MALLOC_ARENA_MAX",
    "MALLOC_MMAP_THRESHOLD_",
    "MALLOC_TRIM_THRESHOLD_",
];

/// Bounds what the process keeps of freed memory, unless the environment says how. Heaps are as many as cores: there would be eight for
/// each. To be called before there are other threads.
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

/// Gives free pages back to the system. glibc keeps what lies between blocks that are still in use: about 100 MB after 900 motions
/// of a creep map, whose operators come and go beside those that are kept.
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

/// After tasks of at least this length free memory is given back to the system, which takes a walk over the whole heap.
const LONG: Duration = Duration::from_secs(1);

/// Stack of a solver thread.
const STACK_BYTES: usize = 16 << 20;

/// Something to compute.
pub(crate) type Task = Box<dyn FnOnce() + Send>;

/// A thread that does arithmetic, one task after the other, until its handle is dropped.
#[derive(Debug)]
pub(crate) struct SolverThread {
    tasks: mpsc::Sender<Task>,
    /// Set when it is left behind; it then counts as such until it ends.
    pub(crate) left: Arc<OnceLock<Counted>>,
}

/// One of a number, as long as it lives.
#[derive(Debug)]
pub(crate) struct Counted(pub(crate) Arc<AtomicUsize>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl SolverThread {
    /// Starts a thread of this name.
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

    /// Hands a task over; `false` if the thread is gone.
    pub(crate) fn give(&self, task: Task) -> bool {
        self.tasks.send(task).is_ok()
    }
}

/// Why a running solve was told to stop. The first reason given stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The client cancelled the job.
    Cancel,
    /// The service shuts down; the job goes back to the queue.
    Shutdown,
    /// The lease is lost; whatever comes out is discarded.
    Lost,
    /// The deadline of the job has passed.
    Deadline,
    /// It takes longer than was expected of a short job; it goes back to the queue.
    TooLong,
}

/// One attempt at a job. The solver ticks; the async side reads the progress and stops it.
#[derive(Debug, Default)]
pub struct AttemptControl {
    reason: OnceLock<StopReason>,
    ticks: AtomicU64,
    progress: AtomicU64,
    clock: Mutex<SolveClock>,
    taken_up: AtomicBool,
}

/// How long a solve has taken.
#[derive(Debug, Default)]
struct SolveClock {
    /// Before it last went on.
    spent: Duration,
    /// Since when it goes on.
    since: Option<Instant>,
}

impl AttemptControl {
    /// The solver's thread has come to this job.
    pub fn take_up(&self) {
        self.taken_up.store(true, Ordering::Release);
    }

    /// The solver's thread has not come to this job, or has yet to come again.
    pub fn reset_started(&self) {
        self.taken_up.store(false, Ordering::Release);
    }

    /// Has the solver's thread come to this job?
    #[must_use]
    pub fn is_started(&self) -> bool {
        self.taken_up.load(Ordering::Acquire)
    }

    /// Starts the clock of the solve, against which `contact` holds the time limit of the case, at the time that was spent
    /// before. It goes on until [`AttemptControl::pause`]; a clock that goes is left alone.
    pub fn begin(&self, spent: Duration) {
        let mut clock = self.clock();
        if clock.since.is_none() {
            *clock = SolveClock {
                spent,
                since: Some(Instant::now()),
            };
        }
    }

    /// Stops the clock and returns the time spent in all.
    pub fn pause(&self) -> Duration {
        let spent = self.elapsed();
        *self.clock() = SolveClock { spent, since: None };
        spent
    }

    fn clock(&self) -> MutexGuard<'_, SolveClock> {
        lock(&self.clock)
    }

    /// Tells the solver to stop at its next tick.
    pub fn stop(&self, reason: StopReason) {
        // A second reason changes nothing: the solver is stopping already.
        let _ = self.reason.set(reason);
    }

    /// Why the solver was told to stop, if it was.
    #[must_use]
    pub fn reason(&self) -> Option<StopReason> {
        self.reason.get().copied()
    }

    /// How often the solver has ticked. If this stands still, so does the solver.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks.load(Ordering::Acquire)
    }

    /// Progress as last reported, 0 to 1.
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
        let clock = self.clock();
        clock.spent + clock.since.map_or(Duration::ZERO, |since| since.elapsed())
    }
}

/// The leases of an attempt. They are no longer renewed once this is dropped.
#[derive(Debug)]
pub(crate) struct GroupLease(pub(crate) Arc<HeldLeases>);

#[derive(Debug)]
pub(crate) struct HeldLeases {
    leases: Mutex<Vec<(Claim, Arc<AttemptControl>)>>,
    /// A solver works and has to tick.
    pub(crate) solving: AtomicBool,
    /// Solves that ended: each is a sign of life like a tick.
    solved: AtomicU64,
    /// Ticks at the last renewal.
    pub(crate) seen: AtomicU64,
    /// When the leases run out, by the steady clock in ms.
    pub(crate) until: AtomicI64,
    /// The leases are over because the solver stands still.
    pub(crate) lost: CancellationToken,
}

/// All leases that this process holds, with the jobs that it works on.
#[derive(Debug, Default)]
pub(crate) struct AllLeases(Mutex<Vec<Weak<HeldLeases>>>);

impl AllLeases {
    /// Adds the leases of an attempt until it is over.
    pub(crate) fn add(&self, held: &Arc<HeldLeases>) {
        self.lock().push(Arc::downgrade(held));
    }

    /// Those that are still held.
    pub(crate) fn held(&self) -> Vec<Arc<HeldLeases>> {
        let mut all = self.lock();
        all.retain(|held| held.strong_count() > 0);
        all.iter().filter_map(Weak::upgrade).collect()
    }

    /// The jobs that are held.
    pub(crate) fn ids(&self) -> Vec<Uuid> {
        let held = self.held();
        let ids = held.iter().flat_map(|held| {
            let leases = held.leases();
            leases.iter().map(|(claim, _)| claim.id).collect::<Vec<_>>()
        });
        ids.collect()
    }

    /// Tells the solver of a job to stop; `false` if this process does not work on it.
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

    fn lock(&self) -> MutexGuard<'_, Vec<Weak<HeldLeases>>> {
        lock(&self.0)
    }
}

impl GroupLease {
    /// From now on a solver has to tick, or need not.
    pub(crate) fn solving(&self, solving: bool) {
        self.0.solving.store(solving, Ordering::Release);
    }

    /// These jobs are no longer held: they ended or were given back.
    pub(crate) fn let_go(&self, ids: &[Uuid]) {
        self.0
            .leases()
            .retain(|(claim, _)| !ids.contains(&claim.id));
    }

    /// Set once the leases are over because the solver stands still.
    pub(crate) fn lost(&self) -> &CancellationToken {
        &self.0.lost
    }
}

impl Drop for GroupLease {
    fn drop(&mut self) {
        // A solver thread that was left behind may keep the rest.
        self.0.leases().clear();
    }
}

impl HeldLeases {
    /// Leases of jobs that were claimed just now.
    pub(crate) fn new(leases: Vec<(Claim, Arc<AttemptControl>)>, until: i64) -> HeldLeases {
        HeldLeases {
            leases: Mutex::new(leases),
            solving: AtomicBool::new(false),
            solved: AtomicU64::new(0),
            seen: AtomicU64::new(0),
            until: AtomicI64::new(until),
            lost: CancellationToken::new(),
        }
    }

    /// A solve has ended.
    pub(crate) fn alive(&self) {
        self.solved.fetch_add(1, Ordering::AcqRel);
    }

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

/// One claimed job.
#[derive(Debug)]
pub(crate) struct Member {
    pub(crate) claim: Claim,
    pub(crate) control: Arc<AttemptControl>,
    pub(crate) phase: Phase,
    /// Its case, until it is handed to a thread.
    pub(crate) case: Option<ClaimedCase>,
    /// What it goes on with, once it is known.
    pub(crate) sliced: Option<Box<SlicedWork>>,
}

/// Where a claimed job stands.
#[derive(Debug)]
pub(crate) enum Phase {
    /// It is to be solved, or is being solved.
    Solving,
    /// Its solve is over.
    Solved(Outcome),
    /// It was not begun and goes back to the queue.
    NotBegun,
    /// It is equal to this earlier job of the group and waits for its answer.
    WaitingFor(Uuid),
    /// Nothing is left to be done.
    Done,
}

/// Claimed jobs with the thread that solves them one after the other.
#[derive(Debug)]
pub(crate) struct Attempt {
    pub(crate) queue: Queue,
    pub(crate) members: Vec<Member>,
    pub(crate) lease: GroupLease,
    /// It was running when a process died; this process solves no other such job at the same time.
    pub(crate) _suspect: Option<OwnedMutexGuard<()>>,
    /// It is a sweep that had been in the queue between two of its slices.
    pub(crate) was_begun: bool,
    /// Begin of its turn.
    pub(crate) turn_began: Instant,
    /// Solver time spent on what it is at.
    pub(crate) spent: Duration,
    pub(crate) solver: Option<Solver>,
}

/// Outcomes that the thread has left for its worker, with the places of their members.
pub(crate) type Outcomes = Arc<Mutex<Vec<(usize, Outcome)>>>;

/// What comes from the thread.
#[derive(Debug)]
pub(crate) struct Solver {
    pub(crate) thread: SolverThread,
    pub(crate) outcomes: Outcomes,
    /// Set when there will be no more outcomes.
    pub(crate) over: CancellationToken,
    /// Nothing more shall be begun.
    pub(crate) closed: Arc<Mutex<bool>>,
}

impl Attempt {
    /// Has it been handed to a thread?
    pub(crate) fn begun(&self) -> bool {
        self.solver.is_some()
    }

    /// The places of the members that are to be solved.
    pub(crate) fn to_solve(&self) -> Vec<usize> {
        let members = self.members.iter().enumerate();
        let solving = members.filter(|(_, member)| matches!(member.phase, Phase::Solving));
        solving.map(|(place, _)| place).collect()
    }

    /// Takes the outcomes that there are.
    pub(crate) fn take_outcomes(&mut self) {
        if let Some(solver) = &self.solver {
            let mut outcomes = lock(&solver.outcomes);
            for (place, outcome) in outcomes.drain(..) {
                self.members[place].phase = Phase::Solved(outcome);
            }
        }
    }

    /// Set when there will be no more outcomes.
    pub(crate) fn over(&self) -> CancellationToken {
        if let Some(solver) = &self.solver {
            return solver.over.clone();
        }
        let none = CancellationToken::new();
        none.cancel();
        none
    }

    /// Nothing more is begun: what the thread has not taken up goes back to the queue.
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

    /// The solver does not stop: what it is at counts as abandoned. Returns its thread, which is to be left behind.
    pub(crate) fn abandon(&mut self) -> Option<SolverThread> {
        self.close();
        for member in &mut self.members {
            if matches!(member.phase, Phase::Solving) {
                member.phase = Phase::Solved(Outcome::Abandoned);
            }
        }
        self.take_thread()
    }

    /// The thread, once it has nothing more to do.
    pub(crate) fn take_thread(&mut self) -> Option<SolverThread> {
        self.solver.take().map(|solver| solver.thread)
    }

    /// Are there members that wait behind another of this attempt? A sweep that is about to begin its next slice waits
    /// behind nobody.
    pub(crate) fn has_more_to_begin(&self) -> bool {
        let solving = self
            .members
            .iter()
            .filter(|member| matches!(member.phase, Phase::Solving));
        let waiting = solving
            .clone()
            .filter(|member| !member.control.is_started());
        solving.count() > 1 && waiting.count() > 0
    }

    /// Tells every member to stop.
    pub(crate) fn stop(&self, reason: StopReason) {
        for member in &self.members {
            member.control.stop(reason);
        }
    }

    /// The member that the solver is at, if it was cancelled or its deadline has passed.
    pub(crate) fn unwanted(&self) -> Option<usize> {
        self.members.iter().position(|member| {
            let reason = member.control.reason();
            matches!(member.phase, Phase::Solving)
                && member.control.is_started()
                && matches!(reason, Some(StopReason::Cancel | StopReason::Deadline))
        })
    }

    /// Claims of the members that are in the phase that `is` tells.
    pub(crate) fn claims(&self, is: impl Fn(&Phase) -> bool) -> Vec<Claim> {
        let members = self.members.iter().filter(|member| is(&member.phase));
        members.map(|member| member.claim.clone()).collect()
    }

    /// Members with these ids need nothing more.
    pub(crate) fn done(&mut self, ids: &[Uuid]) {
        self.lease.let_go(ids);
        for member in &mut self.members {
            if ids.contains(&member.claim.id) {
                member.phase = Phase::Done;
            }
        }
    }

    /// Members equal to an earlier one wait for its answer.
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
            lease: GroupLease(Arc::new(HeldLeases::new(Vec::new(), 0))),
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
        group.members[0].control.take_up();
        assert!(group.has_more_to_begin());
        group.members[1].control.take_up();
        assert!(!group.has_more_to_begin());
    }
}
