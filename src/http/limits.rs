//! Limits of concurrent requests, memory and long computations.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::thread::available_parallelism;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::middleware::Next;
use axum::response::Response;
use http_body_util::BodyExt;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;
use tokio_util::sync::CancellationToken;

use crate::options::HttpOptions;
use crate::problem::{ApiError, ProblemKind, Result};
use railhead_jobs::sync::{blocking, lock};

/// Counts units, such as requests or bytes, in total and for each tenant. Clones share the semaphore.
#[derive(Debug, Clone)]
pub(crate) struct TenantSemaphore {
    all: Arc<Semaphore>,
    of_tenant: usize,
    /// The semaphores of the tenants. The operator creates tenants, so that their number is small.
    tenants: Arc<Mutex<HashMap<Arc<str>, Arc<Semaphore>>>>,
}

/// Units that a request holds. They are released on drop.
#[derive(Debug)]
pub struct Permit {
    of_tenant: OwnedSemaphorePermit,
    of_all: OwnedSemaphorePermit,
}

impl TenantSemaphore {
    /// Creates a semaphore of `all` units, of which a tenant may hold `of_tenant`.
    #[must_use]
    pub(crate) fn new(all: usize, of_tenant: usize) -> TenantSemaphore {
        TenantSemaphore {
            all: Arc::new(Semaphore::new(all.min(Semaphore::MAX_PERMITS))),
            of_tenant: of_tenant.min(all).min(Semaphore::MAX_PERMITS),
            tenants: Arc::default(),
        }
    }

    /// Returns the number of units that a tenant may hold.
    #[must_use]
    pub(crate) fn of_one(&self) -> usize {
        self.of_tenant
    }

    /// Takes `many` units, if they are free.
    #[must_use]
    pub(crate) fn try_take(&self, tenant: &str, many: u32) -> Option<Permit> {
        let of_tenant = self.of(tenant).try_acquire_many_owned(many).ok()?;
        let of_all = self.all.clone().try_acquire_many_owned(many).ok()?;
        Some(Permit { of_tenant, of_all })
    }

    /// Takes one unit.
    ///
    /// # Errors
    /// `too-many-requests` with this detail: no unit is free.
    fn require(&self, tenant: &str, detail: &str) -> Result<Permit> {
        let taken = self.try_take(tenant, 1);
        taken.ok_or_else(|| ApiError::new(ProblemKind::TooManyRequests, detail))
    }

    /// Waits for `many` units, first come, first served. Returns `None` if they are not free within the time, or never can be.
    pub(crate) async fn take(&self, tenant: &str, many: u32, within: Duration) -> Option<Permit> {
        if many as usize > self.of_tenant {
            return None;
        }
        let both = async {
            let of_tenant = self.of(tenant).acquire_many_owned(many).await.ok()?;
            let of_all = self.all.clone().acquire_many_owned(many).await.ok()?;
            Some(Permit { of_tenant, of_all })
        };
        timeout(within, both).await.ok().flatten()
    }

    fn of(&self, tenant: &str) -> Arc<Semaphore> {
        let mut tenants = lock(&self.tenants);
        if let Some(own) = tenants.get(tenant) {
            return own.clone();
        }
        let own = Arc::new(Semaphore::new(self.of_tenant));
        tenants.insert(tenant.into(), own.clone());
        own
    }
}

impl Permit {
    /// Releases all but `many` units.
    pub fn shrink_to_units(&mut self, many: usize) {
        let surplus = self.of_all.num_permits().saturating_sub(many);
        drop(self.of_all.split(surplus));
        drop(self.of_tenant.split(surplus));
    }
}

/// Time that a request waits for memory or for its first turn.
const WITHIN: Duration = Duration::from_secs(20);
/// Time that a computation keeps its turn while others wait. A judgement: much longer than passing the turn on, too short to notice.
const SLICE: Duration = Duration::from_millis(100);

/// Slots for computations, which waiting tenants get in turn: one request of each tenant waits in the queue, the others wait for it. Clones share
/// the slots.
#[derive(Debug, Clone)]
pub(crate) struct Turns {
    free: Arc<Semaphore>,
    /// The place of each tenant in the queue.
    places: TenantSemaphore,
}

/// A slot for a computation. It is released on drop.
#[derive(Debug)]
pub struct Turn(
    #[expect(dead_code, reason = "held until it is dropped")] Option<OwnedSemaphorePermit>,
);

