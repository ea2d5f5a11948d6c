//! Displacements that the pressures of one grid cause on another grid: exact between near cells, interpolated between far ones.
//!
//! Two boxes of cells that are as far from each other as half their longest side act on each other through Chebyshev points in
//! either box, between which the kernel `1/(πE* r)` is interpolated (Börm, Grasedyck and Hackbusch 2003). Boxes nearer than
//! this are halved until they are far enough or hold few cells; between these the coefficients of rectangles are summed.
//!
//! Displacements of some places by unit pressures on the cells of a regular grid nearby, by the closed form.
//!
//! The influence of several grids on each other, as one operator over all their cells.

use std::collections::HashMap;
use std::f64::consts::PI;
use std::ops::Range;

use pulp::NullaryFnOnce;

use crate::contact::half_space::grid_operator::{GridOperator, GridWorkspace};
use crate::contact::normal::gap::cell_sums::{CellWeights, LANES};
use crate::contact::normal::gap::conjugate_gradients::PressureInfluence;
use crate::contact::normal::gap::grid::PressureGrid;
use crate::contact::numerics::simd;
use crate::contact::numerics::simd::Float;

/// Chebyshev points per axis. Displacements differ from the exact sum by less than 5e-5 of the largest one that the other grid
/// causes (the test below; with 6 points by 1e-4). That is the error of interpolation alone: 11 points leave 2e-7.
const ORDER: usize = 7;
const POINTS: usize = ORDER * ORDER;
/// Distance of two boxes, relative to half their longest side, from which the kernel between them is interpolated.
const FAR: f64 = 1.0;
/// Boxes with no more cells than this are not halved.
const CELLS_FEW: usize = 24;
/// Two boxes with no more pairs of cells than this are summed directly, however far they are: interpolation takes as many products.
const PAIRS_FEW: usize = POINTS * POINTS;

/// The influence of one grid on another.
#[derive(Debug, Clone)]
pub(crate) struct Coupling {
    /// Cells along x of the grid acted on, and of the one that acts.
    widths: [usize; 2],
    near: Vec<Near>,
    /// Boxes of the grid acted on, and of the one that acts, that are far from others. Each is in several pairs.
    boxes: [Vec<PointsBox>; 2],
    far: Vec<Far>,
}

/// A rectangular part of a grid's cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Cells {
    first: [usize; 2],
    count: [usize; 2],
}

/// Two near boxes.
#[derive(Debug, Clone)]
struct Near {
    to: Cells,
    from: Cells,
    /// Coefficients in mm/MPa: for every cell that acts those of all acted on.
    coefficients: Vec<f32>,
}

/// A box with Chebyshev points: the values of their basis on its cells, per axis and for every cell `ORDER` of them.
#[derive(Debug, Clone)]
struct PointsBox {
    cells: Cells,
    basis: [Vec<f64>; 2],
}

/// Two far boxes, by their places in [`Coupling::boxes`].
#[derive(Debug, Clone)]
struct Far {
    to: usize,
    from: usize,
    /// The kernel in mm/N between their points: for every point that acts those of all acted on.
    kernel: Vec<f32>,
}

impl Coupling {
    /// Prepares the influence of `from` on `to`, two grids that do not overlap, for the contact modulus `E*` in MPa.
    pub(crate) fn new(to: &PressureGrid, from: &PressureGrid, contact_modulus: f64) -> Coupling {
        let mut near = Vec::new();
        let mut far = Vec::new();
        let mut boxes = [Vec::new(), Vec::new()];
        let mut places = [HashMap::new(), HashMap::new()];
        let mut pending = vec![(Cells::all(to), Cells::all(from))];
        while let Some((acted, acting)) = pending.pop() {
            let sizes = [acted.half_side(to), acting.half_side(from)];
            let distance = distance(acted.range(to), acting.range(from));
            let is_far = distance >= FAR * sizes[0].max(sizes[1]);
            let few = acted.number() * acting.number() <= PAIRS_FEW;
            let halves = [acted.halves(to), acting.halves(from)];
            match halves {
                _ if is_far && !few => {
                    let mut place = |side: usize, cells: Cells, points: &dyn Fn() -> PointsBox| {
                        *places[side].entry(cells).or_insert_with(|| {
                            boxes[side].push(points());
                            boxes[side].len() - 1
                        })
                    };
                    far.push(Far {
                        to: place(0, acted, &|| PointsBox::acted_on(to, acted)),
                        from: place(1, acting, &|| PointsBox::acting(from, acting)),
                        kernel: kernel([acted.range(to), acting.range(from)], contact_modulus),
                    });
                }
                // The larger of the two boxes is halved, or the one that can be.
                [Some(parts), other] if !is_far && (sizes[0] >= sizes[1] || other.is_none()) => {
                    pending.extend(parts.map(|part| (part, acting)));
                }
                [_, Some(parts)] if !is_far => {
                    pending.extend(parts.map(|part| (acted, part)));
                }
                _ => near.push(Near::new(to, from, acted, acting, contact_modulus)),
            }
        }
        Coupling {
            widths: [to.cells[0], from.cells[0]],
            near,
            boxes,
            far,
        }
    }

