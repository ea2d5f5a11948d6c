//! Pressures sampled on grids, and the load that strips carry.

use std::f64::consts::PI;

use railhead_contact::mesh::Chord;
use railhead_contact::normal::pressure_field::field::PressureField;
use railhead_contact::remark::entry::RemarkEntry;
use serde_json::{Value, json};

/// `n` by `n` samples of a pressure over `[x_min, x_max, y_min, y_max]`, ends included.
pub struct Samples {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub pressure: Vec<Vec<f64>>,
}

impl Samples {
    pub fn of(extent: [f64; 4], n: u32, pressure: impl Fn(f64, f64) -> f64) -> Samples {
        let axis = |low: f64, high: f64| -> Vec<f64> {
            (0..n)
                .map(|k| low + (high - low) * f64::from(k) / f64::from(n - 1))
                .collect()
        };
        Samples::on(
            axis(extent[0], extent[1]),
            axis(extent[2], extent[3]),
            pressure,
        )
    }

    pub fn on(x: Vec<f64>, y: Vec<f64>, pressure: impl Fn(f64, f64) -> f64) -> Samples {
        let pressure = y
            .iter()
            .map(|y| x.iter().map(|x| pressure(*x, *y)).collect())
            .collect();
        Samples { x, y, pressure }
    }

    pub fn field(&self) -> PressureField {
        self.field_with_remarks().0
    }

    pub fn field_with_remarks(&self) -> (PressureField, Vec<RemarkEntry>) {
        PressureField::new(&self.x, &self.y, &self.pressure).unwrap()
    }

    pub fn contact(&self) -> Value {
        json!({ "type": "pressure_grid", "x_mm": self.x, "y_mm": self.y, "pressure_mpa": self.pressure })
    }
}

/// Returns equal strips over a patch.
pub fn strips(field: &PressureField, patch: usize, count: u32) -> Vec<(f64, f64)> {
    let [_, _, y_min, y_max] = field.patches()[patch].extent;
    let dy = (y_max - y_min) / f64::from(count);
    (0..count)
        .map(|k| (y_min + (f64::from(k) + 0.5) * dy, dy))
        .collect()
}

/// Returns the force that strips with `cells` cells each carry before scaling.
pub fn strip_load(field: &PressureField, patch: usize, count: u32, cells: u32) -> f64 {
    let chords = field.chords(patch, &strips(field, patch, count));
    chords
        .iter()
        .map(|chord| chord_load(field, chord, cells) * chord.dy)
        .sum()
}

pub fn chord_load(field: &PressureField, chord: &Chord, cells: u32) -> f64 {
    let (centre, half) = (
        0.5 * (chord.left + chord.right),
        0.5 * (chord.right - chord.left),
    );
    let edge = |k: u32| centre - half * (PI * f64::from(k) / f64::from(cells)).cos();
    (0..cells)
        .map(|k| field.mean_pressure(chord, edge(k), edge(k + 1)) * (edge(k + 1) - edge(k)))
        .sum()
}
