//! Influence coefficients between equal rectangles on a regular grid, see
//! [`GridOperator`](crate::contact::half_space::grid_operator::GridOperator).

use pulp::NullaryFnOnce;

use crate::contact::numerics::simd;
use crate::contact::numerics::simd_ln::Float;

/// Displacement i cells along x and j cells along y away from a cell with unit pressure, stored at `j * nx + i`.
pub(crate) fn coefficients(
    nx: usize,
    ny: usize,
    dx: f64,
    dy: f64,
    contact_modulus: f64,
) -> Vec<f64> {
    let factor = 1.0 / (std::f64::consts::PI * contact_modulus);
    // Corners lie half a cell before and after the centres. Neighbouring cells share them, so each is evaluated once; the
    // two corners of the first cell differ only in sign.
    let places = |n: usize, d: f64| -> Vec<f64> { (0..n).map(|i| (i as f64 + 0.5) * d).collect() };
    let (x, y) = (places(nx, dx), places(ny, dy));
    let mut corners = vec![0.0; nx * ny];
    simd::dispatch(Corners {
        x: &x,
        y: &y,
        out: &mut corners,
    });
    let between = |line: &[f64], i: usize| {
        let before = if i == 0 { -line[0] } else { line[i - 1] };
        line[i] - before
    };
    let mut out = Vec::with_capacity(nx * ny);
    for j in 0..ny {
        let above = &corners[j * nx..(j + 1) * nx];
        let (below, sign) = if j == 0 {
            (above, -1.0)
        } else {
            (&corners[(j - 1) * nx..j * nx], 1.0)
        };
        out.extend((0..nx).map(|i| factor * (between(above, i) - sign * between(below, i))));
    }
    out
}

/// `p asinh(q/p) + q asinh(p/q)` at all pairs of two lists of positive lengths.
struct Corners<'a> {
    x: &'a [f64],
    y: &'a [f64],
    out: &'a mut [f64],
}

impl NullaryFnOnce for Corners<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (q, line) in self.y.iter().zip(self.out.chunks_exact_mut(self.x.len())) {
            for (p, corner) in self.x.iter().zip(line) {
                let r = (p * p + q * q).sqrt();
                *corner = p * Float::ln((q + r) / *p) + q * Float::ln((p + r) / *q);
            }
        }
    }
}

/// The coefficients and their mirror images for negative i, row by row.
pub(crate) fn lines(nx: usize, coefficients: &[f64]) -> Vec<f64> {
    let mut lines = Vec::with_capacity(coefficients.len() / nx * (2 * nx - 1));
    for row in coefficients.chunks_exact(nx) {
        lines.extend(row[1..].iter().rev());
        lines.extend_from_slice(row);
    }
    lines
}
