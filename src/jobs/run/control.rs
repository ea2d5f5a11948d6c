//! Runs as a whole: read, listed, followed, cancelled, deleted.

use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::batch::Batch;
use crate::jobs::model::lane::rows_lane;
use crate::jobs::run::head::RunHead;
use crate::jobs::run::model::Run;
use crate::jobs::store::list::{BatchFilter, Page};

impl Jobs {
    /// The lane of the tenant in which the chunks of its runs are jobs.
    #[must_use]
    pub(crate) fn in_rows_lane(&self) -> Jobs {
        Jobs {
            tenant: rows_lane(&self.tenant),
            ..self.clone()
        }
    }

    /// A run.
    ///
    /// # Errors
    /// [`JobsError::RunNotFound`], [`JobsError::Expired`], or a failed database.
    pub async fn run(&self, id: Uuid) -> Result<Run, JobsError> {
        let batch = self.in_rows_lane().batch(id).await.map_err(of_run)?;
        self.with_head(batch).await
    }

    /// The run of a batch in the lane of rows.
    ///
    /// # Errors
    /// As [`Jobs::run`].
    pub(crate) async fn with_head(&self, batch: Batch) -> Result<Run, JobsError> {
        let (_, there) = batch.ended();
        if there < u64::from(batch.count) {
            // Its first chunks have expired, or it is being deleted.
            return Err(JobsError::Expired);
        }
        let lane = rows_lane(&self.tenant);
        let record = self.shared.store.run(&lane, batch.id).await?;
        let record = record.ok_or(JobsError::RunNotFound)?;
        Ok(Run::new(
            batch,
            RunHead::read(&record.template, record.head.as_deref())?,
            &record,
        ))
    }

    /// One page of the runs, newest first.
    ///
    /// # Errors
    /// [`JobsError::BadCursor`], or a failed database.
    pub async fn runs(
        &self,
        filter: &BatchFilter,
        cursor: Option<&str>,
        limit: u32,
    ) -> Result<Page<Run>, JobsError> {
        let page = self.in_rows_lane().batches(filter, cursor, limit).await?;
        let mut runs = Vec::with_capacity(page.entries.len());
        for batch in page.entries {
            match self.with_head(batch).await {
                Ok(run) => runs.push(run),
                // Deleted meanwhile, or on its way out.
                Err(JobsError::RunNotFound | JobsError::Expired) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(Page {
            entries: runs,
            next_cursor: page.next_cursor,
            total: page.total,
        })
    }

    /// Waits until a run differs from what was seen of it; the run, or nothing when the service is about to stop.
    ///
    /// # Errors
    /// As [`Jobs::run`].
    pub async fn run_changed_since(
        &self,
        id: Uuid,
        seen: Option<&str>,
    ) -> Result<Option<Run>, JobsError> {
        let changed = self.in_rows_lane().batch_changed_since(id, seen).await;
        match changed.map_err(of_run)? {
            Some(batch) => self.with_head(batch).await.map(Some),
            None => Ok(None),
        }
    }

    /// Stops a run: chunks that wait end at once, those that are solved at the next tick of their solvers. Rows of ended chunks keep their answers.
    ///
    /// # Errors
    /// As [`Jobs::run`].
    pub async fn cancel_run(&self, id: Uuid) -> Result<Run, JobsError> {
        let batch = self.in_rows_lane().cancel_batch(id).await.map_err(of_run)?;
        self.with_head(batch).await
    }

    /// Removes an ended run with its rows and answers.
    ///
    /// # Errors
    /// [`JobsError::RunNotEnded`], else as [`Jobs::run`].
    pub async fn delete_run(&self, id: Uuid) -> Result<(), JobsError> {
        self.in_rows_lane().delete_batch(id).await.map_err(of_run)
    }
}

/// What an error of a batch means for the run that it stands for.
pub(crate) fn of_run(error: JobsError) -> JobsError {
    match error {
        JobsError::BatchNotFound => JobsError::RunNotFound,
        JobsError::BatchNotEnded(_) => JobsError::RunNotEnded,
        other => other,
    }
}
