//! What a process remembers of long queues between two claims, so that a claim does not walk over what was claimed before.
//!
//! Rows that were claimed stay in the index of queued jobs until VACUUM removes them, which it cannot while somebody holds an old
//! snapshot. A claim therefore begins where the last one of this process began. Jobs that came back to the queue below that place, or
//! were accepted by a node whose clock is behind, wait until the place is forgotten.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use sqlx::Row;
use sqlx::postgres::{PgConnection, PgRow};

use crate::jobs::model::kind::Queue;
use crate::jobs::store::claim::ClaimRequest;
use crate::jobs::store::postgres::sql::claim::peek;
use crate::jobs::store::postgres::sql::rows::{count, read_count};
use crate::jobs::store_error::StoreError;
use crate::jobs::sync::lock;

/// Queues that are shorter are counted and walked from their start at every claim.
const LONG: i64 = 2000;

/// How long the place of a claim is remembered.
const PLACE_KEPT: Duration = Duration::from_secs(2);

/// How long the length of a queue is remembered, less what was claimed since.
const LENGTH_KEPT: Duration = Duration::from_secs(1);

/// How long the queues with jobs in them are remembered while one is long.
const QUEUES_KEPT: Duration = Duration::from_millis(250);

/// Ranks of priority, the most urgent first.
const RANKS: usize = 3;

macro_rules! peek_of {
    ($rank:literal, $after:literal) => {
        concat!(
            "SELECT * FROM (SELECT id, suspect, cost_us, rank FROM jobs \
             WHERE state = 'queued' AND tenant = $1 AND kind = $8 AND (deadline IS NULL OR deadline > $3) AND slice_us <= $4 AND suspect <= $9 AND slices = 0 \
             AND (batch_id IS NULL OR batch_id NOT IN (SELECT id FROM batches WHERE complete = 0 AND tenant = $1)) \
             AND rank = ",
            $rank,
            " AND id >= ",
            $after,
            " ORDER BY id LIMIT $2 FOR UPDATE SKIP LOCKED) AS rank",
            $rank
        )
    };
}

/// As the peek of every claim, from a place in each rank on. The parts are walked in their order, and only as far as needed.
const PEEK_FROM: &str = concat!(
    "SELECT id, suspect, cost_us, rank FROM (",
    peek_of!("0", "$5"),
    " UNION ALL ",
    peek_of!("1", "$6"),
    " UNION ALL ",
    peek_of!("2", "$7"),
    ") AS queued LIMIT $2"
);

/// The jobs of a queue that come first: by priority, the oldest of each first. Jobs whose deadline has passed are
/// left to whoever ends them, jobs of a batch that is not acknowledged to whoever fills it.
const PEEK: &str = peek!("slices = 0", "$2", "$6");

/// Like `PEEK`, for jobs of which some slices are solved.
pub(crate) const PEEK_BEGUN: &str = peek!("slices > 0", "$2", "$6");

/// Jobs in a queue.
const WAITING: &str = "SELECT CAST(COALESCE(SUM(number), 0) AS bigint) AS number FROM job_counts \
     WHERE state = 'queued' AND tenant = $1 AND kind = $2";

/// Number of waiting jobs of a queue, and where its last claims began.
#[derive(Debug, Clone)]
struct KnownQueue {
    waiting: i64,
    counted: Instant,
    /// Where the last claim began, in each rank; empty: at its start.
    places: [String; RANKS],
    placed: Option<Instant>,
}

#[derive(Debug, Default)]
struct Known {
    queues: HashMap<Queue, KnownQueue>,
    all: Option<(Instant, Vec<Queue>)>,
}

/// What a process remembers; clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct ClaimMemory(Arc<Mutex<Known>>);

