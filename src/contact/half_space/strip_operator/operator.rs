//! The strip operator: the change of the surface displacement from one observation point of a segment to the next, per unit traction on every cell.
//!
//! A segment with `n` cells has `n + 3` observation points by increasing x: its `n` nodes, its leading edge, and the images of its last two nodes behind that edge. The
//! discretisation rules need only their `n + 2` consecutive differences. Differences, unlike displacements, do not lose digits when they are combined. The matrix
//! depends only on the mesh and Poisson's ratio. Tractions are in an arbitrary unit; displacement differences are in (that unit / G) × (length unit of the mesh).

use pulp::WithSimd;

use crate::half_space::strip_operator::assembly::OperatorAssembly;
use crate::half_space::strip_operator::kind::{Parity, Precision};
use crate::half_space::strip_operator::product::{Product, RowLayout, blocks};
use crate::mesh::Mesh;
use crate::monitor::{Monitor, Stop};
use crate::numerics::simd;
use crate::numerics::simd::LANES;

/// Displacement differences of all segments, see the [module](self).
#[derive(Debug, Clone)]
pub struct StripOperator {
    /// Whether only one half of a mirror-symmetric mesh is stored. The rows of a full matrix are `[xx | xy | yy]` over all cells. A folded matrix has the rows
    /// of the first half of the segments, `[xx+ | xx− | xy+ | xy− | yy+ | yy−]` over the cells of that half, where `±` adds or subtracts the influence of the
    /// mirrored cell.
    folded: bool,
    /// Cells of the whole mesh.
    cells: usize,
    /// Length of a block of a row.
    stride: usize,
    /// First row of each stored segment, and the end of the last.
    first_row: Vec<usize>,
    /// First cell of each stored segment, and the end of the last.
    first_cell: Vec<usize>,
    matrix: Matrix,
}

/// Buffers of a product. The caller keeps them, so that a product allocates nothing and threads can share the matrix.
#[derive(Debug, Clone, Default)]
pub struct OperatorScratch {
    /// Tractions in single precision.
    narrow: [Vec<f32>; 2],
    /// Tractions and displacement differences of the two parities.
    halves: [Vec<f64>; 2],
}

/// Number of difference rows of a segment with `cells` cells.
pub fn rows_of(cells: usize) -> usize {
    cells + 2
}

/// Bytes of the matrix of a mesh.
pub fn bytes(cells: usize, segments: usize, folded: bool, precision: Precision) -> u64 {
    let rows = (cells + 2 * segments) as u64;
    let stride = |cells: usize| cells.next_multiple_of(LANES) as u64;
    let numbers = if folded {
        6 * (rows / 2) * stride(cells / 2)
    } else {
        3 * rows * stride(cells)
    };
    precision.bytes() * numbers
}

impl StripOperator {
    /// Computes the matrix; with `folded`, the mesh must have a mirror line.
    ///
    /// # Errors
    /// The monitor is asked once per segment and may stop the work.
    pub fn new(
        mesh: &Mesh,
        nu: f64,
        folded: bool,
        precision: Precision,
        monitor: &dyn Monitor,
    ) -> Result<StripOperator, Stop> {
        debug_assert!(!folded || mesh.mirror_line().is_some());
        let stored = if folded {
            mesh.segments.len() / 2
        } else {
            mesh.segments.len()
        };
        let cells_stored = mesh.segments[..stored]
            .iter()
            .map(|s| s.cells.len())
            .sum::<usize>();
        let stride = cells_stored.next_multiple_of(LANES);
        let [mut first_row, mut first_cell] = [0; 2].map(|first| {
            let mut places = Vec::with_capacity(stored + 1);
            places.push(first);
            places
        });
        for segment in &mesh.segments[..stored] {
            first_row.push(first_row[first_row.len() - 1] + rows_of(segment.cells.len()));
            first_cell.push(segment.cells.end);
        }
        let assembly = OperatorAssembly {
            mesh,
            nu,
            folded,
            stride,
            first_row: &first_row,
        };
        let matrix = match precision {
            Precision::Single => Matrix::Single(assembly.matrix(monitor)?),
            Precision::Double => Matrix::Double(assembly.matrix(monitor)?),
        };
        Ok(StripOperator {
            folded,
            cells: mesh.cells(),
            stride,
            first_row,
            first_cell,
            matrix,
        })
    }

    /// Bytes of the matrix.
    pub fn bytes(&self) -> usize {
        self.matrix.bytes()
    }

    /// Number of segments whose rows are stored: all, or half of them if folded.
    pub fn segments(&self) -> usize {
        self.first_row.len() - 1
    }

