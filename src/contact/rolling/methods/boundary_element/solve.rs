//! The fast solver: projection form, semismooth Newton, strip-preconditioned GMRES.
//!
//! Every level is solved twice: with the three-point rule from the given start, then with the trapezoid rule from that solution.
//! Tractions, zones and forces are those of the trapezoid rule, whose resultants are more exact. The size of the slip is that of the
//! three-point rule, whose slips are smooth; its direction is that of the traction, as Coulomb's law demands. The difference of the
//! two rules is one of the indicators of the error.

use crate::contact::half_space::strip_operator::kind::Parity;
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::numerics::gmres::GmresExit;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::answer::{
    LevelAnswer, LevelExit, LevelFailure, Work, project_on_bound,
};
use crate::contact::rolling::methods::boundary_element::fixed_point::fixed_point;
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::methods::boundary_element::task::{Convergence, NewtonTask};
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::contact::rolling::methods::full_slip;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::operator_store::LevelOperator;
use crate::contact::rolling::own_blocks::OwnBlocks;
use crate::contact::rolling::refinement::warm_start::Start;
use crate::contact::rolling::skip::Skip;
use crate::contact::rolling::slip_equations::SlipEquations;
use crate::contact::rolling::slip_rules::Rule;
use crate::contact::rolling::strip_mesh::StripMesh;

/// Solves one motion (dimensionless, about the level's origin) on one level, from a start or from zero tractions.
///
/// # Errors
/// [`LevelFailure::NotConverged`] if no start leads to a solution of the three-point rule; [`LevelFailure::Stopped`] if the
/// monitor stops the work. If only the trapezoid rule fails, the three-point tractions serve and a remark says so.
pub fn solve(
    level: &StripMesh,
    motion: &Motion,
    start: Option<&Start>,
    tolerance: f64,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    if let Some(answer) = full_slip::rigid_answer(level, motion) {
        return Ok(answer);
    }
    let operator = level.operator(monitor)?;
    let parity = level.parity(motion);
    let control = Control {
        tolerance,
        workspace,
        monitor,
    };
    let mut solve = RuleSequence::new(level, motion, &operator, parity, control);
    let mut skips = Vec::new();
    if parity.is_some() {
        skips.push(Skip::HalfTheCells);
    } else if level.is_mirrored() {
        skips.push(Skip::HalfTheOperator);
    }
    let mut t = solve.start(start.map(|start| &start.mirror));
    let mirror = solve.mirror(&mut t, start.is_some())?;
    if mirror.by_fixed_point {
        skips.push(Skip::FullSlip);
    }
    let by_mirror = solve.expand(&t);
    let mut remarks = Vec::new();
    let warm = start.and_then(|start| start.trapezoid.as_ref());
    let warm = warm.map(|warm| solve.start(Some(warm)));
    let (slips, second) = match solve.trapezoid(&mut t, warm)? {
        Some(slips) => (slips, Some(by_mirror)),
        None => {
            remarks.push(Remark::SecondRuleFailed {});
            (mirror.slips, None)
        }
    };
    let mut traction = solve.expand(&t);
    let slip = project_on_bound(&level.bound, &slips, &mut traction, &mirror.slip);
    Ok(LevelAnswer {
        traction,
        second,
        slip,
        slips,
        exit: LevelExit::Solved,
        work: solve.work,
        skips,
        remarks,
    })
}

