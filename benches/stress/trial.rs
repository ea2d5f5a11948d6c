//! Solves a case with a time limit, and checks the answer in several ways.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use cpu_time::ThreadTime;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::{Monitor, Stop};
use railhead_contact::solution::words::answer::{Fields, Solution};
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use super::contacts::{Sample, reversed, scaled};
use super::laws::{broken, difference, energy, relative};

/// A solve that takes longer is considered to hang.
const HANGS_AFTER: Duration = Duration::from_secs(60);
/// Allowed difference of the forces of twins on one mesh, due to the residuals of the iterations.
const TWINS: f64 = 2e-5;
/// Allowed difference where region and pressure are found first, as accurately as a mesh needs them.
const TWINS_OF_GAPS: f64 = 3e-3;
/// Allowed difference where a remark says that patches are coarse or the gap is rough. The last bit decides which grid of some hundred cells is the
/// last one, and therefore whether neighbouring asperities are one patch.
const TWINS_OF_ROUGH_GAPS: f64 = 3e-2;
const ROUGH: [&str; 2] = ["patch-coarse", "gap-rough"];
/// Factor between the lengths of a case and its twin. `LENGTH_MAX` is the largest allowed length in mm.
const UNIT: f64 = 37.0;
const LENGTH_MAX: f64 = 1e6;
/// Maximum number of cells for which the method of Liu and Hsu is also tried.
const DENSE_CELLS_MAX: u64 = 120;
/// Factor by which the target of the finer answer is smaller.
const FINER: f64 = 8.0;

/// The outcome of a case.
#[derive(Default)]
pub enum End {
    #[default]
    Solved,
    /// The case has no answer, with the reason.
    Refused(String),
    NotConverged(String),
    /// A crash, a hang or an unexpected error.
    Failed(String),
}

/// Result of one case.
#[derive(Default)]
pub struct Trial {
    pub end: End,
    pub iterations: Option<u32>,
    pub residual: Option<f64>,
    pub broken: Vec<String>,
    pub energy: Option<f64>,
    /// Largest difference of the forces from those of the method of Liu and Hsu on the same mesh.
    pub from_liu_hsu: Option<f64>,
    /// True error and its estimate.
    pub error: Option<(f64, f64)>,
    /// Actual and expected processor seconds.
    pub times: Option<[f64; 2]>,
}

struct Clock(Instant);

impl Monitor for Clock {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        if self.0.elapsed() > HANGS_AFTER {
            return ControlFlow::Break(Stop::OutOfTime);
        }
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

fn attempt(case: &Value) -> Result<(Solution, Fields), End> {
    attempt_timed(case).map(|(answer, _)| answer)
}

/// Returns the answer to a case, with its actual and expected processor seconds.
pub fn attempt_timed(case: &Value) -> Result<((Solution, Fields), [f64; 2]), End> {
    let limits = Limits {
        memory_bytes: 4 << 30,
        ..Limits::default()
    };
    let work = || -> Result<((Solution, Fields), [f64; 2]), End> {
        let checked = check(case, &limits).map_err(|error| End::Refused(error.to_string()))?;
        let began = ThreadTime::now();
        let answer = solve(&checked, &Clock(Instant::now())).map_err(|error| match error {
            SolveError::NormalProblem { reason } => End::Refused(reason),
            SolveError::Unmeshable { .. } => End::Refused(error.to_string()),
            SolveError::NotConverged { .. } => End::NotConverged(error.to_string()),
            error => End::Failed(format!("hangs: {error}")),
        })?;
        Ok((
            answer,
            [began.elapsed().as_secs_f64(), checked.cost().seconds],
        ))
    };
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(End::Failed("crashes".to_owned())))
}

