//! Types of JSON responses.

use std::collections::BTreeMap;

use railhead_macros::{keyword, none_is_absent};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::options::HttpOptions;
use crate::problem::{ApiError, Fault, ProblemBody, Result};
use railhead_contact::case::words::solver::{Case, Output};
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::rolling::task::Motion;
use railhead_contact::solution::words::answer::{
    ErrorEstimate, HistoryPoint, Origin, PatchPoint, Solution, Total, Zone,
};
use railhead_contact::solution::words::damage::ProfileUncertainty;
use railhead_jobs::model::{Batch, Job, Kind, Priority, QueuePlace, State as JobState};
use railhead_jobs::run::model::Run;
use railhead_tables::table::TableKind;
use railhead_tables::titles::TitledColumn;

/// A job. Times are RFC 3339 in UTC with milliseconds.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Job)]
pub(crate) struct JobAnswer {
    /// Identifier; sorts by time of submission.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// State of the job.
    state: JobState,
    /// Name of the case.
    name: Option<String>,
    /// Labels of the case.
    labels: BTreeMap<String, String>,
    /// The batch that the job belongs to; null for a job submitted alone.
    #[schema(format = "uuid")]
    batch_id: Option<String>,
    /// Priority among the tenant's queued jobs.
    priority: Priority,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// Time of the last change, except changes of progress.
    #[schema(format = "date-time")]
    updated_at: String,
    /// Start of the current or last attempt; null while queued.
    #[schema(format = "date-time")]
    started_at: Option<String>,
    /// End of the job; null before it.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// Time at which the job fails if it has not ended; null without a deadline.
    #[schema(format = "date-time")]
    deadline_at: Option<String>,
    /// Time at which the job and its result will be removed; null before the job ends, and if ended jobs are kept for ever.
    #[schema(format = "date-time")]
    expires_at: Option<String>,
    /// Number of attempts since the last slice of the job was stored, including the current one.
    attempt: u32,
    /// Whether the result is that of an identical earlier case, so that nothing was solved.
    cached: bool,
    /// Rough progress. A queued job keeps the progress of its stored slices.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Position in the queue; only in responses about one job that is queued and not too far behind.
    #[serde(skip_serializing_if = "Option::is_none")]
    queue: Option<QueuePlace>,
    /// Remarks to read before using the numbers; for a failed job those of the check of its case.
    remarks: Vec<RemarkEntry>,
    /// Why the job failed; null otherwise.
    error: Option<ProblemBody>,
    /// Links to related resources.
    links: BTreeMap<String, String>,
    /// The result; only for `Prefer: wait`, if the job succeeded in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    result: Option<JobResult>,
}

impl JobAnswer {
    /// Converts a job.
    #[must_use]
    pub(crate) fn new(job: Job) -> Self {
        let error = job
            .failure
            .as_ref()
            .map(|failure| ProblemBody::of_job(&job, failure));
        JobAnswer {
            id: job.id.to_string(),
            state: job.state,
            links: job_links(&job),
            name: job.name,
            labels: job.labels,
            batch_id: job.batch_id.map(|id| id.to_string()),
            priority: job.priority,
            created_at: rfc3339(job.created_at),
            updated_at: rfc3339(job.updated_at),
            started_at: job.started_at.map(rfc3339),
            ended_at: job.ended_at.map(rfc3339),
            deadline_at: job.deadline.map(rfc3339),
            expires_at: job.expires_at.map(rfc3339),
            attempt: job.attempt,
            cached: job.cached,
            progress: job.progress,
            queue: job.queue,
            remarks: job.remarks,
            error,
            result: None,
        }
    }
}

/// Returns the links of a job in its present state.
fn job_links(job: &Job) -> BTreeMap<String, String> {
    let (own, asked) = match job.kind {
        Kind::Evolution => (format!("/v1/evolutions/{}", job.id), "request"),
        _ => (format!("/v1/jobs/{}", job.id), "case"),
    };
    let own_state = match job.state {
        JobState::Succeeded => Some("result"),
        state => (!state.ended()).then_some("cancel"),
    };
    links(own, [asked, "events"].into_iter().chain(own_state))
}

