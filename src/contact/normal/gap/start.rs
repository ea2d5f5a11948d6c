//! Solved grids from which nearly the same gap is solved: that of the same wheel at another height.

use crate::contact::normal::gap::conjugate_gradients::PressureAnswer;
use crate::contact::normal::gap::grid::PressureGrid;
use crate::contact::normal::gap::patch_grid::PatchGrid;

/// Solved grids, one or one per patch, with coordinates from the load centre.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GapStart {
    patch_grids: Vec<PatchGrid>,
    /// Deepest overlap of the undeformed surfaces in mm.
    depth: f64,
}

impl GapStart {
    /// The start that a solution leaves whose load centre is given in mm.
    pub(crate) fn new(patch_grids: Vec<PatchGrid>, depth: f64, centre: [f64; 2]) -> GapStart {
        let from_centre = |PatchGrid { grid, pressed }| {
            let grid = PressureGrid::placed(&grid, 1.0, centre.map(|at| -at));
            PatchGrid { grid, pressed }
        };
        GapStart {
            patch_grids: patch_grids.into_iter().map(from_centre).collect(),
            depth,
        }
    }

    /// The grids with their load centre at a place in mm, and another deepest overlap: pressures grow with its square root, and so do the lengths
    /// of a single grid, as Hertz's do. Several patches stay where they are.
    pub(crate) fn at(&self, centre: [f64; 2], depth: f64) -> Vec<PatchGrid> {
        let size = (depth / self.depth).sqrt();
        let times = |values: &[f64], factor: f64| values.iter().map(|v| factor * v).collect();
        let lengths = if self.patch_grids.len() == 1 {
            size
        } else {
            1.0
        };
        let there = |PatchGrid { grid, pressed }: &PatchGrid| PatchGrid {
            grid: grid.placed(lengths, centre),
            pressed: PressureAnswer {
                pressure: times(&pressed.pressure, size),
                distance: times(&pressed.distance, size * size),
                approach: depth,
                ..*pressed
            },
        };
        self.patch_grids.iter().map(there).collect()
    }
}
