//! The operator between strips: how much the surface displacement changes from one observation point of a segment
//! to the next, per unit traction on every cell.
//!
//! Every segment with `n` cells has `n + 3` observation points in the order of x: its `n` nodes, its leading edge, and
//! the images of its last two nodes behind that edge. Their `n + 2` consecutive differences are all that the
//! discretisation rules need, and differences, unlike displacements, do not lose digits when they are combined.
//! The matrix depends on the mesh and Poisson's ratio only. Tractions are in any unit, displacement differences come
//! out in (that unit / G) × (length unit of the mesh).

use std::ops::ControlFlow;

use pulp::{Arch, NullaryFnOnce, Simd, WithSimd};

use crate::contact::influence::logarithm::ln;
use crate::contact::mesh::{Mesh, Segment};
use crate::contact::monitor::{Monitor, Stop};

/// Values per cell are padded to a multiple of this, so that products need no remainder loop.
const LANES: usize = 8;

/// Which part of a mirror-symmetric problem the unknowns belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// T_x is the same and T_y the opposite at the mirrored cell: longitudinal creepage.
    Longitudinal,
    /// T_x is the opposite and T_y the same at the mirrored cell: lateral creepage and spin.
    Lateral,
}

/// How the matrix is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// Row `[xx | xy | yy]` over all cells.
    Full,
    /// Rows of the first half of the segments only, `[xx+ | xx− | xy+ | xy− | yy+ | yy−]` over the cells of that half,
    /// where `±` adds or subtracts the influence of the mirrored cell.
    Folded,
}

/// Displacement differences of all segments, see the module's text.
#[derive(Debug, Clone)]
pub struct Differences {
    layout: Layout,
    /// Cells of the whole mesh.
    cells: usize,
    /// Length of a block of a row.
    stride: usize,
    /// First row of each stored segment, and one more.
    first_row: Vec<usize>,
    /// First cell of each stored segment, and one more.
    first_cell: Vec<usize>,
    matrix: Vec<f64>,
}

/// Number of difference rows of a segment with `cells` cells.
#[must_use]
pub fn rows_of(cells: usize) -> usize {
    cells + 2
}

/// Bytes of the matrix of a mesh.
#[must_use]
pub fn bytes(cells: usize, segments: usize, folded: bool) -> u64 {
    let (rows, cells) = (
        (cells + 2 * segments) as u64,
        (cells as u64).next_multiple_of(LANES as u64),
    );
    let full = 8 * 3 * rows * cells;
    if folded { full / 2 } else { full }
}

/// The observation points of a segment, see the module's text.
#[must_use]
pub fn observation_points(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let nodes = &mesh.node[segment.cells.clone()];
    let edge = segment.chord.right;
    let n = nodes.len();
    let last = nodes[n - 1];
    let before = if n > 1 {
        nodes[n - 2]
    } else {
        segment.chord.left
    };
    let mut points = nodes.to_vec();
    points.extend([edge, 2.0 * edge - last, 2.0 * edge - before]);
    points
}

impl Differences {
    /// Computes the matrix; with `folded`, the mesh must have a mirror line.
    ///
    /// # Errors
    /// The monitor is asked once per segment and may stop the work.
    pub fn new(
        mesh: &Mesh,
        nu: f64,
        folded: bool,
        monitor: &dyn Monitor,
    ) -> Result<Differences, Stop> {
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
        let mut first_row = vec![0];
        let mut first_cell = vec![0];
        for segment in &mesh.segments[..stored] {
            first_row.push(first_row[first_row.len() - 1] + rows_of(segment.cells.len()));
            first_cell.push(segment.cells.end);
        }
        let blocks = if folded { 6 } else { 3 };
        let rows = first_row[stored];
        let mut matrix = vec![0.0; rows * blocks * stride];
        let mut edges = Edges::new(mesh);
        let arch = Arch::new();
        for (j, segment) in mesh.segments[..stored].iter().enumerate() {
            if let ControlFlow::Break(stop) = monitor.tick(0.0) {
                return Err(stop);
            }
            let target =
                &mut matrix[first_row[j] * blocks * stride..first_row[j + 1] * blocks * stride];
            let points = observation_points(mesh, segment);
            edges.look_from(mesh, segment.chord.y);
            arch.dispatch(SegmentRows {
                edges: &mut edges,
                points: &points,
                mesh,
                nu,
                folded,
                stride,
                target,
            });
        }
        let layout = if folded { Layout::Folded } else { Layout::Full };
        Ok(Differences {
            layout,
            cells: mesh.cells(),
            stride,
            first_row,
            first_cell,
            matrix,
        })
    }

