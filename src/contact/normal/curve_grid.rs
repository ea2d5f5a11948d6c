//! Grids over the unfolded surface of a rail, and the wheel over their cells.

use crate::geometry::reference_curve::{CurvePlace, ReferenceCurve, WheelOver};
use crate::normal::gap::grid::{bilinear, continued};
use crate::numerics::interpolation::polynomial_weight;

/// Least gap of a strip in mm above which it is not part of the contact.
pub(super) const APART: f64 = 0.3;
/// The gap in mm that is assigned to a cell outside the contact.
pub(super) const NO_CONTACT: f64 = 1e3;
/// Number of free cells around the contact.
pub(super) const FREE: usize = 2;
/// Distance in mm below which runs of contact interact on a half-space.
pub(super) const APART_ON_HALF_SPACE: f64 = 4.0;

/// Equal cells over parts of the unfolded surface. Cell (i, j) is stored at `j * x.len() + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CurveGrid {
    /// Centres of the cells along x in mm.
    pub(crate) x: Vec<f64>,
    /// The strips by increasing arc length, without those between parts of the contact.
    pub(crate) places: Vec<CurvePlace>,
    /// The places of the strips from the first one, in widths of a strip.
    pub(crate) numbers: Vec<usize>,
    /// The plane of contact of each strip; `None` on the curve.
    pub(super) planes: Option<Vec<usize>>,
    /// Size of a cell along x and s in mm.
    pub(crate) step: [f64; 2],
}

/// The undeformed wheel over the cells of a grid.
#[derive(Debug, Clone)]
pub(super) struct WheelOverGrid {
    /// Height of the wheel's centre in mm.
    pub(super) centre: f64,
    /// Distance from the rail along its normal in mm.
    pub(super) gap: Vec<f64>,
    /// Derivative of the gap by the height of the wheel's centre.
    pub(super) lift: Vec<f64>,
    /// Angle of the wheel over each strip where it is closest; that of the rail where it is far.
    pub(super) angle: Vec<f64>,
}

impl CurveGrid {
    /// The cells over a window along x and windows along s in mm, with centres at `(k + ½)` times their size.
    pub(super) fn new(
        curve: &ReferenceCurve,
        x: [f64; 2],
        s: &[[f64; 2]],
        step: [f64; 2],
    ) -> CurveGrid {
        let cells = |window: [f64; 2], step: f64| {
            let [low, high] = window.map(|end| end / step);
            let (first, last) = (low.floor() as i64, high.ceil() as i64);
            first..last.max(first + 1)
        };
        let centre = |cell: i64, step: f64| (cell as f64 + 0.5) * step;
        let mut numbers: Vec<i64> = s
            .iter()
            .flat_map(|window| cells(*window, step[1]))
            .collect();
        numbers.sort_unstable();
        numbers.dedup();
        let places = || numbers.iter().map(|cell| centre(*cell, step[1]));
        CurveGrid {
            x: cells(x, step[0])
                .map(|cell| centre(cell, step[0]))
                .collect(),
            places: places().map(|s| curve.at(s)).collect(),
            planes: curve
                .is_flat()
                .then(|| places().map(|s| curve.plane(s)).collect()),
            numbers: numbers
                .iter()
                .map(|cell| (cell - numbers[0]) as usize)
                .collect(),
            step,
        }
    }

    pub(crate) fn cells(&self) -> [usize; 2] {
        [self.x.len(), self.places.len()]
    }

    pub(crate) fn area(&self) -> f64 {
        self.step[0] * self.step[1]
    }

    /// The wheel over the cells at a height of its centre. Along x the gap is a polynomial through some points.
    pub(super) fn over(&self, curve: &ReferenceCurve, centre: f64) -> WheelOverGrid {
        let [nx, ny] = self.cells();
        let [first, last] = [self.x[0], self.x[nx - 1]];
        let nodes = curve.nodes([first, last]);
        let weights = |x: &f64| {
            let nodes = (0..nodes.len()).map(|node| polynomial_weight(&nodes, node, *x));
            nodes.collect()
        };
        let weights: Vec<Vec<f64>> = self.x.iter().map(weights).collect();
        let mut over = WheelOverGrid {
            centre,
            gap: Vec::with_capacity(nx * ny),
            lift: Vec::with_capacity(nx * ny),
            angle: Vec::with_capacity(ny),
        };
        let mut before: Option<Vec<WheelOver>> = None;
        for (j, place) in self.places.iter().enumerate() {
            let adjoins = j > 0 && self.numbers[j] == self.numbers[j - 1] + 1;
            let start = before.take().filter(|_| adjoins);
            before = curve.over_line(place, &nodes, centre, start.as_deref());
            let Some(line) = &before else {
                self.one_by_one(curve, place, &mut over);
                continue;
            };
            let values = |of: fn(&WheelOver) -> f64| {
                let known: Vec<f64> = line.iter().map(of).collect();
                let at = move |weights: &Vec<f64>| -> f64 {
                    weights.iter().zip(&known).map(|(w, v)| w * v).sum()
                };
                weights.iter().map(at)
            };
            let row = over.gap.len();
            over.gap.extend(values(|wheel| wheel.gap));
            over.lift.extend(values(|wheel| wheel.lift));
            let gaps = &over.gap[row..];
            let nearest = (0..nx).min_by(|a, b| gaps[*a].total_cmp(&gaps[*b]));
            let nearest = nearest.unwrap_or(0);
            let of_wheel = values(|wheel| wheel.angle).nth(nearest);
            if gaps[nearest] < APART {
                over.angle.push(of_wheel.unwrap_or(place.angle));
            } else {
                over.angle.push(place.angle);
                over.gap[row..].fill(NO_CONTACT);
            }
        }
        over
    }

