//! Where stresses below the surface are asked for.

use railhead_macros::{Words, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Where stresses below the surface are asked for, in the axes of the patch: x along rolling, y to the left, depth positive into the
/// body. At most one of `points_mm`, `along_depth_at_mm` and `plane`; without any, only the worst point is found.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Subsurface)]
pub struct SubsurfaceWords {
    /// Points `[x, y, depth]` in mm.
    pub points_mm: Option<Vec<[f64; 3]>>,
    /// The line straight down from `[x, y]` in mm, or below the `"worst"` point of the patch; needs `depths_mm`.
    pub along_depth_at_mm: Option<DepthLineAt>,
    /// Depths on that line in mm.
    pub depths_mm: Option<Vec<f64>>,
    /// A grid of points, usually in a plane.
    pub plane: Option<StressGrid>,
    /// The body: `lower` when left out.
    #[schema(required = false)]
    pub body: BodyName,
    /// Find the point of every patch where von Mises' stress is largest; `true` when left out.
    #[schema(required = false)]
    pub worst: bool,
    /// Judge what a point of the body lives through while the contact rolls over it: Dang Van's criterion and shakedown.
    pub passage: Option<PassageWords>,
}

/// What is judged of a passage of the contact in steady rolling: shakedown always, Dang Van's criterion with its slope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[schema(as = Passage)]
pub struct PassageWords {
    /// Weight of the hydrostatic stress in Dang Van's criterion, a property of the steel; without it the criterion is not evaluated.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, minimum = 0, maximum = 10)]
    pub dang_van_slope: Option<f64>,
}

/// Where a line of depths begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum DepthLineAt {
    /// At `[x, y]` in mm.
    Place([f64; 2]),
    /// At a point that is found.
    Found(FoundPlace),
}

/// A point that is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FoundPlace {
    /// Where von Mises' stress is largest.
    Worst,
}

/// The product of three axes, x fastest, then y, then depth; for a plane one of them is a single number.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct StressGrid {
    /// x in mm.
    pub x_mm: GridAxis,
    /// y in mm.
    pub y_mm: GridAxis,
    /// Depths in mm.
    pub depths_mm: GridAxis,
}

/// Coordinates along one axis: a number, a list, or equally spaced ones `{ "from", "to", "points" }`.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum GridAxis {
    /// One coordinate.
    One(f64),
    /// As listed.
    List(Vec<f64>),
    /// Equally spaced, both ends included.
    Spaced {
        /// First coordinate.
        from: f64,
        /// Last coordinate.
        to: f64,
        /// Number of coordinates, at least 2.
        #[schema(minimum = 2)]
        points: u32,
    },
}

/// One of the two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = Body)]
pub enum BodyName {
    /// Body 2, the rail.
    #[default]
    Lower,
    /// Body 1, the wheel.
    Upper,
}