impl Turns {
    /// Creates this many slots, at least one.
    #[must_use]
    pub(crate) fn new(count: usize) -> Turns {
        Turns {
            free: Arc::new(Semaphore::new(count.max(1))),
            places: TenantSemaphore::new(1, 1),
        }
    }

    /// Waits for a slot.
    pub(crate) async fn take(&self, tenant: &str) -> Turn {
        let _place = self.places.of(tenant).acquire_owned().await;
        // The semaphore is never closed.
        Turn(self.free.clone().acquire_owned().await.ok())
    }

    /// Waits for a slot, at most [`WITHIN`].
    ///
    /// # Errors
    /// `overloaded`: no slot became free in time.
    pub(crate) async fn take_in_time(&self, tenant: &str) -> Result<Turn> {
        let turn = timeout(WITHIN, self.take(tenant)).await;
        turn.map_err(|_| overloaded("other requests of this kind use all slots"))
    }

    /// Runs work of a tenant on a blocking thread, for at most `limit` of computing time. The work calls [`Pace::step`] between its steps, which
    /// lets other requests run, and fails once the client has disconnected.
    ///
    /// # Errors
    /// `overloaded`: no slot became free in time; or the error of the work or of its steps.
    pub(crate) async fn compute<T: Send + 'static>(
        &self,
        tenant: &str,
        limit: Duration,
        work: impl FnOnce(&mut Pace) -> Result<T> + Send + 'static,
    ) -> Result<T> {
        let left = CancellationToken::new();
        let _leaves = left.clone().drop_guard();
        let mut pace = Pace {
            turn: Some(self.take_in_time(tenant).await?),
            turns: self.clone(),
            tenant: tenant.into(),
            limit,
            spent: Duration::ZERO,
            begun: Instant::now(),
            left,
        };
        blocking(move || work(&mut pace)).await?
    }
}

/// The time slices of a computation on its blocking thread.
#[derive(Debug)]
pub struct Pace {
    turn: Option<Turn>,
    turns: Turns,
    tenant: Arc<str>,
    limit: Duration,
    /// Computing time before the current slice.
    spent: Duration,
    /// Start of the current slice.
    begun: Instant,
    left: CancellationToken,
}

impl Pace {
    /// Ends a step of the work. At the end of a slice, releases the slot and waits for one again.
    ///
    /// # Errors
    /// The client has disconnected, or `body-too-large`: the computation exceeds its time.
    pub fn step(&mut self) -> Result<()> {
        if self.left.is_cancelled() {
            return Err(client_left());
        }
        let slice = self.begun.elapsed();
        if self.spent + slice >= self.limit {
            return Err(ApiError::new(
                ProblemKind::BodyTooLarge,
                format!(
                    "reading and computing the rows took {} s, the limit of one request (`--table-time-s`); send fewer rows at once",
                    self.limit.as_secs_f64()
                ),
            ));
        }
        if slice < SLICE {
            return Ok(());
        }
        self.spent += slice;
        // The slot is free again at once if no other request waits.
        self.turn = None;
        self.turn = Handle::current().block_on(async {
            tokio::select! {
                turn = self.turns.take(&self.tenant) => Some(turn),
                () = self.left.cancelled() => None,
            }
        });
        self.begun = Instant::now();
        match self.turn {
            Some(_) => Ok(()),
            None => Err(client_left()),
        }
    }
}

/// Returns an error for a client that has disconnected.
fn client_left() -> ApiError {
    ApiError::internal("the client has left")
}

/// Limits of concurrent requests, event streams and waits. Clones share them.
#[derive(Debug, Clone)]
pub struct ConcurrencyLimits {
    requests: TenantSemaphore,
    streams: TenantSemaphore,
    waits: TenantSemaphore,
}

impl ConcurrencyLimits {
    /// Creates the limits of these options.
    #[must_use]
    pub fn new(options: &HttpOptions) -> ConcurrencyLimits {
        ConcurrencyLimits {
            requests: TenantSemaphore::new(options.connections_max, options.tenant_requests_max),
            streams: TenantSemaphore::new(options.streams_max, options.tenant_streams_max),
            waits: TenantSemaphore::new(options.waits_max, options.tenant_waits_max),
        }
    }

    /// Counts a request of a tenant.
    ///
    /// # Errors
    /// `too-many-requests`: the limit is reached.
    pub fn request(&self, tenant: &str) -> Result<Permit> {
        self.requests.require(
            tenant,
            "the tenant has reached its limit of concurrent requests (`--tenant-requests-max`)",
        )
    }

