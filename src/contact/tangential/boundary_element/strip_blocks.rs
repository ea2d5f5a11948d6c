//! The preconditioner: every segment's own block of the Newton matrix, factored on its own.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Conj, MatMut, MatRef, Par};

use crate::contact::tangential::boundary_element::newton::Linearisation;
use crate::contact::tangential::equations::Equations;

/// Own blocks of the operator, fixed for a rule and mesh.
#[derive(Debug)]
pub struct OwnBlocks {
    /// `M_xx` and `M_yy` of every segment, column by column.
    blocks: Vec<(Vec<f64>, Vec<f64>)>,
}

impl OwnBlocks {
    /// Collects the blocks.
    #[must_use]
    pub fn new(equations: &Equations) -> OwnBlocks {
        OwnBlocks {
            blocks: (0..equations.segments())
                .map(|j| equations.own_block(j))
                .collect(),
        }
    }

    /// `−(M_xx + M_yy)/2` on the diagonal, cell by cell.
    #[must_use]
    pub fn diagonal(&self, equations: &Equations) -> Vec<f64> {
        let mut diagonal = vec![0.0; equations.cells()];
        for (j, (xx, yy)) in self.blocks.iter().enumerate() {
            let n = equations.segment(j).len();
            for (k, i) in equations.segment(j).enumerate() {
                diagonal[i] = -0.5 * (xx[k * n + k] + yy[k * n + k]);
            }
        }
        diagonal
    }
}

/// Factored blocks of one Newton step.
#[derive(Default)]
pub struct StripBlocks {
    factors: Vec<f64>,
    pivots: Vec<usize>,
    pivots_inverse: Vec<usize>,
    /// Position of every unknown of every segment in a full vector.
    places: Vec<usize>,
    /// Start of each segment in `places`, and one more.
    starts: Vec<usize>,
    /// Start of each segment's matrix in `factors`.
    offsets: Vec<usize>,
    gathered: Vec<f64>,
    stack: Option<MemBuffer>,
}

impl StripBlocks {
    /// Builds and factors the blocks of a linearisation.
    pub fn factor(&mut self, own: &OwnBlocks, equations: &Equations, linear: &Linearisation) {
        self.places.clear();
        self.starts.clear();
        self.offsets.clear();
        self.factors.clear();
        let padded = equations.padded();
        let mut largest = 0;
        for (j, (xx, yy)) in own.blocks.iter().enumerate() {
            let cells = equations.segment(j);
            let start = self.places.len();
            self.starts.push(start);
            self.offsets.push(self.factors.len());
            self.places.extend(cells.clone());
            self.places.extend(
                cells
                    .clone()
                    .filter(|i| !linear.slips(*i))
                    .map(|i| padded + i),
            );
            let size = self.places.len() - start;
            largest = largest.max(size);
            self.fill_block(xx, yy, cells.start, cells.len(), linear, size);
        }
        self.starts.push(self.places.len());
        self.pivots.resize(self.places.len(), 0);
        self.pivots_inverse.resize(self.places.len(), 0);
        self.gathered.resize(largest, 0.0);
        let request = factor::lu_in_place_scratch::<usize, f64>(
            largest,
            largest,
            Par::Seq,
            Default::default(),
        )
        .or(solve::solve_in_place_scratch::<usize, f64>(
            largest,
            1,
            Par::Seq,
        ));
        let mut buffer = MemBuffer::new(request);
        for j in 0..own.blocks.len() {
            let (start, size) = (self.starts[j], self.starts[j + 1] - self.starts[j]);
            let matrix = &mut self.factors[self.offsets[j]..self.offsets[j] + size * size];
            factor::lu_in_place(
                MatMut::from_column_major_slice_mut(matrix, size, size),
                &mut self.pivots[start..start + size],
                &mut self.pivots_inverse[start..start + size],
                Par::Seq,
                MemStack::new(&mut buffer),
                Default::default(),
            );
        }
        self.stack = Some(buffer);
    }

    /// Appends one block: first one unknown per cell (T_x where it sticks, the tangential change where it slips),
    /// then T_y of the cells that stick.
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
        let stick: Vec<usize> = (0..n).filter(|k| !linear.slips(first + k)).collect();
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
            out[column] -= linear.stiffness(first + column);
            for (k, row) in stick.iter().enumerate() {
                out[n + k] = uy * yy[*row];
            }
        }
        for (c, column) in stick.iter().enumerate() {
            let yy = &yy[column * n..(column + 1) * n];
            let out = &mut block[(n + c) * size..(n + c + 1) * size];
            for row in 0..n {
                out[row] = linear.direction(first + row).1 * yy[row];
            }
            for (k, row) in stick.iter().enumerate() {
                out[n + k] = yy[*row];
            }
        }
    }

    /// `x ← P⁻¹ x`, segment by segment.
    pub fn apply(&mut self, x: &mut [f64]) {
        let Some(buffer) = self.stack.as_mut() else {
            return;
        };
        for j in 0..self.offsets.len() {
            let range = self.starts[j]..self.starts[j + 1];
            let size = range.len();
            let places = &self.places[range.clone()];
            let gathered = &mut self.gathered[..size];
            for (to, place) in gathered.iter_mut().zip(places) {
                *to = x[*place];
            }
            let matrix = &self.factors[self.offsets[j]..self.offsets[j] + size * size];
            let factors = MatRef::from_column_major_slice(matrix, size, size);
            let permutation = PermRef::new_checked(
                &self.pivots[range.clone()],
                &self.pivots_inverse[range.clone()],
                size,
            );
            solve::solve_in_place_with_conj(
                factors,
                factors,
                permutation,
                Conj::No,
                MatMut::from_column_major_slice_mut(gathered, size, 1),
                Par::Seq,
                MemStack::new(buffer),
            );
            for (from, place) in gathered.iter().zip(places) {
                x[*place] = *from;
            }
        }
    }
}
