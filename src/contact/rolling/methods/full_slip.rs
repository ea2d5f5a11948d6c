//! States without an iteration: nothing moves, everything slips, or there is no friction.

use crate::mesh::Mesh;
use crate::numerics::simd::length;
use crate::rolling::answer::{LevelAnswer, Skip};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// Upper bound of the elastic slip in full slip, in units of (μ p_max)/G: three times the largest value found for a/b from 1/50 to 50 and any ν.
const ELASTIC_SLIP_MAX: f64 = 10.0;
/// Ratio of rigid to elastic slip from which elastic slip is neglected. The direction of the traction then changes by less than the inverse.
pub(crate) const NEGLIGIBLE: f64 = 1e6;

/// Rigid slips of a motion at the cells of a mesh.
fn rigid_slip(mesh: &Mesh, motion: &Motion) -> [Vec<f64>; 2] {
    let (load_y, node) = (mesh.cell_load_y(), mesh.node.iter());
    let x = load_y
        .iter()
        .map(|y| motion.creepage_x - motion.spin_per_mm * y);
    let y = node.map(|x| motion.creepage_y + motion.spin_per_mm * x);
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

/// The solution where the rigid slip alone determines it: no motion, or a rigid slip so large that elastic slip turns the tractions by less than 1e-6.
pub fn rigid_answer(level: &StripMesh, motion: &Motion) -> Option<LevelAnswer> {
    let cells = level.mesh.cells();
    let slip = rigid_slip(&level.normalised, motion);
    let sizes = slip[0].iter().zip(&slip[1]).map(|(x, y)| length(*x, *y));
    let smallest = sizes.fold(f64::INFINITY, f64::min);
    let still = motion.is_still();
    let skip = if still {
        Skip::NoMotion
    } else if smallest > ELASTIC_SLIP_MAX * NEGLIGIBLE && !pole_inside(level, motion) {
        Skip::RigidSlip
    } else {
        return None;
    };
    let traction = along(level, &slip);
    Some(LevelAnswer {
        traction,
        slips: vec![!still; cells],
        slip,
        skip: Some(skip),
        ..LevelAnswer::default()
    })
}

/// The solution without friction: no tractions, and the rigid slip.
pub fn frictionless_answer(level: &StripMesh, motion: &Motion) -> LevelAnswer {
    let cells = level.mesh.cells();
    LevelAnswer {
        traction: [vec![0.0; cells], vec![0.0; cells]],
        slip: rigid_slip(&level.mesh, motion),
        slips: vec![!motion.is_still(); cells],
        skip: Some(Skip::NoFriction),
        ..LevelAnswer::default()
    }
}

/// Whether the rigid slip vanishes in a segment of the patches.
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
