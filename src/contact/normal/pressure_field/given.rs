//! A pressure given on a grid, transferred to strips with its load preserved.
//!
//! The contact is where the interpolated square of the pressure is positive. Squared pressure falls linearly at the
//! edge, so that the edge is located to a small fraction of a grid spacing (see `level_set.rs`), and Hertz's pressure is
//! reproduced exactly. The force of a patch is the sum of its samples times the areas they represent; the mesh scales the
//! pressures on its strips to carry that force.

use std::ops::RangeInclusive;

use crate::mesh::Chord;
use crate::normal::hertz::Patch;
use crate::normal::pressure_field::grid_pressure::{
    GridPressure, NOWHERE, PADDING, PATCHES_MAX, PatchShape, SampleGrid, padded,
};
use crate::normal::pressure_field::level_set::{GridLine, State};
use crate::normal::pressure_field::{grid_pressure, level_set};
use crate::numerics::quadrature::{GaussPoints, integral};
use crate::numerics::roots::{interval, weights};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// With at least this many intervals per chord, three Gauss points per interval are enough: the error stays below 1e-9 of the mean
/// pressure for Hertz's pressure.
const INTERVALS_MANY: f64 = 24.0;
/// Shortest chord over the length of its patch. A line that only touches an edge has shorter ones. They carry a millionth of the load of a line, and their
/// cells are too small for an operator in single precision.
const CHORD_LEAST: f64 = 1e-3;

/// The samples of the four rows about a line along x.
struct RowsAbout<'a> {
    weights: [f64; 4],
    q: [&'a [f64]; 4],
    /// Of the two beside the line.
    smooth: [&'a [bool]; 2],
}

impl RowsAbout<'_> {
    /// Value on a column.
    fn value(&self, column: usize) -> f64 {
        let q = self.q.map(|row| row[column]);
        let [a, b, c, d] = self.weights;
        let value = a * q[0] + b * q[1] + c * q[2] + d * q[3];
        let smooth = self.smooth[0][column] && self.smooth[1][column];
        let [low, high] = level_set::bounds(q[1], q[2], smooth);
        value.clamp(low, high)
    }
}

impl GridPressure {
    /// Finds the patches of a pressure; `pressure[j][i]` in MPa belongs to `(x[i], y[j])` in mm.
    ///
    /// Axes increase strictly and have at least 2 points; pressures are finite and not negative. Returns the field and
    /// remarks for the answer.
    ///
    /// # Errors
    /// A sentence, if no pressure is positive or there are more than 64 patches.
    pub fn new(
        x: &[f64],
        y: &[f64],
        pressure: &[Vec<f64>],
    ) -> Result<(GridPressure, Vec<RemarkEntry>), String> {
        let pressure_max = pressure.iter().flatten().copied().fold(0.0, f64::max);
        let grid = SampleGrid {
            x: padded(x),
            y: padded(y),
        };
        let mut q = vec![0.0; grid.x.len() * grid.y.len()];
        for (j, row) in pressure.iter().enumerate() {
            for (i, p) in row.iter().enumerate() {
                q[(j + PADDING) * grid.x.len() + i + PADDING] = (p / pressure_max).powi(2);
            }
        }
        if !q.iter().any(|q| *q > 0.0) {
            return Err(
                "no pressure above 0 given; at least one is needed for a contact".to_owned(),
            );
        }
        let (mut field, samples) = GridPressure::from_squares(grid, q, pressure_max)?;
        let mut remarks = field.remarks(&samples, &field.shapes);
        (field.discontinuity, field.jump) = field.find_jump();
        if let Some(jump) = field.jump {
            let remark = Remark::PressureJumps {
                x_mm: jump.at[0],
                y_mm: jump.at[1],
                share_of_largest: jump.fall,
            };
            remarks.push(remark.into());
        }
        field.find_edges();
        Ok((field, remarks))
    }

