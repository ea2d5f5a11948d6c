//! Friction of a rail in the axes of its patches.

use crate::contact::friction::coefficient_table::{AcrossLaw, AcrossPlace};
use crate::contact::friction::law::FrictionLaw;
use crate::contact::geometry::wheel_rail::WheelRail;

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
