//! Displacements of an earlier, smaller state of a self-similar loading.
//!
//! Under a gap of second degree, a patch that is pressed together along one load path stays similar to itself: at half the size it has half the tractions and
//! a quarter of the displacements (Spence 1968). With the displacements U(x) of the present state, those of the state smaller by ρ are ρ⁻² U(ρx).
//!
//! The state after pressing bodies that differ, computed step by step for a growing patch (Spence 1968, 1975).
//!
//! In a step the patch grows by the factor ρ. The slip is minus the change of the displacements U at a fixed place, whose backward difference of second order in
//! the logarithm of the size is `3/2 U(x) − 2 ρ⁻² U(ρx) + 1/2 ρ⁻⁴ U(ρ²x)`. Steps follow until the tractions are the scaled copy of those before, so that the
//! initial state is forgotten.

use crate::half_space::kernels::{Rectangle, rectangle};
use crate::half_space::unlike_bodies::displacement;
use crate::mesh::Mesh;
use crate::numerics::interpolation;
use crate::rolling::answer::LevelFailure;
use crate::rolling::history::level_run::LevelRun;
use crate::rolling::history::plan::{StepEquations, weights};
use crate::rolling::slip_equations::SlipScratch;
use crate::rolling::task::Motion;

/// The state that determines the displacements, over all cells of a dimensionless mesh.
#[derive(Debug, Clone, Default)]
pub(crate) struct PressedState {
    /// Displacements at the nodes, along x and across.
    pub(crate) displacement: [Vec<f64>; 2],
    /// Tractions.
    pub(crate) traction: [Vec<f64>; 2],
}

impl PressedState {
    /// The mean of two states.
    pub(crate) fn mean(&self, other: &PressedState) -> PressedState {
        let between = |a: &[Vec<f64>; 2], b: &[Vec<f64>; 2]| {
            [0, 1].map(|k| a[k].iter().zip(&b[k]).map(|(a, b)| 0.5 * (a + b)).collect())
        };
        PressedState {
            displacement: between(&self.displacement, &other.displacement),
            traction: between(&self.traction, &other.traction),
        }
    }
}

/// The displacement at a scaled place as a function of the state.
#[derive(Debug, Clone)]
enum ScaledPlace {
    /// Inside the patch: weights of the displacements at nodes around.
    Inside(Vec<(usize, f64)>),
    /// Outside: influence of the tractions of all cells (along x from x, mixed, across from y) and displacement by the pressures.
    Outside {
        along: Vec<f64>,
        mixed: Vec<f64>,
        across: Vec<f64>,
        of_pressure: [f64; 2],
    },
}

/// The displacements, at the nodes of the present state, of the state that was smaller by a factor.
#[derive(Debug, Clone)]
pub(crate) struct SelfSimilarState {
    factor: f64,
    places: Vec<ScaledPlace>,
}

/// Elastic constants of the pair, and pressures over the unit of traction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PressedPair<'a> {
    /// Poisson's ratio of the pair.
    pub(crate) poisson_ratio: f64,
    /// K of the pair.
    pub(crate) difference: f64,
    /// Pressures of all cells.
    pub(crate) pressure: &'a [f64],
}

impl SelfSimilarState {
    /// The state smaller by `factor`, more than 1, about `centre`, at the first `cells` nodes of a mesh.
    pub(crate) fn new(
        mesh: &Mesh,
        pair: &PressedPair,
        centre: [f64; 2],
        factor: f64,
        cells: usize,
    ) -> SelfSimilarState {
        let scaled = |x: f64, y: f64| {
            [
                centre[0] + factor * (x - centre[0]),
                centre[1] + factor * (y - centre[1]),
            ]
        };
        let mut places = Vec::with_capacity(cells);
        for segment in &mesh.segments {
            for i in segment.cells.clone().take_while(|i| *i < cells) {
                let at = scaled(mesh.node[i], segment.chord.y);
                places.push(match around(mesh, at) {
                    Some(weights) => ScaledPlace::Inside(weights),
                    None => outside(mesh, pair, at),
                });
            }
        }
        SelfSimilarState { factor, places }
    }

