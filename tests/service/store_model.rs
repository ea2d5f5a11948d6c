//! Compares a store with a plain model after random sequences of calls. The calls cover tenants, priorities, groups, batches, deadlines, slices,
//! shared results, expiry, clocks that are set, and a database that returns to an earlier state.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use proptest::sample::Index;
use railhead::jobs::State;
use railhead::jobs::model::Kind;
use railhead::jobs::store::{BatchBegun, Claim, Filter, NewBatch, QueueBounds};
use uuid::Uuid;

use crate::model::{BOUNDS, BatchRow, Model, Row};
use crate::store::{StoreKind, Table, new_batch};
use crate::store_moves::{Pair, TENANTS};

#[derive(Debug, Clone)]
enum Move {
    Enqueue {
        tenant: usize,
        rank: u8,
        within: Option<i64>,
        key: Option<u8>,
    },
    BeginBatch {
        tenant: usize,
        count: u32,
    },
    FillBatch(Index),
    CompleteBatch(Index),
    DropBatch(Index),
    CancelBatch(Index),
    DeleteBatch(Index),
    Claim {
        tenant: usize,
        jobs: usize,
        begun: bool,
    },
    Pass(i64),
    Reap {
        dead: bool,
    },
    Deadlines,
    Expire,
    Renew(Index),
    AddSlice(Index),
    Finish(Index, u8),
    FinishGroup(Index),
    Release(Index),
    Cancel(Index),
    Delete(Index),
    Save,
    GoBack,
}

fn moves() -> impl Strategy<Value = Move> {
    let at = any::<Index>;
    prop_oneof![
        6 => (0..2_usize, 0..3_u8, prop::option::of(1_i64..20), prop::option::of(0..2_u8))
            .prop_map(|(tenant, rank, within, key)| Move::Enqueue { tenant, rank, within, key }),
        2 => (0..2_usize, 1..5_u32).prop_map(|(tenant, count)| Move::BeginBatch { tenant, count }),
        4 => at().prop_map(Move::FillBatch),
        2 => at().prop_map(Move::CompleteBatch),
        1 => at().prop_map(Move::DropBatch),
        1 => at().prop_map(Move::CancelBatch),
        1 => at().prop_map(Move::DeleteBatch),
        7 => (0..2_usize, 1..4_usize, prop::bool::weighted(0.3))
            .prop_map(|(tenant, jobs, begun)| Move::Claim { tenant, jobs, begun }),
        3 => (1_i64..12).prop_map(Move::Pass),
        1 => (-12_i64..0).prop_map(Move::Pass),
        2 => prop::bool::weighted(0.3).prop_map(|dead| Move::Reap { dead }),
        1 => Just(Move::Deadlines),
        1 => Just(Move::Expire),
        2 => at().prop_map(Move::Renew),
        2 => at().prop_map(Move::AddSlice),
        4 => (at(), 0..4_u8).prop_map(|(at, how)| Move::Finish(at, how)),
        2 => at().prop_map(Move::FinishGroup),
        1 => at().prop_map(Move::Release),
        2 => at().prop_map(Move::Cancel),
        2 => at().prop_map(Move::Delete),
        2 => Just(Move::Save),
        2 => Just(Move::GoBack),
    ]
}

