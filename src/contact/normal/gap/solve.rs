//! Any gap: contact region and pressure under a load or an approach.
//!
//! A box that holds the contact is found by looking at the gap, the pressure on ever finer grids of that box by
//! conjugate gradients, each grid started from the one before and shrunk to the contact. Where one grid cannot resolve all
//! patches, each gets a grid of its own (see `tiles.rs`). At the end the edges are placed between the cells.

use crate::contact::monitor::{Monitor, Stop};
use crate::contact::normal::gap::conjugate_gradients;
use crate::contact::normal::gap::conjugate_gradients::{Pressed, press};
use crate::contact::normal::gap::grid::{Grid, Resolution, Side};
use crate::contact::normal::gap::outcome::Outcome;
use crate::contact::normal::gap::search_box::{Reach, reach, reach_of_level};
use crate::contact::normal::gap::surface::Gap;
use crate::contact::normal::gap::surface::Window;
use crate::contact::normal::gap::tiles::Tile;
use crate::contact::normal::hertz::Pressing;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::remark::entry::RemarkEntry;

/// Cells of the first grid along either axis.
const CELLS_FIRST: usize = 32;
/// How fine the last grid is at least.
const RESOLUTION: Resolution = Resolution {
    contact: 44.0,
    patch: 24.0,
    share_min: 0.02,
};
/// The same where only forces are asked for, to some tenths of a per cent.
const RESOLUTION_COARSE: Resolution = Resolution {
    contact: 22.0,
    patch: 12.0,
    share_min: 0.05,
};
/// Below this target of the resultants' error (relative to μN) grids are finer: the error of a normal problem falls with the
/// power 3/2 of its cells' size.
const TARGET_USUAL: f64 = 0.002;
const TARGET_POWER: f64 = -2.0 / 3.0;
/// A grid with cells larger than wanted by less than this factor (inverse) will do.
pub(crate) const COARSER_MAX: f64 = 0.8;
/// A rough gap is looked at more closely until neither the approach nor the largest pressure change by more than this,
/// times the ratio of the cells' sizes.
pub(crate) const APPROACH_CHANGE: f64 = 0.002;
pub(crate) const PRESSURE_CHANGE: f64 = 0.015;
/// How much finer the next grid is.
pub(crate) const REFINEMENT: f64 = 1.6;
/// Violation of the contact conditions relative to the deepest overlap, on the first grid and on the others.
const TOLERANCE_FIRST: f64 = 2e-3;
const TOLERANCE: f64 = 2e-4;
/// Grids tried; each is larger, shifted or finer than the one before.
pub(crate) const GRIDS_MAX: usize = 12;
/// Cells outside the contact that nearly touch, relative to the deepest overlap, belong to the next grid.
pub(crate) const NEAR: f64 = 0.03;
/// Two bodies with a gap between them, pressed together.
#[derive(Debug, Clone, PartialEq)]
pub struct GapContact {
    /// The gap of the undeformed bodies.
    pub gap: Gap,
    /// Force, or approach counted from gap = 0.
    pub pressing: Pressing,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
}

/// The contact of a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Region and pressure.
    pub field: PressureField,
    /// How it was found.
    pub report: Report,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// How a normal problem was solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// Cells of the last grid along x and y, of the one that carries most if there are several.
    pub cells: [usize; 2],
    /// Grids: 1, or one per patch where patches differ much in size.
    pub grids: usize,
    /// Iterations over all grids.
    pub iterations: u32,
    /// Largest violation of the contact conditions on the last grid, relative to the deepest overlap of the undeformed
    /// surfaces: distance in the contact, overlap outside.
    pub residual: f64,
    /// Largest pressure on the last grid but one, relative to that on the last, less 1; 0 if there was only one grid.
    pub pressure_change: f64,
}

/// Why a gap has no contact to show.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// A reason, as a sentence.
    NoAnswer(String),
    /// The caller stopped the work.
    Stopped(Stop),
}

impl From<conjugate_gradients::Failure> for Failure {
    fn from(failure: conjugate_gradients::Failure) -> Failure {
        match failure {
            conjugate_gradients::Failure::Stopped(stop) => Failure::Stopped(stop),
            conjugate_gradients::Failure::NotConverged(residual) => Failure::NoAnswer(format!(
                "the pressure did not converge: the contact conditions are violated by {residual:.1e} of the overlap"
            )),
        }
    }
}

