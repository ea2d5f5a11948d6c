//! The contact of a gap from a solved grid of nearly the same gap.

use std::f64::consts::PI;

use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::NormalError;
use crate::contact::normal::gap::conjugate_gradients::PressureAnswer;
use crate::contact::normal::gap::constants::{NEAR, REFINEMENT, RESOLUTION};
use crate::contact::normal::gap::grid::{GridFineness, PressureGrid, within};
use crate::contact::normal::gap::patch_grid::{GapOutcome, GridsExit, PatchGrid};
use crate::contact::normal::gap::patch_grids::merged;
use crate::contact::normal::gap::search_box::SearchBox;
use crate::contact::normal::gap::solve::{GridStart, NextStep};
use crate::contact::normal::gap::surface::Window;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::NormalLoad;

/// Grids that are tried from a start; each is larger or finer than the one before. Numeric safety.
const GRIDS_MAX: usize = 4;
/// Blocks of cells along either axis whose loads stand for the pressure far from it. 3 and 12, with 0.02 and 0.1 for `RING`, change no figure
/// of `cargo bench --bench calibrate profiles`.
const BLOCKS: usize = 6;
/// Part of the length of the grid beyond its sides within which the contact shows itself in the outermost cells. See [`BLOCKS`].
const RING: f64 = 0.05;

/// What a solution from a start is held to.
#[derive(Clone, Copy)]
struct Settling<'a> {
    /// Deepest overlap of the undeformed bodies in mm.
    depth: f64,
    resolution: GridFineness,
    reach: &'a SearchBox,
}

/// The load of a block of cells, and its place.
struct BlockLoad {
    at: [f64; 2],
    force: f64,
}

