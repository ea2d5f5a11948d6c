//! How much the patches of a wheel that are solved in gaps of their own would change each other.
//!
//! Every gap is solved as if nothing else pressed on its half-space. A patch that carries the force F at the distance r lets the
//! surface sink by `F / (π E* r)` (Boussinesq 1885, both bodies). By Hertz's power 3/2 the force of a patch with the approach δ
//! that sinks by u at a kept height falls by the part `3/2 u/δ`. Frames that are inclined to each other feel less; that is left out.

use std::f64::consts::PI;

use crate::contact::geometry::frame::Frame;

/// One gap, as it acts on its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbour {
    /// Its frame, at its load centre.
    pub(crate) frame: Frame,
    /// Normal force in N.
    pub(crate) force: f64,
    /// Approach in mm.
    pub(crate) approach: f64,
}

/// By how much the force of a gap would change, at most, relative to the sum of all forces, if the gaps pressed on each other; with the
/// least distance of their load centres in mm. At a kept load the wheel sinks until the sum is what it was.
pub(crate) fn neglected(
    gaps: &[Neighbour],
    contact_modulus: f64,
    keeps_load: bool,
) -> Option<[f64; 2]> {
    let distance = |a: &Neighbour, b: &Neighbour| {
        let from = [0, 1, 2].map(|k| a.frame.origin[k] - b.frame.origin[k]);
        from.iter().map(|d| d * d).sum::<f64>().sqrt()
    };
    let mut nearest = f64::INFINITY;
    let sunk: Vec<f64> = (0..gaps.len())
        .map(|i| {
            let others = (0..gaps.len()).filter(|j| *j != i);
            others
                .map(|j| {
                    let apart = distance(&gaps[i], &gaps[j]);
                    nearest = nearest.min(apart);
                    gaps[j].force / (PI * contact_modulus * apart)
                })
                .sum()
        })
        .collect();
    let total: f64 = gaps.iter().map(|gap| gap.force).sum();
    let stiffness = |gap: &Neighbour| 1.5 * gap.force / gap.approach;
    let lost: f64 = gaps
        .iter()
        .zip(&sunk)
        .map(|(gap, u)| stiffness(gap) * u)
        .sum();
    let lower = if keeps_load {
        lost / gaps.iter().map(stiffness).sum::<f64>()
    } else {
        0.0
    };
    let changes = gaps
        .iter()
        .zip(&sunk)
        .map(|(gap, u)| (stiffness(gap) * (u - lower)).abs().min(gap.force));
    let most = changes.fold(0.0, f64::max) / total;
    (gaps.len() > 1).then_some([most, nearest])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(y: f64, force: f64) -> Neighbour {
        let frame = Frame {
            origin: [0.0, y, 0.0],
            angle: 0.0,
            rail: 0.0,
            wheel: 0.0,
        };
        let approach = 0.1;
        Neighbour {
            frame,
            force,
            approach,
        }
    }

    #[test]
    fn equal_patches_under_a_kept_load_take_nothing_from_each_other() {
        let pair = [at(0.0, 50e3), at(20.0, 50e3)];
        let [change, distance] = neglected(&pair, 1e5, true).expect("two gaps");
        assert!(change < 1e-12, "{change}");
        assert_eq!(distance, 20.0);
        let [change, _] = neglected(&pair, 1e5, false).expect("two gaps");
        let sunk = 50e3 / (PI * 1e5 * 20.0);
        assert!((change - 0.5 * 1.5 * sunk / 0.1).abs() < 1e-12, "{change}");
    }

    #[test]
    fn a_heavy_patch_matters_less_with_its_distance_and_one_alone_not_at_all() {
        let change = |y: f64| neglected(&[at(0.0, 90e3), at(y, 10e3)], 1e5, true).expect("two")[0];
        assert!((change(20.0) / change(40.0) - 2.0).abs() < 1e-9);
        assert_eq!(neglected(&[at(0.0, 1e5)], 1e5, true), None);
    }
}
