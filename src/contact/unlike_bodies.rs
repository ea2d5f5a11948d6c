//! Region and pressure of motions of dissimilar bodies: pressure and tractions are iterated until they agree.
//!
//! The pressure of dissimilar bodies causes slip, and their tractions open and close the gap. Each round solves the tractions with the slips of the present pressure,
//! changes the gap by the opening, and solves for region and pressure again (Panagiotopoulos 1975). It leaves a hundredth to a fifth of the previous change. The first
//! round starts from the contact of a neighbouring motion, or from the one without tractions. Each motion has its own region and pressure.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::error::SolveError;
use crate::half_space::bent_surface::BentWorkspace;
use crate::half_space::unlike_bodies::opening;
use crate::mesh::MeshSize;
use crate::monitor::Monitor;
use crate::normal::footprint::NormalTask;
use crate::normal::gap::grid::GridFineness;
use crate::normal::gap::surface::{GapSurface, around};
use crate::normal::gap::task::GapTask;
use crate::normal::hertz::{Ellipse, NormalLoad};
use crate::normal_stage::SolvedFootprint;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::answer::Resultants;
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::refinement::interpolate::RefinementState;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{Resolution, RollingTask, TARGET_USUAL};
use crate::rolling::{force_control, history};
use crate::slices::joined;
use crate::solution::words::answer::{Fields, NormalReport, PatchSolution, Solution};
use crate::time_limit::TimeLimit;
use crate::{normal_stage, rolling_stage};

/// Mesh of the rounds where bodies are only pressed together: approaches of the three contacts of `tests/physics/pressing.rs` are within 0.03 % of
/// those with 48 × 48 already on 16 × 16.
const MESH_OF_PRESSING: MeshSize = MeshSize {
    strips: 20,
    cells: 20,
};
/// Largest number of rounds; three suffice up to |K| = 0.25.
const ROUNDS_MAX: usize = 6;
/// Remaining change after a round over the change of the round. The largest contraction observed is 0.2.
const LEFT: f64 = 0.25;
/// Error of forces relative to μN over |K| due to region and pressure, whose edges follow from the tractions of a mesh (12 contacts of `tests/physics/unlike.rs`: at most
/// 0.022 in free rolling, 0.009 elsewhere).
pub(crate) const LEFT_BY_PRESSURE: f64 = 0.02;
/// Largest remaining change over the target. Chosen by judgement.
const PART_OF_TARGET: f64 = 0.3;
/// Samples of the opening along each axis, over and around the patches; beyond them the opening is constant. It is smooth except at the edges of the cells. On the 12
/// contacts of `tests/physics/unlike.rs` 81 samples change forces by at most 0.0014 of μN; 25 take half the time, but the estimate of one contact no longer covers its error.
const SAMPLES: usize = 41;
/// Reach of the parabola across for an ellipse over its semi-axis, which is the distance of its samples. Parabolas are reproduced exactly.
const REACH: i32 = 6;

/// A gap between bodies that differ, and its contact without tractions.
#[derive(Debug)]
pub(crate) struct UnlikeGap {
    /// The gap of the undeformed bodies and their load.
    pub(crate) task: GapTask,
    /// Region and pressure without tractions.
    pub(crate) without: SolvedFootprint,
}

impl UnlikeGap {
    /// The gap of a case with radii, an ellipse or a gap.
    ///
    /// # Errors
    /// The reason why there is no contact without tractions; or the monitor stopped the work.
    pub(crate) fn of_case(
        case: &CheckedCase,
        monitor: &dyn Monitor,
    ) -> Result<UnlikeGap, SolveError> {
        Ok(UnlikeGap {
            task: gap_task(case),
            without: normal_stage::solve(case, monitor)?,
        })
    }

