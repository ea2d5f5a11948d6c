//! What a case will cost, estimated from its finest mesh before it is queued.

use crate::contact::case::limits::Limits;
use crate::contact::case::problem::Problem;
use crate::contact::case::words::Output;
use crate::contact::error::Fault;
use crate::contact::half_space::strip_operator::kind::Precision;
use crate::contact::normal::region::Region;
use crate::contact::profile_trust::before;
use crate::contact::rolling::methods::method::Method;
use crate::contact::rolling::motion::PrescribedForces;
use crate::contact::rolling::operator_store::OperatorKind;
use crate::contact::rolling::refinement::levels::LEVELS_KEPT;
use crate::contact::rolling::refinement::mesh_policy::{CELLS_MAX, MeshPolicy};
use crate::contact::rolling::refinement::resolution::Resolution;
use crate::contact::rolling::task::precision_of;

/// Cells of the finest mesh for a target of 0.02, on average, and how they grow as it falls.
const TARGET_CELLS: f64 = 160.0;
const TARGET_GROWTH: f64 = 0.65;
/// Time of one solve for a target of 0.005 in s, how steeply it grows as the target falls, and the target below which the largest
/// mesh is the end: medians of 50 Hertz contacts with random motions, which spread by a factor of 3 (`cargo bench --bench stress -- --only
/// creep-map` prints estimates beside times).
const TARGET_SECONDS: f64 = 1.6e-3;
const TARGET_USUAL: f64 = 0.005;
const TARGET_STEEP: f64 = 1.5;
const TARGET_LEAST: f64 = 2e-4;
/// How much longer products in double precision take, and part of a lone solve that one within a sweep takes.
const DOUBLE_TIMES: f64 = 2.5;
const SWEEP_SHARE: f64 = 0.4;
/// Explicit meshes with so many cells have matrices that no cache holds.
const MESH_CELLS_SLOW: f64 = 1600.0;
/// Time to gather and pack values per cell, in s.
const FIELDS_SECONDS_PER_CELL: f64 = 3e-7;
/// Cells that a patch has at least.
const PATCH_CELLS_MIN: f64 = 64.0;
/// Patches of a longer shape are not for the fast solver: its preconditioner knows each strip for itself, and where strips lie closer than
/// the cells in them are long, linear systems no longer converge. Ellipses up to 70 under 20 loads and motions did, from 100 on
/// some did not (`cargo bench --bench stress` goes to 50). Wide patches need no bound: b/a 1000 converges in a few steps.
const LENGTH_OVER_WIDTH_MAX: f64 = 60.0;
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
/// Levels that one motion is solved on at most.
const LEVELS_PER_MOTION: f64 = 4.0;
/// Bytes of a motion in the answer, for each patch, and of its text.
const MOTION_BYTES: f64 = 2000.0;
/// Bytes per cell and motion of fields, in the answer and in their stored form.
const FIELDS_BYTES_PER_CELL: f64 = 160.0;

/// What decides how much a solve costs.
#[derive(Debug, Clone)]
pub(crate) struct CostInput {
    pub(crate) method: Method,
    pub(crate) resolution: Resolution,
    /// Segments per strip, for each patch.
    pub(crate) segments: Vec<f64>,
    pub(crate) motions: usize,
    /// Values per cell are kept motion by motion.
    pub(crate) fields: bool,
    /// Forces prescribed in place of creepages, motion by motion.
    pub(crate) forces: Vec<PrescribedForces>,
    /// Length over width of an ellipse; nothing for other regions.
    pub(crate) ellipse: Option<f64>,
    /// Time to find region and pressure, in s.
    pub(crate) normal_seconds: f64,
}

/// Time to find region and pressure, in s: that of a gap, or of the few heights of a wheel with a gap or two at each, once more for every other
/// reading of its profiles.
pub(crate) fn normal_seconds(region: &Region) -> f64 {
    match region {
        Region::Ellipse(_) | Region::Grid(_) => 0.0,
        Region::Gap(contact) => 0.005 * contact.summits() as f64,
        Region::Profiles(contact) => 0.04 * f64::from(1 + before::readings_expected(contact)),
    }
}

/// Segments per strip of every patch; of a gap, whose patches are not known yet, one for every summit.
pub(crate) fn segments(region: &Region) -> Vec<f64> {
    match region {
        Region::Gap(contact) => vec![1.0; contact.summits()],
        Region::Ellipse(_) | Region::Grid(_) | Region::Profiles(_) => region.segments_per_strip(),
    }
}

/// Half-length along rolling over half-width of an ellipse.
pub(crate) fn length_over_width(region: &Region) -> Option<f64> {
    match region {
        Region::Ellipse(ellipse) => Some(ellipse.a / ellipse.b),
        Region::Gap(_) | Region::Grid(_) | Region::Profiles(_) => None,
    }
}

impl Problem {
    /// Estimated cost of solving this: the operator of the finest mesh and what stands beside it, the matrices of the dense method,
    /// the answer. What the process keeps for all cases, the operator store, comes on top. Seconds are rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        CostInput {
            method: self.method,
            resolution: self.resolution,
            segments: segments(&self.region),
            motions: self.motions.len(),
            fields: self
                .outputs
                .iter()
                .any(|output| *output != Output::Resultants),
            forces: self.forces.clone(),
            ellipse: length_over_width(&self.region),
            normal_seconds: normal_seconds(&self.region),
        }
        .cost()
    }
}

