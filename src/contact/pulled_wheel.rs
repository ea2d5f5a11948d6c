//! Solves a wheel whose rail is to carry a longitudinal or a lateral force: the creepage, or the angular velocity of the wheelset, that gives it is found.
//!
//! Everything is in the search: where the wheel rests, its patches, and how the load is shared between them depend on the force of friction, so
//! that every trial brings the wheel to rest and solves all patches. The unknown is a place, as in the search for the creepages of one
//! patch: by the cubic law with the stiffness of all patches the creepage at r gives about the force r μN.
//!
//! A lateral force contains the lateral part of the normal forces, which grow and shrink with friction under a vertical load: between which forces it lies
//! is found by two coarse solves in full slip, to the right and to the left.

use std::sync::Arc;

use crate::contact::error::SolveError;
use crate::contact::monitor::{Monitor, MonitorPart};
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::numerics::bracketed_root::{FRACTION_MAX, RootExit, find_root};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::physics::Pull;
use crate::contact::problem::run::Run;
use crate::contact::profile_trust::{settle, trust};
use crate::contact::remark::list::Remark;
use crate::contact::rolling::cubic_law::CubicLaw;
use crate::contact::rolling::linear_theory;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::operator_store::OperatorStore;
use crate::contact::solution::words::answer::{PatchSolution, Solution};
use crate::contact::solution::words::fields::Fields;
use crate::contact::wheel_on_rail::{BALANCE, SolvedWheel};

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

/// Solves a wheel on a rail that carries the force of `pull`, at the creepage or the angular velocity that gives it.
///
/// # Errors
/// Why there is no answer: the rail cannot carry the force, or a trial failed.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    pull: Pull,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let settled = settle::settled(case, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let search = PullSearch {
        operators,
        case,
        contact,
        pull,
        monitor,
    };
    let first = search.first()?;
    let reach = match pull.component {
        0 => first.along(pull.force)?,
        _ => search.across(&first)?,
    };
    search.to(&first, &reach)
}

/// What the first estimate says of the contact.
struct FirstEstimate {
    /// Friction limit of all patches in N.
    limit: f64,
    law: CubicLaw,
    /// Mean rolling radius of the patches in mm, weighted with their loads.
    radius: f64,
    /// Lateral force in N without lateral creepage, normal forces included.
    lateral: f64,
    /// Sum of the magnitudes of the lateral parts of the normal forces in N.
    lateral_normal: f64,
}

/// Where a search starts, and what is known of the forces it may meet.
struct Reach {
    /// Place to start from.
    start: f64,
    /// Force in N by which the force changes about when the place changes by 1.
    unit: f64,
    /// Force in N that the balance of the vertical force leaves open.
    open: f64,
    /// Lateral forces in N in full slip to the right and to the left, where the wheel comes to rest there.
    ends: [Option<f64>; 2],
}

impl FirstEstimate {
    fn of(solution: &Solution, case: &CheckedCase) -> FirstEstimate {
        let elasticity = &case.problem.elasticity;
        let modulus = case.problem.interface.reduction * elasticity.shear_modulus;
        let (mut limit, mut load, mut moment, mut lateral_normal) = (0.0, 0.0, 0.0, 0.0);
        let mut stiffness = [0.0; 2];
        for patch in &solution.patches {
            limit += patch.friction_limit_n.unwrap_or(0.0);
            let [x_min, x_max, y_min, y_max] = patch.extent_mm;
            let c = linear_theory::coefficients(
                (x_max - x_min) / (y_max - y_min),
                elasticity.poisson_ratio,
            );
            for (stiffness, c) in stiffness.iter_mut().zip(c) {
                *stiffness += c * modulus * patch.area_mm2 / std::f64::consts::PI;
            }
            load += patch.normal_force_n;
            lateral_normal += patch.normal_force_n * angle_of(patch).sin().abs();
            moment += patch.normal_force_n * radius_of(patch);
        }
        FirstEstimate {
            limit,
            law: CubicLaw {
                stiffness: stiffness.map(|stiffness| stiffness / limit.max(f64::MIN_POSITIVE)),
            },
            radius: moment / load,
            lateral: solution.total[0].force_y_n,
            lateral_normal,
        }
    }

    /// Where the search for a longitudinal force in N starts.
    fn along(&self, force: f64) -> Result<Reach, SolveError> {
        if force.abs() > self.limit {
            return Err(SolveError::NormalProblem {
                reason: format!(
                    "a longitudinal force of {force} N was asked for; friction carries at most {:.1} N under this load",
                    self.limit
                ),
            });
        }
        Ok(Reach {
            start: force / self.limit,
            unit: self.limit,
            open: 0.0,
            ends: [None; 2],
        })
    }
}

fn angle_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(0.0, |position| position.contact_angle_rad)
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
    pull: Pull,
    monitor: &'a dyn Monitor,
}

