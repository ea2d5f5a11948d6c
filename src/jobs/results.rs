//! What is kept of a job besides its row: the case, the solution, the fields.

use bytes::Bytes;
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};
use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::handle::Jobs;
use crate::model::Job;
use crate::store::{ResultRef, StoredResult};
use crate::sync::blocking;
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchFields, Solution};

/// Solutions from this size on are read off the threads that answer requests.
const LARGE_BYTES: usize = 64 << 10;

/// The answer of a succeeded job, read from where it is stored while it is taken.
pub struct ResultStream {
    /// What was computed, as JSON text without the closing brace.
    pub open_solution: BoxStream<'static, Result<Bytes>>,
    /// Size of the whole text.
    pub bytes: usize,
    /// How much of it is in memory already.
    pub held_bytes: usize,
    /// It was computed for an identical case before.
    pub cached: bool,
    /// What the case asked for.
    pub outputs: Vec<Output>,
}

impl ResultStream {
    /// The whole text.
    ///
    /// # Errors
    /// It cannot be read.
    pub async fn text(mut self) -> Result<Bytes> {
        let mut text = Vec::with_capacity(self.bytes);
        while let Some(piece) = self.open_solution.try_next().await? {
            text.extend_from_slice(&piece);
        }
        text.push(b'}');
        Ok(text.into())
    }
}

impl Jobs {
    /// The case of a job as submitted, as JSON text.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn case(&self, id: Uuid) -> Result<Bytes> {
        self.get(id).await?;
        let case = self.shared.store.case(&self.tenant, id).await?;
        // It was there a moment ago.
        let case = case.ok_or(JobsError::Expired)?;
        if case.template.is_none() {
            return Ok(case.body);
        }
        let filled = blocking(move || case.value()).await??;
        Ok(Bytes::from(filled.to_string()))
    }

    /// The answer of a succeeded job, without fields.
    ///
    /// # Errors
    /// [`JobsError::NotReady`], [`JobsError::NotSucceeded`], [`JobsError::NotFound`], or a failed store.
    pub async fn solution(&self, id: Uuid) -> Result<Solution> {
        let text = self.open_answer(id).await?.text().await?;
        let damaged = |error| JobsError::Damaged(format!("solution of job {id}: {error}"));
        let large = text.len() >= LARGE_BYTES;
        let read = move || serde_json::from_slice(&text);
        let solution = match large {
            false => read(),
            true => blocking(read).await?,
        };
        solution.map_err(|error: serde_json::Error| damaged(error))
    }

    /// The answer of a succeeded job, read piece by piece: a client that does not take it holds no memory for it.
    ///
    /// # Errors
    /// As [`Jobs::solution`].
    pub async fn open_answer(&self, id: Uuid) -> Result<ResultStream> {
        let (job, stored) = self.stored(id).await?;
        let outputs = serde_json::from_str(&stored.outputs)
            .map_err(|error| JobsError::Damaged(format!("outputs of job {id}: {error}")))?;
        let (bytes, held_bytes, open_solution) = match &stored.result {
            StoredResult::Blob(key, _) => {
                let opened = self.shared.blobs.open_solution(key).await;
                let (bytes, pieces) = self.unless_gone(id, opened).await?;
                (bytes, 0, pieces)
            }
            StoredResult::Inline(result) => {
                let text = &result.solution;
                if !text.ends_with(b"}") {
                    return Err(JobsError::Damaged(format!(
                        "the solution of job {id} is no object"
                    )));
                }
                let open = text.slice(..text.len() - 1);
                (text.len(), text.len(), stream::iter([Ok(open)]).boxed())
            }
        };
        Ok(ResultStream {
            open_solution,
            bytes,
            held_bytes,
            cached: job.cached,
            outputs,
        })
    }

    /// The cells of one patch with the values of every motion; reads no other patch.
    ///
    /// # Errors
    /// [`JobsError::NoSuchPatch`], else as [`Jobs::solution`].
    pub async fn patch_fields(&self, id: Uuid, patch: usize) -> Result<PatchFields> {
        self.fields_of(id, patch, None).await
    }

    /// The cells of one patch with the values of one motion, the only entry of `points`; reads nothing else.
    ///
    /// # Errors
    /// [`JobsError::NoSuchPatch`], [`JobsError::NoSuchPoint`], else as [`Jobs::solution`].
    pub async fn point_fields(&self, id: Uuid, patch: usize, point: usize) -> Result<PatchFields> {
        self.fields_of(id, patch, Some(point)).await
    }

    async fn fields_of(&self, id: Uuid, patch: usize, point: Option<usize>) -> Result<PatchFields> {
        let (_, stored) = self.stored(id).await?;
        if patch >= stored.field_patches {
            return Err(JobsError::NoSuchPatch(stored.field_patches));
        }
        match &stored.result {
            StoredResult::Blob(key, _) => {
                let fields = self.shared.blobs.patch_fields(key, patch, point).await;
                self.unless_gone(id, fields).await
            }
            StoredResult::Inline(result) => result.patch_fields(patch, point),
        }
    }

    /// Returns a result that was read from storage. If it could not be read because its job was deleted in the meantime, the error says so.
    async fn unless_gone<T>(&self, id: Uuid, read: Result<T>) -> Result<T> {
        match read {
            Err(error) => Err(self.gone_meanwhile(id, error).await),
            read => read,
        }
    }

    /// Why the result of a job that was just there cannot be read: it went in between, or `error`.
    pub(crate) async fn gone_meanwhile(&self, id: Uuid, error: JobsError) -> JobsError {
        if !matches!(
            error,
            JobsError::Blobs(object_store::Error::NotFound { .. })
        ) {
            return error;
        }
        match self.get(id).await {
            Ok(_) => error,
            Err(JobsError::NotFound(_) | JobsError::Expired) => JobsError::Expired,
            Err(failed) => failed,
        }
    }

    /// Where the result of a job lies.
    async fn stored(&self, id: Uuid) -> Result<(Job, ResultRef)> {
        let found = self.shared.store.result(&self.tenant, id).await?;
        let Some((job, stored)) = found else {
            return Err(self.missing(id).await);
        };
        if !self.sees(&job.labels) || job.kind != self.kind {
            return Err(JobsError::NotFound(self.kind));
        }
        let job = self.unexpired(job)?;
        match stored {
            Some(stored) => Ok((job, stored)),
            None if job.state.ended() => Err(JobsError::NotSucceeded(Box::new(job))),
            None => Err(JobsError::NotReady(job.state)),
        }
    }
}
