//! Stresses of many point loads at several points of a half-space at once, in the machine's lanes and in single precision.
//!
//! Axes: x, y in the surface, z into the body. Tension is positive. Sources: Boussinesq's and Cerruti's point loads (Johnson 1985, §3.2 and 3.6).

use std::f64::consts::FRAC_1_PI;
use std::ops::Range;

use pulp::{Arch, NullaryFnOnce};

/// Stresses `xx, yy, zz, xy, xz, yz`.
pub type Stress = [f64; 6];

/// Points that are answered side by side.
pub const LANES: usize = 16;

/// One number for each of the points.
pub type Lanes = [f32; LANES];

/// A force on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLoad {
    /// Where it acts, in mm.
    pub at: [f32; 2],
    /// Its components along x, along y and into the body, in N.
    pub force: [f32; 3],
}

/// Loads that some of the points feel.
#[derive(Debug, Clone, PartialEq)]
pub struct FeltLoads {
    /// Of the list of all loads.
    pub loads: Range<usize>,
    /// A bit for each point that feels them.
    pub lanes: u16,
}

/// The stresses in MPa at the points `x, y, z` in mm, z more than 0, for Poisson's ratio `nu`. Lanes to which no load is felt get 0.
///
/// A point's stress does not depend on the points beside it: what it does not feel adds exactly 0.
#[must_use]
pub fn stresses(
    loads: &[PointLoad],
    felt: &[FeltLoads],
    points: &[Lanes; 3],
    nu: f64,
) -> [Stress; LANES] {
    let sums = Arch::new().dispatch(Sum {
        loads,
        felt,
        points,
        rest: (1.0 - 2.0 * nu) as f32,
    });
    std::array::from_fn(|lane| sums.map(|sum| f64::from(sum[lane]) * (0.5 * FRAC_1_PI)))
}

struct Sum<'a> {
    loads: &'a [PointLoad],
    felt: &'a [FeltLoads],
    points: &'a [Lanes; 3],
    /// 1 − 2ν.
    rest: f32,
}

impl NullaryFnOnce for Sum<'_> {
    type Output = [Lanes; 6];

    #[inline(always)]
    fn call(self) -> [Lanes; 6] {
        let mut sums = StressSums::default();
        for FeltLoads { loads, lanes } in self.felt {
            let share: Lanes =
                std::array::from_fn(|lane| if lanes >> lane & 1 == 1 { 1.0 } else { 0.0 });
            for load in &self.loads[loads.clone()] {
                self.add(load, &share, &mut sums);
            }
        }
        let StressSums { terms, even } = sums;
        let [mut xx, mut yy, zz, xy, xz, yz] = terms;
        for ((xx, yy), even) in xx.iter_mut().zip(&mut yy).zip(even) {
            *xx += even;
            *yy += even;
        }
        [xx, yy, zz, xy, xz, yz]
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

impl Sum<'_> {
    /// Adds 2π times the stresses of one load.
    ///
    /// With r from the load to the point, ρ its length and F the force: −3 (F·r) r_i r_j/ρ⁵, and 1 − 2ν times what has only the components
    /// in the surface. Written for few operations that depend on each other: one division, products added where they arise.
    #[inline(always)]
    fn add(&self, load: &PointLoad, share: &Lanes, sums: &mut StressSums) {
        let [xs, ys, zs] = self.points;
        let [x_load, y_load] = load.at;
        let [along, across, down] = load.force;
        let StressSums { terms, even } = sums;
        let [xx, yy, zz, xy, xz, yz] = terms;
        for lane in 0..LANES {
            let (x, y, z) = (xs[lane] - x_load, ys[lane] - y_load, zs[lane]);
            let distance = x.mul_add(x, y.mul_add(y, z * z)).sqrt();
            let deep = distance + z;
            // Every term has this factor, so that a load that is not felt adds exactly 0.
            let inverse = share[lane] / (distance * deep);
            // 1/ρ, 1/(ρ + z), 1/(ρ (ρ + z)).
            let (near, below) = (inverse * deep, inverse * distance);
            let square = near * near;
            let cube = square * near;
            let sheared = along.mul_add(x, across * y);
            let all = -3.0 * down.mul_add(z, sheared) * (cube * square);
            // 1/(ρ (ρ + z)²), and what multiplies the squares of the coordinates.
            let turned = inverse * below;
            let rest = self.rest * turned;
            let twice = distance + deep;
            let squares = (sheared * below).mul_add(distance + twice, down * twice);
            let both = (rest * square).mul_add(squares, all);
            let flat = cube.mul_add(z, -inverse);
            even[lane] += self.rest * sheared.mul_add(cube - turned, down * flat);
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_feels_its_own_loads_alone() {
        let load = |x: f32| PointLoad {
            at: [x, 0.2],
            force: [0.1, 0.2, 1.0],
        };
        let loads = [load(0.0), load(0.7), load(-0.4)];
        let points = [
            std::array::from_fn(|lane| lane as f32),
            [0.3; LANES],
            [0.5; LANES],
        ];
        let felt = |loads: Range<usize>, lanes: u16| FeltLoads { loads, lanes };
        let all = stresses(&loads, &[felt(0..1, 0b11), felt(1..3, 0b01)], &points, 0.3);
        let first = stresses(&loads, &[felt(0..1, 0b01), felt(1..3, 0b01)], &points, 0.3);
        let second = stresses(&loads, &[felt(0..1, 0b10)], &points, 0.3);
        assert_eq!((all[0], all[1]), (first[0], second[1]));
        assert_eq!(all[2], [0.0; 6]);
    }
}
