//! Capabilities and state of the service: methods, remarks, examples, problems, the tenant, probes and metrics.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::{Path, State};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::contract::EXAMPLES;
use crate::dto::TenantLimits;
use crate::extract::caller::{Caller, Operator};
use crate::layers::metrics::Metrics;
use crate::options::HttpOptions;
use crate::problem::{ApiError, PlainProblems, ProblemKind, ProblemMeaning, Result, problems};
use crate::routes::wait::WAIT_MAX_SECONDS;
use crate::state::AnyTenant;
use railhead_contact::case::words::solver::{Case, MethodName, Output};
use railhead_contact::remark::kind::RemarkKind;
use railhead_contact::remark::list::Remark;
use railhead_jobs::PAGE_MAX;
use railhead_jobs::error::JobsError;
use railhead_jobs::model::State as JobState;

/// The capabilities of the service.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Abilities)]
pub(crate) struct Capabilities {
    /// Values of `solver.method`.
    methods: Vec<MethodCapability>,
    /// Values of `contact.type`.
    contacts: Vec<ContactCapability>,
    /// Values of `outputs`.
    outputs: Vec<OutputCapability>,
    /// Limits of requests.
    limits: RequestLimits,
    /// Version of the service.
    #[schema(value_type = String)]
    version: &'static str,
}

/// A method of solving the tangential contact.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = MethodAbility)]
pub(crate) struct MethodCapability {
    /// Value of `solver.method`.
    name: MethodName,
    /// Whether it is used if the case names no method.
    default: bool,
    /// What the method is and when to choose it.
    #[schema(value_type = String)]
    summary: &'static str,
}

/// A type of contact.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ContactAbility)]
pub(crate) struct ContactCapability {
    /// Value of `contact.type`.
    #[schema(value_type = String)]
    name: &'static str,
    /// Whether the case must have a `load`.
    needs_load: bool,
    /// What the type describes.
    #[schema(value_type = String)]
    summary: &'static str,
}

/// An output that a case can request.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = OutputAbility)]
pub(crate) struct OutputCapability {
    /// Value in `outputs`.
    name: Output,
    /// Whether it is computed if the case names no outputs.
    default: bool,
    /// What it is.
    #[schema(value_type = String)]
    summary: &'static str,
}

/// Limits of requests.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RequestLimits {
    /// Largest body of one case in bytes.
    body_max_bytes: usize,
    /// Longest `Prefer: wait`, in s.
    wait_max_seconds: u32,
    /// Largest number of jobs in one page of a list.
    list_limit_max: u32,
    /// Largest number of motions in a case.
    motions_max: usize,
    /// Largest number of samples of a grid in a case, over both axes.
    samples_max: usize,
    /// Largest estimated memory of a case in bytes.
    memory_max_bytes: u64,
    /// Longest solver time of a case in s, even if it names no `time_limit_s`.
    time_limit_max_seconds: f64,
    /// Largest body of a batch in bytes.
    batch_max_bytes: u64,
    /// Largest number of cases in a batch.
    batch_max_cases: u32,
    /// Largest body of a run in bytes.
    run_max_bytes: u64,
    /// Largest number of rows in a run.
    run_max_rows: u64,
    /// Largest number of queued jobs of the tenant.
    queue_max: u64,
    /// Largest number of samples of a `grid` that a result is resampled on.
    grid_max_samples: usize,
    /// Limits of the requests of the tenant.
    #[serde(flatten)]
    tenant: TenantLimits,
}

