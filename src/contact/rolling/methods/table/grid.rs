//! The nodes of the table: a/b, ν, size, pole and direction of the creepage.

use std::f64::consts::{FRAC_PI_2, LN_10, PI};

/// Nodes in ln(a/b), uniform from 1/10 to 10.
pub const RATIOS: usize = 10;
/// Nodes in Poisson's ratio, between which values are parabolas.
pub const POISSON_RATIOS: [f64; 3] = [0.0, 0.25, 0.5];
/// Nodes in the place of the spin pole, uniform from no spin (θ = 0) to spin alone (θ = π/2).
pub const POLES: usize = 18;
/// Nodes in the direction, uniform from χ = −π/2 to π/2 (χ = 0: creepage along rolling).
pub const DIRECTIONS: usize = 21;
/// Nodes in the size, in 48ths of σ: closest where the last of the patch begins to slip, and one near full slip, which is approached
/// slowly while the spin pole is within the patch.
pub const SIZES: [u8; 22] = [
    0, 5, 10, 15, 19, 21, 22, 23, 24, 25, 26, 27, 28, 30, 32, 34, 36, 38, 40, 44, 46, 48,
];
/// What the nodes of [`SIZES`] count.
pub const SIZE_STEPS: f64 = 48.0;
/// The size of creepage at σ = 1/2.
pub const SIZE_HALF: f64 = 1.5;

/// ln(a/b) at its ends.
#[must_use]
pub fn ln_ratio_max() -> f64 {
    LN_10
}

/// a/b of a node.
#[must_use]
pub fn ratio(node: usize) -> f64 {
    (LN_10 * (2.0 * node as f64 / (RATIOS - 1) as f64 - 1.0)).exp()
}

/// θ of a node.
#[must_use]
pub fn pole(node: usize) -> f64 {
    FRAC_PI_2 * node as f64 / (POLES - 1) as f64
}

/// χ of a node.
#[must_use]
pub fn direction(node: usize) -> f64 {
    PI * node as f64 / (DIRECTIONS - 1) as f64 - FRAC_PI_2
}

/// σ = r/(r + 3/2) of a size r, 0 to 1.
#[must_use]
pub fn sigma(size: f64) -> f64 {
    // Of any size, also one that is 0 or beyond all numbers.
    1.0 / (1.0 + SIZE_HALF / size)
}

/// The size r of a σ below 1.
#[must_use]
pub fn size(sigma: f64) -> f64 {
    SIZE_HALF * sigma / (1.0 - sigma)
}

/// Cells between nodes: in a/b, pole, direction and size.
pub const CELLS: usize = (RATIOS - 1) * (POLES - 1) * (DIRECTIONS - 1) * (SIZES.len() - 1);

/// The last node at or before each of the 48ths of σ.
const SIZE_CELL: [u8; SIZE_STEPS as usize] = {
    let mut cells = [0; SIZE_STEPS as usize];
    let mut node = 0;
    let mut step = 0;
    while step < cells.len() {
        if SIZES[node + 1] as usize <= step {
            node += 1;
        }
        cells[step] = node as u8;
        step += 1;
    }
    cells
};

/// The number of the cell that holds a place, `[a/b][pole][direction][size]`; beyond the ends the last one.
#[must_use]
#[inline(always)]
pub fn cell(ln_ratio: f64, sigma: f64, theta: f64, chi: f64) -> usize {
    let bin = |part: f64, bins: usize| ((part * bins as f64).max(0.0) as usize).min(bins - 1);
    let ratio = bin(0.5 * (ln_ratio / LN_10 + 1.0), RATIOS - 1);
    let pole = bin(theta / FRAC_PI_2, POLES - 1);
    let direction = bin(chi / PI + 0.5, DIRECTIONS - 1);
    let size = usize::from(SIZE_CELL[bin(sigma, SIZE_CELL.len())]);
    ((ratio * (POLES - 1) + pole) * (DIRECTIONS - 1) + direction) * (SIZES.len() - 1) + size
}
