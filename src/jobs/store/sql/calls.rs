//! The calls of a store, each passed on to the file of its subject.

use super::engine::{self, SqlStore};
use std::collections::{HashMap, HashSet};

use async_trait::async_trait;
use uuid::Uuid;

use crate::jobs::model::batch::{Batch, BatchItem, RunRecord};
use crate::jobs::model::job::{Failure, Job, State};
use crate::jobs::model::key::Key;
use crate::jobs::model::kind::{Kind, Queue};
use crate::jobs::store::claim::{
    Claim, ClaimRequest, Lease, QueueAhead, Reap, ReleaseReason, Renewal,
};
use crate::jobs::store::cluster::Cluster;
use crate::jobs::store::ending::{Ending, NewSlice, ResultRef, SliceRecord, StoredResult};
use crate::jobs::store::list::{BatchFilter, Change, Filter, Page};
use crate::jobs::store::profile::{ProfileKept, StoredProfile};
use crate::jobs::store::retention::{Deleted, Moment, Overdue, RetentionRule, Stats, Usage};
use crate::jobs::store::submission::{
    BatchBegun, CacheKey, ClaimedCase, Enqueued, FilledHere, NewBatch, NewJob, QueueBounds,
    Refusal, StoredCase,
};
use crate::jobs::store::{KeyStore, Orphans, Store};
use crate::jobs::store_error::StoreError;

#[async_trait]
impl Store for SqlStore {
    async fn ready(&self, write: bool) -> Result<(), StoreError> {
        engine::again(|| self.ready(write)).await
    }

    async fn stats(&self) -> Result<Stats, StoreError> {
        engine::again(|| self.stats()).await
    }

    async fn usage(&self, tenant: &str) -> Result<Usage, StoreError> {
        engine::again(|| self.usage(tenant)).await
    }

    fn cluster(&self) -> Option<&dyn Cluster> {
        self.as_cluster()
    }

    async fn close(&self) {
        self.close().await;
    }

    async fn enqueue(&self, new: &NewJob, bounds: QueueBounds) -> Result<Enqueued, StoreError> {
        self.enqueue(new, bounds).await
    }

    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, StoreError> {
        engine::again(|| self.job_by_key(tenant, key, digest)).await
    }

    async fn forget_key(&self, tenant: &str, key: &str) -> Result<(), StoreError> {
        engine::again(|| self.forget_key(tenant, key)).await
    }

    async fn reserve(
        &self,
        batch: Uuid,
        tenant: &str,
        most: u32,
        bounds: QueueBounds,
    ) -> Result<Result<u32, Refusal>, StoreError> {
        engine::again(|| self.reserve(batch, tenant, most, bounds)).await
    }

    async fn batch_by_key(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
    ) -> Result<Option<BatchBegun>, StoreError> {
        engine::again(|| self.batch_by_key(new, filled_here)).await
    }

    async fn begin_batch(
        &self,
        new: &NewBatch,
        filled_here: FilledHere<'_>,
        bounds: QueueBounds,
    ) -> Result<BatchBegun, StoreError> {
        engine::again(|| self.begin_batch(new, filled_here, bounds)).await
    }

    async fn fill_batch(
        &self,
        batch: Uuid,
        jobs: &[(u32, NewJob)],
    ) -> Result<Vec<Uuid>, StoreError> {
        engine::again(|| self.fill_batch(batch, jobs)).await
    }

    async fn complete_batch(&self, batch: Uuid) -> Result<(), StoreError> {
        engine::again(|| self.complete_batch(batch)).await
    }

    async fn drop_batch(&self, batch: Uuid, limit: u32) -> Result<bool, StoreError> {
        engine::again(|| self.drop_batch(batch, limit)).await
    }

    async fn unfinished_batches(&self) -> Result<Vec<Uuid>, StoreError> {
        engine::again(|| self.unfinished_batches()).await
    }

    async fn job(&self, tenant: &str, id: Uuid) -> Result<Option<Job>, StoreError> {
        engine::again(|| self.job(tenant, id)).await
    }

