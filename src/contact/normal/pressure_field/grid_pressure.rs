//! A pressure on one grid of samples: its patches with force, extent, area and load centre, its resolution and discontinuities, and remarks.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

use crate::normal::hertz::Patch;
use crate::numerics::flood_fill::groups;
use crate::numerics::roots::{HALVINGS, bisect, maximum};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// Pressure samples on one rectangular grid and the patches they form.
#[derive(Debug, Clone, PartialEq)]
pub struct GridPressure {
    /// The given grid, padded with [`PADDING`] lines on each side.
    pub(crate) grid: SampleGrid,
    /// Squared pressure over its largest value, continued below 0 outside the contact.
    pub(crate) q: Vec<f64>,
    /// Whether each sample is positive or continued by a parabola.
    pub(crate) smooth: Vec<bool>,

    /// The patch of every cell with one of its samples as a corner.
    pub(crate) cells: Vec<u8>,
    /// Largest pressure in MPa.
    pub(crate) pressure_max: f64,
    pub(crate) shapes: Vec<PatchShape>,
    /// The mirror image about y = 0 of each patch; empty without such a symmetry.
    pub(crate) images: Vec<usize>,
    /// The largest jump between given samples.
    pub(crate) jump: Option<Jump>,
}

/// Largest number of patches of a contact.
pub(crate) const PATCHES_MAX: usize = 64;

/// Number of lines added on each side. The contact may extend half a spacing beyond the grid, and interpolation needs more nodes.
pub(crate) const PADDING: usize = 4;

/// Coordinates of a rectangular grid in mm; the value at `(x[i], y[j])` is stored at `j * x.len() + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SampleGrid {
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
}

/// An axis with [`PADDING`] more points on each side, with the outermost spacings.
pub(crate) fn padded(axis: &[f64]) -> Vec<f64> {
    let n = axis.len();
    let (first, last) = (axis[1] - axis[0], axis[n - 1] - axis[n - 2]);
    let before = (1..=PADDING).rev().map(|k| axis[0] - first * k as f64);
    let after = (1..=PADDING).map(|k| axis[n - 1] + last * k as f64);
    before.chain(axis.iter().copied()).chain(after).collect()
}

/// A discontinuity, where the pressure falls between two samples more steeply than at the edge of a smooth contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Coordinates in mm, halfway between the two samples.
    pub at: [f64; 2],
    /// The fall relative to the largest pressure.
    pub fall: f64,
}

/// Excess of the fall of the squared pressure over one interval, relative to the largest squared pressure, from which it is a jump. The excess is over the extrapolation
/// from the interval before. It is 0 at an edge of Hertz's kind; powers of a lens from 0.5 to 1.5 reach 0.21 on 12 samples a side, a hole 0.9.
const JUMP: f64 = 0.35;

impl GridPressure {
    /// Number of grid spacings across each patch, along the axis with fewer. It is smaller for patches oblique to the axes, which fill less of their box than an ellipse
    /// along them.
    pub fn cells_across(&self) -> Vec<f64> {
        let spacing = self.spacing();
        let across = |patch: &Patch| {
            let extent = patch.extent;
            let sides = [0, 1].map(|k| extent[2 * k + 1] - extent[2 * k]);
            let filled = patch.area / (0.25 * PI * sides[0] * sides[1]);
            (sides[0] / spacing[0]).min(sides[1] / spacing[1]) * filled.min(1.0)
        };
        self.patches().iter().map(across).collect()
    }

    /// The jump at the largest excess fall between neighbouring samples (see [`JUMP`]), if it is one. Must be called before edges are found, while squared pressures
    /// are 0 outside the contact.
    pub(crate) fn find_jump(&self) -> Option<Jump> {
        let (nx, ny) = (self.grid.x.len(), self.grid.y.len());
        let mut largest: (f64, Option<Jump>) = (0.0, None);
        for j in PADDING..ny - PADDING {
            for i in PADDING..nx - PADDING {
                for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                    let index = |steps: isize| {
                        let column = i as isize + steps * di;
                        let row = j as isize + steps * dj;
                        (row as usize) * nx + column as usize
                    };
                    let [before, here, next] = [-1, 0, 1].map(|steps| self.q[index(steps)]);
                    // The extrapolation from the two samples before minus the sample.
                    let discontinuity = 2.0 * here - before.max(here) - next;
                    if here > 0.0 && discontinuity > largest.0 {
                        let middle = |axis: &[f64], k: usize, d: isize| {
                            0.5 * (axis[k] + axis[(k as isize + d) as usize])
                        };
                        let at = [middle(&self.grid.x, i, di), middle(&self.grid.y, j, dj)];
                        let fall = here.sqrt() - next.max(0.0).sqrt();
                        largest = (discontinuity, Some(Jump { at, fall }));
                    }
                }
            }
        }
        let (discontinuity, jump) = largest;
        jump.filter(|_| discontinuity > JUMP)
    }

    /// The largest jump of the pressure, if it has any.
    pub fn jump(&self) -> Option<Jump> {
        self.jump
    }
}

