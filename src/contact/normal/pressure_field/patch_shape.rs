//! Force, extent, area and remarks of each patch of a grid.

use std::f64::consts::PI;

use crate::contact::normal::patch::Patch;
use crate::contact::normal::pressure_field::components::NOWHERE;
use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::pressure_field::patch_cells::{PatchShape, SampledLoad};
use crate::contact::normal::pressure_field::sample_grid::PADDING;
use crate::contact::numerics::bracketed_root::{bisect, maximum};
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// With fewer samples along or across, the edge of a patch is uncertain and its force wrong by more than about 2 %: for
/// Hertz's pressure, the sum of the samples is wrong by up to 2 % with 9 samples, 0.5 % with 18.
const SAMPLES_ACROSS_MIN: usize = 8;
/// Halvings of the line between two samples on which a patch ends. They leave 1e-11 of it: mirror images stay alike to 1e-9, for which 1e-9 was not
/// enough.
const HALVINGS: u32 = 37;

/// The ends of a patch along x, each with the line that reaches it.
struct FarthestLines {
    left: (f64, f64),
    right: (f64, f64),
}

impl FarthestLines {
    const NONE: FarthestLines = FarthestLines {
        left: (f64::INFINITY, 0.0),
        right: (f64::NEG_INFINITY, 0.0),
    };

    fn widen(&mut self, line: f64, left: f64, right: f64) {
        if left < self.left.0 {
            self.left = (left, line);
        }
        if right > self.right.0 {
            self.right = (right, line);
        }
    }
}

impl GridPressure {
    /// Patches before their regions are found: force, rows and columns, from the samples.
    pub(crate) fn shapes_from_samples(&self, samples: &[u8], count: usize) -> Vec<PatchShape> {
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
                PatchShape {
                    patch: Patch {
                        normal_force: forces[label],
                        approach: None,
                        area: 0.0,
                        pressure_max: largest[label],
                        semi_axes: None,
                        extent: [0.0; 4],
                    },
                    // Cells with these samples as corners, and one more cell on every side.
                    columns: i0 - 2..=i1 + 1,
                    rows: j0 - 2..=j1 + 1,
                    segments_per_strip: f64::from(runs[label]) / (j1 - j0 + 1) as f64,
                    load: SampledLoad::default(),
                }
            })
            .collect()
    }

    /// Extent `[x_min, x_max, y_min, y_max]` in mm and area in mm² of a patch, from its chords on lines along x.
    pub(crate) fn measure(&self, label: usize, shape: &PatchShape) -> ([f64; 4], f64) {
        let [y_min, y_max] = self.extent_across(shape, label);
        // The length of chords varies as a square root at both ends of the patch, so lines are closer there.
        let lines = (16 + shape.rows.clone().count()).max(48);
        let (middle, half) = (0.5 * (y_min + y_max), 0.5 * (y_max - y_min));
        let step = PI / lines as f64;
        let at = |n: f64| middle - half * (n * step).cos();
        let ends = |y: f64| self.ends(label, y);
        let mut reach = FarthestLines::NONE;
        let mut area = 0.0;
        for n in 0..lines {
            let n = n as f64 + 0.5;
            let (left, right, length) = ends(at(n));
            area += length * half * (n * step).sin() * step;
            reach.widen(n, left, right);
        }
        // The longest chord of a rough patch may lie on a row of samples.
        for (j, y) in self.grid.y.iter().enumerate() {
            if y_min < *y && *y < y_max && self.may_reach(j, &reach) {
                let (left, right, _) = ends(*y);
                reach.widen(((middle - y) / half).acos() / step, left, right);
            }
        }
        let FarthestLines { left, right } = reach;
        let (first, last) = (|n: f64| -ends(at(n)).0, |n: f64| ends(at(n)).1);
        let bracket = |n: f64| [(n - 1.0).max(0.0), (n + 1.0).min(lines as f64)];
        let extent = [
            -maximum(bracket(left.1), first).max(-left.0),
            maximum(bracket(right.1), last).max(right.0),
            y_min,
            y_max,
        ];
        (extent, area)
    }

    /// May the line of row j reach farther than all lines so far? An edge lies at most two samples beyond the positive ones.
    fn may_reach(&self, j: usize, reach: &FarthestLines) -> bool {
        self.runs[j].is_none_or(|[first, last]| {
            let x = &self.grid.x;
            x[first - 2] < reach.left.0 || x[last + 2] > reach.right.0
        })
    }

    /// Left and right end of a patch on the line at y, and the length of its segments there; infinite ends and 0 if it has none.
    fn ends(&self, label: usize, y: f64) -> (f64, f64, f64) {
        let mut found = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        self.each_segment(label, y, |left, right| {
            found = (found.0.min(left), right, found.2 + (right - left));
        });
        found
    }

    /// First and last y of lines that meet the patch.
    fn extent_across(&self, shape: &PatchShape, label: usize) -> [f64; 2] {
        let y = &self.grid.y;
        // The outermost samples are two lines inside the range of cells (see `shapes_from_samples`).
        let [first, last] = [*shape.rows.start(), *shape.rows.end() + 1];
        [(first, first + 2), (last, last - 2)]
            .map(|(outside, inside)| self.end_across(label, [y[outside], y[inside]]))
    }

    /// The last place that meets the patch on the way from `inside` to `outside`.
    fn end_across(&self, label: usize, [outside, inside]: [f64; 2]) -> f64 {
        let meets = |y: f64| {
            let (left, right, _) = self.ends(label, y);
            right > left
        };
        let [last, _] = bisect([inside, outside], HALVINGS, meets);
        last
    }

    pub(crate) fn remarks(&self, samples: &[u8], shapes: &[PatchShape]) -> Vec<RemarkEntry> {
        let (nx, ny) = (self.grid.x.len(), self.grid.y.len());
        let at_edge = |k: usize, n: usize| k == PADDING || k + PADDING + 1 == n;
        let mut remarks = Vec::new();
        let cut = |k: usize| samples[k] != NOWHERE && (at_edge(k % nx, nx) || at_edge(k / nx, ny));
        if (0..nx * ny).any(cut) {
            remarks.push(Remark::PressureCutAtEdge {}.into());
        }
        for (label, shape) in shapes.iter().enumerate() {
            let (along, across) = (
                shape.columns.clone().count() - 3,
                shape.rows.clone().count() - 3,
            );
            if along.min(across) < SAMPLES_ACROSS_MIN {
                let remark = Remark::PressureCoarse {
                    samples_x: along,
                    samples_y: across,
                };
                remarks.push(remark.at_patch(label));
            }
        }
        remarks
    }
}
