//! How wrong are the resultants? From two rules, two levels, and the cell that holds the spin pole.

use crate::contact::normal::Patch;
use crate::contact::outputs::resultants::Resultants;
use crate::contact::problem::Problem;
use crate::contact::tangential::Tangential;
use crate::contact::tangential::ladder::Regime;
use crate::contact::tangential::level::Level;
use crate::contact::tangential::liu_hsu::spin_pole::vortex_centre;

/// Factor on the difference of the two rules where there is only one level.
const RULES_ALONE: f64 = 2.5;
/// Factor on both indicators where there are two levels; with it their larger one covered the error in 97 % of 62 Hertz
/// contacts at the meshes of this ladder.
const SAFETY: f64 = 1.25;
/// Error of sampling the vortex of the tractions by one cell, over p h² / N.
const POLE: f64 = 0.45;
/// Relative error where everything slips along the rigid slip.
const RIGID: f64 = 1e-6;
/// Stick below this share of the cells' area counts as none.
const STICK_NEGLIGIBLE: f64 = 0.08;
/// A pole this far out, relative to the half axes of the box around the patches, is outside.
const POLE_INSIDE: f64 = 0.9;

/// Relative errors of every patch, then of the sum over them; nothing where there is no second opinion.
pub type Errors = Vec<Option<f64>>;

/// What two levels say about each other.
#[derive(Debug, Clone, Copy)]
pub struct Finer<'a> {
    /// Resultants of the coarser level.
    pub coarser: &'a [Resultants],
    /// Cells of the finer level over those of the coarser.
    pub cells_ratio: f64,
    /// The meshes differ in kind, not only in size.
    pub other_kind: bool,
}

/// Estimates the errors of `found`, the resultants of `answer` on `level`, relative to μN (moment: μN√(A/π)).
///
/// `max(1.25 |trapezoid − mirror|, 1.25 |change| / (ratio of cells − 1), pole)`, the largest component for all three
/// resultants, since single ones cross zero; on the first level `max(2.5 |trapezoid − mirror|, pole)`. The pole's term is
/// `0.45 p h² / N` with the pressure p and longer side h of the cell that holds the centre of the traction vortex, if it
/// slips: sampling the vortex at nodes makes an error of that size which two rules on one mesh share.
#[must_use]
pub fn errors(
    problem: &Problem,
    level: &Level,
    answer: &Tangential,
    found: &[Resultants],
    finer: Option<Finer>,
) -> Errors {
    let patches = problem.region.patches();
    let all = |value| vec![value; patches.len() + 1];
    if problem.friction == 0.0 {
        return all(Some(0.0));
    }
    if answer.second.is_none() && answer.work.products == 0 && answer.work.iterations == 0 {
        return all(Some(if answer.slips.iter().any(|s| *s) {
            RIGID
        } else {
            0.0
        }));
    }
    let of_rules = answer.second.as_ref().map(|second| {
        let second: Vec<Resultants> = (0..patches.len())
            .map(|p| Resultants::of_patch(level, second, p))
            .collect();
        distances(problem, &patches, found, &second)
    });
    let of_levels = finer.map(|finer| {
        let change = distances(problem, &patches, found, finer.coarser);
        let extrapolated = |d: f64| d / (finer.cells_ratio - 1.0);
        change
            .into_iter()
            .map(|d| {
                if finer.other_kind {
                    d.min(extrapolated(d))
                } else {
                    extrapolated(d)
                }
            })
            .collect()
    });
    let rules_factor = if of_levels.is_some() {
        SAFETY
    } else {
        RULES_ALONE
    };
    let pole = pole_error(problem, level, answer);
    let scaled = |values: &Vec<f64>, factor: f64, k: usize| factor * values[k];
    (0..=patches.len())
        .map(|k| match (&of_rules, &of_levels) {
            (Some(rules), Some(levels)) => {
                Some(scaled(rules, rules_factor, k).max(scaled(levels, SAFETY, k)))
            }
            (Some(rules), None) => Some(scaled(rules, rules_factor, k)),
            // The dense method has one rule; the change between its levels is all there is.
            (None, Some(levels)) => Some(scaled(levels, SAFETY, k)),
            (None, None) => None,
        })
        .map(|error| error.map(|e| e.max(pole)))
        .collect()
}

/// Which mesh the next level should have, seen from this one.
#[must_use]
pub fn regime(level: &Level, answer: &Tangential, spinning: bool) -> Regime {
    let (mut stick, mut total) = (0.0, 0.0);
    for (slips, area) in answer.slips.iter().zip(&level.area) {
        total += area;
        stick += if *slips { 0.0 } else { *area };
    }
    let inside = spinning && stick < STICK_NEGLIGIBLE * total && {
        pole(level, answer).is_some_and(|[x, y]| {
            let extent = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let a = extent(&level.normalised.node);
            let b = level
                .normalised
                .segments
                .iter()
                .map(|s| s.chord.y.abs() + 0.5 * s.chord.dy)
                .fold(0.0, f64::max);
            (x / a).hypot(y / b) < POLE_INSIDE
        })
    };
    if inside {
        Regime::Spinning
    } else {
        Regime::Sticking
    }
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

/// Error of sampling the vortex, relative to the whole load; 0 where no slipping cell holds its centre.
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
    for (segment, here) in level.mesh.segments.iter().zip(&level.normalised.segments) {
        if (here.chord.y - y).abs() > 0.5 * here.chord.dy {
            continue;
        }
        for i in segment.cells.clone() {
            if level.normalised.left[i] <= x && x <= level.normalised.right[i] && answer.slips[i] {
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
