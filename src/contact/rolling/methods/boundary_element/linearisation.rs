//! The friction law linearised at an iterate, cell by cell.

use std::ops::Range;

use crate::friction::velocity_weakening::Slipping;

/// The state of one Newton step: which cells slip, and along which tangent.
#[derive(Debug, Default)]
pub struct Linearisation {
    /// `(1, 0)` where a cell sticks, the unit tangent where it slips.
    pub(crate) direction: Vec<(f64, f64)>,
    /// D where a cell slips, −1 where it sticks.
    pub(crate) stiffness: Vec<f64>,
    /// The cells that slip under a bound that weakens with slip, in order. They have two unknowns, like sticking cells.
    pub(crate) falling: Vec<FallingRow>,
}

impl Linearisation {
    /// Empties the lists for a new linearisation.
    pub(crate) fn clear(&mut self) {
        self.direction.clear();
        self.stiffness.clear();
        self.falling.clear();
    }

    /// Appends a cell with two unknowns.
    pub(crate) fn two_unknowns(&mut self) {
        self.direction.push((1.0, 0.0));
        self.stiffness.push(-1.0);
    }

    /// The rows among these cells whose bound weakens with slip.
    pub(crate) fn falling_in(&self, cells: Range<usize>) -> &[FallingRow] {
        let place = |cell| self.falling.partition_point(|row| row.cell < cell);
        &self.falling[place(cells.start)..place(cells.end)]
    }

    /// Whether the cell slips with one unknown.
    pub fn slips(&self, cell: usize) -> bool {
        self.stiffness[cell] >= 0.0
    }

    /// Direction of the cell's first unknown.
    pub fn direction(&self, cell: usize) -> (f64, f64) {
        self.direction[cell]
    }

    /// D of a slipping cell, 0 of a sticking one.
    pub fn stiffness(&self, cell: usize) -> f64 {
        self.stiffness[cell].max(0.0)
    }
}

/// The law of a cell whose bound weakens with slip, linearised at `z = T + r s` with `d = z/|z|` and `t ⟂ d`. The equation `t·δs − D t·δT = D t·T − t·s` turns
/// the traction with the slip. The equation `d·(T + δT) = g + g′ (d·(s + δs) − σ)` keeps its length at the bound, where σ is the slip of the resolvent; it is
/// divided by −r, so that both rows have the size and sign of those of sticking cells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FallingRow {
    /// The cell.
    pub(crate) cell: usize,
    /// d.
    along: [f64; 2],
    /// D.
    stiffness: f64,
    /// `g′/r`.
    slope: f64,
    /// `1/r`.
    inverse: f64,
    /// `(g − g′ σ)/r`.
    rest: f64,
}

impl FallingRow {
    /// The row of a cell that slips at `z` of the given length.
    pub(crate) fn new(
        cell: usize,
        z: [f64; 2],
        length: f64,
        r: f64,
        found: &Slipping,
    ) -> FallingRow {
        FallingRow {
            cell,
            along: z.map(|z| z / length),
            stiffness: (length - found.bound) / (found.bound.max(1e-12 * length) * r),
            slope: found.slope / r,
            inverse: 1.0 / r,
            rest: (found.bound - found.slope * found.slip) / r,
        }
    }

    /// Applies both rows to a slip and a traction.
    pub(crate) fn apply(&self, slip: [f64; 2], traction: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = self.along;
        let turned = |v: [f64; 2]| dx * v[1] - dy * v[0];
        let along = |v: [f64; 2]| dx * v[0] + dy * v[1];
        [
            turned(slip) - self.stiffness * turned(traction),
            self.slope * along(slip) - self.inverse * along(traction),
        ]
    }

    /// The right-hand sides at an iterate.
    pub(crate) fn right(&self, slip: [f64; 2], traction: [f64; 2]) -> [f64; 2] {
        let [turning, size] = self.apply(slip, traction);
        [-turning, -size - self.rest]
    }
}

/// Transforms the rows of such cells in a block of the preconditioner, which contain the slips at first.
///
/// `block` is a square matrix of `size`, column by column. Each row comes with the places of both components of its cell.
pub(crate) fn turn_rows(
    block: &mut [f64],
    size: usize,
    rows: impl Iterator<Item = (FallingRow, [usize; 2])>,
) {
    for (row, [x, y]) in rows {
        for (k, column) in block.chunks_exact_mut(size).enumerate() {
            let traction = [f64::from(u8::from(k == x)), f64::from(u8::from(k == y))];
            [column[x], column[y]] = row.apply([column[x], column[y]], traction);
        }
    }
}
