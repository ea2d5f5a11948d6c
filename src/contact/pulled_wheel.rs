//! Solves a wheel whose rail is to carry a longitudinal force: the creepage, or the angular velocity of the wheelset, that gives it is found.
//!
//! Everything is in the search: where the wheel rests, its patches, and how the load is shared between them depend on the force of friction, so
//! that every trial brings the wheel to rest and solves all patches. The unknown is a place, as in the search for the creepages of one
//! patch: by the cubic law with the stiffness of all patches the creepage at r gives about the force r μN.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::monitor::{Monitor, MonitorPart};
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::numerics::bracketed_root::{RootExit, find_root};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::run::Run;
use crate::contact::profile_trust::{settle, trust};
use crate::contact::remark::list::Remark;
use crate::contact::rolling::cubic_law::CubicLaw;
use crate::contact::rolling::linear_theory;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::words::answer::{PatchSolution, Solution};
use crate::contact::solution::words::fields::Fields;
use crate::contact::wheel_on_rail::SolvedWheel;

/// A force may be missed by this part of the target, and by this part of μN at least: what the normal problem leaves open from trial to
/// trial is noise to the search. Chosen by judgement; how much it matters was not measured.
const MISSED_OF_TARGET: f64 = 0.1;
/// See [`MISSED_OF_TARGET`].
const MISSED_LEAST: f64 = 5e-5;
/// Allowed error of the resultants in the first estimate, which tells patches, loads and radii.
/// Chosen by judgement; how much it matters was not measured.
const TARGET_FIRST: f64 = 0.05;
/// Progress of the first estimate and of the search; the rest is the answer.
const PROGRESS: [f64; 2] = [0.1, 0.8];
/// Trials after which the progress of the search stands still.
/// Chosen by judgement; how much it matters was not measured.
const TRIALS_USUAL: f64 = 6.0;

/// Solves a wheel on a rail that carries `force` in N along x, at the creepage or the angular velocity that gives it.
///
/// # Errors
/// Why there is no answer: friction does not carry the force, or a trial failed.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    force: f64,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let settled = settle::settled(case, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let search = PullSearch {
        operators,
        case,
        contact,
        monitor,
    };
    let first = search.first()?;
    if force.abs() > first.limit {
        return Err(SolveError::NormalProblem {
            reason: format!(
                "a longitudinal force of {force} N was asked for; friction carries at most {:.1} N under this load",
                first.limit
            ),
        });
    }
    search.to(force, &first)
}

/// What the first estimate says of the contact.
struct FirstEstimate {
    /// Friction limit of all patches in N.
    limit: f64,
    law: CubicLaw,
    /// Mean rolling radius of the patches in mm, weighted with their loads.
    radius: f64,
}

impl FirstEstimate {
    fn of(solution: &Solution, case: &CheckedCase) -> FirstEstimate {
        let elasticity = &case.problem.elasticity;
        let modulus = case.problem.interface.reduction * elasticity.shear_modulus;
        let (mut limit, mut stiffness, mut load, mut moment) = (0.0, 0.0, 0.0, 0.0);
        for patch in &solution.patches {
            limit += patch.friction_limit_n.unwrap_or(0.0);
            let [x_min, x_max, y_min, y_max] = patch.extent_mm;
            let [c11, ..] = linear_theory::coefficients(
                (x_max - x_min) / (y_max - y_min),
                elasticity.poisson_ratio,
            );
            stiffness += c11 * modulus * patch.area_mm2 / std::f64::consts::PI;
            load += patch.normal_force_n;
            moment += patch.normal_force_n * radius_of(patch);
        }
        FirstEstimate {
            limit,
            law: CubicLaw {
                stiffness: [stiffness / limit.max(f64::MIN_POSITIVE); 2],
            },
            radius: moment / load,
        }
    }
}

fn radius_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(1.0, |position| position.rolling_radius_mm)
}

/// The search for the motion of one wheel.
struct PullSearch<'a> {
    operators: &'a Arc<OperatorStore>,
    case: &'a CheckedCase,
    contact: &'a WheelTask,
    monitor: &'a dyn Monitor,
}

