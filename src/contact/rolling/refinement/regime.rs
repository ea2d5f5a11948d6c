//! The regime of the tractions of a level, from which the next mesh is made: how much sticks, and about which pole they turn.

use crate::contact::mesh::strips::Segment;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::mesh_plan::Regime;
use crate::contact::rolling::refinement::constants::{POLE, STICK_NEGLIGIBLE, STICK_UNCERTAIN};
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;
use crate::contact::rolling::vortex::vortex_centre;

/// A pole this far out, relative to the half axes of the box around the patches, is outside. Chosen by judgement; how much it matters was not
/// measured.
const POLE_INSIDE: f64 = 0.9;
/// Cells gather no farther out than here. Chosen by judgement; how much it matters was not measured.
const POLE_OUTMOST: f64 = 0.95;

/// Gap between neighbouring strips and cells, relative to their size, into which a pole on their common edge may fall by rounding. Strips of
/// slender ellipses are up to 2e-9 apart.
const EDGE_ROUNDING: f64 = 1e-6;

/// The regime that the next level should be made for, judged by this one.
#[must_use]
pub fn regime(level: &StripMesh, answer: &LevelAnswer, spinning: bool) -> Regime {
    if !spinning || stick_share(level, answer) >= STICK_NEGLIGIBLE {
        return Regime::Sticking { spinning };
    }
    pole(level, answer)
        .and_then(|at| place_inside(level, at))
        .map_or(Regime::Sticking { spinning }, Regime::Spinning)
}

/// Share of the cells' area that sticks.
fn stick_share(level: &StripMesh, answer: &LevelAnswer) -> f64 {
    let (mut stick, mut total) = (0.0, 0.0);
    for (slips, area) in answer.slips.iter().zip(&level.area) {
        total += area;
        stick += if *slips { 0.0 } else { *area };
    }
    stick / total
}

/// A point inside the box about the patches as a place along the nearest chord and across, each from −1 to 1.
fn place_inside(level: &StripMesh, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let mesh = &level.normalised;
    let side = |sign: f64| {
        let sides = mesh
            .segments
            .iter()
            .map(|s| sign * s.chord.y + 0.5 * s.chord.dy);
        sign * sides.fold(f64::NEG_INFINITY, f64::max)
    };
    let (bottom, top) = (side(-1.0), side(1.0));
    let across = (2.0 * y - bottom - top) / (top - bottom);
    let reach = mesh.node.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if (x / reach).hypot(across) >= POLE_INSIDE {
        return None;
    }
    let distance = |s: &Segment| (s.chord.y - y).abs();
    let nearest = mesh
        .segments
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let (left, right) = (nearest.chord.left, nearest.chord.right);
    let along = (2.0 * x - left - right) / (right - left);
    Some([along.clamp(-POLE_OUTMOST, POLE_OUTMOST), across])
}

/// Centre of the traction vortex, in the level's dimensionless coordinates.
fn pole(level: &StripMesh, answer: &LevelAnswer) -> Option<[f64; 2]> {
    let y = level.normalised.cell_load_y();
    let load = |i: usize| {
        if answer.slips[i] {
            level.pressure[i] * level.area[i]
        } else {
            0.0
        }
    };
    let weight: Vec<f64> = (0..y.len()).map(load).collect();
    let t: Vec<f64> = answer.traction.concat();
    vortex_centre(&t, &level.normalised.node, &y, &weight)
}

/// Error of sampling the vortex, relative to the whole load; 0 where the cell that holds the centre surely
/// sticks.
pub(crate) fn pole_error(task: &RollingTask, level: &StripMesh, answer: &LevelAnswer) -> f64 {
    let Some([x, y]) = pole(level, answer) else {
        return 0.0;
    };
    let load: f64 = task
        .footprint
        .patches()
        .iter()
        .map(|p| p.normal_force)
        .sum();
    let uncertain =
        level.plan.regime == Regime::Unknown && stick_share(level, answer) < STICK_UNCERTAIN;
    for (segment, here) in level.mesh.segments.iter().zip(&level.normalised.segments) {
        if (here.chord.y - y).abs() > (0.5 + EDGE_ROUNDING) * here.chord.dy {
            continue;
        }
        for i in segment.cells.clone() {
            let (left, right) = (level.normalised.left[i], level.normalised.right[i]);
            let beyond = EDGE_ROUNDING * (right - left);
            let holds = left - beyond <= x && x <= right + beyond;
            if holds && (answer.slips[i] || uncertain) {
                let longer = (level.mesh.right[i] - level.mesh.left[i]).max(segment.chord.dy);
                return POLE * level.pressure[i] * longer * longer / load;
            }
        }
    }
    0.0
}
