//! Buffers of the Newton iteration, kept by the caller.

use crate::numerics::gmres::Gmres;
use crate::rolling::methods::boundary_element::linearisation::Linearisation;
use crate::rolling::methods::boundary_element::preconditioner::StripFactors;
use crate::rolling::slip_equations::SlipScratch;

/// Buffers of the iteration for equations of any size. They grow to the largest, so a second solve of the same size allocates nothing. Between two calls only
/// [`slip`](Self::slip) is meaningful.
#[derive(Debug, Default)]
pub struct NewtonWorkspace {
    pub(crate) blocks: StripFactors,
    pub(crate) gmres: Gmres,
    pub(crate) linear: Linearisation,
    /// The vector from the traction of each slipping cell to the tangent of its friction circle.
    pub(crate) to_tangent: Vec<(f64, f64)>,
    pub(crate) slip: Vec<f64>,
    pub(crate) product: SlipScratch,
    /// The unknowns of the linear system, expanded to tractions.
    pub(crate) expanded: Vec<f64>,
    pub(crate) vectors: StepVectors,
}

/// Vectors of one Newton step.
#[derive(Debug, Default)]
pub(crate) struct StepVectors {
    pub(crate) step: Vec<f64>,
    pub(crate) rhs: Vec<f64>,
    pub(crate) best: Vec<f64>,
}

impl NewtonWorkspace {
    /// The slips `q + M T` of the last iterate that was evaluated, x then y.
    pub fn slip(&self) -> &[f64] {
        &self.slip
    }
}

impl StepVectors {
    /// Copies an iterate to all vectors.
    pub(crate) fn copy(&mut self, t: &[f64]) {
        let StepVectors { step, rhs, best } = self;
        for values in [step, rhs, best] {
            values.clear();
            values.extend_from_slice(t);
        }
    }
}

/// Resizes a buffer and fills it with zeros.
pub(crate) fn zeroed(buffer: &mut Vec<f64>, length: usize) {
    buffer.clear();
    buffer.resize(length, 0.0);
}
