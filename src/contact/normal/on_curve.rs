//! The normal problem of a wheel on the reference curve: one grid over the arc length of the rail, and one unknown height of the wheel.
//!
//! Where the bodies overlap at an expected height, a coarse grid finds the contact; a finer one, as fine as the narrowest patch that counts needs,
//! has the answer. Its strips lie at multiples of their width from the origin of the arc length, whatever the height is, and leave out what lies
//! between the patches.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::reference_curve::{
    ContactPlane, CurvePlace, Nearest, ReferenceCurve, SPACING, WheelOver,
};
use crate::contact::half_space::bent_surface::{
    BentOperator, BentStrips, BentWorkspace, Influence, StripFactors,
};
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::lazy_field::LazyField;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::{NormalError, NormalWork, no_touch};
use crate::contact::normal::gap::cell_sums::{CellWeights, LANES};
use crate::contact::normal::gap::conjugate_gradients::{
    PressureInfluence, PressureTask, solve_pressure,
};
use crate::contact::normal::gap::edges::squares;
use crate::contact::normal::gap::grid::GridFineness;
use crate::contact::normal::hertz::NormalLoad;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::wheel::task::WheelLoad;
use crate::contact::numerics::flood_fill::groups;

/// Cells across the overlaps on the grid that finds the contact.
const FIRST: f64 = 24.0;
/// Largest number of cells along x and s.
const CELLS_MAX: usize = 600;
/// A finer grid is not needed where the present one has this part of the wanted cells.
const FINE_ENOUGH: f64 = 0.9;
/// A strip whose least gap is larger than this, in mm, is no part of the contact.
const APART: f64 = 0.3;
/// The gap of a cell that is no part of the contact, in mm.
const NO_CONTACT: f64 = 1e3;
/// Strips whose deformed surfaces come nearer than this part of the deepest overlap are part of the next grid.
const NEAR: f64 = 0.03;
/// Cells around the contact that stay free.
const FREE: usize = 2;
/// Normal problems that are solved on one grid at most, and grids.
const HEIGHTS_MAX: usize = 40;
const GRIDS_MAX: usize = 12;
/// Tolerance of the contact conditions on the grid that finds the contact, relative to the deepest overlap.
const FIRST_TOLERANCE: f64 = 5e-3;
/// A light patch has at least this part of the cells across that the smallest patch has on planes.
const OF_LIGHT: f64 = 0.5;
/// Tolerance of the force.
const FORCE: f64 = 2e-5;
/// A force that is missed by more than this is no answer.
const FORCE_POOR: f64 = 5e-3;
/// Least lowering of the wheel in mm that is tried.
const LOWERING_LEAST: f64 = 1e-4;
/// The gap is computed again where the height has changed by more than this part of the deepest overlap; up to there it is linear in the height.
const LINEAR: f64 = 0.05;
/// Steeper strips count in the search for the height as if their angle had this cosine.
const COSINE_LEAST: f64 = 0.1;
/// Runs of contact on a half-space that lie nearer than this, in mm, act on each other.
const APART_ON_HALF_SPACE: f64 = 4.0;
/// Patches nearer to each other than this, in mm, and inclined to each other by less than this, in rad, share a plane of contact. CONTACT separates patches that
/// are 8 mm or 30° apart.
const SHARED_PLANE_DISTANCE: f64 = 12.0;
const SHARED_PLANE_ANGLE: f64 = 0.5;

/// The place of a run of strips.
#[derive(Debug, Clone, Copy)]
struct StripRun {
    /// Arc lengths of its ends in mm.
    ends: [f64; 2],
    /// Mean angle in rad, weighted with the pressures.
    angle: f64,
}

impl StripRun {
    /// How far it lies from another one in mm.
    fn apart(&self, other: &StripRun) -> f64 {
        (self.ends[0] - other.ends[1]).max(other.ends[0] - self.ends[1])
    }

    fn inclined(&self, other: &StripRun) -> f64 {
        (self.angle - other.angle).abs()
    }
}

/// What presses a wheel on a rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurveTask<'a> {
    pub(crate) curve: &'a ReferenceCurve<'a>,
    pub(crate) elasticity: &'a Elasticity,
    pub(crate) influence: Influence,
    pub(crate) loading: WheelLoad,
    /// Height of the wheel's centre in mm at which the bodies just touch.
    pub(crate) touch: f64,
    /// Lowering in mm to begin with.
    pub(crate) expected: f64,
    pub(crate) fineness: GridFineness,
}

/// Equal cells over parts of the unfolded surface; cell (i, j) is stored at `j * x.len() + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CurveGrid {
    /// Centres of the cells along x in mm.
    pub(crate) x: Vec<f64>,
    /// The strips, by increasing arc length; without those between parts of the contact.
    pub(crate) places: Vec<CurvePlace>,
    /// The places of the strips in widths of a strip from that of the first one.
    pub(crate) numbers: Vec<usize>,
    /// The plane of contact of each strip; none on the curve.
    planes: Option<Vec<usize>>,
    /// Size of a cell along x and s in mm.
    pub(crate) step: [f64; 2],
}

