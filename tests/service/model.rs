//! A model of a job table: rows in a map, and the effect of each call on them.

use std::collections::{BTreeMap, BTreeSet};

use railhead::jobs::State;
use railhead::jobs::store::{CacheKey, Refusal};
use uuid::Uuid;

/// The number of attempts at a job before it fails.
pub const ATTEMPTS_MAX: u32 = 2;
/// The limits of the queue for all tenants and for one tenant.
pub const BOUNDS: (u64, u64) = (14, 9);

#[derive(Debug, Clone)]
pub struct Row {
    pub tenant: &'static str,
    pub state: State,
    pub rank: u8,
    pub deadline: Option<i64>,
    pub cache_key: Option<CacheKey>,
    pub batch: Option<Uuid>,
    pub attempt: u32,
    pub lease_token: u64,
    pub lease_until: i64,
    pub group_size: usize,
    pub suspect: bool,
    pub cancel_requested: bool,
    pub ended_at: i64,
    pub cached: bool,
    /// The key of the result.
    pub blob: Option<String>,
    /// The keys of the stored slices.
    pub slices: Vec<String>,
    /// Whether slices were ever stored.
    pub begun: bool,
}

#[derive(Debug, Clone)]
pub struct BatchRow {
    pub tenant: &'static str,
    pub count: u32,
    pub filled: u32,
    pub complete: bool,
}

#[derive(Debug, Clone, Default)]
pub struct Model {
    pub rows: BTreeMap<Uuid, Row>,
    pub batches: BTreeMap<Uuid, BatchRow>,
    pub expired: BTreeSet<Uuid>,
}

impl Row {
    pub fn new(tenant: &'static str, rank: u8) -> Row {
        Row {
            tenant,
            state: State::Queued,
            rank,
            deadline: None,
            cache_key: None,
            batch: None,
            attempt: 0,
            lease_token: 0,
            lease_until: 0,
            group_size: 1,
            suspect: false,
            cancel_requested: false,
            ended_at: 0,
            cached: false,
            blob: None,
            slices: Vec::new(),
            begun: false,
        }
    }

    /// Changes the state and asserts that the transition is allowed.
    pub fn become_state(&mut self, state: State, now: i64) {
        assert!(self.state.may_become(state), "{:?} → {state:?}", self.state);
        self.state = state;
        if state.ended() {
            self.ended_at = now;
            self.slices.clear();
        }
    }

    pub fn claimed(&mut self, group_size: usize, lease_until: i64, lease_token: u64) {
        self.become_state(State::Running, 0);
        self.attempt += 1;
        assert_ne!(self.lease_token, lease_token, "no token comes twice");
        self.lease_token = lease_token;
        self.lease_until = lease_until;
        self.group_size = group_size;
    }

    /// Returns the job to the queue without counting the attempt, or cancels it if that was requested.
    pub fn released(&mut self, now: i64) {
        self.attempt -= 1;
        let state = match self.cancel_requested {
            true => State::Cancelled,
            false => State::Queued,
        };
        self.become_state(state, now);
    }

    /// Applies the expiry of the lease.
    pub fn reaped(&mut self, now: i64) {
        if self.group_size > 1 {
            self.suspect = true;
            return self.released(now);
        }
        let state = match (self.cancel_requested, self.attempt >= ATTEMPTS_MAX) {
            (true, _) => State::Cancelled,
            (false, true) => State::Failed,
            (false, false) => State::Queued,
        };
        self.become_state(state, now);
    }

    pub fn cancelled(&mut self, now: i64) {
        if self.state.ended() {
            return;
        }
        self.cancel_requested = true;
        if self.state == State::Queued {
            self.become_state(State::Cancelled, now);
        }
    }

    pub fn is_late(&self, now: i64) -> bool {
        self.deadline.is_some_and(|deadline| deadline <= now)
    }
}

impl Model {
    /// Returns the number of queued jobs and reserved places, of one tenant or of all.
    fn taken(&self, tenant: Option<&str>) -> u64 {
        let of = |other: &str| tenant.is_none_or(|tenant| tenant == other);
        let rows = self.rows.values();
        let queued = rows.filter(|row| row.state == State::Queued && of(row.tenant));
        let batches = self.batches.values();
        let reserved = batches.filter(|batch| !batch.complete && of(batch.tenant));
        let reserved = reserved.map(|batch| u64::from(batch.count - batch.filled));
        queued.count() as u64 + reserved.sum::<u64>()
    }

    /// Returns whether the queue has room for this many more jobs.
    pub fn admit(&self, tenant: &str, jobs: u64) -> Result<(), Refusal> {
        if self.taken(Some(tenant)) + jobs > BOUNDS.1 {
            return Err(Refusal::Quota);
        }
        match self.taken(None) + jobs > BOUNDS.0 {
            true => Err(Refusal::Queue),
            false => Ok(()),
        }
    }

