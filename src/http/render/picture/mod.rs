//! Pictures of a contact patch: a heat map of the cells, the border of the stick zone, arrows, axes in mm and a scale; and of sections,
//! creep curves, and a wheel on its rail.

mod bar;
mod chart;
mod colour;
pub mod curve;
pub mod draw;
mod frame;
mod layers;
mod map;
pub mod raster;
pub mod scene;
pub mod section;
pub mod standing;
mod svg;
