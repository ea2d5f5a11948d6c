//! The normal problem of a wheel on the reference curve: one grid over the arc length of the rail, and the height of the wheel as an unknown.
//!
//! A coarse grid over the overlaps at an expected height finds the contact. The solution is on a finer grid, whose cells resolve the narrowest patch that
//! counts. Its strips lie at multiples of their width from the origin of the arc length, independent of the height, and omit what lies between the patches.

use std::borrow::Cow;
use std::f64::consts::PI;

use crate::geometry::profile::{GROOVE_DEPTH, POINT_SPACING};
use crate::geometry::reference_curve::{CurvePlace, FACING_LEAST, Nearest, ReferenceCurve};
use crate::half_space::bent_surface::{BentOperator, BentStrips, BentWorkspace, Influence};
use crate::half_space::unlike_bodies::Elasticity;
use crate::lazy_field::LazyField;
use crate::monitor::Monitor;
use crate::normal::curve_grid::{CurveGrid, FREE, WheelOverGrid, extent_of};

use crate::normal::gap::conjugate_gradients::{PressureTask, WeightedStrips, solve_pressure};
use crate::normal::gap::grid::{
    GridFineness, NEAR, NormalError, NormalWork, SHARE_MIN, first_pressure, no_touch, squares,
};
use crate::normal::hertz::NormalLoad;
use crate::normal::pressure_field::field::PressureField;
use crate::normal::pressure_field::grid_pressure::GridPressure;
use crate::normal::wheel::WheelLoad;
use crate::numerics::ITERATIONS_MAX;
use crate::numerics::flood_fill::groups;
use crate::numerics::roots::{HALVINGS, bisect};

/// Cells across the largest overlap on the coarse grid.
const FIRST: f64 = 24.0;
/// A grid is fine enough if its cells have at most the wanted size over this part.
const FINE_ENOUGH: f64 = 0.9;
/// Tolerance of the contact conditions on the coarse grid, relative to the deepest overlap.
const FIRST_TOLERANCE: f64 = 5e-3;
/// Largest number of cells along x or s of a grid before it is enlarged.
const CELLS_MAX: usize = 600;

/// Least number of cells across a light patch, over that of the whole contact.
const LIGHT: f64 = 0.27;
/// Relative tolerance of the force.
const FORCE: f64 = 2e-5;
/// Relative error of the force above which there is no solution.
const FORCE_POOR: f64 = 5e-3;
/// Least lowering of the wheel in mm.
const LOWERING_LEAST: f64 = 1e-4;
/// Usual upper limit of the lowering in mm of a wheel that rests where it touches first.
const LOWERING_USUAL: f64 = 1.0;
/// Change of height over the deepest overlap up to which the gap is linear in the height. Beyond it, the gap is computed again.
const LINEAR: f64 = 0.05;
/// Cosine of the angle of a face below which the face is steep.
pub(crate) const STEEP: f64 = 0.26;
/// Step in mm of the search for a lowering below steep faces.
const SLIDE_STEP: f64 = 0.5;

/// A wheel pressed on the reference curve of a rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CurveTask<'a> {
    pub(crate) curve: &'a ReferenceCurve<'a>,
    pub(crate) elasticity: &'a Elasticity,
    pub(crate) influence: Influence,
    pub(crate) loading: WheelLoad,
    /// Height of the wheel's centre in mm at which the bodies just touch.
    pub(crate) touch: f64,
    /// Expected lowering in mm.
    pub(crate) expected: f64,
    pub(crate) fineness: GridFineness,
}