/// Returns the path of a resource and the paths of its parts.
fn links<'a>(own: String, parts: impl IntoIterator<Item = &'a str>) -> BTreeMap<String, String> {
    let below = parts.into_iter();
    let below = below.map(|name| (name.to_owned(), format!("{own}/{name}")));
    let mut links: BTreeMap<String, String> = below.collect();
    links.insert("self".to_owned(), own);
    links
}

/// Formats milliseconds since 1970 as RFC 3339 in UTC, for example `2026-01-31T09:30:00.000Z`.
pub(crate) fn rfc3339(epoch_ms: i64) -> String {
    jiff::Timestamp::from_millisecond(epoch_ms)
        .map_or_else(|_| epoch_ms.to_string(), |time| format!("{time:.3}"))
}

/// The cases of a batch.
#[derive(ToSchema)]
#[schema(min_items = 1, max_items = 200_000)]
#[expect(
    dead_code,
    reason = "describes a body that is split into cases while it arrives"
)]
pub(crate) struct Cases(Vec<BatchElement>);

/// A case, alone or with its own options.
#[derive(ToSchema)]
#[serde(untagged)]
#[expect(
    dead_code,
    reason = "describes a body that is split into cases while it arrives"
)]
pub(crate) enum BatchElement {
    /// A case without options.
    Case(Case),
    /// A case with options that replace those of the batch.
    WithOptions(CaseWithOptions),
}

/// A case with options that replace those of its batch.
#[derive(ToSchema)]
#[expect(
    dead_code,
    reason = "describes a body that is split into cases while it arrives"
)]
pub(crate) struct CaseWithOptions {
    /// The case.
    case: Case,
    /// Priority among the tenant's queued jobs.
    #[schema(nullable = false)]
    priority: Option<Priority>,
    /// Seconds from now within which the job must end.
    #[schema(nullable = false, minimum = 1, maximum = 2_592_000)]
    deadline_s: Option<u32>,
}

/// An accepted batch, with the faults of the skipped cases.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchReceipt {
    #[serde(flatten)]
    pub batch: BatchAnswer,
    /// Faults of the first 1000 skipped cases; empty unless the request has `on_invalid=skip`.
    pub errors: Vec<Fault>,
}

/// A batch and its progress.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Batch)]
pub(crate) struct BatchAnswer {
    /// Identifier of the batch.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// State of the batch.
    state: BatchState,
    /// Free text given by the client.
    name: Option<String>,
    /// Labels of the batch; the labels of its cases are on the jobs.
    labels: BTreeMap<String, String>,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// End of the last job; null until every job has ended.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// Number of jobs in the batch.
    count: u32,
    /// Number of faulty cases that were skipped.
    rejected: u32,
    /// Number of jobs in each state.
    states: BatchStates,
    /// Share of the jobs that have ended.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// Whether every job has ended.
    pub ended: bool,
    /// Links to related resources.
    links: BTreeMap<String, String>,
}

/// State of a batch.
#[keyword]
pub(crate) enum BatchState {
    /// No job has begun.
    Queued,
    /// Some jobs have begun, and not all have ended.
    Running,
    /// Whether every job has ended.
    Ended,
}

/// Number of jobs in each state.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct BatchStates {
    queued: u64,
    running: u64,
    succeeded: u64,
    failed: u64,
    cancelled: u64,
}

impl From<&Batch> for BatchStates {
    fn from(batch: &Batch) -> Self {
        BatchStates {
            queued: batch.in_state(JobState::Queued),
            running: batch.in_state(JobState::Running),
            succeeded: batch.in_state(JobState::Succeeded),
            failed: batch.in_state(JobState::Failed),
            cancelled: batch.in_state(JobState::Cancelled),
        }
    }
}

