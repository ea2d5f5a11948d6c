//! A wheel on a rail by their cross-sections: the height of the wheel at which its patches carry the load.
//!
//! At one height every patch has a gap of its own, in its own frame, and is pressed by the overlap there. The height is
//! sought by secant steps in `N^(2/3)`, which for Hertz's contacts is proportional to the lowering; the first slope comes
//! from the stiffness of flat punches of the same areas, `dN/dδ = 2 E* √(A/π)`. Until the height is nearly found, gaps are sampled
//! and solved coarsely.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::local_gap::{GapSampling, LocalGap};
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::NormalError;
use crate::contact::normal::gap::grid::GridFineness;
use crate::contact::normal::gap::seen::GapSeen;
use crate::contact::normal::gap::surface::GapSurface;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::gap::tile::Tile;
use crate::contact::normal::hertz::NormalLoad;
use crate::contact::normal::neighbours::{Neighbour, neglected};
use crate::contact::normal::wheel_height::bracket::{Bracket, HeightExit};
use crate::contact::normal::wheel_height::gap_remarks::{cut_patches, missed_beside};
use crate::contact::normal::wheel_height::task::{WheelLoad, WheelTask};
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};
use crate::contact::remark::list::Remark;

/// Heights after which the search is given up. Keeps the numbers safe; not tuned.
const HEIGHTS_MAX: u32 = 40;
/// Bounds of the tolerance of the force, which is the target of the resultants' error. The contact is then scaled to the force as Hertz's
/// contacts scale; the error left is of second order for these, and at worst about a third of the tolerance in pressures and lengths.
/// Below the lower bound the forces of neighbouring heights differ by no more than those of different grids.
const FORCE_TOLERANCE: [f64; 2] = [5e-4, 5e-3];
/// A gap whose overlap is less than this fraction of the deepest one is left out: its force is about the power 3/2 of this, 1e-4.
const DEPTH_SHARE_MIN: f64 = 2e-3;

/// How a wheel should come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalPass {
    /// Of a vertical force the normal forces carry the part `1 / (1 + friction_share)`.
    pub friction_share: f64,
    /// How exactly.
    pub accuracy: Accuracy,
}

/// Tells from a wheel at some height what friction will carry, see [`NormalPass::friction_share`]; nothing where it cannot be told.
pub type ShareForecast<'a> = dyn Fn(&WheelContact) -> Option<f64> + 'a;

/// What is known before the search for a height begins.
#[derive(Clone, Copy, Default)]
pub struct HeightStart<'a> {
    /// An earlier rest under a similar load.
    pub before: Option<&'a WheelContact>,
    /// Asked at coarse heights, in place of [`NormalPass::friction_share`].
    pub forecast: Option<&'a ShareForecast<'a>>,
}

/// How exactly a force is to be carried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// It may be missed by this part, by coarse gaps: a place to go on from.
    About(f64),
    /// As resultants with this error relative to μN need it; the contact is corrected to the force.
    For(f64),
}

impl Accuracy {
    fn tolerance(self) -> f64 {
        let [low, high] = FORCE_TOLERANCE;
        match self {
            Accuracy::About(part) => part,
            Accuracy::For(target) => target.clamp(low, high),
        }
    }
}

/// How finely the wheel is solved at one height.
#[derive(Debug, Clone, Copy)]
struct Fineness {
    detail: GapSampling,
    /// Target of the resultants' error relative to μN.
    target: f64,
}

impl Fineness {
    /// At the first height: coarse where it is not near the one sought.
    fn first(wanted: NormalPass, near: bool) -> Fineness {
        let mut fineness = Fineness::fine(wanted);
        if !near {
            fineness.detail = GapSampling::Coarse;
        }
        fineness
    }

    fn fine(wanted: NormalPass) -> Fineness {
        let target = match wanted.accuracy {
            Accuracy::About(_) => f64::INFINITY,
            Accuracy::For(target) => target,
        };
        Fineness {
            detail: GapSampling::Fine,
            target,
        }
    }
}