impl ClaimMemory {
    fn known(&self) -> MutexGuard<'_, Known> {
        lock(&self.0)
    }

    /// Jobs went back to the queue: the next claims walk it from the start.
    pub(crate) fn forget_places(&self) {
        for queue in self.known().queues.values_mut() {
            queue.placed = None;
        }
    }

    /// The number of jobs in a queue, exact for a short one.
    pub(crate) async fn waiting(
        &self,
        connection: &mut PgConnection,
        queue: &Queue,
    ) -> Result<i64, StoreError> {
        if let Some(known) = self.known().queues.get(queue)
            && known.waiting >= LONG
            && known.counted.elapsed() < LENGTH_KEPT
        {
            return Ok(known.waiting);
        }
        let waiting = count_waiting(connection, queue).await?;
        let mut known = self.known();
        match known.queues.get_mut(queue) {
            Some(known) => {
                (known.waiting, known.counted) = (waiting, Instant::now());
            }
            None if waiting >= LONG => {
                let long = KnownQueue {
                    waiting,
                    counted: Instant::now(),
                    places: Default::default(),
                    placed: None,
                };
                known.queues.insert(queue.clone(), long);
            }
            None => {}
        }
        if waiting < LONG {
            known.queues.remove(queue);
        }
        Ok(waiting)
    }

    /// The first jobs of a queue, locked, at most `most`.
    pub(crate) async fn peek(
        &self,
        connection: &mut PgConnection,
        request: &ClaimRequest<'_>,
        most: i64,
    ) -> Result<Vec<PgRow>, StoreError> {
        let places = {
            let known = self.known();
            let queue = known.queues.get(request.queue);
            let kept =
                |queue: &&KnownQueue| queue.placed.is_some_and(|at| at.elapsed() < PLACE_KEPT);
            queue.filter(kept).map(|queue| queue.places.clone())
        };
        if let Some([high, normal, low]) = places {
            let found = sqlx::query(PEEK_FROM)
                .bind(&*request.queue.tenant)
                .bind(most)
                .bind(request.late_before)
                .bind(request.each_slice_us.map_or(i64::MAX, count))
                .bind(high)
                .bind(normal)
                .bind(low)
                .bind(request.queue.kind.name())
                .bind(i64::from(request.suspects))
                .fetch_all(&mut *connection)
                .await?;
            if i64::try_from(found.len()).unwrap_or(i64::MAX) == most {
                self.remember(request.queue, &found, false)?;
                return Ok(found);
            }
            self.forget_places();
            if !found.is_empty() {
                return Ok(found);
            }
        }
        let found = first_queued(connection, PEEK, request, most).await?;
        if i64::try_from(found.len()).unwrap_or(i64::MAX) == most {
            self.remember(request.queue, &found, true)?;
        }
        Ok(found)
    }

    /// Remembers where a full group began.
    fn remember(&self, queue: &Queue, found: &[PgRow], anew: bool) -> Result<(), StoreError> {
        let mut known = self.known();
        let Some(queue) = known.queues.get_mut(queue) else {
            return Ok(());
        };
        if anew {
            queue.places = Default::default();
            queue.placed = Some(Instant::now());
        }
        queue.waiting -= i64::try_from(found.len()).unwrap_or(0);
        // The first of each rank, in the order of the queue.
        for row in found.iter().rev() {
            let rank: i64 = row.try_get("rank")?;
            if let Some(place) = usize::try_from(rank)
                .ok()
                .and_then(|rank| queue.places.get_mut(rank))
            {
                *place = row.try_get("id")?;
            }
        }
        Ok(())
    }

    /// The queues with jobs in them as they were a moment ago, if one is long.
    pub(crate) fn queues(&self) -> Option<Vec<Queue>> {
        let known = self.known();
        let (at, queues) = known.all.as_ref()?;
        (!known.queues.is_empty() && at.elapsed() < QUEUES_KEPT).then(|| queues.clone())
    }

    /// Remembers the queues with jobs in them.
    pub(crate) fn remember_queues(&self, queues: &[Queue]) {
        self.known().all = Some((Instant::now(), queues.to_vec()));
    }
}

/// The first jobs of a queue, found by a statement from its start.
pub(crate) async fn first_queued(
    connection: &mut PgConnection,
    peek: &'static str,
    request: &ClaimRequest<'_>,
    most: i64,
) -> Result<Vec<PgRow>, StoreError> {
    let rows = sqlx::query(peek)
        .bind(&*request.queue.tenant)
        .bind(most)
        .bind(request.late_before)
        .bind(request.each_slice_us.map_or(i64::MAX, count))
        .bind(request.queue.kind.name())
        .bind(i64::from(request.suspects))
        .fetch_all(connection)
        .await?;
    Ok(rows)
}

/// Jobs in a queue.
async fn count_waiting(connection: &mut PgConnection, queue: &Queue) -> Result<i64, StoreError> {
    let row = sqlx::query(WAITING)
        .bind(&*queue.tenant)
        .bind(queue.kind.name())
        .fetch_one(connection)
        .await?;
    Ok(count(read_count(&row, "number")?))
}
