//! The two rules of one motion on one level, each from the starts that it has.

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

/// Forces of two solutions that differ by no more than this part of the friction limit are the same: ten times what the iteration leaves.
const SAME_SOLUTION: f64 = 4e-3;
/// From this stability number on (see [`Newton::stability`]) a second solution is looked for. None was seen below 1.5 in 360 random
/// motions of the prototype.
const SECOND_START_FROM: f64 = 0.5;
/// A round that leaves more than this part of the change before it halves the steps of the next ones. Chosen by judgement; how much it matters was
/// not measured.
const PASSAGE_FALL: f64 = 0.7;

/// What the three-point rule gives besides tractions.
pub(super) struct ThreePointAnswer {
    pub(super) slip: [Vec<f64>; 2],
    pub(super) slips: Vec<bool>,
    /// By how much a second solution differs, see [`RuleSequence::other_solution`].
    pub(super) other: Option<f64>,
}

/// With which buffers to solve, and who may stop it.
pub(super) struct Control<'a> {
    pub(super) workspace: &'a mut NewtonWorkspace,
    pub(super) monitor: &'a dyn Monitor,
}

/// One motion on one level.
pub(super) struct RuleSequence<'a> {
    level: &'a StripMesh,
    motion: &'a Motion,
    fall: Option<Softening>,
    passage: Option<PathDependentFriction<'a>>,
    tolerance: f64,
    /// Newton steps of a rule at most.
    steps_max: u32,
    operator: &'a StripOperator,
    pub(super) parity: Option<Parity>,
    /// Bounds of the cells, at rest where they fall with the slip.
    bound: Vec<f64>,
    /// The same at the slips of the three-point rule, once it is solved; nothing where they do not fall.
    slipping: Option<Vec<f64>>,
    area: Vec<f64>,
    control: Control<'a>,
    pub(super) work: Work,
}

