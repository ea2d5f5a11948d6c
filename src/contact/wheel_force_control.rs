//! Solves a wheel with a prescribed longitudinal or lateral force, or both: finds the creepages, or the angular and the lateral velocity of the
//! wheelset, that give these forces.
//!
//! The position of the wheel, its patches and the sharing of the load depend on friction, so that every evaluation finds the equilibrium of the wheel
//! and solves all patches. The unknown r is a dimensionless creepage: by the cubic law with the stiffness of all patches, it gives roughly the force
//! r μN.
//!
//! A lateral force includes the lateral component of the normal forces, which depend on friction under a vertical load. Its range is found by two
//! coarse solves in full slip, to the right and to the left.

use std::sync::Arc;

use crate::error::SolveError;
use crate::geometry::wheel_rail::Placement;
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::monitor::{Monitor, MonitorPart};
use crate::normal::wheel::WheelTask;
use crate::numerics::equilibrium::{Equilibrium, Search, Termination, Trial};
use crate::problem::checked_case::CheckedCase;
use crate::problem::physics::{Problem, Run};
use crate::profile_assessment::trust;
use crate::remark::entry::RemarkEntry;
use crate::rolling::force_control::{CubicLaw, PLACE_MAX};
use crate::rolling::operator_store::OperatorStore;
use crate::rolling::task::{Motion, NEGLIGIBLE_OF_TARGET, PrescribedForces, RelativeTo};
use crate::solution::words::answer::{Fields, PatchSolution, Solution};
use crate::vertical_equilibrium::tolerance;
use crate::wheel_on_rail::SolvedWheel;

/// Least tolerance of a force or torque relative to the friction limit, because the error of the normal problem is noise to the search. Chosen by judgement; its
/// influence was not measured.
pub(crate) const MISSED_LEAST: f64 = 5e-5;
/// Target error of the resultants in the first estimate, which gives patches, loads and radii. Chosen by judgement; its influence was not
/// measured.
const TARGET_FIRST: f64 = 0.05;
/// Usual number of solves: the first estimate, the trials of the search and the answer. Progress is reported in as many equal parts.
const SOLVES_USUAL: f64 = 8.0;

/// Solves a wheel on a rail with prescribed forces.
///
/// # Errors
/// Returns the reason why there is no answer: the rail cannot carry the forces, or a trial failed.
pub(crate) fn solve(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    contact: &WheelTask,
    forces: PrescribedForces,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let settled = trust::settled(case, contact, monitor)?;
    let contact = settled.as_ref().unwrap_or(contact);
    let search = ForceSearch {
        operators,
        case,
        contact,
        forces,
        monitor,
    };
    let first = search.first()?;
    let reach = search.reach(&first)?;
    search.to(&first, &reach)
}

/// The first estimate of the contact.
struct FirstEstimate {
    /// Friction limit of all patches in N.
    limit: f64,
    law: CubicLaw,
    rolling: FreeRollingState,
    /// Approximate lateral force in N without lateral creepage, normal forces included.
    lateral: f64,
    /// Sum of the magnitudes of the lateral components of the normal forces in N.
    lateral_normal: f64,
}

/// The start of the search and the range of the forces.
struct Reach {
    /// Start of the unknowns.
    start: [f64; 2],
    /// Approximate changes of the forces in N per unit of the unknowns.
    units: [f64; 2],
    /// Error of the lateral force in N due to the tolerance of the vertical force.
    open: f64,
    /// Lateral forces in N in full slip to the right and to the left, if the wheel has an equilibrium there.
    ends: [Option<f64>; 2],
}

impl FirstEstimate {
    fn of(solution: &Solution, case: &CheckedCase, rolling: FreeRollingState) -> FirstEstimate {
        let patches = &solution.patches;
        let (limit, law) = limit_and_law(&case.problem, patches.iter());
        let sizes = patches
            .iter()
            .map(|patch| patch.normal_force_n * angle_of(patch).sin().abs());
        FirstEstimate {
            limit,
            law,
            rolling: rolling.of(&solution.patches),
            lateral: solution.total[0].force_y_n,
            lateral_normal: sizes.sum(),
        }
    }
}