    /// Number of segments whose rows are stored: all, or half of them if folded.
    #[must_use]
    pub fn segments(&self) -> usize {
        self.first_row.len() - 1
    }

    /// Is only one half of a mirror-symmetric mesh stored?
    #[must_use]
    pub fn is_folded(&self) -> bool {
        self.layout == Layout::Folded
    }

    /// Rows of segment `j`.
    #[must_use]
    pub fn rows(&self, j: usize) -> std::ops::Range<usize> {
        self.first_row[j]..self.first_row[j + 1]
    }

    /// Number of stored rows.
    #[must_use]
    pub fn row_count(&self) -> usize {
        self.first_row[self.segments()]
    }

    /// Cells of segment `j`.
    #[must_use]
    pub fn cells(&self, j: usize) -> std::ops::Range<usize> {
        self.first_cell[j]..self.first_cell[j + 1]
    }

    /// Number of entries that one product with the given parity touches.
    #[must_use]
    pub fn entries(&self, parity: Option<Parity>) -> usize {
        let blocks = match (self.layout, parity) {
            (Layout::Full, _) => 3,
            (Layout::Folded, None) => 6,
            (Layout::Folded, Some(_)) => 4,
        };
        blocks * self.row_count() * self.stride
    }

    /// Length of a vector of values per cell: the cells of the unknowns, padded with zeros.
    #[must_use]
    pub fn padded(&self, parity: Option<Parity>) -> usize {
        match (self.layout, parity) {
            (Layout::Folded, None) => self.cells.next_multiple_of(LANES),
            _ => self.stride,
        }
    }

    fn block(&self, row: usize, block: usize) -> &[f64] {
        let blocks = if self.is_folded() { 6 } else { 3 };
        let start = (row * blocks + block) * self.stride;
        &self.matrix[start..start + self.stride]
    }

    /// The blocks that act as (xx, u_x from T_y, u_y from T_x, yy).
    fn roles(&self, parity: Option<Parity>) -> [usize; 4] {
        match (self.layout, parity) {
            (Layout::Full, _) => [0, 1, 1, 2],
            (Layout::Folded, Some(Parity::Lateral)) => [1, 2, 3, 4],
            (Layout::Folded, _) => [0, 3, 2, 5],
        }
    }

    /// Entry of the segment's own block: the change of u_x per T_x (or u_y per T_y) in row `row` of the matrix from
    /// cell `cell`. Own blocks have no cross terms in a full matrix; in a folded one they are left out.
    #[must_use]
    pub fn own(&self, row: usize, cell: usize, parity: Option<Parity>) -> (f64, f64) {
        if self.is_folded() && parity.is_none() {
            let half = |k: usize| 0.5 * (self.block(row, k)[cell] + self.block(row, k + 1)[cell]);
            return (half(0), half(4));
        }
        let [xx, _, _, yy] = self.roles(parity);
        (self.block(row, xx)[cell], self.block(row, yy)[cell])
    }

    /// Any entry of the matrix that [`apply`](Self::apply) stands for, as `[xx, xy, yx, yy]`: the change of u_x per T_x
    /// and per T_y, then of u_y. Without parity, rows and cells are counted over the whole mesh.
    #[must_use]
    pub fn entry(&self, parity: Option<Parity>, row: usize, cell: usize) -> [f64; 4] {
        if self.is_folded() && parity.is_none() {
            return self.unfolded_entry(row, cell);
        }
        self.roles(parity).map(|block| self.block(row, block)[cell])
    }

