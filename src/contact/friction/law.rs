//! Coulomb friction: the largest traction of a cell and the largest tangential force of a patch.
//!
//! A law that varies over the contact is a variant of [`FrictionLaw`]. Meshes take their traction bounds strip by strip from
//! [`FrictionLaw::share`], and values relative to μN use [`FrictionLaw::limit`]. If the bound of a cell decreases with its slip, these are the bounds
//! without slip, and the method applies [`FrictionLaw::bound_fall`].

use std::borrow::Borrow;

use crate::friction::coefficient_table::CoefficientTable;
use crate::friction::path_dependent::HeatedLaw;
use crate::friction::velocity_weakening::{FallingLaw, STABILITY_MAX, Softening};
use crate::geometry::wheel_rail::WheelRail;
use crate::mesh::SIDE_GOOD;
use crate::normal::footprint::{Footprint, LoadAcross};
use crate::normal::hertz::Patch;
use crate::numerics::roots::bounds;

/// The coefficient of friction over the contact.
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
    /// A coefficient that varies along the track, over which a history passes. Bounds and limits are those of the largest coefficient; the history
    /// scales them step by step.
    Along(CoefficientTable),
}

impl FrictionLaw {
    /// The largest coefficient, which scales the tractions.
    pub fn largest(&self) -> f64 {
        match self {
            FrictionLaw::Constant(coefficient) => *coefficient,
            FrictionLaw::Falling(law) => law.at_rest(),
            FrictionLaw::Across(law) => law.largest(),
            FrictionLaw::Heated(law) => law.largest(),
            FrictionLaw::Along(law) => law.largest(),
        }
    }

    /// Returns whether there is no friction at all.
    pub fn is_frictionless(&self) -> bool {
        self.largest() == 0.0
    }

    /// The decrease of the bounds of cells with their slip at a rolling speed in mm/s, for slips in units of `slip_unit`. Returns `None` if they are
    /// constant or the speed is unknown.
    pub fn bound_fall(&self, rolling_speed: Option<f64>, slip_unit: f64) -> Option<Softening> {
        match self {
            FrictionLaw::Falling(law) => Some(law.bound_fall(rolling_speed?, slip_unit)),
            _ => None,
        }
    }

    /// Returns whether bounds depend on the slip, directly or through the heat.
    pub fn depends_on_slip(&self) -> bool {
        matches!(self, FrictionLaw::Falling(_) | FrictionLaw::Heated(_))
    }

    /// The largest number of cells in a strip with a layer of a flexibility in mm/MPa at a rolling speed; see [`FallingLaw::cells_along_max`].
    /// Infinite without a layer and for other laws.
    pub fn cells_along_max(&self, patches: &[Patch], layer: f64, speed: Option<f64>) -> f64 {
        let (FrictionLaw::Falling(law), Some(speed)) = (self, speed) else {
            return f64::INFINITY;
        };
        let cells = patches
            .iter()
            .map(|patch| law.cells_along_max(speed, patch, layer));
        cells.fold(f64::INFINITY, f64::min)
    }

    /// The reason if friction falls too fast for one reliable answer at these rolling speeds, by the largest stability number of the patches and
    /// the number of cells that a layer of a flexibility in mm/MPa allows; see [`FallingLaw::stability`], [`FallingLaw::cells_along_max`] and
    /// [`HeatedLaw::stability`]. Returns `None` for other laws, without patches and without speeds.
    pub fn too_fast(
        &self,
        patches: &[Patch],
        (shear_modulus, layer): (f64, f64),
        speeds: &[Option<f64>],
    ) -> Option<String> {
        let speed = speeds.iter().copied().flatten().reduce(f64::max)?;
        let most = |of: &dyn Fn(&Patch) -> f64| patches.iter().map(of).reduce(f64::max);
        match self {
            FrictionLaw::Constant(_) | FrictionLaw::Across(_) | FrictionLaw::Along(_) => None,
            FrictionLaw::Falling(law) => {
                let of = |patch: &Patch| law.stability(speed, patch.pressure_max, shear_modulus);
                too_fast(
                    most(&of)?,
                    "slip",
                    "rolling speed, fall and largest pressure",
                )
                .or_else(|| self.too_fast_for_layer(patches, layer, speed))
            }
            FrictionLaw::Heated(law) => {
                let of = |patch: &Patch| {
                    let half_length = 0.5 * (patch.extent[1] - patch.extent[0]);
                    law.stability(speed, patch.pressure_max, half_length, shear_modulus)
                };
                let factors = "the fall per K, to the square of the largest pressure and to the root of the rolling speed";
                too_fast(most(&of)?, "temperature", factors)
            }
        }
    }

