//! How well samples resolve a pressure: spacings across a patch, and discontinuities between samples.

use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::pressure_field::jump::Jump;
use crate::contact::normal::pressure_field::sample_grid::PADDING;

/// A jump is a fall of the squared pressure over one interval that exceeds the extrapolation from the interval before by this, relative
/// to the largest squared pressure. At an edge of Hertz's kind the excess is 0; powers of a lens from 0.5 to 1.5 reach 0.21 on 12
/// samples a side, a hole 0.9.
const JUMP: f64 = 0.35;

impl GridPressure {
    /// Number of grid spacings across each patch, along the axis with fewer.
    #[must_use]
    pub fn cells_across(&self) -> Vec<f64> {
        let axes = [&self.grid.x, &self.grid.y];
        let spacing = axes.map(|axis| (axis[axis.len() - 1] - axis[0]) / (axis.len() - 1) as f64);
        let across = |extent: [f64; 4]| {
            let along = [0, 1].map(|k| (extent[2 * k + 1] - extent[2 * k]) / spacing[k]);
            along[0].min(along[1])
        };
        self.patches()
            .iter()
            .map(|patch| across(patch.extent))
            .collect()
    }

    /// The largest excess fall between neighbouring samples (see [`JUMP`]), and the jump there if it is one. To be called before
    /// edges are found, while squared pressures are 0 outside the contact.
    pub(crate) fn find_jump(&self) -> (f64, Option<Jump>) {
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
                    // The value extrapolated from the two samples before, less the sample itself.
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
        (discontinuity, jump.filter(|_| discontinuity > JUMP))
    }

    /// The largest jump of the pressure, if it has any.
    #[must_use]
    pub fn jump(&self) -> Option<Jump> {
        self.jump
    }

    /// The largest fall of the squared pressure over one interval beyond that extrapolated from the interval before, relative to the
    /// largest squared pressure: up to 0.2 for smooth pressures.
    #[must_use]
    pub fn discontinuity(&self) -> f64 {
        self.discontinuity
    }
}
