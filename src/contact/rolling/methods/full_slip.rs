//! States that need no Newton iteration: nothing slips because nothing moves, or everything slips.

use crate::numerics::simd::length;
use crate::rolling::answer::{LevelAnswer, LevelOutcome, Skip};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// Upper bound of the elastic slip in full slip, in units of (μ p_max)/G: three times the largest that was seen for a/b from 1/50 to 50
/// and any ν.
const ELASTIC_SLIP_MAX: f64 = 10.0;
/// Rigid slip must be this many times larger for the elastic slip to be left out: the direction of the traction then
/// changes by less than the inverse.
pub(crate) const NEGLIGIBLE: f64 = 1e6;

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

/// The answer where the rigid slip alone decides: no motion, or a rigid slip so large that elastic slip cannot turn the tractions
/// (relative change below 1e-6).
pub fn rigid_answer(level: &StripMesh, motion: &Motion) -> Option<LevelAnswer> {
    let cells = level.mesh.cells();
    let slip = rigid_slip(level, motion);
    let sizes = slip[0].iter().zip(&slip[1]).map(|(x, y)| length(*x, *y));
    let smallest = sizes.fold(f64::INFINITY, f64::min);
    let still = motion.is_still();
    let (exit, skip) = if still {
        (LevelOutcome::NoMotion, Skip::NoMotion)
    } else if smallest > ELASTIC_SLIP_MAX * NEGLIGIBLE && !pole_inside(level, motion) {
        (LevelOutcome::RigidSlip, Skip::RigidSlip)
    } else {
        return None;
    };
    let traction = along(level, &slip);
    Some(LevelAnswer {
        traction,
        slips: vec![!still; cells],
        slip,
        exit,
        skips: vec![skip],
        ..LevelAnswer::default()
    })
}

/// Without friction there are no tractions, and the slip is the rigid one.
pub fn frictionless_answer(level: &StripMesh, motion: &Motion) -> LevelAnswer {
    let cells = level.mesh.cells();
    let load_y = level.mesh.cell_load_y();
    let still = motion.is_still();
    LevelAnswer {
        traction: [vec![0.0; cells], vec![0.0; cells]],
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
        exit: LevelOutcome::NoFriction,
        skips: vec![Skip::NoFriction],
        ..LevelAnswer::default()
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
