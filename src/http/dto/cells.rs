//! Values of a field as the client reads them: per cell, or on a regular grid.

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::solution::words::answer::Zone;

/// Closed polygons as lists of `[x, y]` in mm; the last point is joined to the first. Outer borders run
/// counter-clockwise, holes clockwise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, ToSchema)]
pub(crate) struct Outlines {
    /// The border of the patch.
    pub patch: Vec<Vec<[f64; 2]>>,
    /// Around the cells that stick; only with zones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stick: Option<Vec<Vec<[f64; 2]>>>,
    /// Around the cells that slip; only with zones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip: Option<Vec<Vec<[f64; 2]>>>,
}

/// Values per cell, strip by strip from smaller to larger y, in each strip from smaller to larger x. All arrays have
/// the same length; those of other fields are absent.
#[derive(Serialize, ToSchema)]
pub(crate) struct Cells {
    /// Centre of the cell along x in mm.
    pub x_mm: Vec<f64>,
    /// Centre of the cell across in mm.
    pub y_mm: Vec<f64>,
    /// Width of the cell along x in mm.
    pub dx_mm: Vec<f64>,
    /// Width of the cell across in mm.
    pub dy_mm: Vec<f64>,
    /// Number of the strip, counted from 0.
    pub strip: Vec<u32>,
    /// Stick or slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<Vec<Zone>>,
    /// Pressure in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_mpa: Option<Vec<f64>>,
    /// Traction on the lower body along x in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_x_mpa: Option<Vec<f64>>,
    /// Traction on the lower body across in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_y_mpa: Option<Vec<f64>>,
    /// Slip along x, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_x: Option<Vec<f64>>,
    /// Slip across, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_y: Option<Vec<f64>>,
    /// Temperature of both surfaces in °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<Vec<f64>>,
}

/// Values on a regular grid over the bounding box of the patch: `values[iy][ix]` at `(x_mm[ix], y_mm[iy])`, null
/// outside the patch; those of other fields are absent.
#[derive(Serialize, ToSchema)]
pub(crate) struct GriddedField {
    /// Number of the patch, counted from 0.
    pub patch: usize,
    /// Number of the motion, counted from 0.
    pub point: usize,
    /// The border of the patch, and of its zones where they are part of the answer.
    pub outlines: Outlines,
    /// Samples along x in mm, ascending.
    pub x_mm: Vec<f64>,
    /// Samples across in mm, ascending.
    pub y_mm: Vec<f64>,
    /// Stick or slip.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zone: Option<Vec<Vec<Option<Zone>>>>,
    /// Pressure in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body along x in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_x_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Traction on the lower body across in MPa.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction_y_mpa: Option<Vec<Vec<Option<f64>>>>,
    /// Slip along x, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_x: Option<Vec<Vec<Option<f64>>>>,
    /// Slip across, divided by rolling speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slip_y: Option<Vec<Vec<Option<f64>>>>,
    /// Temperature of both surfaces in °C.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature_c: Option<Vec<Vec<Option<f64>>>>,
}