    /// Returns the incomplete batches, whose jobs no worker may claim.
    pub fn filling(&self) -> Vec<Uuid> {
        let batches = self.batches.iter();
        let filling = batches.filter(|(_, batch)| !batch.complete);
        filling.map(|(id, _)| *id).collect()
    }

    /// Returns the ids that a claim takes, in order.
    pub fn choose(&self, tenant: &str, jobs: usize, begun: bool, now: i64) -> Vec<Uuid> {
        let filling = self.filling();
        let rows = self.rows.iter().filter(|(_, row)| {
            row.state == State::Queued
                && row.tenant == tenant
                && row.begun == begun
                && !row.is_late(now)
                && row.batch.is_none_or(|batch| !filling.contains(&batch))
        });
        let mut queued: Vec<_> = rows.map(|(id, row)| (row.rank, *id, row.suspect)).collect();
        queued.sort_unstable();
        let most = if begun { 1 } else { jobs };
        let mut chosen = Vec::new();
        for (_, id, suspect) in queued.into_iter().take(most) {
            if suspect && !chosen.is_empty() {
                break;
            }
            chosen.push(id);
            if suspect {
                break;
            }
        }
        chosen
    }

    /// Returns the row if the claim still holds it.
    pub fn held(&mut self, id: Uuid, lease_token: u64) -> Option<&mut Row> {
        self.rows
            .get_mut(&id)
            .filter(|row| row.state == State::Running && row.lease_token == lease_token)
    }

    /// Takes the jobs of a dead process back. The attempt counts only for jobs that were certainly the cause.
    pub fn reap_dead(&mut self, now: i64) -> BTreeMap<Uuid, State> {
        let running = self.rows.values().filter(|row| row.state == State::Running);
        let running = running.count();
        self.take_back(|row| {
            if row.group_size > 1 || (!row.suspect && running > 1) {
                row.suspect = true;
                row.released(now);
            } else {
                row.reaped(now);
            }
        })
    }

    pub fn reap_expired(&mut self, now: i64) -> BTreeMap<Uuid, State> {
        self.take_back(|row| {
            if row.lease_until <= now {
                row.reaped(now);
            }
        })
    }

    fn take_back(&mut self, take: impl Fn(&mut Row)) -> BTreeMap<Uuid, State> {
        let mut taken = BTreeMap::new();
        for (id, row) in &mut self.rows {
            if row.state == State::Running {
                take(row);
                if row.state != State::Running {
                    taken.insert(*id, row.state);
                }
            }
        }
        taken
    }

    /// Returns the succeeded jobs with this cache key.
    pub fn sources(&self, key: CacheKey) -> Vec<Uuid> {
        let rows = self.rows.iter();
        let sources =
            rows.filter(|(_, row)| row.state == State::Succeeded && row.cache_key == Some(key));
        sources.map(|(id, _)| *id).collect()
    }

    /// Gives the job the result of another job. Returns false if that result or the job does not exist.
    pub fn share(&mut self, id: Uuid, source: Uuid, now: i64) -> bool {
        let Some(blob) = self
            .rows
            .get(&source)
            .filter(|row| row.state == State::Succeeded)
            .map(|row| row.blob.clone())
        else {
            return false;
        };
        let Some(row) = self.rows.get_mut(&id) else {
            return false;
        };
        (row.blob, row.cached) = (blob, true);
        // A submission that is answered from the cache is never visible as queued.
        (row.state, row.ended_at) = (State::Succeeded, now);
        row.slices.clear();
        true
    }

    /// Returns the keys of all referenced results.
    pub fn referenced(&self) -> BTreeSet<String> {
        let rows = self.rows.values();
        rows.flat_map(|row| row.blob.iter().chain(&row.slices).cloned())
            .collect()
    }

    /// Removes at most `jobs` jobs that had ended by this time, oldest first.
    pub fn expire(&mut self, ended_before: i64, jobs: usize) -> u64 {
        let old = |id: &Uuid| i64::try_from(id.as_u128() >> 80).unwrap() <= ended_before;
        let gone: Vec<Uuid> = self
            .rows
            .iter()
            .filter(|(id, row)| row.state.ended() && row.ended_at <= ended_before && old(id))
            .map(|(id, _)| *id)
            .take(jobs)
            .collect();
        for id in &gone {
            self.rows.remove(id);
        }
        let rows = &self.rows;
        let empty = |id: &Uuid| !rows.values().any(|row| row.batch == Some(*id));
        let batches: Vec<Uuid> = self
            .batches
            .iter()
            .filter(|(id, batch)| batch.complete && old(id) && empty(id))
            .map(|(id, _)| *id)
            .collect();
        for id in &batches {
            self.batches.remove(id);
        }
        self.expired.extend(gone.iter().chain(&batches));
        gone.len() as u64
    }
}
