//! What a case will cost, estimated from its finest mesh before it is queued.

use crate::contact::case::{Method, Output};
use crate::contact::error::Fault;
use crate::contact::normal::Region;
use crate::contact::problem::{Cost, Limits, Prescribed, Problem, Resolution};
use crate::contact::tangential::ladder::{CELLS_MAX, LEVELS_KEPT, Ladder};
use crate::contact::tangential::level::precision_of;
use crate::contact::tangential::operator_store::OperatorKind;

/// Cells that a target of 0.02 costs on average, all levels added, and how they grow as it falls.
const TARGET_CELLS: f64 = 160.0;
const TARGET_GROWTH: f64 = 0.65;
/// Cells the dense method may use.
const LIU_HSU_CELLS_MAX: f64 = 1000.0;
/// Solves that the search for a prescribed force takes beside the last, on average.
const TRIALS: f64 = 6.0;
/// Dense square matrices the method of Liu and Hsu holds at once.
const LIU_HSU_MATRICES: f64 = 4.0;
/// Doubles per cell of the finest mesh that an iteration holds: the Krylov space, iterates and buffers.
const VECTORS_PER_CELL: f64 = 64.0;
/// Bytes per cell of a level that is kept: two meshes, pressure, area and bound, and what two motions left on it.
const LEVEL_BYTES_PER_CELL: f64 = 200.0;
/// Levels that a motion climbs at most.
const LEVELS_PER_MOTION: f64 = 4.0;
/// Bytes of a motion in the answer, for each patch, and of its text.
const MOTION_BYTES: f64 = 2000.0;
/// Bytes per cell and motion of fields, in the answer and in their stored form.
const FIELDS_BYTES_PER_CELL: f64 = 160.0;

/// What decides how much a solve costs.
#[derive(Debug, Clone)]
pub(super) struct Size {
    pub(super) method: Method,
    pub(super) resolution: Resolution,
    /// Segments per strip, for each patch.
    pub(super) segments: Vec<f64>,
    pub(super) motions: usize,
    /// Values per cell are kept motion by motion.
    pub(super) fields: bool,
    /// Forces prescribed in place of creepages, motion by motion.
    pub(super) forces: Vec<Prescribed>,
    /// Region and pressure are mirror-symmetric for sure.
    pub(super) ellipse: bool,
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
    /// Estimated cost of solving this: the operator of the finest mesh and what stands beside it, the matrices of the dense method,
    /// the answer. What the process keeps for all cases, the operator store, comes on top. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        Size {
            method: self.method,
            resolution: self.resolution,
            segments: self.region.segments_per_strip(),
            motions: self.motions.len(),
            fields: self
                .outputs
                .iter()
                .any(|output| *output != Output::Resultants),
            forces: self.forces.clone(),
            ellipse: self.region.is_ellipse(),
            normal_seconds: normal_seconds(&self.region),
        }
        .cost()
    }
}

impl Size {
    fn cost(&self) -> Cost {
        let (cells, segments) = self.finest();
        let motions = self.motions as f64;
        let prescribed = self
            .forces
            .iter()
            .filter(|forces| **forces != [None; 2])
            .count();
        let solves = motions + TRIALS * prescribed as f64;
        let seconds = match self.method {
            Method::Auto | Method::BoundaryElement => {
                let usual = self.usual_cells(cells);
                1e-9 * usual * usual * (10.0 + 50.0 * solves)
            }
            Method::LiuHsu => 4e-8 * cells * cells + 3e-11 * (2.0 * cells).powi(3) * 30.0 * solves,
            Method::Fastsim => 1e-7 * cells * (1.0 + 0.2 * solves),
        };
        Cost {
            bytes: self.bytes(cells, segments) as u64,
            seconds: seconds + self.normal_seconds,
        }
    }

    /// Peak memory in bytes.
    fn bytes(&self, cells: f64, segments: f64) -> f64 {
        let motions = self.motions as f64;
        let operator = match self.method {
            Method::Fastsim => 0.0,
            Method::Auto | Method::BoundaryElement | Method::LiuHsu => {
                let kind = OperatorKind {
                    poisson_ratio: 0.0,
                    // Cells that gather about a pole are not.
                    folded: self.ellipse && matches!(self.resolution, Resolution::Mesh(_)),
                    precision: precision_of(self.resolution),
                };
                let each = (cells / segments.max(1.0)).ceil();
                kind.bytes(segments.ceil() as usize, each as usize) as f64
            }
        };
        let solve = match self.method {
            // Factored blocks of two unknowns per cell.
            Method::Auto | Method::BoundaryElement => 32.0 * cells * cells / segments.max(1.0),
            Method::LiuHsu => (2.0 * cells).powi(2) * 8.0 * LIU_HSU_MATRICES,
            Method::Fastsim => 0.0,
        };
        let levels = (LEVELS_PER_MOTION * motions).min(LEVELS_KEPT as f64);
        let patches = self.segments.len() as f64;
        let fields = if self.fields {
            motions * cells * FIELDS_BYTES_PER_CELL
        } else {
            0.0
        };
        operator
            + solve
            + cells * (8.0 * VECTORS_PER_CELL + levels * LEVEL_BYTES_PER_CELL)
            + motions * patches * MOTION_BYTES
            + fields
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
        let fixed = Ladder::fixed_sizes(self.resolution, self.method);
        let size = match (self.resolution, fixed.as_deref().and_then(<[_]>::last)) {
            (_, Some(size)) => *size,
            (Resolution::Mesh(size), None) => size,
            (Resolution::Target(_), None) => {
                // The cells are shared out among the patches; hollow ones have several segments in a strip.
                let share = f64::from(CELLS_MAX) / self.segments.len() as f64;
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
