//! Memory and computing time of requests: bodies, parsed cases and answers are counted in bytes before they are allocated, and long
//! computations (large cases, grids, pictures) run only a few at a time.

use std::thread::available_parallelism;
use std::time::Duration;

use crate::http::limits::tenant_semaphore::{Permit, TenantSemaphore};
use crate::http::limits::turns::{Computation, Turn, Turns};
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;
use crate::jobs::sync::blocking;

/// Bytes of one unit, in which shares are counted.
const UNIT: usize = 1 << 10;
/// Smaller amounts are not counted: even the largest number of requests takes little memory with them.
pub(crate) const SMALL_BYTES: usize = 64 << 10;
/// How long a request waits for memory.
const WITHIN: Duration = Duration::from_secs(20);
/// The word for the memory of answers in refusals.
const ANSWERS: &str = "answers that clients have not taken yet";

/// Memory and turns to compute of all requests; clones share them.
#[derive(Debug, Clone)]
pub struct Memory {
    bodies: TenantSemaphore,
    parsed: TenantSemaphore,
    answers: TenantSemaphore,
    /// Turns for large cases: half of the cores, so that small cases need not wait for large ones.
    large: Turns,
    small: Turns,
    /// Turns for solves that find out how long a case takes: half of the cores, beside the workers.
    trials: Turns,
    /// Turns for large grids.
    grids: Turns,
    /// Turns for pictures, small grids and tables, which therefore need not wait for large grids.
    renderings: Turns,
    waiting: TenantSemaphore,
    table_time: Duration,
}

impl Permit {
    /// Releases what is held beyond `bytes`.
    pub fn shrink_to(&mut self, bytes: usize) {
        self.shrink_to_units(bytes.div_ceil(UNIT));
    }
}

/// A turn to compute an answer, and the memory for it.
#[derive(Debug)]
pub struct Rendering {
    share: Option<Permit>,
    turn: Turn,
    memory: Memory,
    tenant: String,
}

/// Memory and a turn to compute; given back on drop.
#[derive(Debug, Default)]
pub struct MemoryPermit {
    /// The memory.
    pub share: Option<Permit>,
    /// The turn.
    pub turn: Option<Turn>,
}

impl Memory {
    /// The limits of these options.
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

    /// Memory for a body of so many bytes.
    ///
    /// # Errors
    /// `overloaded`: it is not free in time.
    pub async fn body(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>, ApiError> {
        take(&self.bodies, tenant, bytes, "the bodies of requests").await
    }

    /// Memory for a parsed case of so many bytes.
    ///
    /// # Errors
    /// As [`Memory::body`].
    pub async fn parsed(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>, ApiError> {
        take(&self.parsed, tenant, bytes, "cases that are read").await
    }

    /// Memory for rows: their text, columns and answer.
    ///
    /// # Errors
    /// As [`Memory::body`].
    pub async fn rows(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>, ApiError> {
        take(&self.answers, tenant, bytes, ANSWERS).await
    }

    /// A turn to check a case of this size in memory.
    ///
    /// # Errors
    /// `overloaded`: it does not come in time.
    pub async fn turn(&self, tenant: &str, bytes: usize) -> Result<Turn, ApiError> {
        let turns = if bytes > SMALL_BYTES {
            &self.large
        } else {
            &self.small
        };
        turns.take_in_time(tenant).await
    }

    /// The reading of a table or the evaluation of rows, in turns for large cases.
    #[must_use]
    pub fn computation(&self, tenant: &str) -> Computation {
        Computation::new(self.large.clone(), tenant, self.table_time)
    }

    /// A turn to solve a case for a moment; none if it does not come within that time.
    pub async fn trial(&self, tenant: &str, within: Duration) -> Option<Turn> {
        let turn = tokio::time::timeout(within, self.trials.take(tenant));
        turn.await.ok()
    }

    /// Memory for an answer that exists already. It does not wait, since the answer would be held in the meantime.
    ///
    /// # Errors
    /// `overloaded`: it is not free.
    pub fn ready_answer(&self, tenant: &str, bytes: usize) -> Result<Option<Permit>, ApiError> {
        if bytes <= SMALL_BYTES {
            return Ok(None);
        }
        let share = self.answers.try_take(tenant, units(bytes));
        share.map(Some).ok_or_else(|| no_memory(ANSWERS, bytes))
    }

    /// Could there ever be memory for an answer of so many bytes?
    #[must_use]
    pub fn has_room_for(&self, bytes: usize) -> bool {
        bytes <= SMALL_BYTES || self.answers.of_one() >= units(bytes) as usize
    }

    /// A turn and memory for an answer of so many bytes; to be taken before anything is loaded for it.
    ///
    /// # Errors
    /// `overloaded`: too many wait already, or too long.
    pub async fn rendering(&self, tenant: &str, bytes: usize) -> Result<Rendering, ApiError> {
        let waiting = self.waiting.try_take(tenant, 1).ok_or_else(|| {
            overloaded("as many requests wait for pictures, grids and tables as there may be (`--renderings-waiting-max`)")
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
    /// Runs the work on the pool of blocking threads. The second value holds the memory of the answer, counted by its actual size.
    ///
    /// # Errors
    /// What `work` fails with, or `overloaded` if the answer is larger than was thought and there is no memory for it.
    pub async fn run<T: Send + 'static>(
        self,
        work: impl FnOnce() -> Result<T, ApiError> + Send + 'static,
        size: impl Fn(&T) -> usize,
    ) -> Result<(T, Option<Permit>), ApiError> {
        let turn = self.turn;
        let work = blocking(move || {
            // The turn is held until the work ends, even if the client has gone away.
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
) -> Result<Option<Permit>, ApiError> {
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
        "the memory for {what} is taken; {bytes} bytes are needed (`--request-memory-mb`, `--tenant-request-memory-mb`)"
    ))
}

fn overloaded(detail: &str) -> ApiError {
    ApiError::new(ProblemKind::Overloaded, detail)
}
