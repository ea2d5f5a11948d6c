//! Both discretisation rules on one mesh, each from its starts.

use std::borrow::Cow;

use crate::friction::path_dependent::PathDependentFriction;
use crate::friction::velocity_weakening::Softening;
use crate::half_space::strip_operator::kind::Parity;
use crate::half_space::strip_operator::operator::StripOperator;
use crate::monitor::{Monitor, Stop};
use crate::numerics::simd::length;
use crate::rolling::answer::{LevelFailure, Work};
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::methods::boundary_element::task::{
    Convergence, LevelTask, NewtonTask, STEPS_MAX,
};
use crate::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::rolling::slip_equations::{SlipEquations, SlipSource};
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// If the change of the bounds in a round exceeds this part of the change before, the following steps are halved. Chosen by judgement.
const PASSAGE_FALL: f64 = 0.7;

/// The results of the three-point rule besides its tractions.
pub(super) struct ThreePointAnswer {
    pub(super) slip: [Vec<f64>; 2],
    pub(super) slips: Vec<bool>,
}

/// The solve of one motion on one mesh.
pub(super) struct RuleSequence<'a> {
    level: &'a StripMesh,
    motion: &'a Motion,
    fall: Option<Softening>,
    passage: Option<PathDependentFriction<'a>>,
    tolerance: f64,

    operator: &'a StripOperator,
    pub(super) parity: Option<Parity>,
    /// Bounds of the cells; without slip if they weaken with slip.
    bound: Vec<f64>,
    /// Bounds at the slips of the three-point rule, once it is solved; `None` if they do not depend on slip.
    slipping: Option<Vec<f64>>,
    area: Vec<f64>,
    workspace: &'a mut NewtonWorkspace,
    monitor: &'a dyn Monitor,
    pub(super) work: Work,
}

