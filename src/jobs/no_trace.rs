//! Replacement for `trace` in a build without the feature `otlp`, in which no span is recorded.

use std::sync::Arc;
use std::time::SystemTime;

use crate::attempts::slices::Outcome;
use crate::error::Result;
use crate::store::Claim;

/// Records spans; this build has no value of it.
#[derive(Debug, Clone)]
pub enum Tracer {}

/// An attribute of a span.
pub(crate) struct KeyValue;

impl KeyValue {
    pub(crate) fn new<T>(_: &'static str, _: T) -> KeyValue {
        KeyValue
    }
}

/// The span of a submission.
pub(crate) struct SubmitSpan;

impl SubmitSpan {
    pub(crate) fn begin(_: Option<&Tracer>) -> SubmitSpan {
        SubmitSpan
    }

    pub(crate) fn traceparent(&self) -> Option<Arc<str>> {
        None
    }

    pub(crate) fn end<T>(
        self,
        submitted: Result<T>,
        _: impl FnOnce(&T) -> Vec<KeyValue>,
    ) -> Result<T> {
        submitted
    }
}

/// The trace of an attempt at a job; this build has no value of it.
#[derive(Debug, Clone)]
pub(crate) enum JobTrace {}

impl JobTrace {
    pub(crate) fn of(_: Option<&Tracer>, _: &Claim) -> Option<JobTrace> {
        None
    }

    pub(crate) fn solving(
        _: Option<&JobTrace>,
        _: bool,
        solve: impl FnOnce() -> Outcome,
    ) -> Outcome {
        solve()
    }

    pub(crate) fn waited_until(&self, _: SystemTime) {
        match *self {}
    }

    pub(crate) fn stored(&self, _: SystemTime, _: &'static str) {
        match *self {}
    }
}