/// Label of samples and cells that belong to no patch.
pub(crate) const NOWHERE: u8 = u8::MAX;

/// The patch of every sample, numbered by increasing smallest y (then x), and the number of patches.
///
/// Samples that are neighbours along an axis or a diagonal are connected. Otherwise a slender patch oblique to the grid would be split, although the interpolated region
/// between two diagonal samples belongs to both.
///
/// # Errors
/// The number of patches, if there are more than [`PATCHES_MAX`].
pub(crate) fn label_samples(grid: &SampleGrid, q: &[f64]) -> Result<(Vec<u8>, usize), usize> {
    let size = [grid.x.len(), grid.y.len()];
    // Samples are stored by increasing y, so patches are found in the required order.
    let patches = groups(size, |sample| q[sample] > 0.0);
    if patches.len() > PATCHES_MAX {
        return Err(patches.len());
    }
    let mut labels = vec![NOWHERE; q.len()];
    for (label, patch) in patches.iter().enumerate() {
        for sample in patch {
            labels[*sample] = label as u8;
        }
    }
    Ok((labels, patches.len()))
}

/// The patch of every cell between four samples, stored at the index of its corner of smallest x and y: the patch of its corners, which never belong to two patches.
pub(crate) fn label_cells(grid: &SampleGrid, samples: &[u8]) -> Vec<u8> {
    let (nx, ny) = (grid.x.len(), grid.y.len());
    let mut labels = vec![NOWHERE; nx * ny];
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let k = j * nx + i;
            let corners = [k, k + 1, k + nx, k + nx + 1];
            labels[k] = corners
                .map(|k| samples[k])
                .into_iter()
                .min()
                .unwrap_or(NOWHERE);
        }
    }
    labels
}

impl GridPressure {
    /// Load centre `[x, y]` in mm of one patch, or of all patches: the mean position weighted with the pressure.
    pub fn load_centre(&self, patch: Option<usize>) -> [f64; 2] {
        if let Some(patch) = patch {
            return self.shapes[patch].load.centre;
        }
        if let [shape] = &self.shapes[..] {
            return shape.load.centre;
        }
        let (mut weight, mut sum) = (0.0, [0.0; 2]);
        for SampledLoad {
            weight: own,
            centre: [x, y],
        } in self.shapes.iter().map(|shape| shape.load)
        {
            weight += own;
            sum = [sum[0] + own * x, sum[1] + own * y];
        }
        sum.map(|sum| sum / weight)
    }

    /// Computes the loads of all patches; called before their edges are found.
    pub(crate) fn find_loads(&mut self) {
        let mut loads = vec![SampledLoad::default(); self.shapes.len()];
        self.each_load(|patch, [x, y], own| {
            let SampledLoad { weight, centre } = &mut loads[patch];
            *weight += own;
            *centre = [centre[0] + own * x, centre[1] + own * y];
        });
        for (shape, SampledLoad { weight, centre }) in self.shapes.iter_mut().zip(loads) {
            shape.load = SampledLoad {
                weight,
                centre: centre.map(|sum| sum / weight),
            };
        }
    }

    /// Mean square distances `[along, across]` in mm² from the load centre of one patch, weighted with the pressure.
    pub fn load_spread(&self, patch: usize) -> [f64; 2] {
        let [x0, y0] = self.load_centre(Some(patch));
        let (mut weight, mut sum) = (0.0, [0.0; 2]);
        self.each_load(|at, [x, y], own| {
            if at == patch {
                weight += own;
                sum = [
                    sum[0] + own * (x - x0) * (x - x0),
                    sum[1] + own * (y - y0) * (y - y0),
                ];
            }
        });
        let spacing = self.spacing();
        // The load of a single row of samples is spread evenly over its width.
        [0, 1].map(|k| (sum[k] / weight).max(spacing[k].powi(2) / 12.0))
    }

