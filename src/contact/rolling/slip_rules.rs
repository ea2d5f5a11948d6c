//! Discretisation rules, which give the slip on a cell from displacement differences along its segment.
//!
//! Steady rolling requires `s = w + ∂u/∂x` (Johnson 1985, §8.1; Liu & Hsu, eq. 2). All rules take differences towards the leading edge, which selects the
//! solution that vanishes there and makes the problem well posed. Slip is in units of G⁻¹ × traction, lengths in the unit of the mesh.

use std::ops::Range;

use railhead_macros::Named;

use crate::mesh::{Mesh, Segment, observe};

/// The available rules.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum Rule {
    /// Mean slip between a node and the next (the leading edge for the last node). First order, monotone.
    Upwind,
    /// One-sided three-point derivative at the node; behind the leading edge the nodes are mirrored. Second order,
    /// smooth slips.
    #[serde(rename = "mirror")]
    ThreePoint,
    /// Eq. 6 of Liu & Hsu with `x_U` at the leading edge and half weight for the own cell, differenced along the strip: the mean of the slips of neighbouring
    /// cells is the mean slip between their nodes. Second order, with the best forces; its slips oscillate next to the stick zone.
    Trapezoid,
}

/// A rule prepared for the segments of a mesh, cell by cell: `t_i = Σ_k band_i[k] (d_{i+k} + W_{i+k})` and, backwards from the leading cell of a segment,
/// `s_i = t_i − carry_i s_{i+1}`.
#[derive(Debug, Clone, PartialEq)]
pub struct Stencils {
    band: Vec<[f64; 3]>,
    carry: Vec<f64>,
    /// x at which the rigid slip of each cell is sampled. A rule with `carry` adds that of the next cell as for `s`.
    rigid_at: Vec<f64>,
    /// Factor of the rigid slip at `rigid_at`.
    rigid_weight: Vec<f64>,
}

impl Stencils {
    /// Prepares a rule for all segments of a mesh, or for the first of them.
    pub fn new(rule: Rule, mesh: &Mesh, segments: &[Segment]) -> Stencils {
        let cells = segments.last().map_or(0, |segment| segment.cells.end);
        let mut stencils = Stencils {
            band: vec![[0.0; 3]; cells],
            carry: vec![0.0; cells],
            rigid_at: vec![0.0; cells],
            rigid_weight: vec![1.0; cells],
        };
        let mut points = Vec::new();
        for segment in segments {
            observe(mesh, segment, &mut points);
            stencils.prepare(rule, segment.cells.clone(), &points);
        }
        stencils
    }

    /// Prepares a rule for a quantity that is 0 beyond the leading edge instead of being mirrored there.
    pub fn ending_at_the_edge(rule: Rule, mesh: &Mesh, segments: &[Segment]) -> Stencils {
        let mut stencils = Stencils::new(rule, mesh, segments);
        let mut points = Vec::new();
        for segment in segments.iter().filter(|_| rule == Rule::ThreePoint) {
            observe(mesh, segment, &mut points);
            let n = segment.cells.len();
            let last = &mut stencils.band[segment.cells.end - 1];
            *last = [1.0 / (points[n] - points[n - 1]), 0.0, 0.0];
            if n > 1 {
                let [a, b] = [n - 1, n].map(|k| points[k] - points[n - 2]);
                let (w1, w2) = (b / (a * (b - a)), -a / (b * (b - a)));
                stencils.band[segment.cells.end - 2] = [w1 + w2, w2, 0.0];
            }
        }
        stencils
    }

    /// Prepares the rule for one segment with these observation points.
    fn prepare(&mut self, rule: Rule, cells: Range<usize>, points: &[f64]) {
        let n = cells.len();
        for (k, i) in cells.enumerate() {
            let (x, next) = (points[k], points[k + 1]);
            match rule {
                Rule::Upwind => {
                    self.band[i] = [1.0 / (next - x), 0.0, 0.0];
                    self.rigid_at[i] = 0.5 * (x + next);
                }
                Rule::ThreePoint => {
                    self.band[i] = three_point(points, k, n);
                    self.rigid_at[i] = if n == 1 { 0.5 * (x + next) } else { x };
                }
                Rule::Trapezoid => {
                    let share = if k + 1 < n { 0.5 } else { 1.0 };
                    self.band[i] = [1.0 / (share * (next - x)), 0.0, 0.0];
                    self.carry[i] = if k + 1 < n { 1.0 } else { 0.0 };
                    self.rigid_at[i] = 0.5 * (x + next);
                    self.rigid_weight[i] = 1.0 / share;
                }
            }
        }
    }

