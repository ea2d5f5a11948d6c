//! The normal problem of a wheel on the reference curve: one grid over the arc length of the rail, and one unknown height of the wheel.
//!
//! Where the bodies overlap at an expected height, a coarse grid finds the contact; a finer one, as fine as the narrowest patch that counts needs,
//! has the answer. Its strips lie at multiples of their width from the origin of the arc length, whatever the height is. The height is sought by
//! secant steps in the force to the power 2/3, which grows nearly linearly.

use crate::contact::geometry::reference_curve::{CurvePlace, ReferenceCurve, WheelOver};
use crate::contact::half_space::bent_surface::{
    BentOperator, BentStrips, BentWorkspace, Influence,
};
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::{NormalError, NormalWork, no_touch};
use crate::contact::normal::gap::cell_sums::{CellWeights, LANES};
use crate::contact::normal::gap::conjugate_gradients::{
    PressureInfluence, PressureTask, solve_pressure,
};
use crate::contact::normal::gap::edges::squares;
use crate::contact::normal::gap::grid::GridFineness;
use crate::contact::normal::hertz::NormalLoad;
use crate::contact::normal::pressure_field::computed::Edges;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::normal::pressure_field::grid_pressure::GridPressure;
use crate::contact::normal::wheel_height::task::WheelLoad;
use crate::contact::numerics::flood_fill::groups;

/// Spacing of the strips that are looked at for overlaps, in mm.
const LOOK: f64 = 0.1;
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
/// Cells around the contact that stay free.
const FREE: usize = 2;
/// Heights that are tried on one grid at most, and grids.
const HEIGHTS_MAX: usize = 40;
const GRIDS_MAX: usize = 12;
/// Tolerance of the force on the grid that finds the contact.
const FORCE_FIRST: f64 = 0.03;
/// Tolerance of the force.
const FORCE: f64 = 2e-5;
/// A force that is missed by more than this is no answer.
const FORCE_POOR: f64 = 5e-3;
/// Violation of the contact conditions relative to the deepest overlap.
const VIOLATION: f64 = 2e-5;
/// Least lowering of the wheel in mm that is tried.
const LOWERING_LEAST: f64 = 1e-4;
/// Largest step of the lowering over the lowering.
const STEP_LARGEST: f64 = 0.6;
/// A bracket of the lowering narrower than this part of it is closed.
const BRACKET_MIN: f64 = 1e-9;
/// Runs of contact on a half-space that lie nearer than this, in mm, act on each other.
const APART_ON_HALF_SPACE: f64 = 4.0;

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

/// Equal cells over the unfolded surface; cell (i, j) is stored at `j * x.len() + i`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CurveGrid {
    /// Centres of the cells along x in mm.
    pub(crate) x: Vec<f64>,
    /// The strips, by increasing arc length.
    pub(crate) places: Vec<CurvePlace>,
    /// Size of a cell along x and s in mm.
    pub(crate) step: [f64; 2],
}

/// A wheel at rest on the curve.
#[derive(Debug)]
pub(crate) struct CurveContact {
    pub(crate) grid: CurveGrid,
    pub(crate) operator: BentOperator,
    /// Height of the wheel's centre in mm.
    pub(crate) centre: f64,
    /// The undeformed wheel over each cell near the contact.
    pub(crate) over: Vec<Option<WheelOver>>,
    /// Pressures in MPa.
    pub(crate) pressure: Vec<f64>,
    /// The runs of contact that act on each other, by strips: first and last.
    pub(crate) runs: Vec<[usize; 2]>,
    pub(crate) work: NormalWork,
    /// Heights that were solved.
    pub(crate) heights: u32,
    /// By which part the force is missed.
    pub(crate) missed: f64,
    /// Force that is prescribed over the lowering to the power 3/2.
    slope: f64,
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

impl PressureInfluence for BentOperator {
    const CHANGES_MAX: usize = 12;
    type Workspace = BentWorkspace;

    fn apply(&self, pressure: &[f64], displacement: &mut [f64], workspace: &mut BentWorkspace) {
        self.opened_by_pressure(pressure, displacement, workspace);
    }

    fn add(&self, changes: &[(usize, f64)], displacement: &mut [f64]) {
        self.add_opened(changes, displacement);
    }

    fn own(&self) -> f64 {
        BentOperator::own(self)
    }

