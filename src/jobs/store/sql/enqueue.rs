//! Submission of single jobs, and what their idempotency keys stand for.

use super::engine::{self, SqlStore, query};
use super::group_commit::{Submission, by_key};
use std::sync::Arc;
use tokio::sync::oneshot;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::store::SubmitJobs;
use crate::jobs::store::submission::{Enqueued, NewJob, QueueBounds};
use crate::jobs::store_error::StoreError;

#[repeat_conflicts]
#[async_trait]
impl SubmitJobs for SqlStore {
    #[once]
    async fn enqueue(&self, new: &NewJob, bounds: QueueBounds) -> Result<Enqueued, StoreError> {
        let gone = || {
            StoreError::Failed(Arc::new(std::io::Error::other(
                "the task that stores jobs has ended",
            )))
        };
        let (reply, answer) = oneshot::channel();
        let waiting = Submission {
            new: new.clone(),
            bounds,
            reply,
        };
        self.group_commit
            .0
            .send(waiting)
            .await
            .map_err(|_| gone())?;
        answer.await.map_err(|_| gone())?
    }

    async fn forget_key(&self, tenant: &str, key: &str) -> Result<(), StoreError> {
        query("DELETE FROM idempotency_keys WHERE of_tenant = $1 AND key = $2")
            .bind(tenant)
            .bind(key)
            .execute(&self.writer)
            .await?;
        Ok(())
    }

    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        by_key(&mut connection, tenant, key, digest).await
    }
}