    /// Counts an event stream of a tenant.
    ///
    /// # Errors
    /// See [`ConcurrencyLimits::request`].
    pub fn stream(&self, tenant: &str) -> Result<Permit> {
        self.streams.require(
            tenant,
            "the limit of open event streams is reached (`--tenant-streams-max`, `--streams-max`)",
        )
    }

    /// Counts a waiting request; `None` if the limit is reached. The request is then answered at once, since `Prefer: wait` is not binding.
    #[must_use]
    pub fn wait(&self, tenant: &str) -> Option<Permit> {
        self.waits.try_take(tenant, 1)
    }

    /// Counts a waiting request whose response depends on the wait.
    ///
    /// # Errors
    /// See [`ConcurrencyLimits::request`].
    pub fn require_wait(&self, tenant: &str) -> Result<Permit> {
        self.waits.require(
            tenant,
            "the limit of waiting requests is reached (`--tenant-waits-max`, `--waits-max`)",
        )
    }
}

/// Keeps `held` until the body of a response has been sent.
pub(crate) fn hold_while_sent<T: Send + 'static>(response: Response, held: T) -> Response {
    response.map(|body| {
        Body::new(body.map_err(move |error| {
            let _held = &held;
            error
        }))
    })
}

/// Permits that a request holds until its response has been sent, in its extensions.
#[derive(Debug, Clone, Default)]
pub(crate) struct HeldPermits(Arc<Mutex<Vec<Permit>>>);

impl HeldPermits {
    /// Adds a permit.
    pub(crate) fn add(&self, share: Permit) {
        lock(&self.0).push(share);
    }

    /// Releases all permits; the caller counts the rest of the request elsewhere.
    pub(crate) fn release(&self) {
        lock(&self.0).clear();
    }
}

/// Layer that lets requests hold permits until their response has been sent.
pub(crate) async fn hold(mut request: Request, next: Next) -> Response {
    let held = HeldPermits::default();
    request.extensions_mut().insert(held.clone());
    hold_while_sent(next.run(request).await, held)
}

/// Bytes of a unit of memory.
const UNIT: usize = 1 << 10;
/// Bytes up to which memory is not counted: it is little even for the largest number of requests.
pub(crate) const SMALL_BYTES: usize = 64 << 10;
/// Description of the memory of responses in refusals.
const ANSWERS: &str = "responses that clients have not read yet";

/// Memory and computations of all requests. Clones share them.
#[derive(Debug, Clone)]
pub struct Memory {
    bodies: TenantSemaphore,
    parsed: TenantSemaphore,
    answers: TenantSemaphore,
    /// Slots for large cases, half as many as cores, so that small cases need not wait for large ones.
    large: Turns,
    small: Turns,
    /// Slots for trial solves that estimate the time of a case, half as many as cores.
    trials: Turns,
    /// Slots for large grids.
    grids: Turns,
    /// Slots for pictures, small grids and tables, which therefore need not wait for large grids.
    renderings: Turns,
    waiting: TenantSemaphore,
    table_time: Duration,
}

impl Permit {
    /// Releases the memory beyond `bytes`.
    pub fn shrink_to(&mut self, bytes: usize) {
        self.shrink_to_units(bytes.div_ceil(UNIT));
    }
}

/// A slot for computing a response, and a permit for its memory.
#[derive(Debug)]
pub struct Rendering {
    share: Option<Permit>,
    turn: Turn,
    memory: Memory,
    tenant: String,
}

/// Memory and a slot for a computation. Both are released on drop.
#[derive(Debug, Default)]
pub struct MemoryPermit {
    /// The permit for the memory; `None` for small amounts.
    pub share: Option<Permit>,
    /// The slot.
    pub turn: Option<Turn>,
}

impl Memory {
    /// Creates the limits of these options.
    #[must_use]
    pub fn new(options: &HttpOptions) -> Memory {
        let part = |eighths: usize| {
            let units = |bytes: usize| bytes / 8 * eighths / UNIT;
            TenantSemaphore::new(
                units(options.memory_max_bytes),
                units(options.tenant_memory_max_bytes),
            )
        };
        let cores = available_parallelism().map_or(1, usize::from);
        let waiting = options.renderings_waiting_max;
        Memory {
            bodies: part(1),
            parsed: part(3),
            answers: part(4),
            large: Turns::new(cores / 2),
            small: Turns::new(cores),
            trials: Turns::new(cores / 2),
            grids: Turns::new(options.renderings),
            renderings: Turns::new(options.renderings),
            waiting: TenantSemaphore::new(waiting, waiting.div_ceil(2)),
            table_time: options.table_time,
        }
    }

