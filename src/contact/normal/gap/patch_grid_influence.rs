//! The influence of several grids on each other, as one operator over all their cells.

use std::ops::Range;

use crate::contact::half_space::grid_operator::{GridOperator, GridWorkspace};
use crate::contact::normal::gap::cell_sums::{CellWeights, LANES};
use crate::contact::normal::gap::conjugate_gradients::PressureInfluence;
use crate::contact::normal::gap::coupling::Coupling;
use crate::contact::normal::gap::grid::PressureGrid;

/// The influence of all grids on all.
pub(crate) struct TilesInfluence {
    /// Cells of every grid.
    pub(crate) ranges: Vec<Range<usize>>,
    own: Vec<GridOperator<f32>>,
    /// Grid acted on, grid that acts.
    couplings: Vec<(usize, usize, Coupling)>,
    /// Cell by cell, relative to the first cell.
    area: Vec<f64>,
    yielding: Vec<f64>,
}

impl TilesInfluence {
    pub(crate) fn new(
        grids: &[PressureGrid],
        contact_modulus: f64,
        workspace: &mut GridWorkspace<f32>,
    ) -> TilesInfluence {
        let own: Vec<GridOperator<f32>> = grids
            .iter()
            .map(|grid| grid.influence(contact_modulus, workspace))
            .collect();
        let (mut ranges, mut area, mut yielding) = (Vec::new(), Vec::new(), Vec::new());
        let first = grids[0].step[0] * grids[0].step[1];
        for (grid, operator) in grids.iter().zip(&own) {
            let count = grid.cells[0] * grid.cells[1];
            ranges.push(area.len()..area.len() + count);
            area.resize(area.len() + count, grid.step[0] * grid.step[1] / first);
            yielding.resize(yielding.len() + count, own[0].own() / operator.own());
        }
        let pairs = (0..grids.len()).flat_map(|to| (0..grids.len()).map(move |from| (to, from)));
        let couplings = pairs
            .filter(|(to, from)| to != from)
            .map(|(to, from)| {
                let coupling = Coupling::new(&grids[to], &grids[from], contact_modulus);
                (to, from, coupling)
            })
            .collect();
        TilesInfluence {
            ranges,
            own,
            couplings,
            area,
            yielding,
        }
    }
}

impl PressureInfluence for TilesInfluence {
    // A change acts on every other grid: a whole product costs less than adding one by one.
    const CHANGES_MAX: usize = 0;
    type Workspace = GridWorkspace<f32>;

    fn apply(
        &self,
        pressure: &[f64],
        displacement: &mut [f64],
        workspace: &mut GridWorkspace<f32>,
    ) {
        for (range, own) in self.ranges.iter().zip(&self.own) {
            let displacement = &mut displacement[range.clone()];
            own.apply(&pressure[range.clone()], displacement, workspace);
        }
        for (to, from, coupling) in &self.couplings {
            let [to, from] = [to, from].map(|k| self.ranges[*k].clone());
            coupling.add(&pressure[from], &mut displacement[to]);
        }
    }

    fn add(&self, changes: &[(usize, f64)], _displacement: &mut [f64]) {
        debug_assert!(changes.is_empty());
    }

    fn own(&self) -> f64 {
        self.own[0].own()
    }

    fn weights(&self, cells: usize) -> CellWeights {
        let padded = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(cells.next_multiple_of(LANES), 1.0);
            values
        };
        CellWeights {
            area: padded(&self.area),
            yielding: padded(&self.yielding),
        }
    }
}