    /// The field before the regions of its patches are found, and the patch of every sample. `q` is as in [`GridPressure::q`],
    /// with 0 outside the contact.
    pub(crate) fn from_squares(
        grid: SampleGrid,
        q: Vec<f64>,
        pressure_max: f64,
    ) -> Result<(GridPressure, Vec<u8>), String> {
        let (samples, count) = grid_pressure::label_samples(&grid, &q).map_err(|count| {
            format!("{count} separate patches found; at most {PATCHES_MAX} are allowed")
        })?;
        let cells = grid_pressure::label_cells(&grid, &samples);
        let mut field = GridPressure {
            grid,
            q,
            smooth: Vec::new(),
            runs: Vec::new(),
            spans: Vec::new(),
            cells,
            pressure_max,
            shapes: Vec::new(),
            images: Vec::new(),
            jump: None,
            discontinuity: 0.0,
        };
        field.shapes = field.shapes_from_samples(&samples, count);
        field.find_loads();
        field.images = field.find_images(&samples);
        Ok((field, samples))
    }

    /// Continues the squared pressures beyond the contact and measures the region of every patch.
    pub(crate) fn find_edges(&mut self) {
        let states = level_set::extend(&self.grid, &mut self.q);
        self.smooth = states
            .into_iter()
            .map(|state| state == State::Smooth)
            .collect();
        let run = |row: &[f64]| {
            let first = row.iter().position(|q| *q > 0.0)?;
            let last = row.iter().rposition(|q| *q > 0.0)?;
            let single = row[first..=last].iter().all(|q| *q > 0.0);
            single.then_some([first, last])
        };
        self.runs = self.q.chunks_exact(self.grid.x.len()).map(run).collect();
        let span = |row: &[u8]| {
            let first = row.iter().position(|label| *label != NOWHERE)?;
            Some([first, row.iter().rposition(|label| *label != NOWHERE)?])
        };
        self.spans = self
            .cells
            .chunks_exact(self.grid.x.len())
            .map(span)
            .collect();
        for label in 0..self.shapes.len() {
            let (extent, area) = self.measure(label, &self.shapes[label]);
            let patch = &mut self.shapes[label].patch;
            (patch.extent, patch.area) = (extent, area);
        }
        self.make_images_alike();
    }

    /// The patches found, in order of the smallest y of their samples.
    ///
    /// `normal_force` is the sum of the samples' pressures times the areas they represent, which extend half-way to the
    /// neighbouring samples; `area` is that of the interpolated region, `pressure_max` the largest sample.
    pub fn patches(&self) -> Vec<Patch> {
        self.shapes.iter().map(|shape| shape.patch).collect()
    }

    /// Average number of segments per strip, for each patch.
    pub fn segments_per_strip(&self) -> Vec<f64> {
        self.shapes
            .iter()
            .map(|shape| shape.segments_per_strip)
            .collect()
    }

    /// Adds the chords of one patch on the given strips, each `(y, dy)` with its mid-line at y; they get the number `patch`. A strip that misses
    /// the patch, or only touches its edge, has none; one that crosses a hollow or curved patch may have several, in order of x.
    pub fn add_chords(
        &self,
        label: usize,
        strips: &[(f64, f64)],
        patch: usize,
        chords: &mut Vec<Chord>,
    ) {
        let [x_min, x_max, ..] = self.shapes[label].patch.extent;
        for (strip, &(y, dy)) in strips.iter().enumerate() {
            self.each_segment(label, y, |left, right| {
                // Rough data may extend slightly farther between the lines from which the extent was measured.
                let (left, right) = (left.max(x_min), right.min(x_max));
                if right - left > CHORD_LEAST * (x_max - x_min) {
                    chords.push(Chord {
                        patch,
                        strip,
                        y,
                        dy,
                        left,
                        right,
                    });
                }
            });
        }
    }

