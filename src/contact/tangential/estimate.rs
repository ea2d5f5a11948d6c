//! How wrong are the resultants? From two rules, two levels, and the cell that holds the spin pole.

use crate::contact::case::{Method, Motion};
use crate::contact::mesh::Segment;
use crate::contact::normal::Patch;
use crate::contact::outputs::resultants::Resultants;
use crate::contact::problem::Problem;
use crate::contact::tangential::Tangential;
use crate::contact::tangential::ladder::Regime;
use crate::contact::tangential::level::Level;
use crate::contact::tangential::liu_hsu::spin_pole::vortex_centre;
use crate::contact::tangential::{fastsim, full_slip};

/// Factor on the difference of the two rules on a mesh that was chosen without knowing the tractions.
const RULES_UNKNOWING: f64 = 2.3;
/// The same on a mesh made for them.
const RULES_ALONE: f64 = 1.4;
/// Factor on these two where region and pressure are not known in closed form: strips may miss what the rules share.
const RULES_SAMPLED: f64 = 1.5;
/// The same where a coarser level of the same kind has its say.
const RULES_BESIDE: f64 = 0.5;
/// Factor on the step of the extrapolation, and where the levels are so near each other that the step is more than
/// `SHARE_LARGE` times the change between them.
const LEVELS: f64 = 1.25;
const LEVELS_NEAR: f64 = 1.9;
const SHARE_LARGE: f64 = 1.5;
/// The factors grow as this power of the slenderness of a patch, whose strips or cells are few for what they have to tell.
const CAUTION: f64 = 0.4;
/// With the load on fewer strips than these, counted by `(Σ load)² / Σ load²`, the factors grow as the square of what is missing;
/// four strips of an ellipse count as 3.5.
const STRIPS_FEW: f64 = 3.5;
/// Error of sampling the vortex of the tractions by one cell, over p h² / N.
const POLE: f64 = 0.45;
/// Relative error where everything slips along the rigid slip.
const RIGID: f64 = 1e-6;
/// Stick below this share of the cells' area counts as none.
const STICK_NEGLIGIBLE: f64 = 0.12;
/// With less stick than this on the first level, a pole in a sticking cell may as well be in a slipping one.
const STICK_UNCERTAIN: f64 = 0.2;
/// A pole this far out, relative to the half axes of the box around the patches, is outside.
const POLE_INSIDE: f64 = 0.9;
/// Cells gather no farther out than here.
const POLE_OUTMOST: f64 = 0.95;

/// Relative errors of every patch, then of the sum over them; nothing where there is no second opinion.
pub type Errors = Vec<Option<f64>>;

/// What else is known besides the two rules on one mesh.
#[derive(Debug, Clone, Copy)]
pub enum Opinion<'a> {
    /// Nothing.
    Alone,
    /// The resultants of a coarser level of the same kind, and the share of the change that is left to go: 1 over (ratio
    /// of cells − 1).
    Coarser(&'a [Resultants], f64),
}

/// What an estimate depends on beside the answers.
#[derive(Debug, Clone, Copy)]
pub struct Circumstances<'a> {
    /// The motion in mm.
    pub motion: &'a Motion,
    /// A finer level, where everything slips and no coarser one has its say.
    pub finer: Option<&'a Level>,
    /// How many times more slender the patch is than the factors were found for; at least 1.
    pub slenderness: f64,
    /// Residual of the solve.
    pub tolerance: f64,
}

