//! Semismooth Newton iteration on the projected friction law `T = Π(T + r s(T))`, where Π projects onto the disc of radius g.
//!
//! With `z = T + r s`, a cell sticks where `|z| ≤ g`: both components are unknown and `s = 0`. It slips where `|z| > g`: `T = g d + τ t` with `d = z/|z|` and
//! `t ⟂ d`, one unknown τ and one equation `t·s = D τ`, `D = (|z| − g)/(g r)`. Each step solves this linear system by GMRES with the self-influence blocks of
//! the segments as preconditioner. The projection form is that of Alart & Curnier (1991), with `r = 0.3/M_ii`, because larger values can cycle on fine
//! meshes. Where the bound weakens with slip, Π is the resolvent of that law: see [`FallingRow`].

use crate::friction::velocity_weakening::Softening;
use crate::monitor::{Monitor, Stop};
use crate::numerics::gmres::LinearSystem;
use crate::numerics::simd::length;
use crate::rolling::answer::Work;
use crate::rolling::methods::boundary_element::linearisation::{FallingRow, Linearisation};
use crate::rolling::methods::boundary_element::preconditioner::{OwnBlocks, StripFactors};
use crate::rolling::methods::boundary_element::task::{Convergence, NewtonTask, STEPS_MAX};
use crate::rolling::methods::boundary_element::workspace::{NewtonWorkspace, StepVectors, zeroed};
use crate::rolling::slip_equations::{SlipEquations, SlipScratch};
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;

// The sensitivities below: each constant was changed alone, on the first 160 ellipses of `cargo bench --bench calibrate ellipse` at the targets 0.005 and
// 0.001, and on 12 sweeps of 9 motions. No change made a solve fail or moved an error beyond its scatter.

/// Projection parameter r times `M_ii`. 0.2 takes 2 to 8 % more Newton steps; 0.45 takes 1 to 4 % fewer but is closer to values that cycle.
const PROJECTION: f64 = 0.3;
/// Distance of the tractions of slipping cells from the tangents of their friction circles, relative to the residual, up to which they are not moved there,
/// which saves a product. 0.03 takes 1 % more products, 0.3 takes 1 % fewer and 1 % more steps.
const LIFT_NEGLIGIBLE: f64 = 0.1;
/// Smallest and largest tolerance of a linear system. 3e-5 and 3e-4 in place of the first change nothing; 0.05 in place of the second takes 3 to 5 % more
/// products in 5 % fewer steps, and 0.2 the reverse.
const INNER_TOLERANCE: (f64, f64) = (1e-4, 1e-1);
/// Least tolerance of a linear system over the ratio of the final to the present residual. Chosen by judgement.
const INNER_OF_GOAL: f64 = 0.3;
/// Solver for one rule on one mesh. It is immutable, so threads may share it.
#[derive(Debug)]
pub struct Newton<'a> {
    equations: &'a SlipEquations<'a>,
    own: OwnBlocks,
    /// Projection parameter r of every cell.
    parameter: Vec<f64>,
    /// See [`Newton::compliance`].
    compliance: f64,
    steps_max: u32,
}