    /// Whether only one half of a mirror-symmetric mesh is stored.
    pub fn is_folded(&self) -> bool {
        self.folded
    }

    /// Rows of segment `j`.
    pub fn segment_rows(&self, j: usize) -> std::ops::Range<usize> {
        self.first_row[j]..self.first_row[j + 1]
    }

    /// Number of stored rows.
    pub fn row_count(&self) -> usize {
        self.first_row[self.segments()]
    }

    /// Cells of segment `j`.
    pub fn cells(&self, j: usize) -> std::ops::Range<usize> {
        self.first_cell[j]..self.first_cell[j + 1]
    }

    /// Number of entries that a product with the given parity reads.
    pub fn entries(&self, parity: Option<Parity>) -> usize {
        let blocks = match (self.folded, parity) {
            (false, _) => 3,
            (true, None) => 6,
            (true, Some(_)) => 4,
        };
        blocks * self.row_count() * self.stride
    }

    /// Length of a vector of values per cell: the cells of the unknowns, padded with zeros.
    pub fn padded(&self, parity: Option<Parity>) -> usize {
        match (self.folded, parity) {
            (true, None) => self.cells.next_multiple_of(LANES),
            _ => self.stride,
        }
    }

    /// The start of a block of a row in the matrix.
    fn place(&self, row: usize, block: usize) -> usize {
        (row * blocks(self.folded) + block) * self.stride
    }

    fn stored(&self, row: usize, block: usize, cell: usize) -> f64 {
        self.matrix.at(self.place(row, block) + cell)
    }

    /// The blocks for (xx, u_x from T_y, u_y from T_x, yy).
    fn roles(&self, parity: Option<Parity>) -> [usize; 4] {
        match (self.folded, parity) {
            (false, _) => [0, 1, 1, 2],
            (true, Some(Parity::Lateral)) => [1, 2, 3, 4],
            (true, _) => [0, 3, 2, 5],
        }
    }

    /// Entries of the self-influence block: the change of u_x per T_x and of u_y per T_y in a row of the matrix by a cell of its segment. These blocks have no cross terms in a
    /// full matrix; in a folded one they are neglected.
    pub fn own(&self, row: usize, cell: usize, parity: Option<Parity>) -> (f64, f64) {
        if self.is_folded() && parity.is_none() {
            // Half the sum of both parities is the influence of the cell without its mirror image.
            let half = |k: usize| 0.5 * (self.stored(row, k, cell) + self.stored(row, k + 1, cell));
            return (half(0), half(4));
        }
        let [xx, _, _, yy] = self.roles(parity);
        (self.stored(row, xx, cell), self.stored(row, yy, cell))
    }

    /// Displacement differences `out_x`, `out_y` (one value per row) caused by tractions `tx`, `ty`.
    ///
    /// Without parity, vectors cover the whole mesh; rows of the mirrored half follow in the order of their segments.
    pub fn apply(
        &self,
        parity: Option<Parity>,
        tx: &[f64],
        ty: &[f64],
        out_x: &mut [f64],
        out_y: &mut [f64],
        scratch: &mut OperatorScratch,
    ) {
        if self.is_folded() && parity.is_none() {
            self.apply_both(tx, ty, out_x, out_y, scratch);
        } else {
            let roles = self.roles(parity);
            self.product(roles, tx, ty, out_x, out_y, &mut scratch.narrow);
        }
    }

    /// `out_x = xx tx + a ty` and `out_y = b tx + yy ty` row by row, for the blocks with these roles.
    fn product(
        &self,
        roles: [usize; 4],
        tx: &[f64],
        ty: &[f64],
        out_x: &mut [f64],
        out_y: &mut [f64],
        narrow: &mut [Vec<f32>; 2],
    ) {
        let layout = RowLayout {
            blocks: blocks(self.folded),
            stride: self.stride,
            roles,
        };
        let tractions = [&tx[..self.stride], &ty[..self.stride]];
        self.matrix
            .multiply(layout, tractions, [out_x, out_y], narrow);
    }

