//! The values per cell: tractions, slips, zones and pressures on the meshes that motions were solved on.
//!
//! Frame and signs are those of [`answer`](crate::contact::solution::words::answer).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The values per cell of all patches: what was asked for, nothing else.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Fields {
    /// One entry per patch, in the order of [`Solution::patches`](crate::contact::solution::words::answer::Solution::patches).
    pub patches: Vec<PatchFields>,
}

/// The values per cell of one patch, motion by motion, each on the mesh that served it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PatchFields {
    /// The meshes that the motions were solved on; several motions may share one.
    pub meshes: Vec<PatchCells>,
    /// One entry per motion.
    pub points: Vec<PointFields>,
}

impl PatchFields {
    /// The cells that the values of a motion belong to.
    #[must_use]
    pub fn cells(&self, point: usize) -> &PatchCells {
        &self.meshes[self.points[point].mesh]
    }
}

/// Cells of one patch, strip by strip from smaller to larger y, in each strip from smaller to larger x.
/// All vectors have one value per cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PatchCells {
    /// Centre of the cell along x in mm.
    pub x_mm: Vec<f64>,
    /// Centre of the cell across in mm.
    pub y_mm: Vec<f64>,
    /// Width of the cell along x in mm.
    pub dx_mm: Vec<f64>,
    /// Width of the cell across in mm.
    pub dy_mm: Vec<f64>,
    /// Number of the strip, counted from 0; segments of one strip share it.
    pub strip: Vec<u32>,
    /// Pressure in MPa, if asked for.
    pub pressure_mpa: Option<Vec<f64>>,
}

/// Values per cell for one motion; absent where not asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointFields {
    /// Which of the patch's meshes they belong to.
    pub mesh: usize,
    /// Stick or slip.
    pub zone: Option<Vec<Zone>>,
    /// Traction on the lower body along x in MPa.
    pub traction_x_mpa: Option<Vec<f64>>,
    /// Traction on the lower body across in MPa.
    pub traction_y_mpa: Option<Vec<f64>>,
    /// Mean slip of the cell, upper body relative to the lower, along x, divided by rolling speed: along the traction, and such that the
    /// power of the cells adds up to that of the patch (see [`local_power`](crate::contact::post::local_power)).
    pub slip_x: Option<Vec<f64>>,
    /// Slip across, divided by rolling speed.
    pub slip_y: Option<Vec<f64>>,
    /// Temperature of both surfaces at the middle of the cell in °C.
    pub temperature_c: Option<Vec<f64>>,
    /// Stresses at the requested points, as [`stored`](crate::contact::post::subsurface::states::stored).
    pub subsurface: Option<Vec<f64>>,
}

/// What a cell of the contact patch does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Zone {
    /// No relative slip.
    Stick,
    /// The friction bound is reached and the surfaces slip.
    Slip,
}

impl Zone {
    /// The word for this zone in every text.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Zone::Stick => "stick",
            Zone::Slip => "slip",
        }
    }
}