impl CostInput {
    fn cost(&self) -> Cost {
        let (cells, segments) = self.finest();
        let motions = self.motions as f64;
        let prescribed = self
            .forces
            .iter()
            .filter(|forces| **forces != [None; 2])
            .count();
        let solves = motions + TRIALS * prescribed as f64;
        let each = self.solve_seconds(cells);
        let first = self.first_seconds(cells);
        let fields = if self.fields {
            FIELDS_SECONDS_PER_CELL * motions * self.usual_cells(cells)
        } else {
            0.0
        };
        let seconds = first + each * solves + fields;
        Cost {
            bytes: self.bytes(cells, segments) as u64,
            seconds: seconds + self.normal_seconds,
        }
    }

    /// Time of a solve in s that others of the same sweep came before.
    fn solve_seconds(&self, cells: f64) -> f64 {
        match (self.method, self.resolution) {
            (Method::BoundaryElement, Resolution::Target(target)) => {
                SWEEP_SHARE * self.target_seconds(target, cells)
            }
            (Method::BoundaryElement, Resolution::Mesh(_)) => {
                // Large matrices come from slower memory.
                let cache_misses = (cells / MESH_CELLS_SLOW).min(1.0);
                1e-9 * cells * cells * (15.0 + 60.0 * cache_misses)
            }
            (Method::LiuHsu, _) => 1.5e-9 * (2.0 * cells).powi(3),
            (Method::Fastsim, _) => 1e-5 + 5e-9 * cells,
        }
    }

    /// Time in s that the first solve takes beside what every solve takes.
    fn first_seconds(&self, cells: f64) -> f64 {
        match (self.method, self.resolution) {
            (Method::BoundaryElement, Resolution::Target(target)) => {
                (1.0 - SWEEP_SHARE) * self.target_seconds(target, cells)
            }
            (Method::BoundaryElement, Resolution::Mesh(_)) => 1e-8 * cells * cells,
            (Method::LiuHsu, _) => 4e-8 * cells * cells,
            (Method::Fastsim, _) => 1e-7 * cells,
        }
    }

    /// Time of a solve alone, in s, that is refined to a target.
    fn target_seconds(&self, target: f64, cells: f64) -> f64 {
        let precision = match precision_of(self.resolution) {
            Precision::Single => 1.0,
            Precision::Double => DOUBLE_TIMES,
        };
        let smooth = (TARGET_USUAL / target.max(TARGET_LEAST)).powf(TARGET_STEEP);
        let refined = TARGET_SECONDS * smooth * precision * self.segments.iter().sum::<f64>();
        // Many patches have more cells than any target asks for, and need more steps.
        let crowded = self.segments.len() as f64 * PATCH_CELLS_MIN;
        let crowd = if crowded > f64::from(CELLS_MAX) / 4.0 {
            3e-7 * cells.max(crowded).powi(2)
        } else {
            0.0
        };
        2e-4 + refined.max(crowd)
    }

    /// Peak memory in bytes.
    fn bytes(&self, cells: f64, segments: f64) -> f64 {
        let motions = self.motions as f64;
        let operator = match self.method {
            Method::Fastsim => 0.0,
            Method::BoundaryElement | Method::LiuHsu => {
                let kind = OperatorKind {
                    poisson_ratio: 0.0,
                    // Cells that gather about a pole are not.
                    folded: self.ellipse.is_some()
                        && matches!(self.resolution, Resolution::Mesh(_)),
                    precision: precision_of(self.resolution),
                };
                let each = (cells / segments.max(1.0)).ceil();
                kind.bytes(segments.ceil() as usize, each as usize) as f64
            }
        };
        let solve = match self.method {
            // Factored blocks of two unknowns per cell.
            Method::BoundaryElement => 32.0 * cells * cells / segments.max(1.0),
            Method::LiuHsu => (2.0 * cells).powi(2) * 8.0 * LIU_HSU_MATRICES,
            Method::Fastsim => 0.0,
        };
        let levels = (LEVELS_PER_MOTION * motions).min(LEVELS_KEPT as f64);
        let patches = self.segments.len() as f64;
        let fields = if self.fields {
            // Many motions need twice the average at most.
            motions * cells.min(2.0 * self.usual_cells(cells)) * FIELDS_BYTES_PER_CELL
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
    pub(crate) fn faults(&self, limits: &Limits) -> Vec<Fault> {
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
        let fast = matches!(self.method, Method::BoundaryElement);
        if let Some(ratio) = self
            .ellipse
            .filter(|ratio| fast && *ratio > LENGTH_OVER_WIDTH_MAX)
        {
            faults.push(Fault {
                pointer: "/contact".to_owned(),
                detail: format!(
                    "a patch {ratio:.1} times as long along rolling as wide; boundary_element solves up to \
                     {LENGTH_OVER_WIDTH_MAX} times, fastsim any"
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
        let fixed = MeshPolicy::fixed_sizes(self.resolution, self.method);
        let size = match (self.resolution, fixed.as_deref().and_then(<[_]>::last)) {
            (_, Some(size)) => *size,
            (Resolution::Mesh(size), None) => size,
            (Resolution::Target(_), None) => {
                // The cells are shared out among the patches; hollow ones have several segments in a strip.
                let share =
                    (f64::from(CELLS_MAX) / self.segments.len() as f64).max(PATCH_CELLS_MIN);
                return (share * per_strip, share.sqrt() * per_strip);
            }
        };
        let segments = f64::from(size.strips) * per_strip;
        (segments * f64::from(size.cells), segments)
    }

    /// Cells that set the time: those of the mesh, or what the target costs on average.
    fn usual_cells(&self, finest: f64) -> f64 {
        match (self.resolution, self.method) {
            (Resolution::Target(target), Method::BoundaryElement) => {
                finest.min(TARGET_CELLS * (0.02 / target).powf(TARGET_GROWTH))
            }
            _ => finest,
        }
    }
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}