    /// Displacements of the smaller state at the nodes.
    pub(crate) fn displacements(&self, state: &PressedState) -> [Vec<f64>; 2] {
        let scale = self.factor.powi(-2);
        let [u, v] = &state.displacement;
        let [tx, ty] = &state.traction;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let at = |place: &ScaledPlace| match place {
            ScaledPlace::Inside(weights) => {
                let sum = |values: &[f64]| weights.iter().map(|(i, w)| w * values[*i]).sum();
                [sum(u), sum(v)]
            }
            ScaledPlace::Outside {
                along,
                mixed,
                across,
                of_pressure: [x, y],
            } => [
                x + dot(along, tx) + dot(mixed, ty),
                y + dot(mixed, tx) + dot(across, ty),
            ],
        };
        let found: Vec<[f64; 2]> = self.places.iter().map(at).collect();
        [0, 1].map(|k| found.iter().map(|u| scale * u[k]).collect())
    }

    /// Memory in bytes on a mesh.
    pub(crate) fn bytes(cells: f64) -> f64 {
        // Two factors, unknowns in half of the cells, and three numbers for the third of the scaled nodes that lies outside.
        3.0 * 8.0 * cells * cells / 3.0
    }
}

/// Nodes around a place of the mesh with their weights, by cubics along x at the same angle and across; `None` outside.
fn around(mesh: &Mesh, [x, y]: [f64; 2]) -> Option<Vec<(usize, f64)>> {
    let middles: Vec<f64> = mesh.segments.iter().map(|s| s.chord.y).collect();
    let (first, last) = (*middles.first()?, *middles.last()?);
    if middles.len() < 4 || y < first || y > last {
        return None;
    }
    let above = middles.partition_point(|middle| *middle < y);
    let from = above.saturating_sub(2).min(middles.len() - 4);
    let nodes: [f64; 4] = std::array::from_fn(|k| middles[from + k]);
    let relative = |j: usize| {
        let chord = mesh.segments[j].chord;
        let half = 0.5 * (chord.right - chord.left);
        (x - 0.5 * (chord.left + chord.right)) / half
    };
    let strips: [usize; 4] = std::array::from_fn(|k| from + k);
    let mut places = strips.map(relative);
    if places.iter().any(|place| place.abs() >= 1.0) {
        // Near the edge strips are followed at the relative position of the place.
        let half = |j: usize| 0.5 * (mesh.segments[j].chord.right - mesh.segments[j].chord.left);
        let squares = strips.map(|j| half(j) * half(j));
        let weights = interpolation::polynomial_weights(&nodes, y);
        let square: f64 = weights.iter().zip(squares).map(|(w, s)| w * s).sum();
        let middle: f64 = weights
            .iter()
            .zip(strips)
            .map(|(w, j)| {
                let chord = mesh.segments[j].chord;
                0.5 * w * (chord.left + chord.right)
            })
            .sum();
        let place = (x - middle) / square.max(0.0).sqrt();
        if place.is_nan() || place.abs() >= 1.0 {
            return None;
        }
        places = [place; 4];
    }
    let across = interpolation::polynomial_weights(&nodes, y);
    let mut weights = Vec::with_capacity(16);
    for (k, j) in strips.into_iter().enumerate() {
        for (i, weight) in along(mesh, j, places[k])? {
            weights.push((i, across[k] * weight));
        }
    }
    Some(weights)
}

/// Nodes of strip `j` and their weights at a relative position between −1 and 1: a cubic in the angle, in which nodes have equal distances.
fn along(mesh: &Mesh, j: usize, place: f64) -> Option<[(usize, f64); 4]> {
    let segment = &mesh.segments[j];
    let chord = segment.chord;
    let (middle, half) = (
        0.5 * (chord.left + chord.right),
        0.5 * (chord.right - chord.left),
    );
    let angle = |x: f64| ((x - middle) / half).clamp(-1.0, 1.0).asin();
    let cells = segment.cells.clone();
    if cells.len() < 4 {
        return None;
    }
    let at = place.asin();
    let above = mesh.node[cells.clone()].partition_point(|x| angle(*x) < at);
    let from = cells.start + above.saturating_sub(2).min(cells.len() - 4);
    let nodes: [f64; 4] = std::array::from_fn(|k| angle(mesh.node[from + k]));
    let weights = interpolation::polynomial_weights(&nodes, at);
    Some(std::array::from_fn(|k| (from + k, weights[k])))
}

