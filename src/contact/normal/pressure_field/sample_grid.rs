//! The grid of the samples, padded so that pressures can be continued beyond the contact.

/// Most patches of one grid.
pub(crate) const PATCHES_MAX: usize = 64;

/// Grid lines added on each side: the contact may extend half a spacing beyond the grid, and interpolation needs nodes beyond that.
pub(crate) const PADDING: usize = 4;

/// Coordinates of a rectangular grid in mm; the value at `(x[i], y[j])` is stored at `j * x.len() + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SampleGrid {
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
}

/// An axis with [`PADDING`] more points on each side, spaced like the outermost ones.
pub(crate) fn padded(axis: &[f64]) -> Vec<f64> {
    let n = axis.len();
    let (first, last) = (axis[1] - axis[0], axis[n - 1] - axis[n - 2]);
    let before = (1..=PADDING).rev().map(|k| axis[0] - first * k as f64);
    let after = (1..=PADDING).map(|k| axis[n - 1] + last * k as f64);
    before.chain(axis.iter().copied()).chain(after).collect()
}
