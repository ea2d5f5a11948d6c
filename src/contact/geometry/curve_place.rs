//! Points on the reference curve of a rail.

/// A point on the reference curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePlace {
    /// Arc length in mm.
    pub s: f64,
    /// `[y, z]` in track axes, in mm.
    pub at: [f64; 2],
    /// Angle α of the tangent in rad.
    pub angle: f64,
    /// Parameter of the curve of the rail's profile.
    pub rail: f64,
}

impl CurvePlace {
    /// Unit tangent `[y, z]`.
    pub fn tangent(&self) -> [f64; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [cos, sin]
    }

    /// Unit normal `[y, z]` out of the rail.
    pub fn normal(&self) -> [f64; 2] {
        let (sin, cos) = self.angle.sin_cos();
        [-sin, cos]
    }

    /// The point `[x, y, z]` in track axes at the distance `gap` along the normal, in mm.
    pub fn point(&self, x: f64, gap: f64) -> [f64; 3] {
        let normal = self.normal();
        [
            x,
            self.at[0] + gap * normal[0],
            self.at[1] + gap * normal[1],
        ]
    }
}
