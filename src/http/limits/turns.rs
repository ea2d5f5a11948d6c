//! Turns to compute: a few at a time, given in rotation to the tenants that wait for one.
//!
//! A computation of unknown length is a [`Computation`]: it passes its turn on after a slice of time if another request waits, ends soon
//! after its client has left, and is bounded in time.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use tokio::runtime::Handle;
use tokio::sync::oneshot;
use tokio_util::sync::{CancellationToken, DropGuard};

use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::sync::{blocking, lock};

/// How long a request waits for its first turn.
const WITHIN: Duration = Duration::from_secs(20);
/// How long a computation keeps its turn while others wait: far longer than passing it on takes, shorter than people notice.
const SLICE: Duration = Duration::from_millis(100);

/// A number of turns; clones share them.
#[derive(Debug, Clone)]
pub(crate) struct Turns(Arc<Mutex<Queue>>);

#[derive(Debug)]
struct Queue {
    free: usize,
    /// The tenants that wait, in the order of their next turns, each with its requests in the order in which they came.
    tenants: VecDeque<(Arc<str>, VecDeque<oneshot::Sender<Turn>>)>,
}

/// A turn; passed on when dropped.
#[derive(Debug)]
pub struct Turn(Option<Turns>);

impl Turns {
    /// This many turns, at least one.
    #[must_use]
    pub(crate) fn new(count: usize) -> Turns {
        Turns(Arc::new(Mutex::new(Queue {
            free: count.max(1),
            tenants: VecDeque::new(),
        })))
    }

    /// Waits for a turn.
    pub(crate) async fn take(&self, tenant: &str) -> Turn {
        loop {
            let waiting = {
                let mut queue = self.queue();
                if queue.free > 0 {
                    queue.free -= 1;
                    return Turn(Some(self.clone()));
                }
                let (sender, waiting) = oneshot::channel();
                let mut tenants = queue.tenants.iter_mut();
                match tenants.find(|(name, _)| **name == *tenant) {
                    Some((_, requests)) => requests.push_back(sender),
                    None => queue.tenants.push_back((tenant.into(), [sender].into())),
                }
                waiting
            };
            if let Ok(turn) = waiting.await {
                return turn;
            }
        }
    }

    /// Waits for a turn, but not longer than a request may wait.
    ///
    /// # Errors
    /// `overloaded`: it does not come in time.
    pub(crate) async fn take_in_time(&self, tenant: &str) -> Result<Turn, ApiError> {
        let turn = tokio::time::timeout(WITHIN, self.take(tenant)).await;
        turn.map_err(|_| {
            ApiError::new(
                ProblemKind::Overloaded,
                "other requests of this kind take all turns",
            )
        })
    }

    fn anybody_waits(&self) -> bool {
        !self.queue().tenants.is_empty()
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        lock(&self.0)
    }
}

impl Queue {
    /// The request whose turn is next; its tenant goes to the end of the rotation.
    fn next(&mut self) -> Option<oneshot::Sender<Turn>> {
        let (tenant, mut requests) = self.tenants.pop_front()?;
        let next = requests.pop_front();
        if !requests.is_empty() {
            self.tenants.push_back((tenant, requests));
        }
        next
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let Some(turns) = self.0.take() else { return };
        let mut turn = Turn(Some(turns.clone()));
        loop {
            let next = {
                let mut queue = turns.queue();
                let next = queue.next();
                if next.is_none() {
                    queue.free += 1;
                    turn.0 = None;
                }
                next
            };
            let Some(next) = next else { return };
            match next.send(turn) {
                Ok(()) => return,
                // That request has been given up.
                Err(back) => turn = back,
            }
        }
    }
}

/// The computing of one request, done in turns. Its work ends soon after this is dropped, as it is when the client leaves.
#[derive(Debug)]
pub struct Computation {
    turns: Turns,
    tenant: Arc<str>,
    limit: Duration,
    spent: Duration,
    left: CancellationToken,
    _leaves: DropGuard,
}

impl Computation {
    /// A computation of a tenant that may take this much time, waiting aside.
    #[must_use]
    pub(crate) fn new(turns: Turns, tenant: &str, limit: Duration) -> Computation {
        let left = CancellationToken::new();
        Computation {
            turns,
            tenant: tenant.into(),
            limit,
            spent: Duration::ZERO,
            _leaves: left.clone().drop_guard(),
            left,
        }
    }

