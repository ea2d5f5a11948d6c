//! Runs: batches of rows with what their chunks share.

use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::kind::Kind;
use crate::jobs::run::head::RunHead;
use crate::jobs::run::model::Run;

impl Jobs {
    /// A run.
    ///
    /// # Errors
    /// [`JobsError::BatchNotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn run(&self, id: Uuid) -> Result<Run, JobsError> {
        let batch = self.batch(Kind::Rows, id).await?;
        self.with_head(batch).await
    }

    /// The run that a batch of rows is.
    ///
    /// # Errors
    /// As [`Jobs::run`].
    pub async fn with_head(&self, batch: Batch) -> Result<Run, JobsError> {
        let (_, there) = batch.ended();
        if there < u64::from(batch.count) {
            // Its first chunks have expired, or it is being deleted.
            return Err(JobsError::Expired);
        }
        let record = self.shared.store.run(&self.tenant, batch.id).await?;
        let record = record.ok_or(JobsError::BatchNotFound(Kind::Rows))?;
        let head = RunHead::read(&record.template, record.head.as_deref())?;
        Ok(Run::new(batch, head, &record))
    }
}