/// A wheel at rest on the curve.
#[derive(Debug)]
pub(crate) struct CurveContact {
    pub(crate) grid: CurveGrid,
    pub(crate) operator: BentOperator,
    /// Height of the wheel's centre in mm.
    pub(crate) centre: f64,
    /// Distance in mm of the undeformed wheel from the rail along its normal at each cell; more than 8 if none was found.
    pub(crate) gap: Vec<f64>,
    /// Pressures in MPa.
    pub(crate) pressure: Vec<f64>,
    /// First and last strip of the runs of contact within which pressures interact.
    pub(crate) runs: Vec<[usize; 2]>,
    pub(crate) work: NormalWork,
    /// Whether the height was found within the largest number of heights.
    settled: bool,
    /// Relative error of the force.
    pub(crate) missed: f64,
    /// The gap in mm opened by tractions at each cell, if there is any.
    pub(crate) opened: Option<Vec<f64>>,
    over: WheelOverGrid,
    /// Whether the deformed surfaces of each strip nearly touch.
    near: Vec<bool>,
    /// The pressures of the patches with their first strips.
    patches: LazyField<Vec<(usize, GridPressure)>>,
}

/// The effect of friction on a contact.
#[derive(Debug, Clone, Default)]
pub(crate) struct Friction {
    /// Upward vertical force of the tractions on the rail in N.
    pub(crate) lift: f64,
    /// The gap in mm opened by tractions on the cells of a grid.
    pub(crate) opened: Option<Vec<f64>>,
}

/// Buffers that successive solves reuse.
pub(crate) type Workspace = BentWorkspace;