    /// Does a part of the work on the pool of blocking threads. The work calls [`Pace::step`] between its steps.
    ///
    /// # Errors
    /// `overloaded`: the first turn does not come in time; or the error of the work or of its steps.
    pub async fn run<T: Send + 'static>(
        &mut self,
        work: impl FnOnce(&mut Pace) -> Result<T, ApiError> + Send + 'static,
    ) -> Result<T, ApiError> {
        let mut pace = Pace {
            turn: Some(self.turns.take_in_time(&self.tenant).await?),
            turns: self.turns.clone(),
            tenant: self.tenant.clone(),
            limit: self.limit,
            spent: self.spent,
            begun: Instant::now(),
            left: self.left.clone(),
        };
        let work = blocking(move || {
            let done = work(&mut pace);
            (done, pace.spent + pace.begun.elapsed())
        });
        let (done, spent) = work.await?;
        self.spent = spent;
        done
    }
}

/// The pace of a computation on its blocking thread.
#[derive(Debug)]
pub struct Pace {
    turn: Option<Turn>,
    turns: Turns,
    tenant: Arc<str>,
    limit: Duration,
    /// Computing time before the present slice.
    spent: Duration,
    /// The begin of the present slice.
    begun: Instant,
    left: CancellationToken,
}

impl Pace {
    /// Ends a step of the work. Passes the turn on and waits for the next one if the slice is over and another request waits.
    ///
    /// # Errors
    /// The client has left, or `body-too-large`: the computation has taken longer than it may.
    pub fn step(&mut self) -> Result<(), ApiError> {
        if self.left.is_cancelled() {
            return Err(client_left());
        }
        let slice = self.begun.elapsed();
        if self.spent + slice >= self.limit {
            return Err(ApiError::new(
                ProblemKind::BodyTooLarge,
                format!(
                    "reading and computing the rows has taken {} s, as long as one request may (`--table-time-s`); send fewer rows at once",
                    self.limit.as_secs_f64()
                ),
            ));
        }
        if slice < SLICE {
            return Ok(());
        }
        self.spent += slice;
        if self.turns.anybody_waits() {
            self.turn = None;
            self.turn = Handle::current().block_on(async {
                tokio::select! {
                    turn = self.turns.take(&self.tenant) => Some(turn),
                    () = self.left.cancelled() => None,
                }
            });
        }
        self.begun = Instant::now();
        match self.turn {
            Some(_) => Ok(()),
            None => Err(client_left()),
        }
    }
}

/// Nobody reads this.
fn client_left() -> ApiError {
    ApiError::internal(&"the client has left")
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

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
            // They queue in this order.
            tokio::task::yield_now().await;
        }
        drop(held);
        for request in waiting {
            request.await.unwrap();
        }
        assert_eq!(*order.lock().unwrap(), ["a", "b", "c", "a", "b", "a"]);
        assert_eq!(turns.queue().free, 1);
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
        assert_eq!(turns.queue().free, 1);
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn an_endless_computation_lets_others_pass_and_ends_when_its_client_leaves() {
        let turns = Turns::new(1);
        let minutes = Duration::from_secs(600);
        let steps = Arc::new(AtomicUsize::new(0));
        let counted = steps.clone();
        let mut endless = Computation::new(turns.clone(), "a", minutes);
        let endless = tokio::spawn(async move {
            let work = move |pace: &mut Pace| -> Result<(), ApiError> {
                loop {
                    counted.fetch_add(1, Ordering::Relaxed);
                    pace.step()?;
                }
            };
            endless.run(work).await
        });
        while steps.load(Ordering::Relaxed) == 0 {
            tokio::task::yield_now().await;
        }
        for tenant in ["b", "a"] {
            let mut short = Computation::new(turns.clone(), tenant, minutes);
            assert_eq!(short.run(|_| Ok(7)).await.unwrap(), 7);
        }
        endless.abort();
        // Its turn comes back, and it stays.
        drop(turns.take("b").await);
        while turns.queue().free == 0 {
            tokio::task::yield_now().await;
        }
    }

    #[tokio::test]
    async fn the_time_of_all_parts_of_a_computation_is_bounded() {
        let limit = Duration::from_millis(20);
        let mut computation = Computation::new(Turns::new(1), "a", limit);
        let part = |pace: &mut Pace| {
            std::thread::sleep(Duration::from_millis(15));
            pace.step()
        };
        let mut parts = 0;
        while computation.run(part).await.is_ok() {
            parts += 1;
        }
        assert!(parts <= 1, "{parts}");
    }
}