    /// Adds the wheel over a strip at whose ends along x the wheel may end.
    fn one_by_one(&self, curve: &ReferenceCurve, place: &CurvePlace, over: &mut WheelOverGrid) {
        let centre = over.centre;
        let row = over.gap.len();
        over.gap.resize(row + self.x.len(), NO_CONTACT);
        over.lift.resize(row + self.x.len(), place.angle.cos());
        let nearest = curve.nearest(place, centre);
        let Some((x, nearest)) = nearest.filter(|(_, wheel)| wheel.gap < APART) else {
            over.angle.push(place.angle);
            return;
        };
        over.angle.push(nearest.angle);
        let from = self.x.partition_point(|centre| *centre < x);
        let mut go = |cells: &mut dyn Iterator<Item = usize>| {
            let mut start = Some(nearest);
            for i in cells {
                start = start.and_then(|start| curve.over(place, self.x[i], centre, &start));
                if let Some(wheel) = start {
                    (over.gap[row + i], over.lift[row + i]) = (wheel.gap, wheel.lift);
                }
            }
        };
        go(&mut (0..from).rev());
        go(&mut (from..self.x.len()));
    }

    /// First and last strip of each part of the grid with adjoining strips.
    pub(super) fn parts(&self) -> Vec<[usize; 2]> {
        let mut parts: Vec<[usize; 2]> = Vec::new();
        for (j, number) in self.numbers.iter().enumerate() {
            match parts.last_mut() {
                Some([_, last]) if self.numbers[*last] + 1 == *number => *last = j,
                _ => parts.push([j, j]),
            }
        }
        parts
    }

    /// First and last strip of each run of strips in contact.
    pub(crate) fn runs(&self, pressure: &[f64]) -> Vec<[usize; 2]> {
        let mut runs: Vec<[usize; 2]> = Vec::new();
        for (j, row) in pressure.chunks_exact(self.x.len()).enumerate() {
            if row.iter().all(|p| *p == 0.0) {
                continue;
            }
            match runs.last_mut() {
                Some([_, last]) if *last + 1 == j => *last = j,
                _ => runs.push([j, j]),
            }
        }
        runs
    }

    /// Merges runs of contact that interact on a half-space.
    pub(super) fn joined(&self, runs: Vec<[usize; 2]>) -> Vec<[usize; 2]> {
        let mut joined: Vec<[usize; 2]> = Vec::new();
        for run in runs {
            match joined.last_mut() {
                Some([_, last])
                    if self.places[run[0]].s - self.places[*last].s < APART_ON_HALF_SPACE =>
                {
                    *last = run[1];
                }
                _ => joined.push(run),
            }
        }
        joined
    }

    /// The number of the run, or of the plane of contact, of each strip. Strips between two runs belong to the closer one.
    pub(super) fn run_of_strips(&self, runs: &[[usize; 2]]) -> Vec<usize> {
        if let Some(planes) = &self.planes {
            return planes.clone();
        }
        let number = |j: usize| self.numbers[j];
        let far = |j: usize, [first, last]: [usize; 2]| {
            let [first, last] = [first, last].map(number);
            first.saturating_sub(number(j)) + number(j).saturating_sub(last)
        };
        let nearest = |j: usize| (0..runs.len()).min_by_key(|k| far(j, runs[*k]));
        (0..self.places.len())
            .map(|j| nearest(j).unwrap_or(0))
            .collect()
    }

