//! Pictures of a patch as a heat map, of sections, of creep curves, and of a wheel on its rail.

pub(crate) mod chart;
pub(crate) mod curve;
pub(crate) mod draw;
pub(crate) mod profile_view;
pub(crate) mod raster;
pub(crate) mod section;
