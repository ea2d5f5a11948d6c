//! The resolution of a case and the limits of its size.

use crate::case::words::solver::{MethodName, Solver};
use crate::error::Fault;
use crate::method::Method;
use crate::problem::memory::SizeInput;
use crate::rolling::methods::fastsim;
use crate::rolling::operator_store::BYTES_DEFAULT;
use crate::rolling::task::{Resolution, TARGET_USUAL};

/// Returns the mesh or the target of a case.
pub(crate) fn resolution(solver: &Solver) -> Resolution {
    match (solver.mesh, solver.target_error) {
        (Some(size), _) => Resolution::Mesh(size),
        // FASTSIM has one mesh for all targets.
        (None, None) if solver.method == MethodName::Fastsim => Resolution::Mesh(fastsim::MESH),
        (None, target) => Resolution::Target(target.unwrap_or(TARGET_USUAL)),
    }
}

/// Limits of one case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Maximum estimated memory of one case in bytes.
    pub memory_bytes: u64,
    /// Capacity of the operator store that the process shares, in bytes.
    pub operator_store_bytes: u64,
    /// Maximum number of motions in one case.
    pub motions_max: usize,
    /// Maximum number of samples of a grid.
    pub samples_max: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            memory_bytes: 2 << 30,
            operator_store_bytes: BYTES_DEFAULT,
            motions_max: 10_000,
            samples_max: 1_000_000,
        }
    }
}

/// Largest ratio of length to width of a patch for `boundary_element`. Its preconditioner treats each strip separately, so that linear
/// systems do not converge for longer patches: in tests all ellipses converged up to 70, and some did not from 100 on. Wide patches need no
/// limit.
const LENGTH_OVER_WIDTH_MAX: f64 = 60.0;
/// Maximum number of cells of `liu_hsu`, whose matrices of 2000 unknowns take 32 MB each. Chosen by judgement.
const LIU_HSU_CELLS_MAX: f64 = 1000.0;

impl SizeInput {
    /// Returns the faults of a case that is too large for the limits or for its method.
    pub(crate) fn faults(&self, limits: &Limits) -> Vec<Fault> {
        let pointer = match self.resolution {
            Resolution::Mesh(_) => "/solver/mesh",
            Resolution::Target(_) => "/contact",
        };
        let mut faults = Vec::new();
        let (cells, _) = self.finest();
        if self.method == Method::LiuHsu && cells > LIU_HSU_CELLS_MAX {
            let detail = format!(
                "{cells:.0} cells over all patches; at most {LIU_HSU_CELLS_MAX} are allowed with liu_hsu, use boundary_element for more"
            );
            faults.push(Fault::new(pointer, detail));
        }
        let is_long = |ratio: &f64| *ratio > LENGTH_OVER_WIDTH_MAX;
        if let Some(ratio) = self.ellipse.filter(is_long)
            && self.method == Method::BoundaryElement
        {
            let detail = format!(
                "a patch {ratio:.1} times as long along rolling as wide; boundary_element solves up to {LENGTH_OVER_WIDTH_MAX} times, fastsim any"
            );
            faults.push(Fault::new("/contact", detail));
        }
        let bytes = self.bytes() as u64;
        if bytes > limits.memory_bytes {
            let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
            let (needed, most) = (mebibytes(bytes), mebibytes(limits.memory_bytes));
            let detail = format!(
                "{cells:.0} cells over all patches and {} motions need about {needed:.0} MiB; at most {most:.0} MiB are allowed for one case",
                self.motions
            );
            faults.push(Fault::new(pointer, detail));
        }
        faults
    }
}