    /// A larger grid if the contact reaches the border of this one or of a part of it.
    pub(super) fn enlarged(&self, curve: &ReferenceCurve, pressure: &[f64]) -> Option<CurveGrid> {
        let nx = self.x.len();
        let is_loaded = |j: usize| pressure[j * nx..(j + 1) * nx].iter().any(|p| *p > 0.0);
        let half = 0.25 * self.step[1];
        let mut any = false;
        let mut window = |[low, high]: [f64; 2], reached: [bool; 2], step: f64| {
            any |= reached[0] || reached[1];
            let growth = 0.15 * (high - low) + 2.0 * step;
            // Cells are whole, so half a cell adds no new one.
            let [below, above] = reached.map(|reached| if reached { growth } else { 0.0 });
            [low - below - half, high + above + half]
        };
        let windows: Vec<[f64; 2]> = self
            .parts()
            .into_iter()
            .map(|[first, last]| {
                let end = (first + FREE).min(last + 1);
                let low = (first..end).any(is_loaded);
                let high = ((last + 1).saturating_sub(FREE).max(first)..=last).any(is_loaded);
                let ends = [first, last].map(|j| self.places[j].s);
                window(ends, [low, high], self.step[1])
            })
            .collect();
        let in_columns = |columns: std::ops::Range<usize>| {
            let mut rows = pressure.chunks_exact(nx);
            rows.any(|row| row[columns.clone()].iter().any(|p| *p > 0.0))
        };
        let reached = [
            in_columns(0..FREE.min(nx)),
            in_columns(nx.saturating_sub(FREE)..nx),
        ];
        let along = window([self.x[0], self.x[nx - 1]], reached, self.step[0]);
        any.then(|| CurveGrid::new(curve, along, &windows, self.step))
    }

    /// Interpolates pressures of another grid. Squares of pressures, which fall linearly to the edge of the contact and continue beyond it, are interpolated
    /// bilinearly.
    pub(super) fn pressures(&self, other: &CurveGrid, pressure: &[f64]) -> Vec<f64> {
        let squares = pressure.iter().map(|p| p * p).collect();
        let width = other.x.len();
        let squares = continued(width, squares);
        let mut found = bilinear(&self.places_on(other), width, |number| {
            Some(&squares[other.strip(number)? * width..])
        });
        found.iter_mut().for_each(|p| *p = p.max(0.0).sqrt());
        found
    }

    /// Interpolates gaps of another grid bilinearly; beyond its cells those of the nearest cells apply.
    pub(super) fn gaps(&self, other: &CurveGrid, gap: &[f64]) -> Vec<f64> {
        let width = other.x.len();
        let far = |number: i64, j: usize| (other.numbers[j] as i64 - number).abs();
        let nearest = |number: i64| (0..other.numbers.len()).min_by_key(|j| far(number, *j));
        let [mut x, s] = self.places_on(other);
        x.iter_mut()
            .for_each(|x| *x = x.clamp(0.0, (width - 1) as f64));
        bilinear(&[x, s], width, |number| {
            let strip = other.strip(number).or_else(|| nearest(number))?;
            Some(&gap[strip * width..])
        })
    }

    /// The places of the cells along x and s, in cells from the first ones of another grid.
    fn places_on(&self, other: &CurveGrid) -> [Vec<f64>; 2] {
        let x = self.x.iter().map(|x| (x - other.x[0]) / other.step[0]);
        let first = other.places[0].s;
        let s = self.places.iter();
        let s = s.map(|place| (place.s - first) / other.step[1]);
        [x.collect(), s.collect()]
    }

    /// The strip at a place in widths of a strip from that of the first one.
    pub(crate) fn strip(&self, number: i64) -> Option<usize> {
        let number = usize::try_from(number).ok()?;
        self.numbers.binary_search(&number).ok()
    }

    /// The strips with the same arc lengths as the first and the last ones of runs on another grid.
    pub(super) fn runs_of(&self, other: &CurveGrid, runs: &[[usize; 2]]) -> Vec<[usize; 2]> {
        let last = self.places.len() - 1;
        let same = |j: usize| {
            let s = other.places[j].s;
            self.places.partition_point(|place| place.s < s).min(last)
        };
        runs.iter().map(|run| run.map(same)).collect()
    }
}

impl WheelOverGrid {
    /// The largest deviation from 1 of the derivative of the gap by the height over the weight of the strip, among cells in contact.
    pub(super) fn lift_off(&self, pressure: &[f64], weights: &[f64]) -> f64 {
        let nx = pressure.len() / weights.len();
        let rows = pressure.chunks_exact(nx).zip(self.lift.chunks_exact(nx));
        let off = rows.zip(weights).flat_map(|((pressure, lift), weight)| {
            let in_contact = pressure.iter().zip(lift).filter(|(p, _)| **p > 0.0);
            in_contact.map(move |(_, lift)| (lift / weight - 1.0).abs())
        });
        off.fold(0.0, f64::max)
    }

    /// The gap of the cells at another height of the wheel's centre.
    pub(super) fn at(&self, centre: f64) -> Vec<f64> {
        let raised = centre - self.centre;
        let cells = self.gap.iter().zip(&self.lift);
        cells.map(|(gap, lift)| gap + raised * lift).collect()
    }
}

/// The ends of some cells along x or s in mm.
pub(super) fn extent_of(grid: &CurveGrid, cells: &[usize], axis: usize) -> [f64; 2] {
    let nx = grid.x.len();
    let places = cells.iter().map(|k| match axis {
        0 => grid.x[k % nx],
        _ => grid.places[k / nx].s,
    });
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = places.fold(nothing, |[low, high], at| [low.min(at), high.max(at)]);
    let half = 0.5 * grid.step[axis];
    [low - half, high + half]
}