    /// An entry of the whole mesh from the stored half: a mirrored row sees the mirrored cell with `T_y` turned round.
    fn unfolded_entry(&self, row: usize, cell: usize) -> [f64; 4] {
        let (row, cell, side) = if row < self.row_count() {
            (row, cell, 1.0)
        } else {
            let row = mirror_image(&self.first_row, row);
            (row, mirror_image(&self.first_cell, cell), -1.0)
        };
        let (cell, sign) = if cell < self.first_cell[self.segments()] {
            (cell, 0.5)
        } else {
            (mirror_image(&self.first_cell, cell), -0.5)
        };
        let part = |k: usize| 0.5 * self.block(row, k)[cell] + sign * self.block(row, k + 1)[cell];
        let cross = side * part(2);
        [part(0), cross, cross, part(4)]
    }

    /// Displacement differences `out_x`, `out_y` (one value per row) caused by tractions `tx`, `ty`.
    ///
    /// Without parity, vectors cover the whole mesh: rows of the mirrored half follow in the order of their segments.
    pub fn apply(
        &self,
        parity: Option<Parity>,
        tx: &[f64],
        ty: &[f64],
        out_x: &mut [f64],
        out_y: &mut [f64],
    ) {
        if self.is_folded() && parity.is_none() {
            self.apply_both(tx, ty, out_x, out_y);
        } else {
            let roles = self.roles(parity);
            Arch::new().dispatch(Product {
                differences: self,
                roles,
                tx,
                ty,
                out_x,
                out_y,
            });
        }
    }

    /// Splits the tractions into their two parities, applies each part, and puts the halves together again.
    fn apply_both(&self, tx: &[f64], ty: &[f64], out_x: &mut [f64], out_y: &mut [f64]) {
        let (stride, rows) = (self.stride, self.row_count());
        let mut parts = vec![0.0; 4 * stride];
        let (x_parts, y_parts) = parts.split_at_mut(2 * stride);
        self.split(tx, x_parts);
        self.split(ty, y_parts);
        let ((x_same, x_opposite), (y_same, y_opposite)) =
            (x_parts.split_at(stride), y_parts.split_at(stride));
        let mut sums = vec![0.0; 4 * rows];
        let (first, second) = sums.split_at_mut(2 * rows);
        let ((ux_same, uy_opposite), (ux_opposite, uy_same)) =
            (first.split_at_mut(rows), second.split_at_mut(rows));
        let arch = Arch::new();
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
            arch.dispatch(Product {
                differences: self,
                roles,
                tx,
                ty,
                out_x,
                out_y,
            });
        }
        self.join(ux_same, ux_opposite, out_x);
        self.join(uy_same, uy_opposite, out_y);
    }

    /// Halves of the sum and of the difference of a cell's value and its mirror image's.
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
            let rows = self.rows(j);
            let image = total - rows.end;
            for (k, i) in rows.enumerate() {
                out[i] = same[i] + opposite[i];
                out[image + k] = same[i] - opposite[i];
            }
        }
    }
}

/// The place of `i` in the mirrored segment; `first` has the starts of the first half of the segments, and its end.
fn mirror_image(first: &[usize], i: usize) -> usize {
    let half = first[first.len() - 1];
    if i < half {
        let j = first.partition_point(|start| *start <= i) - 1;
        2 * half - first[j + 1] + i - first[j]
    } else {
        let j = first.partition_point(|start| *start < 2 * half - i) - 1;
        first[j] + first[j + 1] + i - 2 * half
    }
}

/// All cell edges of a mesh, as seen from the mid-line of one strip.
struct Edges {
    /// x of every edge, segment by segment.
    x: Vec<f64>,
    /// Distance in y from the strip's smaller-y side, and its logarithm (0 for distance 0).
    q1: Vec<f64>,
    q2: Vec<f64>,
    ln_q1: Vec<f64>,
    ln_q2: Vec<f64>,
    /// Per edge, at the point in work and at the one before: the three corner sums over the two y.
    now: [Vec<f64>; 3],
    before: [Vec<f64>; 3],
    /// One row over all cells: xx, xy, yy.
    row: [Vec<f64>; 3],
}

