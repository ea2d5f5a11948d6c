//! Does the job table behave like a plain model of it, whatever is asked in whatever order?

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use proptest::prelude::*;
use railhead::jobs::State;
use railhead::jobs::store::Store;
use railhead::jobs::store::types::QueueBounds;
use railhead::jobs::store::types::Reap;
use railhead::jobs::store::types::{
    Claim, Deleted, Ending, NewJob, ReleaseReason, Renewal, StoredResult,
};
use railhead::jobs::submit_options::SubmitOptions;
use uuid::Uuid;

use crate::store::{claim_up_to, finish_one, open_sqlite};

const LEASE: i64 = 10;
const ATTEMPTS_MAX: u32 = 2;

#[derive(Debug, Clone)]
enum Move {
    Enqueue,
    Claim,
    Pass(i64),
    Reap,
    Renew(prop::sample::Index),
    Finish(prop::sample::Index, bool),
    Release(prop::sample::Index),
    Cancel(prop::sample::Index),
    Delete(prop::sample::Index),
}

#[derive(Debug, Clone, PartialEq)]
struct Row {
    state: State,
    attempt: u32,
    lease_number: u64,
    lease_until: i64,
    cancel_requested: bool,
}

fn moves() -> impl Strategy<Value = Move> {
    let index = any::<prop::sample::Index>;
    prop_oneof![
        3 => Just(Move::Enqueue),
        4 => Just(Move::Claim),
        2 => (1_i64..12).prop_map(Move::Pass),
        2 => Just(Move::Reap),
        2 => index().prop_map(Move::Renew),
        2 => (index(), any::<bool>()).prop_map(|(at, well)| Move::Finish(at, well)),
        1 => index().prop_map(Move::Release),
        2 => index().prop_map(Move::Cancel),
        1 => index().prop_map(Move::Delete),
    ]
}

/// The table and its model, side by side.
struct Pair {
    store: Arc<dyn Store>,
    rows: BTreeMap<Uuid, Row>,
    ids: Vec<Uuid>,
    claims: Vec<Claim>,
    now: i64,
}

impl Pair {
    /// The row a claim still holds.
    fn held(&mut self, claim: &Claim) -> Option<&mut Row> {
        self.rows
            .get_mut(&claim.id)
            .filter(|row| row.state == State::Running && row.lease_number == claim.lease_number)
    }

    async fn make(&mut self, step: Move) {
        match step {
            Move::Enqueue => self.enqueue().await,
            Move::Claim => self.claim().await,
            Move::Pass(time) => self.now += time,
            Move::Reap => self.reap().await,
            Move::Cancel(at) if !self.ids.is_empty() => self.cancel(*at.get(&self.ids)).await,
            Move::Delete(at) if !self.ids.is_empty() => self.delete(*at.get(&self.ids)).await,
            Move::Renew(at) if !self.claims.is_empty() => {
                self.renew(at.get(&self.claims).clone()).await
            }
            Move::Finish(at, well) if !self.claims.is_empty() => {
                self.finish(at.get(&self.claims).clone(), well).await
            }
            Move::Release(at) if !self.claims.is_empty() => {
                self.release(at.get(&self.claims).clone()).await
            }
            _ => {}
        }
    }

    async fn enqueue(&mut self) {
        let id = Uuid::now_v7();
        let new = NewJob {
            tenant: "anonymous".into(),
            id,
            created_at: 0,
            name: None,
            labels: BTreeMap::new(),
            method: "auto".to_owned(),
            body: Bytes::from_static(b"{}"),
            row: false,
            outputs: "[]".to_owned(),
            cost_us: 1000,
            slice_us: 1000,
            cache_key: None,
            source: None,
            idempotency: None,
            traceparent: None,
            options: SubmitOptions::default(),
        };
        self.store.enqueue(&new, QueueBounds::NONE).await.unwrap();
        self.ids.push(id);
        let row = Row {
            state: State::Queued,
            attempt: 0,
            lease_number: 0,
            lease_until: 0,
            cancel_requested: false,
        };
        self.rows.insert(id, row);
    }

    async fn claim(&mut self) {
        let claim = claim_up_to(&*self.store, self.now, LEASE, 1).await.pop();
        let oldest = self
            .rows
            .iter_mut()
            .find(|(_, row)| row.state == State::Queued);
        assert_eq!(
            claim.as_ref().map(|claim| claim.id),
            oldest.as_ref().map(|(id, _)| **id)
        );
        if let (Some(claim), Some((_, row))) = (claim, oldest) {
            row.state = State::Running;
            row.attempt += 1;
            row.lease_number += 1;
            row.lease_until = self.now + LEASE;
            assert_eq!(
                (claim.attempt, claim.lease_number),
                (row.attempt, row.lease_number)
            );
            self.claims.push(claim);
        }
    }

