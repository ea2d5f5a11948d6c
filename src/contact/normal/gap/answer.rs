//! The contact of a gap, or the reason why there is none.

use crate::contact::monitor::Stop;
use crate::contact::normal::gap::conjugate_gradients;
use crate::contact::normal::gap::grid::GridSide;
use crate::contact::normal::gap::surface::Window;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::remark::entry::RemarkEntry;

/// The contact of a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalAnswer {
    /// Region and pressure.
    pub field: PressureField,
    /// How it was found.
    pub report: NormalWork,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// How a normal problem was solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalWork {
    /// Cells of the last grid along x and y, of the one that carries most if there are several.
    pub cells: [usize; 2],
    /// Grids: 1, or one per patch where patches differ much in size.
    pub grids: usize,
    /// Iterations over all grids.
    pub iterations: u32,
    /// Largest violation of the contact conditions on the last grid, relative to the deepest overlap of the undeformed
    /// surfaces: distance in the contact, overlap outside.
    pub residual: f64,
    /// Largest pressure on the last grid but one, relative to that on the last, less 1; 0 if there was only one grid.
    pub pressure_change: f64,
}

/// Why a normal problem has no answer.
#[derive(Debug, Clone, PartialEq)]
pub enum NormalError {
    /// A reason, as a sentence.
    NoAnswer(String),
    /// The caller stopped the work.
    Stopped(Stop),
}

impl From<conjugate_gradients::PressureFailure> for NormalError {
    fn from(failure: conjugate_gradients::PressureFailure) -> NormalError {
        match failure {
            conjugate_gradients::PressureFailure::Stopped(stop) => NormalError::Stopped(stop),
            conjugate_gradients::PressureFailure::NotConverged(residual) => {
                NormalError::NoAnswer(format!(
                    "the pressure did not converge: the contact conditions are violated by {residual:.1e} of the overlap"
                ))
            }
        }
    }
}

pub(crate) fn no_touch(approach: f64, least: f64) -> String {
    format!(
        "the bodies do not touch: the approach of {approach} mm is not more than the least gap of {least} mm"
    )
}

pub(crate) fn edge_reached(side: GridSide, limits: Window) -> NormalError {
    NormalError::NoAnswer(format!(
        "the contact reaches the edge {} of the given gap, so that the true contact is cut off; give the gap farther out",
        side.place(limits)
    ))
}