    fn too_fast_for_layer(&self, patches: &[Patch], layer: f64, speed: f64) -> Option<String> {
        let cells = self.cells_along_max(patches, layer, Some(speed));
        (cells < f64::from(SIDE_GOOD)).then(|| {
            format!(
                "friction falls too fast with slip for a layer this soft: stick and slip alternate on meshes with more than {cells:.1} cells in a \
                 strip, and at least {SIDE_GOOD} cells are needed; the number is inversely proportional to rolling speed, fall, largest pressure and \
                 thickness over modulus of the layer"
            )
        })
    }

    /// The law by temperature, if the coefficient depends on it.
    pub fn heated(&self) -> Option<&HeatedLaw> {
        match self {
            FrictionLaw::Heated(law) => Some(law),
            _ => None,
        }
    }

    /// The table of a coefficient that varies laterally.
    pub fn across(&self) -> Option<&AcrossLaw> {
        match self {
            FrictionLaw::Across(law) => Some(law),
            _ => None,
        }
    }

    /// The table of a coefficient that varies along the track.
    pub fn along(&self) -> Option<&CoefficientTable> {
        match self {
            FrictionLaw::Along(law) => Some(law),
            _ => None,
        }
    }

    /// The mean coefficient over the loads `(y, load)` of a strip, relative to the largest one. It is exactly 1 if the coefficient does not vary
    /// laterally, so that bounds keep the last digit of the pressure and a contact without friction has bounds too.
    pub fn share(&self, loads: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        self.across()
            .map_or(1.0, |law| law.mean(loads) / law.largest())
    }

    /// Friction limit in N of a patch: the largest tangential force it can carry, `μN` for a constant coefficient.
    pub fn limit(&self, footprint: &Footprint, patch: usize) -> f64 {
        let force = footprint.patches()[patch].normal_force;
        self.limit_under(force, || footprint.load_across(patch))
    }

    /// Friction limit in N of a patch with a normal force in N. `load` is called if the coefficient varies laterally.
    pub fn limit_under<L: Borrow<LoadAcross>>(
        &self,
        normal_force: f64,
        load: impl FnOnce() -> L,
    ) -> f64 {
        let across = self.across().map(|law| law.mean_over(load().borrow()));
        across.unwrap_or_else(|| self.largest()) * normal_force
    }

    /// Friction limit in N of all patches together.
    pub fn limit_of_all(&self, footprint: &Footprint) -> f64 {
        let patches = footprint.patches();
        match self {
            FrictionLaw::Constant(coefficient) => {
                coefficient * patches.iter().map(|patch| patch.normal_force).sum::<f64>()
            }
            _ => (0..patches.len()).map(|k| self.limit(footprint, k)).sum(),
        }
    }
}

/// The message about a stability number that is too large for one reliable answer. The number describes how fast friction falls with `variable`,
/// and is proportional to `factors`.
fn too_fast(stability: f64, variable: &str, factors: &str) -> Option<String> {
    (stability > STABILITY_MAX).then(|| {
        format!(
            "friction falls too fast with {variable} for one reliable answer: the stability number is {stability:.3}, at most {STABILITY_MAX} \
             is allowed; it is proportional to {factors}"
        )
    })
}

/// Number of samples of a coefficient that varies over the rail, across all patches.
const SAMPLES: usize = 129;

/// Friction in the coordinates of the surface of a rail, from an origin `[x, s]`.
///
/// A coefficient by y of the rail's profile or by the inclination of its surface becomes one by the arc length, and one by the position along the
/// track becomes one by x. The patches have the extents `[x_min, x_max, s_min, s_max]` in mm. `rail` returns the parameter of the rail's curve at an
/// arc length.
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
    let [low, high] = bounds(extents.flat_map(|[.., low, high]| [low - s, high - s]));
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

/// The variable of a table that varies laterally.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AcrossPlace {
    /// y in mm: of the axes of the footprint, or of the rail's profile until the frame of a patch is known.
    Y,
    /// Inclination of the rail's surface in rad. It is converted to y in the frame of a patch.
    Angle,
}

/// A coefficient of friction that varies laterally.
#[derive(Debug, Clone, PartialEq)]
pub struct AcrossLaw {
    /// The variable of the table.
    pub place: AcrossPlace,
    table: CoefficientTable,
}

impl AcrossLaw {
    /// Makes a law from values of the variable, in order, and as many coefficients, at least one.
    pub fn new(place: AcrossPlace, at: &[f64], coefficient: &[f64]) -> AcrossLaw {
        AcrossLaw {
            place,
            table: CoefficientTable::new(at, coefficient),
        }
    }