impl<'a> RuleSequence<'a> {
    pub(super) fn new(
        task: LevelTask<'a>,
        operator: &'a StripOperator,
        workspace: &'a mut NewtonWorkspace,
        monitor: &'a dyn Monitor,
    ) -> RuleSequence<'a> {
        let LevelTask {
            level,
            motion,
            fall,
            passage,
            tolerance,
        } = task;
        let parity = level.parity(motion);
        let padded = operator.padded(parity);
        let padded_with_zeros = |values: &[f64]| {
            let length = padded.max(values.len());
            let mut all = Vec::with_capacity(length);
            all.extend_from_slice(values);
            all.resize(length, 0.0);
            all
        };
        RuleSequence {
            level,
            motion,
            fall,
            passage,
            tolerance,
            operator,
            parity,
            bound: padded_with_zeros(&level.bound),
            slipping: None,
            area: padded_with_zeros(&level.normalised.areas()),
            workspace,
            monitor,
            work: Work::default(),
        }
    }

    fn equations(&self, rule: Rule) -> SlipEquations<'a> {
        SlipEquations::new(rule, &self.level.normalised, self.operator, self.parity)
            .with_layer(&self.level.normalised, self.level.layer)
    }

    /// Slips of the motion and of the surface.
    fn rigid(&self, equations: &SlipEquations) -> Vec<f64> {
        let source = self.level.surface_slip.as_ref();
        equations.given(self.motion, source.map(|[x, y]| SlipSource { x, y }))
    }

    fn newton<'e>(&self, equations: &'e SlipEquations<'e>) -> Newton<'e> {
        // The trapezoid rule uses the bounds of the three-point rule, because its own slips alternate from cell to cell.
        let fall = self.fall.filter(|_| equations.rule != Rule::Trapezoid);
        Newton::new(equations).falling(&self.bound, fall)
    }

    /// The bounds of all cells of the mesh at the slips of the solution.
    pub(super) fn bounds(&self) -> Cow<'a, [f64]> {
        match &self.slipping {
            None => Cow::Borrowed(&self.level.bound),
            Some(bound) => Cow::Owned(self.level.whole(self.parity, bound)),
        }
    }

    /// The unknowns of a start, or zeros.
    pub(super) fn start(&self, start: Option<&[Vec<f64>; 2]>) -> Vec<f64> {
        let padded = self.operator.padded(self.parity);
        let mut t = vec![0.0; 2 * padded];
        if let Some([x, y]) = start {
            let cells = self.level.mesh.cells();
            let unknowns = if self.parity.is_some() {
                cells / 2
            } else {
                cells
            };
            t[..unknowns].copy_from_slice(&x[..unknowns]);
            t[padded..padded + unknowns].copy_from_slice(&y[..unknowns]);
        }
        t
    }

    /// Solves one rule from `t`.
    fn rule(&mut self, newton: &Newton, rigid: &[f64], t: &mut [f64]) -> Result<Convergence, Stop> {
        let largest = rigid.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        let falls = newton.rule() != Rule::Trapezoid;
        let law = NewtonTask {
            rigid,
            bound: match &self.slipping {
                Some(slipping) if !falls => slipping,
                _ => &self.bound,
            },
            fall: self.fall.filter(|_| falls),
            area: &self.area,
            // Small motions cause small tractions, whose residual must not be relative to the bounds.
            scale: (largest * newton.compliance()).min(1.0),
            tolerance: self.tolerance,
            // Starts of the trapezoid rule come from other meshes or motions; one step makes the solution independent of them.
            accepts_start: falls,
        };
        let report = newton.solve(&law, t, self.workspace, self.monitor)?;
        self.work.add(newton.work(&report));
        Ok(report)
    }

    /// Solves the three-point rule from the start, or else from the upwind solution.
    pub(super) fn three_point(&mut self, t: &mut [f64]) -> Result<ThreePointAnswer, LevelFailure> {
        let equations = self.equations(Rule::ThreePoint);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations);
        let mut report = self.rule(&newton, &rigid, t)?;
        // The start may prevent convergence.
        if !report.converged {
            t.fill(0.0);
            // The upwind rule is of first order but monotone. Its solution is only a start.
            self.upwind(t)?;
            report = self.rule(&newton, &rigid, t)?;
        }
        if !report.converged {
            return Err(LevelFailure::NotConverged {
                work: self.work,
                tolerance: self.tolerance,
                advice: report.advice(),
            });
        }
        if let Some(passage) = self.passage {
            self.follow_passage(&newton, &rigid, passage, t)?;
        }
        let found = ThreePointAnswer {
            slip: self.own_slip(),
            slips: newton.zones(&self.bound, t, self.workspace.slip(), self.level),
        };
        if let Some(fall) = self.fall {
            self.slipping = Some(newton.bounds(&self.bound, &fall, t, self.workspace.slip()));
        }
        Ok(found)
    }

    /// Solves repeatedly with the bounds of the last slips until both agree. The trapezoid rule uses the same bounds.
    fn follow_passage(
        &mut self,
        newton: &Newton,
        rigid: &[f64],
        passage: PathDependentFriction,
        t: &mut [f64],
    ) -> Result<(), LevelFailure> {
        let (cells, rest) = (newton.cells(), self.bound.clone());
        let (mut change, mut weight) = (f64::INFINITY, 1.0);
        // None of 200 random motions with temperature-dependent friction took as many.
        for _ in 0..STEPS_MAX {
            let slips = self.workspace.slip();
            let padded = slips.len() / 2;
            let sizes = (0..cells).map(|i| match newton.slips(&self.bound, t, slips, i) {
                true => length(slips[i], slips[padded + i]),
                false => 0.0,
            });
            let sizes: Vec<f64> = sizes.collect();
            let found = passage.bounds(&self.level.normalised, &rest, &sizes);
            let pairs = found.iter().zip(&self.bound).take(cells);
            let before = change;
            change = pairs
                .map(|(new, old)| (new - old).abs())
                .fold(0.0, f64::max);
            if change <= self.tolerance {
                self.bound.copy_from_slice(&found);
                self.slipping = Some(found);
                return Ok(());
            }
            // The bounds of layers that harden fast change by more than the slip.
            if change > PASSAGE_FALL * before {
                weight *= 0.5;
            }
            for (bound, found) in self.bound.iter_mut().zip(found) {
                *bound += weight * (found - *bound);
            }
            if !self.rule(newton, rigid, t)?.converged {
                break;
            }
        }
        Err(LevelFailure::NotConverged {
            work: self.work,
            tolerance: self.tolerance,
            advice: format!(
                "bounds and the heat or plastic shear that they follow from still change by {change:.1e} of the largest; a smaller fall or hardening helps"
            ),
        })
    }

    fn upwind(&mut self, t: &mut [f64]) -> Result<bool, Stop> {
        let equations = self.equations(Rule::Upwind);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations);
        Ok(self.rule(&newton, &rigid, t)?.converged)
    }

    /// Solves the trapezoid rule from `t` in at most `steps_max` Newton steps and returns the slip flags. Without convergence, `t` and its residual do not
    /// change.
    pub(super) fn trapezoid(
        &mut self,
        t: &mut [f64],
        steps_max: u32,
    ) -> Result<Option<Vec<bool>>, Stop> {
        let equations = self.equations(Rule::Trapezoid);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations).with_steps_max(steps_max);
        let (mut found, residual) = (t.to_vec(), self.work.residual);
        let report = self.rule(&newton, &rigid, &mut found)?;
        if !report.converged {
            self.work.residual = residual;
            return Ok(None);
        }
        t.copy_from_slice(&found);
        let slip = self.workspace.slip();
        Ok(Some(newton.zones(&self.bound, t, slip, self.level)))
    }

    /// The slips of the last rule that was solved, over the whole mesh.
    pub(super) fn own_slip(&self) -> [Vec<f64>; 2] {
        self.expand(self.workspace.slip())
    }

    /// Values of the unknowns (x then y) as two vectors over the whole mesh.
    pub(super) fn expand(&self, values: &[f64]) -> [Vec<f64>; 2] {
        self.level.expand(self.parity, values)
    }
}