/// Lists the methods, contacts and outputs that a case can name.
#[utoipa::path(
    get,
    path = "/v1/methods",
    tag = "cases",
    operation_id = "list_methods",
    responses((status = 200, description = "The capabilities of the service", body = Capabilities), PlainProblems)
)]
pub(crate) async fn methods(
    State(options): State<HttpOptions>,
    State(AnyTenant(jobs)): State<AnyTenant>,
) -> Json<Capabilities> {
    let own = jobs.options();
    let method = |(name, summary)| MethodCapability {
        name,
        default: name == MethodName::default(),
        summary,
    };
    let contact = |(name, needs_load, summary)| ContactCapability {
        name,
        needs_load,
        summary,
    };
    let output = |(name, default, summary)| OutputCapability {
        name,
        default,
        summary,
    };
    Json(Capabilities {
        methods: METHODS.map(method).into(),
        contacts: CONTACTS.map(contact).into(),
        outputs: OUTPUTS.map(output).into(),
        limits: RequestLimits {
            body_max_bytes: options.body_max_bytes,
            wait_max_seconds: WAIT_MAX_SECONDS,
            list_limit_max: PAGE_MAX,
            motions_max: own.limits.motions_max,
            samples_max: own.limits.samples_max,
            memory_max_bytes: own.limits.memory_bytes,
            time_limit_max_seconds: own.time_limit.as_secs_f64(),
            batch_max_bytes: options.batch_max_bytes,
            batch_max_cases: options.batch_max_cases,
            run_max_bytes: options.run_max_bytes,
            run_max_rows: options.run_max_rows,
            queue_max: own.tenant_queue_max.min(own.queue_max),
            grid_max_samples: options.grid_max_samples,
            tenant: TenantLimits::of(&options),
        },
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// An array of tuples, one per line.
macro_rules! entries {
    ($($($part:expr),+;)*) => {
        [$(($($part),+)),*]
    };
}

const METHODS: [(MethodName, &str); 5] = entries! {
    MethodName::Auto, "Resultants by `table` for elliptic contacts of like bodies with one coefficient of friction and given creepages, if its error bound meets `target_error`; otherwise by `boundary_element`. Values per cell by `boundary_element`.";
    MethodName::BoundaryElement, "Boundary elements with a semismooth Newton iteration: fast, for every motion and patches of any shape.";
    MethodName::LiuHsu, "The Newton–Raphson method of Liu and Hsu with its two initial guesses. Slower, for small meshes; for some values of spin it does not converge and reports an error.";
    MethodName::Fastsim, "Kalker's simplified theory: an approximate result in microseconds, with a fixed instead of an estimated error.";
    MethodName::Table, "Resultants and their derivatives from a table computed by `boundary_element`, in about a microsecond, with an error bound: for elliptic patches with a/b from 0.1 to 10, and for other patches by an equivalent ellipse.";
};

const CONTACTS: [(&str, bool, &str); 7] = entries! {
    "radii", true, "An elliptic patch by Hertz's theory, from relative radii of curvature.";
    "ellipse", true, "An elliptic patch of given semi-axes with Hertz's pressure.";
    "gap_profile", true, "A gap measured laterally between bodies that are circular along rolling; region and pressure are computed.";
    "gap_grid", true, "Any gap on a grid; region and pressure are computed, in one or several patches.";
    "profiles", true, "A wheel on a rail by their cross-sections; every patch is found, with its position and its own frame.";
    "wheelset", true, "A wheelset on both rails by their cross-sections, in one or several positions; its roll, its height and every patch are computed, and its equivalent conicity if requested.";
    "pressure_grid", false, "A given pressure on a grid; its positive part is the contact, in one or several patches.";
};

const OUTPUTS: [(Output, bool, &str); 9] = entries! {
    Output::Resultants, true, "Forces, moment and dissipated power.";
    Output::Zones, true, "Stick and slip zones: cells, areas and outlines.";
    Output::Tractions, false, "Tangential tractions per cell.";
    Output::Pressure, false, "Pressure per cell.";
    Output::Slip, false, "Relative slip per cell, divided by rolling speed.";
    Output::Subsurface, false, "Stresses below the surface at the points of `subsurface`, and the worst point of every patch.";
    Output::Damage, false, "Friction power, wear and fatigue of one pass by the models of `damage`.";
    Output::Temperature, false, "Temperature of both surfaces per cell; needs `thermal` and `speed_mm_per_s` in the motion.";
    Output::Gradients, false, "Derivatives of forces and moment with respect to creepages and spin, and to the normal force for Hertz contacts; not for a `history`.";
};

/// Lists every remark that a result can have: its code, what it means and what to do about it.
#[utoipa::path(
    get,
    path = "/v1/remarks",
    tag = "cases",
    operation_id = "list_remarks",
    responses((status = 200, description = "All kinds of remarks", body = Vec<RemarkKind>), PlainProblems)
)]
pub(crate) async fn remarks() -> Json<Vec<RemarkKind>> {
    Json(Remark::kinds())
}

/// An example case.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct ExampleCase {
    /// Name of the example, as in `api/examples/{name}.case.json`.
    #[schema(value_type = String)]
    name: &'static str,
    /// What the example shows.
    #[schema(value_type = String)]
    summary: &'static str,
    /// The case, ready to submit.
    #[schema(value_type = Case)]
    case: Value,
}