impl CurveTask<'_> {
    /// The mean of angles of rail and wheel, weighted with their parts of the displacements.
    fn of_both(&self, rail: f64, wheel: f64) -> f64 {
        if self.curve.is_flat() {
            return rail;
        }
        let share = self.elasticity.lower_share;
        share * rail + (1.0 - share) * wheel
    }

    /// Returns this task with the looser tolerance of grids that only locate the contact or estimate friction.
    pub(crate) fn roughly(mut self) -> Self {
        self.fineness.tolerance = FIRST_TOLERANCE;
        self
    }

    /// Finds the contact on a coarse grid, without friction.
    ///
    /// # Errors
    /// The reason why the wheel does not come to rest; or the monitor stopped the work.
    pub(crate) fn coarse(
        &self,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let mut lowering = match self.loading {
            WheelLoad::Lowering(lowering) => lowering,
            _ => self.expected.max(LOWERING_LEAST),
        };
        // Grids reach slightly deeper than the lowering.
        let deepest = |lowering: f64| self.touch - lowering - 0.1 * lowering.min(LOWERING_USUAL);
        let mut overlaps = self.curve.overlaps(deepest(lowering));
        if let Some(lower) = self.below_steep_faces(lowering, &overlaps)? {
            lowering = lower;
            overlaps = self.curve.overlaps(deepest(lowering));
        }
        let mut last = None;
        for _ in 0..ITERATIONS_MAX {
            let grid = self.over_overlaps(lowering, &overlaps)?;
            let centre = self.touch - lowering;
            let over = grid.over(self.curve, centre);
            let runs = match self.influence {
                Influence::AngleCorrected => vec![[0, grid.places.len() - 1]],
                // Overlaps are wider than contacts, so runs of strips that touch can only be determined from a solution.
                Influence::HalfSpace => {
                    let deep: Vec<f64> = over.gap.iter().map(|gap| (-gap).max(0.0)).collect();
                    grid.joined(grid.runs(&deep))
                }
            };
            let start = Start {
                runs,
                pressure: vec![0.0; grid.x.len() * grid.places.len()],
                operator: None,
                over: Some(over),
                grid,
                centre,
                iterations: 0,
            };
            let none = Friction::default();
            let found = self.roughly().settled(start, &none, workspace, monitor)?;
            let next = self.touch - found.centre;
            let close = (next / lowering - 1.0).abs() < 0.1;
            let found = last.insert(found);
            lowering = next.max(LOWERING_LEAST);
            if self.influence == Influence::HalfSpace {
                found.runs = found.grid.joined(found.grid.runs(&found.pressure));
            }
            if close {
                break;
            }
            overlaps = self.curve.overlaps(deepest(lowering));
        }
        last.ok_or_else(|| NormalError::NoAnswer("no grid of the contact was found".to_owned()))
    }

    /// The lowering in mm at which places outside steep faces carry the load. `None` if the bodies overlap at such places at the expected lowering already, or if no
    /// lowering was found.
    fn below_steep_faces(
        &self,
        expected: f64,
        overlaps: &[Vec<Nearest>],
    ) -> Result<Option<f64>, NormalError> {
        let wanted = self.wanted_force(&Friction::default())?;
        let Some(wanted) = wanted.filter(|_| overlaps.iter().flatten().all(is_steep)) else {
            return Ok(None);
        };
        let overlaps = |lowering: f64| self.curve.overlaps(self.touch - lowering);
        let carries = |lowering: f64| self.carried_apart_from_steep(&overlaps(lowering)) >= wanted;
        let slides = (1..).map(|k| SLIDE_STEP * f64::from(k));
        let mut lowerings = slides
            .take_while(|slide| *slide < GROOVE_DEPTH)
            .map(|slide| expected + slide);
        let carrying = lowerings.find(|lowering| carries(*lowering));
        Ok(carrying.map(|carrying| {
            let bracket = [carrying, carrying - SLIDE_STEP];
            bisect(bracket, HALVINGS, carries)[0]
        }))
    }

    /// Estimates the force in N of the overlaps outside steep faces. Each counts as a circle with half of its area, pressed by a sphere.
    fn carried_apart_from_steep(&self, overlaps: &[Vec<Nearest>]) -> f64 {
        let of_overlap = |overlap: &Vec<Nearest>| {
            let flat = || overlap.iter().filter(|at| !is_steep(at));
            let lengths = flat().map(|at| 2.0 * self.curve.half_length(&at.wheel));
            let area = 0.5 * POINT_SPACING * lengths.sum::<f64>();
            let depth = flat().map(|at| -at.wheel.gap).fold(0.0, f64::max);
            4.0 / 3.0 * self.elasticity.contact_modulus() * depth * (area / PI).sqrt()
        };
        overlaps.iter().map(of_overlap).sum()
    }

    /// Brings the wheel to rest on a grid that meets the wanted resolution.
    ///
    /// # Errors
    /// See [`coarse`](Self::coarse).
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
        let missed = |windows: &[[f64; 2]], [low, high]: [f64; 2]| {
            windows.iter().all(|[from, to]| *to < low || *from > high)
        };
        for [low, high] in self.curve.overlaps(coarse.centre).iter().map(|o| ends(o)) {
            if missed(&windows, [low, high]) {
                windows.push([low - beside, high + beside]);
            }
        }
        let grid = CurveGrid::new(self.curve, [first - margin, last + margin], &windows, step);
        let friction = Friction {
            opened: friction
                .opened
                .as_ref()
                .map(|opened| grid.gaps(&coarse.grid, opened)),
            ..*friction
        };
        let start = Start {
            pressure: grid.pressures(&coarse.grid, &coarse.pressure),
            runs: grid.runs_of(&coarse.grid, &coarse.runs),
            operator: None,
            over: None,
            grid,
            centre: coarse.centre,
            iterations: coarse.work.iterations,
        };
        self.settled(start, &friction, workspace, monitor)
    }

    /// Brings the wheel to rest with friction on the grid of a solution with other friction.
    ///
    /// # Errors
    /// See [`coarse`](Self::coarse).
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
        self.settled(start, friction, workspace, monitor)
    }

    /// A coarse grid over all overlaps at a lowering in mm.
    fn over_overlaps(
        &self,
        lowering: f64,
        overlaps: &[Vec<Nearest>],
    ) -> Result<CurveGrid, NormalError> {
        let mut along = [f64::INFINITY, f64::NEG_INFINITY];
        let (mut widest, mut longest): (f64, f64) = (2.0 * POINT_SPACING, 0.0);
        let mut windows = Vec::with_capacity(overlaps.len());
        let [first, last] = self.curve.range();
        for overlap in overlaps {
            let [low, high] = ends(overlap);
            let window = [
                (low - POINT_SPACING).max(first),
                (high + POINT_SPACING).min(last),
            ];
            widest = widest.max(window[1] - window[0] - POINT_SPACING);
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
            if share < SHARE_MIN {
                continue;
            }
            let cells = self.fineness.across(share);
            let cells = cells.max(LIGHT * self.fineness.contact);
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

    /// Brings the wheel to rest on a grid, which is enlarged where the contact reaches its border.
    fn settled(
        &self,
        mut start: Start,
        friction: &Friction,
        workspace: &mut Workspace,
        monitor: &dyn Monitor,
    ) -> Result<CurveContact, NormalError> {
        let mut friction = friction.clone();
        for _ in 0..ITERATIONS_MAX {
            let mut found = self.on_grid(start, &friction, workspace, monitor)?;
            let opened = friction.opened.take();
            let Some(grid) = found.grid.enlarged(self.curve, &found.pressure) else {
                found.opened = opened;
                return Ok(found);
            };
            // Next to a nearly vertical face the contact outgrows every grid.
            if !found.settled {
                return Err(NormalError::NoAnswer(
                    "the contact extends beyond the surfaces that were searched, and no height of the wheel carries its load \
                     on them, as next to a face that is nearly vertical"
                        .to_owned(),
                ));
            }
            if grid.cells().iter().any(|cells| *cells > 2 * CELLS_MAX) {
                break;
            }
            friction.opened = opened.map(|opened| grid.gaps(&found.grid, &opened));
            start = Start {
                runs: grid.runs_of(&found.grid, &found.runs),
                pressure: grid.pressures(&found.grid, &found.pressure),
                operator: None,
                over: None,
                grid,
                centre: found.centre,
                iterations: found.work.iterations,
            };
        }
        Err(NormalError::NoAnswer(
            "the contact reaches the end of the surfaces that were searched".to_owned(),
        ))
    }

    /// The required value of [`carried`] in N; `None` if the height is given.
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
        let angles = grid.places.iter().zip(&over.angle);
        let strips = BentStrips {
            number: grid.numbers.clone(),
            angle: angles
                .map(|(place, wheel)| self.of_both(place.angle, *wheel))
                .collect(),
            run: grid.run_of_strips(runs),
            corrected: self.influence == Influence::AngleCorrected,
        };
        BentOperator::new(grid.x.len(), grid.step, self.elasticity, strips, workspace)
    }

    /// Brings the wheel to rest on one grid.
    ///
    /// Pressures are multiplied by a weight of their strip, the cosine of its angle. Their sum is then the vertical force, and lowering the wheel is a uniform
    /// approach, so conjugate gradients find pressures and height together. Other effects of the height on the gap enter the next solve.
    fn on_grid(
        &self,
        start: Start,
        friction: &Friction,
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
        let tolerance = self.fineness.tolerance;
        let nx = grid.x.len();
        let mut over = over.unwrap_or_else(|| grid.over(self.curve, centre));
        let operator = operator.unwrap_or_else(|| self.operator(&grid, &over, &runs, workspace));
        let wanted = self.wanted_force(friction)?;
        let weight = |place: &CurvePlace| match wanted {
            Some(_) => place.angle.cos().max(FACING_LEAST),
            None => 1.0,
        };
        let weights: Vec<f64> = grid.places.iter().map(weight).collect();
        let influence = WeightedStrips::new(&operator, &weights);
        let mut sum = wanted.map(|wanted| match self.loading {
            WheelLoad::Normal(_) => wanted * mean_weight(nx, &pressure, &over.gap, &weights),
            _ => wanted,
        });
        for height in 0..ITERATIONS_MAX {
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
                let modulus = self.elasticity.contact_modulus();
                pressure = first_pressure(&weighted, depth, grid.area(), modulus);
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
            let ends = height + 1 == ITERATIONS_MAX;
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
            sum = sum.map(|sum| match self.loading {
                WheelLoad::Normal(_) => sum / (1.0 + missed),
                _ => sum - missed * wanted.unwrap_or(0.0),
            });
            if !is_linear {
                over = grid.over(self.curve, centre);
            }
        }
        unreachable!("the last height ends the search")
    }
}