/// Tractions of the trapezoid rule alone, from a start that is near; for the companions of a mesh.
///
/// # Errors
/// [`LevelFailure::NotConverged`] if neither the start nor the upwind solution leads to a solution; [`LevelFailure::Stopped`] if the
/// monitor stops the work.
pub fn trapezoid(
    level: &StripMesh,
    motion: &Motion,
    start: &[Vec<f64>; 2],
    tolerance: f64,
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<([Vec<f64>; 2], Work), LevelFailure> {
    if let Some(answer) = full_slip::rigid_answer(level, motion) {
        return Ok((answer.traction, answer.work));
    }
    let operator = level.operator(monitor)?;
    let parity = level.parity(motion);
    let control = Control {
        tolerance,
        workspace,
        monitor,
    };
    let mut solve = RuleSequence::new(level, motion, &operator, parity, control);
    let mut t = solve.start(Some(start));
    let Some(slips) = solve.trapezoid(&mut t, None)? else {
        return Err(LevelFailure::NotConverged {
            work: solve.work,
            tolerance,
            advice: "try another mesh".to_owned(),
        });
    };
    let mut traction = solve.expand(&t);
    let none = [0, 1].map(|_| vec![0.0; slips.len()]);
    project_on_bound(&level.bound, &slips, &mut traction, &none);
    Ok((traction, solve.work))
}

/// A clause that says why there is no answer, as far as is known, and what to do.
fn advice(report: &Convergence) -> String {
    let linear = match report.inexact_steps {
        0 => String::new(),
        steps => {
            let reason = GmresExit::RestartsUsedUp.reason();
            format!("in {steps} steps {reason}; ")
        }
    };
    format!("{linear}try another mesh, with cells and strips of similar width")
}

/// What the three-point rule gives besides tractions.
struct ThreePointAnswer {
    slip: [Vec<f64>; 2],
    slips: Vec<bool>,
    by_fixed_point: bool,
}

/// How exactly to solve, with which buffers, and who may stop it.
struct Control<'a> {
    tolerance: f64,
    workspace: &'a mut NewtonWorkspace,
    monitor: &'a dyn Monitor,
}

/// One motion on one level.
struct RuleSequence<'a> {
    level: &'a StripMesh,
    motion: &'a Motion,
    operator: &'a LevelOperator,
    parity: Option<Parity>,
    bound: Vec<f64>,
    area: Vec<f64>,
    control: Control<'a>,
    work: Work,
}

