//! A solved grid from which nearly the same gap is solved: that of the same wheel at another height.

use crate::contact::normal::gap::conjugate_gradients::PressureAnswer;
use crate::contact::normal::gap::tile::Tile;

/// A solved grid, with coordinates from the load centre.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GapStart {
    tile: Tile,
    /// Deepest overlap of the undeformed surfaces in mm.
    depth: f64,
}

impl GapStart {
    /// The start that a solution leaves whose load centre is given in mm.
    pub(crate) fn new(tile: Tile, depth: f64, centre: [f64; 2]) -> GapStart {
        let Tile { grid, pressed } = tile;
        let grid = grid.placed(1.0, centre.map(|at| -at));
        GapStart {
            tile: Tile { grid, pressed },
            depth,
        }
    }

    /// The grid with its load centre at a place in mm, and another deepest overlap: lengths and pressures grow with its square root, as
    /// Hertz's do.
    pub(crate) fn at(&self, centre: [f64; 2], depth: f64) -> Tile {
        let size = (depth / self.depth).sqrt();
        let Tile { grid, pressed } = &self.tile;
        let times = |values: &[f64], factor: f64| values.iter().map(|v| factor * v).collect();
        Tile {
            grid: grid.placed(size, centre),
            pressed: PressureAnswer {
                pressure: times(&pressed.pressure, size),
                distance: times(&pressed.distance, size * size),
                approach: depth,
                ..*pressed
            },
        }
    }
}