impl<'a> RuleSequence<'a> {
    pub(super) fn new(
        task: LevelTask<'a>,
        operator: &'a StripOperator,
        control: Control<'a>,
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
            steps_max: STEPS_MAX,
            operator,
            parity,
            bound: padded_with_zeros(&level.bound),
            slipping: None,
            area: padded_with_zeros(&level.normalised.areas()),
            control,
            work: Work::default(),
        }
    }

    fn equations(&self, rule: Rule) -> SlipEquations<'a> {
        SlipEquations::new(rule, &self.level.normalised, self.operator, self.parity)
            .with_layer(&self.level.normalised, self.level.layer)
    }

    /// Slips of the motion and of the pressure.
    fn rigid(&self, equations: &SlipEquations) -> Vec<f64> {
        let source = self.level.surface_slip.as_ref();
        equations.given(self.motion, source.map(|[x, y]| SlipSource { x, y }))
    }

    fn newton<'e>(&self, equations: &'e SlipEquations<'e>) -> Newton<'e> {
        // The trapezoid rule keeps the bounds that the three-point rule has found: its own slips alternate from cell
        // to cell, and bounds that follow them would do so too.
        let fall = self.fall.filter(|_| equations.rule != Rule::Trapezoid);
        Newton::new(equations).falling(&self.bound, fall)
    }

    /// The bounds of all cells of the mesh at the slips found.
    pub(super) fn bounds(&self) -> Cow<'a, [f64]> {
        match &self.slipping {
            None => Cow::Borrowed(&self.level.bound),
            Some(bound) => Cow::Owned(self.level.whole(self.parity, bound)),
        }
    }

    /// The start brought onto the unknowns, or zero tractions.
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
            // Small motions cause small tractions: relative to the bounds their residual would look small at once.
            scale: (largest * newton.compliance()).min(1.0),
            tolerance: self.tolerance,
            steps_max: self.steps_max,
            // Starts of the trapezoid rule come from other meshes or motions; one step makes the answer independent of them.
            accepts_start: falls,
        };
        let Control { workspace, monitor } = &mut self.control;
        let report = newton.solve(&law, t, workspace, *monitor)?;
        self.work.add(newton.work(&report));
        Ok(report)
    }

    /// The three-point rule: from the start, else from the upwind solution.
    pub(super) fn three_point(&mut self, t: &mut [f64]) -> Result<ThreePointAnswer, LevelFailure> {
        let equations = self.equations(Rule::ThreePoint);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations);
        let mut report = self.rule(&newton, &rigid, t)?;
        // The start may be what hinders the iteration.
        if !report.converged {
            t.fill(0.0);
            // The upwind rule is of first order, but monotone; its solution serves as a start only.
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
            slips: newton.zones(&self.bound, t, self.control.workspace.slip(), self.level),
            other: None,
        };
        let Some(fall) = self.fall else {
            return Ok(found);
        };
        // Now, because a second start overwrites the slips in the workspace.
        self.slipping = Some(newton.bounds(&self.bound, &fall, t, self.control.workspace.slip()));
        let other = match newton.stability() > SECOND_START_FROM {
            true => self.other_solution(&newton, &rigid, t)?,
            false => None,
        };
        Ok(ThreePointAnswer { other, ..found })
    }

    /// Solves on with the bounds that belong to the slips found, until both agree. These bounds are kept for the trapezoid rule too.
    fn follow_passage(
        &mut self,
        newton: &Newton,
        rigid: &[f64],
        passage: PathDependentFriction,
        t: &mut [f64],
    ) -> Result<(), LevelFailure> {
        let (cells, rest) = (newton.cells(), self.bound.clone());
        let (mut change, mut weight) = (f64::INFINITY, 1.0);
        // On 200 random motions with friction that falls with temperature none took as many.
        for _ in 0..STEPS_MAX {
            let slips = self.control.workspace.slip();
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
            // Layers that harden fast answer every change of slip by a larger one of their bounds.
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

    /// By how much the force differs, relative to the friction limit, if every cell slips along the rigid slip at first; nothing if
    /// that leads to no solution or to the same.
    fn other_solution(
        &mut self,
        newton: &Newton,
        rigid: &[f64],
        t: &[f64],
    ) -> Result<Option<f64>, Stop> {
        let Some(fall) = self.fall else {
            return Ok(None);
        };
        let cells = newton.cells();
        let (bound, area) = (&self.bound[..cells], &self.area[..cells]);
        let mut other = vec![0.0; t.len()];
        slide_along(rigid, bound, Some(&fall), &mut other);
        let limit: f64 = area.iter().zip(bound).map(|(a, g)| a * g).sum();
        let report = self.rule(newton, rigid, &mut other)?;
        if !report.converged {
            return Ok(None);
        }
        let change = force_change(&self.area[..cells], t, &other) / limit;
        Ok((change > SAME_SOLUTION).then_some(change))
    }

    fn upwind(&mut self, t: &mut [f64]) -> Result<bool, Stop> {
        let equations = self.equations(Rule::Upwind);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations);
        Ok(self.rule(&newton, &rigid, t)?.converged)
    }

    /// Which cells slip by the trapezoid rule, solved from `t` in at most `steps_max` Newton steps; `t` and its residual stay as they were if they do not
    /// suffice.
    pub(super) fn trapezoid(
        &mut self,
        t: &mut [f64],
        steps_max: u32,
    ) -> Result<Option<Vec<bool>>, Stop> {
        let equations = self.equations(Rule::Trapezoid);
        let rigid = self.rigid(&equations);
        let newton = self.newton(&equations);
        let (mut found, residual) = (t.to_vec(), self.work.residual);
        self.steps_max = steps_max;
        let report = self.rule(&newton, &rigid, &mut found)?;
        self.steps_max = STEPS_MAX;
        if !report.converged {
            self.work.residual = residual;
            return Ok(None);
        }
        t.copy_from_slice(&found);
        let slip = self.control.workspace.slip();
        Ok(Some(newton.zones(&self.bound, t, slip, self.level)))
    }

    /// The slips of the rule that was solved last, over the whole mesh.
    pub(super) fn own_slip(&self) -> [Vec<f64>; 2] {
        self.expand(self.control.workspace.slip())
    }

    /// Values of the unknowns (x then y) as two vectors over the whole mesh.
    pub(super) fn expand(&self, values: &[f64]) -> [Vec<f64>; 2] {
        self.level.expand(self.parity, values)
    }
}

/// Tractions of these cells at their bounds, along slips, both components one after the other.
fn slide_along(slip: &[f64], bound: &[f64], fall: Option<&Softening>, t: &mut [f64]) {
    let padded = t.len() / 2;
    for (i, rest) in bound.iter().enumerate() {
        let size = length(slip[i], slip[padded + i]);
        let bound = fall.map_or(*rest, |fall| rest * fall.at(size).0);
        let factor = if size > 0.0 { bound / size } else { 0.0 };
        t[i] = factor * slip[i];
        t[padded + i] = factor * slip[padded + i];
    }
}

/// Length of the difference of the forces of two sets of tractions on cells with these areas.
fn force_change(area: &[f64], t: &[f64], other: &[f64]) -> f64 {
    let padded = t.len() / 2;
    let [x, y] = [0, padded].map(|from| {
        let change = |(i, area): (usize, &f64)| area * (other[from + i] - t[from + i]);
        area.iter().enumerate().map(change).sum::<f64>()
    });
    x.hypot(y)
}