impl GapContact {
    /// What is wrong with the gap, as far as its samples tell without solving.
    ///
    /// # Errors
    /// A JSON pointer into the case and a sentence, if the gap has no least value inside or the approach does not
    /// reach it.
    pub fn check(&self) -> Result<(), (&'static str, String)> {
        let [least, largest] = self.gap.extremes();
        let gap = |reason: String| Err(("/contact/gap_mm", reason));
        if least == largest {
            return gap(format!(
                "the gap is {least} mm everywhere; a least gap inside is needed"
            ));
        }
        if let Some(place) = self.gap.least_at_edge() {
            return gap(format!(
                "the least gap, {least} mm, lies at the edge of the data, at {place}; a least gap inside is needed"
            ));
        }
        match self.pressing {
            Pressing::Approach(approach) if approach <= least => {
                Err(("/load/approach_mm", no_touch(approach, least)))
            }
            _ => Ok(()),
        }
    }

    /// Finds region and pressure.
    ///
    /// Measured on Hertz's contact and on crowns of arcs: approach within 0.02 %, area within 0.3 %, largest pressure
    /// within 0.3 %.
    ///
    /// # Errors
    /// A reason why there is no answer; or the monitor stopped the work.
    pub fn solve(&self, monitor: &dyn Monitor) -> Result<Found, Failure> {
        self.solve_on(RESOLUTION, monitor)
    }

    /// The same at a third of the cost for whoever looks for a height: forces within some tenths of a per cent, edges
    /// within a cell of a twentieth of the contact. Roughness is not followed.
    ///
    /// # Errors
    /// As [`GapContact::solve`].
    pub fn estimate(&self, monitor: &dyn Monitor) -> Result<Found, Failure> {
        self.solve_on(RESOLUTION_COARSE, monitor)
    }

    /// The same for a target of the resultants' error, relative to μN: finer below 0.002.
    ///
    /// # Errors
    /// As [`GapContact::solve`].
    pub fn solve_for(&self, target: f64, monitor: &dyn Monitor) -> Result<Found, Failure> {
        self.solve_on(RESOLUTION.for_target(target), monitor)
    }

    fn solve_on(&self, resolution: Resolution, monitor: &dyn Monitor) -> Result<Found, Failure> {
        let mut reach = reach(&self.gap, self.pressing, self.contact_modulus);
        if let Pressing::Approach(approach) = self.pressing
            && approach <= reach.least
        {
            return Err(Failure::NoAnswer(no_touch(approach, reach.least)));
        }
        let first =
            |reach: &Reach| Grid::new(reach.window, [CELLS_FIRST; 2], self.gap.is_mirrored());
        let mut grid = first(&reach);
        let mut solved: Option<(Grid, Pressed)> = None;
        let (mut iterations, mut pressure_change) = (0, 0.0);
        let mut end = Next::Rough { capped: false };
        for _ in 0..GRIDS_MAX {
            let pressed = self.press(&grid, solved.as_ref(), &reach, monitor)?;
            iterations += pressed.iterations;
            if let Some((_, before)) = &solved {
                pressure_change = before.largest() / pressed.largest() - 1.0;
            }
            let next = if pressed.approach > reach.level {
                // The estimate was too small: parts of the gap beyond the box may touch as well.
                let depth = pressed.approach - reach.least;
                reach = reach_of_level(&self.gap, pressed.approach + 0.2 * depth);
                Next::Grid(first(&reach))
            } else {
                let depth = pressed.approach - reach.least;
                self.next_grid(&grid, &pressed, solved.as_ref(), depth, resolution)?
            };
            solved = Some((grid, pressed));
            match next {
                Next::Grid(next) => grid = next,
                last => {
                    end = last;
                    break;
                }
            }
        }
        let Some((grid, pressed)) = solved else {
            unreachable!("at least one grid is tried")
        };
        let whole = Tile { grid, pressed };
        if end.capped()
            && let Some(found) =
                self.solve_on_tiles(whole.clone(), reach.least, resolution, monitor)?
        {
            return self.found(Outcome {
                iterations: iterations + found.iterations,
                least: reach.least,
                ..found
            });
        }
        self.found(Outcome {
            tiles: vec![whole],
            iterations,
            settled: matches!(end, Next::Settled { .. }),
            pressure_change,
            least: reach.least,
        })
    }