    /// Mean distances of samples along x and y in mm.
    fn spacing(&self) -> [f64; 2] {
        let axes = [&self.grid.x, &self.grid.y];
        axes.map(|axis| (axis[axis.len() - 1] - axis[0]) / (axis.len() - 1) as f64)
    }

    /// Passes patch, place and load of every sample to `tell`. Loads are relative to the largest pressure in MPa, times mm².
    fn each_load(&self, mut tell: impl FnMut(usize, [f64; 2], f64)) {
        let share = |axis: &[f64], k: usize| 0.5 * (axis[k + 1] - axis[k - 1]);
        let (x, y) = (&self.grid.x, &self.grid.y);
        let rows = self
            .q
            .chunks_exact(x.len())
            .zip(self.cells.chunks_exact(x.len()));
        for (j, (row, cells)) in rows.enumerate() {
            for (i, (q, cell)) in row.iter().zip(cells).enumerate() {
                // Continued values are not positive, so a positive one is a sample outside the padding.
                if *q > 0.0 {
                    let load = q.sqrt() * share(x, i) * share(y, j);
                    tell(usize::from(*cell), [x[i], y[j]], load);
                }
            }
        }
    }

    /// The pressure with coordinates relative to another origin, in mm.
    #[must_use]
    pub fn from_origin(mut self, origin: [f64; 2]) -> GridPressure {
        self.grid.x.iter_mut().for_each(|x| *x -= origin[0]);
        self.grid.y.iter_mut().for_each(|y| *y -= origin[1]);
        for shape in &mut self.shapes {
            let [x_min, x_max, y_min, y_max] = shape.patch.extent;
            shape.patch.extent = [
                x_min - origin[0],
                x_max - origin[0],
                y_min - origin[1],
                y_max - origin[1],
            ];
            let [x, y] = shape.load.centre;
            shape.load.centre = [x - origin[0], y - origin[1]];
        }
        if origin[1] != 0.0 {
            self.images.clear();
        }
        self
    }
}

/// A patch and the cells it may occupy.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PatchShape {
    pub(crate) patch: Patch,
    pub(crate) columns: RangeInclusive<usize>,
    pub(crate) rows: RangeInclusive<usize>,
    pub(crate) segments_per_strip: f64,
    pub(crate) load: SampledLoad,
}

/// The load of samples: the sum of their pressures, relative to the largest one, times the areas they represent in mm², and their mean position `[x, y]` in mm with
/// these weights.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SampledLoad {
    pub(crate) weight: f64,
    pub(crate) centre: [f64; 2],
}

/// Least number of samples along and across a resolved patch. With fewer, its edge is uncertain and its force is wrong by more than about 2 %: for Hertz's pressure, the
/// sum of the samples is wrong by up to 2 % with 9 samples, and 0.5 % with 18.
const SAMPLES_ACROSS_MIN: usize = 8;

