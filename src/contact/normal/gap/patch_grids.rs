//! One grid per patch, if one grid for all patches is too coarse for some of them.
//!
//! The patches come from a solution on one grid. Each gets a grid adapted to its own width; patches whose boxes overlap share one. Every patch is solved at the
//! common approach, in the gap opened by the loads of the others. Loads and approach are iterated.

use crate::half_space::bent_surface::BentWorkspace;
use crate::monitor::Monitor;
use crate::normal::gap::grid::{
    FIRST, GapOutcome, GridFineness, NEAR, NormalError, PatchGrid, PressureGrid, within,
};
use crate::normal::gap::surface::{GapSurface, Window, around};
use crate::normal::gap::task::{GapTask, SearchBox};
use crate::normal::hertz::NormalLoad;
use crate::numerics::ITERATIONS_MAX;

/// Largest number of patches with their own grids; a gap with more patches is rough.
const PATCHES_MAX: usize = 6;
/// Number of samples along either axis of the gap opened by the loads of other patches.
const SAMPLES: usize = 12;

/// A force `[x, y, N]`.
type PointLoad = [f64; 3];

impl GapTask {
    /// Solves with one grid per patch, starting from a solution on one grid. `None` if there is only one patch, or too many.
    pub(crate) fn patch_by_patch(
        &self,
        whole: &PatchGrid,
        least: f64,
        mut fineness: GridFineness,
        workspace: &mut BentWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<Option<GapOutcome>, NormalError> {
        let mut grids = boxes(whole, self.gap.window());
        if !(2..=PATCHES_MAX).contains(&grids.len()) {
            return Ok(None);
        }
        let mut approach = whole.pressed.approach;
        let mut found = GapOutcome {
            patch_grids: vec![whole.clone()],
            iterations: 0,
            settled: false,
            pressure_change: 0.0,
            least,
        };
        let mut settled = true;
        for _ in 0..ITERATIONS_MAX {
            let loads: Vec<PointLoad> = found.patch_grids.iter().flat_map(point_loads).collect();
            let mut patch_grids = Vec::with_capacity(grids.len());
            let (mut stiffness, mut change) = (0.0, 0.0_f64);
            for grid in grids {
                let (own, others): (Vec<_>, Vec<_>) =
                    loads.iter().partition(|[x, y, _]| grid.holds([*x, *y]));
                let task = GapTask {
                    gap: self.opened(&grid, &others),
                    loading: NormalLoad::Approach(approach),
                    contact_modulus: self.contact_modulus,
                };
                let gap = grid.gap(&task.gap);
                let deepest = gap.iter().copied().fold(f64::INFINITY, f64::min);
                if deepest >= approach {
                    patch_grids.push(PatchGrid::apart(grid, gap, approach));
                    continue;
                }
                let reach = SearchBox {
                    window: [grid.range(0), grid.range(1)],
                    level: approach,
                    least: deepest,
                };
                let middle = grid.middle;
                let start = found.patch_grids.iter().find(|at| at.grid.holds(middle));
                let start = start.filter(|at| at.largest() > 0.0);
                let start = start.map(|at| (at.grid.clone(), at.pressed.clone()));
                let (refined, _) =
                    task.refined(grid, start, reach, fineness, workspace, monitor)?;
                found.iterations += refined.iterations;
                found.pressure_change = refined.pressure_change;
                settled &= refined.settled;
                patch_grids.extend(refined.patch_grids);
                let load = patch_grids[patch_grids.len() - 1].load();
                let before: f64 = own.iter().map(|[.., force]| force).sum();
                change = change.max((load - before).abs());
                // The stiffness of Hertz's contact.
                stiffness += 1.5 * load / (approach - deepest);
            }
            found.patch_grids = patch_grids;
            grids = found.patch_grids.iter().map(|at| at.grid.clone()).collect();
            // Later rounds change the loads only slightly.
            fineness = fineness.alone();
            let total: f64 = found.patch_grids.iter().map(PatchGrid::load).sum();
            let mut missed = 0.0;
            if let NormalLoad::Force(force) = self.loading {
                missed = force - total;
                let scale = force / total;
                for patch_grid in &mut found.patch_grids {
                    let pressure = patch_grid.pressed.pressure.iter_mut();
                    pressure.for_each(|p| *p *= scale);
                }
            }
            if change.max(missed.abs()) <= fineness.tolerance * total {
                let unseen = self.unseen(&found.patch_grids, approach - least);
                if unseen.is_empty() {
                    found.settled = settled;
                    break;
                }
                grids.extend(unseen);
            }
            approach += missed / stiffness;
            grids = merged(grids);
            if grids.len() > PATCHES_MAX {
                break;
            }
        }
        Ok(Some(found))
    }

    /// The gap over and around a grid, including the gap opened by point loads elsewhere.
    fn opened(&self, grid: &PressureGrid, loads: &[&PointLoad]) -> GapSurface {
        let limits = self.gap.window();
        let [x, y] = [0, 1].map(|k| around(grid.range(k), limits[k], SAMPLES));
        let rows = y.iter().map(|y| {
            let at = |x: &f64| self.displaced([*x, *y], loads.iter().copied());
            x.iter().map(at).collect()
        });
        let rows: Vec<Vec<f64>> = rows.collect();
        self.gap.changed(&x, &y, &rows)
    }

    /// Displacement in mm of a place by point loads.
    fn displaced<'a>(&self, [x, y]: [f64; 2], loads: impl Iterator<Item = &'a PointLoad>) -> f64 {
        let of_load = |[u, v, force]: &PointLoad| force / (x - u).hypot(y - v);
        loads.map(of_load).sum::<f64>() / (std::f64::consts::PI * self.contact_modulus)
    }