/// The undeformed wheel over the cells of a grid.
#[derive(Debug, Clone)]
struct WheelOverGrid {
    /// Height of the wheel's centre in mm.
    centre: f64,
    /// Distance from the rail along its normal in mm.
    gap: Vec<f64>,
    /// Its change with the height of the wheel's centre.
    lift: Vec<f64>,
    /// Mean angles of rail and wheel of each strip where the wheel is nearest, weighted with the shares of the displacement of both bodies.
    angle: Vec<f64>,
}

/// A wheel at rest on the curve.
#[derive(Debug)]
pub(crate) struct CurveContact {
    pub(crate) grid: CurveGrid,
    pub(crate) operator: BentOperator,
    /// Height of the wheel's centre in mm.
    pub(crate) centre: f64,
    /// Distance in mm of the undeformed wheel from the rail along its normal at each cell; more than 8 where none was found.
    pub(crate) gap: Vec<f64>,
    /// Pressures in MPa.
    pub(crate) pressure: Vec<f64>,
    /// The runs of contact that act on each other, by strips: first and last.
    pub(crate) runs: Vec<[usize; 2]>,
    pub(crate) work: NormalWork,
    /// Was the height found before the heights were used up?
    settled: bool,
    /// By which part the force is missed.
    pub(crate) missed: f64,
    /// The gap in mm that tractions open at each cell, where any do.
    pub(crate) opened: Option<Vec<f64>>,
    over: WheelOverGrid,
    /// Strips whose deformed surfaces nearly touch.
    near: Vec<bool>,
    /// The pressures of the patches with their first strips.
    patches: LazyField<Vec<(usize, GridPressure)>>,
}

/// What friction does to a contact.
#[derive(Debug, Clone, Default)]
pub(crate) struct Friction {
    /// Vertical force on the rail in N, upward, of the tractions.
    pub(crate) lift: f64,
    /// The gap in mm that tractions open, on the cells of a grid.
    pub(crate) opened: Option<Vec<f64>>,
}

/// Buffers that successive solves reuse.
pub(crate) type Workspace = BentWorkspace;

/// Pressures of strips times weights: a uniform approach of these lowers the wheel.
struct WeightedStrips<'a> {
    operator: &'a BentOperator,
    factors: StripFactors,
    weights: &'a [f64],
}

impl PressureInfluence for WeightedStrips<'_> {
    const CHANGES_MAX: usize = 6;
    type Workspace = BentWorkspace;

    fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut BentWorkspace) {
        self.operator
            .opened_by_pressure(&self.factors, pressure, displacement, workspace);
    }

    fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]) {
        self.operator
            .add_opened(&self.factors, changes, displacement);
    }

    fn own(&self) -> f64 {
        self.operator.own() / self.weights[0].powi(2)
    }

    fn weights(&self, cells: usize) -> CellWeights {
        let mut weights = CellWeights {
            area: vec![1.0; cells.next_multiple_of(LANES)],
            yielding: vec![1.0; cells.next_multiple_of(LANES)],
        };
        let rows = weights.yielding[..cells].chunks_exact_mut(cells / self.weights.len());
        for (row, weight) in rows.zip(self.weights) {
            row.fill((weight / self.weights[0]).powi(2));
        }
        weights
    }
}