    /// Applies the operator to both parities of the tractions separately and combines the results.
    fn apply_both(
        &self,
        tx: &[f64],
        ty: &[f64],
        out_x: &mut [f64],
        out_y: &mut [f64],
        scratch: &mut OperatorScratch,
    ) {
        let (stride, rows) = (self.stride, self.row_count());
        let OperatorScratch { narrow, halves } = scratch;
        // The parities do not mix, so each product uses only the stored half of the rows and cells.
        let [parts, sums] = halves;
        parts.resize(4 * stride, 0.0);
        sums.resize(4 * rows, 0.0);
        let (x_parts, y_parts) = parts.split_at_mut(2 * stride);
        self.split(tx, x_parts);
        self.split(ty, y_parts);
        let ((x_same, x_opposite), (y_same, y_opposite)) =
            (x_parts.split_at(stride), y_parts.split_at(stride));
        let (first, second) = sums.split_at_mut(2 * rows);
        let ((ux_same, uy_opposite), (ux_opposite, uy_same)) =
            (first.split_at_mut(rows), second.split_at_mut(rows));
        for (parity, tx, ty, out_x, out_y) in [
            (
                Parity::Longitudinal,
                x_same,
                y_opposite,
                &mut *ux_same,
                &mut *uy_opposite,
            ),
            (
                Parity::Lateral,
                x_opposite,
                y_same,
                &mut *ux_opposite,
                &mut *uy_same,
            ),
        ] {
            let roles = self.roles(Some(parity));
            self.product(roles, tx, ty, out_x, out_y, narrow);
        }
        self.join(ux_same, ux_opposite, out_x);
        self.join(uy_same, uy_opposite, out_y);
    }

    /// Writes half the sum and half the difference of the values of each cell and its mirror image.
    fn split(&self, values: &[f64], parts: &mut [f64]) {
        let (same, opposite) = parts.split_at_mut(self.stride);
        for j in 0..self.segments() {
            let cells = self.cells(j);
            let image = self.cells - cells.end;
            for (k, i) in cells.enumerate() {
                let (here, there) = (values[i], values[image + k]);
                same[i] = 0.5 * (here + there);
                opposite[i] = 0.5 * (here - there);
            }
        }
    }

    fn join(&self, same: &[f64], opposite: &[f64], out: &mut [f64]) {
        let total = 2 * self.row_count();
        for j in 0..self.segments() {
            let rows = self.segment_rows(j);
            let image = total - rows.end;
            for (k, i) in rows.enumerate() {
                // The part of opposite parity changes sign in the mirrored half.
                out[i] = same[i] + opposite[i];
                out[image + k] = same[i] - opposite[i];
            }
        }
    }
}

/// The stored numbers.
#[derive(Debug, Clone)]
pub(crate) enum Matrix {
    Single(Vec<f32>),
    Double(Vec<f64>),
}

impl Matrix {
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Matrix::Single(matrix) => size_of_val(&matrix[..]),
            Matrix::Double(matrix) => size_of_val(&matrix[..]),
        }
    }

    pub(crate) fn at(&self, place: usize) -> f64 {
        match self {
            Matrix::Single(matrix) => f64::from(matrix[place]),
            Matrix::Double(matrix) => matrix[place],
        }
    }

    /// The [`Product`] of all rows with tractions along x and across, which are converted to the precision of the matrix.
    pub(crate) fn multiply(
        &self,
        layout: RowLayout,
        tractions: [&[f64]; 2],
        out: [&mut [f64]; 2],
        narrow: &mut [Vec<f32>; 2],
    ) {
        match self {
            Matrix::Single(matrix) => {
                for (narrow, values) in narrow.iter_mut().zip(tractions) {
                    narrow.clear();
                    narrow.extend(values.iter().map(|v| *v as f32));
                }
                let [tx, ty] = narrow;
                multiply(matrix, layout, [tx, ty], out);
            }
            Matrix::Double(matrix) => multiply(matrix, layout, tractions, out),
        }
    }
}

