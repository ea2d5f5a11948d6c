//! Cell values as smooth fields over a patch, for pictures: interpolated, bounded by the border, cut at levels.

mod contour;
pub mod sheet;
pub mod stick;
