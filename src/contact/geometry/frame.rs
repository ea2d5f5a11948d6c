//! The frame of a patch: its plane of contact in the axes of the track.

/// The frame of a patch in track axes: z of the frame is the normal out of the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Origin on the rail's surface, `[x, y, z]` in mm.
    pub origin: [f64; 3],
    /// Turn about x from the track's axes, in rad.
    pub angle: f64,
    /// Parameter of the origin on the rail's curve.
    pub rail: f64,
    /// Parameter of the opposite point on the wheel's curve.
    pub wheel: f64,
}

impl Frame {
    /// Unit vectors in track axes: tangent (y of the frame) and normal (z of the frame), as `[y, z]`.
    #[must_use]
    pub fn axes(&self) -> [[f64; 2]; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [[cos, sin], [-sin, cos]]
    }

    /// The plane of contact, for the coordinates of many points.
    pub(crate) fn plane(&self) -> Plane {
        Plane {
            origin: [self.origin[1], self.origin[2]],
            axes: self.axes(),
        }
    }
}

/// The plane of contact across the track: origin, tangent and normal as `[y, z]` in track axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plane {
    origin: [f64; 2],
    pub(crate) axes: [[f64; 2]; 2],
}

impl Plane {
    /// Coordinates across and along the normal of a point `[y, z]` of the track.
    pub(crate) fn across(&self, [y, z]: [f64; 2]) -> [f64; 2] {
        let from = [y - self.origin[0], z - self.origin[1]];
        self.axes.map(|axis| axis[0] * from[0] + axis[1] * from[1])
    }
}

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