    /// The rows about the line of a chord.
    fn rows_about(&self, chord: &Chord) -> RowsAbout<'_> {
        let y = if self.images.is_empty() {
            chord.y
        } else {
            chord.y.abs()
        };
        let j = self.row_interval(y);
        self.rows_at(j, weights(&self.grid.y, j, y))
    }

    /// The rows about a line between the rows j and j + 1.
    fn rows_at(&self, j: usize, weights: [f64; 4]) -> RowsAbout<'_> {
        let nx = self.grid.x.len();
        let row = |j: usize| j * nx..(j + 1) * nx;
        RowsAbout {
            weights,
            q: [j - 1, j, j + 1, j + 2].map(|j| &self.q[row(j)]),
            smooth: [j, j + 1].map(|j| &self.smooth[row(j)]),
        }
    }

    /// Mean of the interpolated pressure in MPa over `x0 < x < x1` on the line of a chord; 0 outside the chord. For
    /// `x0 = x1` the pressure there.
    ///
    /// Gauss–Legendre quadrature of order 10 per grid interval (6 where there are many intervals), with the square root of the
    /// distance from the nearer end of the chord as variable, in which the pressure is smooth; accurate to about 1e-9 for Hertz's
    /// pressure.
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        let (low, high) = (x0.max(chord.left), x1.min(chord.right));
        if low > high {
            return 0.0;
        }
        let x = &self.grid.x;
        let rows = self.rows_about(chord);
        let (first, last) = (self.column_interval(low), self.column_interval(high));
        let value = |i: usize| rows.value(i);
        let mut values: [f64; 4] = std::array::from_fn(|k| value(first - 1 + k));
        if x0 == x1 {
            let cubic = level_set::cubic(x, first, values);
            return self.pressure_max * cubic.at(low).sqrt();
        }
        let centre = 0.5 * (chord.right + chord.left);
        let points = |from: f64, to: f64| {
            if (to - from) * INTERVALS_MANY < chord.right - chord.left {
                GaussPoints::Three
            } else {
                GaussPoints::Five
            }
        };
        let mut sum = 0.0;
        for i in first..=last {
            if i > first {
                values = [values[1], values[2], values[3], value(i + 2)];
            }
            let cubic = level_set::cubic(x, i, values);
            let (from, to) = (low.max(x[i]), high.min(x[i + 1]));
            let pressure = |x: f64| cubic.at(x).sqrt();
            if from < centre.min(to) {
                let s = [from, centre.min(to)].map(|x| (x - chord.left).max(0.0).sqrt());
                sum += integral(s, points(from, to), |s| {
                    2.0 * s * pressure(chord.left + s * s)
                });
            }
            if to > centre.max(from) {
                let s = [to, centre.max(from)].map(|x| (chord.right - x).max(0.0).sqrt());
                sum += integral(s, points(from, to), |s| {
                    2.0 * s * pressure(chord.right - s * s)
                });
            }
        }
        self.pressure_max * sum / (x1 - x0)
    }

    /// Pressures at points of the line of a chord, given by x in rising order; 0 outside the chord.
    pub fn pressures<const N: usize>(&self, chord: &Chord, places: [f64; N]) -> [f64; N] {
        let x = &self.grid.x;
        let rows = self.rows_about(chord);
        let value = |column: usize| rows.value(column);
        let last = x.len() - 3;
        let mut i = self.column_interval(places[0].max(chord.left));
        let mut values: [f64; 4] = std::array::from_fn(|k| value(i - 1 + k));
        let mut cubic = level_set::cubic(x, i, values);
        places.map(|place| {
            if place < chord.left || place > chord.right {
                return 0.0;
            }
            let before = i;
            while i < last && x[i + 1] <= place {
                i += 1;
                values = [values[1], values[2], values[3], value(i + 2)];
            }
            if i != before {
                cubic = level_set::cubic(x, i, values);
            }
            self.pressure_max * cubic.at(place).sqrt()
        })
    }

    /// Tells the segments of the line at y that lie in a patch, from smaller to larger x.
    pub(crate) fn each_segment(&self, label: usize, y: f64, tell: impl FnMut(f64, f64)) {
        let (label, y) = match self.images.get(label) {
            Some(image) if y < 0.0 => (*image, -y),
            _ => (label, y),
        };
        let shape = &self.shapes[label];
        let SampleGrid { x, y: rows } = &self.grid;
        let j = interval(rows, y);
        if rows[j] > y || rows[j + 1] < y || !shape.rows.contains(&j) {
            return;
        }
        let Some(columns) = self.near_row(shape, j) else {
            return;
        };
        let t = (y - rows[j]) / (rows[j + 1] - rows[j]);
        let about = self.rows_at(j, weights(rows, j, y));
        let line = GridLine {
            axis: x,
            intervals: columns,
            whole: self.whole(label, j),
            value: |i| about.value(i),
            inside: |i| about.q[1][i] > 0.0 && about.q[2][i] > 0.0,
            smooth: |i| self.is_smooth(i, j),
            allowed: |i| self.allowed(label, i, j, t),
        };
        line.each_segment(tell);
    }

    /// The columns of row j that may hold a part of a patch: those of its cells, and one beside them ([`GridPressure::allowed`]).
    fn near_row(&self, shape: &PatchShape, j: usize) -> Option<RangeInclusive<usize>> {
        let Some(near) = self.spans.get(j - 1..=j + 1) else {
            return Some(shape.columns.clone());
        };
        let widened = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let [first, last] = near.iter().flatten().copied().reduce(widened)?;
        let [from, to] = [*shape.columns.start(), *shape.columns.end()];
        Some(from.max(first - 1)..=to.min(last + 1))
    }

    /// The columns between which a patch has all samples of row j and the next one, where each of the two has one run of positive samples.
    fn whole(&self, label: usize, j: usize) -> Option<[usize; 2]> {
        let [one, other] = [*self.runs.get(j)?, *self.runs.get(j + 1)?];
        let [first, last] = [one?, other?]
            .into_iter()
            .reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])])?;
        let own = usize::from(self.cells[j * self.grid.x.len() + first]) == label;
        (own && first < last).then_some([first, last])
    }

    /// The part of cell (i, j) along x that may belong to a patch, on the line at the fraction t of its width.
    ///
    /// A cell with a sample of the patch as a corner belongs to it as a whole. Where the edge is smooth and nearly parallel to the
    /// grid it may extend slightly beyond those cells (by an eighth of the squared spacing over the radius); farther out the
    /// interpolation is not reliable.
    fn allowed(&self, label: usize, i: usize, j: usize, t: f64) -> [f64; 2] {
        const BULGE: f64 = 0.125;
        let nx = self.grid.x.len();
        let cell = j * nx + i;
        let touches = |cell: usize| usize::from(self.cells[cell]) == label;
        if touches(cell) {
            return [0.0, 1.0];
        }
        if !self.is_smooth(i, j) {
            return [0.0, 0.0];
        }
        if (touches(cell - nx) && t <= BULGE) || (touches(cell + nx) && t >= 1.0 - BULGE) {
            return [0.0, 1.0];
        }
        match (touches(cell - 1), touches(cell + 1)) {
            (true, false) => [0.0, BULGE],
            (false, true) => [1.0 - BULGE, 1.0],
            _ => [0.0, 0.0],
        }
    }

    /// Whether the four corners of cell (i, j) are smooth.
    fn is_smooth(&self, i: usize, j: usize) -> bool {
        let nx = self.grid.x.len();
        let k = j * nx + i;
        [k, k + 1, k + nx, k + nx + 1]
            .iter()
            .all(|k| self.smooth[*k])
    }

    fn row_interval(&self, y: f64) -> usize {
        interval(&self.grid.y, y).clamp(1, self.grid.y.len() - 3)
    }

    fn column_interval(&self, x: f64) -> usize {
        interval(&self.grid.x, x).clamp(1, self.grid.x.len() - 3)
    }
}
