//! Coulomb friction: the largest traction of a cell and the largest tangential force of a patch.

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

    /// The coefficient on the line `y` in mm, relative to the largest one. Exactly 1 where the coefficient is constant, so
    /// that bounds keep the last digit of the pressure.
    #[must_use]
    pub fn relative(&self, _y: f64) -> f64 {
        match self {
            FrictionLaw::Constant(_) => 1.0,
        }
    }

    /// Friction limit of a patch in N: the largest tangential force it can carry, `μN` for a constant coefficient.
    #[must_use]
    pub fn limit(&self, patch: &Patch) -> f64 {
        self.largest() * patch.normal_force
    }

    /// The same for all patches together.
    #[must_use]
    pub fn limit_of_all(&self, patches: &[Patch]) -> f64 {
        self.largest() * patches.iter().map(|patch| patch.normal_force).sum::<f64>()
    }
}
