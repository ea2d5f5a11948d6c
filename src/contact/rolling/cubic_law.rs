//! The cubic law of Vermeulen and Johnson with Kalker's coefficients: about which creepage gives which force.

use crate::contact::numerics::bracketed_root::FRACTION_MAX;
use crate::contact::rolling::linear_theory;
use crate::contact::rolling::task::RollingTask;

/// From this place on the cubic law is continued by its tangent. Chosen by judgement; how much it matters was not measured.
const CUBIC_UNTIL: f64 = 0.9;

/// The cubic law of a problem.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CubicLaw {
    /// Force of linear theory over μN and creepage, along x and across.
    pub(crate) stiffness: [f64; 2],
}

impl CubicLaw {
    pub(crate) fn new(task: &RollingTask, limit: f64) -> CubicLaw {
        let mut stiffness = [0.0; 2];
        for patch in task.footprint.patches() {
            let extent = patch.extent;
            let box_ratio = (extent[1] - extent[0]) / (extent[3] - extent[2]);
            let a_over_b = patch.semi_axes.map_or(box_ratio, |[a, b]| a / b);
            let c = linear_theory::coefficients(a_over_b, task.elasticity.poisson_ratio);
            let modulus = task.interface.reduction * task.elasticity.shear_modulus;
            let unit = modulus * patch.area / std::f64::consts::PI;
            for (k, stiffness) in stiffness.iter_mut().enumerate() {
                *stiffness += unit * c[k] / limit;
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
        (inside + beyond).min(FRACTION_MAX).copysign(creepage)
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
