//! The nested meshes of a motion. They depend on patches, pressures and rigid slip, never on an iterate or on other motions.

use std::f64::consts::PI;

use crate::mesh::MeshSize;
use crate::method::Method;
use crate::rolling::methods::fastsim;
use crate::rolling::task::{MeshPlan, Motion, Resolution, RollingTask};

/// Cells per patch of the coarsest mesh. 16 and 23 halve the work at a target of 0.02, but cover 90 to 93 % of ellipses, because meshes of 4 × 4 cells agree
/// by chance.
pub(crate) const CELLS_FIRST: f64 = 32.0;
/// Total number of cells of the finest mesh.
pub const CELLS_MAX: u32 = 2048;
/// Least number of cells per patch of the finest mesh, for any number of patches.
pub const PATCH_CELLS_MAX_LEAST: f64 = 64.0;
/// Least number of strips, and of cells in a strip, of an adaptive mesh. The meshes below an explicit one may have half as many.
const SIDE_MIN: f64 = 4.0;
/// Least cells of the finest mesh over those of the coarsest: an estimate needs two doublings.
const LAST_OVER_FIRST: f64 = 4.0;
/// Strips, and cells in a strip, of the coarsest mesh before they are rounded. Each doubling of the cells then adds to both. With fewer, the
/// meshes of a slender patch have 4 strips one after another, and agree although their strips are too wide.
const SIDE_FIRST: f64 = 3.6;
/// Largest width of a strip of the coarsest mesh over half the length of a patch whose pressure is sampled. The pressure at the ends of a wide patch changes over
/// this length, and several meshes with wider strips miss it. On 80 random rollers with crowned ends, 0.72 to 0.80 of the estimates cover the error with wider
/// strips.
const STRIP_OF_HALF_LENGTH: f64 = 0.8;
/// Dimensionless spin `φ c G/(μ p_max)` from which meshes are refined about the pole of the rigid slip. Values from 1 to 4 change the work by 20 %.
const SPIN_GRADED: f64 = 2.0;
/// Ratio of length to width of a patch beyond which cells become longer for a motion with spin and no pole inside. With 4 and a power of 0.75 in place of 8
/// and 1.5, 1.5 % of the errors of random ellipses exceed twice their estimate instead of 0.5 %.
const SLENDER_SPINNING: f64 = 8.0;
/// Power with which the number of cells along a strip over the number of strips then grows. With 0.75 the patch of a flange takes twice as many products;
/// with 2, 5 % of the errors of wheels on the curve exceed twice their estimate.
const SLENDER_POWER: f64 = 1.5;
/// Poles are rounded to multiples of this, in semi-axes, so that neighbouring motions share meshes. 0.02 and 0.1 change the work by 1 to 6 %.
const POLE_GRID: f64 = 0.05;

/// The meshes of one motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshFamily {
    /// Number of cells along a strip over the number of strips.
    shape: f64,
    /// The point about which all meshes are refined.
    pole: Option<[f64; 2]>,
    patches: f64,
    /// Least number of strips.
    strips: f64,
    /// Largest number of cells in a strip.
    along: f64,
}

impl MeshFamily {
    /// The family of a motion about the origin of the case.
    ///
    /// Factors and exponents of the shape lie on flat optima over 62 Hertz contacts with a/b from 0.2 to 5 and 14 random ellipses with a/b > 5.
    pub fn of(task: &RollingTask, motion: &Motion) -> MeshFamily {
        let patches = task.footprint.patches();
        let heaviest = patches
            .iter()
            .max_by(|a, b| a.normal_force.total_cmp(&b.normal_force));
        let a_over_b = heaviest.map_or(1.0, |p| {
            (p.extent[1] - p.extent[0]) / (p.extent[3] - p.extent[2])
        });
        let pole = pole(task, motion);
        let shape = if pole.is_some() {
            0.85 * a_over_b.powf(0.4)
        } else if motion.spin_per_mm != 0.0 && a_over_b > 1.0 {
            1.3 * (a_over_b / SLENDER_SPINNING).max(1.0).powf(SLENDER_POWER)
        } else {
            1.3 * a_over_b.powf(0.3)
        };
        let patches = patches.len().max(1) as f64;
        let most = cells_max(patches) / LAST_OVER_FIRST / SIDE_FIRST.powi(2);
        let is_sampled = task.footprint.ellipse().is_none();
        MeshFamily {
            shape: shape.clamp(1.0 / most, most),
            pole,
            patches,
            strips: if is_sampled {
                2.0 / (STRIP_OF_HALF_LENGTH * a_over_b)
            } else {
                0.0
            },
            along: f64::INFINITY,
        }
    }

    /// The family with at most about this many cells in a strip.
    #[must_use]
    pub fn with_cells_along(self, along: f64) -> MeshFamily {
        MeshFamily { along, ..self }
    }

    /// The mesh with approximately `cells` cells per patch and an even number of strips.
    pub fn mesh(&self, cells: f64) -> MeshPlan {
        let strips = (2.0 * (0.5 * (cells / self.shape).sqrt()).round()).max(SIDE_MIN);
        let along = (cells / strips).round().max(SIDE_MIN);
        MeshPlan {
            size: MeshSize {
                strips: strips as u32,
                cells: along as u32,
            },
            pole: self.pole,
        }
    }

    /// Cells per patch of the coarsest mesh.
    pub fn cells_first(&self) -> f64 {
        let slender = self.shape.max(1.0 / self.shape);
        let first = CELLS_FIRST.max(SIDE_FIRST.powi(2) * slender);
        let first = first.max(self.shape * self.strips.powi(2));
        first.min(self.cells_max() / LAST_OVER_FIRST)
    }