    async fn list(
        &self,
        tenant: &str,
        filter: &Filter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Job>, StoreError> {
        engine::again(|| self.list(tenant, filter, after, limit)).await
    }

    async fn batches(
        &self,
        tenant: &str,
        filter: &BatchFilter,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Page<Batch>, StoreError> {
        engine::again(|| self.batches(tenant, filter, after, limit)).await
    }

    async fn changes(
        &self,
        tenant: &str,
        since: i64,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<Change>, StoreError> {
        engine::again(|| self.changes(tenant, since, after, limit)).await
    }

    async fn batch(&self, tenant: &str, kind: Kind, id: Uuid) -> Result<Option<Batch>, StoreError> {
        engine::again(|| self.batch(tenant, kind, id)).await
    }

    async fn run(&self, tenant: &str, id: Uuid) -> Result<Option<RunRecord>, StoreError> {
        engine::again(|| self.run(tenant, id)).await
    }

    async fn add_profile(
        &self,
        tenant: &str,
        new: &StoredProfile,
        max_bytes: u64,
    ) -> Result<ProfileKept, StoreError> {
        engine::again(|| self.add_profile(tenant, new, max_bytes)).await
    }

    async fn profile(
        &self,
        tenant: &str,
        digest: &str,
    ) -> Result<Option<StoredProfile>, StoreError> {
        engine::again(|| self.profile(tenant, digest)).await
    }

    async fn profiles(
        &self,
        tenant: &str,
        limit: u32,
    ) -> Result<Vec<(String, u64, i64)>, StoreError> {
        engine::again(|| self.profiles(tenant, limit)).await
    }

    async fn delete_profile(&self, tenant: &str, digest: &str) -> Result<bool, StoreError> {
        engine::again(|| self.delete_profile(tenant, digest)).await
    }

    async fn batch_items(
        &self,
        tenant: &str,
        id: Uuid,
        after: Option<Uuid>,
        limit: u32,
        bytes: usize,
    ) -> Result<Vec<BatchItem>, StoreError> {
        engine::again(|| self.batch_items(tenant, id, after, limit, bytes)).await
    }

    async fn batch_label_keys(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
    ) -> Result<Vec<String>, StoreError> {
        engine::again(|| self.batch_label_keys(tenant, id, limit)).await
    }

    async fn case(&self, tenant: &str, id: Uuid) -> Result<Option<StoredCase>, StoreError> {
        engine::again(|| self.case(tenant, id)).await
    }

    async fn result(
        &self,
        tenant: &str,
        id: Uuid,
    ) -> Result<Option<(Job, Option<ResultRef>)>, StoreError> {
        engine::again(|| self.result(tenant, id)).await
    }

    async fn cached(&self, keys: &[CacheKey]) -> Result<HashMap<CacheKey, Uuid>, StoreError> {
        engine::again(|| self.cached(keys)).await
    }

    async fn queued_before(&self, job: &Job, limit: u32) -> Result<QueueAhead, StoreError> {
        engine::again(|| self.queued_before(job, limit)).await
    }

    async fn has_expired(&self, tenant: &str, id: Uuid) -> Result<bool, StoreError> {
        engine::again(|| self.has_expired(tenant, id)).await
    }

    async fn cancel(&self, tenant: &str, id: Uuid, now: i64) -> Result<Option<Job>, StoreError> {
        engine::again(|| self.cancel(tenant, id, now)).await
    }

    async fn cancel_batch(
        &self,
        tenant: &str,
        id: Uuid,
        limit: u32,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, StoreError> {
        engine::again(|| self.cancel_batch(tenant, id, limit, now)).await
    }

    async fn delete(&self, tenant: &str, id: Uuid) -> Result<Deleted, StoreError> {
        engine::again(|| self.delete(tenant, id)).await
    }

    async fn delete_batch(&self, tenant: &str, id: Uuid, limit: u32) -> Result<bool, StoreError> {
        engine::again(|| self.delete_batch(tenant, id, limit)).await
    }

    async fn queues(&self) -> Result<Vec<Queue>, StoreError> {
        engine::again(|| self.queues()).await
    }

    async fn claim(&self, request: &ClaimRequest<'_>) -> Result<Vec<Claim>, StoreError> {
        engine::again(|| self.claim(request)).await
    }

    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>, StoreError> {
        engine::again(|| self.claimed_cases(ids)).await
    }

    async fn renew(
        &self,
        claims: &[(&Claim, f64)],
        lease: Lease,
    ) -> Result<Vec<Renewal>, StoreError> {
        engine::again(|| self.renew(claims, lease)).await
    }

    async fn set_solving(&self, claims: &[Claim], solving: bool) -> Result<(), StoreError> {
        engine::again(|| self.set_solving(claims, solving)).await
    }

    async fn add_slice(&self, claim: &Claim, slice: &NewSlice) -> Result<bool, StoreError> {
        engine::again(|| self.add_slice(claim, slice)).await
    }

    async fn slices(&self, id: Uuid) -> Result<Vec<SliceRecord>, StoreError> {
        engine::again(|| self.slices(id)).await
    }

    async fn slice_results(&self, id: Uuid) -> Result<Vec<StoredResult>, StoreError> {
        engine::again(|| self.slice_results(id)).await
    }

    async fn finish(
        &self,
        ends: &[(Claim, Ending)],
        now: i64,
    ) -> Result<HashSet<Uuid>, StoreError> {
        engine::again(|| self.finish(ends, now)).await
    }

    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, StoreError> {
        engine::again(|| self.release(claims, why, now)).await
    }

    async fn reap(
        &self,
        which: Reap,
        now: i64,
        attempts_max: u32,
    ) -> Result<Vec<(Uuid, State)>, StoreError> {
        engine::again(|| self.reap(which, now, attempts_max)).await
    }

    async fn pass_deadlines(
        &self,
        failure: &Failure,
        moment: Moment,
    ) -> Result<Overdue, StoreError> {
        engine::again(|| self.pass_deadlines(failure, moment)).await
    }

    async fn expire(&self, rule: RetentionRule) -> Result<u64, StoreError> {
        engine::again(|| self.expire(rule)).await
    }

    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>, StoreError> {
        engine::again(|| self.released_blobs(done, limit)).await
    }

    async fn abandon_blob(&self, key: &str) -> Result<(), StoreError> {
        engine::again(|| self.abandon_blob(key)).await
    }

    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Orphans, StoreError> {
        engine::again(|| self.orphans(results)).await
    }

    async fn compact(&self, spare: i64, step: u32) -> Result<bool, StoreError> {
        engine::again(|| self.compact(spare, step)).await
    }
}

#[async_trait]
impl KeyStore for SqlStore {
    async fn add_key(&self, key: &Key) -> Result<(), StoreError> {
        engine::again(|| self.add_key(key)).await
    }

    async fn key(&self, id: &str) -> Result<Option<Key>, StoreError> {
        engine::again(|| self.key(id)).await
    }

    async fn keys(&self) -> Result<Vec<Key>, StoreError> {
        engine::again(|| self.keys()).await
    }

    async fn revoke_key(&self, id: &str, now: i64) -> Result<Option<Key>, StoreError> {
        engine::again(|| self.revoke_key(id, now)).await
    }
}