impl From<Batch> for BatchAnswer {
    fn from(batch: Batch) -> Self {
        let (ended, all) = batch.ended();
        let progress = match all {
            0 => 1.0,
            _ => ended as f64 / all as f64,
        };
        let state = match (ended, batch.in_state(JobState::Running)) {
            (ended, _) if ended == all => BatchState::Ended,
            (0, 0) => BatchState::Queued,
            _ => BatchState::Running,
        };
        let ended_at = batch.last_ended_at.filter(|_| ended == all);
        BatchAnswer {
            id: batch.id.to_string(),
            state,
            created_at: rfc3339(batch.created_at),
            ended_at: ended_at.map(rfc3339),
            count: batch.count,
            rejected: batch.rejected,
            states: (&batch).into(),
            progress,
            ended: ended == all,
            links: batch_links(&batch),
            name: batch.name,
            labels: batch.labels,
        }
    }
}

fn batch_links(batch: &Batch) -> BTreeMap<String, String> {
    let own = format!("/v1/batches/{}", batch.id);
    let mut links = links(own, ["results", "cancel", "events"]);
    links.insert("jobs".to_owned(), format!("/v1/jobs?batch={}", batch.id));
    links
}

/// Rows to solve: a case, and columns of values that replace some of its members.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = RunRequest)]
#[allow(
    dead_code,
    reason = "describes a body that is read directly into columns"
)]
pub(crate) struct RunRequest {
    /// A case with one motion. Members that a column replaces may be omitted. Of `outputs` only `resultants`, `zones` and `gradients` are
    /// allowed.
    #[schema(value_type = Object)]
    template: Value,
    /// Columns of numbers or of texts, all of the same length. A JSON pointer such as `/load/normal_force_n` or a short name such as
    /// `normal_force_n` replaces a member of the case. Columns of places, times and sections, such as `km`, and those of `?carry=` are
    /// copied to the results; any other name is refused.
    columns: BTreeMap<String, Vec<CellValue>>,
}

/// A value of a column.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
#[allow(
    dead_code,
    reason = "describes a body that is read directly into columns"
)]
pub(crate) enum CellValue {
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

/// A run and its progress.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Run)]
pub(crate) struct RunAnswer {
    /// Identifier of the run.
    #[schema(value_type = String, format = "uuid")]
    id: String,
    /// State of the run. A cancelled run keeps the results that it has; a run is `failed` if no row could be tried.
    state: JobState,
    /// Free text given by the client.
    name: Option<String>,
    /// Labels of the client.
    labels: BTreeMap<String, String>,
    /// Time of submission.
    #[schema(format = "date-time", example = "2026-01-31T09:30:00.000Z")]
    created_at: String,
    /// End of the last row; null before it.
    #[schema(format = "date-time")]
    ended_at: Option<String>,
    /// The requested method.
    method: String,
    /// Number of rows.
    rows: u64,
    /// Number of rows that are finished.
    rows_done: u64,
    /// Number of finished rows without a result; the column `status` says why.
    rows_without_answer: u64,
    /// Completed share of the work.
    #[schema(minimum = 0.0, maximum = 1.0)]
    progress: f64,
    /// The chunks in which the rows are solved.
    chunks: RunChunks,
    /// The submitted columns.
    columns: Vec<SentColumn>,
    /// The result columns, in order.
    answers: Vec<AnswerColumn>,
    /// Links to related resources.
    links: BTreeMap<String, String>,
}

/// The chunks of a run.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct RunChunks {
    /// Number of chunks.
    count: u32,
    /// Rows of each chunk except the last.
    rows: u32,
    #[serde(flatten)]
    states: BatchStates,
}

/// A submitted column.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SentColumn {
    /// Name of the column.
    name: String,
    /// Member of the case that it replaces; null if it is copied to the results.
    pointer: Option<String>,
    /// Factor from the unit of the column to that of the case.
    factor: f64,
    /// Unit named in its title or in a line of units.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    unit: Option<String>,
}

/// A column of the results.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct AnswerColumn {
    /// Name of the column.
    name: String,
    /// Type of its values.
    kind: TableKind,
}

/// Returns the result columns of a run.
#[must_use]
pub(crate) fn answer_columns(run: &Run) -> Vec<AnswerColumn> {
    let columns = run.head.answers().into_iter();
    let column = |(name, kind)| AnswerColumn { name, kind };
    columns.map(column).collect()
}