    fn press(
        &self,
        grid: &Grid,
        before: Option<&(Grid, Pressed)>,
        reach: &Reach,
        monitor: &dyn Monitor,
    ) -> Result<Pressed, Failure> {
        let gap = grid.gap(&self.gap);
        let (start, tolerance) = match before {
            Some((coarse, pressed)) => {
                (grid.interpolate(coarse, &pressed.pressure, &gap), TOLERANCE)
            }
            None => (
                grid.first_pressure(&gap, reach, self.contact_modulus),
                TOLERANCE_FIRST,
            ),
        };
        let mut influence = grid.influence(self.contact_modulus);
        let cell = grid.step[0] * grid.step[1];
        let mut pressed = press(
            &mut influence,
            &gap,
            cell,
            self.pressing,
            start,
            tolerance,
            monitor,
        )?;
        grid.symmetrise(&mut pressed.pressure);
        Ok(pressed)
    }

    /// What to do after a grid: enlarge it, refine it, or be content.
    fn next_grid(
        &self,
        grid: &Grid,
        pressed: &Pressed,
        before: Option<&(Grid, Pressed)>,
        depth: f64,
        resolution: Resolution,
    ) -> Result<Next, Failure> {
        let limits = self.gap.window();
        let (cut, short): (Vec<Side>, Vec<Side>) = grid
            .sides_in_contact(&pressed.pressure)
            .into_iter()
            .partition(|side| grid.ends_at(*side, limits));
        if !short.is_empty() {
            return Ok(Next::Grid(grid.enlarged(&short, limits)));
        }
        let wanted = grid.wanted(pressed, NEAR * depth, resolution, limits);
        let finer = Grid::new(wanted.window, wanted.cells, grid.mirrored);
        if (0..2).any(|k| finer.step[k] < COARSER_MAX * grid.step[k]) {
            return Ok(Next::Grid(finer));
        }
        if let Some(side) = cut.first() {
            return Err(edge_reached(*side, limits));
        }
        let capped = wanted.capped;
        let Some((coarse, before)) = before.filter(|_| resolution.settles()) else {
            return Ok(Next::Settled { capped });
        };
        let ratio = (coarse.step[0] / grid.step[0]).max(coarse.step[1] / grid.step[1]);
        if (pressed.approach - before.approach).abs() <= APPROACH_CHANGE * ratio * depth
            && (before.largest() / pressed.largest() - 1.0).abs() <= PRESSURE_CHANGE * ratio
        {
            return Ok(Next::Settled { capped });
        }
        let cells = grid.cells.map(|n| (n as f64 * REFINEMENT) as usize);
        let finer = Grid::new(wanted.window, cells, grid.mirrored);
        if (0..2).all(|k| finer.step[k] > COARSER_MAX * grid.step[k]) {
            return Ok(Next::Rough { capped });
        }
        Ok(Next::Grid(finer))
    }
}

fn no_touch(approach: f64, least: f64) -> String {
    format!(
        "the bodies do not touch: the approach of {approach} mm is not more than the least gap of {least} mm"
    )
}

pub(crate) fn edge_reached(side: Side, limits: Window) -> Failure {
    Failure::NoAnswer(format!(
        "the contact reaches the edge {} of the given gap, so that the true contact is cut off; give the gap farther out",
        side.place(limits)
    ))
}

/// What follows a grid.
enum Next {
    Grid(Grid),
    /// Nothing changes any more; `capped` if a patch would want more cells than a grid may have.
    Settled {
        capped: bool,
    },
    /// Something still changes, and no finer grid is allowed.
    Rough {
        capped: bool,
    },
}

impl Next {
    fn capped(&self) -> bool {
        matches!(
            self,
            Next::Settled { capped: true } | Next::Rough { capped: true }
        )
    }
}

impl Resolution {
    /// The resolution for a target of the resultants' error relative to μN; as it is from [`TARGET_USUAL`] on.
    fn for_target(self, target: f64) -> Resolution {
        let finer = (target.min(TARGET_USUAL) / TARGET_USUAL).powf(TARGET_POWER);
        Resolution {
            contact: finer * self.contact,
            patch: finer * self.patch,
            ..self
        }
    }

    /// Is the result compared with that of the grid before?
    fn settles(self) -> bool {
        self.contact >= RESOLUTION.contact
    }
}