    /// Cells per patch of the finest mesh.
    pub fn cells_max(&self) -> f64 {
        cells_max(self.patches).min(self.along.powi(2) / self.shape)
    }
}

fn cells_max(patches: f64) -> f64 {
    (f64::from(CELLS_MAX) / patches).max(PATCH_CELLS_MAX_LEAST)
}

/// The point of the only patch about which the tractions of a motion turn, in half axes, if there is one.
///
/// Elastic slip moves the pole of the rigid slip towards the trailing edge by about `1/(1 + ψ)` semi-axes, with the dimensionless spin ψ (290 vortex centres
/// on random ellipses).
fn pole(task: &RollingTask, motion: &Motion) -> Option<[f64; 2]> {
    let [patch] = task.footprint.patches() else {
        return None;
    };
    let traction = task.friction.largest() * patch.pressure_max;
    let modulus = task.interface.reduction * task.elasticity.shear_modulus;
    let spin = (motion.spin_per_mm * (patch.area / PI).sqrt() * modulus / traction).abs();
    if !(SPIN_GRADED..f64::INFINITY).contains(&spin) {
        return None;
    }
    let at = [
        -motion.creepage_y / motion.spin_per_mm,
        motion.creepage_x / motion.spin_per_mm,
    ];
    let [x0, x1, y0, y1] = patch.extent;
    let place = [
        (2.0 * at[0] - x0 - x1) / (x1 - x0) - 1.0 / (1.0 + spin),
        (2.0 * at[1] - y0 - y1) / (y1 - y0),
    ];
    let inside = place[0].hypot(place[1]) < 1.0;
    inside.then(|| place.map(|p| (p / POLE_GRID).round() * POLE_GRID))
}

/// Returns the meshes of a method that are the same for every motion, from coarse to fine, or `None` where the error decides.
///
/// Before an explicit mesh there are meshes with a quarter of its cells and, for the boundary element method, with half of them. With a target, Liu
/// and Hsu's method has two meshes, the simplified theory has one.
pub fn fixed_meshes(resolution: Resolution, method: Method) -> Option<Vec<MeshSize>> {
    let size = |strips, cells| MeshSize { strips, cells };
    match (resolution, method) {
        (Resolution::Mesh(finest), Method::BoundaryElement) => {
            let mut sizes = [4.0, 2.0].map(|times| coarser(finest, times)).to_vec();
            sizes.push(finest);
            sizes.dedup();
            Some(sizes)
        }
        (Resolution::Mesh(finest), Method::LiuHsu) => {
            let mut sizes = vec![coarser(finest, 4.0), finest];
            sizes.dedup();
            Some(sizes)
        }
        (Resolution::Mesh(size), Method::Fastsim) => Some(vec![size]),
        (Resolution::Target(_), Method::LiuHsu) => Some(vec![size(6, 12), size(12, 24)]),
        (Resolution::Target(_), Method::Fastsim) => Some(vec![fastsim::MESH]),
        // The table has no mesh.
        (Resolution::Target(_), Method::BoundaryElement) | (_, Method::Table) => None,
    }
}

/// A mesh with about `times` fewer cells and the same shape.
fn coarser(size: MeshSize, times: f64) -> MeshSize {
    let side = times.sqrt();
    let [strips, cells] = [size.strips, size.cells].map(f64::from);
    let even = 2.0 * (0.5 * strips / side).round();
    let least = 0.5 * SIDE_MIN;
    MeshSize {
        strips: even.max(least).min(strips) as u32,
        cells: (cells / side).round().max(least).min(cells) as u32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(shape: f64, patches: f64) -> MeshFamily {
        MeshFamily {
            shape,
            pole: None,
            patches,
            strips: 0.0,
            along: f64::INFINITY,
        }
    }

    #[test]
    fn every_family_has_three_meshes_at_least_and_none_beyond_the_largest() {
        for patches in [1.0, 2.0, 7.0, 40.0, 300.0] {
            let family = family(1.3, patches);
            let (first, most) = (family.cells_first(), family.cells_max());
            assert!(4.0 * first <= most && first >= 16.0, "{patches} patches");
            assert!(most * patches <= f64::from(CELLS_MAX).max(PATCH_CELLS_MAX_LEAST * patches));
        }
    }

    #[test]
    fn a_mesh_has_about_as_many_cells_as_asked_for_whatever_its_shape() {
        for shape in [0.3, 0.8, 1.3, 3.2] {
            for cells in [128.0, 512.0, 2048.0] {
                let size = family(shape, 1.0).mesh(cells).size;
                let found = f64::from(size.strips * size.cells);
                assert!((found / cells - 1.0).abs() < 0.15, "{shape}: {size:?}");
            }
        }
    }

    #[test]
    fn meshes_before_an_explicit_one_have_half_and_a_quarter_of_its_cells() {
        let of = |strips, cells| {
            let finest = MeshSize { strips, cells };
            fixed_meshes(Resolution::Mesh(finest), Method::BoundaryElement).expect("meshes")
        };
        let cells = |sizes: Vec<MeshSize>| -> Vec<u32> {
            sizes.iter().map(|size| size.strips * size.cells).collect()
        };
        assert_eq!(cells(of(16, 32)), [8 * 16, 12 * 23, 512]);
        assert_eq!(cells(of(2, 2)), [4]);
        assert_eq!(cells(of(1, 1)), [1]);
    }
}