impl PullSearch<'_> {
    /// The case at a creepage in the direction of the force, which a wheelset has by its angular velocity, at a rolling radius in mm.
    fn at(&self, creepage: f64, radius: f64, run: &Run) -> CheckedCase {
        let problem = &self.case.problem;
        let wheelset = problem.wheelset.map(|mut wheelset| {
            wheelset.angular_velocity = wheelset.speed * (1.0 - creepage) / radius;
            wheelset
        });
        let motion = match (wheelset, self.pull.component) {
            (Some(_), _) => problem.motions[0],
            (None, 1) => Motion {
                creepage_y: creepage,
                ..problem.motions[0]
            },
            (None, _) => Motion {
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

    /// The force of an answer in N that is sought.
    fn force_of(&self, solution: &Solution) -> f64 {
        match self.pull.component {
            0 => solution.total[0].force_x_n,
            _ => solution.total[0].force_y_n,
        }
    }

    /// Where the search for a lateral force starts.
    fn across(&self, first: &FirstEstimate) -> Result<Reach, SolveError> {
        let force = self.pull.force;
        let ends = match first.limit > 0.0 {
            true => [
                self.end(-FRACTION_MAX, first)?,
                self.end(FRACTION_MAX, first)?,
            ],
            false => [Some(first.lateral); 2],
        };
        let slack = TARGET_FIRST * first.limit;
        let beyond = ends[0].is_some_and(|least| force < least - slack)
            || ends[1].is_some_and(|most| force > most + slack);
        if beyond || first.limit <= 0.0 {
            return Err(self.unreached(ends));
        }
        let half = ends[0]
            .zip(ends[1])
            .map(|(least, most)| 0.5 * (most - least));
        let unit = half.unwrap_or(0.0).max(first.limit);
        Ok(Reach {
            start: ((force - first.lateral) / unit).clamp(-1.0, 1.0),
            unit,
            open: BALANCE * first.lateral_normal,
            ends,
        })
    }

    /// The lateral force in N at a place in full slip; nothing where the wheel does not come to rest.
    fn end(&self, place: f64, first: &FirstEstimate) -> Result<Option<f64>, SolveError> {
        let part = MonitorPart {
            inner: self.monitor,
            before: PROGRESS[0],
            own: 0.0,
        };
        let run = self.case.run.for_resultants(TARGET_FIRST);
        let creepage = first.law.creepage(self.pull.component, place);
        match self.judged(&self.at(creepage, first.radius, &run), part) {
            Ok(found) => Ok(Some(self.force_of(&found.solution))),
            Err(SolveError::NormalProblem { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The error of a lateral force that the rail does not carry.
    fn unreached(&self, ends: [Option<f64>; 2]) -> SolveError {
        let force = self.pull.force;
        let reach = match ends {
            [Some(least), Some(most)] => format!("from {least:.1} N to {most:.1} N"),
            [Some(least), None] => format!("at least {least:.1} N"),
            [None, Some(most)] => format!("at most {most:.1} N"),
            [None, None] => "within limits that were not found".to_owned(),
        };
        SolveError::NormalProblem {
            reason: format!(
                "a lateral force force_y_n of {force} N was asked for; normal forces and friction carry {reach} across the track in this position \
                 under this load"
            ),
        }
    }

    /// The error of a search that ended without the force.
    fn missed(&self, exit: RootExit, reach: &Reach) -> SolveError {
        if self.pull.component == 1 && exit == RootExit::SignKept {
            return self.unreached(reach.ends);
        }
        let (force, reason) = (self.pull.force, exit.reason());
        let (direction, beside) = match self.pull.component {
            0 => ("along", "lateral"),
            _ => ("across", "longitudinal"),
        };
        SolveError::NormalProblem {
            reason: format!(
                "no creepage was found at which the rail carries {force} N {direction} the track: {reason}; friction may not carry it beside the {beside} \
                 creepage and the spin"
            ),
        }
    }

    /// The answer at the force.
    fn to(&self, first: &FirstEstimate, reach: &Reach) -> Result<(Solution, Fields), SolveError> {
        let component = self.pull.component;
        let target = self.case.run.resolution.target_or_usual();
        let allowed = (MISSED_OF_TARGET * target)
            .max(MISSED_LEAST)
            .max(reach.open / first.limit);
        // Outputs never change forces, so that trials need none.
        let run = self.case.run.for_resultants(0.0);
        let (mut trials, mut nearest) = (0.0, f64::INFINITY);
        let root = find_root(reach.start, |place, tolerance: &mut f64| {
            let share = (PROGRESS[1] - PROGRESS[0]) / TRIALS_USUAL;
            let part = MonitorPart {
                inner: self.monitor,
                before: PROGRESS[0] + share * f64::min(trials, TRIALS_USUAL - 1.0),
                own: share,
            };
            trials += 1.0;
            let creepage = first.law.creepage(component, place);
            let found = self.judged(&self.at(creepage, first.radius, &run), part)?;
            let off = (self.force_of(&found.solution) - self.pull.force) / first.limit;
            nearest = nearest.min(off.abs());
            let units = first.limit / reach.unit;
            *tolerance = allowed * units;
            Ok::<f64, SolveError>(off * units)
        })?;
        // Where the trials alternate between two meshes the force jumps by what both are allowed to miss.
        if !root.exit.converged() && (root.exit == RootExit::SignKept || nearest > target) {
            return Err(self.missed(root.exit, reach));
        }
        let part = MonitorPart {
            inner: self.monitor,
            before: PROGRESS[1],
            own: 1.0 - PROGRESS[1],
        };
        let creepage = first.law.creepage(component, root.place);
        let case = self.at(creepage, first.radius, &self.case.run);
        let mut found = self.judged(&case, part)?;
        if !root.exit.converged() {
            let remark = Remark::IterationInexact {
                iteration: "the search for the creepages of the prescribed force",
                reason: root.exit.reason(),
                residual: nearest,
                tolerance: allowed,
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
