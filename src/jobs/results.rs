//! Reads the case, the solution and the fields of a job.

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

/// Solutions of at least this size are parsed outside the request threads.
const LARGE_BYTES: usize = 64 << 10;

/// The solution of a succeeded job, read from storage as it is consumed.
pub struct ResultStream {
    /// The JSON text without the closing brace.
    pub open_solution: BoxStream<'static, Result<Bytes>>,
    /// Size of the whole text in bytes.
    pub bytes: usize,
    /// Number of bytes that are in memory already.
    pub held_bytes: usize,
    /// Whether the result was computed for an earlier identical case.
    pub cached: bool,
    /// The requested outputs.
    pub outputs: Vec<Output>,
}

impl ResultStream {
    /// Reads the whole text.
    ///
    /// # Errors
    /// The result cannot be read.
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
    /// Reads the case of a job as submitted, as JSON text.
    ///
    /// # Errors
    /// [`JobsError::NotFound`], or a failed database.
    pub async fn case(&self, id: Uuid) -> Result<Bytes> {
        self.get(id).await?;
        let case = self.shared.store.case(&self.tenant, id).await?;
        // The job was just read, so it was removed since.
        let case = case.ok_or(JobsError::Expired)?;
        if case.template.is_none() {
            return Ok(case.body);
        }
        let filled = blocking(move || case.value()).await??;
        Ok(Bytes::from(filled.to_string()))
    }

    /// Reads the solution of a succeeded job.
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

    /// Opens the solution of a succeeded job as a stream, which holds no memory for a client that does not read.
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

    /// Reads the cells of one patch, with the values of one motion, which is then the only entry of `points`, or of all motions.
    ///
    /// # Errors
    /// [`JobsError::NoSuchPatch`], [`JobsError::NoSuchPoint`], else as [`Jobs::solution`].
    pub async fn patch_fields(
        &self,
        id: Uuid,
        patch: usize,
        point: Option<usize>,
    ) -> Result<PatchFields> {
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

    /// Replaces the error of a read by [`JobsError::Expired`] if the job was removed in the meantime.
    pub(crate) async fn unless_gone<T>(&self, id: Uuid, read: Result<T>) -> Result<T> {
        let Err(JobsError::Blobs(object_store::Error::NotFound { .. })) = &read else {
            return read;
        };
        match self.get(id).await {
            Ok(_) => read,
            Err(JobsError::NotFound(_) | JobsError::Expired) => Err(JobsError::Expired),
            Err(failed) => Err(failed),
        }
    }

    /// Reads a succeeded job with the reference to its result.
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
