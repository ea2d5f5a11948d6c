//! One grid per patch, where one grid for all patches would be too coarse for some of them.
//!
//! Patches are taken from a solution on one grid. Each gets a grid of its own, sized by its own width, and patches whose boxes
//! overlap share one. The pressures of all grids are the unknowns of one conjugate gradient iteration: within a grid the
//! influence is a convolution, between grids see `coupling.rs`. Every grid is refined, moved or enlarged until its own patch
//! is settled.

use std::ops::Range;

use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::conjugate_gradients::{
    PressureAnswer, PressureTask, solve_pressure,
};
use crate::contact::normal::gap::coupling::TilesInfluence;
use crate::contact::normal::gap::grid::{
    APPROACH_CHANGE, COARSER_MAX, GRIDS_MAX, GapOutcome, GridFineness, GridsExit, NEAR,
    NormalError, PRESSURE_CHANGE, PatchGrid, PressureGrid, REFINEMENT, edge_reached, within,
};
use crate::contact::normal::gap::task::GapTask;

/// More grids than this are not coupled: such a gap is rough, not a few patches of different size.
const TILES_MAX: usize = 6;
/// Most cells of all grids together. Three patches of like size have 89 × 89 cells each, a small patch beside a large one up to 30 000
/// in all. A gap that wants more is rough: with 60 000 cells such gaps took up to 10 s and did not settle.
const CELLS_MAX: usize = 36_000;
/// Cells along either axis of a grid whose patch is hardly known yet, at least and at most. Chosen by judgement; how much it matters was not
/// measured.
const CELLS_FIRST: [f64; 2] = [24.0, 56.0];
/// Allowed violation of the contact conditions over what serves for one grid: small patches yield less than large ones. Chosen by judgement; how
/// much it matters was not measured.
const TOLERANCE_SHARE: f64 = 0.25;
/// A patch with less than this fraction of the load needs fewer cells. Chosen by judgement; how much it matters was not measured.
const SHARE_LARGE: f64 = 0.25;
/// Cells across such a patch over those across a large one. On 22 gaps with a patch of radius 1 to 60 mm beside one of 300 mm (1 to 60 kN
/// on the small one), 0.5 and 1 change its force by 0.05 %, its pressure by 0.2 %, its width by 0.4 % and F_x by 0.0003 μN at most.
const RESOLUTION_SMALL: f64 = 0.7;
/// Cells across a patch whose load does not count (see `GridFineness::share_min`).
const CELLS_TINY: f64 = 10.0;

/// What follows the grid of a patch.
enum NextGrids {
    Keep,
    Rough,
    Change(PressureGrid),
}

