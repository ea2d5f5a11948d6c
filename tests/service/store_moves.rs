//! Calls of a store, with their effect on its model.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use railhead::jobs::codec::result::EncodedResult;
use railhead::jobs::model::{Priority, SubmitOptions};
use railhead::jobs::store::{
    Claim, ClaimKind, ClaimRequest, Ending, Enqueued, Lease, Moment, NewJob, NewSlice, QueueBounds,
    Reap, ReleaseReason, RetentionRule, SliceRecord, Store, StoredResult,
};
use railhead::jobs::{Failure, FailureKind, State};
use uuid::Uuid;

use crate::model::{ATTEMPTS_MAX, BOUNDS, Model, Row};
use crate::store::{Table, failure, new_job, queue_of, request};
use crate::store_back::Saved;

pub const LEASE: i64 = 10;
const KEPT: i64 = 15;
pub const TENANTS: [&str; 2] = ["a", "b"];

/// A store and its model.
pub struct Pair {
    pub table: Table,
    pub store: Arc<dyn Store>,
    pub saved: Option<Saved>,
    pub model: Model,
    pub ids: Vec<Uuid>,
    pub batches: Vec<Uuid>,
    pub groups: Vec<Vec<Claim>>,
    /// The keys of the large results that the store has received.
    pub given: BTreeSet<String>,
    pub now: i64,
}

impl Pair {
    fn lease(&self) -> Lease {
        Lease {
            now: self.now,
            ms: LEASE,
        }
    }

    pub fn new_job(&self, tenant: &'static str, rank: u8) -> NewJob {
        NewJob {
            tenant: tenant.into(),
            created_at: self.now,
            options: SubmitOptions {
                priority: Priority::ALL[usize::from(rank)],
                ..SubmitOptions::default()
            },
            ..new_job()
        }
    }

