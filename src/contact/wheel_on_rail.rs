//! Solves a wheel on a rail: brings the wheel to rest, solves the patches one after the other, and lets friction share
//! in the vertical load.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::forecast::{can_forecast, forecast, motion_in};
use crate::contact::friction::on_rail::in_frame;
use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::frame::SurfaceMissed;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::footprint::Footprint;
use crate::contact::normal::wheel_height::search::HeightStart;
use crate::contact::normal::wheel_height::task::{
    Accuracy, NormalPass, ReferenceSurface, WheelLoad, WheelTask,
};
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};
use crate::contact::normal_stage::SolvedFootprint;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::run::Run;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::rolling_stage;
use crate::contact::solution::track_axes::in_track;
use crate::contact::solution::words::answer::{NormalReport, Solution};
use crate::contact::solution::words::fields::Fields;
use crate::contact::time_limit::TimeLimit;
use crate::contact::vertical_equilibrium::{
    BALANCE, EquilibriumExit, ROUNDS_MAX, next_share, tolerance,
};
use crate::contact::wheel_on_curve;

/// Least fraction of the vertical part of its normal forces that a wheel carries; on a steep flange friction may take away all of it. Chosen by
/// judgement; how much it matters was not measured.
const CARRIED_MIN: f64 = 0.1;
/// Allowed error of the resultants in the first round, relative to μN. Chosen by judgement; how much it matters was not measured.
const TARGET_FIRST: f64 = 0.05;
/// Tolerance of the force at the first height: friction's share hardly depends on it.
const TOLERANCE_FIRST: f64 = 0.1;

/// Solves a problem whose region is a wheel on a rail.
///
/// A vertical force is balanced by the normal and the tangential forces together if the case has one motion: friction's share
/// is found on a coarse mesh, the wheel brought to rest again, and so on until the share is what it was taken for. Several
/// motions share their patches, as the points of a history do, so that only normal forces balance then; a remark says so. `near` is the
/// wheel at rest with nearly the same profiles, if that is known.
///
/// # Errors
/// A named reason why there is no answer, with what `judge` says of it.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    near: Option<&WheelContact>,
    judge: &mut dyn Judge,
    monitor: &dyn Monitor,
) -> Result<SolvedWheel, SolveError> {
    if let ReferenceSurface::Curve { influence, .. } = contact.surface {
        let before = &mut |wheel: &WheelContact| judge.before(wheel);
        let found = wheel_on_curve::solve(operators, case, contact, influence, before, monitor);
        let (wheel, solution, fields) = found?;
        return Ok(SolvedWheel {
            wheel,
            solution,
            fields,
        });
    }
    let search = contact
        .search()
        .map_err(|reason| SolveError::NormalProblem { reason })?;
    let vertical = matches!(contact.loading, WheelLoad::Vertical(_))
        && !case.problem.friction.is_frictionless();
    let mut solve = WheelSolve {
        operators,
        case,
        contact,
        near,
        search,
        balanced: vertical && case.problem.part.all == 1 && case.problem.history.is_none(),
        judge,
        monitor,
    };
    let workspace = &mut GridWorkspace::default();
    if solve.balanced {
        return solve.balance(workspace);
    }
    let start = solve.near.map(|near| solve.start_near(near));
    let mut at_rest = solve.rest(solve.exactly(0.0), start.unwrap_or_default(), workspace)?;
    let answers = solve.answers(&at_rest, &case.run)?;
    if vertical {
        let remark = Remark::NormalForcesAloneBalance {};
        at_rest.wheel.remarks.push(remark.into());
    }
    at_rest.found(case, contact, answers)
}

/// Whether a wheel comes to rest on the curve of its rail without tractions. There is no such question on planes.
///
/// # Errors
/// Why it does not; or what `judge` has against it.
pub(crate) fn comes_to_rest(
    case: &CheckedCase,
    contact: &WheelTask,
    judge: &mut dyn Judge,
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    let ReferenceSurface::Curve { influence, .. } = contact.surface else {
        return Ok(());
    };
    let before = &mut |wheel: &WheelContact| judge.before(wheel);
    wheel_on_curve::patches_at_rest(case, contact, influence, before, monitor)?;
    Ok(())
}

/// Who judges a wheel at rest before and after its motions are solved.
pub(crate) trait Judge {
    /// Is there any point in solving its motions?
    ///
    /// # Errors
    /// There is none, and why.
    fn before(&mut self, wheel: &WheelContact) -> Result<(), SolveError>;

    /// The error of a motion that was not solved, with what the wheel at rest says of its cause.
    fn explain(&self, wheel: &WheelContact, error: SolveError) -> SolveError;
}