/// Friction limit in N of some patches together, and their cubic law.
pub(crate) fn limit_and_law<'p>(
    problem: &Problem,
    patches: impl Iterator<Item = &'p PatchSolution> + Clone,
) -> (f64, CubicLaw) {
    let limits = patches.clone().filter_map(|patch| patch.friction_limit_n);
    let limit = limits.sum();
    let shapes = patches.map(|patch| {
        let [x_min, x_max, y_min, y_max] = patch.extent_mm;
        ((x_max - x_min) / (y_max - y_min), patch.area_mm2)
    });
    let law = CubicLaw::of_patches(&problem.elasticity, problem.interface, shapes, limit);
    (limit, law)
}

/// The search for the motion of one wheel.
struct ForceSearch<'a> {
    operators: &'a Arc<OperatorStore>,
    case: &'a CheckedCase,
    contact: &'a WheelTask,
    forces: PrescribedForces,
    monitor: &'a dyn Monitor,
}

impl ForceSearch<'_> {
    /// The case with creepages in the directions of the forces. A wheelset gets them by its angular and its lateral velocity.
    fn at(&self, creepages: [f64; 2], rolling: FreeRollingState, run: &Run) -> CheckedCase {
        let problem = &self.case.problem;
        let wheelset = problem.wheelset;
        let wheelset = wheelset.map(|wheelset| rolling.at(wheelset, creepages, self.forces));
        let mut motion = problem.motions[0];
        if wheelset.is_none() {
            let [along, across] = self.forces.map(|force| force.is_some());
            motion = Motion {
                creepage_x: if along {
                    creepages[0]
                } else {
                    motion.creepage_x
                },
                creepage_y: if across {
                    creepages[1]
                } else {
                    motion.creepage_y
                },
                ..motion
            };
        }
        CheckedCase {
            problem: Problem {
                motions: vec![motion],
                forces: vec![[None; 2]],
                wheelset,
                wheelset_forces: [None; 2],
                ..problem.clone()
            },
            run: run.clone(),
            ..self.case.clone()
        }
    }

    /// The part of the progress after a number of solves.
    fn part(&self, solves: f64) -> MonitorPart<'_> {
        MonitorPart::new(self.monitor, solves / SOLVES_USUAL, 1.0 / SOLVES_USUAL)
    }

    fn judged(&self, case: &CheckedCase, part: MonitorPart) -> Result<SolvedWheel, SolveError> {
        trust::judged(self.operators, case, self.contact, &part)
    }

    fn first(&self) -> Result<FirstEstimate, SolveError> {
        let part = self.part(0.0);
        let run = self.case.run.for_resultants(TARGET_FIRST);
        let rolling = FreeRollingState::about(&self.contact.geometry.placement);
        let found = self.judged(&self.at([0.0; 2], rolling, &run), part)?;
        Ok(FirstEstimate::of(&found.solution, self.case, rolling))
    }

    /// The start of the search. Fails if the forces are out of range.
    fn reach(&self, first: &FirstEstimate) -> Result<Reach, SolveError> {
        let limit = first.limit;
        if limit <= 0.0 {
            let asked = self.asked();
            return Err(SolveError::normal_problem(format!(
                "{asked} was asked for under a wheel without friction, where no creepage changes it; give creepages"
            )));
        }
        if let Some(force) = self.forces[0].filter(|force| force.abs() > limit) {
            return Err(SolveError::normal_problem(format!(
                "a longitudinal force force_x_n of {force} N was asked for; friction carries at most {limit:.1} N under this load"
            )));
        }
        let mut reach = Reach {
            start: [self.forces[0].unwrap_or(0.0) / limit, 0.0],
            units: [limit; 2],
            open: 0.0,
            ends: [None; 2],
        };
        if let Some(across) = self.forces[1] {
            self.reach_across(across, first, &mut reach)?;
        }
        Ok(reach)
    }

    /// Adds the start of the search for a lateral force in N. Both forces share the friction. In full slip they lie on an ellipse, or on a sum of
    /// ellipses, that is as wide as the range of the lateral force and not longer.
    fn reach_across(
        &self,
        force: f64,
        first: &FirstEstimate,
        reach: &mut Reach,
    ) -> Result<(), SolveError> {
        let ends = [self.end(-PLACE_MAX, first)?, self.end(PLACE_MAX, first)?];
        reach.ends = ends;
        let slack = TARGET_FIRST * first.limit;
        let half = ends[0]
            .zip(ends[1])
            .map(|(least, most)| 0.5 * (most - least));
        let mut beyond = ends[0].is_some_and(|least| force < least - slack)
            || ends[1].is_some_and(|most| force > most + slack);
        if let (Some(half), Some(least), Some(along)) = (half, ends[0], self.forces[0]) {
            beyond |= along.hypot(force - least - half) > half + slack;
        }
        if beyond {
            return Err(self.unreached(ends));
        }
        let unit = half.unwrap_or(0.0).max(first.limit);
        let place = ((force - first.lateral) / unit).clamp(-1.0, 1.0);
        reach.units[1] = unit;
        reach.open = tolerance(self.case.run.resolution) * first.lateral_normal;
        reach.start[1] = place;
        if self.forces[0].is_some() {
            reach.start = first.law.places_of_forces(reach.start);
        }
        Ok(())
    }

    /// The lateral force in N in full slip at one end; `None` if the wheel has no equilibrium there.
    fn end(&self, place: f64, first: &FirstEstimate) -> Result<Option<f64>, SolveError> {
        let part = MonitorPart::new(self.monitor, 1.0 / SOLVES_USUAL, 0.0);
        let run = self.case.run.for_resultants(TARGET_FIRST);
        let creepages = [0.0, first.law.creepage(1, place)];
        match self.judged(&self.at(creepages, first.rolling, &run), part) {
            Ok(found) => Ok(Some(found.solution.total[0].force_y_n)),
            Err(SolveError::NormalProblem { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Description of the prescribed forces.
    fn asked(&self) -> String {
        match self.forces {
            [Some(along), None] => format!("a longitudinal force force_x_n of {along} N"),
            [None, across] => {
                format!(
                    "a lateral force force_y_n of {} N",
                    across.unwrap_or_default()
                )
            }
            [Some(along), Some(across)] => {
                format!("force_x_n of {along} N together with force_y_n of {across} N")
            }
        }
    }

    /// The error of a lateral force that the rail does not carry, or not together with the longitudinal one.
    fn unreached(&self, ends: [Option<f64>; 2]) -> SolveError {
        let asked = self.asked();
        let reach = match ends {
            [Some(least), Some(most)] => {
                format!("about {} N to {} N", rounded(least), rounded(most))
            }
            [Some(least), None] => format!("about {} N at least", rounded(least)),
            [None, Some(most)] => format!("about {} N at most", rounded(most)),
            [None, None] => "within limits that were not found".to_owned(),
        };
        let beside = match self.forces[0] {
            Some(_) => ", and less together with a longitudinal force",
            None => "",
        };
        SolveError::normal_problem(format!(
            "{asked} was asked for; normal forces and friction carry {reach} across the track in this position under this load{beside}"
        ))
    }

    /// The error of a search that ended without the forces.
    fn missed(&self, end: Termination, reach: &Reach) -> SolveError {
        if self.forces[1].is_some() && end == Termination::AtLimit {
            return self.unreached(reach.ends);
        }
        let (asked, reason) = (self.asked(), end.reason());
        SolveError::normal_problem(format!(
            "no creepage was found that gives {asked}: {reason}; friction may not carry it together with the other given values"
        ))
    }

    /// Searches for the forces and solves the case there.
    fn to(&self, first: &FirstEstimate, reach: &Reach) -> Result<(Solution, Fields), SolveError> {
        let target = self.case.run.resolution.target_or_usual();
        let wanted = self.forces.map(Option::unwrap_or_default);
        let target = match self.case.run.relative_to {
            RelativeTo::FrictionLimit => target,
            RelativeTo::Force => target * (wanted[0].hypot(wanted[1]) / first.limit).min(1.0),
        };
        let along = (NEGLIGIBLE_OF_TARGET * target).max(MISSED_LEAST);
        let allowed = along.max(reach.open / first.limit);
        // The tolerance of the vertical force affects only the lateral force.
        let units = [along / allowed * first.limit, first.limit];
        // Outputs never change forces, so that trials have none.
        let run = self.case.run.for_resultants(0.0);
        let mut trials = 0.0;
        let creepages_at = |place: [f64; 2]| [0, 1].map(|k| first.law.creepage(k, place[k]));
        let scale = [0, 1].map(|k| self.forces[k].map(|_| units[k] / reach.units[k]));
        let root: Equilibrium<2, ()> =
            Search::new(scale, [PLACE_MAX; 2]).find(reach.start, |place| {
                trials += 1.0;
                let part = self.part(f64::min(trials, SOLVES_USUAL - 2.0));
                let case = self.at(creepages_at(place), first.rolling, &run);
                let total = self.judged(&case, part)?.solution.total[0];
                let found = [total.force_x_n, total.force_y_n];
                Ok::<_, SolveError>(Trial {
                    residual: [0, 1].map(|k| (found[k] - wanted[k]) / units[k]),
                    tolerance: allowed,
                    value: (),
                })
            })?;
        // If the trials alternate between two meshes, the force jumps by up to the target errors of both.
        if !root.converged() && (root.end == Termination::AtLimit || root.residual > target) {
            return Err(self.missed(root.end, reach));
        }
        let part = self.part(SOLVES_USUAL - 1.0);
        let case = self.at(creepages_at(root.place), first.rolling, &self.case.run);
        let mut found = self.judged(&case, part)?;
        let remark = root.inexact("the search for the creepages of the prescribed force");
        let remarks = &mut found.solution.remarks;
        remarks.extend(remark.map(RemarkEntry::from));
        let found = trust::trusted(self.operators, &case, self.contact, found, self.monitor)?;
        let mut solution = found.solution;
        if let Some(wheelset) = case.problem.wheelset {
            let [along, across] = self.forces;
            solution.angular_velocity_rad_per_s = along.map(|_| wheelset.angular_velocity);
            solution.lateral_velocity_mm_per_s = across.map(|_| wheelset.lateral_velocity);
        }
        Ok((solution, found.fields))
    }
}

/// The motion of a wheelset whose mean creepage, weighted with the loads of the patches, is 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FreeRollingState {
    /// Rolling radius in mm.
    radius: f64,
    /// Lateral velocity over the speed.
    drift: f64,
    /// Lateral creepage over the relative lateral velocity: the cosine of the contact angle.
    across: f64,
}

impl FreeRollingState {
    /// The estimate before patches are known. Near the tread, the lateral creepage is that of the yaw.
    pub(crate) fn about(placement: &Placement) -> FreeRollingState {
        FreeRollingState {
            radius: placement.rolling_radius,
            drift: placement.yaw,
            across: 1.0,
        }
    }

    /// The state from the patches that were solved with the motion of this one.
    pub(crate) fn of(self, patches: &[PatchSolution]) -> FreeRollingState {
        let (mut load, mut moment, mut sliding, mut across) = (0.0, 0.0, 0.0, 0.0);
        for patch in patches {
            let force = patch.normal_force_n;
            let creepage = patch.points.first().map(|point| point.motion.creepage_y);
            load += force;
            moment += force * radius_of(patch);
            sliding += force * creepage.unwrap_or(0.0);
            across += force * angle_of(patch).cos();
        }
        FreeRollingState {
            radius: moment / load,
            drift: self.drift - sliding / across,
            across: across / load,
        }
    }

    /// The motion with these mean creepages in the directions of the prescribed forces.
    pub(crate) fn at(
        &self,
        mut wheelset: WheelsetMotion,
        creepages: [f64; 2],
        forces: PrescribedForces,
    ) -> WheelsetMotion {
        let [along, across] = forces.map(|force| force.is_some());
        if along {
            wheelset.angular_velocity = wheelset.speed * (1.0 - creepages[0]) / self.radius;
        }
        if across {
            wheelset.lateral_velocity = wheelset.speed * (self.drift + creepages[1] / self.across);
        }
        wheelset
    }
}

/// The contact angle of a patch in rad.
pub(crate) fn angle_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(0.0, |position| position.contact_angle_rad)
}

/// Rounds a force in N to three digits, the accuracy of a coarse solve.
fn rounded(force: f64) -> f64 {
    let step = 10_f64.powf(force.abs().max(1.0).log10().floor() - 2.0);
    (force / step).round() * step
}

fn radius_of(patch: &PatchSolution) -> f64 {
    let position = patch.position.as_ref();
    position.map_or(1.0, |position| position.rolling_radius_mm)
}
