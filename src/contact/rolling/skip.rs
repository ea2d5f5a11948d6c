//! Work that a motion did not need, and why.

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
