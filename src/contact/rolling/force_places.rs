//! Places of creepages: the unknowns of the search for prescribed forces, and where it starts.
//!
//! By Vermeulen and Johnson's cubic law with Kalker's coefficients (Vermeulen & Johnson 1964; Kalker 1990, §2.2.3) the creepage at
//! place r gives the force r μN, so that the force found is close to r. A search starts where the table of creep forces has the forces.

use std::convert::Infallible;

use crate::contact::friction::path_dependent::Interface;
use crate::contact::half_space::unlike_bodies::Elasticity;
use crate::contact::numerics::equilibrium::{Search, Trial};
use crate::contact::rolling::answer::Resultants;
use crate::contact::rolling::linear_theory;
use crate::contact::rolling::load_ellipse::LoadEllipse;
use crate::contact::rolling::methods::table::solve as table;
use crate::contact::rolling::refinement::interpolate::RefinementState;
use crate::contact::rolling::task::{Motion, PrescribedForces, RollingTask};

/// Largest place: a hundred times the creepage at which the cubic law predicts full slip. Chosen by judgement; how much it matters was not
/// measured.
pub(crate) const PLACE_MAX: f64 = 65.0;
/// The start is good enough when the table misses the forces by no more than this, relative to μN: about what the table is off.
const TABLE_MISSED: f64 = 1e-3;

/// The map between places and motions.
pub(crate) struct ForcePlaces<'a> {
    task: &'a RollingTask<'a>,
    forces: PrescribedForces,
    /// μN of all patches in N.
    limit: f64,
    law: CubicLaw,
    /// The ellipses that stand for the patches, where the table can tell a start.
    ellipses: Vec<LoadEllipse>,
}

impl<'a> ForcePlaces<'a> {
    /// Of forces to be found; `limit` is μN of all patches in N.
    pub(crate) fn new(
        task: &'a RollingTask<'a>,
        state: &RefinementState,
        limit: f64,
        forces: PrescribedForces,
    ) -> ForcePlaces<'a> {
        let ellipses = if table::tells(task.elasticity, task.interface, task.friction) {
            state.ellipses().to_vec()
        } else {
            Vec::new()
        };
        ForcePlaces {
            task,
            forces,
            limit,
            law: CubicLaw::new(task, limit),
            ellipses,
        }
    }

    /// Places to start from.
    pub(crate) fn start(&self, given: &Motion) -> [f64; 2] {
        let wanted = self.forces.map(|f| f.unwrap_or(0.0) / self.limit);
        self.guess(wanted, given)
    }

    /// Places of the creepages that give forces relative to μN: by the table with the rest of a motion, or by the cubic law without spin.
    fn guess(&self, force: [f64; 2], rest: &Motion) -> [f64; 2] {
        let cubic = self.law.places_of_forces(force);
        self.by_table(force, rest, cubic).unwrap_or(cubic)
    }

    /// A search for the places of the prescribed forces: a force over μN is close to its place.
    pub(crate) fn search(&self) -> Search<2> {
        Search::new(self.forces.map(|force| force.map(|_| 1.0)), [PLACE_MAX; 2])
    }

    /// Places at which the table has the forces, from a start.
    fn by_table(&self, force: [f64; 2], rest: &Motion, start: [f64; 2]) -> Option<[f64; 2]> {
        if self.ellipses.is_empty() {
            return None;
        }
        let modulus = self.task.interface.reduction * self.task.elasticity.shear_modulus;
        let poisson_ratio = self.task.elasticity.poisson_ratio;
        let Ok(found) = self.search().find(start, |place| {
            let motion = self.motion(place, rest);
            let mut found = [0.0; 2];
            for (k, ellipse) in self.ellipses.iter().enumerate() {
                let limit = self.task.friction.limit(self.task.footprint, k);
                let own = table::forces(modulus, poisson_ratio, ellipse, limit, &motion);
                found = [0, 1].map(|k| found[k] + own[k] / self.limit);
            }
            Ok::<_, Infallible>(Trial {
                residual: [0, 1].map(|k| found[k] - force[k]),
                tolerance: TABLE_MISSED,
                value: (),
            })
        });
        found.converged().then_some(found.place)
    }

    /// A motion with the creepages of these places where forces are prescribed.
    pub(crate) fn motion(&self, place: [f64; 2], given: &Motion) -> Motion {
        let creepage = |k: usize, given: f64| match self.forces[k] {
            Some(_) => self.law.creepage(k, place[k]),
            None => given,
        };
        Motion {
            creepage_x: creepage(0, given.creepage_x),
            creepage_y: creepage(1, given.creepage_y),
            ..*given
        }
    }
}

/// The sum of the resultants of all patches.
pub(crate) fn total(resultants: &[Resultants]) -> Resultants {
    let sum = Resultants::default();
    resultants.iter().fold(sum, |sum, r| sum.plus(*r))
}

/// Length of two components.
pub(crate) fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// From this place on the cubic law is continued by its tangent. Chosen by judgement; how much it matters was not measured.
const CUBIC_UNTIL: f64 = 0.9;

/// The cubic law of a problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CubicLaw {
    /// Force of linear theory over μN and creepage, along x and across.
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

    /// The law of patches with these ratios of length to width and areas in mm²; `limit` is μN of all in N.
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

    /// Places of the creepages that give forces relative to μN by the cubic law without spin, where both share the friction.
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
