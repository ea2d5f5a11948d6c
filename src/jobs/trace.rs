//! Spans of a request and of a job: `submit`, `queue`, `solve`, `store`.
//!
//! A job may be solved by another process than the one that accepted it, so its row contains its trace as a W3C `traceparent`.
//! If no spans are collected, there is no [`Tracer`], and nothing is recorded.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

pub(crate) use opentelemetry::KeyValue;

use opentelemetry::Context;
use opentelemetry::global::{BoxedTracer, ObjectSafeTracer};
use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::{Span, SpanKind, Status, TraceContextExt, Tracer as _};
use opentelemetry_sdk::propagation::TraceContextPropagator;
use uuid::Uuid;

use crate::attempts::slices::Outcome;
use crate::error::Result;
use crate::model::created_at;
use crate::store::Claim;

const TRACEPARENT: &str = "traceparent";

const TRACESTATE: &str = "tracestate";

/// Records spans; clones share the tracer.
#[derive(Debug, Clone)]
pub struct Tracer(Arc<BoxedTracer>);

impl Tracer {
    /// Records spans with a tracer of OpenTelemetry.
    pub fn new(tracer: impl ObjectSafeTracer + Send + Sync + 'static) -> Tracer {
        Tracer(Arc::new(BoxedTracer::new(Box::new(tracer))))
    }

    /// Begins the span of a request, inside the client's trace if its headers contain one. Invalid headers are ignored, as W3C Trace
    /// Context requires.
    #[must_use]
    pub fn request(
        &self,
        name: String,
        traceparent: Option<&str>,
        tracestate: Option<&str>,
        attributes: Vec<KeyValue>,
    ) -> Context {
        let headers = [(TRACEPARENT, traceparent), (TRACESTATE, tracestate)];
        let headers = headers
            .into_iter()
            .filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned())));
        let headers: HashMap<String, String> = headers.collect();
        let parent = TraceContextPropagator::new().extract_with_context(&Context::new(), &headers);
        let span = self.0.span_builder(name).with_kind(SpanKind::Server);
        let span = span.with_attributes(attributes);
        let span = span.start_with_context(&*self.0, &parent);
        parent.with_span(span)
    }
}

/// The span of a submission, if there is a tracer.
pub(crate) struct SubmitSpan(Option<Context>);

impl SubmitSpan {
    /// Begins the span, inside the span of the request.
    pub(crate) fn begin(tracer: Option<&Tracer>) -> SubmitSpan {
        SubmitSpan(tracer.map(|tracer| {
            let parent = Context::current();
            let span = tracer.0.start_with_context("submit", &parent);
            parent.with_span(span)
        }))
    }

    /// The trace context for the rows of the jobs; `None` if the trace is not recorded.
    pub(crate) fn traceparent(&self) -> Option<Arc<str>> {
        let context = self.0.as_ref()?;
        if !context.span().span_context().is_sampled() {
            return None;
        }
        let mut headers = HashMap::new();
        TraceContextPropagator::new().inject_context(context, &mut headers);
        headers.remove(TRACEPARENT).map(Into::into)
    }

    /// Ends the span with the outcome of the submission.
    pub(crate) fn end<T>(
        self,
        submitted: Result<T>,
        tell: impl FnOnce(&T) -> Vec<KeyValue>,
    ) -> Result<T> {
        if let Some(context) = self.0 {
            let span = context.span();
            match &submitted {
                Ok(done) => span.set_attributes(tell(done)),
                Err(error) => span.set_status(Status::error(error.to_string())),
            }
            span.end();
        }
        submitted
    }
}

/// The trace of an attempt at a job.
#[derive(Debug, Clone)]
pub(crate) struct JobTrace {
    tracer: Tracer,
    parent: Context,
    job: Uuid,
    attempt: u32,
    method: String,
}

impl JobTrace {
    /// The trace of an attempt, if it is recorded.
    pub(crate) fn of(tracer: Option<&Tracer>, claim: &Claim) -> Option<JobTrace> {
        let tracer = tracer?.clone();
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

    /// Solves a case and records the spans `queue`, if it comes from the queue, and `solve`.
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
            Outcome::Solved(_) | Outcome::Slice { .. } => None,
            Outcome::Unsolved { error, .. } => Some(error.to_string()),
            Outcome::Refused(error) => Some(error.to_string()),
            Outcome::Broken(failure) => Some(failure.detail.clone()),
            Outcome::Abandoned => Some("the solver did not stop".to_owned()),
        };
        let method = KeyValue::new("railhead.method", traced.method.clone());
        traced.past("solve", [from, SystemTime::now()], vec![method], fault);
        outcome
    }

    /// Records the span `queue`.
    pub(crate) fn waited_until(&self, end: SystemTime) {
        let queued = Duration::from_millis(created_at(self.job).unsigned_abs());
        // The clock may have been set back in the meantime.
        let queued = (UNIX_EPOCH + queued).min(end);
        self.past("queue", [queued, end], Vec::new(), None);
    }

    /// Records the span `store` with the final state of the job.
    pub(crate) fn stored(&self, from: SystemTime, end: &'static str) {
        let end = KeyValue::new("railhead.job.state", end);
        self.past("store", [from, SystemTime::now()], vec![end], None);
    }

    /// Records a span that has ended.
    fn past(
        &self,
        name: &'static str,
        [from, to]: [SystemTime; 2],
        mut attributes: Vec<KeyValue>,
        fault: Option<String>,
    ) {
        let attempt = i64::from(self.attempt);
        attributes.push(KeyValue::new("railhead.job.id", self.job.to_string()));
        attributes.push(KeyValue::new("railhead.job.attempt", attempt));
        let span = self.tracer.0.span_builder(name).with_start_time(from);
        let span = span.with_attributes(attributes);
        let mut span = span.start_with_context(&*self.tracer.0, &self.parent);
        if let Some(fault) = fault {
            span.set_status(Status::error(fault));
        }
        span.end_with_timestamp(to);
    }
}