    /// Adds the displacements in mm that pressures in MPa on the acting grid cause.
    pub(crate) fn add(&self, pressure: &[f64], displacement: &mut [f64]) {
        let [to_width, from_width] = self.widths;
        let mut sums = Vec::new();
        for Near {
            to,
            from,
            coefficients,
        } in &self.near
        {
            sums.clear();
            sums.resize(to.number(), 0.0_f32);
            let columns = coefficients.chunks_exact(to.number());
            for (source, column) in from.cells(from_width).zip(columns) {
                let p = pressure[source] as f32;
                if p != 0.0 {
                    sums.iter_mut()
                        .zip(column)
                        .for_each(|(sum, c)| *sum += p * c);
                }
            }
            for (cell, sum) in to.cells(to_width).zip(&sums) {
                displacement[cell] += f64::from(*sum);
            }
        }
        let [acted, acting] = &self.boxes;
        let moments = acting.iter().map(|from| from.moments(pressure, from_width));
        let moments: Vec<[f32; POINTS]> = moments.collect();
        let mut values = vec![[0.0_f32; POINTS]; acted.len()];
        for Far { to, from, kernel } in &self.far {
            let values = &mut values[*to];
            for (column, moment) in kernel.chunks_exact(POINTS).zip(&moments[*from]) {
                let sums = values.iter_mut().zip(column);
                sums.for_each(|(value, k)| *value += moment * k);
            }
        }
        for (to, values) in acted.iter().zip(&values) {
            to.spread(values, to_width, displacement);
        }
    }
}

impl PointsBox {
    /// A box of cells at whose centres displacements are wanted.
    fn acted_on(grid: &PressureGrid, cells: Cells) -> PointsBox {
        let points = cells.range(grid).map(chebyshev);
        let at_centres = |k: usize| -> Vec<f64> {
            let centres = grid.centres(k);
            let cells = cells.first[k]..cells.first[k] + cells.count[k];
            cells.flat_map(|i| basis(&points[k], centres[i])).collect()
        };
        PointsBox {
            cells,
            basis: [at_centres(0), at_centres(1)],
        }
    }

    /// A box of cells that press; the basis along x is times the area of a cell in mm².
    fn acting(grid: &PressureGrid, cells: Cells) -> PointsBox {
        let points = cells.range(grid).map(chebyshev);
        let area = grid.step[0] * grid.step[1];
        // Means over the cells by three points of Gauss, times the area once.
        let over_cells = |k: usize| -> Vec<f64> {
            let centres = grid.centres(k);
            let cells = cells.first[k]..cells.first[k] + cells.count[k];
            let off = 0.5 * grid.step[k] * 0.6_f64.sqrt();
            let factor = if k == 0 { area } else { 1.0 };
            let mean = |i: usize| {
                let [low, middle, high] =
                    [-off, 0.0, off].map(|off| basis(&points[k], centres[i] + off));
                let mean = |a: usize| (5.0 * (low[a] + high[a]) + 8.0 * middle[a]) / 18.0;
                std::array::from_fn::<f64, ORDER, _>(|a| factor * mean(a))
            };
            cells.flat_map(mean).collect()
        };
        PointsBox {
            cells,
            basis: [over_cells(0), over_cells(1)],
        }
    }

