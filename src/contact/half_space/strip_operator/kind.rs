//! Which half of the unknowns an operator serves, and how wide its numbers are.

/// Which part of a mirror-symmetric problem the unknowns belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// T_x is the same and T_y the opposite at the mirrored cell: longitudinal creepage.
    Longitudinal,
    /// T_x is the opposite and T_y the same at the mirrored cell: lateral creepage and spin.
    Lateral,
}

/// Width of the numbers of the matrix, in its computation and its products.
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
