//! Pictures of a contact patch: a heat map of the cells, the border of the stick zone, arrows, axes in mm and a scale; and of sections,
//! creep curves, and a wheel on its rail.

mod bar;
mod chart;
mod colour;
pub(crate) mod curve;
pub(crate) mod draw;
mod layers;
mod map;
pub(crate) mod profile_view;
pub(crate) mod raster;
pub(crate) mod scene;
pub(crate) mod section;
pub(crate) mod svg;