/// Estimates the errors of resultants, relative to μN (moment: μN√(A/π)): the largest component for all three, since
/// single ones cross zero.
///
/// `found` are the resultants of `answer` on `level`, not extrapolated. The estimate is
/// - `1.4 |trapezoid − mirror|` on a mesh made for the regime, 2.3 times the difference on one that was not, both 1.5 times
///   that where region and pressure come from samples;
/// - `max(1.25 s |change|, 0.5 |trapezoid − mirror|)`, with 1.9 for 1.25 where s > 1.5, for resultants extrapolated by the share s of the change from a coarser
///   level of the same kind;
/// - both more in slender patches, and where few strips carry the load;
/// - never less than the error of the sums over cells where everything slips;
/// - never less than the tolerance of the solve, nor, unless extrapolated on cells that gather about the pole, than
///   `0.45 p h² / N` with the pressure p and longer side h of the cell that holds the centre of the traction vortex:
///   sampling the vortex at nodes makes an error of that size which two rules on one mesh share.
#[must_use]
pub fn errors(
    problem: &Problem,
    level: &Level,
    answer: &Tangential,
    found: &[Resultants],
    opinion: Opinion,
    circumstances: Circumstances,
) -> Errors {
    let Circumstances {
        motion,
        finer,
        slenderness,
        tolerance,
    } = circumstances;
    let spinning = motion.spin_per_mm != 0.0;
    let caution = slenderness.powf(CAUTION) * few_strips(level);
    let patches = problem.region.patches();
    let all = |value| vec![value; patches.len() + 1];
    if problem.friction == 0.0 {
        return all(Some(0.0));
    }
    let of_sums = finer.map_or_else(
        || vec![0.0; patches.len() + 1],
        |finer| sum_errors(problem, &patches, [level, finer], motion),
    );
    if answer.second.is_none() && answer.work.products == 0 && answer.work.iterations == 0 {
        if !answer.slips.iter().any(|s| *s) {
            return all(Some(0.0));
        }
        return of_sums.iter().map(|e| Some(e.max(RIGID))).collect();
    }
    if problem.method == Method::Fastsim {
        // No mesh tells what the theory leaves out.
        return all(Some(fastsim::error_class(
            problem.traction_bound,
            level.plan.size,
        )));
    }
    let of_rules = answer.second.as_ref().map(|second| {
        let second: Vec<Resultants> = (0..patches.len())
            .map(|p| Resultants::of_patch(level, second, p))
            .collect();
        distances(problem, &patches, found, &second)
    });
    let of_levels = match opinion {
        Opinion::Alone => None,
        Opinion::Coarser(coarser, share) => {
            let mut change = distances(problem, &patches, found, coarser);
            let factor = if share > SHARE_LARGE {
                LEVELS_NEAR
            } else {
                LEVELS
            };
            change.iter_mut().for_each(|d| *d *= factor * share);
            Some(change)
        }
    };
    let sampled = if problem.region.is_ellipse() {
        1.0
    } else {
        RULES_SAMPLED
    };
    let rules_factor = match (&of_levels, level.plan.regime) {
        (Some(_), _) => RULES_BESIDE,
        (None, Regime::Unknown) => sampled * RULES_UNKNOWING,
        (None, _) => sampled * RULES_ALONE,
    };
    let gathered = level.plan.pole().is_some();
    let pole = if !spinning || gathered && of_levels.is_some() {
        0.0
    } else {
        pole_error(problem, level, answer)
    };
    (0..=patches.len())
        .map(|k| {
            let error = match (&of_rules, &of_levels) {
                (Some(rules), Some(levels)) => (rules_factor * rules[k]).max(levels[k]),
                (Some(rules), None) => rules_factor * rules[k],
                // The dense method has one rule; the change between its levels is all there is.
                (None, Some(levels)) => levels[k],
                (None, None) => return None,
            };
            Some((caution * error).max(of_sums[k]).max(pole).max(tolerance))
        })
        .collect()
}

/// Errors of the sums over cells, which both rules share: where everything slips along the rigid slip, those sums are all there is.
/// The change to a level of four times as many cells tells them.
fn sum_errors(
    problem: &Problem,
    patches: &[Patch],
    levels: [&Level; 2],
    motion: &Motion,
) -> Vec<f64> {
    let [here, finer] = levels.map(|level| -> Vec<Resultants> {
        let traction = full_slip::along_rigid_slip(level, &level.scale.motion(motion));
        (0..patches.len())
            .map(|p| Resultants::of_patch(level, &traction, p))
            .collect()
    });
    let mut errors = distances(problem, patches, &here, &finer);
    errors.iter_mut().for_each(|e| *e *= 4.0 / 3.0);
    errors
}

/// A factor for a patch whose load lies on few of its strips.
fn few_strips(level: &Level) -> f64 {
    let mut loads: Vec<(usize, usize, f64)> = Vec::new();
    for segment in &level.mesh.segments {
        let load = |i: usize| level.pressure[i] * level.area[i];
        let load: f64 = segment.cells.clone().map(load).sum();
        let (patch, strip) = (segment.chord.patch, segment.chord.strip);
        match loads.last_mut() {
            Some(last) if (last.0, last.1) == (patch, strip) => last.2 += load,
            _ => loads.push((patch, strip, load)),
        }
    }
    let counted = |patch: &[(usize, usize, f64)]| {
        let sum = |power: i32| patch.iter().map(|(.., load)| load.powi(power)).sum::<f64>();
        let (load, squares) = (sum(1), sum(2));
        if squares > 0.0 {
            load * load / squares
        } else {
            STRIPS_FEW
        }
    };
    let fewest = loads
        .chunk_by(|a, b| a.0 == b.0)
        .map(counted)
        .fold(STRIPS_FEW, f64::min);
    (STRIPS_FEW / fewest).powi(2)
}

