//! A grid of the normal problem with its pressure.

use crate::contact::normal::gap::conjugate_gradients::PressureAnswer;
use crate::contact::normal::gap::grid::PressureGrid;

/// A grid with its part of the solution: distances and pressures are its own, the rest is common to all grids.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PatchGrid {
    pub(crate) grid: PressureGrid,
    pub(crate) pressed: PressureAnswer,
}

impl PatchGrid {
    /// Load over the area of a cell of 1 mm².
    pub(crate) fn load(&self) -> f64 {
        self.pressed.pressure.iter().sum::<f64>() * self.grid.step[0] * self.grid.step[1]
    }

    pub(crate) fn largest(&self) -> f64 {
        self.pressed.largest()
    }
}

/// How the refinement of the grids of a gap ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GridsExit {
    /// Finer grids no longer change the result.
    Settled,
    /// The result still changes on the finest grid allowed.
    Rough,
    /// The patches need more grids, or more cells, than are allowed.
    CellsUsedUp,
    /// The number of grids that may be tried was used up.
    GridsUsedUp,
}

impl GridsExit {
    /// Is the result that of the gap, rather than of the grid?
    pub(crate) fn settled(self) -> bool {
        self == GridsExit::Settled
    }
}

/// Pressures on the last grids.
pub(crate) struct GapOutcome {
    /// The grids with their pressures: one, or one per patch.
    pub(crate) patch_grids: Vec<PatchGrid>,
    /// Iterations over all grids.
    pub(crate) iterations: u32,
    /// How the refinement of the grids ended.
    pub(crate) exit: GridsExit,
    /// See [`NormalWork`](crate::contact::normal::gap::answer::NormalWork).
    pub(crate) pressure_change: f64,
    /// The least gap in mm.
    pub(crate) least: f64,
}
