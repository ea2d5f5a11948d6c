//! What the estimate of an error depends on beside the answer it is of.

use crate::contact::rolling::mesh_plan::Regime;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::table_check::TableCheck;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::strip_mesh::StripMesh;

/// The coarser level that was solved before this one, if it is coarse enough to compare with.
#[derive(Debug, Clone, Copy)]
pub struct CoarserLevel<'a> {
    /// Its resultants.
    pub summed: &'a [Resultants],
    /// What it was made for.
    pub regime: Regime,
    /// 1 over (ratio of cells − 1).
    pub share: f64,
}

/// What an estimate depends on, apart from the answer on its level.
#[derive(Debug, Clone, Copy)]
pub struct EstimateContext<'a> {
    /// The motion in mm.
    pub motion: &'a Motion,
    /// The level before.
    pub before: Option<CoarserLevel<'a>>,
    /// What is left of the difference of the two rules on a coarser level, for a level that was solved with one of them.
    pub carried: Option<&'a [f64]>,
    /// A finer level, where everything slips or the pressure jumps.
    pub finer: Option<&'a StripMesh>,
    /// Slenderness of the patch over that of the population of the factors for explicit meshes; at least 1.
    pub slenderness: f64,
    /// Residual of the solve.
    pub tolerance: f64,
    /// What the table says, where it covers the patch, and the error by it.
    pub table: Option<(TableCheck, f64)>,
}
