//! Values of a field as the client reads them: per cell, or on a regular grid.

use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::solver::Output;
use crate::contact::post::resample::{resample, resample_zone};
use crate::contact::solution::words::{PatchCells, PointFields};
use crate::contact::solution::zone::Zone;

/// Values per cell, strip by strip from smaller to larger y, in each strip from smaller to larger x. All arrays have
/// the same length; those of other fields are absent.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct Cells {
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
}

/// Values on a regular grid over the bounding box of the patch: `values[iy][ix]` at `(x_mm[ix], y_mm[iy])`, null
/// outside the patch; those of other fields are absent.
#[derive(Debug, Default, Serialize, ToSchema)]
pub struct GriddedField {
    /// Number of the patch, counted from 0.
    pub patch: usize,
    /// Number of the motion, counted from 0.
    pub point: usize,
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
}

/// The cells with the values of one output.
pub fn per_cell(fields: PatchCells, point: PointFields, output: Output) -> Cells {
    let mut cells = Cells {
        x_mm: fields.x_mm,
        y_mm: fields.y_mm,
        dx_mm: fields.dx_mm,
        dy_mm: fields.dy_mm,
        strip: fields.strip,
        ..Cells::default()
    };
    match output {
        Output::Tractions => {
            (cells.traction_x_mpa, cells.traction_y_mpa) =
                (point.traction_x_mpa, point.traction_y_mpa)
        }
        Output::Pressure => cells.pressure_mpa = fields.pressure_mpa,
        Output::Slip => (cells.slip_x, cells.slip_y) = (point.slip_x, point.slip_y),
        Output::Zones => cells.zone = point.zone,
        Output::Resultants => {}
    }
    cells
}

/// The values of one output on a grid of `nx × ny` samples; neither patch nor point are filled in.
pub fn gridded(
    fields: &PatchCells,
    point: &PointFields,
    output: Output,
    nx: usize,
    ny: usize,
) -> GriddedField {
    let mut answer = GriddedField::default();
    let mut sample = |values: &Option<Vec<f64>>| {
        let grid = resample(fields, values.as_deref()?, nx, ny);
        (answer.x_mm, answer.y_mm) = (grid.x_mm, grid.y_mm);
        Some(grid.values)
    };
    match output {
        Output::Tractions => {
            let (x, y) = (sample(&point.traction_x_mpa), sample(&point.traction_y_mpa));
            (answer.traction_x_mpa, answer.traction_y_mpa) = (x, y);
        }
        Output::Pressure => answer.pressure_mpa = sample(&fields.pressure_mpa),
        Output::Slip => {
            let (x, y) = (sample(&point.slip_x), sample(&point.slip_y));
            (answer.slip_x, answer.slip_y) = (x, y);
        }
        Output::Zones => {
            if let Some(zone) = &point.zone {
                let grid = resample_zone(fields, zone, nx, ny);
                (answer.x_mm, answer.y_mm) = (grid.x_mm, grid.y_mm);
                answer.zone = Some(grid.values);
            }
        }
        Output::Resultants => {}
    }
    answer
}
