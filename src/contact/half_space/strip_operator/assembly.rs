//! Rows of the strip operator: corner sums of the closed forms over all cell edges, and their differences.

use std::ops::{ControlFlow, Range};

use pulp::NullaryFnOnce;

use crate::half_space::strip_operator::product::blocks;
use crate::mesh::{Mesh, observe};
use crate::monitor::{Monitor, Stop};
use crate::numerics::simd;
use crate::numerics::simd::Float;

/// All cell edges of a mesh relative to the mid-line of one strip.
pub(crate) struct CellEdges<T> {
    /// x of every edge, segment by segment.
    x: Vec<T>,
    /// Distances in y from the sides of the cells' strips with smaller and larger y.
    q1: Vec<T>,
    q2: Vec<T>,
    /// Logarithms of these distances; 0 for distance 0.
    ln_q1: Vec<T>,
    ln_q2: Vec<T>,
    /// The three corner sums over the two y, per edge, at the present point and at the one before.
    now: [Vec<T>; 3],
    before: [Vec<T>; 3],
    /// One row: xx, xy, yy between every edge and the next. Entries between different strips are meaningless.
    row: [Vec<T>; 3],
}

impl<T: Float> CellEdges<T> {
    pub(crate) fn new(mesh: &Mesh) -> CellEdges<T> {
        let mut x: Vec<T> = Vec::with_capacity(mesh.cells() + mesh.segments.len());
        for segment in &mesh.segments {
            x.extend(mesh.left[segment.cells.clone()].iter().map(|x| T::of(*x)));
            x.push(T::of(mesh.right[segment.cells.end - 1]));
        }
        let edges = || vec![T::ZERO; x.len()];
        CellEdges {
            q1: edges(),
            q2: edges(),
            ln_q1: edges(),
            ln_q2: edges(),
            now: [edges(), edges(), edges()],
            before: [edges(), edges(), edges()],
            row: [edges(), edges(), edges()],
            x,
        }
    }

    pub(crate) fn observe_from(&mut self, mesh: &Mesh, y: f64) {
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
                values[start..end].fill(T::of(value));
            }
            start = end;
        }
    }

    /// Corner sums over the two y at every edge: `[q asinh(p/|q|)]`, `[p asinh(q/|p|)]`, `[r]`, each the value at `q1` minus that at `q2`. Differences of `asinh` are logarithms
    /// of one ratio, so nothing cancels for narrow strips.
    #[inline(always)]
    fn corner_sums(&mut self, x: f64) {
        let x = T::of(x);
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
            // `TINY` keeps the logarithm finite at the corner, where its factor is 0.
            let along1 = q1 * ((distance + r1 + T::TINY).ln() - ln_q1s[e]);
            let along2 = q2 * ((distance + r2 + T::TINY).ln() - ln_q2s[e]);
            out_a[e] = if p < T::ZERO {
                along2 - along1
            } else {
                along1 - along2
            };
            let (g1, g2) = (q1.abs() + r1, q2.abs() + r2);
            // `|q| + r` is a sum of like signs, while `r − |q|` would cancel, so the ratio avoids it.
            let (above, below) = if q2 >= T::ZERO {
                (g1, g2)
            } else if q1 <= T::ZERO {
                (g2, g1)
            } else {
                (g1 * g2, pp)
            };
            out_b[e] = p * ((above + T::TINY) / (below + T::TINY)).ln();
            out_r[e] = r1 - r2;
        }
    }

    /// Computes a row from the change of the corner sums between two points. All edges are processed together, because the cells of one strip are too few for the SIMD lanes.
    #[inline(always)]
    fn row(&mut self, nu: f64) {
        use std::f64::consts::FRAC_1_PI;
        let (one, other) = (T::of(FRAC_1_PI), T::of(FRAC_1_PI * (1.0 - nu)));
        let cross = T::of(-FRAC_1_PI * nu);
        let n = self.x.len() - 1;
        let [now_a, now_b, now_r] = &self.now;
        let [before_a, before_b, before_r] = &self.before;
        let (now_a, now_b, now_r) = (&now_a[..=n], &now_b[..=n], &now_r[..=n]);
        let (before_a, before_b, before_r) = (&before_a[..=n], &before_b[..=n], &before_r[..=n]);
        let [xx, xy, yy] = &mut self.row;
        let (xx, xy, yy) = (&mut xx[..n], &mut xy[..n], &mut yy[..n]);
        for i in 0..n {
            let a = (now_a[i] - before_a[i]) - (now_a[i + 1] - before_a[i + 1]);
            let b = (now_b[i] - before_b[i]) - (now_b[i + 1] - before_b[i + 1]);
            let r = (now_r[i] - before_r[i]) - (now_r[i + 1] - before_r[i + 1]);
            xx[i] = one * a + other * b;
            xy[i] = cross * r;
            yy[i] = one * b + other * a;
        }
    }
}

/// A matrix to be computed.
pub(crate) struct OperatorAssembly<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) nu: f64,
    pub(crate) folded: bool,
    /// Length of a block of a row.
    pub(crate) stride: usize,
    /// First row of each stored segment, and the end of the last.
    pub(crate) first_row: &'a [usize],
}

