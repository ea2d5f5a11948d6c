//! The friction law linearised at an iterate, cell by cell.

/// The state of one Newton step: which cells slip, and in which direction.
#[derive(Debug, Default)]
pub struct Linearisation {
    /// `(1, 0)` where a cell sticks, the unit tangent where it slips.
    pub(crate) direction: Vec<(f64, f64)>,
    /// D where a cell slips, −1 where it sticks.
    pub(crate) stiffness: Vec<f64>,
}

impl Linearisation {
    /// Does the cell slip?
    #[must_use]
    pub fn slips(&self, cell: usize) -> bool {
        self.stiffness[cell] >= 0.0
    }

    /// Direction of the cell's first unknown.
    #[must_use]
    pub fn direction(&self, cell: usize) -> (f64, f64) {
        self.direction[cell]
    }

    /// D of a slipping cell, 0 of a sticking one.
    #[must_use]
    pub fn stiffness(&self, cell: usize) -> f64 {
        self.stiffness[cell].max(0.0)
    }
}
