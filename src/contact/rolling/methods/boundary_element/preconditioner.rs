//! The preconditioner: every segment's own block of the Newton matrix, factored on its own.

use std::ops::Range;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::factor;
use faer::{MatMut, Par};
use pulp::{Arch, NullaryFnOnce};

use crate::contact::numerics::small_lu;
use crate::contact::numerics::small_lu::SMALL;
use crate::contact::rolling::methods::boundary_element::falling_rows::{FallingRow, turn_rows};
use crate::contact::rolling::methods::boundary_element::linearisation::Linearisation;
use crate::contact::rolling::own_blocks::OwnBlocks;
use crate::contact::rolling::slip_equations::SlipEquations;

/// Factored blocks of one Newton step.
#[derive(Debug, Default)]
pub struct StripFactors {
    factors: Vec<f64>,
    /// Position in a full vector of every unknown of every block, in the order of the block's pivot rows.
    pivot_places: Vec<usize>,
    /// Position of every unknown in its own order.
    places: Vec<usize>,
    /// Start of each block in `places`, and one more.
    starts: Vec<usize>,
    /// Start of each block's matrix in `factors`.
    offsets: Vec<usize>,
    gathered: Vec<f64>,
    /// Cells of the newest block that have two unknowns.
    stick: Vec<usize>,
    scratch: FactorScratch,
}

/// Buffers of the factorisation.
#[derive(Default)]
struct FactorScratch {
    pivots: Vec<usize>,
    pivots_inverse: Vec<usize>,
    stack: Option<(usize, MemBuffer)>,
}

impl std::fmt::Debug for FactorScratch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Scratch")
    }
}

impl FactorScratch {
    /// Factors a matrix in place, stored column by column; the order of its rows is left in `pivots`.
    fn factor(&mut self, matrix: &mut [f64], size: usize) {
        self.pivots.resize(size, 0);
        if size <= SMALL {
            small_lu::factor(matrix, &mut self.pivots);
            return;
        }
        self.pivots_inverse.resize(size, 0);
        if self.stack.as_ref().is_none_or(|(most, _)| *most < size) {
            // The buffer of the largest block so far serves all smaller ones.
            let request =
                factor::lu_in_place_scratch::<usize, f64>(size, size, Par::Seq, Default::default());
            self.stack = Some((size, MemBuffer::new(request)));
        }
        let Some((_, stack)) = self.stack.as_mut() else {
            return;
        };
        factor::lu_in_place(
            MatMut::from_column_major_slice_mut(matrix, size, size),
            &mut self.pivots,
            &mut self.pivots_inverse,
            Par::Seq,
            MemStack::new(stack),
            Default::default(),
        );
    }
}

impl StripFactors {
    /// Builds and factors the blocks of a linearisation: one block per segment, or one for each component where
    /// nothing slips (sticking x and y do not touch each other inside a segment).
    pub fn factor(&mut self, own: &OwnBlocks, equations: &SlipEquations, linear: &Linearisation) {
        self.places.clear();
        self.pivot_places.clear();
        self.starts.clear();
        self.offsets.clear();
        self.factors.clear();
        let padded = equations.padded();
        for (j, (xx, yy)) in own.blocks().enumerate() {
            let cells = equations.segment(j);
            let falling = linear.falling_in(cells.clone());
            if !falling.is_empty() || cells.clone().any(|i| linear.slips(i)) {
                let start = self.open_block();
                self.places.extend(cells.clone());
                self.places.extend(
                    cells
                        .clone()
                        .filter(|i| !linear.slips(*i))
                        .map(|i| padded + i),
                );
                let size = self.places.len() - start;
                self.fill_block(xx, yy, cells.start, cells.len(), linear, size);
                if !falling.is_empty() {
                    self.turn(falling, cells, size);
                }
                self.close_block(start);
            } else {
                // Two factorisations of half the size take a quarter of the work of one.
                for (matrix, shift) in [(xx, 0), (yy, padded)] {
                    let start = self.open_block();
                    self.places.extend(cells.clone().map(|i| shift + i));
                    self.factors.extend_from_slice(matrix);
                    self.close_block(start);
                }
            }
        }
        self.starts.push(self.places.len());
    }

    fn open_block(&mut self) -> usize {
        let start = self.places.len();
        self.starts.push(start);
        self.offsets.push(self.factors.len());
        start
    }

    /// Factors the newest block, whose matrix is complete.
    fn close_block(&mut self, start: usize) {
        let size = self.places.len() - start;
        let scratch = &mut self.scratch;
        let offset = self.offsets[self.offsets.len() - 1];
        scratch.factor(&mut self.factors[offset..], size);
        // The rows are exchanged while values are gathered, so that an application needs no permutation of its own.
        self.pivot_places
            .extend(scratch.pivots.iter().map(|row| self.places[start + row]));
        self.gathered.resize(self.gathered.len().max(size), 0.0);
    }

    /// Fills one block: first one unknown per cell (T_x where it sticks, the tangential change where it slips), then
    /// T_y of the cells that stick.
    fn fill_block(
        &mut self,
        xx: &[f64],
        yy: &[f64],
        first: usize,
        n: usize,
        linear: &Linearisation,
        size: usize,
    ) {
        let base = self.factors.len();
        self.factors.resize(base + size * size, 0.0);
        let block = &mut self.factors[base..];
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

    /// Turns the rows of falling cells in the newest block.
    fn turn(&mut self, falling: &[FallingRow], cells: Range<usize>, size: usize) {
        let stick = &self.stick;
        let rows = falling.iter().filter_map(|row| {
            let k = row.cell - cells.start;
            let place = stick.binary_search(&k).ok()?;
            Some((*row, [k, cells.len() + place]))
        });
        let offset = self.offsets[self.offsets.len() - 1];
        turn_rows(&mut self.factors[offset..], size, rows);
    }

    /// `x ← P⁻¹ x`, block by block.
    pub fn apply(&mut self, x: &mut [f64]) {
        // One dispatch for all blocks: the loops inside are compiled for the instruction set of this machine.
        Arch::new().dispatch(Elimination { blocks: self, x });
    }
}

/// Forward and backward substitution in all blocks, column by column: each step is one update of contiguous values.
struct Elimination<'a> {
    blocks: &'a mut StripFactors,
    x: &'a mut [f64],
}

impl NullaryFnOnce for Elimination<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Elimination { blocks, x } = self;
        for j in 0..blocks.offsets.len() {
            let range = blocks.starts[j]..blocks.starts[j + 1];
            let size = range.len();
            let matrix = &blocks.factors[blocks.offsets[j]..blocks.offsets[j] + size * size];
            let values = &mut blocks.gathered[..size];
            for (to, place) in values.iter_mut().zip(&blocks.pivot_places[range.clone()]) {
                *to = x[*place];
            }
            for column in 0..size {
                let (head, below) = values.split_at_mut(column + 1);
                subtract(
                    below,
                    head[column],
                    &matrix[column * size + column + 1..(column + 1) * size],
                );
            }
            for column in (0..size).rev() {
                let (above, rest) = values.split_at_mut(column);
                let value = rest[0] / matrix[column * size + column];
                rest[0] = value;
                subtract(above, value, &matrix[column * size..column * size + column]);
            }
            for (from, place) in values.iter().zip(&blocks.places[range]) {
                x[*place] = *from;
            }
        }
    }
}

/// `values −= factor × column`.
#[inline(always)]
fn subtract(values: &mut [f64], factor: f64, column: &[f64]) {
    for (value, entry) in values.iter_mut().zip(column) {
        *value -= factor * entry;
    }
}