    /// Sums of the pressures with the products of the basis along both axes, at `b * ORDER + a`, in N.
    fn moments(&self, pressure: &[f64], width: usize) -> [f32; POINTS] {
        let PointsBox { cells, basis } = self;
        let mut moments = [0.0; POINTS];
        for (j, across) in basis[1].chunks_exact(ORDER).enumerate() {
            let first = (cells.first[1] + j) * width + cells.first[0];
            let row = &pressure[first..first + cells.count[0]];
            let mut sums = [0.0; ORDER];
            for (p, along) in row.iter().zip(basis[0].chunks_exact(ORDER)) {
                if *p != 0.0 {
                    sums.iter_mut()
                        .zip(along)
                        .for_each(|(sum, a)| *sum += p * a);
                }
            }
            for (line, b) in moments.chunks_exact_mut(ORDER).zip(across) {
                line.iter_mut().zip(sums).for_each(|(m, sum)| *m += b * sum);
            }
        }
        moments.map(|moment: f64| moment as f32)
    }

    /// Adds the values at the points, interpolated to the cells.
    fn spread(&self, values: &[f32; POINTS], width: usize, to: &mut [f64]) {
        let PointsBox { cells, basis } = self;
        for (j, across) in basis[1].chunks_exact(ORDER).enumerate() {
            let mut line = [0.0; ORDER];
            for (row, b) in values.chunks_exact(ORDER).zip(across) {
                line.iter_mut()
                    .zip(row)
                    .for_each(|(sum, v)| *sum += b * f64::from(*v));
            }
            let first = (cells.first[1] + j) * width + cells.first[0];
            let row = &mut to[first..first + cells.count[0]];
            for (u, along) in row.iter_mut().zip(basis[0].chunks_exact(ORDER)) {
                *u += line.iter().zip(along).map(|(v, a)| v * a).sum::<f64>();
            }
        }
    }
}

/// The kernel `1/(πE* r)` between the points of a box acted on and of one that acts, in mm/N: see [`Far`].
fn kernel([to, from]: [[[f64; 2]; 2]; 2], contact_modulus: f64) -> Vec<f32> {
    let there = to.map(chebyshev);
    let here = from.map(chebyshev);
    let mut kernel = Vec::with_capacity(POINTS * POINTS);
    for (v, u) in product(&here) {
        kernel.extend(product(&there).map(|(y, x)| {
            let squared = (x - u) * (x - u) + (y - v) * (y - v);
            (1.0 / (PI * contact_modulus * squared.sqrt())) as f32
        }));
    }
    kernel
}

fn chebyshev([low, high]: [f64; 2]) -> [f64; ORDER] {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    std::array::from_fn(|k| middle + half * (PI * (k as f64 + 0.5) / ORDER as f64).cos())
}

impl Cells {
    fn all(grid: &PressureGrid) -> Cells {
        Cells {
            first: [0; 2],
            count: grid.cells,
        }
    }

    fn number(self) -> usize {
        self.count[0] * self.count[1]
    }

    /// The box of these cells in mm.
    fn range(self, grid: &PressureGrid) -> [[f64; 2]; 2] {
        [0, 1].map(|k| {
            let low = grid.range(k)[0];
            [self.first[k], self.first[k] + self.count[k]].map(|i| low + i as f64 * grid.step[k])
        })
    }

    /// Half the longer side of the box in mm.
    fn half_side(self, grid: &PressureGrid) -> f64 {
        let side = |k: usize| 0.5 * self.count[k] as f64 * grid.step[k];
        side(0).max(side(1))
    }

    /// Two halves along the longer side; none of few cells.
    fn halves(self, grid: &PressureGrid) -> Option<[Cells; 2]> {
        if self.number() <= CELLS_FEW {
            return None;
        }
        let side = |k: usize| self.count[k] as f64 * grid.step[k];
        let longer = usize::from(side(1) > side(0));
        let axis = if self.count[longer] > 1 {
            longer
        } else {
            1 - longer
        };
        let (mut low, mut high) = (self, self);
        low.count[axis] /= 2;
        high.first[axis] += low.count[axis];
        high.count[axis] -= low.count[axis];
        Some([low, high])
    }

    /// Indices in a grid with `width` cells along x.
    fn cells(self, width: usize) -> impl Iterator<Item = usize> {
        let rows = self.first[1]..self.first[1] + self.count[1];
        rows.flat_map(move |j| {
            let first = j * width + self.first[0];
            first..first + self.count[0]
        })
    }
}

