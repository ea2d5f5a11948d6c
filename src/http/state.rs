//! The state that handlers share.

use axum::extract::FromRef;

use crate::layers::auth::Access;
use crate::layers::metrics::Metrics;
use crate::limits::{ConcurrencyLimits, Memory};
use crate::options::HttpOptions;
use railhead_jobs::Jobs;

/// Returns the text of the contract, which is built on the first request for it.
#[derive(Debug, Clone, Copy)]
pub struct Document(pub fn() -> &'static str);

/// All jobs, for handlers that do not act for a tenant.
#[derive(Debug, Clone)]
pub struct AnyTenant(pub Jobs);

/// The state that handlers share. Clones are cheap.
#[derive(Clone, FromRef)]
pub struct AppState {
    pub unscoped: AnyTenant,
    pub access: Access,
    pub options: HttpOptions,
    pub concurrency: ConcurrencyLimits,
    pub memory: Memory,
    pub metrics: Metrics,
    pub document: Document,
}

impl AppState {
    /// Creates the state with the limits of these options.
    pub fn new(jobs: Jobs, options: HttpOptions, metrics: Metrics, document: Document) -> AppState {
        AppState {
            access: Access::new(&jobs, &options),
            concurrency: ConcurrencyLimits::new(&options),
            memory: Memory::new(&options),
            unscoped: AnyTenant(jobs),
            options,
            metrics,
            document,
        }
    }
}