impl Pair {
    async fn make(&mut self, step: Move) {
        let claims: Vec<Claim> = self.groups.iter().flatten().cloned().collect();
        match step {
            Move::Enqueue {
                tenant,
                rank,
                within,
                key,
            } => {
                self.enqueue(TENANTS[tenant], rank, within, key).await;
            }
            Move::BeginBatch { tenant, count } => self.begin_batch(TENANTS[tenant], count).await,
            Move::Claim {
                tenant,
                jobs,
                begun,
            } => self.claim(TENANTS[tenant], jobs, begun).await,
            Move::Pass(time) => self.now += time,
            Move::Reap { dead } => self.reap(dead).await,
            Move::Deadlines => self.pass_deadlines().await,
            Move::Expire => self.expire().await,
            Move::Save => self.save().await,
            Move::GoBack => self.go_back().await,
            Move::FillBatch(at) if !self.batches.is_empty() => {
                self.fill_batch(*at.get(&self.batches)).await;
            }
            Move::CompleteBatch(at) if !self.batches.is_empty() => {
                self.complete_batch(*at.get(&self.batches)).await;
            }
            Move::DropBatch(at) if !self.batches.is_empty() => {
                self.drop_batch(*at.get(&self.batches)).await;
            }
            Move::CancelBatch(at) if !self.batches.is_empty() => {
                self.cancel_batch(*at.get(&self.batches)).await;
            }
            Move::DeleteBatch(at) if !self.batches.is_empty() => {
                self.delete_batch(*at.get(&self.batches)).await;
            }
            Move::Cancel(at) if !self.ids.is_empty() => self.cancel(*at.get(&self.ids)).await,
            Move::Delete(at) if !self.ids.is_empty() => self.delete(*at.get(&self.ids)).await,
            Move::FinishGroup(at) if !self.groups.is_empty() => {
                let group = at.get(&self.groups).clone();
                self.finish_group(&group).await;
            }
            _ if claims.is_empty() => {}
            Move::Renew(at) => self.renew(at.get(&claims)).await,
            Move::AddSlice(at) => self.add_slice(at.get(&claims)).await,
            Move::Finish(at, how) => self.finish(at.get(&claims), how).await,
            Move::Release(at) => self.release(at.get(&claims)).await,
            _ => {}
        }
    }

    /// Asserts that the store agrees with the model in every job, batch and stored result.
    async fn compare(&self) {
        for tenant in TENANTS {
            let page = self
                .store
                .list(tenant, &Filter::default(), None, 1000)
                .await;
            let jobs = page.unwrap().entries.into_iter().rev();
            let seen: Vec<_> = jobs
                .map(|job| {
                    let failed = job.failure.is_some();
                    assert!(job.state != State::Queued || job.started_at.is_none());
                    (
                        job.id,
                        job.state,
                        job.attempt,
                        job.cached,
                        job.ended_at,
                        failed,
                    )
                })
                .collect();
            let rows = self
                .model
                .rows
                .iter()
                .filter(|(_, row)| row.tenant == tenant);
            let known = rows.map(|(id, row)| {
                let ended_at = row.state.ended().then_some(row.ended_at);
                let failed = row.state == State::Failed;
                (*id, row.state, row.attempt, row.cached, ended_at, failed)
            });
            assert_eq!(seen, known.collect::<Vec<_>>());
        }
        let outbox = self.store.released_blobs(&[], 1000).await.unwrap();
        let left: BTreeSet<_> = self
            .given
            .difference(&self.model.referenced())
            .cloned()
            .collect();
        assert_eq!(
            BTreeSet::from_iter(outbox),
            left,
            "results that nothing refers to"
        );
        for (id, row) in self.model.rows.iter().filter(|(_, row)| row.begun) {
            assert_eq!(
                self.store.slices(*id).await.unwrap().len(),
                row.slices.len()
            );
        }
        for (id, batch) in &self.model.batches {
            let found = self
                .store
                .batch(batch.tenant, Kind::Cases, *id)
                .await
                .unwrap();
            let jobs = found.map(|found| found.states.values().sum::<u64>());
            let left = self
                .of_batch(*id, |_| true)
                .map(|(_, ids)| ids.len() as u64);
            assert_eq!(jobs, left.filter(|_| batch.complete));
        }
        for id in self.ids.iter().chain(&self.batches) {
            let mut expired = false;
            for tenant in TENANTS {
                expired |= self.store.has_expired(tenant, *id).await.unwrap();
            }
            assert_eq!(expired, self.model.expired.contains(id));
        }
    }
}

/// Calls for batches.
impl Pair {
    async fn begin_batch(&mut self, tenant: &'static str, count: u32) {
        let new = NewBatch {
            created_at: self.now,
            ..new_batch(tenant, count)
        };
        let bounds = QueueBounds {
            all: BOUNDS.0,
            tenant: BOUNDS.1,
            stored: None,
        };
        let begun = self.store.begin_batch(&new, &|_| false, bounds).await;
        match self.model.admit(tenant, u64::from(count)) {
            Err(refusal) => assert_eq!(begun.unwrap(), BatchBegun::Refused(refusal)),
            Ok(()) => {
                assert_eq!(begun.unwrap(), BatchBegun::Created);
                let row = BatchRow {
                    tenant,
                    count,
                    filled: 0,
                    complete: false,
                };
                self.model.batches.insert(new.id, row);
                self.batches.push(new.id);
            }
        }
    }

