//! Limits of the requests of one tenant, as the client sees them.

use serde::Serialize;
use utoipa::ToSchema;

use crate::http::options::HttpOptions;

/// Limits of the requests of the tenant.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TenantLimits {
    /// Most requests of the tenant under way, streams of events and waits aside.
    requests_max: usize,
    /// Most streams of events of the tenant.
    streams_max: usize,
    /// Most requests of the tenant that wait for the end of a job or a batch.
    waits_max: usize,
    /// Requests per second of one key, or of one address without a key; 0 for any number.
    requests_per_second: u32,
}

impl TenantLimits {
    /// The limits that every tenant has.
    #[must_use]
    pub(crate) fn of(options: &HttpOptions) -> TenantLimits {
        TenantLimits {
            requests_max: options.tenant_requests_max,
            streams_max: options.tenant_streams_max,
            waits_max: options.tenant_waits_max,
            requests_per_second: options.requests_per_second,
        }
    }
}