impl OperatorAssembly<'_> {
    /// Computes all rows in order.
    pub(crate) fn matrix<T: Float>(&self, monitor: &dyn Monitor) -> Result<Vec<T>, Stop> {
        let rows = self.first_row[self.first_row.len() - 1];
        let row_length = blocks(self.folded) * self.stride;
        let mut matrix = vec![T::ZERO; rows * row_length];
        let mut edges = CellEdges::new(self.mesh);
        let mut points = Vec::new();
        let reversible = self.mesh.is_reversible();
        let places = self.first_row.windows(2);
        for (place, segment) in places.zip(&self.mesh.segments) {
            if let ControlFlow::Break(stop) = monitor.tick(0.0) {
                return Err(stop);
            }
            observe(self.mesh, segment, &mut points);
            edges.observe_from(self.mesh, segment.chord.y);
            simd::dispatch(SegmentRows {
                edges: &mut edges,
                points: &points,
                mesh: self.mesh,
                nu: self.nu,
                folded: self.folded,
                reversible,
                stride: self.stride,
                target: &mut matrix[place[0] * row_length..place[1] * row_length],
            });
        }
        Ok(matrix)
    }
}

/// Computes all rows of one segment.
pub(crate) struct SegmentRows<'a, T> {
    pub(crate) edges: &'a mut CellEdges<T>,
    pub(crate) points: &'a [f64],
    pub(crate) mesh: &'a Mesh,
    pub(crate) nu: f64,
    pub(crate) folded: bool,
    /// See [`Mesh::is_reversible`].
    pub(crate) reversible: bool,
    pub(crate) stride: usize,
    pub(crate) target: &'a mut [T],
}

impl<T: Float> NullaryFnOnce for SegmentRows<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let SegmentRows {
            edges,
            points,
            mesh,
            nu,
            folded,
            reversible,
            stride,
            target,
        } = self;
        let row_length = blocks(folded) * stride;
        // The rows between nodes of the trailing half are images of those of the leading half.
        let first = if reversible {
            (points.len() - 4) / 2
        } else {
            0
        };
        edges.corner_sums(points[first]);
        let rows = target.chunks_exact_mut(row_length).skip(first);
        for (point, out) in points[first + 1..].iter().zip(rows) {
            // Neighbouring rows share a point, whose sums are computed once.
            std::mem::swap(&mut edges.now, &mut edges.before);
            edges.corner_sums(*point);
            edges.row(nu);
            for (k, values) in edges.row.iter().enumerate() {
                if folded {
                    let (plus, minus) =
                        out[2 * k * stride..2 * (k + 1) * stride].split_at_mut(stride);
                    fold(mesh, values, plus, minus);
                } else {
                    let out = &mut out[k * stride..(k + 1) * stride];
                    for (number, segment) in mesh.segments.iter().enumerate() {
                        let cells = segment.cells.clone();
                        out[cells.clone()].copy_from_slice(&values[edges_of(cells, number)]);
                    }
                }
            }
        }
        for k in 0..first {
            let (head, tail) = target.split_at_mut((k + 1) * row_length);
            let image = &tail[(points.len() - 6 - 2 * k) * row_length..][..row_length];
            reverse(mesh, folded, stride, image, &mut head[k * row_length..]);
        }
    }
}

/// Writes the row whose points are the images of those of another row of a reversible mesh. Changes of `u_x` by `T_x` and of `u_y` by `T_y` reverse their sign, cross terms do
/// not.
#[inline(always)]
fn reverse<T: Float>(mesh: &Mesh, folded: bool, stride: usize, image: &[T], row: &mut [T]) {
    let (each, stored) = if folded {
        (2, mesh.segments.len() / 2)
    } else {
        (1, mesh.segments.len())
    };
    let blocks = image.chunks_exact(stride).zip(row.chunks_exact_mut(stride));
    for (block, (image, row)) in blocks.enumerate() {
        let crosses = block / each == 1;
        for segment in &mesh.segments[..stored] {
            let cells = segment.cells.clone();
            reverse_cells(&image[cells.clone()], &mut row[cells], !crosses);
        }
    }
}

/// Copies values in reverse order, with their signs changed on request.
#[inline(always)]
fn reverse_cells<T: Float>(from: &[T], to: &mut [T], negate: bool) {
    for (target, value) in to.iter_mut().zip(from.iter().rev()) {
        *target = if negate { -*value } else { *value };
    }
}

/// The first edges of the cells of a strip in the list of all edges.
#[inline(always)]
fn edges_of(cells: Range<usize>, strip: usize) -> Range<usize> {
    cells.start + strip..cells.end + strip
}

/// Adds and subtracts the value of the mirrored cell for the first half of the segments.
#[inline(always)]
fn fold<T: Float>(mesh: &Mesh, values: &[T], plus: &mut [T], minus: &mut [T]) {
    let m = mesh.segments.len();
    for (number, here) in mesh.segments[..m / 2].iter().enumerate() {
        let there = m - 1 - number;
        let own = &values[edges_of(here.cells.clone(), number)];
        let image = &values[edges_of(mesh.segments[there].cells.clone(), there)];
        let (plus, minus) = (
            &mut plus[here.cells.clone()],
            &mut minus[here.cells.clone()],
        );
        let images = own.iter().zip(image);
        for ((plus, minus), (own, image)) in plus.iter_mut().zip(minus).zip(images) {
            *plus = *own + *image;
            *minus = *own - *image;
        }
    }
}