    /// Slip of a segment from its displacement differences: `differences` has `cells + 2` values, `slip` has `cells`.
    #[inline]
    pub fn elastic(&self, cells: Range<usize>, differences: &[f64], slip: &mut [f64]) {
        let n = cells.len();
        let (d, band, carry, slip) = (
            &differences[..n + 2],
            &self.band[cells.clone()],
            &self.carry[cells],
            &mut slip[..n],
        );
        let mut ahead = 0.0;
        for i in (0..n).rev() {
            let [c0, c1, c2] = band[i];
            ahead = c0 * d[i] + c1 * d[i + 1] + c2 * d[i + 2] - carry[i] * ahead;
            slip[i] = ahead;
        }
    }

    /// Given slip of every cell of a segment, where `w(i, x)` is the slip of cell i at x. Rigid slip is linear in x.
    pub fn given(&self, cells: Range<usize>, w: impl Fn(usize, f64) -> f64, slip: &mut [f64]) {
        let mut ahead = 0.0;
        for (i, slip) in cells.zip(slip).rev() {
            ahead = self.rigid_weight[i] * w(i, self.rigid_at[i]) - self.carry[i] * ahead;
            *slip = ahead;
        }
    }
}

/// Weights of the three-point derivative at node `i` on the differences `d_i`, `d_{i+1}`, `d_{i+2}`.
///
/// The observation points are the `n` nodes, the leading edge and the images of the last two nodes. The derivative skips the edge, so the difference across
/// it is the sum of two stored differences.
fn three_point(points: &[f64], i: usize, n: usize) -> [f64; 3] {
    if n == 1 {
        return [1.0 / (points[1] - points[0]), 0.0, 0.0];
    }
    let beyond = |k: usize| if k < n { points[k] } else { points[k + 1] };
    let (a, b) = (beyond(i + 1) - points[i], beyond(i + 2) - points[i]);
    let (w1, w2) = (b / (a * (b - a)), -a / (b * (b - a)));
    match n - i {
        1 => [w1 + w2, w1 + w2, w2],
        2 => [w1 + w2, w2, w2],
        _ => [w1 + w2, w2, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Chord;
    use crate::mesh::Grading;
    use crate::mesh::observation_points;

    fn mesh(n: usize) -> Mesh {
        let chord = Chord {
            patch: 0,
            strip: 0,
            y: 0.0,
            dy: 1.0,
            left: -2.0,
            right: 1.0,
        };
        Mesh::new(&[chord], &Grading::cosine(n))
    }

    fn slips(rule: Rule, n: usize, u: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let mesh = mesh(n);
        let segment = &mesh.segments[0];
        let points = observation_points(&mesh, segment);
        let differences: Vec<f64> = points.windows(2).map(|p| u(p[1]) - u(p[0])).collect();
        let mut slip = vec![0.0; n];
        Stencils::new(rule, &mesh, &mesh.segments).elastic(0..n, &differences, &mut slip);
        mesh.node.iter().copied().zip(slip).collect()
    }

    #[test]
    fn every_rule_is_exact_for_a_uniform_strain() {
        for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
            for n in [1, 2, 3, 9] {
                for (_, s) in slips(rule, n, |x| 0.7 * x - 3.0) {
                    assert!((s - 0.7).abs() < 1e-12, "{rule:?} {n} {s}");
                }
            }
        }
    }

    #[test]
    fn the_three_point_rule_is_exact_for_a_parabola() {
        for n in [2, 3, 9] {
            for (x, s) in slips(Rule::ThreePoint, n, |x| x * x) {
                assert!((s - 2.0 * x).abs() < 1e-12, "{n} {x} {s}");
            }
        }
    }

    #[test]
    fn neighbouring_slips_of_the_trapezoid_average_to_the_mean_strain() {
        let found = slips(Rule::Trapezoid, 8, |x| x.powi(3));
        for pair in found.windows(2) {
            let ((x0, s0), (x1, s1)) = (pair[0], pair[1]);
            assert!((0.5 * (s0 + s1) - (x1.powi(3) - x0.powi(3)) / (x1 - x0)).abs() < 1e-12);
        }
    }

    #[test]
    fn rigid_slip_enters_every_rule_like_a_displacement_of_that_slope() {
        for rule in [Rule::Upwind, Rule::ThreePoint, Rule::Trapezoid] {
            for n in [1, 2, 7] {
                let mesh = mesh(n);
                let segment = &mesh.segments[0];
                let points = observation_points(&mesh, segment);
                let displaced = |x: f64| 0.3 * x + 0.2 * x * x;
                let differences: Vec<f64> = points
                    .windows(2)
                    .map(|p| displaced(p[1]) - displaced(p[0]))
                    .collect();
                let stencils = Stencils::new(rule, &mesh, &mesh.segments);
                let (mut elastic, mut rigid) = (vec![0.0; n], vec![0.0; n]);
                stencils.elastic(0..n, &differences, &mut elastic);
                stencils.given(0..n, |_, x| 0.3 + 0.4 * x, &mut rigid);
                for i in 0..n {
                    assert!(
                        (elastic[i] - rigid[i]).abs() < 1e-12,
                        "{rule:?} {n} {i}: {} {}",
                        elastic[i],
                        rigid[i]
                    );
                }
            }
        }
    }
}
