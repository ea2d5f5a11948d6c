//! The pressure of a whole contact, on one grid or on a grid per patch; and fields of computed pressures with their mirror symmetry.

use crate::mesh::Chord;
use crate::normal::hertz::Patch;
use crate::normal::pressure_field::grid_pressure::{
    GridPressure, Jump, NOWHERE, PADDING, PATCHES_MAX, SampleGrid, padded,
};
use crate::remark::entry::RemarkEntry;

/// Pressures on one grid or several, and the patches they form.
#[derive(Debug, Clone, PartialEq)]
pub struct PressureField {
    grids: Vec<GridPressure>,
    /// The grid of every patch, by increasing smallest y, and its number on that grid.
    places: Vec<[usize; 2]>,
}

impl PressureField {
    /// Finds the patches of a pressure; `pressure[j][i]` in MPa belongs to `(x[i], y[j])` in mm.
    ///
    /// Axes increase strictly and have at least 2 points; pressures are finite and not negative. Returns the field and remarks.
    ///
    /// # Errors
    /// A sentence, if no pressure is positive or there are more than 64 patches.
    pub fn new(
        x: &[f64],
        y: &[f64],
        pressure: &[Vec<f64>],
    ) -> Result<(PressureField, Vec<RemarkEntry>), String> {
        let (grid, remarks) = GridPressure::new(x, y, pressure)?;
        Ok((PressureField::of_grids(vec![grid])?, remarks))
    }

    /// The field of pressures on grids that do not overlap.
    ///
    /// # Errors
    /// A sentence, if there are more than 64 patches.
    pub fn of_grids(grids: Vec<GridPressure>) -> Result<PressureField, String> {
        let mut places: Vec<[usize; 2]> = (0..grids.len())
            .flat_map(|g| (0..grids[g].patches().len()).map(move |k| [g, k]))
            .collect();
        if places.len() > PATCHES_MAX {
            return Err(format!(
                "{} separate patches found; at most {PATCHES_MAX} are allowed",
                places.len()
            ));
        }
        if grids.len() > 1 {
            let low = |[g, k]: &[usize; 2]| grids[*g].patches()[*k].extent[2];
            places.sort_by(|a, b| low(a).total_cmp(&low(b)));
        }
        Ok(PressureField { grids, places })
    }

    /// The patches by increasing smallest y.
    pub fn patches(&self) -> Vec<Patch> {
        let patches: Vec<Vec<Patch>> = self.grids.iter().map(GridPressure::patches).collect();
        self.places.iter().map(|[g, k]| patches[*g][*k]).collect()
    }

    /// The patch whose extent contains the point `[x, y]` in mm, if there is one.
    pub fn patch_at(&self, [x, y]: [f64; 2]) -> Option<usize> {
        self.patches().iter().position(|patch| {
            let [x_min, x_max, y_min, y_max] = patch.extent;
            (x_min..=x_max).contains(&x) && (y_min..=y_max).contains(&y)
        })
    }

    /// Number of grid spacings across each patch, along the axis with fewer.
    pub fn cells_across(&self) -> Vec<f64> {
        let cells: Vec<Vec<f64>> = self.grids.iter().map(GridPressure::cells_across).collect();
        self.places.iter().map(|[g, k]| cells[*g][*k]).collect()
    }

    /// The largest jump of a given pressure, if it has any.
    pub fn jump(&self) -> Option<Jump> {
        self.grids.iter().find_map(GridPressure::jump)
    }

    /// Average number of segments per strip, for each patch.
    pub fn segments_per_strip(&self) -> Vec<f64> {
        let segments: Vec<Vec<f64>> = self
            .grids
            .iter()
            .map(GridPressure::segments_per_strip)
            .collect();
        self.places.iter().map(|[g, k]| segments[*g][*k]).collect()
    }

    /// Chords of one patch on the given strips, each `(y, dy)` with its mid-line at y. A strip that misses the patch has none; one that crosses a hollow or curved patch may
    /// have several, by increasing x.
    pub fn chords(&self, patch: usize, strips: &[(f64, f64)]) -> Vec<Chord> {
        let mut chords = Vec::new();
        self.add_chords(patch, strips, &mut chords);
        chords
    }

    /// Appends chords to a buffer; see [`PressureField::chords`].
    pub fn add_chords(&self, patch: usize, strips: &[(f64, f64)], chords: &mut Vec<Chord>) {
        let [grid, label] = self.places[patch];
        self.grids[grid].add_chords(label, strips, patch, chords);
    }

    /// Mean of the interpolated pressure in MPa over `x0 < x < x1` on the line of a chord; 0 outside the chord. For
    /// `x0 = x1` the pressure there. See [`GridPressure::mean_pressure`].
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        let [grid, _] = self.places[chord.patch];
        self.grids[grid].mean_pressure(chord, x0, x1)
    }

    /// Pressures in MPa at points of the line of a chord, given by increasing x; 0 outside the chord.
    pub fn pressures<const N: usize>(&self, chord: &Chord, places: [f64; N]) -> [f64; N] {
        let [grid, _] = self.places[chord.patch];
        self.grids[grid].pressures(chord, places)
    }

    /// Load centre `[x, y]` in mm of one patch, or of all patches: the mean position weighted with the pressure.
    pub fn load_centre(&self, patch: Option<usize>) -> [f64; 2] {
        if let Some(patch) = patch {
            let [grid, label] = self.places[patch];
            return self.grids[grid].load_centre(Some(label));
        }
        if let [grid] = &self.grids[..] {
            return grid.load_centre(None);
        }
        let (mut weight, mut sum) = (0.0, [0.0; 2]);
        for (patch, known) in self.patches().iter().enumerate() {
            let at = self.load_centre(Some(patch));
            weight += known.normal_force;
            sum = [0, 1].map(|k| sum[k] + known.normal_force * at[k]);
        }
        sum.map(|sum| sum / weight)
    }

    /// Mean square distances `[along, across]` in mm² from the load centre of one patch, weighted with the pressure.
    pub fn load_spread(&self, patch: usize) -> [f64; 2] {
        let [grid, label] = self.places[patch];
        self.grids[grid].load_spread(label)
    }

    /// The pressure with coordinates relative to another origin, in mm.
    #[must_use]
    pub fn from_origin(mut self, origin: [f64; 2]) -> PressureField {
        let grids = self.grids.into_iter();
        self.grids = grids.map(|grid| grid.from_origin(origin)).collect();
        self
    }
}

