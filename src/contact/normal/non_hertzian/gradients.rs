//! Pressure on a regular grid by conjugate gradients that never leave the contact conditions.
//!
//! Sought are `p ≥ 0` and `g = u(p) + h − δ ≥ 0` with `p g = 0` at every cell, and either the sum of p or the approach
//! δ prescribed (Polonsky and Keer 1999).

use crate::contact::influence::fft::Convolution;
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::normal::hertz::Pressing;

/// Iterations after which something is wrong: smooth gaps take 10 to 30, rough ones up to about 100.
const ITERATIONS_MAX: u32 = 500;

/// How far the two bodies are from touching where they should, and what they press.
#[derive(Debug, Clone)]
pub(super) struct Pressed {
    /// Pressure of every cell in MPa.
    pub(super) pressure: Vec<f64>,
    /// Distance of the deformed surfaces at every cell in mm; about 0 in contact.
    pub(super) distance: Vec<f64>,
    /// Approach in mm.
    pub(super) approach: f64,
    /// Iterations done.
    pub(super) iterations: u32,
    /// Largest violation of the contact conditions: |g| in contact, −g outside, relative to the deepest overlap of the
    /// undeformed surfaces.
    pub(super) residual: f64,
}

/// Why there is no pressure.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Failure {
    /// The iteration ended with this residual.
    NotConverged(f64),
    /// The caller stopped the work.
    Stopped(Stop),
}

/// Solves for the pressure under which surfaces with the gap `gap` touch; `cell` is the area of a cell in mm².
///
/// `start` is any pressure that is not 0 everywhere; it decides the number of iterations only.
pub(super) fn press(
    influence: &mut Convolution,
    gap: &[f64],
    cell: f64,
    pressing: Pressing,
    start: Vec<f64>,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<Pressed, Failure> {
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let n = gap.len();
    let mut p = start;
    let mut work = Work {
        u: vec![0.0; n],
        g: vec![0.0; n],
        t: vec![0.0; n],
        r: vec![0.0; n],
    };
    scale_to(&mut p, pressing, cell);
    let mut follow = false;
    let mut fresh = false;
    let mut last = 1.0;
    let mut residual = f64::INFINITY;
    for iterations in 0..ITERATIONS_MAX {
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(Failure::Stopped(stop));
        }
        if !fresh {
            influence.apply(&p, &mut work.u);
        }
        let approach = work.distances(&p, gap, pressing);
        residual = work.violation(&p) / (approach - least);
        if residual <= tolerance && approach > least {
            return Ok(Pressed {
                pressure: p,
                distance: work.g,
                approach,
                iterations,
                residual,
            });
        }
        let square = work.square(&p);
        let factor = if follow { square / last } else { 0.0 };
        last = square;
        work.direction(&p, factor);
        influence.apply(&work.t, &mut work.r);
        let step = work.step(&p, pressing, influence.own());
        (follow, fresh) = work.advance(&mut p, step);
        let scale = scale_to(&mut p, pressing, cell);
        if fresh {
            work.u.iter_mut().for_each(|u| *u *= scale);
        }
    }
    Err(Failure::NotConverged(residual))
}

/// Scales the pressures to the prescribed force; returns the factor.
fn scale_to(p: &mut [f64], pressing: Pressing, cell: f64) -> f64 {
    let Pressing::Force(force) = pressing else {
        return 1.0;
    };
    let scale = force / (cell * p.iter().sum::<f64>());
    p.iter_mut().for_each(|p| *p *= scale);
    scale
}

struct Work {
    /// Displacement.
    u: Vec<f64>,
    /// Distance of the deformed surfaces.
    g: Vec<f64>,
    /// Direction of the step, and its displacement.
    t: Vec<f64>,
    r: Vec<f64>,
}