/// One gap at one height of the wheel's centre.
struct LoweredGap<'a> {
    gap: &'a LocalGap,
    /// Deepest overlap in mm.
    depth: f64,
    /// Height of the wheel's centre in mm.
    centre: f64,
    /// What it is solved from, if anything is known.
    start: Option<Tile>,
}

impl WheelTask {
    /// The same with other smoothings of rail and wheel, in mm.
    #[must_use]
    pub fn smoothed(&self, smoothing: [f64; 2]) -> WheelTask {
        WheelTask {
            geometry: self.geometry.smoothed(smoothing),
            ..self.clone()
        }
    }

    /// The search for the places of contact, with its overlaps divided among gaps as near the height that is expected.
    ///
    /// # Errors
    /// As [`ContactLocus::new`].
    pub fn search(&self) -> Result<ContactLocus<'_>, String> {
        let search = ContactLocus::new(&self.geometry)?;
        let expected = match self.loading {
            WheelLoad::Vertical(force) | WheelLoad::Normal(force) => {
                search.estimated_lowering(force / self.contact_modulus)
            }
            WheelLoad::Lowering(lowering) => lowering,
        };
        Ok(search.grouped_near(expected))
    }

    /// The force that normal forces carry where friction carries its share; nothing where the height is given.
    fn target(&self, friction_share: f64) -> Option<f64> {
        match self.loading {
            WheelLoad::Vertical(force) => Some(force / (1.0 + friction_share)),
            WheelLoad::Normal(force) => Some(force),
            WheelLoad::Lowering(_) => None,
        }
    }

    /// Brings the wheel to rest.
    ///
    /// # Errors
    /// A reason why there is no answer; or the monitor stopped the work.
    pub fn find_height(
        &self,
        search: &ContactLocus,
        wanted: NormalPass,
        start: HeightStart,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        if let WheelLoad::Lowering(lowering) = self.loading {
            let fineness = Fineness::fine(wanted);
            return self.lowered(search, lowering, fineness, start.before, workspace, monitor);
        }
        let force = self.target(wanted.friction_share).unwrap_or_default();
        let tolerance = wanted.accuracy.tolerance();
        let corrected = start
            .before
            .and_then(|wheel| wheel.carrying(force, tolerance));
        match (corrected, wanted.accuracy) {
            (Some(wheel), Accuracy::For(_)) => Ok(WheelContact {
                friction_share: wanted.friction_share,
                ..wheel
            }),
            _ => self.height_sought(search, wanted, start, workspace, monitor),
        }
    }

    /// The wheel at the height that carries the force, height by height.
    fn height_sought(
        &self,
        search: &ContactLocus,
        wanted: NormalPass,
        HeightStart { before, forecast }: HeightStart,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        let target = |friction_share: f64| self.target(friction_share).unwrap_or_default();
        let mut friction_share = wanted.friction_share;
        let mut force = target(friction_share);
        let tolerance = wanted.accuracy.tolerance();
        let exact = matches!(wanted.accuracy, Accuracy::For(_));
        let starts_near = exact && before.is_some_and(|before| before.is_near(force));
        let mut fineness = Fineness::first(wanted, starts_near);
        let (mut bracket, mut last) = (Bracket::default(), None::<WheelContact>);
        let mut lowering = match before {
            Some(known) => bracket.next(known.lowering, known.found[0], force, known.found[1]),
            None => search.estimated_lowering(force / self.contact_modulus),
        };
        for heights in 1..=HEIGHTS_MAX {
            let near = last.as_ref().or(before);
            let pressed = self.at_height(search, lowering, fineness, near, workspace, monitor);
            let mut found = match pressed {
                Ok(found) => found,
                Err(NormalError::NoAnswer(reason)) => {
                    // The wheel may lie too deep; the load may be carried higher up.
                    let higher = bracket.refuse(lowering, reason);
                    lowering = higher.map_err(NormalError::NoAnswer)?;
                    continue;
                }
                Err(stopped) => return Err(stopped),
            };
            let [carried, slope] = found.found;
            let known = bracket.slope;
            let fine = fineness.detail == GapSampling::Fine;
            if let Some(share) = forecast.filter(|_| !fine).and_then(|told| told(&found)) {
                friction_share = share;
                force = target(share);
            }
            let next = bracket.next(lowering, carried, force, slope);
            found.found[1] = bracket.slope.or(known).unwrap_or(slope);
            found.heights = heights;
            found.friction_share = friction_share;
            let missed = (carried / force - 1.0).abs();
            if missed <= tolerance && !exact {
                return Ok(found);
            }
            if missed <= tolerance && fine {
                return Ok(found.at_rest(HeightExit::Met { missed }, force));
            }
            if let Some(reason) = bracket.closed_on_refusal(lowering) {
                return Err(NormalError::NoAnswer(reason));
            }
            let closed = bracket.is_closed(lowering);
            if closed && fine {
                return Ok(found.at_rest(HeightExit::closed(force / carried, tolerance), force));
            }
            lowering = if closed { found.lowering } else { next };
            if closed || !fine && found.is_near(force) {
                // Forces of coarse gaps are too inexact as ends of the bracket; their slope is exact enough.
                fineness.detail = GapSampling::Fine;
                bracket = bracket.opened(found.found[1]);
            }
            last = Some(found);
        }
        Err(NormalError::NoAnswer(format!(
            "no height of the wheel carries the load after {HEIGHTS_MAX} tries"
        )))
    }

    /// The wheel at one height; where coarse gaps have no answer, fine ones may.
    fn at_height(
        &self,
        search: &ContactLocus,
        lowering: f64,
        fineness: Fineness,
        near: Option<&WheelContact>,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        match self.lowered(search, lowering, fineness, near, workspace, monitor) {
            Err(NormalError::NoAnswer(_)) if fineness.detail == GapSampling::Coarse => {
                let fine = Fineness {
                    detail: GapSampling::Fine,
                    ..fineness
                };
                self.lowered(search, lowering, fine, near, workspace, monitor)
            }
            found => found,
        }
    }

    /// The wheel at one height.
    fn lowered(
        &self,
        search: &ContactLocus,
        lowering: f64,
        fineness: Fineness,
        near: Option<&WheelContact>,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        let centre = search.touch - lowering;
        let gaps = search
            .gaps(lowering, fineness.detail)
            .map_err(NormalError::NoAnswer)?;
        let depths: Vec<f64> = gaps.iter().map(depth).collect();
        let least = DEPTH_SHARE_MIN * depths.iter().copied().fold(0.0, f64::max);
        let touching = gaps.iter().zip(&depths).filter(|(_, d)| **d > least);
        let patches = touching
            .map(|(gap, depth)| {
                let start = near.and_then(|near| near.start_for(gap, *depth));
                let place = LoweredGap {
                    gap,
                    depth: *depth,
                    centre,
                    start,
                };
                self.solve_gap(place, fineness, workspace, monitor)
            })
            .collect::<Result<Vec<_>, _>>()?;
        if patches.is_empty() {
            return Err(NormalError::NoAnswer(
                "wheel and rail do not overlap at this height of the wheel".to_owned(),
            ));
        }
        let mut wheel = WheelContact {
            lowering,
            found: [0.0; 2],
            load_error: 0.0,
            force_residual: 0.0,
            centre,
            heights: 1,
            friction_share: 0.0,
            met: false,
            patches,
            remarks: Vec::new(),
        };
        let carried = self.carried(&wheel);
        wheel.found = [carried, self.slope(&wheel, carried)];
        Ok(wheel)
    }

    /// One gap under the overlap it has; approaches count from the first touch of its patch along the normal.
    fn solve_gap(
        &self,
        place: LoweredGap,
        fineness: Fineness,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<GapContact, NormalError> {
        let LoweredGap {
            gap,
            depth,
            centre,
            start,
        } = place;
        if let std::ops::ControlFlow::Break(stop) = monitor.tick(0.0) {
            return Err(NormalError::Stopped(stop));
        }
        let above: Vec<Vec<f64>> = gap
            .gap
            .iter()
            .map(|row| row.iter().map(|height| height + depth).collect())
            .collect();
        let contact = GapTask {
            gap: GapSurface::grid(&gap.x, &gap.y, &above),
            loading: NormalLoad::Approach(depth),
            contact_modulus: self.contact_modulus,
            seen: GapSeen::default(),
        };
        let resolution = match fineness.detail {
            GapSampling::Coarse => GridFineness::coarse(),
            GapSampling::Fine => GridFineness::for_answer(fineness.target),
        };
        let found = contact.solve_near(start, resolution, workspace, monitor)?;
        let mut remarks = found.remarks;
        remarks.extend(missed_beside(gap, &found.field));
        if fineness.detail == GapSampling::Fine {
            let cut = cut_patches(&self.geometry, gap, &found.field);
            remarks.extend(cut.map_err(|miss| NormalError::NoAnswer(miss.to_string()))?);
        }
        let moved = |to: [f64; 2]| {
            let place = self.geometry.moved(&gap.frame, to, centre);
            place.map_err(|miss| NormalError::NoAnswer(miss.to_string()))
        };
        if fineness.detail == GapSampling::Fine {
            for patch in 0..found.field.patches().len() {
                moved(found.field.load_centre(Some(patch)))?;
            }
        }
        let middle = found.field.load_centre(None);
        Ok(GapContact {
            frame: moved(middle)?,
            approach: depth,
            field: found.field.from_origin(middle),
            report: found.report,
            remarks,
            start: found.start,
        })
    }

    /// A remark if the patches in gaps of their own would change each other's forces by more than a part of the load.
    #[must_use]
    pub fn uncoupled(&self, wheel: &WheelContact, part: f64) -> Option<Remark> {
        let gaps = wheel.patches.iter().map(|gap| Neighbour {
            frame: gap.frame,
            force: gap.normal_force(),
            approach: gap.approach,
        });
        let keeps_load = !matches!(self.loading, WheelLoad::Lowering(_));
        let gaps: Vec<Neighbour> = gaps.collect();
        let [share, distance_mm] = neglected(&gaps, self.contact_modulus, keeps_load)?;
        (share > part).then_some(Remark::PatchesUncoupled { share, distance_mm })
    }

    /// The force that is prescribed, as it came out.
    fn carried(&self, found: &WheelContact) -> f64 {
        match self.loading {
            WheelLoad::Vertical(_) => found.vertical_force(),
            WheelLoad::Normal(_) | WheelLoad::Lowering(_) => {
                found.patches.iter().map(GapContact::normal_force).sum()
            }
        }
    }

    /// Estimated derivative of that force by the lowering.
    fn slope(&self, found: &WheelContact, carried: f64) -> f64 {
        let part = |gap: &GapContact| {
            let cos = gap.frame.angle.cos();
            let own = 2.0 * self.contact_modulus * gap.stiffness() * cos;
            match self.loading {
                WheelLoad::Vertical(_) => own * cos,
                WheelLoad::Normal(_) | WheelLoad::Lowering(_) => own,
            }
        };
        let slope: f64 = found.patches.iter().map(part).sum();
        // The power 3/2 of Hertz's contacts is a bound for anything that grows as it is pressed.
        slope.max(carried / found.lowering)
    }
}

/// Deepest overlap of a gap in mm.
pub(crate) fn depth(gap: &LocalGap) -> f64 {
    -gap.gap
        .iter()
        .flatten()
        .copied()
        .fold(f64::INFINITY, f64::min)
}
