//! The patches of a grid: groups of connected positive samples.

use crate::contact::normal::pressure_field::sample_grid::{PATCHES_MAX, SampleGrid};
use crate::contact::numerics::flood_fill::groups;

/// Label of samples and cells that belong to no patch.
pub(crate) const NOWHERE: u8 = u8::MAX;

/// The patch of every sample, numbered from 0 in order of smallest y (then x), and the number of patches.
///
/// Samples that are neighbours along an axis or a diagonal are connected: otherwise a slender patch oblique to the grid would
/// be split, although the interpolated region between two diagonal samples belongs to both.
///
/// # Errors
/// The number of patches, if there are more than [`PATCHES_MAX`].
pub(crate) fn label_samples(grid: &SampleGrid, q: &[f64]) -> Result<(Vec<u8>, usize), usize> {
    let size = [grid.x.len(), grid.y.len()];
    // Samples are stored in order of y, so patches are found in the order required.
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

/// The patch of every cell between four samples, stored at the index of its corner of smallest x and y. It is the patch of its
/// corners; no two of them belong to different patches.
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
