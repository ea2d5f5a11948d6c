//! What workers write while they hold a lease.

use super::blob_refs::drop_slices_of_ended;
use super::claim::push_lease_until;
use super::engine::{self, QueryBuilder, Row, SqlStore, query};
use super::rows::{
    count, fence, push_list, read_flag, read_id, read_kind, read_move, read_optional_id,
};
use std::collections::HashMap;

use bytes::Bytes;
use uuid::Uuid;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::job::State;
use crate::jobs::store::Leases;
use crate::jobs::store::claim::{Claim, Lease, ReleaseReason, Renewal};
use crate::jobs::store::submission::{ClaimedCase, StoredCase};
use crate::jobs::store_error::StoreError;

#[repeat_conflicts]
#[async_trait]
impl Leases for SqlStore {
    async fn claimed_cases(&self, ids: &[Uuid]) -> Result<HashMap<Uuid, ClaimedCase>, StoreError> {
        if ids.is_empty() {
            return Ok(HashMap::new());
        }
        let mut query = QueryBuilder::new(
            "SELECT id, kind, cases.row, body, batch_id, cancel_requested, CASE WHEN bypass_cache = 0 AND jobs.cache_key IS NOT NULL THEN \
             (SELECT source.id FROM jobs AS source WHERE source.cache_key = jobs.cache_key AND source.state = 'succeeded' LIMIT 1) END AS source \
             FROM cases JOIN jobs ON jobs.id = cases.job_id \
             WHERE job_id IN (",
        );
        push_list(&mut query, ids);
        query.push(")");
        let mut connection = self.readers.acquire().await?;
        let rows = query.build().fetch_all(&mut *connection).await?;
        drop(connection);
        let mut templates: HashMap<String, (Bytes, Option<Bytes>)> = HashMap::new();
        let mut cases = HashMap::with_capacity(rows.len());
        for row in &rows {
            let (mut template, mut head) = (None, None);
            if read_flag(row, "row")? {
                let batch: String = row.try_get("batch_id")?;
                if !templates.contains_key(&batch)
                    && let Some(read) = self.template(&batch).await?
                {
                    templates.insert(batch.clone(), read);
                }
                let Some((of_batch, of_run)) = templates.get(&batch) else {
                    continue;
                };
                template = Some(of_batch.clone());
                head.clone_from(of_run);
            }
            let body: Vec<u8> = row.try_get("body")?;
            let case = StoredCase {
                kind: read_kind(row)?,
                template,
                head,
                body: body.into(),
            };
            let claimed = ClaimedCase {
                case,
                cancel_requested: read_flag(row, "cancel_requested")?,
                source: read_optional_id(row, "source")?,
            };
            cases.insert(read_id(row)?, claimed);
        }
        Ok(cases)
    }

    async fn renew(
        &self,
        claims: &[(&Claim, f64)],
        lease: Lease,
    ) -> Result<Vec<Renewal>, StoreError> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = QueryBuilder::new("WITH held (id, lease_token, now_at) AS (");
        query.push_values(claims, |mut row, (claim, progress)| {
            row.push_bind(claim.id.to_string())
                .push_bind(fence(claim))
                .push_bind(*progress);
        });
        query.push(") UPDATE jobs SET lease_until = ");
        push_lease_until(&mut query, self, lease);
        query.push(concat!(
            ", progress = ",
            greatest!(),
            "(held.now_at, done), \
         version = CASE WHEN progress = ",
            greatest!(),
            "(held.now_at, done) THEN version ELSE version + 1 END"
        ));
        query.push(OF_HELD).push("jobs.id AS id, cancel_requested");
        let rows = query.build().fetch_all(&self.writer).await?;
        let mut held = HashMap::with_capacity(rows.len());
        for row in &rows {
            held.insert(read_id(row)?, read_flag(row, "cancel_requested")?);
        }
        let answers = claims.iter().map(|(claim, _)| match held.get(&claim.id) {
            Some(cancel_requested) => Renewal::Held {
                cancel_requested: *cancel_requested,
            },
            None => Renewal::Lost,
        });
        Ok(answers.collect())
    }

    async fn release(
        &self,
        claims: &[Claim],
        why: ReleaseReason,
        now: i64,
    ) -> Result<Vec<(Uuid, State)>, StoreError> {
        if claims.is_empty() {
            return Ok(Vec::new());
        }
        let mut query = with_held(claims);
        query.push(
            " UPDATE jobs SET state = CASE WHEN cancel_requested = 1 THEN 'cancelled' ELSE 'queued' END, \
             started_at = CASE WHEN cancel_requested = 1 THEN started_at ELSE NULL END, \
             attempt = attempt - 1, progress = done, lease_until = NULL, worker = NULL, \
             version = version + 1",
        );
        match why {
            ReleaseReason::NotBegun => {}
            ReleaseReason::SolveItself => drop(query.push(", bypass_cache = 1")),
            ReleaseReason::Long { slice_us } => {
                let slice_us = count(slice_us);
                query
                    .push(concat!(", slice_us = ", greatest!(), "(slice_us, "))
                    .push_bind(slice_us);
                query
                    .push(concat!("), cost_us = ", greatest!(), "(cost_us, "))
                    .push_bind(slice_us);
                query.push(")");
            }
        }
        query.push(", updated_at = ").push_bind(now);
        query.push(", ended_at = CASE WHEN cancel_requested = 1 THEN ");
        query.push_bind(now);
        query
            .push(" ELSE NULL END")
            .push(OF_HELD)
            .push("jobs.id AS id, state, slices");
        let mut transaction = engine::begin(&self.writer).await?;
        let rows = query.build().fetch_all(&mut *transaction).await?;
        drop_slices_of_ended(&mut transaction, &rows).await?;
        transaction.commit().await?;
        self.requeued();
        rows.iter()
            .map(|row| read_move(row, State::Running))
            .collect()
    }
}

impl SqlStore {
    /// The template of a batch, and the head of a run.
    async fn template(&self, batch: &str) -> Result<Option<(Bytes, Option<Bytes>)>, StoreError> {
        let row = query(
            "SELECT body, head FROM batches JOIN templates ON templates.tenant = batches.tenant AND templates.digest = batches.template \
             WHERE batches.id = $1",
        )
        .bind(batch)
        .fetch_optional(&self.readers)
        .await?;
        // It goes with the last job of its batch.
        let Some(row) = row else { return Ok(None) };
        let (body, head): (Vec<u8>, Option<Vec<u8>>) = (row.try_get("body")?, row.try_get("head")?);
        Ok(Some((body.into(), head.map(Bytes::from))))
    }
}

/// The end of an update of claimed jobs, as long as their leases are held.
const OF_HELD: &str = concat!(
    " FROM held WHERE jobs.id = held.id AND jobs.lease_token = held.lease_token AND ",
    unordered!("jobs.state"),
    " = 'running' RETURNING "
);

fn with_held(claims: &[Claim]) -> QueryBuilder {
    let mut query = QueryBuilder::new("WITH held (id, lease_token) AS (");
    query.push_values(claims, |mut row, claim| {
        row.push_bind(claim.id.to_string()).push_bind(fence(claim));
    });
    query.push(")");
    query
}