    /// Grids around samples of the gap, outside all grids, at which the deformed surfaces overlap: patches that were too small to be found before.
    fn unseen(&self, patch_grids: &[PatchGrid], depth: f64) -> Vec<PressureGrid> {
        let approach = patch_grids[0].pressed.approach;
        let limits = self.gap.window();
        let samples = self.gap.samples();
        let x = match samples[0].is_empty() {
            true => &[0.0][..],
            false => samples[0],
        };
        let y = samples[1];
        let loads: Vec<PointLoad> = patch_grids.iter().flat_map(point_loads).collect();
        let spacing = |axis: &[f64], i: usize| {
            let [low, high] = [i.saturating_sub(1), (i + 1).min(axis.len() - 1)];
            axis[high] - axis[low]
        };
        let mut found = Vec::new();
        for (k, value) in self.gap.on(x, y).into_iter().enumerate() {
            let (i, j) = (k % x.len(), k / x.len());
            let at = [x[i], y[j]];
            let seen = value >= approach || patch_grids.iter().any(|own| own.grid.holds(at));
            if seen || value + self.displaced(at, loads.iter()) - approach >= -NEAR * depth {
                continue;
            }
            let across = spacing(y, j);
            let along = match samples[0].is_empty() {
                true => across,
                false => spacing(x, i),
            };
            let window = [(at[0], along), (at[1], across)].map(|(at, half)| [at - half, at + half]);
            let mirrored = [self.gap.is_mirrored()[0] && samples[0].is_empty(), false];
            found.push(PressureGrid::new(
                within(window, limits),
                [FIRST; 2],
                mirrored,
            ));
        }
        found
    }
}

/// The cells of a patch grid with pressure as point loads.
fn point_loads(patch_grid: &PatchGrid) -> Vec<PointLoad> {
    let grid = &patch_grid.grid;
    let [x, y] = [grid.centres(0), grid.centres(1)];
    let area = grid.step[0] * grid.step[1];
    let cells = patch_grid.pressed.pressure.iter().enumerate();
    let pressed = cells.filter(|(_, p)| **p > 0.0);
    pressed
        .map(|(k, p)| [x[k % x.len()], y[k / x.len()], area * p])
        .collect()
}

/// A box around every patch of a grid; boxes that overlap are merged.
fn boxes(whole: &PatchGrid, limits: Window) -> Vec<PressureGrid> {
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
        let cells = [0, 1].map(|k| ((window[k][1] - window[k][0]) / grid.step[k]).ceil() as usize);
        let middle = window[1][0] + window[1][1];
        let straddles = middle.abs() < 1e-9 * (window[1][1] - window[1][0]);
        let mirrored = [grid.mirrored[0], grid.mirrored[1] && straddles];
        PressureGrid::new(window, cells, mirrored)
    });
    merged(boxes.collect())
}

/// Merges grids that overlap, with the finer cells of the two.
fn merged(mut grids: Vec<PressureGrid>) -> Vec<PressureGrid> {
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