/// The product with numbers of one precision.
fn multiply<'a, T>(
    matrix: &'a [T],
    layout: RowLayout,
    [tx, ty]: [&'a [T]; 2],
    [out_x, out_y]: [&'a mut [f64]; 2],
) where
    Product<'a, T>: WithSimd<Output = ()>,
{
    simd::dispatch(Product {
        matrix,
        layout,
        tx,
        ty,
        out_x,
        out_y,
    });
}

#[cfg(test)]
mod tests {
    //! The bulk operator against the closed forms, point by point, and against itself folded.

    use std::ops::ControlFlow;

    use super::*;
    use crate::half_space::kernels::{Rectangle, rectangle};
    use crate::mesh::samples::mesh_between;
    use crate::mesh::{Chord, Grading, observation_points};
    use crate::monitor::Unmonitored;

    fn ellipse(a: f64, b: f64, strips: usize, cells: usize) -> Mesh {
        mesh_between(b, [strips, cells], |y| {
            let half = a * (1.0 - (y / b).powi(2)).sqrt();
            [-half, half]
        })
    }

    /// Two patches of different strip widths side by side, one with two segments in a strip.
    fn scattered() -> Mesh {
        let chord = |patch, strip, y, dy, left, right| Chord {
            patch,
            strip,
            y,
            dy,
            left,
            right,
        };
        let chords = [
            chord(0, 0, -1.0, 0.5, -1.0, 0.4),
            chord(0, 1, -0.5, 0.5, -1.2, -0.3),
            chord(0, 1, -0.5, 0.5, 0.1, 0.9),
            chord(1, 0, 0.25, 0.3, -0.2, 0.2),
            chord(1, 1, 0.55, 0.3, -0.4, 0.1),
        ];
        Mesh::new(&chords, &Grading::cosine(4))
    }

    fn by_closed_form(mesh: &Mesh, nu: f64, tx: &[f64], ty: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let displacement = |x: f64, y: f64| {
            let (mut ux, mut uy) = (0.0, 0.0);
            for segment in &mesh.segments {
                let (y0, y1) = (
                    segment.chord.y - 0.5 * segment.chord.dy,
                    segment.chord.y + 0.5 * segment.chord.dy,
                );
                for i in segment.cells.clone() {
                    let cell = Rectangle {
                        x0: mesh.left[i],
                        x1: mesh.right[i],
                        y0,
                        y1,
                    };
                    let influence = rectangle(x, y, cell, nu);
                    ux += influence.xx * tx[i] + influence.xy * ty[i];
                    uy += influence.xy * tx[i] + influence.yy * ty[i];
                }
            }
            (ux, uy)
        };
        let mut out = (Vec::new(), Vec::new());
        for segment in &mesh.segments {
            let points = observation_points(mesh, segment);
            let u: Vec<(f64, f64)> = points
                .iter()
                .map(|x| displacement(*x, segment.chord.y))
                .collect();
            for pair in u.windows(2) {
                out.0.push(pair[1].0 - pair[0].0);
                out.1.push(pair[1].1 - pair[0].1);
            }
        }
        out
    }

    fn tractions(mesh: &Mesh, padded: usize) -> (Vec<f64>, Vec<f64>) {
        let wave = |a: f64, b: f64| {
            let mut values: Vec<f64> = (0..mesh.cells())
                .map(|i| (a * i as f64 + b).sin())
                .collect();
            values.resize(padded, 0.0);
            values
        };
        (wave(0.7, 0.1), wave(1.3, 2.0))
    }

    fn largest_gap(a: &[f64], b: &[f64]) -> f64 {
        let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
            / size
    }

    fn applied(differences: &StripOperator, mesh: &Mesh) -> (Vec<f64>, Vec<f64>) {
        let (tx, ty) = tractions(mesh, differences.padded(None));
        let rows: usize = mesh.segments.iter().map(|s| rows_of(s.cells.len())).sum();
        let (mut ux, mut uy) = (vec![0.0; rows], vec![0.0; rows]);
        differences.apply(
            None,
            &tx,
            &ty,
            &mut ux,
            &mut uy,
            &mut OperatorScratch::default(),
        );
        (ux, uy)
    }

    #[test]
    fn products_agree_with_the_closed_forms() {
        for mesh in [
            ellipse(1.0, 1.0, 5, 7),
            ellipse(0.05, 1.0, 6, 4),
            ellipse(50.0, 1.0, 4, 6),
            scattered(),
        ] {
            for nu in [0.0, 0.28, 0.5] {
                let differences =
                    StripOperator::new(&mesh, nu, false, Precision::Double, &Unmonitored).unwrap();
                let (ux, uy) = applied(&differences, &mesh);
                let (tx, ty) = tractions(&mesh, mesh.cells());
                let (expected_x, expected_y) = by_closed_form(&mesh, nu, &tx, &ty);
                assert!(
                    largest_gap(&ux, &expected_x) < 2e-13,
                    "{}",
                    largest_gap(&ux, &expected_x)
                );
                assert!(
                    largest_gap(&uy, &expected_y) < 2e-13,
                    "{}",
                    largest_gap(&uy, &expected_y)
                );
            }
        }
    }

    #[test]
    fn a_folded_matrix_gives_the_same_products_as_the_full_one() {
        for mesh in [ellipse(1.0, 2.0, 6, 16), ellipse(3.0, 1.0, 4, 16)] {
            let full =
                StripOperator::new(&mesh, 0.3, false, Precision::Double, &Unmonitored).unwrap();
            let folded =
                StripOperator::new(&mesh, 0.3, true, Precision::Double, &Unmonitored).unwrap();
            let (expected_x, expected_y) = applied(&full, &mesh);
            let (ux, uy) = applied(&folded, &mesh);
            assert!(largest_gap(&ux, &expected_x) < 1e-13 && largest_gap(&uy, &expected_y) < 1e-13);
            assert_eq!(2 * folded.entries(None), full.entries(None));
        }
    }

    #[test]
    fn single_precision_keeps_five_digits() {
        for folded in [false, true] {
            let mesh = ellipse(1.5, 1.0, 6, 8);
            let double =
                StripOperator::new(&mesh, 0.3, folded, Precision::Double, &Unmonitored).unwrap();
            let single =
                StripOperator::new(&mesh, 0.3, folded, Precision::Single, &Unmonitored).unwrap();
            let (expected_x, expected_y) = applied(&double, &mesh);
            let (ux, uy) = applied(&single, &mesh);
            assert!(largest_gap(&ux, &expected_x) < 1e-5 && largest_gap(&uy, &expected_y) < 1e-5);
            assert!(ux != expected_x, "it is another matrix");
        }
    }

    #[test]
    fn one_parity_needs_half_the_cells_only() {
        let mesh = ellipse(1.5, 1.0, 6, 8);
        let folded = StripOperator::new(&mesh, 0.3, true, Precision::Double, &Unmonitored).unwrap();
        let half = mesh.cells() / 2;
        for (parity, sign_x, sign_y) in [
            (Parity::Longitudinal, 1.0, -1.0),
            (Parity::Lateral, -1.0, 1.0),
        ] {
            let (mut tx, mut ty) = tractions(&mesh, folded.padded(None));
            for segment in &mesh.segments[..mesh.segments.len() / 2] {
                for i in segment.cells.clone() {
                    let image = mesh.cells() - segment.cells.end + (i - segment.cells.start);
                    tx[image] = sign_x * tx[i];
                    ty[image] = sign_y * ty[i];
                }
            }
            let rows = folded.row_count();
            let (mut all_x, mut all_y) = (vec![0.0; 2 * rows], vec![0.0; 2 * rows]);
            folded.apply(
                None,
                &tx,
                &ty,
                &mut all_x,
                &mut all_y,
                &mut OperatorScratch::default(),
            );
            let (mut ux, mut uy) = (vec![0.0; rows], vec![0.0; rows]);
            tx.truncate(half);
            ty.truncate(half);
            tx.resize(folded.padded(Some(parity)), 0.0);
            ty.resize(folded.padded(Some(parity)), 0.0);
            folded.apply(
                Some(parity),
                &tx,
                &ty,
                &mut ux,
                &mut uy,
                &mut OperatorScratch::default(),
            );
            assert!(
                largest_gap(&ux, &all_x[..rows]) < 1e-13
                    && largest_gap(&uy, &all_y[..rows]) < 1e-13
            );
        }
    }

    #[test]
    fn a_stop_is_seen_between_segments() {
        struct Stopped;
        impl Monitor for Stopped {
            fn tick(&self, _: f64) -> ControlFlow<Stop> {
                ControlFlow::Break(Stop::Cancelled)
            }
            fn elapsed(&self) -> std::time::Duration {
                std::time::Duration::ZERO
            }
        }
        let stopped = StripOperator::new(
            &ellipse(1.0, 1.0, 4, 4),
            0.3,
            false,
            Precision::Double,
            &Stopped,
        );
        assert_eq!(stopped.map(|_| ()), Err(Stop::Cancelled));
    }

    /// A mesh that is its own image has its trailing rows from the leading ones; moved along x it is none any more.
    #[test]
    fn rows_of_a_reversible_mesh_are_those_of_the_same_mesh_elsewhere() {
        for cells in [1, 2, 3, 4, 9, 19] {
            let mesh = ellipse(1.3, 0.8, 6, cells);
            let moved = mesh.normalised([0.25, 0.0], 1.0);
            assert!(mesh.is_reversible() && !moved.is_reversible());
            for folded in [false, true] {
                let [here, there] = [&mesh, &moved].map(|mesh| {
                    StripOperator::new(mesh, 0.3, folded, Precision::Double, &Unmonitored).unwrap()
                });
                let parity = folded.then_some(Parity::Lateral);
                for row in 0..here.row_count() {
                    for cell in 0..here.cells(here.segments() - 1).end {
                        let entry = |all: &StripOperator| {
                            all.roles(parity).map(|block| all.stored(row, block, cell))
                        };
                        let pairs = [&here, &there].map(entry);
                        for (a, b) in pairs[0].into_iter().zip(pairs[1]) {
                            assert!(
                                (a - b).abs() < 1e-12,
                                "{cells} {folded} {row} {cell}: {a} {b}"
                            );
                        }
                    }
                }
            }
        }
    }
}
