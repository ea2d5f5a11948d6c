//! The tangential answer on one level: tractions, slips and zones, how they came about, and the work done for them.

use crate::contact::monitor::Stop;
use crate::contact::numerics::length::length;
use crate::contact::remark::list::Remark;

/// The tangential answer on one level for one motion, dimensionless, one value per cell.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelAnswer {
    /// Tractions along x and across, for forces.
    pub traction: [Vec<f64>; 2],
    /// The tractions by the three-point rule, where smooth slips were asked for or bounds depend on the slip.
    pub second: Option<[Vec<f64>; 2]>,
    /// Slips along x and across.
    pub slip: [Vec<f64>; 2],
    /// Does the cell slip?
    pub slips: Vec<bool>,
    /// How the tractions came about.
    pub exit: LevelOutcome,
    /// Work done.
    pub work: Work,
    /// Work that was not needed.
    pub skips: Vec<Skip>,
    /// Remarks for the client.
    pub remarks: Vec<Remark>,
}

/// How the tractions of a level came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LevelOutcome {
    /// Nothing moves: they are 0.
    NoMotion,
    /// There is no friction: they are 0.
    NoFriction,
    /// The rigid slip is so large that they follow it, to one part in a million.
    RigidSlip,
    /// The method solved for them.
    Solved,
}

/// Counted work of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Newton iterations.
    pub iterations: u32,
    /// Products of the operator with a vector.
    pub products: u32,
    /// Entries of the operator that these products touched.
    pub entries: u64,
    /// Last residual of the friction law relative to the traction scale.
    pub residual: f64,
}

impl Work {
    /// Adds the counts of another solve; the residual is the later one's.
    pub fn add(&mut self, later: Work) {
        self.iterations += later.iterations;
        self.products += later.products;
        self.entries += later.entries;
        self.residual = later.residual;
    }

    /// Adds the counts of work that did not change the answer.
    pub fn add_lost(&mut self, lost: Work) {
        let residual = self.residual;
        self.add(lost);
        self.residual = residual;
    }

    /// The counts since an earlier state.
    #[must_use]
    pub fn since(&self, earlier: Work) -> Work {
        Work {
            iterations: self.iterations - earlier.iterations,
            products: self.products - earlier.products,
            entries: self.entries - earlier.entries,
            residual: self.residual,
        }
    }
}

/// Why there is no tangential answer.
#[derive(Debug, Clone, PartialEq)]
pub enum LevelFailure {
    /// The caller stopped the work.
    Stopped(Stop),
    /// The iteration did not converge.
    NotConverged {
        /// Work done, with the residual of the best iterate.
        work: Work,
        /// Residual needed.
        tolerance: f64,
        /// What to try instead.
        advice: String,
    },
}

impl From<Stop> for LevelFailure {
    fn from(stop: Stop) -> Self {
        LevelFailure::Stopped(stop)
    }
}

/// Brings every traction into its disc, which it may exceed by the tolerance of the solver, and returns the slips: 0 in cells that
/// stick, the component of the given slip along the traction in cells that slip.
pub(crate) fn project_on_bound(
    bound: &[f64],
    slips: &[bool],
    traction: &mut [Vec<f64>; 2],
    given: &[Vec<f64>; 2],
) -> [Vec<f64>; 2] {
    let mut slip = [vec![0.0; bound.len()], vec![0.0; bound.len()]];
    for i in 0..bound.len() {
        let length = length(traction[0][i], traction[1][i]);
        if length == 0.0 {
            // Without traction (no pressure) the slip is free.
            if slips[i] {
                slip[0][i] = given[0][i];
                slip[1][i] = given[1][i];
            }
            continue;
        }
        let (dx, dy) = (traction[0][i] / length, traction[1][i] / length);
        if slips[i] || length > bound[i] {
            traction[0][i] = bound[i] * dx;
            traction[1][i] = bound[i] * dy;
        }
        if slips[i] {
            let along = (given[0][i] * dx + given[1][i] * dy).max(0.0);
            slip[0][i] = along * dx;
            slip[1][i] = along * dy;
        }
    }
    slip
}

/// A part of the usual work that was recognised as unnecessary.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Skip {
    /// The bound of the creep table meets the target, so that resultants need no mesh.
    Mesh,
    /// The tractions of a motion without creepage and spin are 0.
    NoMotion,
    /// Without friction there are no tractions.
    NoFriction,
    /// The rigid slip is so large that elastic slip cannot turn the tractions.
    RigidSlip,
    /// Everything slips, and a fixed point found the tractions.
    FullSlip,
    /// Patch and motion are mirror-symmetric, so that half the cells are unknowns.
    HalfTheCells,
    /// The patch alone is mirror-symmetric, so that half the operator is enough.
    HalfTheOperator,
}

impl Skip {
    /// The sentence a client reads.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Skip::Mesh => "the bound of the creep table meets the target: no mesh",
            Skip::NoMotion => "no creepage and no spin: nothing to solve",
            Skip::NoFriction => "no friction: no tractions",
            Skip::RigidSlip => {
                "the rigid slip exceeds the elastic slip by a factor of a million: tractions follow the rigid slip"
            }
            Skip::FullSlip => "all cells slip: a fixed-point iteration replaced Newton's method",
            Skip::HalfTheCells => "mirror symmetry of patch and motion: half the cells",
            Skip::HalfTheOperator => {
                "mirror symmetry of the patch: half of the influence matrix was computed"
            }
        }
    }
}
