//! What makes spans: of a request, of a submission, and of what has passed already.
//!
//! A job may be solved by another process than the one that took it, so its trace travels with its row, as a W3C
//! `traceparent`. Where nobody collects spans there is no [`Tracer`], and nothing is made, stored or measured.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::SystemTime;

pub(crate) use opentelemetry::KeyValue;

use opentelemetry::Context;
use opentelemetry::global::{BoxedTracer, ObjectSafeTracer};
use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::{Span, SpanKind, Status, TraceContextExt, Tracer as _};
use opentelemetry_sdk::propagation::TraceContextPropagator;

use crate::error::Result;

pub(crate) const TRACEPARENT: &str = "traceparent";

const TRACESTATE: &str = "tracestate";

/// Makes spans for those who collect them; clones share it.
#[derive(Debug, Clone)]
pub struct Tracer(pub(crate) Arc<BoxedTracer>);

impl Tracer {
    /// Spans go where this tracer of OpenTelemetry sends them.
    pub fn new(tracer: impl ObjectSafeTracer + Send + Sync + 'static) -> Tracer {
        Tracer(Arc::new(BoxedTracer::new(Box::new(tracer))))
    }

    /// Begins the span of a request, inside the client's trace if its headers name one. What the headers should not
    /// say is passed over, as W3C Trace Context asks.
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

    /// Writes down a span that is over.
    pub(crate) fn past(
        &self,
        name: &'static str,
        parent: &Context,
        [from, to]: [SystemTime; 2],
        attributes: Vec<KeyValue>,
        fault: Option<String>,
    ) {
        let span = self.0.span_builder(name).with_start_time(from);
        let span = span.with_attributes(attributes);
        let mut span = span.start_with_context(&*self.0, parent);
        if let Some(fault) = fault {
            span.set_status(Status::error(fault));
        }
        span.end_with_timestamp(to);
    }
}

/// The span of a submission; without a tracer it is none.
pub(crate) struct SubmitSpan(pub(crate) Option<Context>);

impl SubmitSpan {
    /// What is written to the rows of the jobs; `None` if the trace is not collected.
    pub(crate) fn traceparent(&self) -> Option<Arc<str>> {
        let context = self.0.as_ref()?;
        if !context.span().span_context().is_sampled() {
            return None;
        }
        let mut headers = HashMap::new();
        TraceContextPropagator::new().inject_context(context, &mut headers);
        headers.remove(TRACEPARENT).map(Into::into)
    }

    /// Ends the span with what became of it.
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