impl Edges {
    fn new(mesh: &Mesh) -> Edges {
        let mut x = Vec::with_capacity(mesh.cells() + mesh.segments.len());
        for segment in &mesh.segments {
            x.extend_from_slice(&mesh.left[segment.cells.clone()]);
            x.push(mesh.right[segment.cells.end - 1]);
        }
        let edges = || vec![0.0; x.len()];
        let cells = || vec![0.0; mesh.cells()];
        Edges {
            q1: edges(),
            q2: edges(),
            ln_q1: edges(),
            ln_q2: edges(),
            now: [edges(), edges(), edges()],
            before: [edges(), edges(), edges()],
            row: [cells(), cells(), cells()],
            x,
        }
    }

    fn look_from(&mut self, mesh: &Mesh, y: f64) {
        let ln_or_zero = |q: f64| if q == 0.0 { 0.0 } else { q.abs().ln() };
        let mut start = 0;
        for segment in &mesh.segments {
            let end = start + segment.cells.len() + 1;
            let (middle, half) = (y - segment.chord.y, 0.5 * segment.chord.dy);
            for (values, value) in [
                (&mut self.q1, middle + half),
                (&mut self.q2, middle - half),
                (&mut self.ln_q1, ln_or_zero(middle + half)),
                (&mut self.ln_q2, ln_or_zero(middle - half)),
            ] {
                values[start..end].fill(value);
            }
            start = end;
        }
    }

    /// Corner sums over the two y at every edge: `[q asinh(p/|q|)]`, `[p asinh(q/|p|)]`, `[r]`, each the value at `q1`
    /// less that at `q2`. The differences of `asinh` are logarithms of one ratio, so nothing cancels for small strips.
    #[inline(always)]
    fn corner_sums(&mut self, x: f64) {
        const TINY: f64 = 1e-290;
        let n = self.x.len();
        let (xe, q1s, q2s) = (&self.x[..n], &self.q1[..n], &self.q2[..n]);
        let (ln_q1s, ln_q2s) = (&self.ln_q1[..n], &self.ln_q2[..n]);
        let [out_a, out_b, out_r] = &mut self.now;
        let (out_a, out_b, out_r) = (&mut out_a[..n], &mut out_b[..n], &mut out_r[..n]);
        for e in 0..n {
            let (q1, q2) = (q1s[e], q2s[e]);
            let p = x - xe[e];
            let distance = p.abs();
            let pp = p * p;
            let (r1, r2) = ((pp + q1 * q1).sqrt(), (pp + q2 * q2).sqrt());
            let along1 = q1 * (ln(distance + r1 + TINY) - ln_q1s[e]);
            let along2 = q2 * (ln(distance + r2 + TINY) - ln_q2s[e]);
            out_a[e] = if p < 0.0 {
                along2 - along1
            } else {
                along1 - along2
            };
            let (g1, g2) = (q1.abs() + r1, q2.abs() + r2);
            let (above, below) = if q2 >= 0.0 {
                (g1, g2)
            } else if q1 <= 0.0 {
                (g2, g1)
            } else {
                (g1 * g2, pp)
            };
            out_b[e] = p * ln((above + TINY) / (below + TINY));
            out_r[e] = r1 - r2;
        }
    }

    /// Turns the change of the corner sums since the point before into a row over all cells.
    #[inline(always)]
    fn row(&mut self, mesh: &Mesh, nu: f64) {
        use std::f64::consts::FRAC_1_PI;
        let mut edge = 0;
        for segment in &mesh.segments {
            let cells = segment.cells.clone();
            let n = cells.len();
            let change = |k: usize| {
                let (now, before) = (
                    &self.now[k][edge..=edge + n],
                    &self.before[k][edge..=edge + n],
                );
                move |i: usize| (now[i] - before[i]) - (now[i + 1] - before[i + 1])
            };
            let (a, b, r) = (change(0), change(1), change(2));
            let [xx, xy, yy] = &mut self.row;
            let (xx, xy, yy) = (
                &mut xx[cells.clone()],
                &mut xy[cells.clone()],
                &mut yy[cells],
            );
            for i in 0..n {
                let (a, b) = (a(i), b(i));
                xx[i] = FRAC_1_PI * (a + (1.0 - nu) * b);
                xy[i] = -FRAC_1_PI * nu * r(i);
                yy[i] = FRAC_1_PI * (b + (1.0 - nu) * a);
            }
            edge += n + 1;
        }
    }
}

