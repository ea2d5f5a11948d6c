//! What is known of each patch of a grid as a whole: force, extent, area, and remarks.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::contact::normal::Patch;
use crate::contact::normal::prescribed::components::NOWHERE;
use crate::contact::normal::prescribed::line::Direction;
use crate::contact::normal::prescribed::{PADDING, PressureField};

/// A patch with fewer samples along or across has an uncertain edge.
const SAMPLES_ACROSS_MIN: usize = 4;

/// One patch and the cells it may occupy.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Shape {
    pub(super) patch: Patch,
    pub(super) columns: RangeInclusive<usize>,
    pub(super) rows: RangeInclusive<usize>,
    pub(super) segments_per_strip: f64,
}

impl PressureField {
    /// Patches without their region: force, rows and columns come from the samples.
    pub(super) fn shapes_from_samples(&self, samples: &[u8], count: usize) -> Vec<Shape> {
        let nx = self.grid.x.len();
        let mut boxes = vec![[usize::MAX, 0, usize::MAX, 0]; count];
        let (mut forces, mut largest) = (vec![0.0; count], vec![0.0_f64; count]);
        let mut runs = vec![0_u32; count];
        let share = |axis: &[f64], k: usize| 0.5 * (axis[k + 1] - axis[k - 1]);
        for (k, &label) in samples
            .iter()
            .enumerate()
            .filter(|(_, label)| **label != NOWHERE)
        {
            let (i, j, label_index) = (k % nx, k / nx, usize::from(label));
            let pressure = self.pressure_max * self.q[k].sqrt();
            forces[label_index] += pressure * share(&self.grid.x, i) * share(&self.grid.y, j);
            largest[label_index] = largest[label_index].max(pressure);
            runs[label_index] += u32::from(samples[k - 1] != label);
            let [i0, i1, j0, j1] = &mut boxes[label_index];
            (*i0, *i1) = (i.min(*i0), i.max(*i1));
            (*j0, *j1) = (j.min(*j0), j.max(*j1));
        }
        (0..count)
            .map(|label| {
                let [i0, i1, j0, j1] = boxes[label];
                Shape {
                    patch: Patch {
                        normal_force: forces[label],
                        approach: None,
                        area: 0.0,
                        pressure_max: largest[label],
                        semi_axes: None,
                        extent: [0.0; 4],
                    },
                    // Cells touching the samples, and one more around them.
                    columns: i0 - 2..=i1 + 1,
                    rows: j0 - 2..=j1 + 1,
                    segments_per_strip: f64::from(runs[label]) / (j1 - j0 + 1) as f64,
                }
            })
            .collect()
    }

    /// Extent and area of a patch, by lines through it.
    pub(super) fn measure(&self, label: usize, shape: &mut Shape) {
        let [x_min, x_max] = self.extent(shape, label, Direction::Across);
        let [y_min, y_max] = self.extent(shape, label, Direction::Rolling);
        shape.patch.extent = [x_min, x_max, y_min, y_max];
        // Chords have a root at both ends of the patch, so the lines crowd there.
        let lines = 64 + 2 * shape.rows.clone().count();
        let (middle, half) = (0.5 * (y_min + y_max), 0.5 * (y_max - y_min));
        let step = PI / lines as f64;
        let area: f64 = (0..lines)
            .map(|n| {
                let theta = (n as f64 + 0.5) * step;
                let line = self.line_of(
                    shape,
                    label,
                    Direction::Rolling,
                    middle - half * theta.cos(),
                );
                let length: f64 = line
                    .segments()
                    .iter()
                    .map(|(left, right)| right - left)
                    .sum();
                length * half * theta.sin() * step
            })
            .sum();
        shape.patch.area = area;
    }

    /// First and last position of lines in `direction` that meet the patch.
    fn extent(&self, shape: &Shape, label: usize, direction: Direction) -> [f64; 2] {
        const STEPS: usize = 50;
        let (axis, range) = match direction {
            Direction::Rolling => (&self.grid.y, &shape.rows),
            Direction::Across => (&self.grid.x, &shape.columns),
        };
        // The outermost samples are two lines inside the range of cells (see `shapes_from_samples`).
        let [first, last] = [*range.start(), *range.end() + 1];
        [(first, first + 2), (last, last - 2)].map(|(outside, inside)| {
            let (mut outside, mut inside) = (axis[outside], axis[inside]);
            for _ in 0..STEPS {
                let middle = 0.5 * (outside + inside);
                if self
                    .line_of(shape, label, direction, middle)
                    .segments()
                    .is_empty()
                {
                    outside = middle;
                } else {
                    inside = middle;
                }
            }
            inside
        })
    }

    pub(super) fn warnings(&self, samples: &[u8], shapes: &[Shape]) -> Vec<String> {
        let (nx, ny) = (self.grid.x.len(), self.grid.y.len());
        let at_edge = |k: usize, n: usize| k == PADDING || k + PADDING + 1 == n;
        let mut warnings = Vec::new();
        let cut = |k: usize| samples[k] != NOWHERE && (at_edge(k % nx, nx) || at_edge(k / nx, ny));
        if (0..nx * ny).any(cut) {
            warnings.push(
                "the pressure does not fall to 0 at the edge of the grid; the contact is taken to end within the next spacing"
                    .to_owned(),
            );
        }
        for (label, shape) in shapes.iter().enumerate() {
            let (along, across) = (
                shape.columns.clone().count() - 3,
                shape.rows.clone().count() - 3,
            );
            if along.min(across) < SAMPLES_ACROSS_MIN {
                warnings.push(format!(
                    "patch {label} has only {along} by {across} samples of pressure; its edge is uncertain"
                ));
            }
        }
        warnings
    }
}
