//! Finds the first touch of a wheel and its rail, and estimates how far the wheel is lowered under a load.
//!
//! The rail is straight along x, so that the wheel touches it where the wheel's normal has no component along x. The wheel is
//! therefore replaced by the curve of these points, and the search takes place in the cross-section.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::geometry::envelope::{Envelope, envelope};
use crate::geometry::locus_lines::{LocusLines, LocusPoint};
use crate::geometry::wheel_rail::WheelRail;
use crate::numerics::roots::{bisect, bounds};

/// Lateral spacing of the lines in mm, half of that of the points along the curves. The height of first touch is exact as far as the rail is
/// straight over half of it.
pub(crate) const STEP: f64 = 0.04;
/// Range in mm of the estimated lowering of a wheel.
const LOWERINGS: [f64; 2] = [1e-4, 16.0];
/// Halvings of the logarithm of this range, to 0.3 %. The estimate itself is some per cent off; it decides only where the solver starts.
const LOWERING_HALVINGS: u32 = 12;

/// The lines along x on which the wheel lies above the rail.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactLocus<'g> {
    pub(crate) geometry: &'g WheelRail,
    pub(crate) lines: &'g [LocusPoint],
    /// Height of the wheel's centre in mm at which the bodies just touch.
    pub touch: f64,
}

/// Points `[y, z, s]` of the rail in mm at these parameters, for an [`envelope`].
pub(crate) fn rail_points(
    geometry: &WheelRail,
    parameters: impl IntoIterator<Item = f64>,
) -> Vec<Option<[f64; 3]>> {
    let point = |s: f64| {
        let [y, z] = geometry.rail_at(s).at;
        Some([y, z, s])
    };
    parameters.into_iter().map(point).collect()
}

/// Places the wheel above the rail and finds the height of first touch.
fn lines_of(geometry: &WheelRail) -> Result<LocusLines, String> {
    let rail: &Envelope = geometry.rail_edge.get_or_make(|| {
        let [rail, _] = geometry.parameters(2.0 * STEP);
        envelope(&rail_points(geometry, rail), STEP)
    });
    // The lowest point of every circle of the wheel, if it has one.
    let [_, wheel] = geometry.parameters(2.0 * STEP);
    let point = |s: f64| geometry.lowest(s).map(|[_, y, z]| [y, -z, s]);
    let wheel: Vec<Option<[f64; 3]>> = wheel.into_iter().map(point).collect();
    if wheel.iter().all(Option::is_none) {
        return Err(nothing_above());
    }
    let wheel = envelope(&wheel, STEP);
    let first = rail.first.max(wheel.first);
    let last = (rail.first + rail.points.len() as i64).min(wheel.first + wheel.points.len() as i64);
    let mut lines = Vec::with_capacity(usize::try_from(last - first).unwrap_or(0));
    for k in first..last {
        let (below, above) = (
            rail.points[(k - rail.first) as usize],
            wheel.points[(k - wheel.first) as usize],
        );
        if let (Some([z, rail]), Some([depth, wheel])) = (below, above) {
            lines.push(LocusPoint {
                y: k as f64 * STEP,
                clearance: -depth - z,
                rail,
                wheel,
            });
        }
    }
    if lines.len() < 3 {
        return Err(nothing_above());
    }
    let [least, _] = bounds(lines.iter().map(|line| line.clearance));
    for line in &mut lines {
        line.clearance -= least;
    }
    Ok(LocusLines {
        lines,
        touch: -least,
    })
}

fn nothing_above() -> String {
    "no part of the wheel lies above the rail; check gauge, flange-back distance and position, lateral shift".to_owned()
}