    fn weights(&self, cells: usize) -> CellWeights {
        let ones = vec![1.0; cells.next_multiple_of(LANES)];
        CellWeights {
            area: ones.clone(),
            yielding: ones,
        }
    }
}

impl CurveGrid {
    /// The cells over windows in mm, with centres at `(k + ½)` times their size.
    fn new(curve: &ReferenceCurve, window: [[f64; 2]; 2], step: [f64; 2]) -> CurveGrid {
        let centres = |k: usize| -> Vec<f64> {
            let [low, high] = window[k].map(|end| end / step[k]);
            let (first, last) = (low.floor() as i64, high.ceil() as i64);
            (first..last.max(first + 1))
                .map(|cell| (cell as f64 + 0.5) * step[k])
                .collect()
        };
        CurveGrid {
            x: centres(0),
            places: centres(1).into_iter().map(|s| curve.at(s)).collect(),
            step,
        }
    }

    pub(crate) fn cells(&self) -> [usize; 2] {
        [self.x.len(), self.places.len()]
    }

    pub(crate) fn area(&self) -> f64 {
        self.step[0] * self.step[1]
    }

    /// The wheel over the cells at a height of its centre; none far from the contact.
    fn over(&self, curve: &ReferenceCurve, centre: f64) -> Vec<Option<WheelOver>> {
        let mut over = Vec::with_capacity(self.x.len() * self.places.len());
        for place in &self.places {
            let nearest = curve.nearest(place, centre);
            let Some((x, nearest)) = nearest.filter(|(_, wheel)| wheel.gap < APART) else {
                over.extend(self.x.iter().map(|_| None));
                continue;
            };
            let mut row = vec![None; self.x.len()];
            let from = self.x.partition_point(|centre| *centre < x);
            let (behind, ahead) = row.split_at_mut(from);
            let (behind, ahead) = (behind.iter_mut().rev(), ahead.iter_mut());
            let behind = behind.zip(self.x[..from].iter().rev());
            let mut start = Some(nearest);
            for (wheel, x) in behind {
                start = start.and_then(|start| curve.over(place, *x, centre, &start));
                *wheel = start;
            }
            start = Some(nearest);
            for (wheel, x) in ahead.zip(&self.x[from..]) {
                start = start.and_then(|start| curve.over(place, *x, centre, &start));
                *wheel = start;
            }
            over.extend(row);
        }
        over
    }

    /// Mean angles of the strips: of the rail and of the wheel where it is nearest, at a height of its centre; both bodies bend, and each deforms as its
    /// own surface does.
    fn mean_angles(&self, curve: &ReferenceCurve, centre: f64) -> Vec<f64> {
        let of = |place: &CurvePlace| {
            let nearest = curve.nearest(place, centre);
            let nearest = nearest.filter(|(_, wheel)| wheel.gap < APART);
            nearest.map_or(place.angle, |(_, wheel)| 0.5 * (place.angle + wheel.angle))
        };
        self.places.iter().map(of).collect()
    }