    async fn fill_batch(&mut self, id: Uuid) {
        let Some(batch) = self.model.batches.get(&id).cloned() else {
            return;
        };
        if batch.complete || batch.filled == batch.count {
            return;
        }
        let new = self.new_job(batch.tenant, 1);
        let mut row = Row::new(batch.tenant, 1);
        row.batch = Some(id);
        self.model.rows.insert(new.id, row);
        self.ids.push(new.id);
        self.model.batches.get_mut(&id).unwrap().filled += 1;
        let ended = self.store.fill_batch(id, &[(batch.filled, new)]).await;
        assert!(ended.unwrap().is_empty());
    }

    async fn complete_batch(&mut self, id: Uuid) {
        if let Some(batch) = self.model.batches.get_mut(&id)
            && batch.filled == batch.count
        {
            batch.complete = true;
            self.store.complete_batch(id).await.unwrap();
        }
    }

    async fn drop_batch(&mut self, id: Uuid) {
        let Some(batch) = self.model.batches.get(&id).cloned() else {
            return;
        };
        if batch.complete {
            return;
        }
        while !self.store.drop_batch(id, 2).await.unwrap() {}
        self.model.rows.retain(|_, row| row.batch != Some(id));
        self.model.batches.remove(&id);
    }

    /// Returns the tenant of a batch and the ids of its jobs that satisfy `is`, in order.
    fn of_batch(&self, id: Uuid, is: impl Fn(&Row) -> bool) -> Option<(&'static str, Vec<Uuid>)> {
        let batch = self.model.batches.get(&id)?;
        let rows = self.model.rows.iter();
        let ids = rows.filter(|(_, row)| row.batch == Some(id) && is(row));
        Some((batch.tenant, ids.map(|(id, _)| *id).collect()))
    }

    async fn cancel_batch(&mut self, id: Uuid) {
        let open = |row: &Row| !row.state.ended() && !row.cancel_requested;
        let Some((tenant, ids)) = self.of_batch(id, open) else {
            return;
        };
        let nobody = self.store.cancel_batch("nobody", id, 9, self.now).await;
        assert_eq!(nobody.unwrap(), []);
        let changed = self.store.cancel_batch(tenant, id, 9, self.now).await;
        let changed: BTreeMap<_, _> = changed.unwrap().into_iter().collect();
        assert!(changed.keys().eq(ids.iter()));
        for (id, state) in changed {
            let row = self.model.rows.get_mut(&id).unwrap();
            row.cancelled(self.now);
            assert_eq!(row.state, state);
        }
    }

    async fn delete_batch(&mut self, id: Uuid) {
        let Some((tenant, ended)) = self.of_batch(id, |row| row.state.ended()) else {
            return;
        };
        assert!(self.store.delete_batch("nobody", id, 2).await.unwrap());
        let last = self.store.delete_batch(tenant, id, 2).await.unwrap();
        assert_eq!(last, ended.len() < 2);
        for id in ended.iter().take(2) {
            self.model.rows.remove(id);
        }
        let (_, left) = self.of_batch(id, |_| true).unwrap();
        if last && left.is_empty() && self.model.batches[&id].complete {
            self.model.batches.remove(&id);
        }
    }
}

fn agrees(kind: StoreKind, steps: Vec<Move>) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .unwrap();
    runtime.block_on(async {
        let table = Table::new(kind).await;
        let mut pair = Pair {
            store: table.store.clone(),
            table,
            saved: None,
            model: Model::default(),
            ids: Vec::new(),
            batches: Vec::new(),
            groups: Vec::new(),
            given: BTreeSet::new(),
            // The time is later than that of the ids to be created.
            now: i64::try_from(Uuid::now_v7().as_u128() >> 80).unwrap() + 100_000,
        };
        for step in steps {
            pair.make(step).await;
            pair.compare().await;
        }
        pair.store.close().await;
    });
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_embedded_store_agrees_with_its_model(steps in prop::collection::vec(moves(), 1..80)) {
        agrees(StoreKind::Sqlite, steps);
    }
}

#[cfg(feature = "cluster")]
proptest! {
    // The statements are those of the embedded store, and each case takes a tenth of a second on a server.
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn the_shared_store_agrees_with_its_model(steps in prop::collection::vec(moves(), 1..80)) {
        if crate::cluster::postgres::server().is_some() {
            agrees(StoreKind::Postgres, steps);
        }
    }
}