/// Lists example cases, each ready to submit.
#[utoipa::path(
    get,
    path = "/v1/examples",
    tag = "cases",
    operation_id = "list_examples",
    responses((status = 200, description = "All example cases", body = Vec<ExampleCase>), PlainProblems)
)]
pub(crate) async fn examples() -> Result<Json<Vec<ExampleCase>>> {
    let read = |(name, summary, text): (&'static str, &'static str, &str)| {
        let case = serde_json::from_str(text);
        let case = case.map_err(ApiError::internal)?;
        Ok(ExampleCase {
            name,
            summary,
            case,
        })
    };
    let examples = EXAMPLES.into_iter().map(read);
    examples.collect::<Result<_>>().map(Json)
}

/// Response of a healthy service.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Health {
    /// `alive` or `ready`.
    #[schema(value_type = String, example = "ready")]
    status: &'static str,
    /// Version of the service.
    #[schema(value_type = String)]
    version: &'static str,
}

impl Health {
    fn new(status: &'static str) -> Json<Health> {
        Json(Health {
            status,
            version: env!("CARGO_PKG_VERSION"),
        })
    }
}

/// Checks that the process is alive, and nothing else.
#[utoipa::path(
    get,
    path = "/healthz",
    tag = "service",
    operation_id = "healthz",
    responses((status = 200, description = "The process is alive", body = Health))
)]
pub(crate) async fn alive() -> Json<Health> {
    Health::new("alive")
}

problems! {
    /// Problems of `GET /readyz`.
    ReadyProblems: NotReady, Draining, StorageFull, StorageUnwritable, StorageUnreachable
}

/// Checks that the service can accept jobs; queries the job store.
#[utoipa::path(
    get,
    path = "/readyz",
    tag = "service",
    operation_id = "readyz",
    responses((status = 200, description = "The service accepts jobs", body = Health), ReadyProblems)
)]
pub(crate) async fn ready(State(AnyTenant(jobs)): State<AnyTenant>) -> Result<Json<Health>> {
    match jobs.ready().await {
        Ok(()) => Ok(Health::new("ready")),
        Err(reason)
            if matches!(reason, JobsError::Draining) || reason.storage_fault().is_some() =>
        {
            Err(reason.into())
        }
        Err(reason) => {
            tracing::warn!(%reason, "the job store does not respond");
            Err(ApiError::new(
                ProblemKind::NotReady,
                "the job store cannot be reached; the service's log has the reason",
            ))
        }
    }
}

/// Content type of OpenMetrics text, which Prometheus prefers.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Content type of the older text format of Prometheus.
const PLAIN: &str = "text/plain; version=0.0.4; charset=utf-8";

problems! {
    /// Problems of `GET /metrics`.
    MetricsProblems: Unauthorized, Forbidden, TooManyRequests
}

/// Returns the metrics as OpenMetrics text, or as Prometheus text for clients that accept only that.
///
/// Every name begins with `railhead_`. Labels have few values; none contains an id or a text of a client.
#[utoipa::path(
    get,
    path = "/metrics",
    tag = "service",
    operation_id = "get_metrics",
    responses((status = 200, description = "The metrics", content((String = "application/openmetrics-text"), (String = "text/plain"))), MetricsProblems)
)]
pub(crate) async fn metrics(
    Operator(jobs): Operator,
    State(metrics): State<Metrics>,
    headers: HeaderMap,
) -> Result<Response> {
    jobs.refresh_metrics().await?;
    let mut text = String::new();
    metrics.write(&mut text).map_err(ApiError::internal)?;
    if wants_plain_text(&headers) {
        return Ok(([(header::CONTENT_TYPE, PLAIN)], plain(&text)).into_response());
    }
    Ok(([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response())
}

/// Whether `Accept` names plain text and not OpenMetrics, as older tools do.
fn wants_plain_text(headers: &HeaderMap) -> bool {
    let names = |wanted: &str| {
        let values = headers.get_all(header::ACCEPT).iter();
        let mut values = values.filter_map(|value| value.to_str().ok());
        values.any(|value| value.contains(wanted))
    };
    names("text/plain") && !names("application/openmetrics-text")
}

/// Converts OpenMetrics text to the older text format: counters and infos have the names of their samples, and there is no end mark.
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
            // Units and the end mark are dropped; types are read with their help text.
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

problems! {
    /// Problems of `GET /problems/{name}`.
    ExplainProblems: BadQuery, UnknownRoute
}

/// Lists every kind of problem.
#[utoipa::path(
    get,
    path = "/problems",
    tag = "service",
    operation_id = "list_problems",
    responses((status = 200, description = "All kinds of problems", body = Vec<ProblemMeaning>), PlainProblems)
)]
pub(crate) async fn list_problems() -> Json<Vec<ProblemMeaning>> {
    let kinds = ProblemKind::ALL.iter().copied();
    Json(kinds.map(ProblemMeaning::from).collect())
}

