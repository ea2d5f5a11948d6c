//! What every handler can reach.

use axum::extract::FromRef;

use crate::http::layers::auth::{Access, Unscoped};
use crate::http::layers::metrics::Metrics;
use crate::http::limits::concurrency::Crowds;
use crate::http::limits::memory::Memory;
use crate::http::options::HttpOptions;
use crate::jobs::Jobs;

/// What every handler can reach; clones share it.
#[derive(Clone, FromRef)]
pub struct AppState {
    pub unscoped: Unscoped,
    pub access: Access,
    pub options: HttpOptions,
    pub crowds: Crowds,
    pub memory: Memory,
    pub metrics: Metrics,
}

impl AppState {
    /// The jobs and the limits of these options.
    pub fn new(jobs: Jobs, options: HttpOptions, metrics: Metrics) -> AppState {
        AppState {
            access: Access::new(&jobs, &options),
            crowds: Crowds::new(&options),
            memory: Memory::new(&options),
            unscoped: Unscoped(jobs),
            options,
            metrics,
        }
    }
}