    /// First and last strip of each run of strips in contact.
    fn runs(&self, pressure: &[f64]) -> Vec<[usize; 2]> {
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
                Some([_, last]) if (run[0] - *last) as f64 * self.step[1] < APART_ON_HALF_SPACE => {
                    *last = run[1];
                }
                _ => joined.push(run),
            }
        }
        joined
    }

    /// The number of the run that each strip belongs to; those between two belong to the nearer one.
    fn run_of_strips(&self, runs: &[[usize; 2]]) -> Vec<usize> {
        let far =
            |j: usize, [first, last]: [usize; 2]| first.saturating_sub(j) + j.saturating_sub(last);
        let nearest = |j: usize| (0..runs.len()).min_by_key(|k| far(j, runs[*k]));
        (0..self.places.len())
            .map(|j| nearest(j).unwrap_or(0))
            .collect()
    }

    /// Sides of the grid that are not free of contact: along x and s, the lower and the upper one.
    fn reached(&self, pressure: &[f64]) -> [[bool; 2]; 2] {
        let [nx, ny] = self.cells();
        let mut reached = [[false; 2]; 2];
        for k in (0..pressure.len()).filter(|k| pressure[*k] > 0.0) {
            for (axis, (cell, cells)) in [(k % nx, nx), (k / nx, ny)].into_iter().enumerate() {
                reached[axis][0] |= cell < FREE;
                reached[axis][1] |= cell + FREE >= cells;
            }
        }
        reached
    }

    /// The window of the grid in mm.
    fn window(&self) -> [[f64; 2]; 2] {
        let ends = |first: f64, last: f64, step: f64| [first - 0.5 * step, last + 0.5 * step];
        let [nx, ny] = self.cells();
        [
            ends(self.x[0], self.x[nx - 1], self.step[0]),
            ends(self.places[0].s, self.places[ny - 1].s, self.step[1]),
        ]
    }

    fn enlarged(&self, curve: &ReferenceCurve, reached: [[bool; 2]; 2]) -> CurveGrid {
        let mut window = self.window();
        for (axis, window) in window.iter_mut().enumerate() {
            let growth = 0.15 * (window[1] - window[0]) + 2.0 * self.step[axis];
            // Cells are whole, so that half of one is no new one.
            let [low, high] = reached[axis].map(|reached| if reached { growth } else { 0.0 });
            *window = [
                window[0] - low + 0.25 * self.step[axis],
                window[1] + high - 0.25 * self.step[axis],
            ];
        }
        CurveGrid::new(curve, window, self.step)
    }

    /// Pressures of another grid at the cells, bilinearly.
    fn interpolated(&self, other: &CurveGrid, pressure: &[f64]) -> Vec<f64> {
        let width = other.x.len();
        let value = |i: i64, j: i64| {
            let inside =
                (0..width as i64).contains(&i) && (0..other.places.len() as i64).contains(&j);
            match inside {
                true => pressure[j as usize * width + i as usize],
                false => 0.0,
            }
        };
        let place = |at: f64, first: f64, step: f64| {
            let at = (at - first) / step;
            (at.floor() as i64, at - at.floor())
        };
        let mut out = Vec::with_capacity(self.x.len() * self.places.len());
        for strip in &self.places {
            let (j, v) = place(strip.s, other.places[0].s, other.step[1]);
            for x in &self.x {
                let (i, u) = place(*x, other.x[0], other.step[0]);
                let row = |j: i64| (1.0 - u) * value(i, j) + u * value(i + 1, j);
                out.push((1.0 - v) * row(j) + v * row(j + 1));
            }
        }
        out
    }
}