impl<'a> RuleSequence<'a> {
    fn new(
        level: &'a StripMesh,
        motion: &'a Motion,
        operator: &'a LevelOperator,
        parity: Option<Parity>,
        control: Control<'a>,
    ) -> RuleSequence<'a> {
        let padded = operator.influence.padded(parity);
        let resized = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(padded.max(values.len()), 0.0);
            values
        };
        RuleSequence {
            level,
            motion,
            operator,
            parity,
            bound: resized(&level.bound),
            area: resized(&level.normalised.areas()),
            control,
            work: Work::default(),
        }
    }

    fn equations(&self, rule: Rule) -> SlipEquations<'a> {
        SlipEquations::new(
            rule,
            &self.level.normalised,
            &self.operator.influence,
            self.parity,
        )
    }

    /// A solver that shares its own blocks with the other motions of the level.
    fn newton<'e>(&self, equations: &'e SlipEquations<'e>) -> Newton<'e> {
        let own = self
            .operator
            .own_blocks
            .get(equations.rule, self.parity, || OwnBlocks::new(equations));
        Newton::with_blocks(equations, own)
    }

    /// The start brought onto the unknowns, or zero tractions.
    fn start(&self, start: Option<&[Vec<f64>; 2]>) -> Vec<f64> {
        let padded = self.operator.influence.padded(self.parity);
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

    /// Solves one rule from `t`; `shortcut` allows the fixed point.
    fn rule(
        &mut self,
        newton: &Newton,
        rigid: &[f64],
        t: &mut [f64],
        shortcut: bool,
    ) -> Result<(Convergence, bool), Stop> {
        let largest = rigid.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        let law = NewtonTask {
            rigid,
            bound: &self.bound,
            area: &self.area,
            scale: (largest * newton.compliance()).min(1.0),
            tolerance: self.control.tolerance,
        };
        let Control {
            workspace, monitor, ..
        } = &mut self.control;
        let settled = if shortcut {
            fixed_point(newton, &law, t, workspace, *monitor)?
        } else {
            None
        };
        let by_fixed_point = settled.is_some();
        let report = match settled {
            Some(report) => report,
            None => newton.solve(&law, t, workspace, *monitor)?,
        };
        self.work.add(Work {
            iterations: report.iterations,
            products: report.products,
            entries: u64::from(report.products) * newton.entries() as u64,
            residual: report.residual,
        });
        Ok((report, by_fixed_point))
    }

    /// The three-point rule: from the start, else from zero, else from the upwind solution.
    fn mirror(&mut self, t: &mut [f64], started: bool) -> Result<ThreePointAnswer, LevelFailure> {
        let equations = self.equations(Rule::ThreePoint);
        let rigid = equations.rigid(self.motion);
        let newton = self.newton(&equations);
        let (mut report, by_fixed_point) = self.rule(&newton, &rigid, t, true)?;
        if !report.exit.converged() && started {
            t.fill(0.0);
            report = self.rule(&newton, &rigid, t, false)?.0;
        }
        if !report.exit.converged() {
            t.fill(0.0);
            self.upwind(t)?;
            report = self.rule(&newton, &rigid, t, false)?.0;
        }
        if !report.exit.converged() {
            return Err(LevelFailure::NotConverged {
                work: self.work,
                tolerance: self.control.tolerance,
                advice: advice(&report),
            });
        }
        Ok(ThreePointAnswer {
            slip: self.expand(self.control.workspace.slip()),
            slips: self.zones(&newton, t),
            by_fixed_point,
        })
    }

    /// Which cells of the whole mesh slip; `newton` has evaluated `t` last.
    fn zones(&self, newton: &Newton, t: &[f64]) -> Vec<bool> {
        let slip = self.control.workspace.slip();
        let slips: Vec<f64> = (0..newton.cells())
            .map(|i| f64::from(u8::from(newton.slips(&self.bound, t, slip, i))))
            .collect();
        let slips = if self.parity.is_some() {
            self.level.unfold(&slips, 1.0)
        } else {
            slips
        };
        slips.into_iter().map(|v| v > 0.5).collect()
    }

    fn upwind(&mut self, t: &mut [f64]) -> Result<bool, Stop> {
        let equations = self.equations(Rule::Upwind);
        let rigid = equations.rigid(self.motion);
        let newton = self.newton(&equations);
        Ok(self.rule(&newton, &rigid, t, false)?.0.exit.converged())
    }

    /// The trapezoid rule from a start of its own if there is one, else from the three-point solution in `t`, else from the
    /// upwind solution; returns which cells slip. If no start leads to a solution `t` is as it was.
    fn trapezoid(
        &mut self,
        t: &mut [f64],
        warm: Option<Vec<f64>>,
    ) -> Result<Option<Vec<bool>>, Stop> {
        let equations = self.equations(Rule::Trapezoid);
        let rigid = equations.rigid(self.motion);
        let newton = self.newton(&equations);
        let residual = self.work.residual;
        let mut converged = false;
        let mut found = t.to_vec();
        if let Some(warm) = warm {
            found.copy_from_slice(&warm);
            converged = self
                .rule(&newton, &rigid, &mut found, true)?
                .0
                .exit
                .converged();
            if !converged {
                found.copy_from_slice(t);
            }
        }
        if !converged
            && !self
                .rule(&newton, &rigid, &mut found, true)?
                .0
                .exit
                .converged()
        {
            found.fill(0.0);
            self.upwind(&mut found)?;
            if !self
                .rule(&newton, &rigid, &mut found, false)?
                .0
                .exit
                .converged()
            {
                self.work.residual = residual;
                return Ok(None);
            }
        }
        t.copy_from_slice(&found);
        Ok(Some(self.zones(&newton, t)))
    }

    /// Values of the unknowns (x then y) as two vectors over the whole mesh.
    fn expand(&self, values: &[f64]) -> [Vec<f64>; 2] {
        let (x, y) = values.split_at(values.len() / 2);
        match self.parity {
            None => [x, y].map(|v| v[..self.level.mesh.cells()].to_vec()),
            Some(Parity::Longitudinal) => [self.level.unfold(x, 1.0), self.level.unfold(y, -1.0)],
            Some(Parity::Lateral) => [self.level.unfold(x, -1.0), self.level.unfold(y, 1.0)],
        }
    }
}