    /// The coefficient at a value. At a jump, that of the side of larger values is returned.
    pub fn at(&self, place: f64) -> f64 {
        self.table.at(place).0
    }

    /// The largest coefficient.
    pub fn largest(&self) -> f64 {
        self.table.largest()
    }

    /// The mean coefficient weighted with loads, or the plain mean if all loads are 0.
    pub fn mean(&self, loads: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        let weighted = |weight: fn(f64) -> f64| {
            let sums = loads.clone().map(|(y, load)| (weight(load), self.at(y)));
            sums.fold((0.0, 0.0), |sum, (load, mu)| {
                (sum.0 + load, sum.1 + load * mu)
            })
        };
        match weighted(|load| load) {
            (load, sum) if load > 0.0 => sum / load,
            _ => {
                let (count, sum) = weighted(|_| 1.0);
                if count > 0.0 { sum / count } else { 0.0 }
            }
        }
    }

    /// The mean coefficient over a load.
    pub fn mean_over(&self, load: &LoadAcross) -> f64 {
        load.mean(self.table.points())
    }
}

#[cfg(test)]
mod coefficient_table_tests {
    use super::*;

    fn law() -> AcrossLaw {
        AcrossLaw::new(
            AcrossPlace::Y,
            &[-1.0, 1.0, 1.0, 2.0],
            &[0.1, 0.3, 0.5, 0.2],
        )
    }

    #[test]
    fn the_mean_over_an_ellipse_is_the_integral_of_its_load() {
        let law = law();
        let count = 400_000_u32;
        for extent in [[-0.5, 2.5], [-3.0, -1.5], [0.9, 1.1], [1.5, 9.0]] {
            let samples = (0..count).map(|k| {
                let eta = f64::from(2 * k + 1) / f64::from(count) - 1.0;
                let y = 0.5 * (extent[0] + extent[1]) + 0.5 * (extent[1] - extent[0]) * eta;
                (y, 1.0 - eta * eta)
            });
            let mean = law.mean_over(&LoadAcross::of_ellipse(extent));
            assert!((mean / law.mean(samples) - 1.0).abs() < 1e-5, "{extent:?}");
        }
    }

    #[test]
    fn coefficients_are_linear_between_points_jump_at_pairs_and_end_constant() {
        let known = [
            (-9.0, 0.1),
            (-1.0, 0.1),
            (0.0, 0.2),
            (1.0, 0.5),
            (1.5, 0.35),
            (2.0, 0.2),
            (7.0, 0.2),
        ];
        for (y, mu) in known {
            assert!((law().at(y) - mu).abs() < 1e-15, "{y}");
        }
        assert!((law().at(1.0 - 1e-12) - 0.3).abs() < 1e-12);
        assert_eq!(law().largest(), 0.5);
    }

    #[test]
    fn an_even_table_carries_its_coefficient_times_the_load() {
        let load = LoadAcross::of_ellipse([-2.0, 3.0]);
        let even = AcrossLaw::new(AcrossPlace::Y, &[0.0, 1.0], &[0.3, 0.3]);
        assert!((even.mean_over(&load) - 0.3).abs() < 1e-14);
        // A straight line has the value of its middle.
        let slope = AcrossLaw::new(AcrossPlace::Y, &[-10.0, 10.0], &[0.0, 0.4]);
        assert!((slope.mean_over(&load) - 0.21).abs() < 1e-14);
        assert_eq!(slope.mean([(0.0, 0.0), (5.0, 0.0)].into_iter()), 0.25);
    }

    #[test]
    fn means_are_integrals_over_their_length() {
        let law = CoefficientTable::new(&[-1.0, 1.0, 1.0, 2.0], &[0.1, 0.3, 0.5, 0.2]);
        let known = [
            (-5.0, -2.0, 0.1),
            (-1.0, 1.0, 0.2),
            (0.0, 2.0, 0.5 * (0.25 + 0.35)),
            (1.0, 2.0, 0.35),
            (1.5, 2.5, 0.5 * (0.275 + 0.2)),
            (3.0, 9.0, 0.2),
        ];
        for (from, to, mean) in known {
            assert!(
                (law.mean_between(from, to) - mean).abs() < 1e-15,
                "{from} to {to}"
            );
        }
        assert_eq!(law.mean_between(0.5, 0.5), law.at(0.5).0);
        assert_eq!(law.largest(), 0.5);
    }

    #[test]
    fn an_even_table_has_its_coefficient_everywhere() {
        let law = CoefficientTable::new(&[0.0, 1.0], &[0.3, 0.3]);
        for from in [-1e6, -0.3, 0.4, 0.99, 7.0] {
            assert!((law.mean_between(from, from + 0.7) - 0.3).abs() < 1e-15);
        }
    }
}