impl CurveTask<'_> {
    /// Brings the wheel to rest without friction.
    ///
    /// # Errors
    /// Why it does not come to rest; or the monitor stopped the work.
    pub(crate) fn rest(
        &self,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let coarse = self.first(workspace, monitor)?;
        let step = self.wanted(&coarse);
        let mut window = coarse.grid.window();
        for (axis, window) in window.iter_mut().enumerate() {
            let [first, last] = extent(&coarse, axis);
            let margin = coarse.grid.step[axis] + (FREE as f64 + 0.5) * step[axis];
            *window = [first - margin, last + margin];
        }
        let grid = CurveGrid::new(self.curve, window, step);
        let start = grid.interpolated(&coarse.grid, &coarse.pressure);
        let runs = coarse.runs.iter().map(|run| {
            // The same arc lengths on the new grid.
            run.map(|j| {
                let s = coarse.grid.places[j].s;
                grid.places.partition_point(|place| place.s < s)
            })
        });
        let runs: Vec<[usize; 2]> = runs.collect();
        let contact = Start {
            grid,
            runs,
            pressure: start,
            centre: coarse.centre,
            slope: coarse.slope,
            heights: coarse.heights,
            iterations: coarse.work.iterations,
        };
        self.settled(contact, &Friction::default(), FORCE, workspace, monitor)
    }

    /// Brings the wheel to rest with friction, from a rest with other friction.
    ///
    /// # Errors
    /// As [`rest`](Self::rest).
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
            slope: before.slope,
            heights: before.heights,
            iterations: before.work.iterations,
        };
        self.settled(start, friction, FORCE, workspace, monitor)
    }

    /// The contact on coarse grids.
    fn first(
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
            let pressure = vec![0.0; grid.x.len() * grid.places.len()];
            let runs = vec![[0, grid.places.len() - 1]];
            let start = Start {
                runs: match self.influence {
                    Influence::AngleCorrected | Influence::Unfolded => runs,
                    // Overlaps are wider than contacts, so that runs of strips that touch may only be found with what acts alone.
                    Influence::HalfSpace => {
                        let over = grid.over(self.curve, self.touch - lowering);
                        let deep: Vec<f64> = over
                            .iter()
                            .map(|over| over.map_or(0.0, |over| (-over.gap).max(0.0)))
                            .collect();
                        grid.joined(grid.runs(&deep))
                    }
                },
                grid,
                pressure,
                centre: self.touch - lowering,
                slope: 0.0,
                heights: 0,
                iterations: 0,
            };
            let found =
                self.settled(start, &Friction::default(), FORCE_FIRST, workspace, monitor)?;
            let next = self.touch - found.centre;
            let close = (next / lowering - 1.0).abs() < 0.1;
            lowering = next;
            let found = last.insert(found);
            found.runs = match self.influence {
                Influence::AngleCorrected | Influence::Unfolded => found.runs.clone(),
                Influence::HalfSpace => found.grid.joined(found.grid.runs(&found.pressure)),
            };
            if close {
                break;
            }
        }
        last.ok_or_else(|| NormalError::NoAnswer("no grid of the contact was found".to_owned()))
    }

    /// A coarse grid over all places where the bodies overlap at a lowering in mm.
    fn over_overlaps(&self, lowering: f64) -> Result<CurveGrid, NormalError> {
        // So that a little more than the lowering still fits.
        let centre = self.touch - 1.1 * lowering;
        let [first, last] = self.curve.range();
        let nothing = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut along, mut across) = (nothing, nothing);
        let (mut widest, mut longest): (f64, f64) = (0.0, 0.0);
        let mut width = 0.0;
        let strips = ((last - first) / LOOK) as usize;
        for k in 0..strips {
            let place = self.curve.at(first + (k as f64 + 0.5) * LOOK);
            let nearest = self.curve.nearest(&place, centre);
            let Some((x, wheel)) = nearest.filter(|(_, wheel)| wheel.gap < 0.0) else {
                width = 0.0;
                continue;
            };
            if k == 0 || k + 1 == strips {
                return Err(NormalError::NoAnswer(
                    "the contact reaches the end of the rail's points; send the points beyond"
                        .to_owned(),
                ));
            }
            width += LOOK;
            widest = widest.max(width);
            let half = self.curve.half_length(&wheel);
            longest = longest.max(2.0 * half);
            along = [along[0].min(x - half), along[1].max(x + half)];
            across = [across[0].min(place.s - LOOK), across[1].max(place.s + LOOK)];
        }
        if widest == 0.0 {
            return Err(NormalError::NoAnswer(no_touch(lowering, 0.0)));
        }
        let step = [longest / FIRST, widest.max(2.0 * LOOK) / FIRST];
        let window = [along, across];
        let window = [0, 1].map(|k| {
            let margin = FREE as f64 * step[k];
            [window[k][0] - margin, window[k][1] + margin]
        });
        let step = [0, 1].map(|k| step[k].max((window[k][1] - window[k][0]) / CELLS_MAX as f64));
        Ok(CurveGrid::new(self.curve, window, step))
    }

    /// The size of cells that resolves a contact.
    fn wanted(&self, found: &CurveContact) -> [f64; 2] {
        let CurveContact { grid, pressure, .. } = found;
        let mut step = [0, 1].map(|axis| {
            let [first, last] = extent(found, axis);
            (last - first) / self.fineness.contact
        });
        // Patches far apart do not make each other's strips wider.
        let total: f64 = pressure.iter().sum();
        let mut heaviest = (0.0, step);
        for patch in groups(grid.cells(), |k| pressure[k] > 0.0) {
            let load: f64 = patch.iter().map(|k| pressure[*k]).sum();
            if load < self.fineness.share_min * total {
                continue;
            }
            let size = [0, 1].map(|axis| {
                let [first, last] = extent_of(grid, &patch, axis);
                last - first
            });
            for axis in [0, 1] {
                step[axis] = step[axis].min(size[axis] / self.fineness.patch);
            }
            if load > heaviest.0 {
                heaviest = (load, size.map(|size| size / self.fineness.contact));
            }
        }
        let window = grid.window();
        [0, 1].map(|axis| {
            let length = window[axis][1] - window[axis][0];
            let wanted = step[axis].min(heaviest.1[axis]);
            match grid.step[axis] * FINE_ENOUGH < wanted {
                true => grid.step[axis],
                false => wanted.max(length / CELLS_MAX as f64),
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
            let found = self.on_grid(start, &friction, tolerance, workspace, monitor)?;
            let reached = found.grid.reached(&found.pressure);
            if reached == [[false; 2]; 2] {
                return Ok(found);
            }
            let grid = found.grid.enlarged(self.curve, reached);
            let shift = |s: f64| grid.places.partition_point(|place| place.s < s);
            let opened = friction.opened.take();
            friction.opened = opened.map(|opened| grid.interpolated(&found.grid, &opened));
            start = Start {
                runs: found
                    .runs
                    .iter()
                    .map(|run| run.map(|j| shift(found.grid.places[j].s)))
                    .collect(),
                pressure: grid.interpolated(&found.grid, &found.pressure),
                grid,
                centre: found.centre,
                slope: found.slope,
                heights: found.heights,
                iterations: found.work.iterations,
            };
        }
        Err(NormalError::NoAnswer(
            "the contact reaches the end of the surfaces on which it was looked for".to_owned(),
        ))
    }

    /// The wheel at rest on one grid.
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
            slope,
            mut heights,
            mut iterations,
        } = start;
        let strips = BentStrips {
            angle: grid.mean_angles(self.curve, centre),
            run: grid.run_of_strips(&runs),
            corrected: self.influence == Influence::AngleCorrected,
        };
        let operator = BentOperator::new(grid.cells(), grid.step, self.elasticity, strips);
        let wanted = match self.loading {
            WheelLoad::Vertical(force) => Some(force + friction.lift),
            WheelLoad::Normal(force) => Some(force),
            WheelLoad::Lowering(_) => None,
        };
        if wanted.is_some_and(|wanted| wanted <= 0.0) {
            return Err(NormalError::NoAnswer(
                "friction carries the whole load; give a normal_force_n or an approach_mm"
                    .to_owned(),
            ));
        }
        let mut search = HeightSearch {
            bounds: [0.0, f64::INFINITY],
            before: None,
            slope,
        };
        for height in 0..HEIGHTS_MAX {
            let over = grid.over(self.curve, centre);
            let gap = gap(&over, friction.opened.as_deref());
            let deepest = gap.iter().copied().fold(f64::INFINITY, f64::min);
            let mut residual = 0.0;
            if deepest < 0.0 {
                let start = match pressure.iter().any(|p| *p > 0.0) {
                    true => pressure,
                    false => first_pressure(&gap, grid.area(), self.elasticity),
                };
                let task = PressureTask {
                    gap: &gap,
                    cell: grid.area(),
                    loading: NormalLoad::Approach(0.0),
                    tolerance: VIOLATION.max(0.2 * tolerance),
                };
                let found = solve_pressure(&task, &operator, start, workspace, monitor)?;
                iterations += found.iterations;
                residual = found.residual;
                pressure = found.pressure;
            } else {
                pressure.fill(0.0);
            }
            heights += 1;
            let carried = carried(self.loading, &grid, &pressure);
            let lowering = self.touch - centre;
            let missed = wanted.map_or(0.0, |wanted| carried / wanted - 1.0);
            if missed.abs() <= tolerance || search.is_closed() || height + 1 == HEIGHTS_MAX {
                if missed.abs() > tolerance.max(FORCE_POOR) {
                    return Err(NormalError::NoAnswer(format!(
                        "no height of the wheel was found on the curve of the rail at which it carries its load, which is missed by {:.1} %",
                        100.0 * missed.abs()
                    )));
                }
                let work = NormalWork {
                    cells: grid.cells(),
                    grids: 1,
                    iterations,
                    residual,
                    pressure_change: 0.0,
                };
                return Ok(CurveContact {
                    grid,
                    operator,
                    centre,
                    over,
                    pressure,
                    runs,
                    work,
                    heights,
                    missed: missed.abs(),
                    slope: search.slope,
                });
            }
            let wanted = wanted.unwrap_or(carried);
            centre = self.touch - search.next([lowering, carried], wanted);
        }
        unreachable!("the last height ends the search")
    }
}

