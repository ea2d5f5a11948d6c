//! Cached positions in long queues, so that a claim does not scan rows that were claimed before.
//!
//! Claimed rows remain in the index of queued jobs until VACUUM removes them, which is delayed by old snapshots. A claim
//! therefore begins where the previous claim of this process began. Jobs that returned to the queue before that position,
//! or were accepted by a node whose clock is behind, wait until the position expires.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use sqlx::Row;
use sqlx::postgres::{PgConnection, PgRow};
use sqlx::query;

use crate::model::Queue;
use crate::store::postgres::sql::claim::{PEEK, first_queued};
use crate::store::postgres::sql::rows::count;
use crate::store::{ClaimRequest, Result};
use crate::sync::lock;

/// Shorter queues are counted and scanned from their start at every claim.
const LONG: u64 = 2000;

/// How long the position of a claim is kept.
const PLACE_KEPT: Duration = Duration::from_secs(2);

/// How long the list of queues is cached while one of them is long.
const QUEUES_KEPT: Duration = Duration::from_millis(250);

/// Number of priority ranks.
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

/// As `PEEK`, from a position in each rank on. The parts are scanned in their order, and only as far as needed.
const PEEK_FROM: &str = concat!(
    "SELECT id, suspect, cost_us, rank FROM (",
    peek_of!("0", "$5"),
    " UNION ALL ",
    peek_of!("1", "$6"),
    " UNION ALL ",
    peek_of!("2", "$7"),
    ") AS queued LIMIT $2"
);

/// Positions in a long queue by rank; empty: its start. The time is that of the last scan from the start.
type Places = (Instant, [String; RANKS]);

#[derive(Debug, Default)]
struct Known {
    places: HashMap<Queue, Places>,
    queues: Option<(Instant, Vec<(Queue, u64)>)>,
}

/// The cache of a process; clones share it.
#[derive(Debug, Clone, Default)]
pub(crate) struct ClaimMemory(Arc<Mutex<Known>>);

impl ClaimMemory {
    /// Forgets the positions, because jobs returned to the queue.
    pub(crate) fn forget_places(&self) {
        lock(&self.0).places.clear();
    }

    /// Selects and locks the first jobs of a queue, at most as many as requested.
    pub(crate) async fn peek(
        &self,
        connection: &mut PgConnection,
        request: &ClaimRequest<'_>,
    ) -> Result<Vec<PgRow>> {
        let places = lock(&self.0).places.get(request.queue).cloned();
        if let Some((since, [high, normal, low])) = places
            && since.elapsed() < PLACE_KEPT
        {
            let found = sql!(fetch_all, &mut *connection,
                PEEK_FROM;
                &*request.queue.tenant, count(request.jobs), request.late_before,
                request.each_slice_us.map_or(i64::MAX, count), high, normal, low,
                request.queue.kind.name(), i64::from(request.suspects)
            )?;
            self.remember(request, &found, since)?;
            if !found.is_empty() {
                return Ok(found);
            }
        }
        let found = first_queued(connection, PEEK, request, request.jobs).await?;
        self.remember(request, &found, Instant::now())?;
        Ok(found)
    }

    /// Stores the position of a full group of a long queue; after an incomplete group the next claim begins at the start.
    fn remember(&self, request: &ClaimRequest<'_>, found: &[PgRow], since: Instant) -> Result<()> {
        let mut known = lock(&self.0);
        let Some((_, mut places)) = known.places.remove(request.queue).or_else(|| {
            let begin = (since, Default::default());
            (request.waiting >= LONG).then_some(begin)
        }) else {
            return Ok(());
        };
        if found.len() < request.jobs {
            return Ok(());
        }
        // The first of each rank, in the order of the queue.
        for row in found.iter().rev() {
            let rank: i64 = row.try_get("rank")?;
            let place = usize::try_from(rank).ok();
            if let Some(place) = place.and_then(|rank| places.get_mut(rank)) {
                *place = row.try_get("id")?;
            }
        }
        known.places.insert(request.queue.clone(), (since, places));
        Ok(())
    }

    /// The cached list of queues, if one of them is long.
    pub(crate) fn queues(&self) -> Option<Vec<(Queue, u64)>> {
        let known = lock(&self.0);
        let (at, queues) = known.queues.as_ref()?;
        let long = queues.iter().any(|(_, waiting)| *waiting >= LONG);
        (long && at.elapsed() < QUEUES_KEPT).then(|| queues.clone())
    }

    /// Caches the list of queues.
    pub(crate) fn remember_queues(&self, queues: &[(Queue, u64)]) {
        lock(&self.0).queues = Some((Instant::now(), queues.to_vec()));
    }
}
