//! Submission of single jobs, and what their idempotency keys stand for.

use super::engine::{self, SqlStore, query};
use super::group_commit::{Submission, by_key};
use std::sync::Arc;
use tokio::sync::oneshot;

use async_trait::async_trait;

use crate::jobs::store::SubmitJobs;
use crate::jobs::store::submission::{Enqueued, NewJob, QueueBounds};
use crate::jobs::store_error::StoreError;

#[async_trait]
impl SubmitJobs for SqlStore {
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
        engine::again(|| async move {
            query("DELETE FROM idempotency_keys WHERE of_tenant = $1 AND key = $2")
                .bind(tenant)
                .bind(key)
                .execute(&self.writer)
                .await?;
            Ok(())
        })
        .await
    }

    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, StoreError> {
        engine::again(|| async move {
            let mut connection = self.readers.acquire().await?;
            by_key(&mut connection, tenant, key, digest).await
        })
        .await
    }
}
