//! States that need no Newton iteration: nothing slips because nothing moves, or everything slips.

use crate::contact::normal::footprint::{Footprint, LineAngles};
use crate::contact::normal::patch::Patch;
use crate::contact::numerics::length::length;
use crate::contact::rolling::answer::{LevelAnswer, LevelExit, Work};
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::skip::Skip;
use crate::contact::rolling::strip_mesh::StripMesh;

/// Upper bound of the elastic slip in full slip, in units of (μ p_max)/G: three times the largest that was seen for a/b from 1/50 to 50
/// and any ν.
const ELASTIC_SLIP_MAX: f64 = 10.0;
/// Rigid slip must be this many times larger for the elastic slip to be left out: the direction of the traction then
/// changes by less than the inverse.
const NEGLIGIBLE: f64 = 1e6;

/// Tractions at the bound along the rigid slip of a dimensionless motion, on every cell.
#[must_use]
pub fn along_rigid_slip(level: &StripMesh, motion: &Motion) -> [Vec<f64>; 2] {
    along(level, &rigid_slip(level, motion))
}

fn rigid_slip(level: &StripMesh, motion: &Motion) -> [Vec<f64>; 2] {
    let normalised = &level.normalised;
    let load_y = normalised.cell_load_y();
    let x = load_y
        .iter()
        .map(|y| motion.creepage_x - motion.spin_per_mm * y);
    let y = normalised.node.iter();
    let y = y.map(|x| motion.creepage_y + motion.spin_per_mm * x);
    [x.collect(), y.collect()]
}

/// Tractions at the bound in the directions of the slips.
fn along(level: &StripMesh, slip: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
    let lengths: Vec<f64> = slip[0]
        .iter()
        .zip(&slip[1])
        .map(|(x, y)| length(*x, *y))
        .collect();
    [0, 1].map(|k| {
        let cells = slip[k].iter().zip(&lengths).zip(&level.bound);
        cells
            .map(|((s, length), bound)| {
                if *length > 0.0 {
                    bound * s / length
                } else {
                    0.0
                }
            })
            .collect()
    })
}

/// Lines across a patch, and points along each of them, of [`sum_along_rigid_slip`]. Chosen by judgement: they serve meshes of a quarter as many cells.
const POINTS: [usize; 2] = [16, 32];

/// Most cells of a patch whose sums [`sum_along_rigid_slip`] tells the errors of.
pub(crate) const CELLS_MAX: usize = POINTS[1] * POINTS[1] / 4;

/// Forces and moment of one patch if every point slips along the rigid slip of a motion in mm, with the same coefficient of friction everywhere;
/// the moment is about the origin of the case.
///
/// Lines and points lie in the middle of equal angles (see [`Footprint::mean_of_line`]), as whose function pressures are smooth. With the pole of
/// the rotation inside, the direction jumps there, and this is about as exact as four times as many `cells`, of which there are at most
/// [`CELLS_MAX`].
#[must_use]
pub fn sum_along_rigid_slip(
    footprint: &Footprint,
    patch: usize,
    motion: &Motion,
    coefficient: f64,
    cells: usize,
) -> Resultants {
    let [few, many] = POINTS;
    if 4 * cells <= few * few {
        sum_at::<{ POINTS[0] }>(footprint, patch, motion, coefficient)
    } else {
        debug_assert!(4 * cells <= many * many);
        sum_at::<{ POINTS[1] }>(footprint, patch, motion, coefficient)
    }
}

/// The same from N lines and N points on each of them.
fn sum_at<const N: usize>(
    footprint: &Footprint,
    patch: usize,
    motion: &Motion,
    coefficient: f64,
) -> Resultants {
    let Patch {
        extent: [.., low, high],
        normal_force,
        ..
    } = footprint.patches()[patch];
    let angles = LineAngles::<N>::new();
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let (mut chords, mut load, mut sum) = (Vec::new(), 0.0, Resultants::default());
    for (cos, width) in angles.cosines.iter().zip(&angles.sines) {
        let y = middle - half * cos;
        footprint.chords_into(patch, &[(y, half)], &mut chords);
        for chord in &chords {
            let along = 0.5 * (chord.right - chord.left) * width;
            let pressures = footprint.pressures(chord, (&angles.cosines, &angles.sines));
            let points = angles.cosines.iter().zip(&angles.sines).zip(&pressures);
            for ((cos, length_share), pressure) in points {
                let x = chord.along(*cos);
                let slip = [
                    motion.creepage_x - motion.spin_per_mm * y,
                    motion.creepage_y + motion.spin_per_mm * x,
                ];
                let share = pressure * length_share * along;
                load += share;
                let size = length(slip[0], slip[1]);
                if size > 0.0 {
                    let [force_x, force_y] = slip.map(|part| share * part / size);
                    sum = sum.plus(Resultants {
                        force_x,
                        force_y,
                        moment_z: x * force_y - y * force_x,
                    });
                }
            }
        }
    }
    if load > 0.0 {
        sum.times(coefficient * normal_force / load)
    } else {
        sum
    }
}

