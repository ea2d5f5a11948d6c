//! What requests for a part of a result begin with: whose job it is, and whether the client has the part already.

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, Uri};
use axum::response::Response;
use uuid::Uuid;

use crate::http::extract::caller::Caller;
use crate::http::extract::ids::JobId;
use crate::http::layers::etag::{Precondition, tagged};
use crate::http::limits::memory::Rendering;
use crate::http::problem::error::ApiError;
use crate::http::render::format::Format;
use crate::http::state::AppState;
use crate::jobs::Jobs;

/// A request for a part of the result of a job.
pub(crate) struct PartRequest {
    /// The jobs of the client.
    pub jobs: Jobs,
    /// The job in the path.
    pub id: Uuid,
    /// What every handler can reach.
    pub shared: AppState,
    /// The address that was asked.
    pub uri: Uri,
    /// The head of the request.
    pub headers: HeaderMap,
}

impl FromRequestParts<AppState> for PartRequest {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, shared: &AppState) -> Result<Self, ApiError> {
        let Caller(jobs) = Caller::from_request_parts(parts, shared).await?;
        let JobId(id) = JobId::from_request_parts(parts, shared).await?;
        Ok(PartRequest {
            jobs,
            id,
            shared: shared.clone(),
            uri: parts.uri.clone(),
            headers: parts.headers.clone(),
        })
    }
}

impl PartRequest {
    /// The answer with its tag; nothing is loaded or computed for it if the client has it already.
    ///
    /// # Errors
    /// There is no such job, or those of `answer`.
    pub(crate) async fn unless_known(
        &self,
        format: Format,
        answer: impl Future<Output = Result<Response, ApiError>> + Send,
    ) -> Result<Response, ApiError> {
        match Precondition::of(&self.jobs, self.id, &self.uri, &self.headers, format).await? {
            Precondition::NotModified(unchanged) => Ok(unchanged),
            Precondition::Proceed(tag) => Ok(tagged(&tag, answer.await?)),
        }
    }

    /// A turn and memory for an answer of so many bytes.
    ///
    /// # Errors
    /// As [`Memory::rendering`](crate::http::limits::memory::Memory::rendering).
    pub(crate) async fn rendering(&self, bytes: usize) -> Result<Rendering, ApiError> {
        self.shared
            .memory
            .rendering(self.jobs.tenant(), bytes)
            .await
    }
}
