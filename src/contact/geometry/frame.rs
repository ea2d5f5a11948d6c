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