impl From<Run> for RunAnswer {
    fn from(run: Run) -> Self {
        let state = run.state();
        let chunks = &run.chunks;
        let sent = |column: &TitledColumn| SentColumn {
            name: column.name.clone(),
            pointer: column.pointer.clone(),
            factor: column.factor,
            unit: column.unit.clone(),
        };
        let own = format!("/v1/runs/{}", chunks.id);
        let parts = ["results", "manifest", "totals", "cancel", "events"];
        let links = links(own, parts);
        RunAnswer {
            id: chunks.id.to_string(),
            state,
            created_at: rfc3339(chunks.created_at),
            ended_at: chunks.last_ended_at.filter(|_| state.ended()).map(rfc3339),
            method: run.head.method.clone(),
            rows: run.head.rows,
            rows_done: run.rows_done(),
            rows_without_answer: run.without_answer,
            progress: run.progress,
            chunks: RunChunks {
                count: chunks.count,
                rows: run.head.chunk_rows,
                states: chunks.into(),
            },
            columns: run.head.columns.iter().map(sent).collect(),
            answers: answer_columns(&run),
            links,
            name: run.chunks.name,
            labels: run.chunks.labels,
        }
    }
}

/// The result of a job: the solution without its fields, and links to them.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobResult {
    #[serde(flatten)]
    solution: Solution,
    /// Whether the result is that of an identical earlier case; `seconds` then refer to that solve.
    cached: bool,
    /// Links to the job and to every part of the result that the case requested.
    links: BTreeMap<String, String>,
}

impl JobResult {
    /// Returns the JSON that replaces the closing brace of the stored solution.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub(crate) fn tail(id: Uuid, cached: bool, outputs: &[Output]) -> Result<String> {
        let outputs: Vec<&str> = outputs.iter().copied().map(Output::name).collect();
        let links = serde_json::to_string(&JobResult::links(id, &outputs));
        let links = links.map_err(ApiError::internal)?;
        Ok(format!(",\"cached\":{cached},\"links\":{links}}}"))
    }

    /// Returns the links of the result of a job whose case requests these outputs.
    #[must_use]
    pub(crate) fn links(id: Uuid, outputs: &[impl AsRef<str>]) -> BTreeMap<String, String> {
        let own = format!("/v1/jobs/{id}");
        let mut links = BTreeMap::from([("resultants".to_owned(), format!("{own}/resultants"))]);
        // Gradients are a part of the resultants.
        let own_parts = outputs.iter().map(AsRef::as_ref);
        for name in own_parts.filter(|name| *name != Output::Gradients.name()) {
            links.insert(name.to_owned(), format!("{own}/{name}"));
            let small = [Output::Resultants, Output::Subsurface, Output::Damage].map(Output::name);
            if !small.contains(&name) {
                links.insert("fields".to_owned(), format!("{own}/fields"));
            }
        }
        links.insert("job".to_owned(), own);
        links
    }
}

/// Limits of the requests of the tenant.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct TenantLimits {
    /// Largest number of concurrent requests of the tenant, not counting event streams and waits.
    requests_max: usize,
    /// Largest number of event streams of the tenant.
    streams_max: usize,
    /// Largest number of requests of the tenant that wait for work to end.
    waits_max: usize,
    /// Requests per second of one key, or of one address without a key; 0: no limit.
    requests_per_second: u32,
}

impl TenantLimits {
    /// Returns the limits of every tenant.
    #[must_use]
    pub(crate) fn of(options: &HttpOptions) -> TenantLimits {
        TenantLimits {
            requests_max: options.tenant_requests_max,
            streams_max: options.tenant_streams_max,
            waits_max: options.tenant_waits_max,
            requests_per_second: options.requests_per_second,
        }
    }
}

/// Forces and moments.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct Resultants {
    /// One entry per contact patch, or only the requested one.
    pub patches: Vec<PatchResultants>,
    /// One entry per motion, or only the requested one: plain sums over all patches.
    pub total: Vec<Total>,
    /// Reference point of the moments.
    pub origin: Origin,
}

