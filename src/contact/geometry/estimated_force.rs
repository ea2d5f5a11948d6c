//! What a wheel lowered by some height would carry, from the overlap of the undeformed bodies alone.

use std::f64::consts::PI;

use crate::contact::geometry::grouping::SHARED_GAP_DISTANCE;
use crate::contact::geometry::locus_lines::LocusPoint;

/// Force over the contact modulus, in mm², that lines `step` mm apart, in the order of y, carry at a lowering of a wheel of this radius, both in
/// mm. Lines that do not overlap may be missing.
///
/// Every patch is taken for a circle of the area that half the lowering makes overlap, pressed by a sphere, as if horizontal:
/// `N = 4/3 E* √(A/π) δ`, exact for paraboloids.
pub(crate) fn estimated_force(lines: &[LocusPoint], step: f64, radius: f64, lowering: f64) -> f64 {
    let inside = |line: &LocusPoint| line.clearance < 0.5 * lowering;
    let runs = lines.chunk_by(|a, b| inside(a) == inside(b) && b.y - a.y < 1.5 * step);
    let length =
        |line: &LocusPoint| 2.0 * (2.0 * radius * (0.5 * lowering - line.clearance)).sqrt();
    let carried = |run: &[LocusPoint]| {
        let area: f64 = run.iter().map(|line| length(line) * step).sum();
        let clearances = run.iter().map(|line| line.clearance);
        EstimatedPatch {
            ends: [run[0].y, run[run.len() - 1].y],
            depth: lowering - clearances.fold(f64::INFINITY, f64::min),
            force: 4.0 / 3.0 * (area / PI).sqrt() * lowering,
        }
    };
    let mut patches: Vec<EstimatedPatch> =
        runs.filter(|run| inside(&run[0])).map(carried).collect();
    // The order decides what few rounds leave; so a mirror image has the same.
    patches.sort_by(|a, b| b.force.total_cmp(&a.force));
    coupled_force(&patches)
}

/// A patch as [`estimated_force`] finds it.
struct EstimatedPatch {
    /// Its ends across, in mm.
    ends: [f64; 2],
    /// Deepest overlap in mm.
    depth: f64,
    /// What it would carry alone, over the contact modulus, in mm².
    force: f64,
}

impl EstimatedPatch {
    /// The distance of the middles in mm of two patches so near to each other that they share a gap.
    fn near(&self, other: &EstimatedPatch) -> Option<f64> {
        /// At twice the depth a paraboloid's overlap is wider by this part of its width on either side: `(√2 − 1)/2`.
        const NARROWER: f64 = 0.207;
        let [own, others] = [self, other].map(|patch| {
            let [low, high] = patch.ends;
            [0.5 * (low + high), 0.5 * (high - low)]
        });
        let apart = (own[0] - others[0]).abs();
        let beside = apart - (1.0 + 2.0 * NARROWER) * (own[1] + others[1]);
        (apart > 0.0 && beside < SHARED_GAP_DISTANCE).then_some(apart)
    }
}

/// Force over the contact modulus of all patches. Patches that share a gap press each other out of contact: one that carries the force F lets the
/// surface at the distance r sink by `F / (π E* r)` (Boussinesq 1885), and forces grow as the power 3/2 of the depth.
fn coupled_force(patches: &[EstimatedPatch]) -> f64 {
    /// Rounds in which forces and what they let sink are found from each other; two leave less than 2 % (see the test). They decide
    /// which height is tried first.
    const ROUNDS: usize = 2;
    let mut forces: Vec<f64> = patches.iter().map(|patch| patch.force).collect();
    let rounds = if patches.len() > 1 { ROUNDS } else { 0 };
    for _ in 0..rounds {
        for (k, patch) in patches.iter().enumerate() {
            let sunk = |(other, force): (&EstimatedPatch, &f64)| {
                let apart = patch.near(other)?;
                Some(force / (PI * apart))
            };
            let sunk: f64 = patches.iter().zip(&forces).filter_map(sunk).sum();
            let left = (1.0 - sunk / patch.depth).max(0.0);
            forces[k] = patch.force * left * left.sqrt();
        }
    }
    forces.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines over bumps of 300 mm at these places, all of which touch at once.
    fn carried(places: &[f64]) -> f64 {
        const STEP: f64 = 0.01;
        let line = |k: i32| {
            let y = STEP * f64::from(k);
            let heights = places.iter().map(|place| (y - place).powi(2) / 600.0);
            LocusPoint {
                y,
                clearance: heights.fold(f64::INFINITY, f64::min),
                rail: y,
                wheel: y,
                of_rail: 0,
            }
        };
        let lines: Vec<LocusPoint> = (-4000..=4000).map(line).collect();
        estimated_force(&lines, STEP, 300.0, 0.05)
    }

    #[test]
    fn a_sphere_carries_what_hertz_says() {
        let hertz = 4.0 / 3.0 * 300_f64.sqrt() * 0.05_f64.powf(1.5);
        assert!((carried(&[0.0]) / hertz - 1.0).abs() < 1e-3);
    }

    #[test]
    fn patches_that_share_a_gap_carry_less_than_each_alone_and_others_as_much() {
        let alone = carried(&[0.0]);
        assert!((carried(&[-20.0, 20.0]) / alone - 2.0).abs() < 1e-9);
        let near = carried(&[-6.0, 6.0]);
        // Each sinks by what the other one carries: w = N / (π r), N = N₀ (1 − w/δ)^(3/2).
        let half = 0.5 * near;
        let left = 1.0 - half / (PI * 12.0 * 0.05);
        assert!(
            (half / (alone * left.powf(1.5)) - 1.0).abs() < 0.02,
            "{near} {alone}"
        );
        assert!(near < 1.9 * alone);
    }
}