    /// Region and pressure of a case of one motion, starting from those of a `neighbour` if there is one.
    ///
    /// # Errors
    /// The reason why there is no solution; or the monitor stopped the work.
    pub(crate) fn solve(
        &self,
        operators: &Arc<OperatorStore>,
        case: &CheckedCase,
        neighbour: Option<&SolvedFootprint>,
        watch: &TimeLimit,
    ) -> Result<SolvedFootprint, SolveError> {
        let began = watch.elapsed();
        let rough = rough(case);
        let target = case.run.resolution.target_or_usual();
        let mut fineness = GridFineness::for_answer(case.run.target());
        if case.problem.history.is_some() {
            // Finer grids would only resolve the coarse cells of the tractions. The contact without tractions shows whether the gap is rough.
            fineness = fineness.alone();
        }
        let workspace = &mut BentWorkspace::default();
        let mut found: Option<SolvedFootprint> = None;
        let mut before = None;
        let mut left = f64::INFINITY;
        for _ in 0..ROUNDS_MAX {
            let present = found.as_ref().or(neighbour).unwrap_or(&self.without);
            let (gap, force) = opened(operators, &rough, present, &self.task, watch)?;
            let change = before.map(|before| distance(before, force));
            before = Some(force);
            let task = GapTask {
                gap,
                ..self.task.clone()
            };
            found = Some(normal_stage::solve_gap(
                case, &task, fineness, workspace, watch,
            )?);
            if let Some(change) = change {
                left = LEFT * change;
                if left <= PART_OF_TARGET * target {
                    break;
                }
            }
        }
        let Some(mut solved) = found else {
            unreachable!("there is a first round")
        };
        solved.coupling_error = left.hypot(LEFT_BY_PRESSURE * case.problem.elasticity.difference);
        if left > PART_OF_TARGET * target {
            let remark = rounds_used_up(left, PART_OF_TARGET * target);
            solved.remarks.push(remark.into());
        }
        let rough = RemarkEntry::from(Remark::GapRough {});
        if self.without.remarks.contains(&rough) {
            solved.remarks.push(rough);
        }
        let mut seconds = watch.elapsed().saturating_sub(began).as_secs_f64();
        if neighbour.is_none() {
            seconds += self.without.report.map_or(0.0, |report| report.seconds);
        }
        solved.report = solved
            .report
            .map(|report| NormalReport { seconds, ..report });
        Ok(solved)
    }
}

/// The case as solved in the rounds, for resultants only and with their accuracy.
fn rough(case: &CheckedCase) -> CheckedCase {
    let mut rough = CheckedCase {
        // An error of the tractions changes the opening by K times as much.
        run: case.run.for_resultants(TARGET_USUAL),
        ..case.clone()
    };
    if case.problem.history.is_some() {
        rough.run.resolution = Resolution::Mesh(MESH_OF_PRESSING);
    }
    rough
}

fn rounds_used_up(residual: f64, tolerance: f64) -> Remark {
    Remark::IterationInexact {
        iteration: "pressure and tractions of unlike bodies",
        reason: "the iteration limit was reached",
        residual,
        tolerance,
    }
}

/// The gap of a case with its load; that of an ellipse is a paraboloid.
fn gap_task(case: &CheckedCase) -> GapTask {
    let modulus = case.problem.elasticity.contact_modulus();
    let ellipse = match &case.problem.task {
        NormalTask::Gap(task) => return task.as_ref().clone(),
        NormalTask::Hertz(ellipse) => *ellipse,
        NormalTask::Given(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_) => {
            unreachable!("the gap of a coupled problem is known")
        }
    };
    let load = case.label.asked.load;
    let loading = match load.and_then(|load| load.approach_mm) {
        Some(approach) => NormalLoad::Approach(approach),
        None => NormalLoad::Force(ellipse.normal_force),
    };
    GapTask {
        gap: paraboloid(&ellipse, modulus),
        loading,
        contact_modulus: modulus,
    }
}

/// The gap of a Hertzian ellipse.
fn paraboloid(ellipse: &Ellipse, modulus: f64) -> GapSurface {
    let [along, across] = ellipse.curvatures(modulus);
    let y: Vec<f64> = (-REACH..=REACH).map(|k| ellipse.b * f64::from(k)).collect();
    let gap: Vec<f64> = y.iter().map(|y| across * y * y).collect();
    GapSurface::profile(0.5 / along, &y, &gap)
}