    pub async fn enqueue(
        &mut self,
        tenant: &'static str,
        rank: u8,
        within: Option<i64>,
        key: Option<u8>,
    ) {
        let mut new = self.new_job(tenant, rank);
        let within_ms = within.map(|ms| Duration::from_millis(ms.unsigned_abs()));
        new.options.ends_within = within_ms;
        let tenant_byte = tenant.as_bytes()[0];
        new.cache_key = key.map(|key| [tenant_byte, key, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        let sources = new.cache_key.map(|key| self.model.sources(key));
        let sources = sources.unwrap_or_default();
        let bounds = QueueBounds {
            all: BOUNDS.0,
            tenant: BOUNDS.1,
            stored: None,
        };
        let answer = self.store.enqueue(&new, bounds).await.unwrap();
        let admitted = match sources.is_empty() {
            false => Ok(()),
            true => self.model.admit(tenant, 1),
        };
        if let Err(refusal) = admitted {
            return assert_eq!(answer, Enqueued::Refused(refusal));
        }
        let mut row = Row::new(tenant, rank);
        row.deadline = within.map(|within| self.now + within);
        row.cache_key = new.cache_key;
        self.model.rows.insert(new.id, row);
        self.ids.push(new.id);
        if !sources.is_empty() {
            let stored = self.store.result(tenant, new.id).await.unwrap();
            let blob = match stored.unwrap().1.unwrap().result {
                StoredResult::Blob(key, _) => Some(key),
                StoredResult::Inline(_) => None,
            };
            let source = sources.iter().find(|id| self.model.rows[id].blob == blob);
            assert!(self.model.share(new.id, *source.unwrap(), self.now));
        }
        let Enqueued::Created(job) = answer else {
            panic!("{answer:?}")
        };
        assert_eq!(job.state, self.model.rows[&new.id].state);
    }

    pub async fn claim(&mut self, tenant: &'static str, jobs: usize, begun: bool) {
        let queue = queue_of(tenant);
        let mut request = ClaimRequest {
            lease: self.lease(),
            ..request(&queue, jobs, self.now)
        };
        if begun {
            request.kind = ClaimKind::Begun;
        }
        let claims = self.store.claim(&request).await.unwrap();
        let expected = self.model.choose(tenant, jobs, begun, self.now);
        let ids: Vec<Uuid> = claims.iter().map(|claim| claim.id).collect();
        assert_eq!(ids, expected);
        for claim in &claims {
            let row = self.model.rows.get_mut(&claim.id).unwrap();
            row.claimed(claims.len(), self.now + LEASE, claim.lease_token);
            let said = (claim.attempt, claim.suspect, claim.slices as usize);
            let known = (row.attempt, row.suspect, row.slices.len());
            assert_eq!(said, known);
        }
        if !claims.is_empty() {
            self.groups.push(claims);
        }
    }

    pub async fn reap(&mut self, dead: bool) {
        let (which, expected) = match dead {
            true => (Reap::Dead, self.model.reap_dead(self.now)),
            false => (
                Reap::Expired { now: self.now },
                self.model.reap_expired(self.now),
            ),
        };
        let taken = self
            .store
            .reap(which, self.now, ATTEMPTS_MAX)
            .await
            .unwrap();
        assert_eq!(taken.into_iter().collect::<BTreeMap<_, _>>(), expected);
    }

    pub async fn pass_deadlines(&mut self) {
        let moment = Moment {
            now: self.now,
            set_at: 0,
            unset: self.now,
        };
        let failure = Failure::new(FailureKind::DeadlinePassed, "late");
        let overdue = self.store.pass_deadlines(&failure, moment).await.unwrap();
        let (mut ended, mut running) = (BTreeSet::new(), BTreeSet::new());
        for (id, row) in self
            .model
            .rows
            .iter_mut()
            .filter(|(_, row)| row.is_late(self.now))
        {
            match row.state {
                State::Queued => {
                    row.become_state(State::Failed, self.now);
                    ended.insert(*id);
                }
                State::Running => drop(running.insert(*id)),
                _ => {}
            }
        }
        assert_eq!(overdue.ended.into_iter().collect::<BTreeSet<_>>(), ended);
        assert_eq!(
            overdue.running.into_iter().collect::<BTreeSet<_>>(),
            running
        );
    }

    pub async fn expire(&mut self) {
        let ended_before = self.now - KEPT;
        let rule = RetentionRule {
            now: self.now,
            ended_before,
            forget_before: 0,
            jobs: 2,
        };
        let removed = self.store.expire(rule).await.unwrap();
        assert_eq!(removed, self.model.expire(ended_before, 2));
    }

    pub async fn renew(&mut self, claim: &Claim) {
        let until = self.now + LEASE;
        let held = [(claim, 0.5)];
        let renewed = self.store.renew(&held, self.lease()).await.unwrap();
        let held = self.model.held(claim.id, claim.lease_token);
        assert_eq!(renewed.contains(&claim.id), held.is_some());
        if let Some(row) = held {
            row.lease_until = until;
        }
    }

    pub async fn add_slice(&mut self, claim: &Claim) {
        let row = self.model.held(claim.id, claim.lease_token);
        let number = row.as_ref().map_or(0, |row| row.slices.len());
        let key = format!("{}/{}-{number}", claim.id, claim.lease_token);
        let slice = NewSlice {
            note: SliceRecord {
                number: u32::try_from(number).unwrap(),
                motions: 1,
                digest: key.clone(),
                spent: Duration::from_secs(1),
            },
            result: StoredResult::Blob(key.clone(), 7),
            done: 0.5,
            rest_us: 1000,
        };
        let added = self.store.add_slice(claim, &slice).await.unwrap();
        assert_eq!(added, row.is_some());
        if let Some(row) = row {
            (row.attempt, row.begun) = (1, true);
            row.slices.push(key.clone());
            self.given.insert(key);
        }
    }

    /// Returns a successful ending with a large or a small result, and the key of a large result.
    pub fn success(&mut self, claim: &Claim, large: bool) -> (Ending, Option<String>) {
        let key = large.then(|| format!("{}/{}", claim.id, claim.lease_token));
        self.given.extend(key.clone());
        let small = || {
            StoredResult::Inline(EncodedResult {
                solution: Bytes::from_static(b"{}"),
                fields: None,
            })
        };
        let result = key
            .clone()
            .map_or_else(small, |key| StoredResult::Blob(key, 1));
        (
            Ending::Succeeded {
                remarks: Vec::new(),
                result,
                field_patches: 0,
            },
            key,
        )
    }

    pub async fn finish(&mut self, claim: &Claim, how: u8) {
        let (ending, blob) = match how {
            0 => (Ending::Cancelled, None),
            1 => (failure(), None),
            how => self.success(claim, how == 2),
        };
        let ends = [(claim.clone(), ending.clone())];
        let ended = self.store.finish(&ends, self.now).await.unwrap();
        let row = self.model.held(claim.id, claim.lease_token);
        assert_eq!(ended.contains(&claim.id), row.is_some());
        if let Some(row) = row {
            row.become_state(ending.state(), self.now);
            row.blob = blob;
        }
    }

    /// Ends a group. Its first job is solved and the others share its result.
    pub async fn finish_group(&mut self, group: &[Claim]) {
        let (first, blob) = self.success(&group[0], true);
        let mut ends = vec![(group[0].clone(), first)];
        let cached = Ending::Cached {
            source: group[0].id,
        };
        ends.extend(
            group[1..]
                .iter()
                .map(|claim| (claim.clone(), cached.clone())),
        );
        let ended = self.store.finish(&ends, self.now).await.unwrap();
        let mut expected = HashSet::new();
        if let Some(row) = self.model.held(group[0].id, group[0].lease_token) {
            row.become_state(State::Succeeded, self.now);
            row.blob = blob;
            expected.insert(group[0].id);
        }
        for claim in &group[1..] {
            let held = self.model.held(claim.id, claim.lease_token).is_some();
            if held && self.model.share(claim.id, group[0].id, self.now) {
                self.model.rows.get_mut(&claim.id).unwrap().attempt -= 1;
                expected.insert(claim.id);
            }
        }
        assert_eq!(ended, expected);
    }

    pub async fn release(&mut self, claim: &Claim) {
        let claims = std::slice::from_ref(claim);
        let why = ReleaseReason::NotBegun;
        let released = self.store.release(claims, why, self.now).await.unwrap();
        let held = self.model.held(claim.id, claim.lease_token);
        let expected = held.map(|row| {
            row.released(self.now);
            (claim.id, row.state)
        });
        assert_eq!(released, Vec::from_iter(expected));
    }

    pub async fn cancel(&mut self, id: Uuid) {
        let row = self.model.rows.get_mut(&id);
        let tenant = row.as_ref().map_or(TENANTS[0], |row| row.tenant);
        let stranger = self.store.cancel("nobody", id, self.now).await.unwrap();
        assert_eq!(stranger, None);
        let job = self.store.cancel(tenant, id, self.now).await.unwrap();
        let expected = row.map(|row| {
            row.cancelled(self.now);
            row.state
        });
        assert_eq!(job.map(|job| job.state), expected);
    }

    pub async fn delete(&mut self, id: Uuid) {
        let (tenant, expected) = match self.model.rows.get(&id) {
            None => (TENANTS[0], false),
            Some(row) => (row.tenant, row.state.ended()),
        };
        assert!(!self.store.delete("nobody", id).await.unwrap());
        assert_eq!(self.store.delete(tenant, id).await.unwrap(), expected);
        if expected {
            self.model.rows.remove(&id);
        }
    }
}
