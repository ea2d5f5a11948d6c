//! How does it drag? Tractions and slips for given pressure and motion.

use crate::contact::monitor::Stop;
use crate::contact::remark::list::Remark;

/// The tangential answer on one level for one motion, dimensionless, one value per cell.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelAnswer {
    /// Tractions along x and across, for forces.
    pub traction: [Vec<f64>; 2],
    /// A second opinion on the tractions from another discretisation rule, where there is one.
    pub second: Option<[Vec<f64>; 2]>,
    /// Slips along x and across.
    pub slip: [Vec<f64>; 2],
    /// Does the cell slip?
    pub slips: Vec<bool>,
    /// What it took.
    pub work: Work,
    /// Work that was recognised as unnecessary.
    pub skipped: Vec<String>,
    /// Remarks for the client.
    pub remarks: Vec<Remark>,
}

/// Counted work of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Newton iterations.
    pub iterations: u32,
    /// Products of the influence with a vector.
    pub products: u32,
    /// Entries of the influence that these products touched.
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
}

/// Why there is no tangential answer.
#[derive(Debug, Clone, PartialEq)]
pub enum LevelFailure {
    /// The caller stopped the work.
    Stopped(Stop),
    /// The iteration did not converge; the residual of its best iterate, what was needed, and advice as a clause.
    NotConverged {
        /// Work done.
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

/// Brings every traction into its disc (it may be outside by the solver's tolerance) and returns the slips: none in
/// cells that stick, the part of the given slip along the traction in cells that slip.
pub(crate) fn project_on_bound(
    bound: &[f64],
    slips: &[bool],
    traction: &mut [Vec<f64>; 2],
    given: &[Vec<f64>; 2],
) -> [Vec<f64>; 2] {
    let mut slip = [vec![0.0; bound.len()], vec![0.0; bound.len()]];
    for i in 0..bound.len() {
        let length = traction[0][i].hypot(traction[1][i]);
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