impl GapTask {
    /// Goes on from a solution on one grid with one grid per patch; none if there is only one patch, or too many.
    pub(crate) fn solve_on_tiles(
        &self,
        whole: PatchGrid,
        least: f64,
        resolution: GridFineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<Option<GapOutcome>, NormalError> {
        let limits = self.gap.window();
        let grids = boxes(&whole, limits);
        if !(2..=TILES_MAX).contains(&grids.len()) {
            return Ok(None);
        }
        let found = GapOutcome {
            patch_grids: vec![whole],
            iterations: 0,
            exit: GridsExit::GridsUsedUp,
            pressure_change: 0.0,
            least,
        };
        self.on_tiles(grids, found, resolution, workspace, monitor)
            .map(Some)
    }

    /// Refines, moves and enlarges the grids of several patches until they settle; `found` has what is known of them.
    pub(crate) fn on_tiles(
        &self,
        mut grids: Vec<PressureGrid>,
        mut found: GapOutcome,
        resolution: GridFineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<GapOutcome, NormalError> {
        for _ in 0..GRIDS_MAX {
            let tolerance = TOLERANCE_SHARE * resolution.tolerance;
            let patch_grids =
                self.press_grids(grids, &found.patch_grids, tolerance, workspace, monitor)?;
            let before = std::mem::replace(&mut found.patch_grids, patch_grids);
            found.iterations += found.patch_grids[0].pressed.iterations;
            let peak = |patch_grids: &[PatchGrid]| {
                patch_grids
                    .iter()
                    .map(PatchGrid::largest)
                    .fold(0.0, f64::max)
            };
            found.pressure_change = peak(&before) / peak(&found.patch_grids) - 1.0;
            let depth = found.patch_grids[0].pressed.approach - found.least;
            let total: f64 = found.patch_grids.iter().map(PatchGrid::load).sum();
            let (mut next, mut changed, mut rough) = (Vec::new(), false, false);
            for patch_grid in &found.patch_grids {
                let resolution = own_resolution(resolution, patch_grid.load() / total);
                match self.refined_grid(patch_grid, &before, depth, resolution)? {
                    NextGrids::Keep => next.push(patch_grid.grid.clone()),
                    NextGrids::Rough => {
                        rough = true;
                        next.push(patch_grid.grid.clone());
                    }
                    NextGrids::Change(grid) => {
                        changed = true;
                        next.push(grid);
                    }
                }
            }
            if !changed {
                let missed = self.missed(&found.patch_grids, depth);
                if missed.is_empty() {
                    found.exit = match rough {
                        true => GridsExit::Rough,
                        false => GridsExit::Settled,
                    };
                    break;
                }
                next.extend(missed);
            }
            grids = merged(next);
            if grids.len() > TILES_MAX || cells(&grids) > CELLS_MAX {
                found.exit = GridsExit::CellsUsedUp;
                break;
            }
        }
        Ok(found)
    }

    fn press_grids(
        &self,
        grids: Vec<PressureGrid>,
        before: &[PatchGrid],
        tolerance: f64,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<Vec<PatchGrid>, NormalError> {
        let influence = TilesInfluence::new(&grids, self.contact_modulus, workspace);
        let (mut gap, mut start) = (Vec::new(), Vec::new());
        for grid in &grids {
            let own = grid.gap(&self.gap);
            start.extend(start_on(grid, before, &own));
            gap.extend(own);
        }
        let task = PressureTask {
            gap: &gap,
            cell: grids[0].step[0] * grids[0].step[1],
            loading: self.loading,
            tolerance,
        };
        let pressed = solve_pressure(&task, &influence, start, workspace, monitor)?;
        let parts = grids.into_iter().zip(influence.ranges);
        let patch_grid = |(grid, range): (PressureGrid, Range<usize>)| {
            let mut pressure = pressed.pressure[range.clone()].to_vec();
            grid.symmetrise(&mut pressure);
            let pressed = PressureAnswer {
                pressure,
                distance: pressed.distance[range].to_vec(),
                ..pressed
            };
            PatchGrid { grid, pressed }
        };
        Ok(parts.map(patch_grid).collect())
    }

    /// Whether the grid of a patch is to be enlarged, refined or kept. See `GapTask::refined_grid`.
    fn refined_grid(
        &self,
        patch_grid: &PatchGrid,
        before: &[PatchGrid],
        depth: f64,
        resolution: GridFineness,
    ) -> Result<NextGrids, NormalError> {
        let limits = self.gap.window();
        let PatchGrid { grid, pressed } = patch_grid;
        let (cut, short): (Vec<_>, Vec<_>) = grid
            .sides_in_contact(&pressed.pressure)
            .into_iter()
            .partition(|side| grid.ends_at(*side, limits));
        if !short.is_empty() {
            return Ok(NextGrids::Change(grid.enlarged(&short, limits)));
        }
        if patch_grid.largest() <= 0.0 {
            return Ok(NextGrids::Keep);
        }
        let wanted = grid.wanted(pressed, NEAR * depth, resolution, limits);
        let finer = PressureGrid::new(wanted.window, wanted.cells, grid.mirrored);
        if (0..2).any(|k| finer.step[k] < COARSER_MAX * grid.step[k]) {
            return Ok(NextGrids::Change(finer));
        }
        if let Some(side) = cut.first() {
            return Err(edge_reached(*side, limits));
        }
        let middle = [0, 1].map(|k| 0.5 * (grid.range(k)[0] + grid.range(k)[1]));
        let holds = |other: &&PatchGrid| {
            (0..2).all(|k| (other.grid.range(k)[0]..other.grid.range(k)[1]).contains(&middle[k]))
        };
        let Some(coarse) = before.iter().find(holds) else {
            return Ok(NextGrids::Keep);
        };
        if resolution.patch <= CELLS_TINY || coarse.grid == *grid {
            return Ok(NextGrids::Keep);
        }
        let ratio = |k: usize| coarse.grid.step[k] / grid.step[k];
        let ratio = ratio(0).max(ratio(1));
        // The largest pressure of one grid for all may be that of another patch.
        let alone = coarse.grid.patches(&coarse.pressed.pressure).len() == 1;
        let moved = (pressed.approach - coarse.pressed.approach).abs();
        if moved <= APPROACH_CHANGE * ratio * depth
            && alone
            && (coarse.largest() / patch_grid.largest() - 1.0).abs() <= PRESSURE_CHANGE * ratio
        {
            return Ok(NextGrids::Keep);
        }
        let cells = grid.cells.map(|n| (n as f64 * REFINEMENT) as usize);
        let finer = PressureGrid::new(wanted.window, cells, grid.mirrored);
        if (0..2).all(|k| finer.step[k] > COARSER_MAX * grid.step[k]) {
            return Ok(NextGrids::Rough);
        }
        Ok(NextGrids::Change(finer))
    }

    /// Grids around samples of the gap outside all grids at which the deformed surfaces overlap: patches that were too small to
    /// be seen before.
    fn missed(&self, patch_grids: &[PatchGrid], depth: f64) -> Vec<PressureGrid> {
        let approach = patch_grids[0].pressed.approach;
        let limits = self.gap.window();
        let samples = self.gap.samples();
        let x = if samples[0].is_empty() {
            &[0.0][..]
        } else {
            samples[0]
        };
        let y = samples[1];
        let values = self.gap.on(x, y);
        let sources: Vec<[f64; 3]> = patch_grids.iter().flat_map(point_loads).collect();
        let inside = |at: [f64; 2]| {
            patch_grids.iter().any(|patch_grid| {
                (0..2).all(|k| {
                    let [low, high] = patch_grid.grid.range(k);
                    at[k] >= low && at[k] <= high
                })
            })
        };
        let factor = 1.0 / (std::f64::consts::PI * self.contact_modulus);
        let mut found = Vec::new();
        for (k, value) in values.iter().enumerate().filter(|(_, h)| **h < approach) {
            let at = [x[k % x.len()], y[k / x.len()]];
            if inside(at) {
                continue;
            }
            let down: f64 = sources
                .iter()
                .map(|[u, v, force]| force / (at[0] - u).hypot(at[1] - v))
                .sum();
            if value + factor * down - approach < -NEAR * depth {
                let spacing = |axis: &[f64], i: usize| {
                    let [low, high] = [i.saturating_sub(1), (i + 1).min(axis.len() - 1)];
                    axis[high] - axis[low]
                };
                let across = spacing(y, k / x.len());
                let along = if samples[0].is_empty() {
                    across
                } else {
                    spacing(x, k % x.len())
                };
                let window = [along, across].into_iter().zip(at);
                let mut window = window.map(|(half, at)| [at - half, at + half]);
                let window = [window.next(), window.next()].map(Option::unwrap_or_default);
                let mirrored = [self.gap.is_mirrored()[0] && samples[0].is_empty(), false];
                let cells = [CELLS_FIRST[0] as usize; 2];
                found.push(PressureGrid::new(within(window, limits), cells, mirrored));
            }
        }
        found
    }
}

/// Pressures of a patch grid as point loads `[x, y, N]`, several cells in one.
fn point_loads(patch_grid: &PatchGrid) -> Vec<[f64; 3]> {
    const PARTS: usize = 10;
    let grid = &patch_grid.grid;
    let [x, y] = [grid.centres(0), grid.centres(1)];
    let area = grid.step[0] * grid.step[1];
    let mut sums = vec![[0.0; 3]; PARTS * PARTS];
    for (k, p) in patch_grid.pressed.pressure.iter().enumerate() {
        let [i, j] = [k % grid.cells[0], k / grid.cells[0]];
        let part = (j * PARTS / grid.cells[1]) * PARTS + i * PARTS / grid.cells[0];
        let force = p * area;
        let sum = &mut sums[part];
        *sum = [sum[0] + force * x[i], sum[1] + force * y[j], sum[2] + force];
    }
    let loaded = sums.into_iter().filter(|sum| sum[2] > 0.0);
    loaded
        .map(|[x, y, force]| [x / force, y / force, force])
        .collect()
}

/// The resolution that a part of the load asks for.
fn own_resolution(resolution: GridFineness, share: f64) -> GridFineness {
    if share < resolution.share_min {
        GridFineness {
            contact: CELLS_TINY,
            patch: CELLS_TINY,
            settles: false,
            ..resolution
        }
    } else if share < SHARE_LARGE {
        GridFineness {
            contact: RESOLUTION_SMALL * resolution.contact,
            settles: false,
            ..resolution
        }
    } else {
        resolution
    }
}

/// A box around every patch of a grid, those that overlap in one.
fn boxes(whole: &PatchGrid, limits: [[f64; 2]; 2]) -> Vec<PressureGrid> {
    let grid = &whole.grid;
    let boxes = grid.patches(&whole.pressed.pressure).into_iter();
    let boxes = boxes.map(|patch| {
        let window = grid.window_of(&patch);
        let window = [0, 1].map(|k| {
            let [low, high] = window[k];
            let margin = (1.5 * grid.step[k]).max(0.15 * (high - low));
            [low - margin, high + margin]
        });
        let window = within(window, limits);
        let cells = [0, 1].map(|k| {
            let [low, high] = window[k];
            ((high - low) / grid.step[k]).clamp(CELLS_FIRST[0], CELLS_FIRST[1]) as usize
        });
        let middle = window[1][0] + window[1][1];
        let straddles = middle.abs() < 1e-9 * (window[1][1] - window[1][0]);
        let mirrored = [grid.mirrored[0], grid.mirrored[1] && straddles];
        PressureGrid::new(window, cells, mirrored)
    });
    merged(boxes.collect())
}

/// The grids, those that overlap replaced by one over both with the finer cells.
pub(crate) fn merged(mut grids: Vec<PressureGrid>) -> Vec<PressureGrid> {
    let overlap = |a: &PressureGrid, b: &PressureGrid| {
        (0..2).all(|k| a.range(k)[0] < b.range(k)[1] && b.range(k)[0] < a.range(k)[1])
    };
    let mut k = 0;
    while k < grids.len() {
        let other = (k + 1..grids.len()).find(|m| overlap(&grids[k], &grids[*m]));
        let Some(other) = other else {
            k += 1;
            continue;
        };
        let (a, b) = (grids[k].clone(), grids.swap_remove(other));
        let window = [0, 1].map(|k| {
            let [a, b] = [a.range(k), b.range(k)];
            [a[0].min(b[0]), a[1].max(b[1])]
        });
        let cells = [0, 1].map(|k| {
            let [low, high] = window[k];
            ((high - low) / a.step[k].min(b.step[k])).ceil() as usize
        });
        let mirrored = [0, 1].map(|k| a.mirrored[k] && b.mirrored[k]);
        grids[k] = PressureGrid::new(window, cells, mirrored);
        k = 0;
    }
    grids
}

fn cells(grids: &[PressureGrid]) -> usize {
    grids.iter().map(|grid| grid.cells[0] * grid.cells[1]).sum()
}

/// Pressures to start from on a grid: those of all earlier grids that reach into it.
fn start_on(grid: &PressureGrid, before: &[PatchGrid], gap: &[f64]) -> Vec<f64> {
    let mut start = vec![0.0_f64; gap.len()];
    for patch_grid in before {
        if patch_grid.grid == *grid {
            return patch_grid.pressed.pressure.clone();
        }
        let found = grid.interpolated(&patch_grid.grid, &patch_grid.pressed.pressure);
        for (p, other) in start.iter_mut().zip(found) {
            *p = p.max(other);
        }
    }
    let largest = before.iter().map(PatchGrid::largest).fold(0.0, f64::max);
    grid.never_empty(start, largest, gap)
}