/// Whether the rail is steep at a place.
fn is_steep(at: &Nearest) -> bool {
    at.place.angle.cos() < STEEP
}

/// The ends of an overlap along the arc length in mm.
fn ends(overlap: &[Nearest]) -> [f64; 2] {
    [0, overlap.len() - 1].map(|k| overlap[k].place.s)
}

/// The error for a force with a relative error `part`.
fn load_missed(part: f64) -> NormalError {
    NormalError::NoAnswer(format!(
        "no height of the wheel was found on the curve of the rail at which it carries its load, which is missed by {:.1} %",
        100.0 * part.abs()
    ))
}

/// Combines the values of the cells with the weight of their strip.
fn each_row(values: &mut [f64], weights: &[f64], of: fn(f64, f64) -> f64) {
    let nx = values.len() / weights.len();
    for (row, weight) in values.chunks_exact_mut(nx).zip(weights) {
        row.iter_mut()
            .for_each(|value| *value = of(*value, *weight));
    }
}

/// The load-weighted mean weight of the strips in contact, or the weight at the least gap if none is in contact.
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

/// The start of a solve on a grid.
struct Start {
    grid: CurveGrid,
    runs: Vec<[usize; 2]>,
    pressure: Vec<f64>,
    centre: f64,
    /// The operator, if the grid has been solved before.
    operator: Option<BentOperator>,
    over: Option<WheelOverGrid>,
    iterations: u32,
}

