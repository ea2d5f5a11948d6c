//! `/v1/methods`: what the service can do, in words a client can choose from.

use axum::Json;
use axum::extract::State;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::{MethodName, Output};
use crate::http::dto::tenant_limits::TenantLimits;
use crate::http::extract::caller::AnyTenant;
use crate::http::options::HttpOptions;
use crate::http::problem::catalogue::PlainProblems;
use crate::http::routes::wait::WAIT_MAX_SECONDS;
use crate::jobs::PAGE_MAX;

/// What the service can do.
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
    /// The word for `solver.method`.
    name: MethodName,
    /// Used when the case names none.
    default: bool,
    /// What it is and when to choose it.
    #[schema(value_type = String)]
    summary: &'static str,
}

/// A way to describe where the bodies touch.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ContactAbility)]
pub(crate) struct ContactCapability {
    /// The word for `contact.type`.
    #[schema(value_type = String)]
    name: &'static str,
    /// Must the case have a `load`?
    needs_load: bool,
    /// What it describes.
    #[schema(value_type = String)]
    summary: &'static str,
}

/// Something a case can ask for.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = OutputAbility)]
pub(crate) struct OutputCapability {
    /// The word for `outputs`.
    name: Output,
    /// Computed when the case names no outputs.
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
    /// Most jobs in one page of a list.
    list_limit_max: u32,
    /// Most motions of one case.
    motions_max: usize,
    /// Most samples of a grid in a case, one axis times the other.
    samples_max: usize,
    /// Most memory in bytes that a case may be estimated to need.
    memory_max_bytes: u64,
    /// Longest solver time of a case in s, also of one that names no `time_limit_s`.
    time_limit_max_seconds: f64,
    /// Largest body of a batch in bytes.
    batch_max_bytes: u64,
    /// Most cases of a batch.
    batch_max_cases: u32,
    /// Largest body of a run in bytes.
    run_max_bytes: u64,
    /// Most rows of a run.
    run_max_rows: u64,
    /// Most queued jobs of the tenant.
    queue_max: u64,
    /// Most samples of a `grid` that a result is resampled on.
    grid_max_samples: usize,
    /// Limits of the requests of the tenant.
    #[serde(flatten)]
    tenant: TenantLimits,
}

/// The methods, contacts and outputs that a case can name.
#[utoipa::path(
    get,
    path = "/v1/methods",
    tag = "cases",
    operation_id = "list_methods",
    responses((status = 200, description = "What the service can do", body = Capabilities), PlainProblems)
)]
pub(crate) async fn methods(
    State(options): State<HttpOptions>,
    State(AnyTenant(jobs)): State<AnyTenant>,
) -> Json<Capabilities> {
    let own = jobs.options();
    Json(Capabilities {
        methods: METHODS
            .map(|(name, summary)| MethodCapability {
                name,
                default: name == MethodName::default(),
                summary,
            })
            .into(),
        contacts: CONTACTS
            .map(|(name, needs_load, summary)| ContactCapability {
                name,
                needs_load,
                summary,
            })
            .into(),
        outputs: OUTPUTS
            .map(|(name, default, summary)| OutputCapability {
                name,
                default,
                summary,
            })
            .into(),
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

/// Methods with what they are for.
const METHODS: [(MethodName, &str); 5] = [
    (
        MethodName::Auto,
        "Resultants by `table` for elliptic contacts of like bodies with one coefficient of friction and given creepages, where the bound of its \
         error meets `target_error`, and else by `boundary_element`. Values per cell are by `boundary_element`.",
    ),
    (
        MethodName::BoundaryElement,
        "Boundary elements with a semismooth Newton iteration: fast, for every motion and any shape of patch.",
    ),
    (
        MethodName::LiuHsu,
        "The Newton–Raphson method of Liu and Hsu with its two initial guesses. Slower, for small meshes; \
         it does not converge at every spin and then says so.",
    ),
    (
        MethodName::Fastsim,
        "Kalker's simplified theory: a draft in microseconds, with a stated error instead of an estimated one.",
    ),
    (
        MethodName::Table,
        "Resultants and their derivatives interpolated in a table that `boundary_element` made, in about a microsecond, with a \
         bound of the error: elliptic patches with a/b from 0.1 to 10, others by the ellipse that carries their load the same way.",
    ),
];

/// Types of contacts: whether they need a load, and how they are given.
const CONTACTS: [(&str, bool, &str); 7] = [
    (
        "radii",
        true,
        "Relative radii of curvature: an elliptic patch after Hertz.",
    ),
    (
        "ellipse",
        true,
        "An elliptic patch of given semi-axes with Hertz's pressure.",
    ),
    (
        "gap_profile",
        true,
        "A gap measured across, between bodies that are circular along rolling: region and pressure are found.",
    ),
    (
        "gap_grid",
        true,
        "Any gap on a grid: region and pressure are found, in one or several patches.",
    ),
    (
        "profiles",
        true,
        "A wheel on a rail by their cross-sections: every patch is found, with its place and its own frame.",
    ),
    (
        "wheelset",
        true,
        "A wheelset on both rails by their cross-sections, in one or several positions: its roll, its height and every patch are found; with \
         its equivalent conicity if asked.",
    ),
    (
        "pressure_grid",
        false,
        "A given pressure on a grid; its positive part is the contact, in one or several patches.",
    ),
];

/// Outputs: whether they are the default, and what they are.
const OUTPUTS: [(Output, bool, &str); 9] = [
    (
        Output::Resultants,
        true,
        "Forces, moment and dissipated power.",
    ),
    (
        Output::Zones,
        true,
        "Stick and slip zones: cells, areas and outlines.",
    ),
    (Output::Tractions, false, "Tangential tractions per cell."),
    (Output::Pressure, false, "Pressure per cell."),
    (
        Output::Slip,
        false,
        "Relative slip per cell, divided by rolling speed.",
    ),
    (
        Output::Subsurface,
        false,
        "Stresses below the surface at the points of `subsurface`, and the worst point of every patch.",
    ),
    (
        Output::Damage,
        false,
        "Friction power, wear and fatigue of one pass by the models of `damage`.",
    ),
    (
        Output::Temperature,
        false,
        "Temperature of both surfaces per cell; needs `thermal` and `speed_mm_per_s` in the motion.",
    ),
    (
        Output::Gradients,
        false,
        "Derivatives of forces and moment by creepages and spin, and by the normal force of Hertz contacts; not of a `history`.",
    ),
];