/// The answer where the rigid slip alone decides: no motion, or a rigid slip so large that elastic slip cannot turn the tractions
/// (relative change below 1e-6).
#[must_use]
pub fn rigid_answer(level: &StripMesh, motion: &Motion) -> Option<LevelAnswer> {
    let cells = level.mesh.cells();
    let slip = rigid_slip(level, motion);
    let sizes = slip[0].iter().zip(&slip[1]).map(|(x, y)| length(*x, *y));
    let smallest = sizes.fold(f64::INFINITY, f64::min);
    let still = motion.creepage_x == 0.0 && motion.creepage_y == 0.0 && motion.spin_per_mm == 0.0;
    let (exit, skip) = if still {
        (LevelExit::NoMotion, Skip::NoMotion)
    } else if smallest > ELASTIC_SLIP_MAX * NEGLIGIBLE && !pole_inside(level, motion) {
        (LevelExit::RigidSlip, Skip::RigidSlip)
    } else {
        return None;
    };
    let traction = along(level, &slip);
    Some(LevelAnswer {
        traction,
        second: None,
        slips: vec![!still; cells],
        slip,
        exit,
        work: Work::default(),
        skips: vec![skip],
        remarks: Vec::new(),
    })
}

/// Without friction there are no tractions, and the slip is the rigid one.
#[must_use]
pub fn frictionless_answer(level: &StripMesh, motion: &Motion) -> LevelAnswer {
    let cells = level.mesh.cells();
    let load_y = level.mesh.cell_load_y();
    let still = motion.creepage_x == 0.0 && motion.creepage_y == 0.0 && motion.spin_per_mm == 0.0;
    LevelAnswer {
        traction: [vec![0.0; cells], vec![0.0; cells]],
        second: None,
        slip: [
            load_y
                .iter()
                .map(|y| motion.creepage_x - motion.spin_per_mm * y)
                .collect(),
            level
                .mesh
                .node
                .iter()
                .map(|x| motion.creepage_y + motion.spin_per_mm * x)
                .collect(),
        ],
        slips: vec![!still; cells],
        exit: LevelExit::NoFriction,
        work: Work::default(),
        skips: vec![Skip::NoFriction],
        remarks: Vec::new(),
    }
}

/// Does the rigid slip vanish somewhere in the box around the patches?
fn pole_inside(level: &StripMesh, motion: &Motion) -> bool {
    if motion.spin_per_mm == 0.0 {
        return false;
    }
    let (x, y) = (
        -motion.creepage_y / motion.spin_per_mm,
        motion.creepage_x / motion.spin_per_mm,
    );
    level.normalised.segments.iter().any(|s| {
        let half = 0.5 * s.chord.dy;
        s.chord.left <= x && x <= s.chord.right && (s.chord.y - y).abs() <= half
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::normal::hertz::{Ellipse, NormalLoad};

    const LOAD: f64 = 1000.0;
    const FRICTION: f64 = 0.3;

    /// By few points and by many.
    fn sums(
        semi_axes: [f64; 2],
        [creepage_x, creepage_y, spin_per_mm]: [f64; 3],
    ) -> [Resultants; 2] {
        let [a, b] = semi_axes;
        let ellipse = Ellipse::of_semi_axes(a, b, NormalLoad::Force(LOAD), 1e5);
        let motion = Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        };
        let footprint = Footprint::hertz(ellipse);
        let sum = |cells| sum_along_rigid_slip(&footprint, 0, &motion, FRICTION, cells);
        [1, CELLS_MAX].map(sum)
    }

    #[test]
    fn without_spin_the_whole_bound_points_along_the_creepage() {
        for found in sums([5.0, 3.0], [0.003, 0.004, 0.0]) {
            assert!((found.force_x / (0.6 * FRICTION * LOAD) - 1.0).abs() < 1e-9);
            assert!((found.force_y / (0.8 * FRICTION * LOAD) - 1.0).abs() < 1e-9);
        }
    }

    /// The mean distance from the centre under Hertz's pressure on a circle is `3 π a / 16`.
    #[test]
    fn spin_about_the_centre_of_a_circle_leaves_a_moment_alone() {
        for found in sums([4.0, 4.0], [0.0, 0.0, 1e-3]) {
            let moment = FRICTION * LOAD * 3.0 * std::f64::consts::PI * 4.0 / 16.0;
            assert!((found.moment_z / moment - 1.0).abs() < 1e-3, "{found:?}");
            assert!(found.force_x.hypot(found.force_y) < 1e-9 * FRICTION * LOAD);
        }
    }

    /// To the second order in the distance of the pole the transverse force falls by half the mean square of y over that distance.
    #[test]
    fn a_far_pole_turns_tractions_by_what_the_place_tells() {
        let (b, pole) = (3.0, 60.0);
        for found in sums([b, b], [1e-3 * pole, 0.0, 1e-3]) {
            let spread = 0.5 * (b * b / 5.0) / (pole * pole);
            let expected = FRICTION * LOAD * (1.0 - spread);
            assert!((found.force_x / expected - 1.0).abs() < 1e-5, "{found:?}");
        }
    }
}
