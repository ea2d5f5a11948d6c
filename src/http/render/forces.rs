//! Motion, forces and their errors under the names that they have as columns of every table.

use railhead_contact::case::words::motion::MotionWords;
use railhead_contact::solution::words::answer::{ErrorEstimate, Total};

/// The motion of a line, its forces and their errors.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Forces {
    /// The motion.
    pub motion: Option<MotionWords>,
    /// Longitudinal and lateral force in N, and moment in N·mm.
    pub resultants: [f64; 3],
    /// Their errors, if they are estimated.
    pub error: Option<ErrorEstimate>,
}

impl Forces {
    /// The columns of these, in the order of a table that has all of them; `normal_force_n` stands between motion and forces.
    pub(crate) const COLUMNS: [&'static str; 10] = [
        "creepage_x",
        "creepage_y",
        "spin_per_mm",
        "normal_force_n",
        "force_x_n",
        "force_y_n",
        "moment_z_n_mm",
        "error_force_x_n",
        "error_force_y_n",
        "error_moment_z_n_mm",
    ];

    /// The sums over all patches.
    #[must_use]
    pub(crate) fn of_total(motion: Option<MotionWords>, total: &Total) -> Forces {
        Forces {
            motion,
            resultants: [total.force_x_n, total.force_y_n, total.moment_z_n_mm],
            error: total.error_estimate,
        }
    }

    /// The value of a column; nothing where there is none.
    #[must_use]
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        let [x, y, moment] = self.resultants;
        let error = |of: fn(ErrorEstimate) -> f64| self.error.map(of);
        match name {
            "creepage_x" => Some(self.motion?.creepage_x),
            "creepage_y" => Some(self.motion?.creepage_y),
            "spin_per_mm" => Some(self.motion?.spin_per_mm),
            "force_x_n" => Some(x),
            "force_y_n" => Some(y),
            "moment_z_n_mm" => Some(moment),
            "error_force_x_n" => error(|error| error.force_x_n),
            "error_force_y_n" => error(|error| error.force_y_n),
            "error_moment_z_n_mm" => error(|error| error.moment_z_n_mm),
            _ => None,
        }
    }
}
