//! The estimated memory of a case, from its finest mesh and the operators that it leaves in the operator store of the process.

use crate::error::SolveError;
use crate::mesh::MeshSize;
use crate::method::Method;
use crate::normal::footprint::{Footprint, NormalTask};
use crate::post::subsurface::states::SubsurfaceTask;
use crate::problem::checked_case::CheckedCase;
use crate::rolling::history::plan::HistoryStart;
use crate::rolling::history::solve::{pressed_bytes, pressed_cells_max};
use crate::rolling::operator_store::{OperatorKind, kept_bytes};
use crate::rolling::refinement::interpolate::LEVELS_KEPT;
use crate::rolling::refinement::mesh_family::{
    CELLS_FIRST, CELLS_MAX, PATCH_CELLS_MAX_LEAST, fixed_meshes,
};
use crate::rolling::task::{Motion, Resolution, TARGET_LEAST, TARGET_USUAL};

/// Average number of cells of the finest mesh for the target [`TARGET_USUAL`].
const TARGET_CELLS: f64 = 315.0;
/// Negative exponent of the target in the number of cells.
const TARGET_GROWTH: f64 = 0.65;
/// Bytes per cell of an iteration: the Krylov space, iterates and buffers. A kept mesh with pressure, area, bound and the values of two motions needs less.
const WORK_BYTES_PER_CELL: f64 = 512.0;
/// Bytes of a motion in the answer for each patch, with its text.
const MOTION_BYTES: f64 = 2000.0;
/// Bytes of a stress, or of the fields of a cell for one motion, in the answer and in their stored form.
const STORED_BYTES: f64 = 160.0;

/// The quantities that determine the memory of a solve.
#[derive(Debug, Clone)]
pub(crate) struct SizeInput {
    pub(crate) method: Method,
    pub(crate) resolution: Resolution,
    /// Segments per strip, for each patch.
    pub(crate) segments: Vec<f64>,
    pub(crate) motions: usize,
    /// Number of motions that may each need a separate mesh: about a pole for motions with spin, on a separate region for unlike bodies.
    pub(crate) spinning: usize,
    /// Whether values per cell are kept for each motion.
    pub(crate) fields: bool,
    /// Number of points of stresses below the surface for each motion.
    pub(crate) stress_points: usize,
    /// Ratio of length to width of an ellipse; `None` for other regions.
    pub(crate) ellipse: Option<f64>,
    /// How the history begins, if the motions are one.
    pub(crate) history: Option<HistoryStart>,
    /// Capacity of the operator store in bytes.
    pub(crate) store: u64,
}

/// Returns the segments per strip of each patch. A gap, whose patches are not known yet, counts one patch per asperity.
pub(crate) fn segments(task: &NormalTask) -> Vec<f64> {
    match task {
        NormalTask::Gap(contact) => vec![1.0; contact.asperities()],
        NormalTask::Given(field) => field.segments_per_strip(),
        NormalTask::Hertz(_) | NormalTask::Wheel(_) => vec![1.0],
        // Both wheels of one position. The positions are solved one after the other.
        NormalTask::Wheelset(_) => vec![1.0; 2],
    }
}

/// Returns the average number of cells of the finest mesh for a target.
pub(crate) fn usual_cells(target: f64) -> f64 {
    TARGET_CELLS * (TARGET_USUAL / target.max(TARGET_LEAST)).powf(TARGET_GROWTH)
}

/// Returns the number of motions with spin.
pub(crate) fn spinning(motions: &[Motion]) -> usize {
    let spin = |motion: &&Motion| motion.spin_per_mm != 0.0;
    motions.iter().filter(spin).count()
}

/// Returns the ratio of the semi-axes of an ellipse, the longitudinal one divided by the lateral one.
pub(crate) fn length_over_width(task: &NormalTask) -> Option<f64> {
    match task {
        NormalTask::Hertz(ellipse) => Some(ellipse.a / ellipse.b),
        NormalTask::Gap(_)
        | NormalTask::Given(_)
        | NormalTask::Wheel(_)
        | NormalTask::Wheelset(_) => None,
    }
}

impl SizeInput {
    /// Returns the number of cells of the finest mesh over all patches.
    pub(crate) fn cells(&self) -> f64 {
        self.finest().0
    }

    /// Returns the peak memory in bytes.
    pub(crate) fn bytes(&self) -> f64 {
        let (cells, segments) = self.finest();
        let motions = self.motions as f64;
        let (all, store) = (self.operators(), self.store as f64);
        let operator = self.operator(cells, segments);
        let operators = match all > store {
            // The next operator is computed before others leave the store.
            true => store + operator,
            false => all.max(operator),
        };
        let solve = match self.method {
            // Diagonal blocks of the strips, and factored blocks of two unknowns per cell (see `StripFactors`).
            Method::BoundaryElement => 48.0 * cells * cells / segments.max(1.0),
            // Four dense square matrices at once.
            Method::LiuHsu => 4.0 * (2.0 * cells).powi(2) * 8.0,
            Method::Fastsim | Method::Table => 0.0,
        };
        let levels = (self.meshes().len() * self.motions).min(LEVELS_KEPT) as f64;
        let patches = self.segments.len() as f64;
        let fields = match self.fields {
            // On average, motions have at most twice the usual number of cells.
            true => motions * cells.min(2.0 * self.usual_cells(cells)) * STORED_BYTES,
            false => 0.0,
        };
        operators
            + solve
            + cells * WORK_BYTES_PER_CELL * (1.0 + levels)
            + self.kept_of_history(cells)
            + motions * patches * (MOTION_BYTES + STORED_BYTES * self.stress_points as f64)
            + fields
    }

