//! The method on one mesh of a case.

use crate::half_space::strip_operator::operator::StripOperator;
use crate::monitor::{Monitor, Stop};
use crate::rolling::answer::{LevelAnswer, LevelFailure, Skip, Work, project_on_bound};
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::methods::boundary_element::task::NewtonTask;
use crate::rolling::methods::liu_hsu::solve::{self, ZonesOutcome};
use crate::rolling::methods::liu_hsu::stick_block::DenseTask;
use crate::rolling::slip_equations::SlipEquations;
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// Solves one motion about the origin of the case with the trapezoid rule. The spin pole comes from the mesh `coarse`; without it, guess 2 is skipped.
///
/// # Errors
/// [`LevelFailure::NotConverged`] with the residual of the final tractions; [`LevelFailure::Stopped`].
pub fn solve(
    level: &StripMesh,
    coarse: Option<&StripMesh>,
    motion: &Motion,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<LevelAnswer, LevelFailure> {
    if motion.is_still() {
        return Ok(LevelAnswer::without_traction(level, motion, Skip::NoMotion));
    }
    let here = level.scale.motion(motion);
    let operator = level.operator(monitor)?;
    let coarse = coarse.map(|coarse| Ok::<_, Stop>((coarse, coarse.operator(monitor)?)));
    let coarse = coarse.transpose()?;
    let fine = DenseParts::new(level, &operator, &here);
    let coarse = coarse.as_ref().map(|(level, operator)| {
        let motion = level.scale.motion(motion);
        DenseParts::new(level, operator, &motion)
    });
    let mut t = vec![0.0; 2 * fine.equations.padded()];
    let outcome = solve::solve(
        &fine.stage(tolerance),
        coarse.as_ref().map(|c| c.stage(tolerance)).as_ref(),
        &mut t,
        monitor,
    )?;
    let work = work(&outcome);
    if !outcome.exit().converged() {
        return Err(LevelFailure::NotConverged {
            work,
            tolerance,
            advice: outcome.advice(),
        });
    }
    let cells = level.mesh.cells();
    let padded = fine.equations.padded();
    let halves = |v: &[f64]| [v[..cells].to_vec(), v[padded..padded + cells].to_vec()];
    let mut traction = halves(&t);
    let slip = project_on_bound(
        &level.bound,
        &outcome.slips,
        &mut traction,
        &halves(&outcome.slip),
    );
    Ok(LevelAnswer {
        traction,
        slip,
        slips: outcome.slips,
        work,
        ..LevelAnswer::default()
    })
}

fn work(outcome: &ZonesOutcome) -> Work {
    Work {
        iterations: outcome.newton_iterations(),
        products: 0,
        entries: 0,
        residual: outcome.residual,
    }
}

/// The equations of a level, with the data that a [`DenseTask`] borrows.
struct DenseParts<'a> {
    level: &'a StripMesh,
    equations: SlipEquations<'a>,
    motion: Motion,
    rigid: Vec<f64>,
    bound: Vec<f64>,
    area: Vec<f64>,
    y: Vec<f64>,
    scale: f64,
}

impl<'a> DenseParts<'a> {
    fn new(level: &'a StripMesh, operator: &'a StripOperator, motion: &Motion) -> DenseParts<'a> {
        let equations = SlipEquations::new(Rule::Trapezoid, &level.normalised, operator, None);
        let padded = equations.padded();
        let resized = |mut values: Vec<f64>| {
            values.resize(padded, 0.0);
            values
        };
        let rigid = equations.rigid(motion);
        let largest = rigid.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        let compliance = Newton::new(&equations).compliance();
        DenseParts {
            bound: resized(level.bound.clone()),
            area: resized(level.normalised.areas()),
            y: level.normalised.cell_load_y(),
            scale: (largest * compliance).min(1.0),
            motion: *motion,
            level,
            equations,
            rigid,
        }
    }

    fn stage(&self, tolerance: f64) -> DenseTask<'_> {
        DenseTask {
            equations: &self.equations,
            law: NewtonTask {
                rigid: &self.rigid,
                bound: &self.bound,
                fall: None,
                area: &self.area,
                scale: self.scale,
                tolerance,
                accepts_start: true,
            },
            nodes: (&self.level.normalised.node, &self.y),
            motion: self.motion,
        }
    }
}