impl PullSearch<'_> {
    /// The case at a longitudinal creepage, which a wheelset has by its angular velocity, at a rolling radius in mm.
    fn at(&self, creepage: f64, radius: f64, run: &Run) -> CheckedCase {
        let problem = &self.case.problem;
        let wheelset = problem.wheelset.map(|mut wheelset| {
            wheelset.angular_velocity = wheelset.speed * (1.0 - creepage) / radius;
            wheelset
        });
        let motion = match wheelset {
            Some(_) => problem.motions[0],
            None => Motion {
                creepage_x: creepage,
                ..problem.motions[0]
            },
        };
        CheckedCase {
            problem: problem.moving(motion, wheelset),
            run: run.clone(),
            ..self.case.clone()
        }
    }

    fn judged(&self, case: &CheckedCase, part: MonitorPart) -> Result<SolvedWheel, SolveError> {
        trust::judged(self.operators, case, self.contact, &part)
    }

    fn first(&self) -> Result<FirstEstimate, SolveError> {
        let part = MonitorPart {
            inner: self.monitor,
            before: 0.0,
            own: PROGRESS[0],
        };
        let run = self.case.run.for_resultants(TARGET_FIRST);
        let found = self.judged(
            &self.at(0.0, self.contact.geometry.placement.rolling_radius, &run),
            part,
        )?;
        Ok(FirstEstimate::of(&found.solution, self.case))
    }

    /// The answer at the force.
    fn to(&self, force: f64, first: &FirstEstimate) -> Result<(Solution, Fields), SolveError> {
        let target = self.case.run.resolution.target_or_usual();
        // Outputs never change forces, so that trials need none.
        let run = self.case.run.for_resultants(0.0);
        let (mut trials, mut nearest) = (0.0, f64::INFINITY);
        let root = find_root(force / first.limit, |place, tolerance: &mut f64| {
            let share = (PROGRESS[1] - PROGRESS[0]) / TRIALS_USUAL;
            let part = MonitorPart {
                inner: self.monitor,
                before: PROGRESS[0] + share * f64::min(trials, TRIALS_USUAL - 1.0),
                own: share,
            };
            trials += 1.0;
            let creepage = first.law.creepage(0, place);
            let found = self.judged(&self.at(creepage, first.radius, &run), part)?;
            *tolerance = (MISSED_OF_TARGET * target).max(MISSED_LEAST);
            let off = (found.solution.total[0].force_x_n - force) / first.limit;
            nearest = nearest.min(off.abs());
            Ok::<f64, SolveError>(off)
        })?;
        // Where the trials alternate between two meshes the force jumps by what both are allowed to miss.
        if !root.exit.converged() && (root.exit == RootExit::SignKept || nearest > target) {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "no creepage was found at which the rail carries {force} N along the track: {}; friction may not carry it beside the lateral \
                     creepage and the spin",
                    root.exit.reason()
                ),
            });
        }
        let part = MonitorPart {
            inner: self.monitor,
            before: PROGRESS[1],
            own: 1.0 - PROGRESS[1],
        };
        let creepage = first.law.creepage(0, root.place);
        let case = self.at(creepage, first.radius, &self.case.run);
        let mut found = self.judged(&case, part)?;
        if !root.exit.converged() {
            let remark = Remark::IterationInexact {
                iteration: "the search for the creepages of the prescribed force",
                reason: root.exit.reason(),
                residual: nearest,
                tolerance: (MISSED_OF_TARGET * target).max(MISSED_LEAST),
            };
            found.solution.remarks.push(remark.into());
        }
        let found = trust::trusted(self.operators, &case, self.contact, found, self.monitor)?;
        let mut solution = found.solution;
        let wheelset = case.problem.wheelset;
        solution.angular_velocity_rad_per_s = wheelset.map(|wheelset| wheelset.angular_velocity);
        Ok((solution, found.fields))
    }
}
