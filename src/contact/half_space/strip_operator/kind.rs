//! Parity of the unknowns, and precision of an operator.

/// The symmetry of the unknowns of a mirror-symmetric problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// T_x is the same and T_y the opposite at the mirrored cell: longitudinal creepage.
    Longitudinal,
    /// T_x is the opposite and T_y the same at the mirrored cell: lateral creepage and spin.
    Lateral,
}

/// Precision of the numbers of the matrix, in its computation and its products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Four bytes: half the memory and twice the speed; forces move by less than 1e-5 of μN.
    Single,
    /// Eight bytes.
    Double,
}

impl Precision {
    /// Bytes of one number.
    pub fn bytes(self) -> u64 {
        match self {
            Precision::Single => 4,
            Precision::Double => 8,
        }
    }
}
