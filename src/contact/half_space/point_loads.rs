//! Stresses of many point loads at several points of a half-space at once, in the machine's lanes and in single precision.
//!
//! Axes: x, y in the surface, z into the body. Tension is positive. Sources: Boussinesq's and Cerruti's point loads (Johnson 1985, §3.2 and 3.6).

use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

use pulp::NullaryFnOnce;

use crate::contact::numerics::simd;

/// Stresses `xx, yy, zz, xy, xz, yz`.
pub type Stress = [f64; 6];

/// Points that are answered side by side.
pub const LANES: usize = 16;

/// One number for each of the points.
pub type Lanes = [f32; LANES];

/// Forces on the surface, [`LANES`] side by side. Those that are not needed are 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadPack {
    /// Where they act: x and y in mm.
    pub at: [Lanes; 2],
    /// Their components along x, along y and into the body, in N.
    pub force: [Lanes; 3],
}

/// The stresses in MPa at the points `[x, y, z]` in mm, z more than 0, for Poisson's ratio `nu`; each point feels its own packs of the list
/// of all.
#[must_use]
pub fn stresses(
    packs: &[LoadPack],
    felt: &[Vec<Range<usize>>; LANES],
    points: &[Lanes; 3],
    nu: f64,
) -> [Stress; LANES] {
    simd::dispatch(FeltStresses {
        packs,
        felt,
        points,
        rest: (1.0 - 2.0 * nu) as f32,
    })
}

struct FeltStresses<'a> {
    packs: &'a [LoadPack],
    felt: &'a [Vec<Range<usize>>; LANES],
    points: &'a [Lanes; 3],
    /// 1 − 2ν.
    rest: f32,
}

impl NullaryFnOnce for FeltStresses<'_> {
    type Output = [Stress; LANES];

    #[inline(always)]
    fn call(self) -> [Stress; LANES] {
        let mut stresses = [[0.0; 6]; LANES];
        let points = (0..LANES).map(|k| self.points.map(|axis| axis[k]));
        for ((stress, felt), point) in stresses.iter_mut().zip(self.felt).zip(points) {
            let mut sums = StressSums::default();
            for packs in felt {
                for pack in &self.packs[packs.clone()] {
                    add(pack, point, self.rest, &mut sums);
                }
            }
            *stress = sums.total();
        }
        stresses
    }
}

/// 2π times the sums of the stresses.
#[derive(Default)]
struct StressSums {
    /// Without `even`.
    terms: [Lanes; 6],
    /// What xx and yy have in common.
    even: Lanes,
}

impl StressSums {
    /// The sum over the lanes.
    #[inline(always)]
    fn total(&self) -> Stress {
        let sum = |lanes: &Lanes| {
            let mut halves = *lanes;
            for width in [8, 4, 2, 1] {
                for lane in 0..width {
                    halves[lane] += halves[lane + width];
                }
            }
            f64::from(halves[0]) * (0.5 * FRAC_1_PI)
        };
        let even = sum(&self.even);
        let [xx, yy, zz, xy, xz, yz] = &self.terms;
        [
            sum(xx) + even,
            sum(yy) + even,
            sum(zz),
            sum(xy),
            sum(xz),
            sum(yz),
        ]
    }
}

/// Adds 2π times the stresses of a pack.
///
/// With r from the load to the point, ρ its length and F the force: −3 (F·r) r_i r_j/ρ⁵, and 1 − 2ν times what has only the components
/// in the surface. Written for few operations that depend on each other: one division, products added where they arise.
#[inline(always)]
fn add(pack: &LoadPack, [x_point, y_point, z]: [f32; 3], share: f32, sums: &mut StressSums) {
    let [xs, ys] = &pack.at;
    let [alongs, acrosses, downs] = &pack.force;
    let StressSums { terms, even } = sums;
    let [xx, yy, zz, xy, xz, yz] = terms;
    for lane in 0..LANES {
        let (x, y) = (x_point - xs[lane], y_point - ys[lane]);
        let (along, across, down) = (alongs[lane], acrosses[lane], downs[lane]);
        let distance = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
        let deep = distance + z;
        let inverse = 1.0 / (distance * deep);
        // 1/ρ, 1/(ρ + z), 1/(ρ (ρ + z)).
        let (near, below) = (inverse * deep, inverse * distance);
        let square = near * near;
        let cube = square * near;
        let sheared = along.mul_add(x, across * y);
        let all = -3.0 * down.mul_add(z, sheared) * (cube * square);
        // 1/(ρ (ρ + z)²), and what multiplies the squares of the coordinates.
        let turned = inverse * below;
        let rest = share * turned;
        let twice = distance + deep;
        let squares = (sheared * below).mul_add(distance + twice, down * twice);
        let both = (rest * square).mul_add(squares, all);
        let flat = cube.mul_add(z, -inverse);
        even[lane] += share * sheared.mul_add(cube - turned, down * flat);
        let (along, across) = (rest * along, rest * across);
        xx[lane] = x.mul_add(both.mul_add(x, -2.0 * along), xx[lane]);
        yy[lane] = y.mul_add(both.mul_add(y, -2.0 * across), yy[lane]);
        xy[lane] = x.mul_add(both.mul_add(y, -across), y.mul_add(-along, xy[lane]));
        let all = all * z;
        zz[lane] = all.mul_add(z, zz[lane]);
        xz[lane] = all.mul_add(x, xz[lane]);
        yz[lane] = all.mul_add(y, yz[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_feels_its_own_loads_alone() {
        let pack = |x: f32| LoadPack {
            at: [[x; LANES], [0.2; LANES]],
            force: [[0.1; LANES], [0.2; LANES], [1.0; LANES]],
        };
        let packs = [pack(0.0), pack(0.7), pack(-0.4)];
        let points = [
            std::array::from_fn(|lane| lane as f32),
            [0.3; LANES],
            [0.5; LANES],
        ];
        // Ends of what a point feels.
        let felt = |first: &[usize], second: &[usize]| {
            let mut felt = [const { Vec::new() }; LANES];
            for (felt, ends) in felt.iter_mut().zip([first, second]) {
                felt.extend(ends.windows(2).map(|ends| ends[0]..ends[1]));
            }
            felt
        };
        let all = stresses(&packs, &felt(&[0, 1, 3], &[0, 1]), &points, 0.3);
        let first = stresses(&packs, &felt(&[0, 3], &[]), &points, 0.3);
        let second = stresses(&packs, &felt(&[], &[0, 1]), &points, 0.3);
        assert_eq!((all[0], all[1]), (first[0], second[1]));
        assert_eq!(all[2], [0.0; 6]);
    }
}