/// The influence of every cell on a place outside.
fn outside(mesh: &Mesh, pair: &PressedPair, [x, y]: [f64; 2]) -> ScaledPlace {
    let [mut along, mut mixed, mut across] =
        [0; 3].map(|_| Vec::<f64>::with_capacity(mesh.cells()));
    for segment in &mesh.segments {
        let (middle, half) = (segment.chord.y, 0.5 * segment.chord.dy);
        for i in segment.cells.clone() {
            let cell = Rectangle {
                x0: mesh.left[i],
                x1: mesh.right[i],
                y0: middle - half,
                y1: middle + half,
            };
            let found = rectangle(x, y, cell, pair.poisson_ratio);
            along.push(found.xx);
            mixed.push(found.xy);
            across.push(found.yy);
        }
    }
    ScaledPlace::Outside {
        along,
        mixed,
        across,
        of_pressure: displacement(mesh, pair.difference, pair.pressure, [x, y]),
    }
}

// The constants below were chosen on the three contacts of `tests/physics/pressing.rs`.

/// Growth of the patch in a step.
const GROWTH: f64 = 1.05;
/// Largest number of steps; 100 steps reduce the influence of the initial state by 130.
const STEPS_MAX: usize = 300;
/// Step from which the mean of two states is used as the past: single cells at the edge of the stick zone may alternate for ever where nearly all sticks.
pub(super) const STEPS_FREE: usize = 60;
/// Mean change of the tractions in a step, relative to the friction limit, at which they count as self-similar. 1e-6 gives the same forces and areas.
const CHANGE: f64 = 2e-5;

impl LevelRun<'_> {
    /// Finds the tractions after pressing the bodies together.
    ///
    /// # Errors
    /// A step did not converge, or the monitor stopped the work.
    pub(super) fn press(&mut self, of: &StepEquations) -> Result<(), LevelFailure> {
        let (level, cells) = (self.level, self.cells);
        let mesh = &level.normalised;
        let difference = self.task.elasticity.difference;
        let unit = self.task.interface.reduction / level.scale.traction;
        let pressure: Vec<f64> = level.pressure.iter().map(|p| p * unit).collect();
        let pair = PressedPair {
            poisson_ratio: level.poisson_ratio,
            difference,
            pressure: &pressure,
        };
        let centre = level.scale.origin.map(|x| -x / level.scale.length);
        let smaller = [GROWTH, GROWTH * GROWTH]
            .map(|factor| SelfSimilarState::new(mesh, &pair, centre, factor, cells));
        let rows = mesh.segments.iter().flat_map(|s| {
            let y = s.chord.y;
            s.cells.clone().map(move |i| [mesh.node[i], y])
        });
        let given: Vec<[f64; 2]> = rows
            .map(|at| displacement(mesh, difference, &pressure, at))
            .collect();
        // The patch starts without a past.
        let mut past: Option<[PressedState; 2]> = None;
        let mut change = f64::INFINITY;
        for step in 0..STEPS_MAX {
            self.monitor.go_on(0.0)?;
            let [now, last, earlier] = weights(1.0);
            let mut source = [0, 1].map(|k| given.iter().map(|u| -now * u[k]).collect());
            if let Some(past) = &past {
                for ((state, smaller), weight) in past.iter().zip(&smaller).zip([last, -earlier]) {
                    add(&mut source, &smaller.displacements(state), weight);
                }
            }
            let tractions = self.solve(of, &Motion::default(), &source)?;
            change = self.mean_change(&tractions);
            let state = self.pressed(of, &tractions, &given);
            past = Some(match past {
                None => [state.clone(), state],
                Some([last, _]) if step < STEPS_FREE => [state, last],
                // The mean removes cells that alternate from step to step.
                Some([last, _]) => {
                    let mean = state.mean(&last);
                    [mean.clone(), mean]
                }
            });
            self.state.tractions = tractions;
            if change < CHANGE && step > 1 {
                self.settle(of);
                return Ok(());
            }
        }
        Err(LevelFailure::NotConverged {
            work: self.state.work,
            tolerance: CHANGE,
            advice: format!(
                "tractions still change by {change:.1e} of the friction limit in a step of growth; try another mesh"
            ),
        })
    }

    /// Mean change of tractions from those of the state, over the friction limit.
    fn mean_change(&self, tractions: &[f64]) -> f64 {
        let before = &self.state.tractions;
        let change: Vec<f64> = tractions.iter().zip(before).map(|(t, b)| t - b).collect();
        self.mean(&change)
    }

    /// Mean length of tractions over the friction limit.
    pub(super) fn mean(&self, tractions: &[f64]) -> f64 {
        let half = tractions.len() / 2;
        let of_cell = |i: usize| self.area[i] * tractions[i].hypot(tractions[half + i]);
        (0..self.cells).map(of_cell).sum::<f64>() / self.limit
    }

    /// The state for given tractions and the displacements by pressures.
    fn pressed(&self, of: &StepEquations, tractions: &[f64], given: &[[f64; 2]]) -> PressedState {
        let mut own = vec![0.0; tractions.len()];
        of.equations
            .displacement(tractions, &mut own, &mut SlipScratch::default());
        let mut displacement = self.expand(&own);
        for (k, displacement) in displacement.iter_mut().enumerate() {
            let both = displacement.iter_mut().zip(given);
            both.for_each(|(u, given)| *u += given[k]);
        }
        PressedState {
            displacement,
            traction: self.expand(tractions),
        }
    }

    /// Sets the displacements and energies of the state found. Friction has dissipated a fifth of its power per growth.
    fn settle(&mut self, of: &StepEquations) {
        let mut displacement = vec![0.0; self.state.tractions.len()];
        let mut scratch = SlipScratch::default();
        of.equations
            .displacement(&self.state.tractions, &mut displacement, &mut scratch);
        let slip = self.workspace.slip().to_vec();
        let length = self.level.scale.length;
        let over = self.per_patch(&self.state.tractions, &slip);
        let stored = self.per_patch(&self.state.tractions, &displacement);
        let state = &mut self.state;
        state.motion = Motion::default();
        for patch in 0..over.len() {
            let per_growth = length * over[patch] / GROWTH.ln();
            // Energies grow with the fifth power of the size.
            state.dissipated[patch] = (per_growth / 5.0).max(0.0);
            state.stored[patch] = [0.5 * length * stored[patch]; 2];
        }
        state.earlier.clone_from(&displacement);
        state.displacement = displacement;
    }
}

