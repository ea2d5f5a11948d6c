//! Influence coefficients between equal rectangles on a regular grid, see
//! [`GridOperator`](crate::contact::half_space::grid_operator::GridOperator).

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
    let places = |n: usize, d: f64| -> Vec<[f64; 2]> {
        let at = |i: usize| (i as f64 + 0.5) * d;
        (0..n).map(|i| [at(i), at(i).ln()]).collect()
    };
    let (x, y) = (places(nx, dx), places(ny, dy));
    // p asinh(q/p) + q asinh(p/q)
    let corner = |[p, ln_p]: [f64; 2], [q, ln_q]: [f64; 2]| {
        let r = (p * p + q * q).sqrt();
        p * ((q + r).ln() - ln_p) + q * ((p + r).ln() - ln_q)
    };
    let line = |q: [f64; 2]| -> Vec<f64> {
        let mut before = -corner(x[0], q);
        x.iter()
            .map(|p| {
                let here = corner(*p, q);
                let between = here - before;
                before = here;
                between
            })
            .collect()
    };
    let mut out = Vec::with_capacity(nx * ny);
    let mut below: Vec<f64> = line(y[0]).into_iter().map(|value| -value).collect();
    for q in y {
        let above = line(q);
        out.extend(
            above
                .iter()
                .zip(&below)
                .map(|(above, below)| factor * (above - below)),
        );
        below = above;
    }
    out
}

/// The coefficients and their mirror images for negative i, row by row.
pub(crate) fn lines(nx: usize, coefficients: &[f64]) -> Vec<f64> {
    let both = |row: &[f64]| -> Vec<f64> {
        let images = row[1..].iter().rev().copied();
        images.chain(row.iter().copied()).collect()
    };
    coefficients.chunks_exact(nx).flat_map(both).collect()
}