impl GridPressure {
    /// The field of a pressure computed on equal cells with the centres `(x[i], y[j])` in mm, stored at
    /// `j * x.len() + i`.
    ///
    /// `squares` are the squared pressures in MPa², continued such that the edge is where they vanish; they are not positive at centres outside the edge. `pressure` are
    /// the computed pressures in MPa, which give the forces of the patches.
    ///
    /// # Errors
    /// A sentence, if there are more than 64 patches, or none.
    pub fn of_solution(
        x: &[f64],
        y: &[f64],
        squares: &[f64],
        pressure: &[f64],
        approach: f64,
    ) -> Result<GridPressure, String> {
        let mut field = GridPressure::of_samples(x, y, squares, pressure, approach)?;
        field.find_edges();
        Ok(field)
    }

    /// The field before its edges are found. It has forces, load centres and spreads, its patches end at their outermost samples, and it gives no pressures between
    /// samples.
    ///
    /// # Errors
    /// See [`of_solution`](Self::of_solution).
    pub(crate) fn of_samples(
        x: &[f64],
        y: &[f64],
        squares: &[f64],
        pressure: &[f64],
        approach: f64,
    ) -> Result<GridPressure, String> {
        let grid = SampleGrid {
            x: padded(x),
            y: padded(y),
        };
        let largest = squares.iter().copied().fold(0.0, f64::max);
        if largest <= 0.0 {
            return Err("the contact is smaller than a cell of the grid".to_owned());
        }
        let width = grid.x.len();
        let inner = |k: usize| (k / x.len() + PADDING) * width + k % x.len() + PADDING;
        let mut q = vec![0.0; width * grid.y.len()];
        for (k, square) in squares.iter().enumerate() {
            q[inner(k)] = (square / largest).max(0.0);
        }
        let (mut field, samples) = GridPressure::from_squares(grid, q, largest.sqrt())?;
        let cell = (x[1] - x[0]) * (y[1] - y[0]);
        let mut forces = vec![0.0; field.shapes.len()];
        let mut peaks = vec![0.0_f64; field.shapes.len()];
        let mut total = 0.0;
        for (k, p) in pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            total += p * cell;
            if let Some(label) = nearest_label(&samples, width, inner(k)) {
                forces[label] += p * cell;
                peaks[label] = peaks[label].max(*p);
            }
        }
        let scale = total / forces.iter().sum::<f64>();
        for (shape, (force, peak)) in field.shapes.iter_mut().zip(forces.iter().zip(peaks)) {
            shape.patch.normal_force = scale * force;
            shape.patch.pressure_max = peak;
            shape.patch.approach = Some(approach);
        }
        Ok(field)
    }

    /// Finds the mirror image of every patch about y = 0, if every sample has a mirror image.
    pub(crate) fn find_images(&self, samples: &[u8]) -> Vec<usize> {
        let width = self.grid.x.len();
        let rows = self.grid.y.len();
        let axis = self.grid.y.iter();
        let image = |k: usize| (rows - 1 - k / width) * width + k % width;
        let mirrored = axis.clone().zip(axis.rev()).all(|(a, b)| *a == -b)
            && (0..self.q.len() / 2).all(|k| self.q[k] == self.q[image(k)]);
        if !mirrored {
            return Vec::new();
        }
        let mut images = vec![0; self.shapes.len()];
        for k in (0..samples.len()).filter(|k| samples[*k] != NOWHERE) {
            images[usize::from(samples[k])] = usize::from(samples[image(k)]);
        }
        images
    }

    /// Makes the values of mirror images equal to the last digit.
    pub(crate) fn make_images_alike(&mut self) {
        for label in 0..self.images.len() {
            let image = self.images[label];
            if image < label {
                continue;
            }
            let mut patch = self.shapes[label].patch;
            let [x_min, x_max, y_min, y_max] = patch.extent;
            if image == label {
                patch.extent = [x_min, x_max, -y_max, y_max];
                self.shapes[label].patch = patch;
            } else {
                patch.extent = [x_min, x_max, -y_max, -y_min];
                self.shapes[image].patch = patch;
            }
        }
    }
}

/// The patch of a sample, or of a neighbour if the sample belongs to none.
fn nearest_label(samples: &[u8], width: usize, k: usize) -> Option<usize> {
    let neighbours = [
        k,
        k - 1,
        k + 1,
        k - width,
        k + width,
        k - width - 1,
        k - width + 1,
        k + width - 1,
        k + width + 1,
    ];
    let found = neighbours.into_iter().find(|k| samples[*k] != NOWHERE)?;
    Some(usize::from(samples[found]))
}
