//! Tractions along the slip, where the rigid slip is large everywhere.

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::methods::boundary_element::task::{Convergence, NewtonTask};
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;

/// Rigid slip above this, in the same units, makes the fixed point worth trying.
const FIXED_POINT_FROM: f64 = 30.0;

/// Sweeps of the fixed point before Newton takes over.
const SWEEPS_MAX: u32 = 12;

/// Tries `T ← g s/|s|` where the rigid slip is large on every cell: each sweep costs one product, and what it finds is
/// accepted only by the residual that Newton's iterates are held to. Returns nothing where it does not settle; `t`
/// is then still a fair start.
///
/// # Errors
/// Only if the monitor stops the work.
pub fn fixed_point(
    newton: &Newton,
    law: &NewtonTask,
    t: &mut [f64],
    workspace: &mut NewtonWorkspace,
    monitor: &dyn Monitor,
) -> Result<Option<Convergence>, Stop> {
    let padded = t.len() / 2;
    let cells = newton.cells();
    let smallest = (0..cells)
        .map(|i| law.rigid[i].hypot(law.rigid[padded + i]))
        .fold(f64::INFINITY, f64::min);
    if smallest < FIXED_POINT_FROM {
        return Ok(None);
    }
    let mut report = Convergence {
        converged: false,
        iterations: 0,
        products: 0,
        residual: f64::INFINITY,
        inexact_steps: 0,
    };
    let follow = |t: &mut [f64], slip: &[f64]| {
        for i in 0..cells {
            let factor = law.bound[i] / slip[i].hypot(slip[padded + i]);
            t[i] = factor * slip[i];
            t[padded + i] = factor * slip[padded + i];
        }
    };
    follow(t, law.rigid);
    for _ in 0..SWEEPS_MAX {
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(stop);
        }
        report.residual = newton.evaluate(law, t, workspace, &mut report);
        report.iterations += 1;
        if report.residual <= law.tolerance {
            report.converged = (0..cells).all(|i| newton.slips(law.bound, t, workspace.slip(), i));
            return Ok(report.converged.then_some(report));
        }
        follow(t, workspace.slip());
    }
    Ok(None)
}
