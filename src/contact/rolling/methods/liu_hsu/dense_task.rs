//! What the dense method solves: equations, bound and motion on one mesh.

use crate::contact::rolling::methods::boundary_element::task::NewtonTask;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::slip_equations::SlipEquations;

/// The problem on one mesh. All values are dimensionless, as in [`SlipEquations`].
#[derive(Debug, Clone, Copy)]
pub struct DenseTask<'a> {
    /// The discrete equations over the whole mesh, without parity.
    pub equations: &'a SlipEquations<'a>,
    /// Friction bound, rigid slip, tolerance.
    pub law: NewtonTask<'a>,
    /// x and y of every cell's node.
    pub nodes: (&'a [f64], &'a [f64]),
    /// The motion, of which only the direction of rigid slip is used.
    pub motion: Motion,
}
