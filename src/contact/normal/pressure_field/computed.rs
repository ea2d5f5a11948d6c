//! Fields from pressures computed on equal cells, and their mirror symmetry about y = 0.

use crate::contact::normal::pressure_field::grid_pressure::{
    GridPressure, NOWHERE, PADDING, SampleGrid, padded,
};

impl GridPressure {
    /// The field of a pressure computed on equal cells with the centres `(x[i], y[j])` in mm, stored at
    /// `j * x.len() + i`.
    ///
    /// `squares` are the squared pressures in MPa², continued so that the edge is where they vanish (not positive at centres
    /// outside the edge). `pressure` are the computed pressures in MPa, from which the forces of the patches are taken.
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
        field.find_edges();
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