/// The search for the lowering of a wheel that carries a force: secant steps in the force to the power 2/3, kept between what carries too little and
/// too much.
struct HeightSearch {
    bounds: [f64; 2],
    /// The last lowering in mm, and the power of its force.
    before: Option<[f64; 2]>,
    /// Power of the force per mm; 0 where it is not known.
    slope: f64,
}

impl HeightSearch {
    fn is_closed(&self) -> bool {
        self.bounds[1] - self.bounds[0] < BRACKET_MIN * self.bounds[1]
    }

    /// The lowering to try after one in mm with its force in N.
    fn next(&mut self, [lowering, carried]: [f64; 2], wanted: f64) -> f64 {
        let [low, high] = &mut self.bounds;
        if carried < wanted {
            *low = low.max(lowering);
        } else {
            *high = high.min(lowering);
        }
        let power = |force: f64| force.max(0.0).powf(2.0 / 3.0);
        let here = power(carried);
        let secant = self
            .before
            .filter(|[at, _]| *at != lowering)
            .map(|[at, was]| (here - was) / (lowering - at));
        let least = lowering.max(LOWERING_LEAST);
        match secant.filter(|slope| *slope > 0.0) {
            Some(slope) => self.slope = slope,
            None if self.slope <= 0.0 => self.slope = here / least,
            None => {}
        }
        self.before = Some([lowering, here]);
        let step = match self.slope > 0.0 {
            true => (power(wanted) - here) / self.slope,
            false => least,
        };
        let next = lowering + step.clamp(-STEP_LARGEST * least, STEP_LARGEST * least);
        let [low, high] = self.bounds;
        if next > low && next < high {
            next
        } else if high.is_finite() {
            0.5 * (low + high)
        } else {
            (1.0 + STEP_LARGEST) * least
        }
    }
}