/// Explains one kind of problem; the `type` of a problem is this path.
#[utoipa::path(
    get,
    path = "/problems/{name}",
    tag = "service",
    operation_id = "explain_problem",
    params(("name" = String, Path, description = "The last part of a problem's `type`", example = "faulty-case")),
    responses((status = 200, description = "What this kind of problem means", body = ProblemMeaning), ExplainProblems)
)]
pub(crate) async fn explain(Path(name): Path<String>) -> Result<Json<ProblemMeaning>> {
    let known = ProblemKind::ALL
        .iter()
        .copied()
        .find(|kind| kind.slug() == name);
    known.map(|kind| Json(kind.into())).ok_or_else(|| {
        ApiError::new(
            ProblemKind::UnknownRoute,
            format!("`{name}` is not a kind of problem; `/problems` lists all kinds"),
        )
    })
}

/// The client with its usage and limits.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Me {
    /// The tenant that the key belongs to; `anonymous` without a key.
    tenant: String,
    /// Labels that the key is bound to: the key can access only resources with these labels, and resources created with it get them.
    labels: BTreeMap<String, String>,
    /// Largest usage allowed to the tenant.
    quota: Quota,
    /// Present usage of the tenant.
    used: Used,
    /// Limits of requests.
    limits: TenantLimits,
}

/// Largest usage allowed to a tenant.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Quota {
    /// Queued jobs and chunks of runs, including those of batches that are being received.
    queued: u64,
    /// Bytes reserved for batches that are being received.
    staged_bytes: u64,
    /// Bytes of stored cases, templates and results; null: no limit.
    stored_bytes: Option<u64>,
}

/// Present usage of a tenant.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Used {
    /// Queued jobs and chunks of runs, including the places reserved for batches that are being received.
    queued: u64,
    /// Bytes reserved for batches that are being received.
    staged_bytes: u64,
    /// Bytes of stored cases, templates and results.
    stored_bytes: u64,
    /// Number of its jobs in each state, including the chunks of its runs.
    #[schema(value_type = BTreeMap<String, u64>)]
    jobs: BTreeMap<&'static str, u64>,
}

/// Returns the client's tenant, its usage and its limits.
#[utoipa::path(
    get,
    path = "/v1/me",
    tag = "service",
    operation_id = "get_me",
    responses((status = 200, description = "The tenant with its usage and its limits", body = Me), PlainProblems)
)]
pub(crate) async fn me(
    Caller(jobs): Caller,
    State(options): State<HttpOptions>,
) -> Result<Json<Me>> {
    let own = jobs.options();
    let usage = jobs.usage().await?;
    let number = |state| usage.jobs.get(&state).copied().unwrap_or(0);
    Ok(Json(Me {
        tenant: jobs.tenant().to_owned(),
        labels: jobs.bound().clone(),
        quota: Quota {
            queued: own.tenant_queue_max.min(own.queue_max),
            staged_bytes: own.staging.tenant.min(own.staging.all),
            stored_bytes: own.tenant_stored_max_bytes,
        },
        used: Used {
            queued: number(JobState::Queued) + usage.reserved,
            staged_bytes: usage.staged_bytes,
            stored_bytes: usage.stored_bytes,
            jobs: JobState::ALL
                .map(|state| (state.name(), number(state)))
                .into(),
        },
        limits: TenantLimits::of(&options),
    }))
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
