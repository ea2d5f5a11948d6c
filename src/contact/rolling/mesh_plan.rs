//! What a mesh is made from: its size, and the regime of the tractions that it is to resolve.

use crate::contact::mesh::size::MeshSize;

/// A mesh gathered about a pole serves motions whose pole is no farther away than this: within the bump of the density of cells (see
/// `BUMP` in `mesh/strips.rs`; lengths relative to half chords). With 0.1 and 0.25 the products of 12 sweeps of 9 motions on ellipses of
/// `benches/calibrate` change by less than 0.5 %.
const POLE_MOVED: f64 = 0.15;

/// The regime of the tractions of a motion, as far as it decides the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Regime {
    /// Nothing is known yet.
    Unknown,
    /// A stick zone of some size.
    Sticking {
        /// There is spin, and the patch is longer than wide; the mesh of other patches does not depend on spin.
        spinning: bool,
    },
    /// Hardly any stick, and tractions that turn about a point of the patch, given along its chord and across the patch, each from −1
    /// to 1.
    Spinning([f64; 2]),
}

impl Regime {
    /// Cells along a strip divided by strips, for a patch of half-length a and half-width b. Factors and exponents lie on
    /// flat optima over 62 Hertz contacts with a/b from 0.2 to 5; with spin and stick in a long patch, over 14 random ellipses
    /// with a/b > 5 on 500 cells: error .0007, half of that with the exponent 0.3.
    pub(crate) fn shape(self, a_over_b: f64) -> f64 {
        match self {
            Regime::Unknown => 1.25 * a_over_b.powf(0.45),
            Regime::Sticking { spinning: true } => 1.3,
            Regime::Sticking { spinning: false } => 1.3 * a_over_b.powf(0.3),
            Regime::Spinning(_) => 0.85 * a_over_b.powf(0.4),
        }
    }
}

/// What a level is made from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshPlan {
    /// Strips and cells.
    pub size: MeshSize,
    /// The regime it is made for.
    pub regime: Regime,
}

impl MeshPlan {
    /// Where cells and strips gather, if anywhere.
    #[must_use]
    pub fn pole(&self) -> Option<[f64; 2]> {
        match self.regime {
            Regime::Spinning(pole) => Some(pole),
            Regime::Unknown | Regime::Sticking { .. } => None,
        }
    }

    /// Does the mesh serve a regime that was found on it?
    #[must_use]
    pub fn serves(&self, found: Regime) -> bool {
        match (self.regime, found) {
            (Regime::Sticking { .. }, Regime::Sticking { .. }) => true,
            (Regime::Spinning(made), Regime::Spinning(found)) => {
                (made[0] - found[0]).hypot(made[1] - found[1]) < POLE_MOVED
            }
            _ => false,
        }
    }

    /// Do the meshes of two plans differ in size only, so that the change between them tells what is left?
    #[must_use]
    pub fn is_like(&self, other: &MeshPlan) -> bool {
        match (self.regime, other.regime) {
            (Regime::Sticking { .. }, Regime::Sticking { .. })
            | (Regime::Spinning(_), Regime::Spinning(_)) => self.size.strips != other.size.strips,
            _ => false,
        }
    }
}

impl From<MeshSize> for MeshPlan {
    fn from(size: MeshSize) -> Self {
        let regime = Regime::Unknown;
        MeshPlan { size, regime }
    }
}
