//! How many requests, streams and waits may be in progress: in total, and for one tenant.

use crate::http::limits::tenant_semaphore::{Permit, TenantSemaphore};
use crate::http::options::HttpOptions;
use crate::http::problem::error::ApiError;
use crate::http::problem::kinds::ProblemKind;

/// Requests, streams and waits in progress; clones share them.
#[derive(Debug, Clone)]
pub struct ConcurrencyLimits {
    requests: TenantSemaphore,
    streams: TenantSemaphore,
    waits: TenantSemaphore,
}

impl ConcurrencyLimits {
    /// The limits of these options.
    #[must_use]
    pub fn new(options: &HttpOptions) -> ConcurrencyLimits {
        ConcurrencyLimits {
            requests: TenantSemaphore::new(options.connections_max, options.tenant_requests_max),
            streams: TenantSemaphore::new(options.streams_max, options.tenant_streams_max),
            waits: TenantSemaphore::new(options.waits_max, options.tenant_waits_max),
        }
    }

    /// Counts one more request of a tenant.
    ///
    /// # Errors
    /// `too-many-requests`: there are as many as there may be.
    pub fn request(&self, tenant: &str) -> Result<Permit, ApiError> {
        self.requests.try_take(tenant, 1).ok_or_else(|| {
            too_many(
                "the tenant has as many requests under way as it may (`--tenant-requests-max`)",
            )
        })
    }

    /// Counts one more stream of events of a tenant.
    ///
    /// # Errors
    /// As [`ConcurrencyLimits::request`].
    pub fn stream(&self, tenant: &str) -> Result<Permit, ApiError> {
        self.streams.try_take(tenant, 1).ok_or_else(|| {
            too_many("as many streams of events are open as there may be (`--tenant-streams-max`, `--streams-max`)")
        })
    }

    /// Counts one more waiting request, if there may be one. If not, the request is answered at once: `Prefer: wait` is not binding.
    #[must_use]
    pub fn wait(&self, tenant: &str) -> Option<Permit> {
        self.waits.try_take(tenant, 1)
    }

    /// The same where the answer depends on the wait.
    ///
    /// # Errors
    /// As [`ConcurrencyLimits::request`].
    pub fn require_wait(&self, tenant: &str) -> Result<Permit, ApiError> {
        self.wait(tenant).ok_or_else(|| {
            too_many("as many requests wait as there may be (`--tenant-waits-max`, `--waits-max`)")
        })
    }
}

fn too_many(detail: &str) -> ApiError {
    ApiError::new(ProblemKind::TooManyRequests, detail)
}
