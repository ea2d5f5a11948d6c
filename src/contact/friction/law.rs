//! Coulomb friction: the largest traction of a cell and the largest tangential force of a patch.
//!
//! A law that varies over the contact is one more variant of [`FrictionLaw`], and the compiler asks for its value on a strip, its largest
//! value and what a patch carries with it. Levels take their bounds strip by strip from [`FrictionLaw::share`]; what is relative to μN
//! takes it from [`FrictionLaw::limit`]. Where the bound of a cell falls with its slip, these are the bounds at rest, and the method
//! follows [`FrictionLaw::bound_fall`] from there.
//!
//! Friction of a rail in the axes of its patches.

use std::borrow::Borrow;

use crate::contact::friction::coefficient_table::{AcrossLaw, AcrossPlace, AlongLaw};
use crate::contact::friction::path_dependent::HeatedLaw;
use crate::contact::friction::velocity_weakening::{FallingLaw, Softening};
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::footprint::{Footprint, LoadAcross};
use crate::contact::normal::hertz::Patch;

/// How the coefficient of friction varies over the contact.
#[derive(Debug, Clone, PartialEq)]
pub enum FrictionLaw {
    /// One coefficient μ everywhere.
    Constant(f64),
    /// A coefficient that falls with the speed of slip.
    Falling(FallingLaw),
    /// A coefficient that varies across the contact.
    Across(AcrossLaw),
    /// A coefficient that falls with the temperature of the contact.
    Heated(HeatedLaw),
    /// A coefficient that varies along the track, which a history passes over. Bounds and limits told here are those of the largest one; the
    /// history takes its part of them step by step.
    Along(AlongLaw),
}

impl FrictionLaw {
    /// The largest coefficient, which scales the tractions.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match self {
            FrictionLaw::Constant(coefficient) => *coefficient,
            FrictionLaw::Falling(law) => law.at_rest(),
            FrictionLaw::Across(law) => law.largest(),
            FrictionLaw::Heated(law) => law.largest(),
            FrictionLaw::Along(law) => law.largest(),
        }
    }

    /// Is there no friction at all?
    #[must_use]
    pub fn is_frictionless(&self) -> bool {
        self.largest() == 0.0
    }

    /// How the bounds of cells fall with their slip at a rolling speed in mm/s, for slips counted in `slip_unit`; nothing where they
    /// do not.
    #[must_use]
    pub fn bound_fall(&self, rolling_speed: Option<f64>, slip_unit: f64) -> Option<Softening> {
        match self {
            FrictionLaw::Constant(_)
            | FrictionLaw::Across(_)
            | FrictionLaw::Heated(_)
            | FrictionLaw::Along(_) => None,
            FrictionLaw::Falling(law) => {
                rolling_speed.map(|speed| law.bound_fall(speed, slip_unit))
            }
        }
    }

    /// Do bounds depend on slips, at once or by the heat that they make?
    #[must_use]
    pub fn depends_on_slip(&self) -> bool {
        matches!(self, FrictionLaw::Falling(_) | FrictionLaw::Heated(_))
    }

    /// Why friction falls too fast for one reliable answer on patches at rolling speeds, if it does: by the largest stability number, see
    /// [`FallingLaw::stability`] and [`HeatedLaw::stability`]; nothing for other laws, without patches or without speeds.
    #[must_use]
    pub fn too_fast(
        &self,
        patches: &[Patch],
        shear_modulus: f64,
        speeds: &[Option<f64>],
    ) -> Option<String> {
        let speed = speeds.iter().copied().flatten().reduce(f64::max)?;
        let most = |of: &dyn Fn(&Patch) -> f64| patches.iter().map(of).reduce(f64::max);
        match self {
            FrictionLaw::Constant(_) | FrictionLaw::Across(_) | FrictionLaw::Along(_) => None,
            FrictionLaw::Falling(law) => {
                let of = |patch: &Patch| law.stability(speed, patch.pressure_max, shear_modulus);
                FallingLaw::too_fast(most(&of)?)
            }
            FrictionLaw::Heated(law) => {
                let of = |patch: &Patch| {
                    let half_length = 0.5 * (patch.extent[1] - patch.extent[0]);
                    law.stability(speed, patch.pressure_max, half_length, shear_modulus)
                };
                HeatedLaw::too_fast(most(&of)?)
            }
        }
    }

    /// The law by temperature, where the coefficient falls with it.
    #[must_use]
    pub fn heated(&self) -> Option<&HeatedLaw> {
        match self {
            FrictionLaw::Heated(law) => Some(law),
            _ => None,
        }
    }

    /// The table of a coefficient that varies across, where it does.
    #[must_use]
    pub fn across(&self) -> Option<&AcrossLaw> {
        match self {
            FrictionLaw::Across(law) => Some(law),
            FrictionLaw::Constant(_)
            | FrictionLaw::Falling(_)
            | FrictionLaw::Heated(_)
            | FrictionLaw::Along(_) => None,
        }
    }

    /// The table of a coefficient that varies along the track, where it does.
    #[must_use]
    pub fn along(&self) -> Option<&AlongLaw> {
        match self {
            FrictionLaw::Along(law) => Some(law),
            _ => None,
        }
    }

    /// The mean coefficient over loads at places y of a strip, relative to the largest. Exactly 1 where it does not vary across, so that
    /// bounds keep the last digit of the pressure and a contact without friction has bounds too.
    #[must_use]
    pub fn share(&self, loads: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        match self {
            FrictionLaw::Constant(_)
            | FrictionLaw::Falling(_)
            | FrictionLaw::Heated(_)
            | FrictionLaw::Along(_) => 1.0,
            FrictionLaw::Across(law) => law.mean(loads) / law.largest(),
        }
    }

    /// Friction limit in N of a patch: the largest tangential force it can carry, `μN` for a constant coefficient.
    #[must_use]
    pub fn limit(&self, footprint: &Footprint, patch: usize) -> f64 {
        let force = footprint.patches()[patch].normal_force;
        self.limit_under(force, || footprint.load_across(patch))
    }

    /// The same of a patch with a normal force in N and a load, which is asked for where the coefficient varies across.
    #[must_use]
    pub fn limit_under<L: Borrow<LoadAcross>>(
        &self,
        normal_force: f64,
        load: impl FnOnce() -> L,
    ) -> f64 {
        match self {
            FrictionLaw::Constant(_)
            | FrictionLaw::Falling(_)
            | FrictionLaw::Heated(_)
            | FrictionLaw::Along(_) => self.largest() * normal_force,
            FrictionLaw::Across(law) => law.mean_over(load().borrow()) * normal_force,
        }
    }

    /// Friction limit in N of all patches together.
    #[must_use]
    pub fn limit_of_all(&self, footprint: &Footprint) -> f64 {
        let patches = footprint.patches();
        match self {
            FrictionLaw::Constant(coefficient) => {
                coefficient * patches.iter().map(|patch| patch.normal_force).sum::<f64>()
            }
            FrictionLaw::Falling(_)
            | FrictionLaw::Across(_)
            | FrictionLaw::Heated(_)
            | FrictionLaw::Along(_) => (0..patches.len()).map(|k| self.limit(footprint, k)).sum(),
        }
    }
}

