//! The spans of the life of one job: `submit`, `queue`, `solve`, `store`.

use std::collections::HashMap;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use opentelemetry::Context;
use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::{TraceContextExt, Tracer as _};
use opentelemetry_sdk::propagation::TraceContextPropagator;
use uuid::Uuid;

use crate::attempts::slices::Outcome;
use crate::handle::Jobs;
use crate::model::created_at;
use crate::shared::Shared;
use crate::store::Claim;
use crate::trace::{KeyValue, SubmitSpan, TRACEPARENT, Tracer};

impl Jobs {
    /// What makes the spans, if they are collected.
    #[must_use]
    pub fn tracer(&self) -> Option<&Tracer> {
        self.shared.options.tracer.as_ref()
    }

    /// Begins the span of a submission, inside the span of the request.
    pub(crate) fn submit_span(&self) -> SubmitSpan {
        SubmitSpan(self.tracer().map(|tracer| {
            let parent = Context::current();
            let span = tracer.0.start_with_context("submit", &parent);
            parent.with_span(span)
        }))
    }
}

impl Shared {
    /// The trace to which an attempt at a job belongs, if it is collected.
    pub(crate) fn job_trace(&self, claim: &Claim) -> Option<JobTrace> {
        let tracer = self.options.tracer.clone()?;
        let traceparent = claim.traceparent.clone()?;
        let headers = HashMap::from([(TRACEPARENT.to_owned(), traceparent)]);
        Some(JobTrace {
            parent: TraceContextPropagator::new().extract_with_context(&Context::new(), &headers),
            tracer,
            job: claim.id,
            attempt: claim.attempt,
            method: claim.method.clone(),
        })
    }
}

/// An attempt at a job whose trace is collected.
#[derive(Debug, Clone)]
pub(crate) struct JobTrace {
    tracer: Tracer,
    parent: Context,
    job: Uuid,
    attempt: u32,
    method: String,
}

impl JobTrace {
    /// Solves a case and writes down how long it had waited and how long it took.
    pub(crate) fn solving(
        traced: Option<&JobTrace>,
        comes_from_queue: bool,
        solve: impl FnOnce() -> Outcome,
    ) -> Outcome {
        let Some(traced) = traced else {
            return solve();
        };
        let from = SystemTime::now();
        if comes_from_queue {
            traced.waited_until(from);
        }
        let outcome = solve();
        let fault = match &outcome {
            Outcome::Solved { .. } | Outcome::Slice { .. } => None,
            Outcome::Unsolved { error, .. } => Some(error.to_string()),
            Outcome::Refused(error) => Some(error.to_string()),
            Outcome::Broken(failure) => Some(failure.detail.clone()),
            Outcome::Abandoned => Some("the solver did not stop".to_owned()),
        };
        let method = KeyValue::new("railhead.method", traced.method.clone());
        traced.past("solve", [from, SystemTime::now()], vec![method], fault);
        outcome
    }

    /// Writes down how long a job has waited.
    pub(crate) fn waited_until(&self, end: SystemTime) {
        let queued = Duration::from_millis(created_at(self.job).unsigned_abs());
        // The clock may have been set back since.
        let queued = (UNIX_EPOCH + queued).min(end);
        self.past("queue", [queued, end], Vec::new(), None);
    }

    /// Writes down how long the end of a job took to store, and what it was.
    pub(crate) fn stored(&self, from: SystemTime, end: &'static str) {
        let end = KeyValue::new("railhead.job.state", end);
        self.past("store", [from, SystemTime::now()], vec![end], None);
    }

    fn past(
        &self,
        name: &'static str,
        times: [SystemTime; 2],
        mut attributes: Vec<KeyValue>,
        fault: Option<String>,
    ) {
        attributes.push(KeyValue::new("railhead.job.id", self.job.to_string()));
        attributes.push(KeyValue::new(
            "railhead.job.attempt",
            i64::from(self.attempt),
        ));
        self.tracer
            .past(name, &self.parent, times, attributes, fault);
    }
}