/// The force of pressures that corresponds to the load: the vertical one, or the sum of the normal ones.
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

impl CurveContact {
    /// The pressures of the patches in some strips, each as a separate field, by increasing arc length; coordinates are x and s. Without `edges` they are samples
    /// (see [`GridPressure::of_samples`]).
    ///
    /// # Errors
    /// See [`GridPressure::of_samples`].
    pub(crate) fn patches(
        &self,
        [first, last]: [usize; 2],
        edges: bool,
    ) -> Result<Vec<GridPressure>, NormalError> {
        let with_edges = || {
            let mut all = self.all_patches();
            all.iter_mut().for_each(|(_, patch)| patch.find_edges());
            all
        };
        let all = match edges {
            true => Cow::Borrowed(self.patches.get_or_make(with_edges)),
            false => Cow::Owned(self.all_patches()),
        };
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
        let field = |patch: Vec<usize>| {
            let overlaps = patch.iter().map(|k| -self.gap[*k]);
            let depth = overlaps.fold(0.0, f64::max);
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
            let found = GridPressure::of_samples(
                &self.grid.x[columns.clone()],
                &s,
                &squares(columns.len(), &pressure),
                &pressure,
                depth,
            );
            // A patch of one or two cells has no edges.
            Some((strip, found.ok()?))
        };
        let inside = |k: usize| self.pressure[k] > 0.0;
        let patches = groups(self.grid.cells(), inside).into_iter();
        patches.filter_map(field).collect()
    }

    /// The strips of the parts of the contact that are solved together: everything on the curve, the strips of a plane, or with the influence of a half-space the runs
    /// that interact.
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

    /// Estimated changes with the friction: of the vertical force on the rail, relative to it, and of the lateral force through the gap opened by tractions, relative to all
    /// normal forces. The lateral force changes with the turn of the surface and with `shared`, the part of a change of pressures that tractions follow.
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