/// Solves a sample and all cases that it is compared with.
pub fn trial(sample: &Sample) -> Trial {
    let mut trial = Trial::default();
    let (solution, fields) = match attempt_timed(&sample.case) {
        Ok((answer, times)) => {
            trial.times = Some(times);
            answer
        }
        Err(end) => {
            trial.end = end;
            return trial;
        }
    };
    let reports = solution.patches.iter().map(|p| &p.points[0].solver);
    trial.iterations = reports.clone().map(|report| report.iterations).max();
    trial.residual = reports.map(|report| report.residual).reduce(f64::max);
    trial.broken = broken(&sample.case, &solution, &fields);
    trial.energy = energy(&solution, &fields);
    if sample.kind == "ellipse, huge mesh" {
        return trial;
    }
    let found = relative(&sample.case, &solution);
    if sample.number.is_multiple_of(4) {
        let rough = |solution: &Solution| {
            let codes = solution.remarks.iter().map(|remark| remark.code.as_str());
            codes.into_iter().any(|code| ROUGH.contains(&code))
        };
        let of_gap = if rough(&solution) {
            TWINS_OF_ROUGH_GAPS
        } else {
            TWINS_OF_GAPS
        };
        trial
            .broken
            .extend(twins(&sample.case, found, of_gap, sample.number));
    }
    let solver = &sample.case["solver"];
    let cells = solver["mesh"]["strips"]
        .as_u64()
        .zip(solver["mesh"]["cells"].as_u64());
    if let Some((strips, cells)) = cells
        && strips * cells <= DENSE_CELLS_MAX
        && sample.number.is_multiple_of(3)
    {
        let mut dense = sample.case.clone();
        dense["solver"]["method"] = json!("liu_hsu");
        if let Ok((other, _)) = attempt(&dense) {
            trial.from_liu_hsu = Some(distance(found.0, relative(&dense, &other).0));
        }
    }
    if let Some(target) = solver["target_error"].as_f64()
        && sample.number % 5 == 1
    {
        let mut finer = sample.case.clone();
        finer["solver"] = json!({ "target_error": (target / FINER).max(3e-4) });
        finer["outputs"] = json!(["resultants"]);
        if let Ok((exact, _)) = attempt(&finer) {
            let error = difference(&finer, &solution, &exact);
            trial.error = Some((error, found.1 + relative(&finer, &exact).1));
        }
    }
    trial
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Returns the largest length in mm in a case.
fn longest(case: &Value) -> f64 {
    fn within(value: &Value, length: bool) -> f64 {
        match value {
            Value::Object(members) => {
                let all = members
                    .iter()
                    .map(|(name, v)| within(v, name.ends_with("_mm")));
                all.fold(0.0, f64::max)
            }
            Value::Array(elements) => elements
                .iter()
                .map(|v| within(v, length))
                .fold(0.0, f64::max),
            Value::Number(number) if length => number.as_f64().unwrap_or(0.0).abs(),
            _ => 0.0,
        }
    }
    within(&case["contact"], false)
}

/// Checks that the contact reversed and in other units gives the same forces.
fn twins(
    case: &Value,
    (found, estimate): ([f64; 3], f64),
    twins_of_gap: f64,
    number: usize,
) -> Vec<String> {
    let (name, twin, sign) = if number.is_multiple_of(8) {
        ("reversed", reversed(case), -1.0)
    } else {
        // The lengths are divided by `UNIT` where their product would exceed the allowed lengths.
        let unit = if longest(case) * UNIT < LENGTH_MAX {
            UNIT
        } else {
            1.0 / UNIT
        };
        ("in other units", scaled(case, unit, 1.23e-4), 1.0)
    };
    let of_gap = case["contact"]["type"]
        .as_str()
        .is_some_and(|t| t.starts_with("gap"));
    let searched = case["motion"]
        .as_object()
        .is_some_and(|m| m.keys().any(|k| k.starts_with("force")));
    let same_mesh = if of_gap { twins_of_gap } else { TWINS };
    // With a target, an estimate near the target may stop the refinement one mesh earlier or later.
    let climbs = case["solver"]["mesh"].is_null() || searched;
    let allowed = same_mesh + if climbs { 2.0 * estimate } else { 0.0 };
    match attempt(&twin) {
        Ok((solution, _)) => {
            let other = relative(&twin, &solution).0.map(|value| sign * value);
            let apart = distance(found, other);
            if apart > allowed {
                vec![format!(
                    "{name}: {other:?} for {found:?}, {apart:.2e} apart"
                )]
            } else {
                Vec::new()
            }
        }
        Err(End::Failed(reason) | End::NotConverged(reason) | End::Refused(reason)) => {
            vec![format!("{name}: {reason}")]
        }
        Err(End::Solved) => Vec::new(),
    }
}
