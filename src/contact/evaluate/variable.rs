//! The numbers of a case that columns of rows can replace without a check of each row.

use crate::case::words::contact::FORCE;
use crate::case::words::object::AllowedRange;

/// A number of a case that a column can replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// Shear modulus in MPa.
    ShearModulus,
    /// Young's modulus in MPa.
    YoungModulus,
    /// Poisson's ratio.
    PoissonRatio,
    /// Coefficient of friction.
    Friction,
    /// Relative radius of curvature in the rolling direction in mm.
    Rolling,
    /// Relative radius of curvature in the lateral direction in mm.
    Lateral,
    /// Semi-axis in the rolling direction in mm.
    SemiAxisA,
    /// Semi-axis in the lateral direction in mm.
    SemiAxisB,
    /// Normal force in N.
    NormalForce,
    /// Longitudinal creepage.
    CreepageX,
    /// Lateral creepage.
    CreepageY,
    /// Spin in 1/mm.
    Spin,
}

/// The numbers of a row, in the order of [`VARIABLES`].
pub type Row = [f64; VARIABLES.len()];

const MODULUS: AllowedRange = AllowedRange::positive(1e12, "MPa");
const RATIO: AllowedRange = AllowedRange::closed(0.0, 0.5, "");
const COEFFICIENT: AllowedRange = AllowedRange::closed(0.0, 100.0, "");
const RADIUS: AllowedRange = AllowedRange::positive(1e9, "mm");
const AXIS: AllowedRange = AllowedRange::positive(1e6, "mm");
const CREEPAGE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "");
const SPIN: AllowedRange = AllowedRange::closed(-1e6, 1e6, "1/mm");

/// Each variable with its JSON pointer in the case and its allowed values.
const VARIABLES: [(Variable, &str, AllowedRange); 12] = {
    use Variable as V;
    [
        (V::ShearModulus, "/material/shear_modulus_mpa", MODULUS),
        (V::YoungModulus, "/material/young_modulus_mpa", MODULUS),
        (V::PoissonRatio, "/material/poisson_ratio", RATIO),
        (V::Friction, "/friction/coefficient", COEFFICIENT),
        (V::Rolling, "/contact/rolling_mm", RADIUS),
        (V::Lateral, "/contact/lateral_mm", RADIUS),
        (V::SemiAxisA, "/contact/a_mm", AXIS),
        (V::SemiAxisB, "/contact/b_mm", AXIS),
        (V::NormalForce, "/load/normal_force_n", FORCE),
        (V::CreepageX, "/motion/creepage_x", CREEPAGE),
        (V::CreepageY, "/motion/creepage_y", CREEPAGE),
        (V::Spin, "/motion/spin_per_mm", SPIN),
    ]
};

impl Variable {
    /// Returns all variables.
    pub fn all() -> impl Iterator<Item = Variable> {
        VARIABLES.iter().map(|(variable, ..)| *variable)
    }

    /// Returns the variable at a JSON pointer into the case.
    pub fn at(pointer: &str) -> Option<Variable> {
        Variable::all().find(|variable| variable.pointer() == pointer)
    }

    /// Returns its value in a case that omits it: 0 for creepages and spin, NaN for numbers that such a case does not use.
    pub fn absent(self) -> f64 {
        match self {
            Variable::CreepageX | Variable::CreepageY | Variable::Spin => 0.0,
            _ => f64::NAN,
        }
    }

    /// Its JSON pointer in the case.
    pub fn pointer(self) -> &'static str {
        VARIABLES[self as usize].1
    }

    /// Its allowed values.
    pub(crate) fn allowed(self) -> AllowedRange {
        VARIABLES[self as usize].2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_variable_stands_at_its_own_place() {
        for variable in Variable::all() {
            assert_eq!(Variable::at(variable.pointer()), Some(variable));
        }
    }
}