/// Where a grid is solved from.
struct Start {
    grid: CurveGrid,
    runs: Vec<[usize; 2]>,
    pressure: Vec<f64>,
    centre: f64,
    slope: f64,
    heights: u32,
    iterations: u32,
}

/// The gap of the cells: the wheel over the rail, and what tractions open.
fn gap(over: &[Option<WheelOver>], opened: Option<&[f64]>) -> Vec<f64> {
    let mut gap: Vec<f64> = over
        .iter()
        .map(|over| over.map_or(NO_CONTACT, |over| over.gap))
        .collect();
    for (gap, opened) in gap.iter_mut().zip(opened.into_iter().flatten()) {
        *gap += opened;
    }
    gap
}

/// A pressure to start from: Hertz's law over the part that overlaps by more than half of the deepest overlap.
fn first_pressure(gap: &[f64], cell: f64, elasticity: &Elasticity) -> Vec<f64> {
    let deepest = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let part = |gap: &f64| (2.0 * gap / deepest - 1.0).max(0.0);
    let inside = gap.iter().filter(|gap| part(gap) > 0.0).count();
    let radius = (inside as f64 * cell / std::f64::consts::PI).sqrt();
    let largest = -elasticity.contact_modulus() * deepest / (std::f64::consts::PI * radius);
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
        let nx = self.grid.x.len();
        let inside = |k: usize| self.pressure[k] > 0.0 && (first..=last).contains(&(k / nx));
        let s: Vec<f64> = self.grid.places.iter().map(|place| place.s).collect();
        let depth = self.over.iter().flatten().map(|over| -over.gap);
        let depth = depth.fold(0.0, f64::max);
        let field = |patch: Vec<usize>| {
            let mut pressure = vec![0.0; self.pressure.len()];
            for k in patch {
                pressure[k] = self.pressure[k];
            }
            GridPressure::of_solution(
                &self.grid.x,
                &s,
                &squares(nx, &pressure),
                &pressure,
                depth,
                Edges::Found,
            )
        };
        let patches = groups(self.grid.cells(), inside).into_iter();
        // A patch of a cell or two has no edges.
        let found: Vec<GridPressure> = patches.filter_map(|patch| field(patch).ok()).collect();
        match found.is_empty() {
            true => Err(NormalError::NoAnswer(
                "the contact is smaller than a cell of the grid".to_owned(),
            )),
            false => Ok(found),
        }
    }

    /// The strips of the parts of the contact that are solved together.
    pub(crate) fn parts(&self, influence: Influence) -> Vec<[usize; 2]> {
        let last = self.grid.places.len() - 1;
        let runs = self.grid.runs(&self.pressure);
        match influence {
            Influence::AngleCorrected | Influence::Unfolded => vec![[0, last]],
            Influence::HalfSpace => {
                let of_strips = self.grid.run_of_strips(&self.runs);
                let mut parts: Vec<[usize; 2]> = Vec::new();
                for run in runs {
                    match parts.last_mut() {
                        Some(part) if of_strips[part[1]] == of_strips[run[0]] => part[1] = run[1],
                        _ => parts.push(run),
                    }
                }
                parts
            }
        }
    }

    /// The field of a part.
    ///
    /// # Errors
    /// There are more than 64 patches.
    pub(crate) fn field(patches: Vec<GridPressure>) -> Result<PressureField, NormalError> {
        PressureField::of_grids(patches).map_err(NormalError::NoAnswer)
    }
}
