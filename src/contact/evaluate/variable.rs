//! The numbers of a case that may differ from row to row.

use crate::contact::case::words::object::AllowedRange;

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

/// Every variable with its place in the case and the numbers that it may have.
const VARIABLES: [(Variable, &str, AllowedRange); 12] = [
    (
        Variable::ShearModulus,
        "/material/shear_modulus_mpa",
        AllowedRange::positive(1e12, "MPa"),
    ),
    (
        Variable::YoungModulus,
        "/material/young_modulus_mpa",
        AllowedRange::positive(1e12, "MPa"),
    ),
    (
        Variable::PoissonRatio,
        "/material/poisson_ratio",
        AllowedRange::closed(0.0, 0.5, ""),
    ),
    (
        Variable::Friction,
        "/friction/coefficient",
        AllowedRange::closed(0.0, 100.0, ""),
    ),
    (
        Variable::Rolling,
        "/contact/rolling_mm",
        AllowedRange::positive(1e9, "mm"),
    ),
    (
        Variable::Lateral,
        "/contact/lateral_mm",
        AllowedRange::positive(1e9, "mm"),
    ),
    (
        Variable::SemiAxisA,
        "/contact/a_mm",
        AllowedRange::positive(1e6, "mm"),
    ),
    (
        Variable::SemiAxisB,
        "/contact/b_mm",
        AllowedRange::positive(1e6, "mm"),
    ),
    (
        Variable::NormalForce,
        "/load/normal_force_n",
        AllowedRange::positive(1e12, "N"),
    ),
    (
        Variable::CreepageX,
        "/motion/creepage_x",
        AllowedRange::closed(-1e6, 1e6, ""),
    ),
    (
        Variable::CreepageY,
        "/motion/creepage_y",
        AllowedRange::closed(-1e6, 1e6, ""),
    ),
    (
        Variable::Spin,
        "/motion/spin_per_mm",
        AllowedRange::closed(-1e6, 1e6, "1/mm"),
    ),
];

impl Variable {
    /// Every variable.
    pub fn all() -> impl Iterator<Item = Variable> {
        VARIABLES.iter().map(|(variable, ..)| *variable)
    }

    /// The variable at a place of the case.
    #[must_use]
    pub fn at(pointer: &str) -> Option<Variable> {
        let found = VARIABLES.iter().find(|(_, at, _)| *at == pointer);
        found.map(|(variable, ..)| *variable)
    }

    /// Its number in a case that leaves it out: creepages and spin are 0 then, anything else is not asked for.
    #[must_use]
    pub fn absent(self) -> f64 {
        match self {
            Variable::CreepageX | Variable::CreepageY | Variable::Spin => 0.0,
            _ => f64::NAN,
        }
    }

    /// Its place in the case, a JSON pointer.
    #[must_use]
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