impl GapTask {
    /// The solution from a start, in place of a search for its box and a first grid there. Nothing where the solution and the start
    /// differ by more than two grids of one gap may, or where the bodies may touch outside the grid as well.
    ///
    /// # Errors
    /// The monitor stopped the work.
    pub(crate) fn solve_from(
        &self,
        start: PatchGrid,
        resolution: GridFineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<Option<GapOutcome>, NormalError> {
        let NormalLoad::Approach(approach) = self.loading else {
            return Ok(None);
        };
        let (limits, [least, _]) = (self.gap.window(), self.gap.extremes());
        let depth = approach - least;
        let wanted = start
            .grid
            .wanted(&start.pressed, NEAR * depth, resolution, limits);
        if wanted.capped {
            let found = self.solve_on_tiles(start, least, resolution, workspace, monitor);
            return settled(found);
        }
        let mut grid = PressureGrid::new(wanted.window, wanted.cells, self.gap.is_mirrored());
        let reach = SearchBox {
            window: wanted.window,
            level: approach,
            least,
        };
        let reach = &reach;
        let start = (start.grid, start.pressed);
        let mut last: Option<(PressureGrid, PressureAnswer)> = None;
        let mut iterations = 0;
        for _ in 0..GRIDS_MAX {
            let from = last.as_ref().unwrap_or(&start);
            let begun = GridStart::new(from, reach, resolution.tolerance);
            let pressed = answered(self.pressure_on(&grid, begun, workspace, monitor))?;
            let Some(pressed) = pressed else {
                return Ok(None);
            };
            iterations += pressed.iterations;
            let short = grid.sides_in_contact(&pressed.pressure);
            if !short.is_empty() {
                let larger = grid.enlarged(&short, limits);
                last = Some((std::mem::replace(&mut grid, larger), pressed));
                continue;
            }
            match self.next_grid(&grid, &pressed, None, depth, resolution.alone()) {
                // A patch turned out smaller than at the start.
                Ok(NextStep::PressureGrid(finer)) => {
                    last = Some((std::mem::replace(&mut grid, finer), pressed));
                    continue;
                }
                Ok(next) if next.is_settled() && !self.touches_beside(&grid, &pressed) => {}
                _ => return Ok(None),
            }
            let found = (grid, pressed);
            let asked = Settling {
                depth,
                resolution,
                reach,
            };
            let more = self.settles(&found, from, asked, workspace, monitor)?;
            return Ok(more.map(|more| settled_outcome(found, from, least, iterations + more)));
        }
        Ok(None)
    }

    /// Does the solution on a grid agree with the start, or with a coarser grid of the same gap, where the start was of another height or of
    /// other profiles? The iterations that took.
    fn settles(
        &self,
        found: &(PressureGrid, PressureAnswer),
        from: &(PressureGrid, PressureAnswer),
        asked: Settling,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<Option<u32>, NormalError> {
        let (grid, pressed) = found;
        let agrees = |before: &(PressureGrid, PressureAnswer)| {
            let next = self.next_grid(grid, pressed, Some(before), asked.depth, asked.resolution);
            next.is_ok_and(|next| next.is_settled())
        };
        if !asked.resolution.settles || agrees(from) {
            return Ok(Some(0));
        }
        // Peaks between the chords of a polygon are seen by finer grids only; loose targets do without.
        if asked.resolution.tolerance <= RESOLUTION.tolerance {
            return Ok(None);
        }
        let coarse = grid.coarser(REFINEMENT);
        let start = GridStart::new(found, asked.reach, asked.resolution.tolerance);
        let checked = answered(self.pressure_on(&coarse, start, workspace, monitor))?;
        Ok(checked.and_then(|checked| {
            let iterations = checked.iterations;
            agrees(&(coarse, checked)).then_some(iterations)
        }))
    }

    /// The same from several grids, one per patch.
    ///
    /// # Errors
    /// The monitor stopped the work.
    pub(crate) fn solve_from_tiles(
        &self,
        start: Vec<PatchGrid>,
        resolution: GridFineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<Option<GapOutcome>, NormalError> {
        if !matches!(self.loading, NormalLoad::Approach(_)) {
            return Ok(None);
        }
        let (limits, mirrored) = (self.gap.window(), self.gap.is_mirrored());
        let inside = |PatchGrid { grid, .. }: &PatchGrid| {
            let window = within([0, 1].map(|axis| grid.range(axis)), limits);
            let mirrored = [0, 1].map(|axis| grid.mirrored[axis] && mirrored[axis]);
            PressureGrid::new(window, grid.cells, mirrored)
        };
        let grids: Vec<PressureGrid> = merged(start.iter().map(inside).collect());
        if grids
            .iter()
            .any(|grid| grid.step.iter().any(|step| *step <= 0.0))
        {
            // One of them lies beside the samples of this gap.
            return Ok(None);
        }
        let [least, _] = self.gap.extremes();
        let from = GapOutcome {
            patch_grids: start,
            iterations: 0,
            exit: GridsExit::GridsUsedUp,
            pressure_change: 0.0,
            least,
        };
        settled(
            self.on_tiles(grids, from, resolution, workspace, monitor)
                .map(Some),
        )
    }

    /// May the bodies touch at a sample outside a grid, under the pressures on it?
    fn touches_beside(&self, grid: &PressureGrid, pressed: &PressureAnswer) -> bool {
        let Some([x, y, gap]) = self.gap.grid_samples() else {
            return true;
        };
        let loads = blocks(grid, pressed);
        let ringed: Window = [0, 1].map(|k| {
            let [low, high] = grid.range(k);
            let ring = RING * (high - low);
            [low - ring, high + ring]
        });
        let outside = |at: [f64; 2]| (0..2).any(|k| at[k] < ringed[k][0] || at[k] > ringed[k][1]);
        let sunk = |at: [f64; 2]| {
            let each = loads
                .iter()
                .map(|load| load.force / (load.at[0] - at[0]).hypot(load.at[1] - at[1]));
            each.sum::<f64>() / (PI * self.contact_modulus)
        };
        gap.iter().enumerate().any(|(k, gap)| {
            let at = [x[k % x.len()], y[k / x.len()]];
            *gap < pressed.approach && outside(at) && gap + sunk(at) < pressed.approach
        })
    }
}

/// What a grid that settled amounts to, with the change of pressure since its start.
fn settled_outcome(
    (grid, pressed): (PressureGrid, PressureAnswer),
    (_, before): &(PressureGrid, PressureAnswer),
    least: f64,
    iterations: u32,
) -> GapOutcome {
    GapOutcome {
        iterations,
        exit: GridsExit::Settled,
        pressure_change: before.largest() / pressed.largest() - 1.0,
        least,
        patch_grids: vec![PatchGrid { grid, pressed }],
    }
}

/// A solution; that there is none is no error.
fn answered(
    pressed: Result<PressureAnswer, NormalError>,
) -> Result<Option<PressureAnswer>, NormalError> {
    match pressed {
        Ok(pressed) => Ok(Some(pressed)),
        Err(NormalError::NoAnswer(_)) => Ok(None),
        Err(stopped) => Err(stopped),
    }
}

/// An outcome whose grids settled; that there is none is no error.
fn settled(
    found: Result<Option<GapOutcome>, NormalError>,
) -> Result<Option<GapOutcome>, NormalError> {
    match found {
        Ok(found) => Ok(found.filter(|found| found.exit.settled())),
        Err(NormalError::NoAnswer(_)) => Ok(None),
        Err(stopped) => Err(stopped),
    }
}

/// The loads of blocks of cells.
fn blocks(grid: &PressureGrid, pressed: &PressureAnswer) -> Vec<BlockLoad> {
    let mut sums = vec![[0.0; 3]; BLOCKS * BLOCKS];
    let axes = [0, 1].map(|axis| grid.centres(axis));
    let area = grid.step[0] * grid.step[1];
    for (k, pressure) in pressed
        .pressure
        .iter()
        .enumerate()
        .filter(|(_, p)| **p > 0.0)
    {
        let [i, j] = [k % grid.cells[0], k / grid.cells[0]];
        let block = j * BLOCKS / grid.cells[1] * BLOCKS + i * BLOCKS / grid.cells[0];
        let force = pressure * area;
        let parts = [force, force * axes[0][i], force * axes[1][j]];
        for (sum, part) in sums[block].iter_mut().zip(parts) {
            *sum += part;
        }
    }
    let loaded = sums.into_iter().filter(|[force, ..]| *force > 0.0);
    loaded
        .map(|[force, x, y]| BlockLoad {
            at: [x / force, y / force],
            force,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::monitor::Unmonitored;
    use crate::contact::normal::gap::answer::NormalAnswer;
    use crate::contact::normal::gap::preview::PreviewCache;
    use crate::contact::normal::gap::surface::GapSurface;
    use crate::contact::normal::pressure_field::computed::Edges;
    use crate::contact::normal::pressure_field::field::PressureField;

    const TARGET: f64 = 0.005;

    /// A bump at y = −6 mm, and another at 6 mm that is `lift` lower, pressed together by an approach.
    fn bumps(lift: f64, approach: f64) -> GapTask {
        bumps_of([300.0, 100.0], lift, approach)
    }

    /// The same with these diameters across.
    fn bumps_of([one, other]: [f64; 2], lift: f64, approach: f64) -> GapTask {
        let [x, y] = [140, 120]
            .map(|most| -> Vec<f64> { (-most..=most).map(|k| 0.1 * f64::from(k)).collect() });
        let across = |y: f64| ((y + 6.0).powi(2) / one).min((y - 6.0).powi(2) / other + lift);
        let line = |y: &f64| x.iter().map(|x| x * x / 920.0 + across(*y)).collect();
        let gap: Vec<Vec<f64>> = y.iter().map(line).collect();
        GapTask {
            gap: GapSurface::grid(&x, &y, &gap),
            loading: NormalLoad::Approach(approach),
            contact_modulus: 115_000.0,
            seen: PreviewCache::default(),
        }
    }

    /// The bumps under an approach of 0.06 mm: from what an approach of 0.05 mm leaves, and by a search.
    fn both_ways(lift: f64) -> (Option<NormalAnswer>, NormalAnswer) {
        let mut workspace = GridWorkspace::default();
        let before = bumps(lift, 0.05).solve_for(TARGET, &mut workspace, &Unmonitored);
        let start = before.unwrap().start.expect("one grid");
        let task = bumps(lift, 0.06);
        let start = start.at([0.0, -6.0], 0.06).remove(0);
        let fineness = GridFineness::for_answer(TARGET);
        let near = task.solve_from(start, fineness, &mut workspace, &Unmonitored);
        let near = near
            .unwrap()
            .map(|found| task.found(found, Edges::Found).unwrap());
        let searched = task.solve_for(TARGET, &mut workspace, &Unmonitored);
        (near, searched.unwrap())
    }

    fn force(field: &PressureField) -> f64 {
        field.patches().iter().map(|patch| patch.normal_force).sum()
    }

    #[test]
    fn a_contact_found_from_another_height_is_that_of_a_search() {
        let (near, searched) = both_ways(0.08);
        let near = near.expect("nothing else touches");
        assert_eq!(near.field.patches().len(), 1);
        let ratio = force(&near.field) / force(&searched.field);
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
        assert!(near.report.iterations < searched.report.iterations);
    }

    #[test]
    fn patches_of_different_size_are_found_from_their_grids_at_another_height() {
        let mut workspace = GridWorkspace::default();
        let task = |approach| bumps_of([300.0, 4.0], 0.01, approach);
        let before = task(0.05).solve_for(TARGET, &mut workspace, &Unmonitored);
        let before = before.unwrap();
        let start = before.start.expect("grids that settled");
        let start = start.at(before.field.load_centre(None), 0.06);
        assert_eq!(start.len(), 2);
        let fineness = GridFineness::for_answer(TARGET);
        let task = task(0.06);
        let near = task.solve_from_tiles(start, fineness, &mut workspace, &Unmonitored);
        let near = near.unwrap().expect("nothing else touches");
        let near = task.found(near, Edges::Found).unwrap();
        let searched = task.solve_for(TARGET, &mut workspace, &Unmonitored);
        let searched = searched.unwrap();
        assert_eq!(near.field.patches().len(), 2);
        for (found, known) in near.field.patches().iter().zip(searched.field.patches()) {
            let ratio = found.normal_force / known.normal_force;
            assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
        }
        assert!(near.report.iterations < searched.report.iterations);
    }

    #[test]
    fn a_contact_beside_the_grid_of_the_start_is_not_overlooked() {
        // The second bump does not touch at 0.05 mm, and at 0.06 mm it does: the first one bends it away by less than 0.009 mm.
        let (near, searched) = both_ways(0.047);
        assert_eq!(near, None);
        assert_eq!(searched.field.patches().len(), 2);
    }
}