/// The ends of a patch along x, each with its line.
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
    /// Patches before their regions are found, with force, rows and columns of the samples.
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
                        extent: [
                            self.grid.x[i0],
                            self.grid.x[i1],
                            self.grid.y[j0],
                            self.grid.y[j1],
                        ],
                    },
                    // Cells with these samples as corners, plus one cell on every side.
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
        // The length of chords varies as a square root at both ends of the patch, where lines are closer.
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
        for y in self.grid.y.iter().filter(|y| y_min < **y && **y < y_max) {
            let (left, right, _) = ends(*y);
            reach.widen(((middle - y) / half).acos() / step, left, right);
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

    /// Left and right end of a patch on the line at y, and the length of its segments there; infinite ends and 0 without a segment.
    fn ends(&self, label: usize, y: f64) -> (f64, f64, f64) {
        let mut found = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        self.each_segment(label, y, |left, right| {
            found = (found.0.min(left), right, found.2 + (right - left));
        });
        found
    }

    /// Smallest and largest y of lines that meet the patch.
    fn extent_across(&self, shape: &PatchShape, label: usize) -> [f64; 2] {
        let y = &self.grid.y;
        // The outermost samples lie two lines inside the range of cells (see `shapes_from_samples`).
        let [first, last] = [*shape.rows.start(), *shape.rows.end() + 1];
        [(first, first + 2), (last, last - 2)]
            .map(|(outside, inside)| self.end_across(label, [y[outside], y[inside]]))
    }

    /// The last place from `inside` to `outside` at which the line meets the patch.
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

#[cfg(test)]
mod moments_tests {
    use super::*;
    use crate::mesh::Chord;

    fn two_bumps() -> GridPressure {
        let x: Vec<f64> = (-20..=20).map(|k| 0.2 * f64::from(k)).collect();
        let y: Vec<f64> = (-50..=50).map(|k| 0.2 * f64::from(k)).collect();
        let bump = |x: f64, y: f64, y0: f64, size: f64| {
            size * (1.0 - (x - 0.3).powi(2) / 4.0 - (y - y0).powi(2) / 9.0)
                .max(0.0)
                .sqrt()
        };
        let rows: Vec<Vec<f64>> = y
            .iter()
            .map(|y| {
                x.iter()
                    .map(|x| bump(*x, *y, -5.0, 600.0) + bump(*x, *y, 4.0, 300.0))
                    .collect()
            })
            .collect();
        GridPressure::new(&x, &y, &rows).unwrap().0
    }

    fn chord_at(field: &GridPressure, y: f64) -> Chord {
        let mut chords = Vec::new();
        field.add_chords(0, &[(y, 0.1)], 0, &mut chords);
        chords[0]
    }

    #[test]
    fn every_patch_has_its_load_centre_and_all_have_the_weighted_mean() {
        let field = two_bumps();
        let patches = field.patches();
        assert_eq!(patches.len(), 2);
        let centres = [0, 1].map(|k| field.load_centre(Some(k)));
        for (centre, y) in centres.iter().zip([-5.0, 4.0]) {
            assert!(
                (centre[0] - 0.3).abs() < 5e-3 && (centre[1] - y).abs() < 5e-3,
                "{centre:?}"
            );
        }
        let all = field.load_centre(None);
        let force = patches[0].normal_force + patches[1].normal_force;
        let mean = (patches[0].normal_force * centres[0][1]
            + patches[1].normal_force * centres[1][1])
            / force;
        assert!((all[1] - mean).abs() < 1e-9, "{all:?} {mean}");
    }

    /// Of a head of radius 2 with an ear of radius 0.8, whose top is at y = 1.8.
    #[test]
    fn a_line_that_touches_the_edge_of_a_patch_has_no_tiny_chord() {
        let axis: Vec<f64> = (-30..=30).map(|k| 0.1 * f64::from(k)).collect();
        let inside = |x: f64, y: f64| {
            let head = 4.0 - (x - 0.5).powi(2) - y.powi(2);
            let ear = 0.64 - (x + 1.2).powi(2) - (y - 1.0).powi(2);
            head.max(ear).max(0.0)
        };
        let row = |y: &f64| axis.iter().map(|x| inside(*x, *y).sqrt()).collect();
        let rows: Vec<Vec<f64>> = axis.iter().map(row).collect();
        let field = GridPressure::new(&axis, &axis, &rows).unwrap().0;
        let chords = |y: f64| {
            let mut chords = Vec::new();
            field.add_chords(0, &[(y, 0.1)], 0, &mut chords);
            chords
        };
        let (mut one, mut two) = (1.85, 1.72);
        assert_eq!((chords(one).len(), chords(two).len()), (1, 2));
        for _ in 0..60 {
            let middle = 0.5 * (one + two);
            match chords(middle).len() {
                1 => one = middle,
                _ => two = middle,
            }
        }
        let [x_min, x_max, ..] = field.patches()[0].extent;
        for Chord { left, right, .. } in chords(two) {
            assert!(right - left > 1e-3 * (x_max - x_min), "{left} {right}");
        }
    }

    #[test]
    fn moving_changes_coordinates_only() {
        let field = two_bumps();
        let moved = field.clone().from_origin([0.3, -5.0]);
        let centre = moved.load_centre(Some(0));
        assert!(
            centre[0].abs() < 5e-3 && centre[1].abs() < 5e-3,
            "{centre:?}"
        );
        for (before, after) in field.patches().iter().zip(moved.patches()) {
            assert!((after.normal_force / before.normal_force - 1.0).abs() < 1e-12);
            assert!((after.extent[0] - before.extent[0] + 0.3).abs() < 1e-12);
            assert!((after.extent[3] - before.extent[3] - 5.0).abs() < 1e-12);
            assert_eq!(after.area, before.area);
        }
        let (here, there) = (chord_at(&field, -4.2), chord_at(&moved, 0.8));
        assert!((here.left - there.left - 0.3).abs() < 1e-12);
    }
}
