//! The content of the picture of a patch: the coloured values, the bounding box of the cells, the zones.

use crate::render::shape::sheet::{AtBorder, bounds};
use railhead_contact::case::words::solver::Output;
use railhead_contact::solution::words::answer::{PatchCells, PointFields, Zone};

/// The content of the picture of a patch.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The title, a text of the client.
    pub title: String,
    /// At most two lines below the title.
    pub remarks: Vec<String>,
    /// The field that is coloured.
    pub shown: Output,
    /// The cells.
    pub fields: PatchCells,
    /// The values of one motion.
    pub values: PointFields,
    /// The ends of the scale; by default 0 and the largest value.
    pub range: Option<[f64; 2]>,
}

/// The values of a heat map.
pub(crate) struct Heat {
    /// Magnitude per cell.
    pub values: Vec<f64>,
    /// Their name.
    pub label: &'static str,
    /// Their unit; empty if they have none.
    pub unit: &'static str,
    /// Their behaviour at the border of the patch.
    pub edge: AtBorder,
}

impl Heat {
    /// Returns the ends of the scale, the second above the first.
    pub(crate) fn range(&self, asked: Option<[f64; 2]>) -> [f64; 2] {
        let largest = self.values.iter().copied().fold(0.0, f64::max);
        asked.unwrap_or([0.0, if largest > 0.0 { largest } else { 1.0 }])
    }
}

/// Returns the values of the heat map; `None` for zones.
pub(crate) fn heat(scene: &Scene) -> Option<Heat> {
    let magnitude = |x: &Option<Vec<f64>>, y: &Option<Vec<f64>>| {
        let (x, y) = (x.as_deref().unwrap_or(&[]), y.as_deref().unwrap_or(&[]));
        x.iter().zip(y).map(|(x, y)| x.hypot(*y)).collect()
    };
    let values = &scene.values;
    match scene.shown {
        Output::Tractions => Some(Heat {
            values: magnitude(&values.traction_x_mpa, &values.traction_y_mpa),
            label: "traction",
            unit: "MPa",
            edge: AtBorder::Vanishes,
        }),
        Output::Pressure => Some(Heat {
            values: scene.fields.pressure_mpa.clone().unwrap_or_default(),
            label: "pressure",
            unit: "MPa",
            edge: AtBorder::Vanishes,
        }),
        Output::Slip => Some(Heat {
            values: magnitude(&values.slip_x, &values.slip_y),
            label: "slip / rolling speed",
            unit: "",
            edge: AtBorder::Continues,
        }),
        Output::Temperature => Some(Heat {
            values: values.temperature_c.clone().unwrap_or_default(),
            label: "temperature",
            unit: "°C",
            edge: AtBorder::Continues,
        }),
        Output::Zones
        | Output::Resultants
        | Output::Subsurface
        | Output::Damage
        | Output::Gradients => None,
    }
}

/// Returns the bounding box `[x_min, x_max, y_min, y_max]` of the cells in mm.
pub(crate) fn extent(fields: &PatchCells) -> [f64; 4] {
    let shape = bounds((0..fields.x_mm.len()).flat_map(|cell| {
        let (x, y) = (fields.x_mm[cell], fields.y_mm[cell]);
        let (dx, dy) = (0.5 * fields.dx_mm[cell], 0.5 * fields.dy_mm[cell]);
        [[x - dx, y - dy], [x + dx, y + dy]]
    }));
    match shape.iter().all(|value| value.is_finite()) {
        true => shape,
        false => [-1.0, 1.0, -1.0, 1.0],
    }
}

/// Whether any cell sticks, and whether any cell slips.
pub(crate) fn zones_present(scene: &Scene) -> (bool, bool) {
    let zones = scene.values.zone.as_deref().unwrap_or(&[]);
    (zones.contains(&Zone::Stick), zones.contains(&Zone::Slip))
}
