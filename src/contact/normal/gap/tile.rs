//! A grid of the normal problem with its pressure.

use crate::contact::normal::gap::conjugate_gradients::Pressed;
use crate::contact::normal::gap::grid::PressureGrid;

/// A grid with its part of the solution: distances and pressures are its own, the rest is common to all tiles.
#[derive(Debug, Clone)]
pub(crate) struct Tile {
    pub(crate) grid: PressureGrid,
    pub(crate) pressed: Pressed,
}

impl Tile {
    /// Load over the area of a cell of 1 mm².
    pub(crate) fn load(&self) -> f64 {
        self.pressed.pressure.iter().sum::<f64>() * self.grid.step[0] * self.grid.step[1]
    }

    pub(crate) fn largest(&self) -> f64 {
        self.pressed.largest()
    }
}

/// Pressures on the last grids.
pub(crate) struct GapOutcome {
    /// The grids with their pressures: one, or one per patch.
    pub(crate) tiles: Vec<Tile>,
    /// Iterations over all grids.
    pub(crate) iterations: u32,
    /// Finer grids no longer change the result.
    pub(crate) settled: bool,
    /// See [`NormalWork`](crate::contact::normal::answer::NormalWork).
    pub(crate) pressure_change: f64,
    /// The least gap in mm.
    pub(crate) least: f64,
}
