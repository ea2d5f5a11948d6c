//! Pictures of a patch as a heat map, of sections, of creep curves, and of a wheel on its rail.

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