impl<'a> Newton<'a> {
    /// Collects the self-influence blocks.
    pub fn new(equations: &'a SlipEquations<'a>) -> Newton<'a> {
        let own = OwnBlocks::new(equations);
        let diagonal = own.diagonal(equations);
        let parameter: Vec<f64> = diagonal.iter().map(|m| PROJECTION / m.abs()).collect();
        let sum: f64 = parameter.iter().sum();
        Newton {
            equations,
            compliance: sum / (PROJECTION * parameter.len().max(1) as f64),
            parameter,
            own,
            steps_max: STEPS_MAX,
        }
    }

    /// The solver with at most `steps_max` steps in place of [`STEPS_MAX`].
    #[must_use]
    pub(super) fn with_steps_max(self, steps_max: u32) -> Newton<'a> {
        Newton { steps_max, ..self }
    }

    /// Returns this solver for bounds that weaken with slip from `bound`. r is at least twice the steepest weakening of each cell, which makes its resolvent
    /// unique.
    #[must_use]
    pub fn falling(mut self, bound: &[f64], fall: Option<Softening>) -> Newton<'a> {
        let Some(fall) = fall else {
            return self;
        };
        let steepest = fall.steepest();
        for (r, bound) in self.parameter.iter_mut().zip(bound) {
            *r = r.max(2.0 * steepest * bound);
        }
        self
    }

    /// Returns this solver with a smaller r, for a slip of each cell that grows by `gain` when all tractions grow by one. Displacements reach far, so the
    /// tractions of a step together move a cell much more than its own traction does.
    #[must_use]
    pub fn far_reaching(mut self, gain: &[f64]) -> Newton<'a> {
        for (r, gain) in self.parameter.iter_mut().zip(gain) {
            *r = PROJECTION / (PROJECTION / *r + gain.abs());
        }
        self
    }

    /// The rule in use.
    pub fn rule(&self) -> Rule {
        self.equations.rule
    }

    /// A typical `1/M_ii`: the traction that one unit of slip causes on a cell.
    pub fn compliance(&self) -> f64 {
        self.compliance
    }

    /// Entries of the operator that one product reads.
    pub fn entries(&self) -> usize {
        self.equations.entries()
    }

    /// Number of cells with unknowns.
    pub fn cells(&self) -> usize {
        self.equations.cells()
    }

    /// Solves for the tractions, starting from those in `t`. Without convergence `t` holds the best iterate.
    ///
    /// # Errors
    /// Only if the monitor stops the work.
    pub fn solve(
        &self,
        law: &NewtonTask,
        t: &mut [f64],
        workspace: &mut NewtonWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<Convergence, Stop> {
        let mut report = Convergence::default();
        let mut vectors = std::mem::take(&mut workspace.vectors);
        vectors.copy(t);
        let StepVectors { step, rhs, best } = &mut vectors;
        let mut least = f64::INFINITY;
        let mut last = f64::INFINITY;
        report.residual = self.evaluate(law, t, workspace, &mut report);
        loop {
            if report.residual < least {
                least = report.residual;
                best.copy_from_slice(t);
            }
            let is_answer = law.accepts_start || report.iterations > 0;
            if is_answer && report.residual <= law.tolerance {
                report.converged = true;
                break;
            }
            // An iterate that is not a number cannot be improved.
            if report.iterations == self.steps_max || report.residual.is_nan() {
                break;
            }
            self.linearise(law, t, rhs, workspace, &mut report);
            let NewtonWorkspace { blocks, linear, .. } = &mut *workspace;
            blocks.factor(&self.own, self.equations, linear);
            let inner = inner_tolerance(report.residual, last, law.tolerance);
            self.linear_step(rhs, inner, step, workspace, monitor, &mut report)?;
            last = report.residual;
            self.advance(law, t, step, &workspace.linear);
            report.residual = self.evaluate(law, t, workspace, &mut report);
            report.iterations += 1;
        }
        if !report.converged {
            report.residual = least;
            t.copy_from_slice(best);
        }
        workspace.vectors = vectors;
        Ok(report)
    }

    /// The bounds of all cells at the slips of a solution; those without slip where cells stick.
    pub fn bounds(&self, rest: &[f64], fall: &Softening, t: &[f64], slip: &[f64]) -> Vec<f64> {
        let mut bounds = rest.to_vec();
        for (i, bound) in bounds.iter_mut().enumerate().take(self.equations.cells()) {
            let (_, length) = self.projected(t, slip, i);
            if length > *bound {
                *bound = fall.resolvent(*bound, self.parameter[i], length).bound;
            }
        }
        bounds
    }

    /// `z = T + r s` of a cell and its length.
    fn projected(&self, t: &[f64], slip: &[f64], cell: usize) -> ([f64; 2], f64) {
        let (padded, r) = (self.equations.padded(), self.parameter[cell]);
        let z = [cell, padded + cell].map(|i| t[i] + r * slip[i]);
        (z, (z[0] * z[0] + z[1] * z[1]).sqrt())
    }

    /// Whether a cell slips under tractions `t` with their slips.
    pub fn slips(&self, bound: &[f64], t: &[f64], slip: &[f64], cell: usize) -> bool {
        self.projected(t, slip, cell).1 > bound[cell]
    }

    /// Slip flags of all cells of the whole mesh, for tractions with their slips.
    pub fn zones(&self, bound: &[f64], t: &[f64], slip: &[f64], level: &StripMesh) -> Vec<bool> {
        let mut zones = Vec::with_capacity(level.mesh.cells());
        zones.extend((0..self.cells()).map(|i| self.slips(bound, t, slip, i)));
        if self.cells() < level.mesh.cells() {
            let segments = &level.mesh.segments;
            for segment in segments[..segments.len() / 2].iter().rev() {
                zones.extend_from_within(segment.cells.clone());
            }
        }
        zones
    }

    /// The work of a solve.
    pub(crate) fn work(&self, report: &Convergence) -> Work {
        Work {
            iterations: report.iterations,
            products: report.products,
            entries: u64::from(report.products) * self.entries() as u64,
            residual: report.residual,
        }
    }

    /// Computes the slips of `t`, which stay in the workspace, and returns the residual of the projected law.
    pub fn evaluate(
        &self,
        law: &NewtonTask,
        t: &[f64],
        workspace: &mut NewtonWorkspace,
        report: &mut Convergence,
    ) -> f64 {
        let padded = self.equations.padded();
        self.slip(law, t, workspace, report);
        let slip = &workspace.slip;
        let (mut sum, mut weight) = (0.0, 0.0);
        for i in 0..self.equations.cells() {
            let (tx, ty, r) = (t[i], t[padded + i], self.parameter[i]);
            let (zx, zy) = (tx + r * slip[i], ty + r * slip[padded + i]);
            let length = (zx * zx + zy * zy).sqrt();
            let shrink = match &law.fall {
                _ if length <= law.bound[i] => 1.0,
                None => law.bound[i] / length,
                Some(fall) => fall.resolvent(law.bound[i], r, length).bound / length,
            };
            sum += law.area[i] * ((tx - shrink * zx).powi(2) + (ty - shrink * zy).powi(2));
            weight += law.area[i];
        }
        (sum / weight).sqrt() / law.scale
    }

    /// Computes the slips `q + M T`.
    fn slip(
        &self,
        law: &NewtonTask,
        t: &[f64],
        workspace: &mut NewtonWorkspace,
        report: &mut Convergence,
    ) {
        let NewtonWorkspace { slip, product, .. } = workspace;
        zeroed(slip, 2 * self.equations.padded());
        self.equations.elastic(t, slip, product);
        report.products += 1;
        for (s, q) in slip.iter_mut().zip(law.rigid) {
            *s += q;
        }
    }

    /// Divides the cells into stick and slip by the last slips, moves `t` of slipping cells to the tangent of the friction circle, and computes the right-hand
    /// side there.
    fn linearise(
        &self,
        law: &NewtonTask,
        t: &mut [f64],
        rhs: &mut [f64],
        workspace: &mut NewtonWorkspace,
        report: &mut Convergence,
    ) {
        let residual = report.residual;
        let (padded, cells) = (self.equations.padded(), self.equations.cells());
        let NewtonWorkspace {
            linear,
            to_tangent,
            slip,
            ..
        } = &mut *workspace;
        linear.clear();
        to_tangent.clear();
        let (mut lifted, mut weight) = (0.0, 0.0);
        for i in 0..cells {
            let r = self.parameter[i];
            let (zx, zy) = (t[i] + r * slip[i], t[padded + i] + r * slip[padded + i]);
            let (length, bound) = ((zx * zx + zy * zy).sqrt(), law.bound[i]);
            weight += law.area[i];
            let fall = law.fall.as_ref().filter(|_| length > bound && bound > 0.0);
            if let Some(fall) = fall {
                let found = fall.resolvent(bound, r, length);
                let row = FallingRow::new(i, [zx, zy], length, r, &found);
                linear.falling.push(row);
            }
            if length <= bound || fall.is_some() {
                linear.two_unknowns();
                to_tangent.push((0.0, 0.0));
                continue;
            }
            let (dx, dy) = (zx / length, zy / length);
            linear.direction.push((-dy, dx));
            // A cell without pressure carries no traction, which means infinite stiffness. A large finite one keeps the factorisation accurate.
            let stiffness = if bound > 0.0 {
                (length - bound) / (bound * r)
            } else {
                1e12 / r
            };
            linear.stiffness.push(stiffness.min(1e12 / r));
            let lift = bound - (dx * t[i] + dy * t[padded + i]);
            to_tangent.push((lift * dx, lift * dy));
            lifted += law.area[i] * lift * lift;
        }
        // Near the solution the distance to the tangent is smaller than the residual after the step.
        if (lifted / weight).sqrt() > LIFT_NEGLIGIBLE * residual * law.scale {
            for (i, (x, y)) in to_tangent.iter().enumerate() {
                t[i] += x;
                t[padded + i] += y;
            }
            self.slip(law, t, workspace, report);
        }
        self.right_hand_side(t, rhs, workspace);
    }

    /// Computes the right-hand side of a linearisation at an iterate.
    fn right_hand_side(&self, t: &[f64], rhs: &mut [f64], workspace: &NewtonWorkspace) {
        let (padded, cells) = (self.equations.padded(), self.equations.cells());
        let NewtonWorkspace { linear, slip, .. } = workspace;
        rhs.fill(0.0);
        for i in 0..cells {
            let (sx, sy) = (slip[i], slip[padded + i]);
            if linear.slips(i) {
                let (ux, uy) = linear.direction[i];
                let along = ux * t[i] + uy * t[padded + i];
                rhs[i] = linear.stiffness[i] * along - (ux * sx + uy * sy);
            } else {
                rhs[i] = -sx;
                rhs[padded + i] = -sy;
            }
        }
        for row in &linear.falling {
            let [x, y] = [row.cell, padded + row.cell];
            [rhs[x], rhs[y]] = row.right([slip[x], slip[y]], [t[x], t[y]]);
        }
    }

    /// Solves the linear system to a relative tolerance.
    fn linear_step(
        &self,
        rhs: &[f64],
        tolerance: f64,
        step: &mut [f64],
        workspace: &mut NewtonWorkspace,
        monitor: &dyn Monitor,
        report: &mut Convergence,
    ) -> Result<(), Stop> {
        let NewtonWorkspace {
            blocks,
            gmres,
            linear,
            slip,
            product,
            expanded,
            ..
        } = workspace;
        zeroed(expanded, step.len());
        let mut system = NewtonSystem {
            equations: self.equations,
            linear,
            blocks,
            product,
            expanded,
            slip,
            monitor,
        };
        let report_of_step = gmres.solve(&mut system, rhs, tolerance, step)?;
        report.products += report_of_step.products;
        report.inexact_steps += u32::from(!report_of_step.converged);
        Ok(())
    }

    /// Adds the step to `t`, with slipping cells projected onto the friction circle.
    fn advance(&self, law: &NewtonTask, t: &mut [f64], step: &[f64], linear: &Linearisation) {
        let padded = self.equations.padded();
        for i in 0..self.equations.cells() {
            if linear.slips(i) {
                let (ux, uy) = linear.direction[i];
                let (x, y) = (t[i] + ux * step[i], t[padded + i] + uy * step[i]);
                let size = length(x, y);
                let factor = if size > 0.0 { law.bound[i] / size } else { 0.0 };
                t[i] = factor * x;
                t[padded + i] = factor * y;
            } else {
                t[i] += step[i];
                t[padded + i] += step[padded + i];
            }
        }
    }
}

