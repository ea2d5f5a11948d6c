//! Values derived from a stress tensor: von Mises stress, principal stresses and directions.

use crate::case::words::subsurface::{BodyName, PassageWords};
use crate::half_space::kernels::Stress;
use crate::solution::words::evolution::{StressPoint, StressTensor};

/// Number of values of a stored point: `x, y, depth`, then the stress in the axes of the patch.
pub const STORED: usize = 9;

/// Von Mises' stress.
pub fn von_mises([xx, yy, zz, xy, xz, yz]: Stress) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    let shear = xy * xy + xz * xz + yz * yz;
    (0.5 * normal + 3.0 * shear).sqrt()
}

/// Transforms a stress from axes with z into the body to the axes of the patch, with z up.
pub fn in_patch_axes(stress: Stress, body: BodyName) -> Stress {
    let [xx, yy, zz, xy, xz, yz] = stress;
    match body {
        BodyName::Lower => [xx, yy, zz, xy, -xz, -yz],
        BodyName::Upper => stress,
    }
}

/// The stored values of a point.
pub fn stored(at: [f64; 3], stress: Stress) -> [f64; STORED] {
    let [x, y, depth] = at;
    let [xx, yy, zz, xy, xz, yz] = stress;
    [x, y, depth, xx, yy, zz, xy, xz, yz]
}

/// The points of a stored list.
pub fn points(stored: &[f64]) -> Vec<StressPoint> {
    let (all, _) = stored.as_chunks::<STORED>();
    all.iter()
        .map(|[x, y, depth, stress @ ..]| point([*x, *y, *depth], *stress))
        .collect()
}

/// The reported values of a stress in the axes of the patch.
pub fn point(at: [f64; 3], stress: Stress) -> StressPoint {
    let [xx, yy, zz, xy, xz, yz] = stress;
    let Principal {
        stress: [first, second, third],
        direction,
    } = principal(stress);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let along = |sign: f64| [0, 1, 2].map(|k| half * (direction[0][k] + sign * direction[2][k]));
    StressPoint {
        at_mm: at,
        stress_mpa: StressTensor {
            xx,
            yy,
            zz,
            xy,
            xz,
            yz,
        },
        von_mises_mpa: von_mises(stress),
        tresca_mpa: first - third,
        principal_mpa: [first, second, third],
        hydrostatic_mpa: (xx + yy + zz) / 3.0,
        shear_max_mpa: 0.5 * (first - third),
        shear_plane_normal: along(1.0),
        shear_direction: along(-1.0),
    }
}

/// Principal stresses from the largest to the smallest, and their directions as unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// The stresses.
    pub stress: [f64; 3],
    /// `direction[k]` belongs to `stress[k]`.
    pub direction: [[f64; 3]; 3],
}

/// Principal stresses of a tensor `xx, yy, zz, xy, xz, yz`, by Jacobi rotations.
pub fn principal([xx, yy, zz, xy, xz, yz]: Stress) -> Principal {
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let size = a.iter().flatten().map(|x| x.abs()).fold(0.0, f64::max);
    // Five sweeps suffice to rounding.
    for _ in 0..12 {
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

/// Applies the rotation in the plane of p and q that makes `a[p][q]` 0.
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

/// The points of the requested stresses.
#[derive(Debug, Clone, PartialEq)]
pub enum StressPlaces {
    /// Points `[x, y, depth]` in mm.
    Points(Vec<[f64; 3]>),
    /// Depths in mm below the worst point of every patch.
    BelowWorst(Vec<f64>),
}

impl StressPlaces {
    /// Number of points.
    pub fn count(&self) -> usize {
        match self {
            StressPlaces::Points(points) => points.len(),
            StressPlaces::BelowWorst(depths) => depths.len(),
        }
    }
}

/// The requested stresses below the surface of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct SubsurfaceTask {
    /// Points of the stresses.
    pub places: StressPlaces,
    /// The body.
    pub body: BodyName,
    /// Poisson's ratio of that body.
    pub poisson_ratio: f64,
    /// Whether the worst point of every patch is requested.
    pub worst: bool,
    /// Options for the assessment of a passage of the contact, if it is requested.
    pub passage: Option<PassageWords>,
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
