//! From a stress tensor to what is read off it.

use crate::contact::half_space::point_loads::Stress;
use crate::contact::post::subsurface::principal::{Principal, principal};
use crate::contact::post::subsurface::task::LoadedBody;
use crate::contact::solution::words::maintenance::{StressPoint, StressTensor};

/// Numbers that a stored point has: `x, y, depth`, then the stress in axes of the patch.
pub const STORED: usize = 9;

/// Von Mises' stress.
#[must_use]
pub fn von_mises([xx, yy, zz, xy, xz, yz]: Stress) -> f64 {
    let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
    let shear = xy * xy + xz * xz + yz * yz;
    (0.5 * normal + 3.0 * shear).sqrt()
}

/// A stress in axes with z into the body becomes one in the axes of the patch, with z up.
#[must_use]
pub fn in_patch_axes(stress: Stress, body: LoadedBody) -> Stress {
    let [xx, yy, zz, xy, xz, yz] = stress;
    match body {
        LoadedBody::Lower => [xx, yy, zz, xy, -xz, -yz],
        LoadedBody::Upper => stress,
    }
}

/// A point as it is stored.
#[must_use]
pub fn stored(at: [f64; 3], stress: Stress) -> [f64; STORED] {
    let [x, y, depth] = at;
    let [xx, yy, zz, xy, xz, yz] = stress;
    [x, y, depth, xx, yy, zz, xy, xz, yz]
}

/// The points of a stored list.
#[must_use]
pub fn points(stored: &[f64]) -> Vec<StressPoint> {
    let (all, _) = stored.as_chunks::<STORED>();
    all.iter()
        .map(|[x, y, depth, stress @ ..]| point([*x, *y, *depth], *stress))
        .collect()
}

/// Everything that is answered of a stress in the axes of the patch.
#[must_use]
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
