//! A fixed point for the tractions where the rigid slip is large everywhere.

use crate::contact::friction::velocity_weakening::Softening;
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::numerics::simd::length;
use crate::contact::rolling::methods::boundary_element::newton::Newton;
use crate::contact::rolling::methods::boundary_element::task::{
    Convergence, NewtonTask, NewtonTermination,
};
use crate::contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;

/// The fixed point is tried if the rigid slip of every cell exceeds this, in units of (μ p_max)/G. 15 and 60 give the
/// same work on the 160 ellipses that `newton.rs` names, few of which slip so far.
const FIXED_POINT_FROM: f64 = 30.0;

/// Iterations of the fixed point before Newton's take over. 8 and 20 are alike on the same ellipses.
const SWEEPS_MAX: u32 = 12;

/// Forces of two solutions that differ by no more than this part of the friction limit are the same: ten times what the iteration leaves.
pub(crate) const SAME_SOLUTION: f64 = 4e-3;

/// Iterates `T ← g s/|s|` if the rigid slip is large on every cell. An iteration costs one product, and its result has to meet the
/// residual that Newton's iterates have to meet. Returns nothing if it does not settle; `t` is then still a fair start.
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
        .map(|i| length(law.rigid[i], law.rigid[padded + i]))
        .fold(f64::INFINITY, f64::min);
    if smallest < FIXED_POINT_FROM {
        return Ok(None);
    }
    let mut report = Convergence::default();
    let follow = |t: &mut [f64], slip: &[f64]| {
        slide_along(slip, &law.bound[..cells], law.fall.as_ref(), t);
    };
    follow(t, law.rigid);
    for _ in 0..SWEEPS_MAX {
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(stop);
        }
        report.residual = newton.evaluate(law, t, workspace, &mut report);
        report.iterations += 1;
        if report.residual <= law.tolerance {
            report.exit = NewtonTermination::Converged;
            let full_slip = (0..cells).all(|i| newton.slips(law.bound, t, workspace.slip(), i));
            return Ok(full_slip.then_some(report));
        }
        follow(t, workspace.slip());
    }
    Ok(None)
}

/// Tractions of these cells at their bounds, along slips, both components one after the other.
pub(crate) fn slide_along(slip: &[f64], bound: &[f64], fall: Option<&Softening>, t: &mut [f64]) {
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
pub(crate) fn force_change(area: &[f64], t: &[f64], other: &[f64]) -> f64 {
    let padded = t.len() / 2;
    let [x, y] = [0, padded].map(|from| {
        let change = |(i, area): (usize, &f64)| area * (other[from + i] - t[from + i]);
        area.iter().enumerate().map(change).sum::<f64>()
    });
    x.hypot(y)
}
