//! The creepages that give prescribed tangential forces.
//!
//! Each force is a monotone function of its own creepage. The unknown is not the creepage but its *place*: the creepage at place r gives the force r μN by
//! Vermeulen and Johnson's cubic law with Kalker's coefficients (Vermeulen & Johnson 1964; Kalker 1990, §2.2.3), so the derivative of the force by the place
//! is about μN. A search starts from the creepages of the table of creep forces, or of that law without spin.
//!
//! A rough search on the coarsest mesh gives the start. The adaptive solve of that motion determines the meshes, on which value and estimate are smooth
//! functions of the creepage.

use std::convert::Infallible;

use crate::error::SolveError;
use crate::friction::path_dependent::Interface;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::Method;
use crate::monitor::Monitor;
use crate::numerics::equilibrium::{Equilibrium, Search, Termination, Trial};
use crate::rolling::answer::{MotionAnswer, Resultants, Work};
use crate::rolling::linear_theory;
use crate::rolling::methods::table::solve as table;
use crate::rolling::refinement::adapt;
use crate::rolling::refinement::interpolate::RefinementState;
use crate::rolling::refinement::mesh_family::MeshFamily;
use crate::rolling::refinement::on_mesh::MotionTask;
use crate::rolling::task::{
    MeshPlan, Motion, PrescribedForces, Resolution, RollingTask, SHARE_OF_TARGET, TOLERANCE_LEAST,
};

/// Largest place: a hundred times the creepage at which the cubic law predicts full slip. Chosen by judgement.
pub(crate) const PLACE_MAX: f64 = 65.0;
/// Tolerance of a force, relative to μN, of the searches for a start: by the table, without which a single force takes 47 % more products, and on the coarsest
/// mesh, without which the work is five times as large. 0.003 and 0.03 take 1 % more work on the 118 prescribed forces of
/// `cargo bench --bench stress -- --only times`.
const MISSED_AT_START: f64 = 0.01;
/// Near μN the creepage depends on the small remainder `1 − force/μN`; the tolerance is at most this multiple of it. Chosen by judgement.
const NEAR_LIMIT: f64 = 10.0;
/// Least tolerance of a force, relative to μN or, if they are smaller, to the forces of the first motion tried. Where everything slips, elastic slip still turns
/// the tractions by this much. Chosen by judgement.
const MISSED_LEAST: f64 = 2e-7;
/// Largest number of choices of meshes. Further choices follow if the motion found does not meet its target on the meshes chosen before.
const MESH_CHOICES_MAX: u32 = 3;

/// Solves motion `index` of a problem. Where forces are prescribed, finds the creepages that give them.
///
/// # Errors
/// The reason why there is no solution.
pub fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    index: usize,
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    let motion = task.motions[index];
    if task.forces[index] == [None; 2] || task.friction.is_frictionless() {
        return adapt::solve(task, state, MotionTask { index, motion }, monitor);
    }
    let began = monitor.elapsed();
    let mut search = ForceSearch::new(task, state, index, monitor);
    let start = search.start();
    let found = match task.method == Method::BoundaryElement && task.target().is_some() {
        true => search.find_on_chosen_meshes(start)?,
        false => search.find(start, false)?,
    };
    let saturated = found.end == Termination::AtLimit;
    let remark = found.inexact("the search for the creepages of the prescribed force");
    let mut point = found.value;
    point.remarks.extend(remark.filter(|_| !saturated));
    point.saturated = saturated;
    point.work = search.work;
    adapt::add_slips(task, state, index, &mut point, monitor)?;
    point.seconds = (monitor.elapsed() - began).as_secs_f64();
    Ok(point)
}

/// Places with the solution at them.
type FoundPlaces = Equilibrium<2, MotionAnswer>;

/// The search for the creepages of one motion.
struct ForceSearch<'a, 's, 'p> {
    task: &'a RollingTask<'a>,
    state: &'s mut RefinementState<'p>,
    index: usize,
    monitor: &'a dyn Monitor,
    forces: PrescribedForces,
    /// μN of all patches in N.
    limit: f64,
    law: CubicLaw,
    search: Search<2>,
    /// The meshes of a trial, coarse to fine; empty for the meshes of the method.
    meshes: Vec<MeshPlan>,
    /// Length of the forces of the first trial, relative to μN.
    first: Option<f64>,
    work: Work,
}

