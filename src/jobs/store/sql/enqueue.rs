//! Submission of single jobs, and what their idempotency keys stand for.

use super::engine::SqlStore;
use super::group_commit::{Submission, by_key};
use tokio::sync::oneshot;

use crate::jobs::store::submission::{Enqueued, NewJob, QueueBounds};
use crate::jobs::store_error::StoreError;

impl SqlStore {
    /// Queues a job if the bounds leave it a place, or finds the one its idempotency key already stands for. Durable once it returns. Whoever stops
    /// waiting for it does not stop it.
    ///
    /// # Errors
    /// The database failed; nothing was stored.
    pub(crate) async fn enqueue(
        &self,
        new: &NewJob,
        bounds: QueueBounds,
    ) -> Result<Enqueued, StoreError> {
        let gone = || StoreError::from(sqlx::Error::WorkerCrashed);
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

    /// Frees an idempotency key, whatever job it stands for.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub(crate) async fn forget_key(&self, tenant: &str, key: &str) -> Result<(), StoreError> {
        sqlx::query("DELETE FROM idempotency_keys WHERE of_tenant = $1 AND key = $2")
            .bind(tenant)
            .bind(key)
            .execute(&self.writer)
            .await?;
        Ok(())
    }

    /// What an idempotency key of a tenant stands for, if it was used.
    ///
    /// # Errors
    /// The database failed.
    pub(crate) async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>, StoreError> {
        let mut connection = self.readers.acquire().await?;
        by_key(&mut connection, tenant, key, digest).await
    }
}
