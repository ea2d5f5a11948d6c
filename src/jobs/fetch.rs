//! What is kept of a job besides its row: the case, the solution, the fields.

use bytes::Bytes;
use uuid::Uuid;

use crate::contact::solution::{PatchFields, Solution};
use crate::jobs::Jobs;
use crate::jobs::error::JobsError;
use crate::jobs::results::Encoded;
use crate::jobs::store::StoredResult;

impl Jobs {
    /// The case of a job as submitted, as JSON text.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn case(&self, id: Uuid) -> Result<Bytes, JobsError> {
        self.get(id).await?;
        let (body, _) = self
            .shared
            .store
            .case(id)
            .await?
            .ok_or(JobsError::NotFound)?;
        Ok(body)
    }

    /// The answer of a succeeded job, without fields.
    ///
    /// # Errors
    /// [`JobsError::NotReady`], [`JobsError::NotSucceeded`], [`JobsError::NotFound`], or a failed store.
    pub async fn solution(&self, id: Uuid) -> Result<Solution, JobsError> {
        let stored = self.stored(id).await?;
        let text = match &stored.folder {
            Some(folder) => self.shared.results.solution(folder).await?,
            None => self.small(&stored).await?.solution,
        };
        serde_json::from_slice(&text)
            .map_err(|error| JobsError::Damaged(format!("solution of job {id}: {error}")))
    }

    /// The cells of one patch with the values of every motion; reads no other patch.
    ///
    /// # Errors
    /// [`JobsError::NoSuchPatch`], else as [`Jobs::solution`].
    pub async fn patch_fields(&self, id: Uuid, patch: usize) -> Result<PatchFields, JobsError> {
        self.fields_of(id, patch, None).await
    }

    /// The cells of one patch with the values of one motion, the only entry of `points`; reads nothing else.
    ///
    /// # Errors
    /// [`JobsError::NoSuchPatch`], [`JobsError::NoSuchPoint`], else as [`Jobs::solution`].
    pub async fn point_fields(
        &self,
        id: Uuid,
        patch: usize,
        point: usize,
    ) -> Result<PatchFields, JobsError> {
        self.fields_of(id, patch, Some(point)).await
    }

    async fn fields_of(
        &self,
        id: Uuid,
        patch: usize,
        point: Option<usize>,
    ) -> Result<PatchFields, JobsError> {
        let stored = self.stored(id).await?;
        if patch >= stored.field_patches {
            return Err(JobsError::NoSuchPatch {
                patches: stored.field_patches,
            });
        }
        match &stored.folder {
            Some(folder) => self.shared.results.patch_fields(folder, patch, point).await,
            None => self.small(&stored).await?.patch_fields(patch, point),
        }
    }

    /// A result that lies in the database.
    async fn small(&self, stored: &StoredResult) -> Result<Encoded, JobsError> {
        let result = self.shared.store.small_result(stored.job).await?;
        result.ok_or(JobsError::NotFound)
    }

    /// Where the result of a job lies.
    async fn stored(&self, id: Uuid) -> Result<StoredResult, JobsError> {
        let found = self.shared.store.result(id).await?;
        let Some((job, stored)) = found.filter(|(job, _)| *job.tenant == *self.tenant) else {
            return Err(self.missing(id, JobsError::NotFound).await);
        };
        let job = self.unexpired(job)?;
        match stored {
            Some(stored) => Ok(stored),
            None if job.state.ended() => Err(JobsError::NotSucceeded(Box::new(job))),
            None => Err(JobsError::NotReady(job.state)),
        }
    }
}
