//! The load centre of a pressure, and the same pressure moved or corrected.

use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::pressure_field::patch_cells::SampledLoad;

impl GridPressure {
    /// Load centre `[x, y]` in mm of one patch, or of all of them: the mean position weighted with the pressure.
    #[must_use]
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

    /// Finds the loads of all patches, before their edges are placed.
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
    #[must_use]
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
        sum.map(|sum| sum / weight)
    }

    /// Tells patch, place and load of every sample; loads are relative to the largest pressure in MPa, times mm².
    fn each_load(&self, mut tell: impl FnMut(usize, [f64; 2], f64)) {
        let share = |axis: &[f64], k: usize| 0.5 * (axis[k + 1] - axis[k - 1]);
        let (x, y) = (&self.grid.x, &self.grid.y);
        let rows = self
            .q
            .chunks_exact(x.len())
            .zip(self.cells.chunks_exact(x.len()));
        for (j, (row, cells)) in rows.enumerate() {
            for (i, (q, cell)) in row.iter().zip(cells).enumerate() {
                // Values continued outside the contact are not positive, so a positive one is a sample and not in the padding.
                if *q > 0.0 {
                    let load = q.sqrt() * share(x, i) * share(y, j);
                    tell(usize::from(*cell), [x[i], y[j]], load);
                }
            }
        }
    }

    /// The same pressure with coordinates relative to another origin, in mm.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mesh::strips::Chord;

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