    /// Waits for memory for a body.
    ///
    /// # Errors
    /// `overloaded`: the memory is not free in time.
    pub async fn body(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>> {
        take(&self.bodies, tenant, bytes, "the bodies of requests").await
    }

    /// Waits for memory for a parsed case.
    ///
    /// # Errors
    /// See [`Memory::body`].
    pub async fn parsed(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>> {
        take(&self.parsed, tenant, bytes, "cases that are read").await
    }

    /// Waits for memory for rows: their text, columns and response.
    ///
    /// # Errors
    /// See [`Memory::body`].
    pub async fn rows(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>> {
        take(&self.answers, tenant, bytes, ANSWERS).await
    }

    /// Waits for a slot to check a case of this size in memory.
    ///
    /// # Errors
    /// `overloaded`: no slot became free in time.
    pub async fn turn(&self, tenant: &str, bytes: usize) -> Result<Turn> {
        let turns = if bytes > SMALL_BYTES {
            &self.large
        } else {
            &self.small
        };
        turns.take_in_time(tenant).await
    }

    /// Reads a table or evaluates rows in a slot for large cases.
    ///
    /// # Errors
    /// See [`Turns::compute`].
    pub async fn compute<T: Send + 'static>(
        &self,
        tenant: &str,
        work: impl FnOnce(&mut Pace) -> Result<T> + Send + 'static,
    ) -> Result<T> {
        self.large.compute(tenant, self.table_time, work).await
    }

    /// Waits for a slot for a trial solve; `None` if no slot became free within this time.
    pub async fn trial(&self, tenant: &str, within: Duration) -> Option<Turn> {
        let turn = timeout(within, self.trials.take(tenant));
        turn.await.ok()
    }

    /// Takes memory for a response that exists already, without waiting.
    ///
    /// # Errors
    /// `overloaded`: the memory is not free.
    pub fn ready_answer(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>> {
        if bytes <= SMALL_BYTES {
            return Ok(None);
        }
        let share = self.answers.try_take(tenant, units(bytes));
        share.map(Some).ok_or_else(|| no_memory(ANSWERS, bytes))
    }

    /// Whether the limits allow a response of this many bytes.
    #[must_use]
    pub fn has_room_for(&self, bytes: usize) -> bool {
        bytes <= SMALL_BYTES || self.answers.of_one() >= units(bytes) as usize
    }

    /// Waits for a slot and memory for a response of this many bytes. To be called before anything is loaded for the response.
    ///
    /// # Errors
    /// `overloaded`: too many requests wait already, or slot or memory are not free in time.
    pub async fn rendering(&self, tenant: &str, bytes: usize) -> Result<Rendering> {
        let waiting = self.waiting.try_take(tenant, 1).ok_or_else(|| {
            overloaded("the limit of requests that wait for pictures, grids and tables is reached (`--renderings-waiting-max`)")
        })?;
        let share = take(&self.answers, tenant, bytes, ANSWERS).await?;
        let turns = if bytes > SMALL_BYTES {
            &self.grids
        } else {
            &self.renderings
        };
        let turn = turns.take_in_time(tenant).await?;
        drop(waiting);
        Ok(Rendering {
            share,
            turn,
            memory: self.clone(),
            tenant: tenant.to_owned(),
        })
    }
}

impl Rendering {
    /// Runs the work on a blocking thread. The second value is the permit for the memory of the response, by its actual `size`.
    ///
    /// # Errors
    /// The error of `work`, or `overloaded` if the response is larger than expected and its memory is not free.
    pub async fn run<T: Send + 'static>(
        self,
        work: impl FnOnce() -> Result<T> + Send + 'static,
        size: impl Fn(&T) -> usize,
    ) -> Result<(T, Option<Permit>)> {
        let turn = self.turn;
        let work = blocking(move || {
            // The slot is held until the work ends, even if the client has disconnected.
            let _turn = turn;
            work()
        });
        let done = work.await??;
        let bytes = size(&done);
        let share = match self.share {
            Some(mut share) => {
                share.shrink_to(bytes);
                Some(share)
            }
            None => self.memory.ready_answer(&self.tenant, bytes)?,
        };
        Ok((done, share))
    }
}

async fn take(
    shares: &TenantSemaphore,
    tenant: &str,
    bytes: usize,
    what: &str,
) -> Result<Option<Permit>> {
    if bytes <= SMALL_BYTES {
        return Ok(None);
    }
    let share = shares.take(tenant, units(bytes), WITHIN).await;
    share.map(Some).ok_or_else(|| no_memory(what, bytes))
}

fn units(bytes: usize) -> u32 {
    u32::try_from(bytes.div_ceil(UNIT)).unwrap_or(u32::MAX)
}

fn no_memory(what: &str, bytes: usize) -> ApiError {
    overloaded(&format!(
        "the memory for {what} is in use; {bytes} bytes are needed (`--request-memory-mb`, `--tenant-request-memory-mb`)"
    ))
}

fn overloaded(detail: &str) -> ApiError {
    ApiError::new(ProblemKind::Overloaded, detail)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn a_tenant_gets_its_share_and_leaves_the_rest_to_others() {
        let shares = TenantSemaphore::new(5, 3);
        let mut held = shares.try_take("a", 3).unwrap();
        assert!(shares.try_take("a", 1).is_none());
        assert!(shares.try_take("b", 3).is_none(), "two are left");
        let other = shares.try_take("b", 2).unwrap();
        held.shrink_to_units(1);
        assert!(shares.try_take("a", 3).is_none());
        assert!(shares.try_take("a", 2).is_some());
        drop((held, other));
        assert!(shares.try_take("c", 3).is_some());
    }

    #[tokio::test]
    async fn what_is_not_free_in_time_is_not_waited_for_any_longer() {
        let shares = TenantSemaphore::new(2, 2);
        let held = shares.try_take("a", 2).unwrap();
        let soon = Duration::from_millis(20);
        assert!(shares.take("b", 1, soon).await.is_none());
        assert!(shares.take("b", 3, Duration::MAX).await.is_none());
        let (later, ()) = tokio::join!(shares.take("b", 1, Duration::from_secs(60)), async {
            drop(held);
        });
        assert!(later.is_some());
    }

    #[tokio::test]
    async fn tenants_take_turns_however_many_requests_one_of_them_has() {
        let turns = Turns::new(1);
        let held = turns.take("a").await;
        let order = Arc::new(Mutex::new(Vec::new()));
        let mut waiting = Vec::new();
        for tenant in ["a", "a", "a", "b", "c", "b"] {
            let (turns, order) = (turns.clone(), order.clone());
            waiting.push(tokio::spawn(async move {
                let _turn = turns.take(tenant).await;
                order.lock().unwrap().push(tenant);
            }));
            // Yielding makes the tasks queue in this order.
            tokio::task::yield_now().await;
        }
        drop(held);
        for request in waiting {
            request.await.unwrap();
        }
        assert_eq!(*order.lock().unwrap(), ["a", "b", "c", "a", "b", "a"]);
        assert_eq!(turns.free.available_permits(), 1);
    }

    #[tokio::test]
    async fn requests_that_are_given_up_leave_no_turn_behind() {
        let turns = Turns::new(1);
        let held = turns.take("a").await;
        for _ in 0..1000 {
            let mut waiting = Box::pin(turns.take("b"));
            assert!(futures_util::poll!(&mut waiting).is_pending());
        }
        let mut last = Box::pin(turns.take("b"));
        assert!(futures_util::poll!(&mut last).is_pending());
        drop(held);
        drop(last.await);
        assert_eq!(turns.free.available_permits(), 1);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn an_endless_computation_lets_others_pass_and_ends_when_its_client_leaves() {
        let turns = Turns::new(1);
        let minutes = Duration::from_secs(600);
        let steps = Arc::new(AtomicUsize::new(0));
        let counted = steps.clone();
        let own = turns.clone();
        let endless = tokio::spawn(async move {
            let work = move |pace: &mut Pace| -> Result<()> {
                loop {
                    counted.fetch_add(1, Ordering::Relaxed);
                    pace.step()?;
                }
            };
            own.compute("a", minutes, work).await
        });
        while steps.load(Ordering::Relaxed) == 0 {
            tokio::task::yield_now().await;
        }
        for tenant in ["b", "a"] {
            let short = turns.compute(tenant, minutes, |_| Ok(7)).await;
            assert_eq!(short.unwrap(), 7);
        }
        endless.abort();
        // The abandoned computation gives its turn back.
        drop(turns.take("b").await);
        while turns.free.available_permits() == 0 {
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn the_time_of_all_steps_of_a_computation_is_bounded() {
        let limit = Duration::from_millis(20);
        let steps = |pace: &mut Pace| {
            for number in 0.. {
                std::thread::sleep(Duration::from_millis(15));
                if pace.step().is_err() {
                    return Ok(number);
                }
            }
            Ok(usize::MAX)
        };
        let steps = Turns::new(1).compute("a", limit, steps).await.unwrap();
        assert!(steps <= 1, "{steps}");
    }
}