/// The gap with the opening by the tractions under a pressure, and the force of the tractions over the friction limit; where bodies are only pressed together, the result of
/// [`pressed_out`].
fn opened(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    solved: &SolvedFootprint,
    task: &GapTask,
    watch: &TimeLimit,
) -> Result<(GapSurface, [f64; 2]), SolveError> {
    let rolling = RollingTask {
        // Smooth slips come with the tractions of the three-point rule.
        wants_slips: true,
        ..case.rolling_task(&solved.footprint)
    };
    if let Some(reason) = rolling.falls_too_fast() {
        return Err(SolveError::NotCovered { reason });
    }
    let mut state = RefinementState::new(&rolling, operators);
    let point = match &case.problem.history {
        None => Some(force_control::solve(&rolling, &mut state, 0, watch)?),
        Some(history) => history::solve::solve(&rolling, history, &mut state, watch)?.pop(),
    };
    let Some((point, fields)) = point.as_ref().and_then(|p| Some((p, p.fields.as_ref()?))) else {
        unreachable!("the method that couples has fields")
    };
    let level = state.levels.get(fields.level);
    let limit = case.problem.friction.limit_of_all(&solved.footprint);
    let force = match case.problem.history {
        None => {
            let sum = Resultants::default();
            let sum = point.resultants.iter().fold(sum, |sum, r| sum.plus(*r));
            [sum.force_x / limit, sum.force_y / limit]
        }
        Some(_) => pressed_out(&level, &fields.tangential.traction, limit),
    };
    let elasticity = &case.problem.elasticity;
    let unit = level.scale.traction / elasticity.shear_modulus;
    // The tractions of the three-point rule are smooth, those of the trapezoid rule alternate where they stick.
    let found = &fields.tangential;
    let traction = found.second.as_ref().unwrap_or(&found.traction);
    let traction = [0, 1].map(|k| traction[k].iter().map(|t| t * unit).collect::<Vec<f64>>());
    let mut extent = [
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ];
    for patch in solved.footprint.patches() {
        for k in [0, 2] {
            extent[k] = extent[k].min(patch.extent[k]);
            extent[k + 1] = extent[k + 1].max(patch.extent[k + 1]);
        }
    }
    let limits = task.gap.window();
    let [x, y] = [0, 1].map(|k| around([extent[2 * k], extent[2 * k + 1]], limits[k], SAMPLES));
    let mut rows = Vec::with_capacity(y.len());
    for y in &y {
        if let ControlFlow::Break(stop) = watch.tick(0.0) {
            return Err(stop.into());
        }
        let at = |x: &f64| opening(&level.mesh, elasticity.difference, &traction, [*x, *y]);
        rows.push(x.iter().map(at).collect());
    }
    Ok((task.gap.changed(&x, &y, &rows), force))
}

/// Sums of the sizes of the tractions of a pressing along x and across, over the friction limit. Their forces balance.
fn pressed_out(level: &StripMesh, traction: &[Vec<f64>; 2], limit: f64) -> [f64; 2] {
    let unit = level.scale.traction / limit;
    [0, 1].map(|k| {
        let cells = level.area.iter().zip(&traction[k]);
        unit * cells.map(|(area, t)| area * t.abs()).sum::<f64>()
    })
}

fn distance([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    (a - c).hypot(b - d)
}

/// Solves every motion of a case in a gap; region and pressure of each start from those of the previous motion. The patches of the solution are those of the first motion;
/// with several motions, each point has its own region.
///
/// # Errors
/// The reason why a motion has no solution; or the monitor stopped the work.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    gap: &UnlikeGap,
    watch: &TimeLimit,
) -> Result<(Solution, Fields), SolveError> {
    let several = case.problem.part.all > 1;
    let mut neighbour: Option<SolvedFootprint> = None;
    joined((0..case.problem.motions.len()).map(|index| {
        let part = case.slice(index..index + 1);
        let solved = gap
            .solve(operators, &part, neighbour.as_ref(), watch)
            .map_err(|error| watch.explained(error, &part))?;
        let solved = if several {
            with_patches_of(gap, solved, &part)
        } else {
            solved
        };
        let (mut solution, fields) = rolling_stage::solve(operators, &part, &solved, watch)?;
        if several {
            solution.patches.iter_mut().for_each(tell_region);
        }
        neighbour = Some(solved);
        Ok::<_, SolveError>((solution, fields))
    }))
}

/// The contact of a motion with as many patches as without tractions, because a solution has one list of patches. If tractions divide or join patches, the motion is solved
/// on the patches without tractions, with a remark.
fn with_patches_of(
    gap: &UnlikeGap,
    solved: SolvedFootprint,
    part: &CheckedCase,
) -> SolvedFootprint {
    let count = |solved: &SolvedFootprint| solved.footprint.patches().len();
    let number = part.problem.part.before;
    let seconds = solved.report.map_or(0.0, |report| report.seconds);
    let mut kept = solved;
    if count(&kept) != count(&gap.without) {
        kept = gap.without.clone();
        kept.coupling_error = part.problem.first_order_error(part.run.method);
        let remark = part.problem.first_order_remark(part.run.method);
        kept.remarks.push(remark.into());
    }
    if let Some(report) = &mut kept.report {
        report.seconds = seconds;
    }
    kept.remarks
        .iter_mut()
        .for_each(|remark| remark.point = Some(number));
    kept
}

/// Writes region and pressure of a patch to the point of its only motion.
pub(crate) fn tell_region(patch: &mut PatchSolution) {
    let region = patch.region();
    for point in &mut patch.points {
        point.region = Some(Box::new(region));
    }
}