impl Near {
    fn new(
        to: &PressureGrid,
        from: &PressureGrid,
        acted: Cells,
        acting: Cells,
        contact_modulus: f64,
    ) -> Near {
        let centres = [to.centres(0), to.centres(1)];
        let of_cells = |axis: usize| -> Vec<f64> {
            let index = |cell: usize| [cell % to.cells[0], cell / to.cells[0]][axis];
            let cells = acted.cells(to.cells[0]);
            cells.map(|cell| centres[axis][index(cell)]).collect()
        };
        let edges = |axis: usize| -> Vec<f64> {
            let low = from.range(axis)[0];
            let first = acting.first[axis];
            let edges = first..=first + acting.count[axis];
            edges.map(|i| low + i as f64 * from.step[axis]).collect()
        };
        let cells = NearCells {
            places: [&of_cells(0), &of_cells(1)],
            edges: [&edges(0), &edges(1)],
            contact_modulus,
        };
        let coefficients = cells.coefficients();
        Near {
            to: acted,
            from: acting,
            coefficients,
        }
    }
}

/// All pairs `(y, x)` of points, x first.
fn product(points: &[[f64; ORDER]; 2]) -> impl Iterator<Item = (f64, f64)> + '_ {
    let [x, y] = points;
    y.iter().flat_map(move |y| x.iter().map(move |x| (*y, *x)))
}

/// Lagrange's polynomials through the points, at one place.
fn basis(points: &[f64; ORDER], at: f64) -> [f64; ORDER] {
    std::array::from_fn(|a| {
        (0..ORDER)
            .filter(|b| *b != a)
            .map(|b| (at - points[b]) / (points[a] - points[b]))
            .product()
    })
}

/// Distance of two boxes.
fn distance(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> f64 {
    let apart = |k: usize| {
        (one[k][0] - other[k][1])
            .max(other[k][0] - one[k][1])
            .max(0.0)
    };
    apart(0).hypot(apart(1))
}

/// Places where displacements are wanted, and a block of cells that press.
pub(crate) struct NearCells<'a> {
    /// x and y of the places in mm.
    pub(crate) places: [&'a [f64]; 2],
    /// Edges of the cells along x and y in mm, in rising order.
    pub(crate) edges: [&'a [f64]; 2],
    /// Contact modulus `E*` in MPa.
    pub(crate) contact_modulus: f64,
}

impl NearCells<'_> {
    /// Displacements in mm/MPa: for every cell, x fastest, those of all places.
    ///
    /// The coefficient [`rectangle`](crate::contact::half_space::kernels::rectangle) calls `zz`, as differences of values at the corners, which
    /// neighbouring cells share. They lose digits with the square of the distance over the side of a cell: at a distance of 1000 sides ten are left.
    pub(crate) fn coefficients(self) -> Vec<f32> {
        simd::dispatch(self)
    }
}

impl NullaryFnOnce for NearCells<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let [x, y] = self.places;
        let [along, across] = self.edges;
        let factor = 1.0 / (PI * self.contact_modulus);
        let count = x.len();
        let (mut lower, mut upper) = (
            vec![0.0; along.len() * count],
            vec![0.0; along.len() * count],
        );
        let cells = (along.len() - 1) * (across.len() - 1);
        let mut out = Vec::with_capacity(cells * count);
        for (j, v) in across.iter().enumerate() {
            std::mem::swap(&mut lower, &mut upper);
            for (column, u) in upper.chunks_exact_mut(count).zip(along) {
                for ((value, x), y) in column.iter_mut().zip(x).zip(y) {
                    *value = corner(x - u, y - v);
                }
            }
            if j == 0 {
                continue;
            }
            let between =
                |row: &[f64], i: usize, k: usize| row[i * count + k] - row[(i + 1) * count + k];
            for i in 0..along.len() - 1 {
                out.extend(
                    (0..count)
                        .map(|k| (factor * (between(&lower, i, k) - between(&upper, i, k))) as f32),
                );
            }
        }
        out
    }
}