impl<'a, 's, 'p> ForceSearch<'a, 's, 'p> {
    fn new(
        task: &'a RollingTask<'a>,
        state: &'s mut RefinementState<'p>,
        index: usize,
        monitor: &'a dyn Monitor,
    ) -> ForceSearch<'a, 's, 'p> {
        let limit = task.friction.limit_of_all(task.footprint);
        let forces = task.forces[index];
        ForceSearch {
            task,
            law: CubicLaw::new(task, limit),
            search: new_search(forces),
            state,
            index,
            monitor,
            forces,
            limit,
            meshes: Vec::new(),
            first: None,
            work: Work::default(),
        }
    }

    /// Finds the places on meshes on which the motion found meets its target.
    fn find_on_chosen_meshes(&mut self, start: [f64; 2]) -> Result<FoundPlaces, SolveError> {
        let mut place = self.start_on_coarsest(start)?;
        let target = self.task.target().unwrap_or(f64::INFINITY);
        let mut choices = 0;
        loop {
            self.choose_meshes(place)?;
            let found = self.find(place, false)?;
            choices += 1;
            let met = found.value.error().is_some_and(|error| error <= target);
            // Where the force jumps, other meshes do not help.
            let ends = matches!(found.end, Termination::AtLimit | Termination::Jump);
            if met || ends || choices == MESH_CHOICES_MAX {
                return Ok(found);
            }
            place = found.place;
        }
    }

    /// Finds the places roughly on the coarsest mesh; the start if that fails.
    fn start_on_coarsest(&mut self, start: [f64; 2]) -> Result<[f64; 2], SolveError> {
        let family = MeshFamily::of(self.task, &self.motion(start));
        self.meshes = vec![family.mesh(family.cells_first())];
        match self.find(start, true) {
            Ok(found) if found.converged() => Ok(found.place),
            // Finer meshes may have a solution all the same.
            Ok(_) | Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }) => {
                self.search = new_search(self.forces);
                Ok(start)
            }
            Err(error) => Err(error),
        }
    }

    /// Takes the meshes that the adaptive solve at two places compares.
    fn choose_meshes(&mut self, place: [f64; 2]) -> Result<(), SolveError> {
        let asked = self.asked(place);
        let (point, meshes) = adapt::solve_forces(self.task, self.state, asked, self.monitor)?;
        self.work.add(point.work);
        self.first.get_or_insert(length(self.relative(&point)));
        self.meshes = meshes;
        Ok(())
    }

    /// Finds the places at which the forces are as prescribed, or as close as possible; `roughly` for a start.
    fn find(&mut self, start: [f64; 2], roughly: bool) -> Result<FoundPlaces, SolveError> {
        let mut search = self.search;
        let found = search.find(start, |place| self.trial(place, roughly));
        self.search = search;
        found
    }

    /// Solves the motion at two places and compares its forces with the prescribed ones, relative to μN.
    fn trial(
        &mut self,
        place: [f64; 2],
        roughly: bool,
    ) -> Result<Trial<2, MotionAnswer>, SolveError> {
        let asked = self.asked(place);
        let point = match &*self.meshes {
            [] => adapt::solve_forces(self.task, self.state, asked, self.monitor)?.0,
            meshes => adapt::solve_on_meshes(self.task, self.state, asked, meshes, self.monitor)?,
        };
        self.work.add(point.work);
        let forces = self.relative(&point);
        self.first.get_or_insert(length(forces));
        Ok(Trial {
            residual: [0, 1].map(|k| forces[k] - self.wanted()[k]),
            tolerance: self.tolerance(roughly),
            value: point,
        })
    }

    fn asked(&self, place: [f64; 2]) -> MotionTask {
        MotionTask {
            index: self.index,
            motion: self.motion(place),
        }
    }

    /// The forces of a solution, relative to μN.
    fn relative(&self, point: &MotionAnswer) -> [f64; 2] {
        let sum: Resultants = point.resultants.iter().sum();
        [sum.force_x / self.limit, sum.force_y / self.limit]
    }

    /// The prescribed forces, relative to μN.
    fn wanted(&self) -> [f64; 2] {
        self.forces.map(|force| force.unwrap_or(0.0) / self.limit)
    }

    /// Tolerance of the forces, relative to μN.
    fn tolerance(&self, roughly: bool) -> f64 {
        let most = match self.task.resolution {
            Resolution::Target(target) if self.task.method != Method::Fastsim => {
                (SHARE_OF_TARGET * target).max(10.0 * TOLERANCE_LEAST)
            }
            _ => TOLERANCE_LEAST,
        };
        let wanted = length(self.wanted());
        // Where pressure causes slip, the forces of the first trial are no measure of the forces.
        let first = self.first.filter(|_| !self.task.is_coupled());
        let scale = first.unwrap_or(1.0).max(wanted).min(1.0);
        let left = (NEAR_LIMIT * (1.0 - wanted)).max(0.0);
        let most = if roughly {
            MISSED_AT_START.max(most)
        } else {
            most
        };
        (most * scale.min(left)).max(MISSED_LEAST * scale)
    }

    /// The start: the places at which the table has the forces, or those of the cubic law.
    fn start(&self) -> [f64; 2] {
        let RollingTask {
            elasticity,
            interface,
            friction,
            ..
        } = self.task;
        let (wanted, ellipses) = (self.wanted(), self.state.ellipses());
        let cubic = self.law.places_of_forces(wanted);
        if ellipses.is_empty() || !table::tells(elasticity, *interface, friction) {
            return cubic;
        }
        let modulus = interface.reduction * elasticity.shear_modulus;
        let Ok(found) = new_search(self.forces).find(cubic, |place| {
            let motion = self.motion(place);
            let mut residual = wanted.map(|force| -force);
            for (k, ellipse) in ellipses.iter().enumerate() {
                let limit = friction.limit(self.task.footprint, k);
                let own = table::forces(modulus, elasticity.poisson_ratio, ellipse, limit, &motion);
                residual = [0, 1].map(|k| residual[k] + own[k] / self.limit);
            }
            Ok::<_, Infallible>(Trial {
                residual,
                tolerance: MISSED_AT_START,
                value: (),
            })
        });
        match found.converged() {
            true => found.place,
            false => cubic,
        }
    }

    fn motion(&self, place: [f64; 2]) -> Motion {
        let given = self.task.motions[self.index];
        let creepage = |k: usize, given: f64| match self.forces[k] {
            Some(_) => self.law.creepage(k, place[k]),
            None => given,
        };
        Motion {
            creepage_x: creepage(0, given.creepage_x),
            creepage_y: creepage(1, given.creepage_y),
            ..given
        }
    }
}