/// Forces and moments of one patch.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PatchResultants {
    /// Index of the patch, from 0.
    pub patch: usize,
    /// Normal force in N under the first motion.
    pub normal_force_n: f64,
    /// One entry per motion, or only the requested one.
    pub points: Vec<PointResultants>,
}

/// Forces and moment on the lower body, for one patch and one motion.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct PointResultants {
    /// Index of the motion or of the position of the wheelset, from 0.
    pub point: usize,
    /// The motion.
    pub motion: Motion,
    /// Normal force in N.
    pub normal_force_n: f64,
    /// Longitudinal force in N.
    pub force_x_n: f64,
    /// Lateral force in N.
    pub force_y_n: f64,
    /// Moment about the origin in N·mm.
    pub moment_z_n_mm: f64,
    /// Estimated absolute errors; null if they cannot be estimated.
    pub error_estimate: Option<ErrorEstimate>,
    /// Uncertainty due to the measured profiles; only for `profiles`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<ProfileUncertainty>)]
    pub profile_uncertainty: Option<Box<ProfileUncertainty>>,
    /// Dissipated power divided by rolling speed, in N.
    pub friction_power_n: f64,
    /// Friction power without the part of spin, |ν_x F_x| + |ν_y F_y|, in N.
    pub friction_power_without_spin_n: f64,
    /// Whether a prescribed force could not be reached.
    pub saturated: bool,
    /// Additional values of a history; only for `motion.history`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<HistoryPoint>, nullable = false)]
    pub history: Option<Box<HistoryPoint>>,
}

impl PointResultants {
    fn of_patch(motion: usize, part: &PatchPoint<'_>) -> PointResultants {
        let point = part.point;
        PointResultants {
            point: motion,
            motion: point.motion,
            normal_force_n: part.region.normal_force_n,
            force_x_n: point.force_x_n,
            force_y_n: point.force_y_n,
            moment_z_n_mm: point.moment_z_n_mm,
            error_estimate: point.error_estimate,
            profile_uncertainty: point.profile_uncertainty.map(Box::new),
            friction_power_n: point.friction_power_n,
            friction_power_without_spin_n: point.friction_power_without_spin_n,
            saturated: point.saturated,
            history: point.history.map(Box::new),
        }
    }