    /// Returns the memory of the operator of a mesh in bytes.
    fn operator(&self, cells: f64, segments: f64) -> f64 {
        if matches!(self.method, Method::Fastsim | Method::Table) {
            return 0.0;
        }
        let kind = OperatorKind {
            poisson_ratio: 0.0,
            // Cells that are clustered about a pole are not symmetric.
            folded: self.ellipse.is_some()
                && (self.spinning == 0 || matches!(self.resolution, Resolution::Mesh(_))),
            precision: self.resolution.precision(),
        };
        kind.bytes(segments.ceil() as usize, cells.ceil() as usize) as f64
    }

    /// Returns the memory in bytes of all operators that an unlimited store would keep: those of the fixed meshes of the method, or of the meshes
    /// for a target, of which each motion with spin has its own.
    fn operators(&self) -> f64 {
        let separate = match self.fixed() {
            Some(_) => 1,
            None => self.spinning.max(1),
        };
        let meshes = self.meshes().into_iter();
        let kept = meshes.map(|(cells, segments)| {
            kept_bytes(self.operator(cells, segments) as u64, self.store) as f64
        });
        separate as f64 * kept.sum::<f64>()
    }

    /// Returns the numbers of cells and segments of the meshes of one motion. With a target, each has half the cells of the next finer one.
    fn meshes(&self) -> Vec<(f64, f64)> {
        if let Some(sizes) = self.fixed() {
            return sizes.iter().map(|size| self.of_size(size)).collect();
        }
        let (finest, segments) = self.finest();
        std::iter::successors(Some(self.usual_cells(finest)), |cells| Some(0.5 * cells))
            .take_while(|cells| *cells >= CELLS_FIRST)
            .map(|cells| (cells, segments * (cells / finest).sqrt()))
            .collect()
    }

    fn fixed(&self) -> Option<Vec<MeshSize>> {
        fixed_meshes(self.resolution, self.method)
    }

    /// Returns the numbers of cells and segments of a mesh over all patches.
    fn of_size(&self, size: &MeshSize) -> (f64, f64) {
        let segments = f64::from(size.strips) * self.segments.iter().sum::<f64>();
        (segments * f64::from(size.cells), segments)
    }

    /// Returns the memory in bytes that the case takes in the operator store.
    pub(crate) fn stored(&self) -> f64 {
        self.operators().min(self.store as f64)
    }

    /// Returns the memory in bytes of a history on two levels, with that of pressing the bodies together.
    fn kept_of_history(&self, cells: f64) -> f64 {
        let pressing = match (self.history, self.resolution) {
            (None, _) => return 0.0,
            (Some(HistoryStart::Pressed), Resolution::Mesh(_)) => pressed_bytes(cells),
            (Some(HistoryStart::Pressed), _) => pressed_bytes(cells.min(pressed_cells_max())),
            (Some(_), _) => 0.0,
        };
        // Tractions, slips and slip flags.
        let per_cell = size_of::<[f64; 4]>() + size_of::<bool>();
        pressing + 2.0 * self.motions as f64 * cells * per_cell as f64
    }

    /// Returns the numbers of cells and segments of the finest mesh over all patches.
    pub(crate) fn finest(&self) -> (f64, f64) {
        if self.method == Method::Table {
            return (0.0, 0.0);
        }
        if let Some(size) = self.fixed().as_deref().and_then(<[_]>::last) {
            return self.of_size(size);
        }
        // The patches share the cells. Strips of hollow patches have several segments.
        let per_strip: f64 = self.segments.iter().sum();
        let share = (f64::from(CELLS_MAX) / self.segments.len() as f64).max(PATCH_CELLS_MAX_LEAST);
        (share * per_strip, share.sqrt() * per_strip)
    }

    /// Returns the usual number of cells: that of an explicit mesh, or the average for the target.
    fn usual_cells(&self, finest: f64) -> f64 {
        match (self.resolution, self.method) {
            (Resolution::Target(target), Method::BoundaryElement) => {
                finest.min(usual_cells(target))
            }
            _ => finest,
        }
    }
}

impl CheckedCase {
    /// Returns the quantities that determine the memory.
    pub(crate) fn size_input(&self) -> SizeInput {
        let places = |task: &SubsurfaceTask| task.places.count();
        let history = self.problem.history.as_ref();
        SizeInput {
            method: self.run.method,
            resolution: self.run.least_resolution(),
            segments: segments(&self.problem.task),
            motions: self.problem.motions.len() * self.problem.task.positions(),
            spinning: if self.problem.is_coupled(&self.run) {
                // Each motion has a separate region and therefore separate meshes.
                self.problem.motions.len()
            } else {
                spinning(&self.problem.motions) * self.problem.task.positions()
            },
            history: history.map(|history| history.start),
            fields: self.run.outputs.iter().any(|output| output.is_per_cell()),
            stress_points: self.run.after.subsurface.as_ref().map_or(0, places),
            ellipse: length_over_width(&self.problem.task),
            store: self.run.operator_store_bytes,
        }
    }

    /// Checks that a solve stays within its memory limit, once the patches are known.
    ///
    /// # Errors
    /// The solve needs more memory.
    pub(crate) fn fits(&self, footprint: &Footprint) -> Result<(), SolveError> {
        let segments = footprint.segments_per_strip();
        let (patches, sum) = (footprint.patches().len(), segments.iter().sum::<f64>());
        let bytes = SizeInput {
            segments,
            ellipse: None,
            ..self.size_input()
        }
        .bytes() as u64;
        if bytes > self.run.memory_bytes {
            return Err(SolveError::normal_problem(format!(
                "the contact splits into {patches} patches with {sum:.1} segments per strip, which need about {} MiB; at \
                     most {} MiB are allowed for one case",
                bytes >> 20,
                self.run.memory_bytes >> 20
            )));
        }
        Ok(())
    }
}
