//! Stand-in for `otlp` in a build without this feature.

use crate::jobs::JobsError;
use crate::jobs::trace::Tracer;
use crate::telemetry::Endpoint;

/// Sends spans; no value of it exists in this build.
#[derive(Debug)]
pub enum Traces {}

impl Traces {
    /// Refuses: this program cannot send spans.
    ///
    /// # Errors
    /// Always [`JobsError::NotBuilt`].
    pub fn start(_: &Endpoint) -> anyhow::Result<Traces> {
        Err(JobsError::NotBuilt {
            what: "OTLP",
            feature: "otlp",
        }
        .into())
    }

    /// Creates the spans.
    #[must_use]
    pub fn tracer(&self) -> Tracer {
        match *self {}
    }

    /// Sends the remaining spans.
    pub async fn stop(self) {
        match self {}
    }
}
