//! What rows are answered with: columns of numbers, and a word for each row.

/// What became of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowStatus {
    /// The resultants meet the target, or there is none.
    Ok,
    /// The resultants are there; the bound of their error is above the target.
    TargetMissed,
    /// No resultants: the bound of the table is above the target, and `auto` would solve the row.
    NeedsSolver,
    /// No resultants: the table does not cover the ellipse, whose ratio of semi-axes is beyond 0.1 to 10.
    NotCovered,
}

impl RowStatus {
    /// The word that clients read.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            RowStatus::Ok => "ok",
            RowStatus::TargetMissed => "target_missed",
            RowStatus::NeedsSolver => "needs_solver",
            RowStatus::NotCovered => "not_covered",
        }
    }
}

/// Names of the columns of derivatives, in the order of [`RowsAnswer::gradients`].
pub const GRADIENT_NAMES: [&str; 9] = [
    "force_x_n_by_creepage_x",
    "force_x_n_by_creepage_y",
    "force_x_n_by_spin_per_mm",
    "force_y_n_by_creepage_x",
    "force_y_n_by_creepage_y",
    "force_y_n_by_spin_per_mm",
    "moment_z_n_mm_by_creepage_x",
    "moment_z_n_mm_by_creepage_y",
    "moment_z_n_mm_by_spin_per_mm",
];

/// The answers to rows, one number of each column for a row; not a number where a row has none.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RowsAnswer {
    /// Longitudinal force on the lower body in N.
    pub force_x_n: Vec<f64>,
    /// Lateral force in N.
    pub force_y_n: Vec<f64>,
    /// Moment about the centre of the ellipse in N·mm.
    pub moment_z_n_mm: Vec<f64>,
    /// Bound of the error of either force in N; that of the moment is this times √(ab).
    pub error_estimate: Vec<f64>,
    /// ν_x F_x + ν_y F_y + φ M_z in N.
    pub friction_power_n: Vec<f64>,
    /// Share of the patch that sticks.
    pub stick_share: Vec<f64>,
    /// Derivatives, if they were asked for, named by [`GRADIENT_NAMES`].
    pub gradients: Option<[Vec<f64>; 9]>,
    /// What became of the rows.
    pub status: Vec<RowStatus>,
}

impl RowsAnswer {
    /// Bytes that it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let numbers: usize = self.columns().iter().map(|(_, column)| column.len()).sum();
        size_of::<f64>() * numbers + self.status.len()
    }

    /// The columns of numbers with their names, in their order.
    #[must_use]
    pub fn columns(&self) -> Vec<(&'static str, &[f64])> {
        let mut columns: Vec<(&'static str, &[f64])> = vec![
            ("force_x_n", &self.force_x_n),
            ("force_y_n", &self.force_y_n),
            ("moment_z_n_mm", &self.moment_z_n_mm),
            ("error_estimate", &self.error_estimate),
            ("friction_power_n", &self.friction_power_n),
            ("stick_share", &self.stick_share),
        ];
        if let Some(gradients) = &self.gradients {
            let named = GRADIENT_NAMES.iter().zip(gradients);
            columns.extend(named.map(|(name, column)| (*name, &column[..])));
        }
        columns
    }
}