/// A search for places. A force over μN changes about as much as its place.
fn new_search(forces: PrescribedForces) -> Search<2> {
    Search::new(forces.map(|force| force.map(|_| 1.0)), [PLACE_MAX; 2])
}

/// Length of two components.
fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Place from which the cubic law is continued by its tangent. Chosen by judgement.
const CUBIC_UNTIL: f64 = 0.9;

/// The cubic law for a footprint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CubicLaw {
    /// Force of linear theory over μN per creepage, along x and across.
    pub(crate) stiffness: [f64; 2],
}

impl CubicLaw {
    fn new(task: &RollingTask, limit: f64) -> CubicLaw {
        let shapes = task.footprint.patches().iter().map(|patch| {
            let extent = patch.extent;
            let box_ratio = (extent[1] - extent[0]) / (extent[3] - extent[2]);
            let a_over_b = patch.semi_axes.map_or(box_ratio, |[a, b]| a / b);
            (a_over_b, patch.area)
        });
        CubicLaw::of_patches(task.elasticity, task.interface, shapes, limit)
    }

    /// The law for patches given by their ratio of length to width and area in mm²; `limit` is the total μN in N.
    pub(crate) fn of_patches(
        elasticity: &Elasticity,
        interface: Interface,
        shapes: impl Iterator<Item = (f64, f64)>,
        limit: f64,
    ) -> CubicLaw {
        let modulus = interface.reduction * elasticity.shear_modulus;
        let mut stiffness = [0.0; 2];
        for (a_over_b, area) in shapes {
            let c = linear_theory::coefficients(a_over_b, elasticity.poisson_ratio);
            let unit = modulus * area / std::f64::consts::PI;
            for (k, stiffness) in stiffness.iter_mut().enumerate() {
                *stiffness += unit * c[k] / limit.max(f64::MIN_POSITIVE);
            }
        }
        CubicLaw { stiffness }
    }

    /// Force of linear theory over μN at which the cubic law gives the force `place` μN.
    pub(crate) fn linear(place: f64) -> f64 {
        let inside = place.abs().min(CUBIC_UNTIL);
        let slope = (1.0 - CUBIC_UNTIL).powf(-2.0 / 3.0);
        let beyond = slope * (place.abs() - inside);
        (3.0 * (1.0 - (1.0 - inside).cbrt()) + beyond).copysign(place)
    }

    pub(crate) fn creepage(&self, k: usize, place: f64) -> f64 {
        CubicLaw::linear(place) / self.stiffness[k]
    }

    pub(crate) fn place(&self, k: usize, creepage: f64) -> f64 {
        let linear = (creepage * self.stiffness[k]).abs();
        let knee = CubicLaw::linear(CUBIC_UNTIL);
        let inside = 1.0 - (1.0 - linear.min(knee) / 3.0).powi(3);
        let beyond = (linear - knee).max(0.0) * (1.0 - CUBIC_UNTIL).powf(2.0 / 3.0);
        (inside + beyond).min(PLACE_MAX).copysign(creepage)
    }

    /// Places of the creepages that give forces relative to μN by the cubic law without spin, with a common friction limit.
    pub(crate) fn places_of_forces(&self, force: [f64; 2]) -> [f64; 2] {
        let length = force[0].hypot(force[1]);
        let linear = if length > 0.0 {
            CubicLaw::linear(length.min(1.0)) / length
        } else {
            0.0
        };
        [0, 1].map(|k| self.place(k, linear * force[k] / self.stiffness[k]))
    }
}
