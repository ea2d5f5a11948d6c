//! Displacements that the pressures of one grid cause on another grid: exact between near cells, interpolated between far ones.
//!
//! Two boxes of cells that are as far from each other as half their longest side act on each other through Chebyshev points in
//! either box, between which the kernel `1/(πE* r)` is interpolated (Börm, Grasedyck and Hackbusch 2003). Boxes nearer than
//! this are halved until they are far enough or hold few cells; between these the coefficients of rectangles are summed.

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::contact::normal::gap::grid::PressureGrid;
use crate::contact::normal::gap::near_cells::NearCells;

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
