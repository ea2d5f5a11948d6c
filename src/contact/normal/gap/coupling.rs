//! Displacements that the pressures of one grid cause on another grid: exact between near cells, interpolated between far ones.
//!
//! Two boxes of cells that are as far from each other as half their longest side act on each other through Chebyshev points in
//! either box, between which the kernel `1/(πE* r)` is interpolated (Börm, Grasedyck and Hackbusch 2003). Boxes nearer than
//! this are halved until they are far enough or hold few cells; between these the coefficients of rectangles are summed.

use std::f64::consts::PI;

use crate::contact::half_space::kernels::{Rectangle, rectangle};
use crate::contact::normal::gap::grid::PressureGrid;

/// Chebyshev points per axis. Displacements differ from the exact sum by less than 5e-5 of the largest one that the other grid
/// causes (the test below; with 6 points by 1e-4). That is the error of interpolation alone: 11 points leave 2e-7.
const ORDER: usize = 7;
/// Distance of two boxes, relative to half their longest side, from which the kernel between them is interpolated.
const FAR: f64 = 1.0;
/// Boxes with no more cells than this are not halved.
const CELLS_FEW: usize = 24;

/// The influence of one grid on another.
#[derive(Debug, Clone)]
pub(crate) struct Coupling {
    /// Cells along x of the grid acted on, and of the one that acts.
    widths: [usize; 2],
    blocks: Vec<Block>,
}

/// A rectangular part of a grid's cells.
#[derive(Debug, Clone, Copy)]
struct Cells {
    first: [usize; 2],
    count: [usize; 2],
}

#[derive(Debug, Clone)]
struct Block {
    to: Cells,
    from: Cells,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    /// Coefficients in mm/MPa: for every cell acted on those of all that act.
    Near(Vec<f64>),
    /// Values of the basis of either box on its cells, per axis and for every cell `ORDER` of them, and the kernel in mm/N
    /// between the points.
    Far {
        to: [Vec<f64>; 2],
        from: [Vec<f64>; 2],
        kernel: Vec<f64>,
    },
}

impl Coupling {
    /// Prepares the influence of `from` on `to`, two grids that do not overlap, for the contact modulus `E*` in MPa.
    pub(crate) fn new(to: &PressureGrid, from: &PressureGrid, contact_modulus: f64) -> Coupling {
        let mut blocks = Vec::new();
        let mut pending = vec![(Cells::all(to), Cells::all(from))];
        while let Some((acted, acting)) = pending.pop() {
            let sizes = [acted.half_side(to), acting.half_side(from)];
            let far = distance(acted.range(to), acting.range(from)) >= FAR * sizes[0].max(sizes[1]);
            let halves = [acted.halves(to), acting.halves(from)];
            match halves {
                _ if far => {
                    blocks.push(Block::far(to, from, acted, acting, contact_modulus));
                }
                // The larger of the two boxes is halved, or the one that can be.
                [Some(parts), other] if sizes[0] >= sizes[1] || other.is_none() => {
                    pending.extend(parts.map(|part| (part, acting)));
                }
                [_, Some(parts)] => pending.extend(parts.map(|part| (acted, part))),
                _ => blocks.push(Block::near(to, from, acted, acting, contact_modulus)),
            }
        }
        Coupling {
            widths: [to.cells[0], from.cells[0]],
            blocks,
        }
    }

    /// Adds the displacements in mm that pressures in MPa on the acting grid cause.
    pub(crate) fn add(&self, pressure: &[f64], displacement: &mut [f64]) {
        let [to_width, from_width] = self.widths;
        for block in &self.blocks {
            let (to, from) = (block.to, block.from);
            match &block.kind {
                Kind::Near(coefficients) => {
                    let rows = coefficients.chunks_exact(from.count[0] * from.count[1]);
                    for (cell, row) in to.cells(to_width).zip(rows) {
                        let sources = from.cells(from_width).zip(row);
                        displacement[cell] += sources.map(|(k, c)| c * pressure[k]).sum::<f64>();
                    }
                }
                Kind::Far {
                    to: basis_to,
                    from: basis_from,
                    kernel,
                } => {
                    let moments = moments(pressure, from, from_width, basis_from);
                    let values: Vec<f64> = kernel
                        .chunks_exact(ORDER * ORDER)
                        .map(|row| row.iter().zip(&moments).map(|(k, m)| k * m).sum())
                        .collect();
                    spread(&values, to, to_width, basis_to, displacement);
                }
            }
        }
    }
}

/// Sums of the pressures with the products of the basis along both axes, at `b * ORDER + a`.
fn moments(pressure: &[f64], cells: Cells, width: usize, basis: &[Vec<f64>; 2]) -> Vec<f64> {
    let mut moments = vec![0.0; ORDER * ORDER];
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
    moments
}