/// Which mesh the next level should have, seen from this one.
#[must_use]
pub fn regime(level: &Level, answer: &Tangential, spinning: bool) -> Regime {
    if !spinning || stick_share(level, answer) >= STICK_NEGLIGIBLE {
        return Regime::Sticking;
    }
    pole(level, answer)
        .and_then(|at| place_inside(level, at))
        .map_or(Regime::Sticking, Regime::Spinning)
}

/// Share of the cells' area that sticks.
fn stick_share(level: &Level, answer: &Tangential) -> f64 {
    let (mut stick, mut total) = (0.0, 0.0);
    for (slips, area) in answer.slips.iter().zip(&level.area) {
        total += area;
        stick += if *slips { 0.0 } else { *area };
    }
    stick / total
}

/// A point inside the box about the patches as a place along the nearest chord and across, each from −1 to 1.
fn place_inside(level: &Level, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
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
fn pole(level: &Level, answer: &Tangential) -> Option<[f64; 2]> {
    let rows = level.normalised.rows();
    let load = |i: usize| {
        if answer.slips[i] {
            level.pressure[i] * level.area[i]
        } else {
            0.0
        }
    };
    let weight: Vec<f64> = (0..rows.len()).map(load).collect();
    let t: Vec<f64> = answer.traction.concat();
    vortex_centre(&t, &level.normalised.node, &rows, &weight)
}

/// Error of sampling the vortex, relative to the whole load; 0 where the cell that holds the centre surely
/// sticks.
fn pole_error(problem: &Problem, level: &Level, answer: &Tangential) -> f64 {
    let Some([x, y]) = pole(level, answer) else {
        return 0.0;
    };
    let load: f64 = problem
        .region
        .patches()
        .iter()
        .map(|p| p.normal_force)
        .sum();
    let uncertain =
        level.plan.regime == Regime::Unknown && stick_share(level, answer) < STICK_UNCERTAIN;
    for (segment, here) in level.mesh.segments.iter().zip(&level.normalised.segments) {
        if (here.chord.y - y).abs() > 0.5 * here.chord.dy {
            continue;
        }
        for i in segment.cells.clone() {
            let holds = level.normalised.left[i] <= x && x <= level.normalised.right[i];
            if holds && (answer.slips[i] || uncertain) {
                let longer = (level.mesh.right[i] - level.mesh.left[i]).max(segment.chord.dy);
                return POLE * level.pressure[i] * longer * longer / load;
            }
        }
    }
    0.0
}

/// Distances of two sets of resultants: every patch relative to its own μN with moments about its middle, then the sums.
fn distances(
    problem: &Problem,
    patches: &[Patch],
    found: &[Resultants],
    other: &[Resultants],
) -> Vec<f64> {
    let mut distances = Vec::with_capacity(patches.len() + 1);
    let (mut sum, mut sum_other) = (Resultants::default(), Resultants::default());
    let (mut force, mut area, mut centre) = (0.0, 0.0, [0.0, 0.0]);
    for ((patch, found), other) in patches.iter().zip(found).zip(other) {
        let bound = problem.friction * patch.normal_force;
        let at = [
            0.5 * (patch.extent[0] + patch.extent[1]),
            0.5 * (patch.extent[2] + patch.extent[3]),
        ];
        let length = (patch.area / std::f64::consts::PI).sqrt();
        distances.push(found.about(at).distance(&other.about(at), bound, length));
        sum = sum.plus(*found);
        sum_other = sum_other.plus(*other);
        force += bound;
        area += patch.area;
        centre = [centre[0] + bound * at[0], centre[1] + bound * at[1]];
    }
    let centre = centre.map(|c| c / force);
    let length = (area / std::f64::consts::PI).sqrt();
    distances.push(
        sum.about(centre)
            .distance(&sum_other.about(centre), force, length),
    );
    distances
}