/// Tolerance of a linear system: the square of the progress of the residual (Eisenstat & Walker 1996, choice 2), which is loose while the zones still move,
/// but no tighter than the last step needs.
fn inner_tolerance(residual: f64, last: f64, goal: f64) -> f64 {
    let progress = if last.is_finite() {
        0.5 * (residual / last).powi(2)
    } else {
        1.0
    };
    progress
        .max(INNER_OF_GOAL * goal / residual)
        .clamp(INNER_TOLERANCE.0, INNER_TOLERANCE.1)
}

/// The linearised equations as a system for GMRES.
pub(crate) struct NewtonSystem<'a> {
    pub(crate) equations: &'a SlipEquations<'a>,
    pub(crate) linear: &'a Linearisation,
    pub(crate) blocks: &'a mut StripFactors,
    pub(crate) product: &'a mut SlipScratch,
    pub(crate) expanded: &'a mut [f64],
    pub(crate) slip: &'a mut [f64],
    pub(crate) monitor: &'a dyn Monitor,
}

impl LinearSystem for NewtonSystem<'_> {
    fn product(&mut self, x: &[f64], out: &mut [f64]) {
        let (padded, cells) = (self.equations.padded(), self.equations.cells());
        for i in 0..cells {
            if self.linear.slips(i) {
                let (ux, uy) = self.linear.direction[i];
                self.expanded[i] = ux * x[i];
                self.expanded[padded + i] = uy * x[i];
            } else {
                self.expanded[i] = x[i];
                self.expanded[padded + i] = x[padded + i];
            }
        }
        self.equations
            .elastic(self.expanded, self.slip, self.product);
        out.fill(0.0);
        for i in 0..cells {
            let (sx, sy) = (self.slip[i], self.slip[padded + i]);
            if self.linear.slips(i) {
                let (ux, uy) = self.linear.direction[i];
                out[i] = ux * sx + uy * sy - self.linear.stiffness[i] * x[i];
            } else {
                out[i] = sx;
                out[padded + i] = sy;
            }
        }
        for row in &self.linear.falling {
            let [i, j] = [row.cell, padded + row.cell];
            [out[i], out[j]] = row.apply([out[i], out[j]], [x[i], x[j]]);
        }
    }

    fn precondition(&mut self, x: &mut [f64]) {
        self.blocks.apply(x);
    }

    fn tick(&mut self) -> Result<(), Stop> {
        self.monitor.go_on(0.0)
    }
}
