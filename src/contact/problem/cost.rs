//! What a case will cost, estimated from its finest mesh before it is queued.

use crate::contact::case::{MeshSize, Method};
use crate::contact::error::Fault;
use crate::contact::normal::Region;
use crate::contact::problem::{Cost, Limits, Prescribed, Problem, Resolution};

/// Cells of the finest mesh that a target may lead to, and of that of the dense method.
const TARGET_CELLS_MAX: f64 = 2048.0;
const TARGET_DENSE: MeshSize = MeshSize {
    strips: 12,
    cells: 24,
};
/// The mesh of the simplified theory, whatever the target.
const FASTSIM_MESH: MeshSize = MeshSize {
    strips: 10,
    cells: 16,
};
/// Cells that a target of 0.02 costs on average, all levels added, and how they grow as it falls.
const TARGET_CELLS: f64 = 160.0;
const TARGET_GROWTH: f64 = 0.65;
/// Cells the dense method may use.
const LIU_HSU_CELLS_MAX: f64 = 1000.0;
/// Memory beside the influence coefficients, relative to them.
const BYTES_BESIDE: f64 = 1.3;
/// Solves that the search for a prescribed force takes beside the last, on average.
const TRIALS: f64 = 6.0;
/// Dense square matrices the method of Liu and Hsu holds at once.
const LIU_HSU_MATRICES: f64 = 4.0;
/// Vectors per cell a solve holds, and doubles per cell and motion in the answer.
const VECTORS_PER_CELL: f64 = 64.0;
const FIELDS_PER_CELL: f64 = 6.0;

/// What decides how much a solve costs.
#[derive(Debug, Clone)]
pub(super) struct Size {
    pub(super) method: Method,
    pub(super) resolution: Resolution,
    /// Segments per strip, for each patch.
    pub(super) segments: Vec<f64>,
    pub(super) motions: usize,
    /// Forces prescribed in place of creepages, motion by motion.
    pub(super) forces: Vec<Prescribed>,
    /// Time to find region and pressure, in s.
    pub(super) normal_seconds: f64,
}

/// Time to find region and pressure, in s: that of a gap, or of the few heights of a wheel with a gap or two at each.
pub(super) fn normal_seconds(region: &Region) -> f64 {
    match region {
        Region::Ellipse(_) | Region::Grid(_) => 0.0,
        Region::Gap(_) => 0.005,
        Region::Profiles(_) => 0.04,
    }
}

impl Problem {
    /// Estimated cost of solving this: the influence coefficients of the finest mesh and what stands beside them,
    /// the matrices of the dense method, the fields of the answer. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Size {
            method: self.method,
            resolution: self.resolution,
            segments: self.region.segments_per_strip(),
            motions: self.motions.len(),
            forces: self.forces.clone(),
            normal_seconds: normal_seconds(&self.region),
        }
        .cost()
    }
}

impl Size {
    fn cost(&self) -> Cost {
        let (cells, segments) = self.finest();
        let motions = self.motions as f64;
        let fields = cells * (VECTORS_PER_CELL + FIELDS_PER_CELL * motions) * 8.0;
        let prescribed = self
            .forces
            .iter()
            .filter(|forces| **forces != [None; 2])
            .count();
        let solves = motions + TRIALS * prescribed as f64;
        let influence = 3.0 * cells * (cells + 2.0 * segments) * 8.0 * BYTES_BESIDE;
        let (bytes, seconds) = match self.method {
            Method::Auto | Method::BoundaryElement => {
                let usual = self.usual_cells(cells);
                (influence, 1e-9 * usual * usual * (10.0 + 50.0 * solves))
            }
            Method::LiuHsu => (
                influence + (2.0 * cells).powi(2) * 8.0 * LIU_HSU_MATRICES,
                4e-8 * cells * cells + 3e-11 * (2.0 * cells).powi(3) * 30.0 * solves,
            ),
            Method::Fastsim => (0.0, 1e-7 * cells * (1.0 + 0.2 * solves)),
        };
        Cost {
            bytes: (bytes + fields) as u64,
            seconds: seconds + self.normal_seconds,
        }
    }

    /// Faults of a case that is too large for the limits or for its method.
    pub(super) fn faults(&self, limits: &Limits) -> Vec<Fault> {
        let pointer = match self.resolution {
            Resolution::Mesh(_) => "/solver/mesh",
            Resolution::Target(_) => "/contact",
        };
        let mut faults = Vec::new();
        let (cells, _) = self.finest();
        if self.method == Method::LiuHsu && cells > LIU_HSU_CELLS_MAX {
            faults.push(Fault {
                pointer: pointer.to_owned(),
                detail: format!(
                    "{cells:.0} cells over all patches; at most {LIU_HSU_CELLS_MAX} are allowed with liu_hsu, \
                     use boundary_element for more"
                ),
            });
        }
        let bytes = self.cost().bytes;
        if bytes > limits.memory_bytes {
            let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
            faults.push(Fault {
                pointer: pointer.to_owned(),
                detail: format!(
                    "{cells:.0} cells over all patches and {} motions need about {:.0} MiB; at most {:.0} MiB are \
                     allowed for one case",
                    self.motions,
                    mebibytes(bytes),
                    mebibytes(limits.memory_bytes)
                ),
            });
        }
        faults
    }

    /// Cells and segments of the finest mesh over all patches.
    fn finest(&self) -> (f64, f64) {
        let per_strip: f64 = self.segments.iter().sum();
        let size = match (self.resolution, self.method) {
            (Resolution::Mesh(size), _) => size,
            (Resolution::Target(_), Method::LiuHsu) => TARGET_DENSE,
            (Resolution::Target(_), Method::Fastsim) => FASTSIM_MESH,
            (Resolution::Target(_), _) => {
                // The cells are shared out among the patches; hollow ones have several segments in a strip.
                let share = TARGET_CELLS_MAX / self.segments.len() as f64;
                return (share * per_strip, share.sqrt() * per_strip);
            }
        };
        let segments = f64::from(size.strips) * per_strip;
        (segments * f64::from(size.cells), segments)
    }

    /// Cells that set the time: those of the mesh, or what the target costs on average.
    fn usual_cells(&self, finest: f64) -> f64 {
        match (self.resolution, self.method) {
            (Resolution::Target(target), Method::Auto | Method::BoundaryElement) => {
                finest.min(TARGET_CELLS * (0.02 / target).powf(TARGET_GROWTH))
            }
            _ => finest,
        }
    }
}