/// Computes all rows of one segment.
struct SegmentRows<'a> {
    edges: &'a mut Edges,
    points: &'a [f64],
    mesh: &'a Mesh,
    nu: f64,
    folded: bool,
    stride: usize,
    target: &'a mut [f64],
}

impl NullaryFnOnce for SegmentRows<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let SegmentRows {
            edges,
            points,
            mesh,
            nu,
            folded,
            stride,
            target,
        } = self;
        edges.corner_sums(points[0]);
        let row_length = if folded { 6 * stride } else { 3 * stride };
        for (point, out) in points[1..].iter().zip(target.chunks_exact_mut(row_length)) {
            std::mem::swap(&mut edges.now, &mut edges.before);
            edges.corner_sums(*point);
            edges.row(mesh, nu);
            for (k, values) in edges.row.iter().enumerate() {
                if folded {
                    let (plus, minus) =
                        out[2 * k * stride..2 * (k + 1) * stride].split_at_mut(stride);
                    fold(mesh, values, plus, minus);
                } else {
                    out[k * stride..k * stride + values.len()].copy_from_slice(values);
                }
            }
        }
    }
}

/// Adds and subtracts the value of the mirrored cell for the first half of the segments.
#[inline(always)]
fn fold(mesh: &Mesh, values: &[f64], plus: &mut [f64], minus: &mut [f64]) {
    let m = mesh.segments.len();
    for (here, there) in mesh.segments[..m / 2]
        .iter()
        .zip(mesh.segments.iter().rev())
    {
        let here = here.cells.clone();
        let (own, image) = (&values[here.clone()], &values[there.cells.clone()]);
        let (plus, minus) = (&mut plus[here.clone()], &mut minus[here]);
        for i in 0..own.len() {
            plus[i] = own[i] + image[i];
            minus[i] = own[i] - image[i];
        }
    }
}

/// `out_x = xx tx + a ty`, `out_y = b tx + yy ty` row by row.
struct Product<'a> {
    differences: &'a Differences,
    roles: [usize; 4],
    tx: &'a [f64],
    ty: &'a [f64],
    out_x: &'a mut [f64],
    out_y: &'a mut [f64],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Product {
            differences,
            roles,
            tx,
            ty,
            out_x,
            out_y,
        } = self;
        let stride = differences.stride;
        let (tx, _) = S::as_simd_f64s(&tx[..stride]);
        let (ty, _) = S::as_simd_f64s(&ty[..stride]);
        for row in 0..differences.row_count() {
            let [xx, a, b, yy] = roles.map(|k| S::as_simd_f64s(differences.block(row, k)).0);
            let (xx, a, b, yy) = (
                &xx[..tx.len()],
                &a[..tx.len()],
                &b[..tx.len()],
                &yy[..tx.len()],
            );
            let ty = &ty[..tx.len()];
            let zero = simd.splat_f64s(0.0);
            let [mut s0, mut s1, mut s2, mut s3] = [zero; 4];
            for i in 0..tx.len() {
                s0 = simd.mul_add_e_f64s(xx[i], tx[i], s0);
                s1 = simd.mul_add_e_f64s(a[i], ty[i], s1);
                s2 = simd.mul_add_e_f64s(b[i], tx[i], s2);
                s3 = simd.mul_add_e_f64s(yy[i], ty[i], s3);
            }
            out_x[row] = simd.reduce_sum_f64s(simd.add_f64s(s0, s1));
            out_y[row] = simd.reduce_sum_f64s(simd.add_f64s(s2, s3));
        }
    }
}

#[cfg(test)]
mod tests;
