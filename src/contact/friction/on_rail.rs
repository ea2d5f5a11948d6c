//! Friction of a rail in the axes of one of its patches.

use crate::contact::friction::coefficient_table::{AcrossLaw, AcrossPlace};
use crate::contact::friction::law::FrictionLaw;
use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::wheel_rail::WheelRail;

/// Samples of a coefficient that varies over the rail, across all patches of a frame.
const SAMPLES: usize = 129;

/// Friction in the axes of a frame whose patches have these extents `[x_min, x_max, y_min, y_max]` in mm: a coefficient by the y of the
/// rail's profile, or by the inclination of its surface, becomes one by the y of the frame; one by the place along the track becomes one by
/// the x of the frame, whose origin lies ahead of or behind that of the track if the wheel is yawed.
pub(crate) fn in_frame(
    friction: &FrictionLaw,
    frame: &Frame,
    geometry: &WheelRail,
    extents: impl Iterator<Item = [f64; 4]>,
) -> FrictionLaw {
    // Where the rail turns away from the plane nothing touches.
    on_rail(friction, geometry, extents, frame.origin[0], |y| {
        geometry.rail_over(frame, y).ok()
    })
}

/// Friction in the axes of the surface of a rail whose patches have these extents `[x_min, x_max, s_min, s_max]` in mm along its cross-section: a
/// coefficient by the y of the rail's profile, or by the inclination of its surface, becomes one by the arc length from an origin `[x, s]`, and one by
/// the place along the track becomes one by x. `rail` gives the parameter of the rail's curve by the arc length.
pub(crate) fn on_curve(
    friction: &FrictionLaw,
    geometry: &WheelRail,
    extents: impl Iterator<Item = [f64; 4]>,
    [x, s]: [f64; 2],
    rail: impl Fn(f64) -> f64,
) -> FrictionLaw {
    let extents = extents.map(|[x_min, x_max, low, high]| [x_min, x_max, low - s, high - s]);
    on_rail(friction, geometry, extents, x, |y| Some(rail(s + y)))
}

/// Friction of patches whose origin lies at x in mm of the track, and whose places y lie over parameters of the rail's curve.
fn on_rail(
    friction: &FrictionLaw,
    geometry: &WheelRail,
    extents: impl Iterator<Item = [f64; 4]>,
    x: f64,
    rail: impl Fn(f64) -> Option<f64>,
) -> FrictionLaw {
    if let Some(law) = friction.along() {
        return FrictionLaw::Along(law.about(x));
    }
    let Some(law) = friction.across() else {
        return friction.clone();
    };
    let nothing = (f64::INFINITY, f64::NEG_INFINITY);
    let (low, high) = extents.fold(nothing, |(low, high), e| (low.min(e[2]), high.max(e[3])));
    let step = (high - low) / (SAMPLES - 1) as f64;
    let found = (0..SAMPLES).filter_map(|k| {
        let y = low + k as f64 * step;
        let rail = rail(y)?;
        let at = match law.place {
            AcrossPlace::Y => geometry.on_rail(rail)[0],
            AcrossPlace::Angle => {
                let [across, up] = geometry.rail_at(rail).slope;
                (up * across.signum()).atan2(across.abs())
            }
        };
        Some((y, law.at(at)))
    });
    let (y, coefficient): (Vec<f64>, Vec<f64>) = found.unzip();
    match y.is_empty() {
        true => FrictionLaw::Constant(law.largest()),
        false => FrictionLaw::Across(AcrossLaw::new(AcrossPlace::Y, &y, &coefficient)),
    }
}
