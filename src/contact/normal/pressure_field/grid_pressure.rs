//! A pressure on one grid of samples, with its patches.

use crate::contact::normal::pressure_field::jump::Jump;
use crate::contact::normal::pressure_field::patch_cells::PatchShape;
use crate::contact::normal::pressure_field::sample_grid::SampleGrid;

/// Pressure samples on one rectangular grid and the patches they form.
#[derive(Debug, Clone, PartialEq)]
pub struct GridPressure {
    /// The given grid with [`PADDING`](crate::contact::normal::pressure_field::sample_grid::PADDING) more lines on each side.
    pub(crate) grid: SampleGrid,
    /// Squared pressure relative to its largest value, continued below 0 outside the contact.
    pub(crate) q: Vec<f64>,
    /// Samples that are positive or continued by a parabola.
    pub(crate) smooth: Vec<bool>,
    /// The first and the last positive sample of every row that has one run of them; empty before edges are found.
    pub(crate) runs: Vec<Option<[usize; 2]>>,
    /// The first and the last cell of every row that belongs to a patch; empty before edges are found.
    pub(crate) spans: Vec<Option<[usize; 2]>>,
    /// The patch of every cell that has one of its samples as a corner.
    pub(crate) cells: Vec<u8>,
    /// Largest pressure in MPa.
    pub(crate) pressure_max: f64,
    pub(crate) shapes: Vec<PatchShape>,
    /// For each patch, its mirror image about y = 0; empty if the pressure has no such symmetry.
    pub(crate) images: Vec<usize>,
    /// The largest jump from one given sample to the next.
    pub(crate) jump: Option<Jump>,
    pub(crate) discontinuity: f64,
}
