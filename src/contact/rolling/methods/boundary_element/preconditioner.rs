//! The preconditioner: the self-influence block of every segment in the Newton matrix, factored on its own.

use std::ops::Range;

use crate::numerics::lu;
use crate::rolling::methods::boundary_element::linearisation::{
    FallingRow, Linearisation, turn_rows,
};
use crate::rolling::methods::boundary_element::strip_blocks::StripBlocks;
use crate::rolling::slip_equations::SlipEquations;

/// Self-influence blocks of the operator, for one rule and mesh.
#[derive(Debug)]
pub struct OwnBlocks {
    /// `M_xx` of every segment, column by column, segment after segment.
    xx: Vec<f64>,
    /// `M_yy`, likewise.
    yy: Vec<f64>,
    /// Start of the block of each segment, and the end of the last.
    starts: Vec<usize>,
}

impl OwnBlocks {
    /// Collects the blocks.
    pub fn new(equations: &SlipEquations) -> OwnBlocks {
        let mut starts = Vec::with_capacity(equations.segments() + 1);
        starts.push(0);
        for j in 0..equations.segments() {
            starts.push(starts[j] + equations.segment(j).len().pow(2));
        }
        let length = starts[equations.segments()];
        let (mut xx, mut yy) = (vec![0.0; length], vec![0.0; length]);
        let mut differences = [Vec::new(), Vec::new()];
        for (j, range) in starts.windows(2).enumerate() {
            let (xx, yy) = (&mut xx[range[0]..range[1]], &mut yy[range[0]..range[1]]);
            equations.own_block(j, [xx, yy], &mut differences);
        }
        OwnBlocks { xx, yy, starts }
    }

    /// `M_xx` and `M_yy` of every segment, column by column.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        let ranges = self.starts.windows(2).map(|range| range[0]..range[1]);
        ranges.map(|range| (&self.xx[range.clone()], &self.yy[range]))
    }

    /// `−(M_xx + M_yy)/2` on the diagonal, cell by cell.
    pub fn diagonal(&self, equations: &SlipEquations) -> Vec<f64> {
        let mut diagonal = vec![0.0; equations.cells()];
        for (j, (xx, yy)) in self.blocks().enumerate() {
            let n = equations.segment(j).len();
            for (k, i) in equations.segment(j).enumerate() {
                diagonal[i] = -0.5 * (xx[k * n + k] + yy[k * n + k]);
            }
        }
        diagonal
    }
}

/// Factored blocks of one Newton step.
#[derive(Debug, Default)]
pub struct StripFactors {
    blocks: StripBlocks,
    gathered: Vec<f64>,
    /// Cells of the last block that have two unknowns.
    stick: Vec<usize>,
    pivots: Vec<usize>,
}

impl StripFactors {
    /// Builds and factors the blocks of a linearisation. There is one block per segment, or one per axis where nothing slips, because sticking x and y do not
    /// interact inside a segment.
    pub fn factor(&mut self, own: &OwnBlocks, equations: &SlipEquations, linear: &Linearisation) {
        self.blocks.clear();
        for (j, blocks) in own.blocks().enumerate() {
            self.factor_segment(blocks, equations.segment(j), linear, equations.padded());
        }
        self.blocks.starts.push(self.blocks.places.len());
    }

    fn factor_segment(
        &mut self,
        (xx, yy): (&[f64], &[f64]),
        cells: Range<usize>,
        linear: &Linearisation,
        padded: usize,
    ) {
        let falling = linear.falling_in(cells.clone());
        if !falling.is_empty() || cells.clone().any(|i| linear.slips(i)) {
            let start = self.open_block();
            let places = &mut self.blocks.places;
            places.extend(cells.clone());
            let sticking = cells.clone().filter(|i| !linear.slips(*i));
            places.extend(sticking.map(|i| padded + i));
            let size = places.len() - start;
            self.fill_block(xx, yy, cells.start, cells.len(), linear, size);
            if !falling.is_empty() {
                self.turn(falling, cells, size);
            }
            self.close_block(start);
        } else {
            // Two factorisations of half the size take a quarter of the work.
            for (matrix, shift) in [(xx, 0), (yy, padded)] {
                let start = self.open_block();
                self.blocks.places.extend(cells.clone().map(|i| shift + i));
                self.blocks.factors.extend_from_slice(matrix);
                self.close_block(start);
            }
        }
    }

    fn open_block(&mut self) -> usize {
        let start = self.blocks.places.len();
        self.blocks.starts.push(start);
        self.blocks.offsets.push(self.blocks.factors.len());
        start
    }

    /// Factors the last block, whose matrix is complete.
    fn close_block(&mut self, start: usize) {
        let size = self.blocks.places.len() - start;
        let offset = self.blocks.offsets[self.blocks.offsets.len() - 1];
        self.pivots.resize(size, 0);
        lu::factor(&mut self.blocks.factors[offset..], &mut self.pivots);
        // Rows are exchanged while values are gathered, so applying the block needs no permutation.
        self.blocks.pivot_places.extend(
            self.pivots
                .iter()
                .map(|row| self.blocks.places[start + row]),
        );
        self.gathered.resize(self.gathered.len().max(size), 0.0);
    }

    /// Fills one block. The first unknown of each cell is T_x where it sticks and the tangential change where it slips; then follows T_y of the cells that stick.
    fn fill_block(
        &mut self,
        xx: &[f64],
        yy: &[f64],
        first: usize,
        n: usize,
        linear: &Linearisation,
        size: usize,
    ) {
        let base = self.blocks.factors.len();
        self.blocks.factors.resize(base + size * size, 0.0);
        let block = &mut self.blocks.factors[base..];
        self.stick.clear();
        self.stick
            .extend((0..n).filter(|k| !linear.slips(first + k)));
        let stick = &self.stick;
        for column in 0..n {
            let (xx, yy) = (
                &xx[column * n..(column + 1) * n],
                &yy[column * n..(column + 1) * n],
            );
            let (ux, uy) = linear.direction(first + column);
            let out = &mut block[column * size..(column + 1) * size];
            for row in 0..n {
                let (vx, vy) = linear.direction(first + row);
                out[row] = vx * ux * xx[row] + vy * uy * yy[row];
            }
            // The equation of a slipping cell is `t·s − D τ = 0`; D of a sticking one is 0.
            out[column] -= linear.stiffness(first + column);
            for (k, row) in stick.iter().enumerate() {
                out[n + k] = uy * yy[*row];
            }
        }
        for (c, column) in stick.iter().enumerate() {
            let yy = &yy[column * n..(column + 1) * n];
            let out = &mut block[(n + c) * size..(n + c + 1) * size];
            for (row, value) in yy.iter().enumerate() {
                out[row] = linear.direction(first + row).1 * value;
            }
            for (k, row) in stick.iter().enumerate() {
                out[n + k] = yy[*row];
            }
        }
    }

    /// Transforms the rows of cells with weakening bounds in the last block.
    fn turn(&mut self, falling: &[FallingRow], cells: Range<usize>, size: usize) {
        let stick = &self.stick;
        let rows = falling.iter().filter_map(|row| {
            let k = row.cell - cells.start;
            let place = stick.binary_search(&k).ok()?;
            Some((*row, [k, cells.len() + place]))
        });
        let offset = self.blocks.offsets[self.blocks.offsets.len() - 1];
        turn_rows(&mut self.blocks.factors[offset..], size, rows);
    }

    /// `x ← P⁻¹ x`, block by block.
    pub fn apply(&mut self, x: &mut [f64]) {
        self.blocks.apply(&mut self.gathered, x);
    }
}
