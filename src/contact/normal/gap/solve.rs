//! Contact region and pressure of a gap under a load or an approach.
//!
//! The search box of the contact comes from the gap, the pressure from conjugate gradients on successively finer grids of that box. Each grid starts from the
//! solution on the previous one and is reduced to the contact. If one grid cannot resolve all patches, each patch gets its own grid (see `patch_grids.rs`).
//! Finally the edges are placed between the cells.

use crate::half_space::bent_surface::{BentOperator, BentWorkspace};
use crate::monitor::Monitor;
use crate::normal::gap::conjugate_gradients::{
    PressureAnswer, PressureTask, WeightedStrips, solve_pressure,
};
use crate::normal::gap::grid::{
    APPROACH_CHANGE, CELLS_ACROSS_MIN, CELLS_BY_ERROR, COARSER_MAX, FIRST, GapOutcome,
    GridFineness, GridSide, LOOSER_MAX, NEAR, NormalAnswer, NormalError, PRESSURE_CHANGE,
    PatchGrid, PressureGrid, REFINEMENT, RESOLUTION, TARGETS, TOLERANCE_FIRST, edge_reached,
    first_pressure, no_touch,
};
use crate::normal::gap::task::{GapTask, MARGIN, SearchBox, reach_of_level};
use crate::normal::hertz::NormalLoad;
use crate::numerics::ITERATIONS_MAX;

impl GapTask {
    /// Checks the gap by its samples, without solving.
    ///
    /// # Errors
    /// A JSON pointer into the case and a sentence, if the gap has no minimum inside or the approach does not reach it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let [least, largest] = self.gap.extremes();
        let gap = |reason: String| Err(("/contact/gap_mm", reason));
        if least == largest {
            return gap(format!(
                "the gap is {least} mm everywhere; a smallest gap inside the data is needed"
            ));
        }
        if let Some(place) = self.gap.least_at_edge() {
            return gap(format!(
                "the smallest gap, {least} mm, lies at the edge of the data, at {place}; a smallest gap inside the data is needed"
            ));
        }
        match self.loading {
            NormalLoad::Approach(approach) if approach <= least => {
                Err(("/load/approach_mm", no_touch(approach, least)))
            }
            _ => Ok(()),
        }
    }

    /// Finds region and pressure on grids of a given resolution.
    ///
    /// Measured on Hertz's contact and on crowns of arcs at targets of 0.002 to 0.005: the approach is within 0.02 %, the area and the largest pressure within 0.3 %. At
    /// 0.02 lengths and pressures are within 1 %.
    ///
    /// # Errors
    /// The reason why there is no solution; or the monitor stopped the work.
    pub(crate) fn solve_as(
        &self,
        resolution: GridFineness,
        workspace: &mut BentWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<NormalAnswer, NormalError> {
        let reach = self.touching_reach()?;
        let grid = self.first_grid(&reach);
        let (whole, capped) = self.refined(grid, None, reach, resolution, workspace, monitor)?;
        if capped
            && let Some(found) = self.patch_by_patch(
                &whole.patch_grids[0],
                whole.least,
                resolution,
                workspace,
                monitor,
            )?
        {
            return self.found(GapOutcome {
                iterations: whole.iterations + found.iterations,
                ..found
            });
        }
        self.found(whole)
    }

    fn first_grid(&self, reach: &SearchBox) -> PressureGrid {
        PressureGrid::new(reach.window, [FIRST; 2], self.gap.is_mirrored())
    }

    /// Refines the grid until it is fine enough, starting from a solution on another grid if there is one. Also returns whether a patch needs more cells than the last
    /// grid may have.
    pub(crate) fn refined(
        &self,
        mut grid: PressureGrid,
        mut solved: Option<(PressureGrid, PressureAnswer)>,
        mut reach: SearchBox,
        resolution: GridFineness,
        workspace: &mut BentWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<(GapOutcome, bool), NormalError> {
        let (mut iterations, mut pressure_change) = (0, 0.0);
        let (mut settled, mut capped) = (false, false);
        for _ in 0..ITERATIONS_MAX {
            let pressed = {
                let start = GridStart {
                    before: solved.as_ref(),
                    reach: &reach,
                    tolerance: resolution.tolerance,
                };
                self.pressure_on(&grid, start, workspace, monitor)?
            };
            iterations += pressed.iterations;
            if let Some((_, before)) = &solved {
                pressure_change = before.largest() / pressed.largest() - 1.0;
            }
            let depth = pressed.approach - reach.least;
            let next = if pressed.approach > reach.level {
                // The estimate was too small, so parts of the gap beyond the box may touch as well.
                reach = reach_of_level(&self.gap, reach.least + MARGIN * depth);
                NextStep::PressureGrid(self.first_grid(&reach))
            } else {
                self.next_grid(&grid, &pressed, solved.as_ref(), depth, resolution)?
            };
            solved = Some((grid, pressed));
            match next {
                NextStep::PressureGrid(next) => grid = next,
                NextStep::End(end) => {
                    (settled, capped) = (end.settled, end.capped);
                    break;
                }
            }
        }
        let Some((grid, pressed)) = solved else {
            unreachable!("at least one grid is tried")
        };
        let outcome = GapOutcome {
            patch_grids: vec![PatchGrid { grid, pressed }],
            iterations,
            settled,
            pressure_change,
            least: reach.least,
        };
        Ok((outcome, capped))
    }

    /// The search box of the contact, if the bodies touch.
    fn touching_reach(&self) -> Result<SearchBox, NormalError> {
        let reach = self.reach();
        match self.loading {
            NormalLoad::Approach(approach) if approach <= reach.least => {
                Err(NormalError::NoAnswer(no_touch(approach, reach.least)))
            }
            _ => Ok(reach),
        }
    }

    fn pressure_on(
        &self,
        grid: &PressureGrid,
        GridStart {
            before,
            reach,
            tolerance,
        }: GridStart,
        workspace: &mut BentWorkspace,
        monitor: &dyn Monitor,
    ) -> Result<PressureAnswer, NormalError> {
        let gap = grid.gap(&self.gap);
        let cell = grid.step[0] * grid.step[1];
        let (start, tolerance) = match before {
            Some((coarse, pressed)) => {
                (grid.interpolate(coarse, &pressed.pressure, &gap), tolerance)
            }
            None => {
                let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
                let depth = (reach.level - least).max(1e-3 * (reach.level - reach.least));
                let pressure = first_pressure(&gap, depth, cell, self.contact_modulus);
                (pressure, TOLERANCE_FIRST)
            }
        };
        let operator = BentOperator::flat(grid.cells, grid.step, self.contact_modulus, workspace);
        let weights = vec![1.0; grid.cells[1]];
        let influence = WeightedStrips::new(&operator, &weights);
        let task = PressureTask {
            gap: &gap,
            cell,
            loading: self.loading,
            tolerance,
        };
        let mut pressed = solve_pressure(&task, &influence, start, workspace, monitor)?;
        grid.symmetrise(&mut pressed.pressure);
        Ok(pressed)
    }

    /// Decides whether a grid must be enlarged or refined, or is the last one.
    fn next_grid(
        &self,
        grid: &PressureGrid,
        pressed: &PressureAnswer,
        before: Option<&(PressureGrid, PressureAnswer)>,
        depth: f64,
        resolution: GridFineness,
    ) -> Result<NextStep, NormalError> {
        let limits = self.gap.window();
        let (cut, short): (Vec<GridSide>, Vec<GridSide>) = grid
            .sides_in_contact(&pressed.pressure)
            .into_iter()
            .partition(|side| grid.ends_at(*side, limits));
        if !short.is_empty() {
            return Ok(NextStep::PressureGrid(grid.enlarged(&short, limits)));
        }
        let wanted = grid.wanted(pressed, NEAR * depth, resolution, limits);
        let finer = PressureGrid::new(wanted.window, wanted.cells, grid.mirrored);
        if (0..2).any(|k| finer.step[k] < COARSER_MAX * grid.step[k]) {
            return Ok(NextStep::PressureGrid(finer));
        }
        if let Some(side) = cut.first() {
            return Err(edge_reached(*side, limits));
        }
        let capped = wanted.capped;
        let end = |settled: bool| Ok(NextStep::End(GridsEnd { settled, capped }));
        if !resolution.settles {
            return end(true);
        }
        let Some((coarse, before)) = before else {
            // The first grid is solved roughly and has nothing to compare with.
            return Ok(NextStep::PressureGrid(finer));
        };
        let ratio = (coarse.step[0] / grid.step[0]).max(coarse.step[1] / grid.step[1]);
        if (pressed.approach - before.approach).abs() <= APPROACH_CHANGE * ratio * depth
            && (before.largest() / pressed.largest() - 1.0).abs() <= PRESSURE_CHANGE * ratio
        {
            return end(true);
        }
        let cells = grid.cells.map(|n| (n as f64 * REFINEMENT) as usize);
        let finer = PressureGrid::new(wanted.window, cells, grid.mirrored);
        if (0..2).all(|k| finer.step[k] > COARSER_MAX * grid.step[k]) {
            return end(false);
        }
        Ok(NextStep::PressureGrid(finer))
    }
}

/// The start of a solve on a grid.
#[derive(Clone, Copy)]
struct GridStart<'a> {
    /// The solution on an earlier grid, if there is one.
    before: Option<&'a (PressureGrid, PressureAnswer)>,
    /// The search box of the contact.
    reach: &'a SearchBox,
    /// See [`GridFineness::tolerance`].
    tolerance: f64,
}

