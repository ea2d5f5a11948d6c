//! The methods that solve a motion.

use railhead_macros::{Named, Words, keyword};

/// A method. Each has a file or folder of its name in [`rolling::methods`](crate::rolling::methods).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Named)]
pub enum Method {
    /// Semismooth Newton iteration with strip-preconditioned GMRES.
    #[default]
    BoundaryElement,
    /// The method of Liu and Hsu.
    LiuHsu,
    /// Kalker's simplified theory.
    Fastsim,
    /// The table of creep forces of elliptic patches.
    Table,
}

/// Traction bound at which `fastsim` slips.
#[keyword(Default, Words)]
pub enum TractionBound {
    /// At μ times the pressure, for an ellipse Hertz's semi-ellipsoid.
    #[default]
    Elliptic,
    /// At the square of the pressure, scaled to carry the same μN: for an ellipse Kalker's paraboloid, 4/3 as high in the middle.
    Parabolic,
}

impl Method {
    /// Whether it computes tractions and slips, rather than resultants only.
    pub fn has_fields(self) -> bool {
        self != Method::Table
    }
}
