//! Principal stresses and their directions.

use crate::contact::half_space::point_loads::Stress;

/// Sweeps of rotations; a symmetric 3 × 3 matrix is diagonal to rounding after five.
const SWEEPS_MAX: usize = 12;

/// Principal stresses from the largest to the smallest, and their directions as unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// The stresses.
    pub stress: [f64; 3],
    /// `direction[k]` belongs to `stress[k]`.
    pub direction: [[f64; 3]; 3],
}

/// Of a tensor `xx, yy, zz, xy, xz, yz`, by Jacobi's rotations.
#[must_use]
pub fn principal([xx, yy, zz, xy, xz, yz]: Stress) -> Principal {
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let size = a.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    for _ in 0..SWEEPS_MAX {
        let off = a[0][1].abs().max(a[0][2].abs()).max(a[1][2].abs());
        if off <= f64::EPSILON * 1e-3 * size {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| a[*j][*j].total_cmp(&a[*i][*i]));
    Principal {
        stress: order.map(|k| a[k][k]),
        direction: order.map(|k| [v[0][k], v[1][k], v[2][k]]),
    }
}

/// The rotation in the plane of p and q that makes `a[p][q]` 0.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = 1.0 / t.hypot(1.0);
    let s = t * c;
    for row in a.iter_mut() {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
    let (first, second) = (a[p], a[q]);
    a[p] = [0, 1, 2].map(|k| c * first[k] - s * second[k]);
    a[q] = [0, 1, 2].map(|k| s * first[k] + c * second[k]);
    for row in v.iter_mut() {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_stresses_give_the_tensor_back() {
        for tensor in [
            [1.0, -2.0, 0.5, 0.3, -0.7, 1.1],
            [-3.0, -3.0, -3.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 2.0, 0.0],
            [5.0, 5.0, 1.0, 1e-9, 0.0, 3.0],
        ] {
            let found = principal(tensor);
            assert!(found.stress[0] >= found.stress[1] && found.stress[1] >= found.stress[2]);
            for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
                .into_iter()
                .enumerate()
            {
                let parts =
                    (0..3).map(|n| found.stress[n] * found.direction[n][i] * found.direction[n][j]);
                assert!(
                    (parts.sum::<f64>() - tensor[k]).abs() < 1e-14 * 10.0,
                    "{tensor:?}"
                );
            }
        }
    }
}