impl Work {
    /// Puts `u + h − δ` into the distances and returns δ; with a force it makes the mean over the contact 0.
    fn distances(&mut self, p: &[f64], gap: &[f64], pressing: Pressing) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (k, p) in p.iter().enumerate() {
            self.g[k] = self.u[k] + gap[k];
            if *p > 0.0 {
                sum += self.g[k];
                count += 1.0;
            }
        }
        let approach = match pressing {
            Pressing::Force(_) => sum / count,
            Pressing::Approach(approach) => approach,
        };
        self.g.iter_mut().for_each(|g| *g -= approach);
        approach
    }

    fn violation(&self, p: &[f64]) -> f64 {
        let each = self.g.iter().zip(p);
        each.map(|(g, p)| if *p > 0.0 { g.abs() } else { -g })
            .fold(0.0, f64::max)
    }

    fn square(&self, p: &[f64]) -> f64 {
        let each = self.g.iter().zip(p);
        each.filter(|(_, p)| **p > 0.0).map(|(g, _)| g * g).sum()
    }

    fn direction(&mut self, p: &[f64], factor: f64) {
        for (k, p) in p.iter().enumerate() {
            self.t[k] = if *p > 0.0 {
                self.g[k] + factor * self.t[k]
            } else {
                0.0
            };
        }
    }

    /// Length of the step that leaves no distance along the direction; `own` is what a cell's pressure displaces itself.
    fn step(&self, p: &[f64], pressing: Pressing, own: f64) -> f64 {
        let mean = match pressing {
            Pressing::Force(_) => {
                let (mut sum, mut count) = (0.0, 0.0);
                for (r, _) in self.r.iter().zip(p).filter(|(_, p)| **p > 0.0) {
                    sum += r;
                    count += 1.0;
                }
                sum / count
            }
            Pressing::Approach(_) => 0.0,
        };
        let (mut above, mut below) = (0.0, 0.0);
        for (k, _) in p.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            above += self.g[k] * self.t[k];
            below += (self.r[k] - mean) * self.t[k];
        }
        // A single cell under a force leaves nothing to minimise; its own stiffness lets others in.
        if below > 0.0 && above > 0.0 {
            above / below
        } else {
            1.0 / own
        }
    }

    /// Takes the step. Says whether the next direction may build on this one (no cell came into contact) and whether the
    /// displacement is up to date (no pressure had to be cut either).
    fn advance(&mut self, p: &mut [f64], step: f64) -> (bool, bool) {
        let (mut follow, mut fresh) = (true, true);
        for (k, p) in p.iter_mut().enumerate() {
            if *p > 0.0 {
                *p -= step * self.t[k];
                if *p <= 0.0 {
                    (*p, fresh) = (0.0, false);
                }
            }
            // Outside, and what has just left the contact although the bodies overlap there.
            if *p == 0.0 && self.g[k] < 0.0 {
                *p = -step * self.g[k];
                (follow, fresh) = (false, false);
            }
        }
        if fresh {
            for (u, r) in self.u.iter_mut().zip(&self.r) {
                *u -= step * r;
            }
        }
        (follow, fresh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::monitor::Unwatched;

    const CELLS: usize = 24;
    const STEP: f64 = 0.5;
    const MODULUS: f64 = 115_000.0;

    fn paraboloid() -> Vec<f64> {
        let at = |i: usize| (i as f64 - 11.3) * STEP;
        (0..CELLS * CELLS)
            .map(|k| at(k % CELLS).powi(2) / 900.0 + at(k / CELLS).powi(2) / 600.0)
            .collect()
    }

    fn solved(pressing: Pressing, start: Vec<f64>) -> Pressed {
        let mut influence = Convolution::new(CELLS, CELLS, STEP, STEP, MODULUS);
        let gap = paraboloid();
        press(
            &mut influence,
            &gap,
            STEP * STEP,
            pressing,
            start,
            1e-9,
            &Unwatched,
        )
        .unwrap()
    }

    #[test]
    fn the_start_does_not_decide_the_pressure() {
        let even = solved(Pressing::Force(5e4), vec![1.0; CELLS * CELLS]);
        let mut corner = vec![0.0; CELLS * CELLS];
        corner[3] = 7.0;
        let far = solved(Pressing::Force(5e4), corner);
        let largest = even.pressure.iter().copied().fold(0.0, f64::max);
        for (a, b) in even.pressure.iter().zip(&far.pressure) {
            assert!((a - b).abs() < 1e-5 * largest, "{a} {b}");
        }
        assert!((even.pressure.iter().sum::<f64>() * STEP * STEP / 5e4 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn force_and_approach_are_two_names_for_one_contact() {
        let by_force = solved(Pressing::Force(5e4), vec![1.0; CELLS * CELLS]);
        let approach = Pressing::Approach(by_force.approach);
        let by_approach = solved(approach, vec![1.0; CELLS * CELLS]);
        let sum = |pressed: &Pressed| pressed.pressure.iter().sum::<f64>();
        assert!((sum(&by_approach) / sum(&by_force) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_overlaps_and_only_touching_cells_press() {
        let pressed = solved(Pressing::Force(5e4), vec![1.0; CELLS * CELLS]);
        let depth = pressed.approach;
        for (p, g) in pressed.pressure.iter().zip(&pressed.distance) {
            assert!(*p >= 0.0 && *g >= -1e-8 * depth);
            assert!(*p == 0.0 || g.abs() < 1e-8 * depth, "{p} {g}");
        }
    }
}
