//! How large parts of the loads look from several points at once: how many points of a quadrature each needs along and across.

use pulp::NullaryFnOnce;

use crate::contact::half_space::point_loads::{LANES, Lanes};
use crate::contact::numerics::quadrature::RULES;
use crate::contact::numerics::simd;

/// Number of rules; the code one above the last asks for a division of the part.
pub const ORDERS: usize = RULES.len();
/// Codes of one axis.
const CODES: u32 = ORDERS as u32 + 1;
/// How finely the loads are resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadResolution {
    /// Sizes over distance from which on the rule with the next number of points is used, and from the last on a part is halved. Errors of
    /// Gauss's rule fall with the distance to the power of twice its points.
    pub sizes: [f32; ORDERS],
}

impl LoadResolution {
    /// For stresses that are answered: within 0.0016 of the largest pressure of those with sizes of 0.05 to 0.67 and a quadrature cell by cell, and within
    /// 0.0001 in the median, on the 18 ellipses of `cargo bench --bench stress -- --only after`, three in full slip and four at other targets; within
    /// 0.0009 on two gaps; at 3500 random points each in depths from 0.012 to 4 half-widths. Of a constant load on a square, 0.62, 1.4 and 3 leave 0.001.
    pub const FINE: LoadResolution = LoadResolution {
        sizes: [0.5, 1.0, 2.6],
    };
    /// For scans before a search: within 0.001 in the median on the same points, and 0.08 at the worst.
    pub const COARSE: LoadResolution = LoadResolution {
        sizes: [1.2, 2.5, 5.5],
    };
}

/// What decides how a part is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartBox {
    /// `[x0, x1, y0, y1]` in mm.
    pub sides: [f32; 4],
    /// Squares of its lengths along and across in mm².
    pub squares: [f32; 2],
}

/// The codes of one part, point by point: see [`orders`].
pub type PartCodes = [u8; LANES];

/// Which rules a code stands for, along and across; [`ORDERS`] where the part has to be divided.
#[must_use]
pub fn orders(code: u8) -> [usize; 2] {
    let codes = CODES as usize;
    [usize::from(code) / codes, usize::from(code) % codes]
}

/// Appends the codes of every part as seen from the points `x, y, z` in mm.
pub fn look(
    parts: impl Iterator<Item = PartBox>,
    points: &[Lanes; 3],
    resolution: LoadResolution,
    codes: &mut Vec<PartCodes>,
) {
    let LoadResolution { sizes } = resolution;
    simd::dispatch(Look {
        parts,
        points,
        limits: sizes.map(|size| size * size),
        codes,
    });
}

struct Look<'a, I> {
    parts: I,
    points: &'a [Lanes; 3],
    /// Squares of the sizes over distance.
    limits: [f32; ORDERS],
    codes: &'a mut Vec<PartCodes>,
}

impl<I: Iterator<Item = PartBox>> NullaryFnOnce for Look<'_, I> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let [xs, ys, zs] = self.points;
        let limits = self.limits;
        for PartBox { sides, squares } in self.parts {
            let [x0, x1, y0, y1] = sides;
            let mut code = [0_u32; LANES];
            for lane in 0..LANES {
                let (x, y, z) = (xs[lane], ys[lane], zs[lane]);
                let dx = (x0 - x).max(x - x1).max(0.0);
                let dy = (y0 - y).max(y - y1).max(0.0);
                let square = dx * dx + dy * dy + z * z;
                let mut sum = 0;
                for limit in limits {
                    let limit = limit * square;
                    sum += CODES * u32::from(squares[0] > limit) + u32::from(squares[1] > limit);
                }
                code[lane] = sum;
            }
            self.codes.push(code.map(|code| code as u8));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_parts_need_more_points_than_far_ones() {
        let part = PartBox {
            sides: [-1.0, 1.0, -0.5, 0.5],
            squares: [4.0, 1.0],
        };
        let depths = std::array::from_fn(|lane| 0.1 * 1.6_f32.powi(lane as i32));
        let points = [[0.0; LANES], [0.0; LANES], depths];
        let mut codes = Vec::new();
        look(
            [part].into_iter(),
            &points,
            LoadResolution::FINE,
            &mut codes,
        );
        let seen = codes[0].map(orders);
        assert_eq!((seen[0], seen[LANES - 1]), ([ORDERS; 2], [0; 2]));
        for pair in seen.windows(2) {
            assert!(pair[0][0] >= pair[1][0] && pair[0][1] >= pair[1][1]);
        }
        // Along it is twice as long as across.
        assert!(seen.iter().all(|[along, across]| along >= across));
    }
}
