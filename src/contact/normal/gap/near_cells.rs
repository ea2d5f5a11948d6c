//! Displacements of some places by unit pressures on the cells of a regular grid nearby, by the closed form.

use pulp::NullaryFnOnce;

use crate::contact::numerics::simd;
use crate::contact::numerics::simd_ln::Float;

/// Places where displacements are wanted, and a block of cells that press.
pub(crate) struct NearCells<'a> {
    /// x and y of the places in mm.
    pub(crate) places: [&'a [f64]; 2],
    /// Edges of the cells along x and y in mm, in rising order.
    pub(crate) edges: [&'a [f64]; 2],
    /// Contact modulus `E*` in MPa.
    pub(crate) contact_modulus: f64,
}

impl NearCells<'_> {
    /// Displacements in mm/MPa: for every cell, x fastest, those of all places.
    ///
    /// The coefficient [`rectangle`](crate::contact::half_space::kernels::rectangle) calls `zz`, as differences of values at the corners, which
    /// neighbouring cells share. They lose digits with the square of the distance over the side of a cell: at a distance of 1000 sides ten are left.
    pub(crate) fn coefficients(self) -> Vec<f32> {
        simd::dispatch(self)
    }
}

impl NullaryFnOnce for NearCells<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let [x, y] = self.places;
        let [along, across] = self.edges;
        let factor = 1.0 / (std::f64::consts::PI * self.contact_modulus);
        let count = x.len();
        let (mut lower, mut upper) = (
            vec![0.0; along.len() * count],
            vec![0.0; along.len() * count],
        );
        let cells = (along.len() - 1) * (across.len() - 1);
        let mut out = Vec::with_capacity(cells * count);
        for (j, v) in across.iter().enumerate() {
            std::mem::swap(&mut lower, &mut upper);
            for (column, u) in upper.chunks_exact_mut(count).zip(along) {
                for ((value, x), y) in column.iter_mut().zip(x).zip(y) {
                    *value = corner(x - u, y - v);
                }
            }
            if j == 0 {
                continue;
            }
            let between =
                |row: &[f64], i: usize, k: usize| row[i * count + k] - row[(i + 1) * count + k];
            for i in 0..along.len() - 1 {
                out.extend(
                    (0..count)
                        .map(|k| (factor * (between(&lower, i, k) - between(&upper, i, k))) as f32),
                );
            }
        }
        out
    }
}

/// `p asinh(q/|p|) + q asinh(p/|q|)`, 0 on either axis.
#[inline(always)]
fn corner(p: f64, q: f64) -> f64 {
    let (a, b) = (p.abs().max(f64::TINY), q.abs().max(f64::TINY));
    let r = (a * a + b * b).sqrt();
    let value = a * Float::ln((b + r) / a) + b * Float::ln((a + r) / b);
    if p * q < 0.0 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::half_space::kernels::{Rectangle, rectangle};

    #[test]
    fn coefficients_are_those_of_the_rectangles() {
        // Inside, on edges and corners, and far away.
        let places = [
            [0.1, 0.3, 0.7, -2.0, 300.0, 0.3],
            [0.05, 0.2, 0.4, 0.2, -90.0, 1.0],
        ];
        let edges = [[0.0, 0.3, 0.6, 0.9], [0.2, 0.4, 0.6, 0.8]];
        let found = NearCells {
            places: [&places[0], &places[1]],
            edges: [&edges[0], &edges[1]],
            contact_modulus: 2.0,
        };
        let found = found.coefficients();
        assert_eq!(found.len(), 54);
        for (k, found) in found.into_iter().enumerate() {
            let (cell, place) = (k / 6, k % 6);
            let (i, j) = (cell % 3, cell / 3);
            let pressed = Rectangle {
                x0: edges[0][i],
                x1: edges[0][i + 1],
                y0: edges[1][j],
                y1: edges[1][j + 1],
            };
            let exact = 0.5 * rectangle(places[0][place], places[1][place], pressed, 0.0).zz;
            assert!(
                (f64::from(found) / exact - 1.0).abs() < 1e-6,
                "{cell} {place}"
            );
        }
    }
}