/// The step after a grid.
enum NextStep {
    PressureGrid(PressureGrid),
    End(GridsEnd),
}

/// The end of the refinement.
struct GridsEnd {
    /// See [`GapOutcome::settled`].
    settled: bool,
    /// Whether a patch needs more cells than a grid may have.
    capped: bool,
}

impl GridFineness {
    /// Returns this resolution without the comparison with another grid.
    pub(crate) fn alone(self) -> GridFineness {
        GridFineness {
            settles: false,
            ..self
        }
    }

    /// The resolution for a target of the error of the resultants relative to μN: finer below 0.002 and coarser above 0.005.
    pub(crate) fn for_answer(target: f64) -> GridFineness {
        if !target.is_finite() {
            return RESOLUTION;
        }
        let [least, most] = TARGETS;
        let looser = (target / target.clamp(least, most)).min(LOOSER_MAX);
        GridFineness {
            contact: looser.powf(CELLS_BY_ERROR) * RESOLUTION.contact,
            tolerance: looser.max(1.0) * RESOLUTION.tolerance,
            ..RESOLUTION
        }
    }

    /// Cells across a patch with a part of the load. The error of a patch counts in proportion to its load.
    pub(crate) fn across(self, share: f64) -> f64 {
        self.contact / share.powf(CELLS_BY_ERROR)
    }

    /// Least number of cells across a patch of a gap, so that it is resolved.
    pub(crate) fn resolving(self) -> f64 {
        let finer = (self.contact / RESOLUTION.contact).max(1.0);
        finer * CELLS_ACROSS_MIN / COARSER_MAX
    }
}
