//! Pictures of a contact patch: a heat map of the cells, the border of the stick zone, arrows, axes in mm and a scale.

mod bar;
mod colour;
pub mod draw;
mod frame;
mod layers;
mod map;
pub mod raster;
pub mod scene;
mod svg;
