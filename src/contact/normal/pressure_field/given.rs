//! A pressure given on a grid, transferred to strips with its load preserved.
//!
//! The contact is where the interpolated square of the pressure is positive. Squared pressure falls linearly at the edge, so the edge is located to a small fraction of a
//! grid spacing (see `level_set.rs`), and Hertz's pressure is reproduced exactly. The force of a patch is the sum of its samples times the areas they represent; the
//! mesh scales the pressures on its strips to that force.

use crate::mesh::Chord;
use crate::normal::hertz::Patch;
use crate::normal::pressure_field::grid_pressure::{
    GridPressure, PADDING, PATCHES_MAX, SampleGrid, padded,
};
use crate::normal::pressure_field::level_set::{GridLine, State};
use crate::normal::pressure_field::{grid_pressure, level_set};
use crate::numerics::quadrature::{GaussPoints, integral};
use crate::numerics::roots::{interval, weights};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;

/// Number of intervals per chord from which three Gauss points per interval suffice: for Hertz's pressure the error stays below 1e-9 of the mean pressure.
const INTERVALS_MANY: f64 = 24.0;
/// Shortest chord over the length of its patch. A line that only touches an edge has shorter ones, which carry a millionth of the load of a line and whose cells are too
/// small for an operator in single precision.
const CHORD_LEAST: f64 = 1e-3;

/// The samples of the four rows about a line along x.
struct RowsAbout<'a> {
    weights: [f64; 4],
    q: [&'a [f64]; 4],
    /// Smoothness of the two rows next to the line.
    smooth: [&'a [bool]; 2],
}

impl RowsAbout<'_> {
    /// Value at a column.
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
    /// Axes increase strictly and have at least 2 points; pressures are finite and not negative. Returns the pressure and remarks.
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
        field.jump = field.find_jump();
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

    /// The pressure before the regions of its patches are found, and the patch of every sample. `q` is as in [`GridPressure::q`], with 0 outside the contact.
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

            cells,
            pressure_max,
            shapes: Vec::new(),
            images: Vec::new(),
            jump: None,
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

        for label in 0..self.shapes.len() {
            let (extent, area) = self.measure(label, &self.shapes[label]);
            let patch = &mut self.shapes[label].patch;
            (patch.extent, patch.area) = (extent, area);
        }
        self.make_images_alike();
    }

    /// The patches by increasing smallest y of their samples.
    ///
    /// `normal_force` is the sum of the pressures of the samples times the areas they represent, which extend half-way to the neighbouring samples; `area` is that of the
    /// interpolated region, `pressure_max` the largest sample.
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

    /// Appends the chords of one patch on the given strips, each `(y, dy)` with its mid-line at y, with the number `patch`. A strip that misses the patch, or only touches its
    /// edge, has none; one that crosses a hollow or curved patch may have several, by increasing x.
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
                // Rough data may extend slightly farther between the lines that determined the extent.
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

    /// Mean of the interpolated pressure in MPa over `x0 < x < x1` on the line of a chord; 0 outside the chord. For `x0 = x1` the pressure there.
    ///
    /// Gauss–Legendre quadrature of order 10 per grid interval, or 6 with many intervals, in the square root of the distance from the nearer end of the chord, as a function of
    /// which the pressure is smooth; accurate to about 1e-9 for Hertz's pressure.
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

    /// Pressures at points of the line of a chord, given by increasing x; 0 outside the chord.
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

    /// Passes the segments of the line at y that lie in a patch to `tell`, by increasing x.
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
        let t = (y - rows[j]) / (rows[j + 1] - rows[j]);
        let about = self.rows_at(j, weights(rows, j, y));
        let line = GridLine {
            axis: x,
            intervals: shape.columns.clone(),
            value: |i| about.value(i),
            inside: |i| about.q[1][i] > 0.0 && about.q[2][i] > 0.0,
            smooth: |i| self.is_smooth(i, j),
            allowed: |i| self.allowed(label, i, j, t),
        };
        line.each_segment(tell);
    }

    /// The part of cell (i, j) along x that may belong to a patch, on the line at the fraction t of its width.
    ///
    /// A cell with a sample of the patch as a corner belongs to it entirely. Where the edge is smooth and nearly parallel to the grid, the patch may extend slightly beyond
    /// those cells, by an eighth of the squared spacing over the radius; farther outside the interpolation is not reliable.
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