    async fn reap(&mut self) {
        let mut taken = self
            .store
            .reap(
                Reap::Expired {
                    lease_until: self.now,
                },
                self.now,
                ATTEMPTS_MAX,
            )
            .await
            .unwrap();
        taken.sort_unstable();
        let mut expected = Vec::new();
        for (id, row) in &mut self.rows {
            if row.state == State::Running && row.lease_until <= self.now {
                row.state = match (row.cancel_requested, row.attempt >= ATTEMPTS_MAX) {
                    (true, _) => State::Cancelled,
                    (false, true) => State::Failed,
                    (false, false) => State::Queued,
                };
                expected.push((*id, row.state));
            }
        }
        assert_eq!(taken, expected);
    }

    async fn renew(&mut self, claim: Claim) {
        let renewals = self.store.renew(&[(&claim, 0.5)], self.now + LEASE).await;
        let renewal = renewals.unwrap()[0];
        let until = self.now + LEASE;
        let expected = self.held(&claim).map_or(Renewal::Lost, |row| {
            row.lease_until = until;
            Renewal::Held {
                cancel_requested: row.cancel_requested,
            }
        });
        assert_eq!(renewal, expected);
    }

    async fn finish(&mut self, claim: Claim, well: bool) {
        let ending = if well {
            Ending::Succeeded {
                remarks: Vec::new(),
                result: StoredResult::Blob("k".to_owned(), 1),
                field_patches: 0,
            }
        } else {
            Ending::Cancelled
        };
        let job = finish_one(&*self.store, &claim, &ending, self.now).await;
        let held = self.held(&claim);
        assert_eq!(job.is_some(), held.is_some());
        if let Some(row) = held {
            row.state = if well {
                State::Succeeded
            } else {
                State::Cancelled
            };
        }
    }

    async fn release(&mut self, claim: Claim) {
        let claims = std::slice::from_ref(&claim);
        let released = self
            .store
            .release(claims, ReleaseReason::NotBegun, self.now)
            .await;
        let state = released.unwrap().first().map(|(_, state)| *state);
        let expected = self.held(&claim).map(|row| {
            row.attempt -= 1;
            row.state = if row.cancel_requested {
                State::Cancelled
            } else {
                State::Queued
            };
            row.state
        });
        assert_eq!(state, expected);
    }

    async fn cancel(&mut self, id: Uuid) {
        let job = self.store.cancel("anonymous", id, self.now).await.unwrap();
        let row = self.rows.get_mut(&id);
        assert_eq!(job.is_some(), row.is_some());
        if let Some(row) = row.filter(|row| !row.state.ended()) {
            row.cancel_requested = true;
            if row.state == State::Queued {
                row.state = State::Cancelled;
            }
        }
    }

    async fn delete(&mut self, id: Uuid) {
        let expected = match self.rows.get(&id) {
            None => Deleted::NotFound,
            Some(row) if row.state.ended() => Deleted::Done,
            Some(row) => Deleted::NotEnded(row.state),
        };
        assert_eq!(self.store.delete("anonymous", id).await.unwrap(), expected);
        if expected == (Deleted::Done) {
            self.rows.remove(&id);
        }
    }

    /// The table says of every job what the model says, and the moves seen are allowed ones.
    async fn compare(&self, before: &BTreeMap<Uuid, Row>) {
        for id in &self.ids {
            let job = self.store.job("anonymous", *id).await.unwrap();
            let seen = job.map(|job| (job.state, job.attempt));
            assert_eq!(seen, self.rows.get(id).map(|row| (row.state, row.attempt)));
            if let (Some(old), Some(new)) = (before.get(id), self.rows.get(id)) {
                let (old, new) = (old.state, new.state);
                assert!(old == new || old.may_become(new), "{old:?} became {new:?}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn the_table_agrees_with_its_model(steps in prop::collection::vec(moves(), 1..60)) {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let folder = tempfile::tempdir().unwrap();
            let mut pair = Pair {
                store: open_sqlite(&folder.path().join("jobs.db")).await,
                rows: BTreeMap::new(),
                ids: Vec::new(),
                claims: Vec::new(),
                now: 0,
            };
            for step in steps {
                let before = pair.rows.clone();
                pair.make(step).await;
                pair.compare(&before).await;
            }
        });
    }
}
