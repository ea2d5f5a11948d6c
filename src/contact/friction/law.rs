//! Coulomb friction: the largest traction of a cell and the largest tangential force of a patch.
//!
//! A law that varies over the contact, such as a coefficient by y, is one more variant of [`FrictionLaw`], and the compiler asks
//! for its value at a cell, its largest value and what a patch carries with it. Levels take their bounds cell by cell from
//! [`FrictionLaw::bounds`]; what is relative to μN takes it from [`FrictionLaw::limit`].

use crate::contact::normal::patch::Patch;

/// How the coefficient of friction varies over the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// One coefficient μ everywhere.
    Constant(f64),
}

impl FrictionLaw {
    /// The largest coefficient, which scales the tractions.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match *self {
            FrictionLaw::Constant(coefficient) => coefficient,
        }
    }

    /// Is there no friction at all?
    #[must_use]
    pub fn is_frictionless(&self) -> bool {
        self.largest() == 0.0
    }

    /// Largest traction of every cell, in units of the largest coefficient times `pressure_max`, for cells with these middles in mm
    /// and these pressures.
    #[must_use]
    pub fn bounds(
        &self,
        middles: impl Iterator<Item = [f64; 2]>,
        pressures: &[f64],
        pressure_max: f64,
    ) -> Vec<f64> {
        let cells = middles.zip(pressures);
        cells
            .map(|(middle, pressure)| self.relative(middle) * pressure / pressure_max)
            .collect()
    }

    /// The coefficient of a cell relative to the largest one. Exactly 1 where the coefficient is constant, so that bounds keep
    /// the last digit of the pressure and a contact without friction has bounds too.
    fn relative(&self, _middle: [f64; 2]) -> f64 {
        match self {
            FrictionLaw::Constant(_) => 1.0,
        }
    }

    /// Friction limit of a patch in N: the largest tangential force it can carry, `μN` for a constant coefficient.
    #[must_use]
    pub fn limit(&self, patch: &Patch) -> f64 {
        match self {
            FrictionLaw::Constant(coefficient) => coefficient * patch.normal_force,
        }
    }

    /// The same for all patches together.
    #[must_use]
    pub fn limit_of_all(&self, patches: &[Patch]) -> f64 {
        match self {
            FrictionLaw::Constant(coefficient) => {
                coefficient * patches.iter().map(|patch| patch.normal_force).sum::<f64>()
            }
        }
    }
}
