//! `/metrics`: what the service counts, for Prometheus.

use axum::extract::State;
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};

use crate::http::extract::caller::Operator;
use crate::http::layers::metrics::Metrics;
use crate::http::problem::catalogue::problems;
use crate::http::problem::error::ApiError;

/// The text form that Prometheus asks for first.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// The form before it.
const PLAIN: &str = "text/plain; version=0.0.4; charset=utf-8";

problems! {
    /// What `GET /metrics` can fail with.
    MetricsProblems: Unauthorized, Forbidden, TooManyRequests
}

/// What the service counts, as OpenMetrics text, or in the older text form for those who accept only that.
///
/// Every name begins with `railhead_`. Labels have few values; none holds an id or a text of a client.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "service",
    operation_id = "get_metrics",
    responses((status = 200, description = "The figures", content((String = "application/openmetrics-text"), (String = "text/plain"))), MetricsProblems)
)]
pub(crate) async fn metrics(
    Operator(jobs): Operator,
    State(metrics): State<Metrics>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    jobs.refresh_metrics().await?;
    let mut text = String::new();
    metrics
        .write(&mut text)
        .map_err(|error| ApiError::internal(&error))?;
    if wants_plain_text(&headers) {
        return Ok(([(header::CONTENT_TYPE, PLAIN)], plain(&text)).into_response());
    }
    Ok(([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response())
}

/// Older tools name the text form and not OpenMetrics.
fn wants_plain_text(headers: &HeaderMap) -> bool {
    let names = |wanted: &str| {
        let values = headers.get_all(header::ACCEPT).iter();
        let mut values = values.filter_map(|value| value.to_str().ok());
        values.any(|value| value.contains(wanted))
    };
    names("text/plain") && !names("application/openmetrics-text")
}

/// OpenMetrics text in the older form: counters and infos are called as their samples are, and there is no end mark.
fn plain(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut samples = text.lines().peekable();
    while let Some(line) = samples.next() {
        let Some(about) = line.strip_prefix("# ") else {
            lines.push(line.to_owned());
            continue;
        };
        let mut words = about.splitn(3, ' ');
        let (kind, name, rest) = (words.next(), words.next(), words.next());
        let (Some("HELP"), Some(name), Some(help)) = (kind, name, rest) else {
            // Units and the end mark; types are taken with their help.
            continue;
        };
        let of_type = samples.next().and_then(|line| line.rsplit(' ').next());
        let (suffix, of_type) = match of_type {
            Some("counter") => ("_total", "counter"),
            Some("info") => ("_info", "gauge"),
            Some("unknown") | None => ("", "untyped"),
            Some(other) => ("", other),
        };
        lines.push(format!("# HELP {name}{suffix} {help}"));
        lines.push(format!("# TYPE {name}{suffix} {of_type}"));
    }
    lines.push(String::new());
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_older_form_calls_metrics_as_their_samples_are_called() {
        let text = "# HELP a_build The version.\n# TYPE a_build info\na_build_info{version=\"1\"} 1\n\
                    # HELP a_jobs Jobs.\n# TYPE a_jobs counter\na_jobs_total{state=\"x\"} 2\n\
                    # HELP a_size Size.\n# TYPE a_size gauge\n# UNIT a_size bytes\na_size 3\n# EOF\n";
        assert_eq!(
            plain(text),
            "# HELP a_build_info The version.\n# TYPE a_build_info gauge\na_build_info{version=\"1\"} 1\n\
             # HELP a_jobs_total Jobs.\n# TYPE a_jobs_total counter\na_jobs_total{state=\"x\"} 2\n\
             # HELP a_size Size.\n# TYPE a_size gauge\na_size 3\n"
        );
    }
}