/// `p asinh(q/|p|) + q asinh(p/|q|)`, 0 on either axis.
#[inline(always)]
fn corner(p: f64, q: f64) -> f64 {
    let (a, b) = (p.abs().max(f64::TINY), q.abs().max(f64::TINY));
    let r = (a * a + b * b).sqrt();
    let value = a * Float::ln((b + r) / a) + b * Float::ln((a + r) / b);
    if p * q < 0.0 { -value } else { value }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    const MODULUS: f64 = 115_000.0;

    fn exact(to: &PressureGrid, from: &PressureGrid, pressure: &[f64]) -> Vec<f64> {
        let Near { coefficients, .. } =
            Near::new(to, from, Cells::all(to), Cells::all(from), MODULUS);
        let mut sums = vec![0.0; to.cells[0] * to.cells[1]];
        for (column, p) in coefficients.chunks_exact(sums.len()).zip(pressure) {
            for (sum, c) in sums.iter_mut().zip(column) {
                *sum += f64::from(*c) * p;
            }
        }
        sums
    }

    fn dome(grid: &PressureGrid) -> Vec<f64> {
        let [x, y] = [grid.centres(0), grid.centres(1)];
        let part = |k: usize, axis: &[f64]| {
            let last = axis.len() - 1;
            (2.0 * axis[k] - axis[0] - axis[last]) / (axis[last] - axis[0])
        };
        (0..x.len() * y.len())
            .map(|k| {
                let (u, v) = (part(k % x.len(), &x), part(k / x.len(), &y));
                (1.0 - u * u - v * v).max(0.0).sqrt() * (1.0 + 0.3 * u)
            })
            .collect()
    }

    #[test]
    fn far_near_and_adjoining_grids_act_as_the_sum_over_all_cells_says() {
        let large = PressureGrid::new([[-5.0, 5.0], [-6.0, 6.0]], [40, 48], [false; 2]);
        for (window, cells) in [
            ([[-0.4, 0.5], [14.0, 14.8]], [20, 22]),
            ([[-0.4, 0.5], [6.5, 7.3]], [20, 22]),
            ([[-4.0, 4.0], [6.0, 6.7]], [30, 20]),
            ([[5.0, 15.0], [-6.0, 6.0]], [24, 31]),
        ] {
            let small = PressureGrid::new(window, cells, [false; 2]);
            for (to, from) in [(&large, &small), (&small, &large)] {
                let pressure = dome(from);
                let expected = exact(to, from, &pressure);
                let mut found = vec![0.0; expected.len()];
                Coupling::new(to, from, MODULUS).add(&pressure, &mut found);
                let largest = expected.iter().copied().fold(0.0, f64::max);
                for (a, b) in found.iter().zip(&expected) {
                    assert!((a - b).abs() < 5e-5 * largest, "{window:?}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn far_grids_take_one_block() {
        let large = PressureGrid::new([[-5.0, 5.0], [-6.0, 6.0]], [44, 44], [false; 2]);
        let small = PressureGrid::new([[-0.4, 0.5], [14.0, 14.8]], [24, 24], [false; 2]);
        let coupling = Coupling::new(&large, &small, MODULUS);
        assert_eq!([coupling.near.len(), coupling.far.len()], [0, 1]);
    }
}

#[cfg(test)]
mod near_cells_tests {
    use super::*;
    use crate::contact::half_space::kernels::{Rectangle, rectangle};

    #[test]
    fn coefficients_are_those_of_the_rectangles() {
        // Inside, on edges and corners, and far away.
        let places = [
            [0.1, 0.3, 0.7, -2.0, 300.0, 0.3],
            [0.05, 0.2, 0.4, 0.2, -90.0, 1.0],
        ];
        let edges = [[0.0, 0.3, 0.6, 0.9], [0.2, 0.4, 0.6, 0.8]];
        let found = NearCells {
            places: [&places[0], &places[1]],
            edges: [&edges[0], &edges[1]],
            contact_modulus: 2.0,
        };
        let found = found.coefficients();
        assert_eq!(found.len(), 54);
        for (k, found) in found.into_iter().enumerate() {
            let (cell, place) = (k / 6, k % 6);
            let (i, j) = (cell % 3, cell / 3);
            let pressed = Rectangle {
                x0: edges[0][i],
                x1: edges[0][i + 1],
                y0: edges[1][j],
                y1: edges[1][j + 1],
            };
            let exact = 0.5 * rectangle(places[0][place], places[1][place], pressed, 0.0).zz;
            assert!(
                (f64::from(found) / exact - 1.0).abs() < 1e-6,
                "{cell} {place}"
            );
        }
    }
}
