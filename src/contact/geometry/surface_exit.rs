//! How the search for a point of the bodies' surfaces over the plane of contact ends.

/// No point of a body was found over a place of the plane of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceMissed {
    /// The place `[x, y]` in the frame, in mm.
    pub at: [f64; 2],
    /// How the search ended.
    pub exit: SurfaceExit,
}

/// How the search for a point of a surface ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceExit {
    /// The last step was too small to matter.
    Converged,
    /// The search left the wheel's profile: there is no such point.
    BeyondProfile,
    /// The steps were used up.
    StepsUsedUp,
    /// The rail ends or turns away from the plane of contact before.
    RailTurnsAway,
}

impl SurfaceExit {
    /// Was the point found?
    #[must_use]
    pub fn converged(self) -> bool {
        self == SurfaceExit::Converged
    }

    /// The exit as a clause.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            SurfaceExit::Converged => "the point was found",
            SurfaceExit::BeyondProfile => "the search left the wheel's profile",
            SurfaceExit::StepsUsedUp => "the steps were used up",
            SurfaceExit::RailTurnsAway => "the rail ends or turns away before",
        }
    }
}

impl std::fmt::Display for SurfaceMissed {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let [x, y] = self.at;
        let body = match self.exit {
            SurfaceExit::RailTurnsAway => "rail",
            _ => "wheel",
        };
        write!(
            f,
            "the {body}'s surface was not found over the place x = {x:.3} mm, y = {y:.3} mm of the plane of contact: {}",
            self.exit.reason()
        )
    }
}