impl CurveGrid {
    /// The cells over a window along x and windows along s in mm, with centres at `(k + ½)` times their size.
    fn new(curve: &ReferenceCurve, x: [f64; 2], s: &[[f64; 2]], step: [f64; 2]) -> CurveGrid {
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

    /// The wheel over the cells at a height of its centre. Along x the gap is that of a polynomial through some points.
    fn over(&self, task: &CurveTask, centre: f64) -> WheelOverGrid {
        let curve = task.curve;
        let of_both = |rail: f64, wheel: f64| task.of_both(rail, wheel);
        let [nx, ny] = self.cells();
        let [first, last] = [self.x[0], self.x[nx - 1]];
        let nodes = curve.nodes([first, last]);
        let weights: Vec<Vec<f64>> = self.x.iter().map(|x| lagrange(&nodes, *x)).collect();
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
                self.one_by_one(task, place, &mut over);
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
                over.angle
                    .push(of_both(place.angle, of_wheel.unwrap_or(place.angle)));
            } else {
                over.angle.push(place.angle);
                over.gap[row..].fill(NO_CONTACT);
            }
        }
        over
    }

    /// The wheel over a strip above whose ends along x it may end.
    fn one_by_one(&self, task: &CurveTask, place: &CurvePlace, over: &mut WheelOverGrid) {
        let (curve, centre) = (task.curve, over.centre);
        let row = over.gap.len();
        over.gap.resize(row + self.x.len(), NO_CONTACT);
        over.lift.resize(row + self.x.len(), place.angle.cos());
        let nearest = curve.nearest(place, centre);
        let Some((x, nearest)) = nearest.filter(|(_, wheel)| wheel.gap < APART) else {
            over.angle.push(place.angle);
            return;
        };
        over.angle.push(task.of_both(place.angle, nearest.angle));
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

    /// Ends of the parts of the grid whose strips adjoin each other, by strips: first and last.
    fn parts(&self) -> Vec<[usize; 2]> {
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

    /// Runs of contact on a half-space, without those that act on each other as one.
    fn joined(&self, runs: Vec<[usize; 2]>) -> Vec<[usize; 2]> {
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

    /// The number of the run, or of the plane of contact, that each strip belongs to; those between two runs belong to the nearer one.
    fn run_of_strips(&self, runs: &[[usize; 2]]) -> Vec<usize> {
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

    /// A larger grid where the contact reaches the border of this one or of a part of it.
    fn enlarged(&self, curve: &ReferenceCurve, pressure: &[f64]) -> Option<CurveGrid> {
        let nx = self.x.len();
        let is_loaded = |j: usize| pressure[j * nx..(j + 1) * nx].iter().any(|p| *p > 0.0);
        let half = 0.25 * self.step[1];
        let mut any = false;
        let mut window = |[low, high]: [f64; 2], reached: [bool; 2], step: f64| {
            any |= reached[0] || reached[1];
            let growth = 0.15 * (high - low) + 2.0 * step;
            // Cells are whole, so that half of one is no new one.
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

    /// Pressures of another grid at the cells, bilinearly.
    fn interpolated(&self, other: &CurveGrid, pressure: &[f64]) -> Vec<f64> {
        let width = other.x.len();
        let value = |i: i64, j: Option<usize>| match j {
            Some(j) if (0..width as i64).contains(&i) => pressure[j * width + i as usize],
            _ => 0.0,
        };
        let place = |at: f64, first: f64, step: f64| {
            let at = (at - first) / step;
            (at.floor() as i64, at - at.floor())
        };
        let columns: Vec<(i64, f64)> = self
            .x
            .iter()
            .map(|x| place(*x, other.x[0], other.step[0]))
            .collect();
        let mut out = Vec::with_capacity(self.x.len() * self.places.len());
        for strip in &self.places {
            let (j, v) = place(strip.s, other.places[0].s, other.step[1]);
            let [low, high] = [j, j + 1].map(|j| other.strip(j));
            for &(i, u) in &columns {
                let row = |j| (1.0 - u) * value(i, j) + u * value(i + 1, j);
                out.push((1.0 - v) * row(low) + v * row(high));
            }
        }
        out
    }

    /// The strip at a place in widths of a strip from that of the first one.
    pub(crate) fn strip(&self, number: i64) -> Option<usize> {
        let number = usize::try_from(number).ok()?;
        self.numbers.binary_search(&number).ok()
    }

    /// The strips with the same arc lengths as the first and the last ones of runs on another grid.
    fn runs_of(&self, other: &CurveGrid, runs: &[[usize; 2]]) -> Vec<[usize; 2]> {
        let last = self.places.len() - 1;
        let same = |j: usize| {
            let s = other.places[j].s;
            self.places.partition_point(|place| place.s < s).min(last)
        };
        runs.iter().map(|run| run.map(same)).collect()
    }
}

/// Weights of values at some nodes for that of a polynomial through them.
fn lagrange(nodes: &[f64], at: f64) -> Vec<f64> {
    let weight = |k: usize| {
        let others = (0..nodes.len()).filter(|m| *m != k);
        others
            .map(|m| (at - nodes[m]) / (nodes[k] - nodes[m]))
            .product()
    };
    (0..nodes.len()).map(weight).collect()
}

impl CurveTask<'_> {
    /// The mean of two angles of rail and wheel, with the parts that they have of the displacements.
    fn of_both(&self, rail: f64, wheel: f64) -> f64 {
        if self.curve.is_flat() {
            return rail;
        }
        let share = self.elasticity.lower_share;
        share * rail + (1.0 - share) * wheel
    }

    /// Finds the contact on a coarse grid, without friction.
    ///
    /// # Errors
    /// Why the wheel does not come to rest; or the monitor stopped the work.
    pub(crate) fn coarse(
        &self,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let mut lowering = match self.loading {
            WheelLoad::Lowering(lowering) => lowering,
            _ => self.expected.max(LOWERING_LEAST),
        };
        let mut last = None;
        for _ in 0..GRIDS_MAX {
            let grid = self.over_overlaps(lowering)?;
            let centre = self.touch - lowering;
            let over = grid.over(self, centre);
            let runs = match self.influence {
                Influence::AngleCorrected => vec![[0, grid.places.len() - 1]],
                // Overlaps are wider than contacts, so that runs of strips that touch may only be found with what acts alone.
                Influence::HalfSpace => {
                    let deep: Vec<f64> = over.gap.iter().map(|gap| (-gap).max(0.0)).collect();
                    grid.joined(grid.runs(&deep))
                }
            };
            let start = Start {
                runs,
                pressure: vec![0.0; grid.x.len() * grid.places.len()],
                operator: None,
                over: None,
                grid,
                centre,
                iterations: 0,
            };
            let none = Friction::default();
            let found = self.settled(start, &none, FIRST_TOLERANCE, workspace, monitor)?;
            let next = self.touch - found.centre;
            let close = (next / lowering - 1.0).abs() < 0.1;
            lowering = next.max(LOWERING_LEAST);
            let found = last.insert(found);
            if self.influence == Influence::HalfSpace {
                found.runs = found.grid.joined(found.grid.runs(&found.pressure));
            }
            if close {
                break;
            }
        }
        last.ok_or_else(|| NormalError::NoAnswer("no grid of the contact was found".to_owned()))
    }

    /// Brings the wheel to rest on a grid as fine as the answer needs.
    ///
    /// # Errors
    /// As [`coarse`](Self::coarse).
    pub(crate) fn fine(
        &self,
        coarse: &CurveContact,
        friction: &Friction,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let step = self.wanted(coarse);
        let [first, last] = extent(coarse, 0);
        let margin = coarse.grid.step[0] + (FREE as f64 + 0.5) * step[0];
        let beside = 0.5 * coarse.grid.step[1] + (FREE as f64 + 0.5) * step[1];
        let near = coarse.grid.places.iter().zip(&coarse.near);
        let mut windows: Vec<[f64; 2]> = near
            .filter(|(_, near)| **near)
            .map(|(place, _)| [place.s - beside, place.s + beside])
            .collect();
        // Overlaps narrower than a cell of the coarse grid.
        for overlap in self.curve.overlaps(coarse.centre) {
            let [low, high] = [0, overlap.len() - 1].map(|k| overlap[k].place.s);
            if windows.iter().all(|[from, to]| *to < low || *from > high) {
                windows.push([low - beside, high + beside]);
            }
        }
        let grid = CurveGrid::new(self.curve, [first - margin, last + margin], &windows, step);
        let friction = Friction {
            opened: friction
                .opened
                .as_ref()
                .map(|opened| grid.interpolated(&coarse.grid, opened)),
            ..*friction
        };
        let start = Start {
            pressure: grid.interpolated(&coarse.grid, &coarse.pressure),
            runs: grid.runs_of(&coarse.grid, &coarse.runs),
            operator: None,
            over: None,
            grid,
            centre: coarse.centre,
            iterations: coarse.work.iterations,
        };
        let tolerance = self.fineness.tolerance;
        self.settled(start, &friction, tolerance, workspace, monitor)
    }

    /// Brings the wheel to rest with friction on the grid of a rest with other friction.
    ///
    /// # Errors
    /// As [`coarse`](Self::coarse).
    pub(crate) fn again(
        &self,
        before: CurveContact,
        friction: &Friction,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let start = Start {
            grid: before.grid,
            runs: before.runs,
            pressure: before.pressure,
            centre: before.centre,
            operator: Some(before.operator),
            over: Some(before.over),
            iterations: before.work.iterations,
        };
        let tolerance = self.fineness.tolerance;
        self.settled(start, friction, tolerance, workspace, monitor)
    }

    /// A coarse grid over all places where the bodies overlap at a lowering in mm.
    fn over_overlaps(&self, lowering: f64) -> Result<CurveGrid, NormalError> {
        // So that a little more than the lowering still fits.
        let centre = self.touch - 1.1 * lowering;
        let overlaps = self.curve.overlaps(centre);
        let mut along = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut widest, mut longest): (f64, f64) = (2.0 * SPACING, 0.0);
        let mut windows = Vec::with_capacity(overlaps.len());
        let [first, last] = self.curve.range();
        for overlap in &overlaps {
            let window = [
                (overlap[0].place.s - SPACING).max(first),
                (overlap[overlap.len() - 1].place.s + SPACING).min(last),
            ];
            widest = widest.max(window[1] - window[0] - SPACING);
            windows.push(window);
            for Nearest { x, wheel, .. } in overlap {
                let half = self.curve.half_length(wheel);
                longest = longest.max(2.0 * half);
                along = [along[0].min(x - half), along[1].max(x + half)];
            }
        }
        if overlaps.is_empty() {
            return Err(NormalError::NoAnswer(no_touch(lowering, 0.0)));
        }
        let step = [longest, widest].map(|length| length / FIRST);
        let total: f64 = windows.iter().map(|[low, high]| high - low).sum();
        let lengths = [along[1] - along[0], total];
        let step = [0, 1].map(|k| step[k].max(lengths[k] / CELLS_MAX as f64));
        let [margin, beside] = step.map(|step| FREE as f64 * step);
        for [low, high] in &mut windows {
            (*low, *high) = (*low - beside, *high + beside);
        }
        let along = [along[0] - margin, along[1] + margin];
        Ok(CurveGrid::new(self.curve, along, &windows, step))
    }

    /// The size of cells that resolves a contact.
    fn wanted(&self, found: &CurveContact) -> [f64; 2] {
        let CurveContact { grid, pressure, .. } = found;
        let length = |[first, last]: [f64; 2]| last - first;
        let mut step = [0, 1].map(|axis| length(extent(found, axis)) / self.fineness.contact);
        let total: f64 = pressure.iter().sum();
        for patch in groups(grid.cells(), |k| pressure[k] > 0.0) {
            let share = patch.iter().map(|k| pressure[*k]).sum::<f64>() / total;
            if share < self.fineness.share_min {
                continue;
            }
            // The error of a patch falls with the power 3/2 of its cells, and counts as much as its load.
            let cells = self.fineness.contact * share.powf(2.0 / 3.0);
            let cells = cells.max(OF_LIGHT * self.fineness.patch);
            for axis in [0, 1] {
                step[axis] = step[axis].min(length(extent_of(grid, &patch, axis)) / cells);
            }
        }
        let lengths = [0, 1].map(|axis| grid.cells()[axis] as f64 * grid.step[axis]);
        [0, 1].map(|axis| {
            let wanted = step[axis];
            match grid.step[axis] * FINE_ENOUGH < wanted {
                true => grid.step[axis],
                false => wanted.max(lengths[axis] / CELLS_MAX as f64),
            }
        })
    }

    /// The wheel at rest on a grid, which grows where the contact reaches its border.
    fn settled(
        &self,
        mut start: Start,
        friction: &Friction,
        tolerance: f64,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let mut friction = friction.clone();
        for _ in 0..GRIDS_MAX {
            let mut found = self.on_grid(start, &friction, tolerance, workspace, monitor)?;
            let opened = friction.opened.take();
            let Some(grid) = found.grid.enlarged(self.curve, &found.pressure) else {
                found.opened = opened;
                return Ok(found);
            };
            // On a face that is nearly vertical, the contact outgrows every grid.
            if !found.settled {
                return Err(NormalError::NoAnswer(
                    "the contact outgrows the surfaces on which it was looked for, and no height of the wheel carries its load there, as beside a \
                     face that is nearly vertical"
                        .to_owned(),
                ));
            }
            friction.opened = opened.map(|opened| grid.interpolated(&found.grid, &opened));
            start = Start {
                runs: grid.runs_of(&found.grid, &found.runs),
                pressure: grid.interpolated(&found.grid, &found.pressure),
                operator: None,
                over: None,
                grid,
                centre: found.centre,
                iterations: found.work.iterations,
            };
        }
        Err(NormalError::NoAnswer(
            "the contact reaches the end of the surfaces on which it was looked for".to_owned(),
        ))
    }

    /// The force in N that the pressures carry as [`carried`] counts it; none where the height is given.
    fn wanted_force(&self, friction: &Friction) -> Result<Option<f64>, NormalError> {
        let wanted = match self.loading {
            WheelLoad::Vertical(force) => force + friction.lift,
            WheelLoad::Normal(force) => force,
            WheelLoad::Lowering(_) => return Ok(None),
        };
        if wanted <= 0.0 {
            return Err(NormalError::NoAnswer(
                "friction carries the whole load; give a normal_force_n or an approach_mm"
                    .to_owned(),
            ));
        }
        Ok(Some(wanted))
    }

    fn operator(
        &self,
        grid: &CurveGrid,
        over: &WheelOverGrid,
        runs: &[[usize; 2]],
        workspace: &mut Workspace,
    ) -> BentOperator {
        let strips = BentStrips {
            number: grid.numbers.clone(),
            angle: over.angle.clone(),
            run: grid.run_of_strips(runs),
            corrected: self.influence == Influence::AngleCorrected,
        };
        BentOperator::new(grid.x.len(), grid.step, self.elasticity, strips, workspace)
    }

    /// The wheel at rest on one grid.
    ///
    /// Pressures are multiplied with a weight of their strip, the cosine of its angle. Then their sum is the vertical force, and lowering the wheel is
    /// a uniform approach: conjugate gradients find the pressures and the height together. What the gap depends on the height otherwise is
    /// added in the next solve.
    fn on_grid(
        &self,
        start: Start,
        friction: &Friction,
        tolerance: f64,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let Start {
            grid,
            runs,
            mut pressure,
            mut centre,
            operator,
            over,
            mut iterations,
        } = start;
        let nx = grid.x.len();
        let mut over = over.unwrap_or_else(|| grid.over(self, centre));
        let operator = operator.unwrap_or_else(|| self.operator(&grid, &over, &runs, workspace));
        let wanted = self.wanted_force(friction)?;
        let weight = |place: &CurvePlace| match wanted {
            Some(_) => place.angle.cos().max(COSINE_LEAST),
            None => 1.0,
        };
        let weights: Vec<f64> = grid.places.iter().map(weight).collect();
        let influence = WeightedStrips {
            factors: operator.weighted_pressure_factors(&weights),
            operator: &operator,
            weights: &weights,
        };
        let mut sum = wanted.map(|wanted| match self.loading {
            WheelLoad::Normal(_) => wanted * mean_weight(nx, &pressure, &over.gap, &weights),
            _ => wanted,
        });
        for height in 0..HEIGHTS_MAX {
            let gap = over.at(centre);
            let mut weighted: Vec<f64> = match &friction.opened {
                Some(opened) => gap.iter().zip(opened).map(|(a, b)| a + b).collect(),
                None => gap,
            };
            each_row(&mut weighted, &weights, |gap, weight| gap / weight);
            let least = weighted.iter().copied().fold(f64::INFINITY, f64::min);
            if least >= 0.0 && wanted.is_none() {
                return Err(NormalError::NoAnswer(no_touch(self.touch - centre, 0.0)));
            }
            each_row(&mut pressure, &weights, |p, weight| p * weight);
            if pressure.iter().all(|p| *p == 0.0) {
                let depth = (-least).max(self.expected);
                pressure = first_pressure(&weighted, depth, grid.area(), self.elasticity);
            }
            let task = PressureTask {
                gap: &weighted,
                cell: grid.area(),
                loading: sum.map_or(NormalLoad::Approach(0.0), NormalLoad::Force),
                tolerance,
            };
            let found = solve_pressure(&task, &influence, pressure, workspace, monitor)?;
            iterations += found.iterations;
            pressure = found.pressure;
            each_row(&mut pressure, &weights, |p, weight| p / weight);
            centre -= found.approach;
            let depth = found.approach - least;
            let carried = carried(self.loading, &grid, &pressure);
            let missed = wanted.map_or(0.0, |wanted| carried / wanted - 1.0);
            let off = over.lift_off(&pressure, &weights) * found.approach.abs();
            let is_linear = (over.centre - centre).abs() <= LINEAR * depth;
            let ends = height + 1 == HEIGHTS_MAX;
            let settled = is_linear && off <= tolerance * depth && missed.abs() <= FORCE;
            if ends || settled {
                if missed.abs() > FORCE_POOR {
                    return Err(load_missed(missed));
                }
                let rows = found.distance.chunks_exact(nx);
                let near = rows.map(|row| row.iter().any(|distance| *distance < NEAR * depth));
                return Ok(CurveContact {
                    patches: LazyField::default(),
                    opened: None,
                    near: near.collect(),
                    gap: over.at(centre),
                    work: NormalWork {
                        cells: grid.cells(),
                        grids: 1,
                        iterations,
                        residual: found.residual,
                        pressure_change: 0.0,
                    },
                    grid,
                    operator,
                    centre,
                    pressure,
                    runs,
                    settled,
                    missed: missed.abs(),
                    over,
                });
            }
            sum = sum.map(|sum| sum / (1.0 + missed));
            if !is_linear {
                over = grid.over(self, centre);
            }
        }
        unreachable!("the last height ends the search")
    }
}

/// Why there is no answer where the force is missed by a part of it.
fn load_missed(part: f64) -> NormalError {
    NormalError::NoAnswer(format!(
        "no height of the wheel was found on the curve of the rail at which it carries its load, which is missed by {:.1} %",
        100.0 * part.abs()
    ))
}

/// Changes the values of cells with a weight of their strip.
fn each_row(values: &mut [f64], weights: &[f64], of: fn(f64, f64) -> f64) {
    let nx = values.len() / weights.len();
    for (row, weight) in values.chunks_exact_mut(nx).zip(weights) {
        row.iter_mut()
            .for_each(|value| *value = of(*value, *weight));
    }
}

impl WheelOverGrid {
    /// The largest difference of the change of the gap with the height over the weight of the strip from 1, among cells in contact.
    fn lift_off(&self, pressure: &[f64], weights: &[f64]) -> f64 {
        let nx = pressure.len() / weights.len();
        let rows = pressure.chunks_exact(nx).zip(self.lift.chunks_exact(nx));
        let off = rows.zip(weights).flat_map(|((pressure, lift), weight)| {
            let in_contact = pressure.iter().zip(lift).filter(|(p, _)| **p > 0.0);
            in_contact.map(move |(_, lift)| (lift / weight - 1.0).abs())
        });
        off.fold(0.0, f64::max)
    }

    /// The gap of the cells at another height of the wheel's centre.
    fn at(&self, centre: f64) -> Vec<f64> {
        let raised = centre - self.centre;
        let cells = self.gap.iter().zip(&self.lift);
        cells.map(|(gap, lift)| gap + raised * lift).collect()
    }
}

/// The weight of the strips in contact, or, where none is, of the one with the least gap.
fn mean_weight(nx: usize, pressure: &[f64], gap: &[f64], weights: &[f64]) -> f64 {
    let loads = || pressure.chunks_exact(nx).map(|row| row.iter().sum::<f64>());
    let total: f64 = loads().sum();
    if total > 0.0 {
        let weighted = loads().zip(weights).map(|(load, weight)| load * weight);
        return weighted.sum::<f64>() / total;
    }
    let deepest = (0..gap.len()).min_by(|a, b| gap[*a].total_cmp(&gap[*b]));
    weights[deepest.unwrap_or(0) / nx]
}

/// Where a grid is solved from.
struct Start {
    grid: CurveGrid,
    runs: Vec<[usize; 2]>,
    pressure: Vec<f64>,
    centre: f64,
    /// Solution found earlier on the same grid.
    operator: Option<BentOperator>,
    over: Option<WheelOverGrid>,
    iterations: u32,
}

/// A pressure to start from: Hertz's law over the part that overlaps by more than half of the deepest overlap, which is given.
fn first_pressure(gap: &[f64], depth: f64, cell: f64, elasticity: &Elasticity) -> Vec<f64> {
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let part = |gap: &f64| (1.0 - 2.0 * (gap - least) / depth).max(0.0);
    let inside = gap.iter().filter(|gap| part(gap) > 0.0).count();
    let radius = (inside as f64 * cell / std::f64::consts::PI).sqrt();
    let largest = elasticity.contact_modulus() * depth / (std::f64::consts::PI * radius);
    gap.iter().map(|gap| largest * part(gap).sqrt()).collect()
}

/// The force that is prescribed, as pressures give it: the vertical one, or the sum of the normal ones.
fn carried(loading: WheelLoad, grid: &CurveGrid, pressure: &[f64]) -> f64 {
    let rows = pressure.chunks_exact(grid.x.len()).zip(&grid.places);
    let of_row = |(row, place): (&[f64], &CurvePlace)| {
        let share = match loading {
            WheelLoad::Vertical(_) => place.angle.cos(),
            WheelLoad::Normal(_) | WheelLoad::Lowering(_) => 1.0,
        };
        share * row.iter().sum::<f64>()
    };
    grid.area() * rows.map(of_row).sum::<f64>()
}

/// The ends of a contact along x or s in mm.
fn extent(contact: &CurveContact, axis: usize) -> [f64; 2] {
    let pressure = &contact.pressure;
    let cells: Vec<usize> = (0..pressure.len()).filter(|k| pressure[*k] > 0.0).collect();
    extent_of(&contact.grid, &cells, axis)
}

/// The ends of some cells along x or s in mm.
fn extent_of(grid: &CurveGrid, cells: &[usize], axis: usize) -> [f64; 2] {
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

impl CurveContact {
    /// The pressures of the patches in some strips, each as a field of its own, by increasing arc length; coordinates are x and s.
    ///
    /// # Errors
    /// As [`GridPressure::of_solution`].
    pub(crate) fn patches(
        &self,
        [first, last]: [usize; 2],
    ) -> Result<Vec<GridPressure>, NormalError> {
        let all = self.patches.get_or_make(|| self.all_patches());
        let inside = all
            .iter()
            .filter(|(strip, _)| (first..=last).contains(strip));
        let found: Vec<GridPressure> = inside.map(|(_, patch)| patch.clone()).collect();
        match found.is_empty() {
            true => Err(NormalError::NoAnswer(
                "the contact is smaller than a cell of the grid".to_owned(),
            )),
            false => Ok(found),
        }
    }

    fn all_patches(&self) -> Vec<(usize, GridPressure)> {
        let [nx, ny] = self.grid.cells();
        let depth = self.gap.iter().fold(0.0, |depth: f64, gap| depth.max(-gap));
        let field = |patch: Vec<usize>| {
            let strip = patch[0] / nx;
            let range = |of: fn(usize, usize) -> usize, cells: usize| {
                let numbers = patch.iter().map(|k| of(*k, nx));
                let (low, high) = numbers.fold((cells, 0), |(l, h), k| (l.min(k), h.max(k)));
                low.saturating_sub(FREE)..(high + FREE + 1).min(cells)
            };
            let (columns, rows) = (range(|k, nx| k % nx, nx), range(|k, nx| k / nx, ny));
            let mut pressure = vec![0.0; columns.len() * rows.len()];
            for k in patch {
                let (i, j) = (k % nx - columns.start, k / nx - rows.start);
                pressure[j * columns.len() + i] = self.pressure[k];
            }
            let places = &self.grid.places[rows];
            let s: Vec<f64> = places.iter().map(|place| place.s).collect();
            let found = GridPressure::of_solution(
                &self.grid.x[columns.clone()],
                &s,
                &squares(columns.len(), &pressure),
                &pressure,
                depth,
            );
            // A patch of a cell or two has no edges.
            Some((strip, found.ok()?))
        };
        let inside = |k: usize| self.pressure[k] > 0.0;
        let patches = groups(self.grid.cells(), inside).into_iter();
        patches.filter_map(field).collect()
    }

    /// The strips of the parts of the contact that are solved together: all on the curve, those of a plane, and with the influence of a half-space the
    /// runs that act on each other.
    pub(crate) fn parts(&self, influence: Influence) -> Vec<[usize; 2]> {
        let of_strips = match influence {
            Influence::AngleCorrected => vec![0; self.grid.places.len()],
            Influence::HalfSpace => self.grid.run_of_strips(&self.runs),
        };
        let mut parts: Vec<[usize; 2]> = Vec::new();
        for run in self.grid.runs(&self.pressure) {
            match parts.last_mut() {
                Some(part) if of_strips[part[1]] == of_strips[run[0]] => part[1] = run[1],
                _ => parts.push(run),
            }
        }
        parts
    }

    /// Planes of contact for its patches and for overlaps without pressure: neighbours that are near and hardly inclined to each other share one. Each passes
    /// through the mean of the overlap, weighted with its square over the area, at the mean angle there.
    pub(crate) fn planes(&self, curve: &ReferenceCurve, locus: &ContactLocus) -> Vec<ContactPlane> {
        let [first, last] = curve.range();
        let overlaps = curve.overlaps(self.centre);
        let pressed = self.grid.runs(&self.pressure).into_iter();
        let pressed: Vec<StripRun> = pressed.map(|run| self.strip_run(run)).collect();
        let free = overlaps.iter().filter_map(|overlap| {
            let ends = [overlap[0].place.s, overlap[overlap.len() - 1].place.s];
            let apart = |run: &StripRun| run.ends[1] < ends[0] || run.ends[0] > ends[1];
            let gap = |near: &&Nearest| near.wheel.gap;
            let deepest = overlap.iter().min_by(|a, b| gap(a).total_cmp(&gap(b)))?;
            pressed.iter().all(apart).then_some(StripRun {
                ends,
                angle: deepest.place.angle,
            })
        });
        let mut groups: Vec<Vec<StripRun>> = Vec::new();
        for run in pressed.iter().copied().chain(free) {
            // Of the groups that may have it, the one whose inclination is nearest.
            let fits = |group: &&mut Vec<StripRun>| {
                let near = |other: &StripRun| other.apart(&run) <= SHARED_PLANE_DISTANCE;
                let inclined = group.iter().map(|other| other.inclined(&run));
                group.iter().any(near) && inclined.fold(0.0, f64::max) <= SHARED_PLANE_ANGLE
            };
            let nearest = groups
                .iter_mut()
                .filter(fits)
                .min_by(|a, b| a[0].inclined(&run).total_cmp(&b[0].inclined(&run)));
            match nearest {
                Some(group) => group.push(run),
                None => groups.push(vec![run]),
            }
        }
        groups.iter_mut().for_each(|group| {
            group.sort_by(|a, b| a.ends[0].total_cmp(&b.ends[0]));
        });
        groups.sort_by(|a, b| a[0].ends[0].total_cmp(&b[0].ends[0]));
        let ends = |group: &[StripRun]| [group[0].ends[0], group[group.len() - 1].ends[1]];
        let ends: Vec<[f64; 2]> = groups.iter().map(|group| ends(group)).collect();
        let between = |k: usize| 0.5 * (ends[k][1] + ends[k + 1][0]);
        let plane = |k: usize| {
            let low = match k {
                0 => f64::NEG_INFINITY,
                _ => between(k - 1),
            };
            let high = match k + 1 == ends.len() {
                true => f64::INFINITY,
                false => between(k),
            };
            let mut rails = [low, high].map(|s| curve.at(s.clamp(first, last)).rail);
            rails.sort_by(f64::total_cmp);
            let middle = curve.at(0.5 * (ends[k][0] + ends[k][1]));
            let mean = locus.mean_overlap(locus.touch - self.centre, rails);
            let [rail, angle] = mean.unwrap_or([middle.rail, middle.angle]);
            ContactPlane {
                origin: curve.at_rail(rail),
                angle,
                range: [low, high],
            }
        };
        (0..groups.len()).map(plane).collect()
    }

    /// The place of a run of strips.
    fn strip_run(&self, [first, last]: [usize; 2]) -> StripRun {
        let nx = self.grid.x.len();
        let half = 0.5 * self.grid.step[1];
        let [low, high] = [first, last].map(|j| self.grid.places[j].s);
        let (mut load, mut angle) = (0.0, 0.0);
        for j in first..=last {
            let own: f64 = self.pressure[j * nx..(j + 1) * nx].iter().sum();
            load += own;
            angle += own * self.grid.places[j].angle;
        }
        StripRun {
            ends: [low - half, high + half],
            angle: angle / load,
        }
    }

    /// The largest pressure in MPa of the patch with the largest load.
    pub(crate) fn main_pressure(&self) -> f64 {
        let patches = groups(self.grid.cells(), |k| self.pressure[k] > 0.0);
        let load = |patch: &Vec<usize>| patch.iter().map(|k| self.pressure[*k]).sum::<f64>();
        let main = patches.iter().max_by(|a, b| load(a).total_cmp(&load(b)));
        let pressures = main.into_iter().flatten().map(|k| self.pressure[*k]);
        pressures.fold(0.0, f64::max)
    }

    /// Sum of the pressures in N.
    pub(crate) fn normal_force(&self) -> f64 {
        self.grid.area() * self.pressure.iter().sum::<f64>()
    }

    /// Mean angle of the strips in rad, and its standard deviation, weighted with their loads.
    pub(crate) fn angles(&self) -> [f64; 2] {
        let rows = self.pressure.chunks_exact(self.grid.x.len());
        let (mut load, mut first, mut second) = (0.0, 0.0, 0.0);
        for (row, place) in rows.zip(&self.grid.places) {
            let sum: f64 = row.iter().sum();
            load += sum;
            first += sum * place.angle;
            second += sum * place.angle * place.angle;
        }
        let mean = first / load;
        [mean, (second / load - mean * mean).max(0.0).sqrt()]
    }

    /// About what changes with the friction: the vertical force on the rail, relative to it; and, by the gap that tractions open, the lateral force relative
    /// to all normal forces. That changes by the turn of the surface, and by `shared`, the part of a change of the pressures that the tractions take.
    pub(crate) fn change_by(&self, from: &Friction, to: &Friction, shared: f64) -> [f64; 2] {
        let (mut depth, mut opened) = (0.0, 0.0);
        for (k, p) in self.pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let [before, after] = [from, to].map(|friction| {
                let opened = friction.opened.as_ref();
                opened.map_or(0.0, |opened| opened[k])
            });
            depth -= p * self.gap[k];
            opened += p * (after - before).abs();
        }
        let vertical = carried(WheelLoad::Vertical(0.0), &self.grid, &self.pressure);
        let [_, deviation] = self.angles();
        [
            (to.lift - from.lift).abs() / (vertical - to.lift).abs().max(f64::MIN_POSITIVE),
            (deviation + shared) * opened / depth.max(f64::MIN_POSITIVE),
        ]
    }

    /// The field of a part.
    ///
    /// # Errors
    /// There are more than 64 patches.
    pub(crate) fn field(patches: Vec<GridPressure>) -> Result<PressureField, NormalError> {
        PressureField::of_grids(patches).map_err(NormalError::NoAnswer)
    }
}