/// One wheel on its rail.
struct WheelSolve<'a> {
    operators: &'a Arc<OperatorStore>,
    case: &'a CheckedCase,
    contact: &'a WheelTask,
    search: ContactLocus<'a>,
    /// The wheel at rest with nearly the same profiles.
    near: Option<&'a WheelContact>,
    balanced: bool,
    judge: &'a mut dyn Judge,
    monitor: &'a dyn Monitor,
}

impl<'a> WheelSolve<'a> {
    fn start_near(&self, near: &'a WheelContact) -> HeightStart<'a> {
        HeightStart::of_other_profiles(near, self.search.touch)
    }

    fn exactly(&self, friction_share: f64) -> NormalPass {
        NormalPass {
            friction_share,
            accuracy: Accuracy::For(self.case.run.target()),
        }
    }

    fn rest(
        &mut self,
        wanted: NormalPass,
        start: HeightStart,
        workspace: &mut GridWorkspace<f32>,
    ) -> Result<RestingWheel, SolveError> {
        let watch = TimeLimit::new(self.monitor, self.case.run.time_limit, 1);
        let began = self.monitor.elapsed();
        let wheel = self
            .contact
            .find_height(&mut self.search, wanted, start, workspace, &watch);
        let wheel = wheel.map_err(|failure| watch.explained(failure.into(), self.case))?;
        if matches!(wanted.accuracy, Accuracy::For(_)) {
            self.judge.before(&wheel)?;
        }
        let seconds = (self.monitor.elapsed() - began).as_secs_f64();
        let unbalanced = if self.balanced { BALANCE } else { 0.0 };
        Ok(RestingWheel {
            wheel,
            seconds,
            unbalanced,
        })
    }

    fn answers(
        &self,
        at_rest: &RestingWheel,
        run: &Run,
    ) -> Result<Vec<(Solution, Fields)>, SolveError> {
        self.answers_of_gaps(at_rest, run)
            .map_err(|error| self.judge.explain(&at_rest.wheel, error))
    }

    /// Solves every motion in every gap.
    fn answers_of_gaps(
        &self,
        at_rest: &RestingWheel,
        run: &Run,
    ) -> Result<Vec<(Solution, Fields)>, SolveError> {
        let CheckedCase { problem, label, .. } = self.case;
        let (wheel, geometry) = (&at_rest.wheel, &self.contact.geometry);
        let count = wheel.patches.len();
        let watch = TimeLimit::new(self.monitor, run.time_limit, count * problem.motions.len());
        let mut answers = Vec::with_capacity(count);
        for (k, gap) in wheel.patches.iter().enumerate() {
            // What all gaps share is charged to the first.
            let seconds = if k == 0 { at_rest.seconds } else { 0.0 };
            let normal = NormalReport {
                force_residual: wheel.force_residual,
                ..gap.report.with_time(seconds)
            };
            let motions = match &problem.wheelset {
                None => problem.motions.clone(),
                Some(wheelset) => vec![motion_in(gap, geometry, wheel.centre, wheelset)?],
            };
            let load_error = wheel.load_error.hypot(at_rest.unbalanced);
            let solved = SolvedFootprint {
                footprint: Footprint::computed(gap.field.clone(), load_error),
                report: Some(normal),
                coupling_error: problem.first_order_error(run.method),
                remarks: Vec::new(),
            };
            let extents = gap.field.patches().into_iter().map(|patch| patch.extent);
            let friction = in_frame(&problem.friction, &gap.frame, geometry, extents);
            let part = CheckedCase {
                problem: problem.of_gap(friction, motions),
                run: run.clone(),
                label: label.clone(),
                // Remarks are added once, for the whole contact.
                remarks: Vec::new(),
            };
            part.fits(&solved.footprint)?;
            let answered = rolling_stage::solve(self.operators, &part, &solved, &watch);
            answers.push(answered.map_err(|error| of_gap(error, gap, geometry))?);
        }
        Ok(answers)
    }

    /// The first rest with friction's share in it, and whether it is an exact one: the share is that of nearly the same profiles, or
    /// forecast while the height is sought, or found on a coarse mesh at about the right height.
    fn first_rest(
        &mut self,
        workspace: &mut GridWorkspace<f32>,
    ) -> Result<(RestingWheel, bool), SolveError> {
        if let Some(near) = self.near {
            let wanted = self.exactly(near.friction_share);
            return Ok((self.rest(wanted, self.start_near(near), workspace)?, true));
        }
        let WheelSolve { case, contact, .. } = *self;
        let share = |wheel: &WheelContact| forecast(&case.problem, &contact.geometry, wheel);
        if can_forecast(&case.problem) {
            let start = HeightStart {
                forecast: Some(&share),
                ..HeightStart::default()
            };
            return Ok((self.rest(self.exactly(0.0), start, workspace)?, true));
        }
        let about = NormalPass {
            friction_share: 0.0,
            accuracy: Accuracy::About(TOLERANCE_FIRST),
        };
        let mut at_rest = self.rest(about, HeightStart::default(), workspace)?;
        let coarse = case.run.for_resultants(TARGET_FIRST);
        let answers = self.answers(&at_rest, &coarse)?;
        at_rest.wheel.friction_share = friction_share(&at_rest.wheel, &answers);
        Ok((at_rest, false))
    }

    /// Brings normal and tangential forces to balance the vertical force together.
    fn balance(&mut self, workspace: &mut GridWorkspace<f32>) -> Result<SolvedWheel, SolveError> {
        let WheelSolve { case, contact, .. } = *self;
        let (mut at_rest, mut exact) = self.first_rest(workspace)?;
        let mut counted = at_rest.wheel.friction_share;
        let mut share = counted;
        let mut previous = None;
        let tolerance = tolerance(case.run.resolution);
        let mut exit = EquilibriumExit::NothingCarried;
        let mut last = None;
        for _ in 0..ROUNDS_MAX {
            if 1.0 + counted < CARRIED_MIN {
                exit = EquilibriumExit::NothingCarried;
                break;
            }
            if !exact {
                let start = HeightStart::near(&at_rest.wheel);
                let later = self.rest(self.exactly(counted), start, workspace)?;
                at_rest = at_rest.again(later);
            }
            exact = false;
            let answers = self.answers(&at_rest, &case.run)?;
            share = friction_share(&at_rest.wheel, &answers);
            let before = previous.replace((counted, share));
            last = Some(answers);
            let change = ((1.0 + share) / (1.0 + counted) - 1.0).abs();
            exit = EquilibriumExit::RoundsUsedUp { change };
            if change <= tolerance {
                exit = EquilibriumExit::Balanced;
                break;
            }
            counted = next_share((counted, share), before);
        }
        let answers = exit.judged(last, tolerance, share, &mut at_rest.wheel)?;
        at_rest.found(case, contact, answers)
    }
}

/// The same error with the place of the gap whose coordinates it speaks of.
fn of_gap(error: SolveError, gap: &GapContact, geometry: &WheelRail) -> SolveError {
    match error {
        SolveError::NotConverged {
            method,
            point,
            iterations,
            residual,
            tolerance,
            advice,
        } => SolveError::NotConverged {
            method,
            point,
            iterations,
            residual,
            tolerance,
            advice: format!(
                "{advice}; in the coordinates of the contact at y = {:.2} mm on the rail",
                geometry.on_rail(gap.frame.rail)[0]
            ),
        },
        other => other,
    }
}

/// Vertical part of the tangential forces on the wheel, relative to that of the normal ones.
fn friction_share(wheel: &WheelContact, answers: &[(Solution, Fields)]) -> f64 {
    let lifted = |(gap, (answer, _)): (&GapContact, &(Solution, Fields))| {
        -answer.total[0].force_y_n * gap.frame.angle.sin()
    };
    let lifted: f64 = wheel.patches.iter().zip(answers).map(lifted).sum();
    lifted / wheel.vertical_force()
}

/// The wheel at rest with the answers for all its patches.
pub(crate) struct SolvedWheel {
    /// The wheel.
    pub(crate) wheel: WheelContact,
    /// The answer.
    pub(crate) solution: Solution,
    /// The values per cell.
    pub(crate) fields: Fields,
}

/// The wheel at rest, and the time that took.
struct RestingWheel {
    wheel: WheelContact,
    seconds: f64,
    /// By which part of it friction may leave a vertical force unbalanced.
    unbalanced: f64,
}

impl RestingWheel {
    fn found(
        self,
        case: &CheckedCase,
        contact: &WheelTask,
        answers: Vec<(Solution, Fields)>,
    ) -> Result<SolvedWheel, SolveError> {
        let (solution, fields) = in_track(case, &contact.geometry, &self.wheel, answers)?;
        Ok(SolvedWheel {
            wheel: self.wheel,
            solution,
            fields,
        })
    }

    /// A later rest, with the work of both.
    fn again(&self, later: RestingWheel) -> RestingWheel {
        let mut wheel = later.wheel;
        wheel.heights += self.wheel.heights;
        RestingWheel {
            wheel,
            seconds: self.seconds + later.seconds,
            unbalanced: later.unbalanced,
        }
    }
}

impl From<SurfaceMissed> for SolveError {
    fn from(miss: SurfaceMissed) -> SolveError {
        SolveError::NormalProblem {
            reason: miss.to_string(),
        }
    }
}
