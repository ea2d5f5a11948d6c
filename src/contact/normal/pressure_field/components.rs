//! The patches of a grid: groups of connected positive samples.

use crate::contact::normal::pressure_field::sample_grid::{PATCHES_MAX, SampleGrid};
use crate::contact::numerics::flood_fill::groups;

/// Label of samples and cells that belong to no patch.
pub(crate) const NOWHERE: u8 = u8::MAX;

/// Label of every sample, from 0 in order of the smallest y (then x), and the number of patches.
///
/// Samples hang together over edges and corners: a slender patch that lies askew in the grid would fall apart
/// otherwise, and the interpolated region between two diagonal samples belongs to both.
///
/// # Errors
/// The number of patches, if there are more than [`PATCHES_MAX`].
pub(crate) fn label_samples(grid: &SampleGrid, q: &[f64]) -> Result<(Vec<u8>, usize), usize> {
    let size = [grid.x.len(), grid.y.len()];
    // The order of storage is that of y, so patches are met in the order wanted.
    let patches = groups(size, |sample| q[sample] > 0.0);
    if patches.len() > PATCHES_MAX {
        return Err(patches.len());
    }
    let mut labels = vec![NOWHERE; q.len()];
    for (label, patch) in patches.iter().enumerate() {
        for sample in patch {
            labels[*sample] = label as u8;
        }
    }
    Ok((labels, patches.len()))
}

/// Label of every cell between four samples, stored like the samples at its corner of smallest x and y: that of its
/// corners, of which no two belong to different patches.
pub(crate) fn label_cells(grid: &SampleGrid, samples: &[u8]) -> Vec<u8> {
    let (nx, ny) = (grid.x.len(), grid.y.len());
    let mut labels = vec![NOWHERE; nx * ny];
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let k = j * nx + i;
            let corners = [k, k + 1, k + nx, k + nx + 1];
            labels[k] = corners
                .map(|k| samples[k])
                .into_iter()
                .min()
                .unwrap_or(NOWHERE);
        }
    }
    labels
}