/// Samples of a coefficient that varies over the rail, across all patches.
const SAMPLES: usize = 129;

/// Friction in the axes of the surface of a rail whose patches have these extents `[x_min, x_max, s_min, s_max]` in mm along its cross-section: a
/// coefficient by the y of the rail's profile, or by the inclination of its surface, becomes one by the arc length from an origin `[x, s]`, and one by
/// the place along the track becomes one by x. `rail` gives the parameter of the rail's curve by the arc length.
pub(crate) fn on_rail(
    friction: &FrictionLaw,
    geometry: &WheelRail,
    extents: impl Iterator<Item = [f64; 4]>,
    [x, s]: [f64; 2],
    rail: impl Fn(f64) -> f64,
) -> FrictionLaw {
    if let Some(law) = friction.along() {
        return FrictionLaw::Along(law.about(x));
    }
    let Some(law) = friction.across() else {
        return friction.clone();
    };
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = extents.fold(nothing, |(low, high), e| {
        (low.min(e[2] - s), high.max(e[3] - s))
    });
    let step = (high - low) / (SAMPLES - 1) as f64;
    let found = (0..SAMPLES).map(|k| {
        let y = low + k as f64 * step;
        let rail = rail(s + y);
        let at = match law.place {
            AcrossPlace::Y => geometry.on_rail(rail)[0],
            AcrossPlace::Angle => {
                let [across, up] = geometry.rail_at(rail).slope;
                (up * across.signum()).atan2(across.abs())
            }
        };
        (y, law.at(at))
    });
    let (y, coefficient): (Vec<f64>, Vec<f64>) = found.unzip();
    FrictionLaw::Across(AcrossLaw::new(AcrossPlace::Y, &y, &coefficient))
}