impl<'g> ContactLocus<'g> {
    /// Places the wheel above the rail and finds the height of first touch. The result is cached in the geometry.
    ///
    /// # Errors
    /// Returns a sentence if no part of the wheel lies above the rail.
    pub fn new(geometry: &'g WheelRail) -> Result<ContactLocus<'g>, String> {
        let found = geometry.locus.get_or_make(|| Arc::new(lines_of(geometry)));
        let found = found.as_ref().as_ref().map_err(String::clone)?;
        Ok(ContactLocus {
            geometry,
            lines: &found.lines,
            touch: found.touch,
        })
    }

    /// Parameters of rail and wheel at first touch. Of several such points, the one at the smallest y is returned.
    pub fn first_touch(&self) -> [f64; 2] {
        let mut lines = self.lines.iter();
        let first = lines.find(|line| line.clearance <= 0.0);
        first.map_or([0.0; 2], |line| [line.rail, line.wheel])
    }

    /// Estimates how far below first touch the wheel is in equilibrium under a vertical force, which is given in mm² as the force divided by
    /// the contact modulus. See [`estimated_force`].
    pub fn estimated_lowering(&self, force: f64) -> f64 {
        let radius = self.geometry.placement.rolling_radius;
        let is_low = |power: f64| estimated_force(self.lines, STEP, radius, power.exp()) < force;
        let [low, _] = bisect(LOWERINGS.map(f64::ln), LOWERING_HALVINGS, is_low);
        low.exp()
    }

    /// Weighted mean of the overlap between wheel and rail: the parameter of the rail's curve at the mean position, and the mean inclination of
    /// the rail in rad. The wheel is `lowering` mm below first touch. Only lines with a rail parameter between `from` and `to` count. The weight
    /// is the square of the overlap, integrated over the area. Returns `None` if the bodies do not overlap there.
    pub(crate) fn mean_overlap(&self, lowering: f64, [from, to]: [f64; 2]) -> Option<[f64; 2]> {
        let inside =
            |line: &&LocusPoint| line.clearance < lowering && (from..to).contains(&line.rail);
        let (mut weight, mut y, mut angle) = (0.0, 0.0, 0.0);
        for line in self.lines.iter().filter(inside) {
            // The length of the overlap along x grows as its square root.
            let own = (lowering - line.clearance).powf(2.5);
            let [across, up] = self.geometry.rail_at(line.rail).slope;
            weight += own;
            y += own * line.y;
            angle += own * (up / across).atan();
        }
        let far = |line: &&LocusPoint| (line.y - y / weight).abs();
        let nearest = self.lines.iter().min_by(|a, b| far(a).total_cmp(&far(b)))?;
        (weight > 0.0).then_some([nearest.rail, angle / weight])
    }
}

/// Estimates the force over the contact modulus, in mm², of a wheel with this radius at this lowering, both in mm. The lines are `step` mm apart
/// and in the order of y; lines that do not overlap may be missing.
///
/// Every patch is replaced by a horizontal circle of the area that overlaps at half the lowering, pressed by a sphere:
/// `N = 4/3 E* √(A/π) δ`, exact for paraboloids. The influence of patches on each other is neglected.
pub(crate) fn estimated_force(lines: &[LocusPoint], step: f64, radius: f64, lowering: f64) -> f64 {
    let inside = |line: &LocusPoint| line.clearance < 0.5 * lowering;
    let runs = lines.chunk_by(|a, b| inside(a) == inside(b) && b.y - a.y < 1.5 * step);
    let length =
        |line: &LocusPoint| 2.0 * (2.0 * radius * (0.5 * lowering - line.clearance)).sqrt();
    let force = |run: &[LocusPoint]| {
        let area: f64 = run.iter().map(|line| length(line) * step).sum();
        4.0 / 3.0 * (area / PI).sqrt() * lowering
    };
    runs.filter(|run| inside(&run[0])).map(force).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_carries_what_hertz_says() {
        const STEP: f64 = 0.01;
        let line = |k: i32| {
            let y = STEP * f64::from(k);
            LocusPoint {
                y,
                clearance: y * y / 600.0,
                rail: y,
                wheel: y,
            }
        };
        let lines: Vec<LocusPoint> = (-4000..=4000).map(line).collect();
        let hertz = 4.0 / 3.0 * 300_f64.sqrt() * 0.05_f64.powf(1.5);
        assert!((estimated_force(&lines, STEP, 300.0, 0.05) / hertz - 1.0).abs() < 1e-3);
    }
}