/// Adds the values at the points, interpolated to the cells.
fn spread(values: &[f64], cells: Cells, width: usize, basis: &[Vec<f64>; 2], to: &mut [f64]) {
    for (j, across) in basis[1].chunks_exact(ORDER).enumerate() {
        let mut line = [0.0; ORDER];
        for (row, b) in values.chunks_exact(ORDER).zip(across) {
            line.iter_mut().zip(row).for_each(|(sum, v)| *sum += b * v);
        }
        let first = (cells.first[1] + j) * width + cells.first[0];
        let row = &mut to[first..first + cells.count[0]];
        for (u, along) in row.iter_mut().zip(basis[0].chunks_exact(ORDER)) {
            *u += line.iter().zip(along).map(|(v, a)| v * a).sum::<f64>();
        }
    }
}

impl Cells {
    fn all(grid: &PressureGrid) -> Cells {
        Cells {
            first: [0; 2],
            count: grid.cells,
        }
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
        if self.count[0] * self.count[1] <= CELLS_FEW {
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

impl Block {
    fn near(
        to: &PressureGrid,
        from: &PressureGrid,
        acted: Cells,
        acting: Cells,
        contact_modulus: f64,
    ) -> Block {
        let (places, centres) = (
            [to.centres(0), to.centres(1)],
            [from.centres(0), from.centres(1)],
        );
        let mut coefficients = Vec::new();
        for cell in acted.cells(to.cells[0]) {
            let [x, y] = [places[0][cell % to.cells[0]], places[1][cell / to.cells[0]]];
            for source in acting.cells(from.cells[0]) {
                let at = [
                    centres[0][source % from.cells[0]],
                    centres[1][source / from.cells[0]],
                ];
                let half = from.step.map(|step| 0.5 * step);
                let cell = Rectangle {
                    x0: at[0] - half[0],
                    x1: at[0] + half[0],
                    y0: at[1] - half[1],
                    y1: at[1] + half[1],
                };
                coefficients.push(rectangle(x, y, cell, 0.0).zz / contact_modulus);
            }
        }
        Block {
            to: acted,
            from: acting,
            kind: Kind::Near(coefficients),
        }
    }

    fn far(
        to: &PressureGrid,
        from: &PressureGrid,
        acted: Cells,
        acting: Cells,
        contact_modulus: f64,
    ) -> Block {
        let points = |range: [f64; 2]| -> [f64; ORDER] {
            let (middle, half) = (0.5 * (range[0] + range[1]), 0.5 * (range[1] - range[0]));
            std::array::from_fn(|k| middle + half * (PI * (k as f64 + 0.5) / ORDER as f64).cos())
        };
        let there = acted.range(to).map(points);
        let here = acting.range(from).map(points);
        let mut kernel = Vec::with_capacity(ORDER.pow(4));
        for (y, x) in product(&there) {
            kernel.extend(
                product(&here).map(|(v, u)| 1.0 / (PI * contact_modulus * (x - u).hypot(y - v))),
            );
        }
        let area = from.step[0] * from.step[1];
        let at_centres = |k: usize| -> Vec<f64> {
            let centres = to.centres(k);
            let cells = acted.first[k]..acted.first[k] + acted.count[k];
            cells.flat_map(|i| basis(&there[k], centres[i])).collect()
        };
        // Means over the cells by three points of Gauss, times the area once.
        let over_cells = |k: usize| -> Vec<f64> {
            let centres = from.centres(k);
            let cells = acting.first[k]..acting.first[k] + acting.count[k];
            let off = 0.5 * from.step[k] * 0.6_f64.sqrt();
            let factor = if k == 0 { area } else { 1.0 };
            let mean = |i: usize| {
                let [low, middle, high] =
                    [-off, 0.0, off].map(|off| basis(&here[k], centres[i] + off));
                let mean = |a: usize| (5.0 * (low[a] + high[a]) + 8.0 * middle[a]) / 18.0;
                std::array::from_fn::<f64, ORDER, _>(|a| factor * mean(a))
            };
            cells.flat_map(mean).collect()
        };
        Block {
            to: acted,
            from: acting,
            kind: Kind::Far {
                to: [at_centres(0), at_centres(1)],
                from: [over_cells(0), over_cells(1)],
                kernel,
            },
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
        let block = Block::near(to, from, Cells::all(to), Cells::all(from), MODULUS);
        let Kind::Near(coefficients) = block.kind else {
            unreachable!("asked for")
        };
        coefficients
            .chunks_exact(pressure.len())
            .map(|row| row.iter().zip(pressure).map(|(c, p)| c * p).sum())
            .collect()
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
        assert_eq!(Coupling::new(&large, &small, MODULUS).blocks.len(), 1);
    }
}