/// Adds values with a weight.
fn add(sum: &mut [Vec<f64>; 2], values: &[Vec<f64>; 2], weight: f64) {
    for (sum, values) in sum.iter_mut().zip(values) {
        sum.iter_mut()
            .zip(values)
            .for_each(|(sum, value)| *sum += weight * value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::mesh_between;

    /// A field of second degree is its own smaller self.
    #[test]
    fn a_field_that_is_its_own_copy_is_met_inside() {
        let half = |y: f64| (1.0 - 0.25 * y * y).sqrt();
        let mesh = mesh_between(1.8, [12, 16], |y| [-half(y), half(y)]);
        let cells = mesh.cells();
        let rows = mesh.cell_load_y();
        let pressure = vec![0.0; cells];
        let pair = PressedPair {
            poisson_ratio: 0.3,
            difference: 0.0,
            pressure: &pressure,
        };
        let of = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..cells).map(|i| f(mesh.node[i], rows[i])).collect()
        };
        let u = of(&|x, y| 0.3 * x * x - x * y);
        let v = of(&|x, y| y * y + 0.2 * x * y);
        let state = PressedState {
            displacement: [u.clone(), v.clone()],
            traction: [vec![0.0; cells], vec![0.0; cells]],
        };
        let smaller = SelfSimilarState::new(&mesh, &pair, [0.0; 2], 1.05, cells);
        let found = smaller.displacements(&state);
        let mut inside = 0;
        for i in 0..cells {
            if matches!(smaller.places[i], ScaledPlace::Inside(_)) {
                inside += 1;
                let off = (found[0][i] - u[i]).hypot(found[1][i] - v[i]);
                assert!(off < 2e-3, "{} {}: {off}", mesh.node[i], rows[i]);
            }
        }
        assert!(inside > cells / 2 && inside < cells, "{inside} of {cells}");
    }
}
