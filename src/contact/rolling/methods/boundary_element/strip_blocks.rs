//! Factored blocks of the segments, and their application.

use pulp::NullaryFnOnce;

use crate::numerics::simd;

/// Factored blocks of all segments.
#[derive(Debug, Default)]
pub(super) struct StripBlocks {
    pub(super) factors: Vec<f64>,
    /// Position in a full vector of every unknown of every block, in the order of the block's pivot rows.
    pub(super) pivot_places: Vec<usize>,
    /// Position of every unknown in the order of the unknowns.
    pub(super) places: Vec<usize>,
    /// Start of each block in `places`, and the end of the last.
    pub(super) starts: Vec<usize>,
    /// Start of each block's matrix in `factors`.
    pub(super) offsets: Vec<usize>,
}

impl StripBlocks {
    /// Empties the lists.
    pub(super) fn clear(&mut self) {
        let StripBlocks {
            factors,
            pivot_places,
            places,
            starts,
            offsets,
        } = self;
        factors.clear();
        for list in [pivot_places, places, starts, offsets] {
            list.clear();
        }
    }

    /// `x ← P⁻¹ x`, block by block. `gathered` is a buffer for the unknowns of a block.
    pub(super) fn apply(&self, gathered: &mut [f64], x: &mut [f64]) {
        // One dispatch for all blocks: the loops are compiled for the instruction set of the machine.
        simd::dispatch(Elimination {
            blocks: self,
            gathered,
            x,
        });
    }
}

/// Forward and backward substitution in all blocks, column by column: each step is one update of contiguous values.
struct Elimination<'a> {
    blocks: &'a StripBlocks,
    gathered: &'a mut [f64],
    x: &'a mut [f64],
}

impl NullaryFnOnce for Elimination<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Elimination {
            blocks,
            gathered,
            x,
        } = self;
        for j in 0..blocks.offsets.len() {
            let range = blocks.starts[j]..blocks.starts[j + 1];
            let size = range.len();
            let matrix = &blocks.factors[blocks.offsets[j]..blocks.offsets[j] + size * size];
            let values = &mut gathered[..size];
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