    /// Returns the sums over all patches for a motion; `None` without patches.
    #[must_use]
    pub(crate) fn total(solution: &Solution, motion: usize) -> Option<PointResultants> {
        let parts = || solution.at(motion);
        let sum = |of: fn(&PatchPoint<'_>) -> f64| parts().map(|part| of(&part)).sum();
        let total = solution.total.get(motion)?;
        let first = PointResultants::of_patch(motion, &parts().next()?);
        Some(PointResultants {
            normal_force_n: sum(|part| part.region.normal_force_n),
            force_x_n: total.force_x_n,
            force_y_n: total.force_y_n,
            moment_z_n_mm: total.moment_z_n_mm,
            error_estimate: total.error_estimate,
            friction_power_n: sum(|part| part.point.friction_power_n),
            friction_power_without_spin_n: sum(|part| part.point.friction_power_without_spin_n),
            saturated: parts().any(|part| part.point.saturated),
            history: first.history.map(|history| {
                Box::new(HistoryPoint {
                    dissipated_n_mm: parts()
                        .filter_map(|part| Some(part.point.history?.dissipated_n_mm))
                        .sum(),
                    ..*history
                })
            }),
            ..first
        })
    }
}

impl Resultants {
    /// Returns forces and moments of a solution, of one patch or all patches, for one motion or all motions.
    #[must_use]
    pub(crate) fn select(
        solution: Solution,
        point: Option<usize>,
        patch: Option<usize>,
    ) -> Resultants {
        let motions = point.map_or(0..solution.total.len(), |point| point..point + 1);
        let mut patches = BTreeMap::new();
        for number in motions.clone() {
            let parts = solution.at(number);
            for part in parts.filter(|part| patch.is_none_or(|patch| patch == part.number)) {
                let own = patches.entry(part.number);
                let own = own.or_insert_with(|| PatchResultants {
                    patch: part.number,
                    normal_force_n: part.patch.normal_force_n,
                    points: Vec::new(),
                });
                own.points.push(PointResultants::of_patch(number, &part));
            }
        }
        Resultants {
            patches: patches.into_values().collect(),
            total: solution.total[motions].to_vec(),
            origin: solution.origin,
        }
    }
}

/// Closed polygons as lists of `[x, y]` in mm; the last point is joined to the first. Outer borders run
/// counter-clockwise, holes clockwise.
#[none_is_absent(nullable)]
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub(crate) struct Outlines {
    /// The border of the patch.
    pub patch: Vec<Vec<[f64; 2]>>,
    /// Borders of the stick zones; only with zones.
    pub stick: Option<Vec<Vec<[f64; 2]>>>,
    /// Borders of the slip zones; only with zones.
    pub slip: Option<Vec<Vec<[f64; 2]>>>,
}

/// Values per cell, strip by strip by increasing y, and within a strip by increasing x. All arrays have the same length; those of other
/// fields are absent.
#[none_is_absent(nullable)]
#[derive(Serialize, ToSchema)]
pub(crate) struct Cells {
    /// Centre of the cell along x in mm.
    pub x_mm: Vec<f64>,
    /// Centre of the cell along y in mm.
    pub y_mm: Vec<f64>,
    /// Width of the cell along x in mm.
    pub dx_mm: Vec<f64>,
    /// Width of the cell along y in mm.
    pub dy_mm: Vec<f64>,
    /// Index of the strip, from 0.
    pub strip: Vec<u32>,
    /// Stick or slip.
    pub zone: Option<Vec<Zone>>,
    /// Pressure in MPa.
    pub pressure_mpa: Option<Vec<f64>>,
    /// Traction on the lower body along x in MPa.
    pub traction_x_mpa: Option<Vec<f64>>,
    /// Traction on the lower body along y in MPa.
    pub traction_y_mpa: Option<Vec<f64>>,
    /// Slip along x, divided by rolling speed.
    pub slip_x: Option<Vec<f64>>,
    /// Slip along y, divided by rolling speed.
    pub slip_y: Option<Vec<f64>>,
    /// Temperature of both surfaces in °C.
    pub temperature_c: Option<Vec<f64>>,
}

/// Values on a regular grid over the bounding box of the patch: `values[iy][ix]` at `(x_mm[ix], y_mm[iy])`, null outside the patch. Arrays
/// of other fields are absent.
#[none_is_absent(nullable)]
#[derive(Serialize, ToSchema)]
pub(crate) struct GriddedField {
    /// Index of the patch, from 0.
    pub patch: usize,
    /// Index of the motion, from 0.
    pub point: usize,
    /// The border of the patch, and of its zones if included.
    pub outlines: Outlines,
    /// Samples along x in mm, ascending.
    pub x_mm: Vec<f64>,
    /// Samples along y in mm, ascending.
    pub y_mm: Vec<f64>,
    /// Stick or slip.
    pub zone: Option<Vec<Vec<Option<Zone>>>>,
    /// Pressure in MPa.
    pub pressure_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body along x in MPa.
    pub traction_x_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body along y in MPa.
    pub traction_y_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Slip along x, divided by rolling speed.
    pub slip_x: Option<Vec<Vec<Option<f64>>>>,
    /// Slip along y, divided by rolling speed.
    pub slip_y: Option<Vec<Vec<Option<f64>>>>,
    /// Temperature of both surfaces in °C.
    pub temperature_c: Option<Vec<Vec<Option<f64>>>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_milliseconds_and_are_in_utc() {
        assert_eq!(rfc3339(1_769_851_800_000), "2026-01-31T09:30:00.000Z");
        assert_eq!(rfc3339(1_769_851_800_007), "2026-01-31T09:30:00.007Z");
    }
}
