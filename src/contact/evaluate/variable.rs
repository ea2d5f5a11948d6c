//! The numbers of a case that may differ from row to row.

use crate::case::words::object::AllowedRange;

/// A number of a case that a column can hold.
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
    /// Relative radius of curvature along rolling in mm.
    Rolling,
    /// The same across.
    Lateral,
    /// Semi-axis along rolling in mm.
    SemiAxisA,
    /// The same across.
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

/// Numbers of a row, in the order of [`VARIABLES`].
pub type Row = [f64; VARIABLES.len()];

const MODULUS: AllowedRange = AllowedRange::positive(1e12, "MPa");
const RATIO: AllowedRange = AllowedRange::closed(0.0, 0.5, "");
const COEFFICIENT: AllowedRange = AllowedRange::closed(0.0, 100.0, "");
const RADIUS: AllowedRange = AllowedRange::positive(1e9, "mm");
const AXIS: AllowedRange = AllowedRange::positive(1e6, "mm");
const FORCE: AllowedRange = AllowedRange::positive(1e12, "N");
const CREEPAGE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "");
const SPIN: AllowedRange = AllowedRange::closed(-1e6, 1e6, "1/mm");

/// Every variable with its place in the case and the numbers that it may have.
const VARIABLES: [(Variable, &str, AllowedRange); 12] = [
    (
        Variable::ShearModulus,
        "/material/shear_modulus_mpa",
        MODULUS,
    ),
    (
        Variable::YoungModulus,
        "/material/young_modulus_mpa",
        MODULUS,
    ),
    (Variable::PoissonRatio, "/material/poisson_ratio", RATIO),
    (Variable::Friction, "/friction/coefficient", COEFFICIENT),
    (Variable::Rolling, "/contact/rolling_mm", RADIUS),
    (Variable::Lateral, "/contact/lateral_mm", RADIUS),
    (Variable::SemiAxisA, "/contact/a_mm", AXIS),
    (Variable::SemiAxisB, "/contact/b_mm", AXIS),
    (Variable::NormalForce, "/load/normal_force_n", FORCE),
    (Variable::CreepageX, "/motion/creepage_x", CREEPAGE),
    (Variable::CreepageY, "/motion/creepage_y", CREEPAGE),
    (Variable::Spin, "/motion/spin_per_mm", SPIN),
];

impl Variable {
    /// Every variable.
    pub fn all() -> impl Iterator<Item = Variable> {
        VARIABLES.iter().map(|(variable, ..)| *variable)
    }

    /// The variable at a place of the case.
    pub fn at(pointer: &str) -> Option<Variable> {
        let found = VARIABLES.iter().find(|(_, at, _)| *at == pointer);
        found.map(|(variable, ..)| *variable)
    }

    /// Its number in a case that leaves it out: creepages and spin are 0 then, anything else is not asked for.
    pub fn absent(self) -> f64 {
        match self {
            Variable::CreepageX | Variable::CreepageY | Variable::Spin => 0.0,
            _ => f64::NAN,
        }
    }

    /// Its place in the case, a JSON pointer.
    pub fn pointer(self) -> &'static str {
        VARIABLES[self as usize].1
    }

    /// The numbers that it may have.
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
