//! The nodes of the table: a/b, ν, size, pole and direction of the creepage.

use std::f64::consts::{FRAC_PI_2, LN_10, PI};

/// Nodes in ln(a/b), uniform from 1/10 to 10.
pub const RATIOS: usize = 9;
/// Nodes in Poisson's ratio, between which values are parabolas.
pub const POISSON_RATIOS: [f64; 3] = [0.0, 0.25, 0.5];
/// Nodes in the place of the spin pole, uniform from no spin (θ = 0) to spin alone (θ = π/2).
pub const POLES: usize = 22;
/// Nodes in the direction, uniform from χ = −π/2 to π/2 (χ = 0: creepage along rolling).
pub const DIRECTIONS: usize = 17;
/// Nodes in the size, in 24ths of σ: closer where the last of the patch begins to slip.
pub const SIZES: [u8; 18] = [
    0, 2, 4, 6, 8, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 22, 24,
];
/// What the nodes of [`SIZES`] count.
pub const SIZE_STEPS: f64 = 24.0;
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
    size / (size + SIZE_HALF)
}

/// The size r of a σ below 1.
#[must_use]
pub fn size(sigma: f64) -> f64 {
    SIZE_HALF * sigma / (1.0 - sigma)
}
