//! The spin pole of the elastic problem, read off the tractions of a solution.

use crate::contact::numerics::length::length;

/// The point around which tractions turn: least squares of `n·(x − x_p) = 0` over all cells, `n = T/|T|`, each cell
/// weighted with the load `weight` it carries.
///
/// `t` has x of all cells before y. `None` if the tractions do not turn (all parallel, or none at all): the pole is then
/// nowhere near the patch.
#[must_use]
pub fn vortex_centre(t: &[f64], x: &[f64], y: &[f64], weight: &[f64]) -> Option<[f64; 2]> {
    let n = x.len();
    let (mut xx, mut xy, mut yy, mut rhs) = (0.0, 0.0, 0.0, [0.0; 2]);
    for i in 0..n {
        let size = length(t[i], t[n + i]);
        if size == 0.0 || !size.is_finite() {
            continue;
        }
        let (nx, ny) = (t[i] / size, t[n + i] / size);
        let along = weight[i] * (nx * x[i] + ny * y[i]);
        xx += weight[i] * nx * nx;
        xy += weight[i] * nx * ny;
        yy += weight[i] * ny * ny;
        rhs[0] += along * nx;
        rhs[1] += along * ny;
    }
    let determinant = xx * yy - xy * xy;
    // (xx + yy)² = 4 × determinant for tractions in all directions alike, and determinant = 0 for parallel ones.
    if determinant <= 1e-6 * (xx + yy).powi(2) {
        return None;
    }
    Some([
        (yy * rhs[0] - xy * rhs[1]) / determinant,
        (xx * rhs[1] - xy * rhs[0]) / determinant,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> (Vec<f64>, Vec<f64>) {
        let at = |k: usize| -1.0 + 0.4 * k as f64;
        (0..36).map(|k| (at(k % 6), at(k / 6))).unzip()
    }

    #[test]
    fn a_rigid_rotation_has_its_vortex_at_its_centre() {
        let (x, y) = grid();
        let weight: Vec<f64> = (0..36).map(|i| 1.0 + f64::from(i % 5)).collect();
        for [px, py] in [[0.13, -0.4], [3.0, 1.0]] {
            for sign in [-1.0, 1.0] {
                let tx = y.iter().map(|y| -sign * (y - py));
                let t: Vec<f64> = tx.chain(x.iter().map(|x| sign * (x - px))).collect();
                let [cx, cy] = vortex_centre(&t, &x, &y, &weight).unwrap();
                assert!((cx - px).abs() < 1e-10 && (cy - py).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn parallel_tractions_have_no_vortex() {
        let (x, y) = grid();
        let t: Vec<f64> = (0..72).map(|i| if i < 36 { 0.6 } else { -0.8 }).collect();
        assert_eq!(vortex_centre(&t, &x, &y, &[1.0; 36]), None);
        assert_eq!(vortex_centre(&[0.0; 72], &x, &y, &[1.0; 36]), None);
    }
}
