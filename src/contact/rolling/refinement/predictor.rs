//! First iterates from the tractions of earlier motions on the same mesh. They change the time of a solve, but no mesh and no estimate.

use crate::numerics::simd::length;
use crate::rolling::task::Motion;

/// Longest step, relative to the motion, for which the last tractions are used unchanged. On 12 sweeps of 9 motions on random ellipses 0.12 takes 6 % more
/// products and 0.5 takes 6 % fewer.
const NEAR: f64 = 0.25;

/// Tractions of the last two motions on every mesh.
#[derive(Debug, Clone, Default)]
pub struct Predictor {
    /// The newest step of a mesh is last.
    steps: Vec<Step>,
}

#[derive(Debug, Clone)]
struct Step {
    /// Number of the mesh.
    mesh: usize,
    /// The motion, dimensionless, about the origin of the mesh.
    motion: Motion,
    traction: [Vec<f64>; 2],
}

impl Predictor {
    /// Stores the tractions of a motion; those of the same motion, or the oldest on the mesh, are dropped.
    pub fn remember(&mut self, mesh: usize, motion: Motion, traction: &[Vec<f64>; 2]) {
        self.steps
            .retain(|step| step.mesh != mesh || step.motion != motion);
        // Extrapolation by a parabola through three motions takes 8 to 15 % more products on creep curves and maps.
        if self.steps.iter().filter(|step| step.mesh == mesh).count() == 2
            && let Some(oldest) = self.steps.iter().position(|step| step.mesh == mesh)
        {
            self.steps.remove(oldest);
        }
        self.steps.push(Step {
            mesh,
            motion,
            traction: traction.clone(),
        });
    }

    /// Forgets the tractions on a mesh.
    pub fn forget(&mut self, mesh: usize) {
        self.steps.retain(|step| step.mesh != mesh);
    }

    /// The predicted tractions of a motion, within their bounds: extrapolated on the line through the last two motions, or those of
    /// the last motion if it is near.
    pub fn start(&self, mesh: usize, motion: &Motion, bound: &[f64]) -> Option<[Vec<f64>; 2]> {
        let mut steps = self.steps.iter().rev().filter(|step| step.mesh == mesh);
        let last = steps.next()?;
        let to_go = difference(motion, &last.motion);
        let before = steps.next().and_then(|before| {
            let along = on_line(to_go, difference(&last.motion, &before.motion))?;
            (along > 0.0).then_some((before, along))
        });
        let mut start = match before {
            Some((before, along)) => [0, 1].map(|k| {
                let pairs = last.traction[k].iter().zip(&before.traction[k]);
                pairs.map(|(t, before)| t + along * (t - before)).collect()
            }),
            None => is_near(motion, &last.motion).then(|| last.traction.clone())?,
        };
        shrink(&mut start, bound);
        Some(start)
    }
}

/// `s` such that `to = s·step`, if the vectors are parallel.
fn on_line(to: [f64; 3], step: [f64; 3]) -> Option<f64> {
    let along = dot(to, step) / dot(step, step);
    let aside = [0, 1, 2].map(|k| to[k] - along * step[k]);
    // Parallel up to rounding.
    (dot(aside, aside).sqrt() <= 1e-6 * dot(to, to).sqrt()).then_some(along)
}

/// Whether the tractions of the last motion can be used unchanged.
fn is_near(motion: &Motion, last: &Motion) -> bool {
    let (whole, to_go) = (motion.components(), difference(motion, last));
    dot(to_go, to_go) <= NEAR * NEAR * dot(whole, whole)
}

/// Scales tractions back to their friction circles.
fn shrink(traction: &mut [Vec<f64>; 2], bound: &[f64]) {
    let [x, y] = traction;
    for ((x, y), bound) in x.iter_mut().zip(y.iter_mut()).zip(bound) {
        let long = length(*x, *y);
        if long > *bound {
            *x *= bound / long;
            *y *= bound / long;
        }
    }
}

fn difference(a: &Motion, b: &Motion) -> [f64; 3] {
    let (a, b) = (a.components(), b.components());
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(creepage_x: f64, creepage_y: f64) -> Motion {
        Motion {
            creepage_x,
            creepage_y,
            spin_per_mm: 0.0,
        }
    }

    fn of(values: [f64; 2]) -> [Vec<f64>; 2] {
        values.map(|value| vec![value])
    }

    #[test]
    fn motions_on_a_line_are_extrapolated_within_their_discs() {
        let mut predictor = Predictor::default();
        assert_eq!(predictor.start(0, &moving(1.0, 1.0), &[1.0]), None);
        predictor.remember(0, moving(1.0, 1.0), &of([0.2, 0.0]));
        predictor.remember(0, moving(2.0, 1.0), &of([0.3, 0.0]));
        let near =
            |a: Option<[Vec<f64>; 2]>, b: f64| a.is_some_and(|a| (a[0][0] - b).abs() < 1e-12);
        assert!(near(predictor.start(0, &moving(3.0, 1.0), &[1.0]), 0.4));
        assert!(near(predictor.start(0, &moving(3.0, 1.0), &[0.35]), 0.35));
        assert_eq!(predictor.start(1, &moving(3.0, 1.0), &[1.0]), None);
    }

    #[test]
    fn motions_beside_the_line_start_from_the_last_one_if_they_are_near() {
        let mut predictor = Predictor::default();
        predictor.remember(0, moving(1.0, 1.0), &of([0.2, 0.0]));
        predictor.remember(0, moving(2.0, 1.0), &of([0.3, 0.0]));
        let start = predictor.start(0, &moving(2.0, 1.1), &[1.0]);
        assert_eq!(start, Some(of([0.3, 0.0])));
        assert_eq!(predictor.start(0, &moving(2.0, 9.0), &[1.0]), None);
    }
}
