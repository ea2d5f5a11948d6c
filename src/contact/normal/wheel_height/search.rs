//! A wheel on a rail by their cross-sections: the height of the wheel at which its patches carry the load.
//!
//! At one height every patch has a gap of its own, in its own frame, and is pressed by the overlap there. The height is
//! sought by secant steps in `N^(2/3)`, which for Hertz's contacts is proportional to the lowering; the first slope comes
//! from the stiffness of flat punches of the same areas, `dN/dδ = 2 E* √(A/π)`. Until the height is nearly found, gaps are sampled
//! and solved coarsely.

use crate::contact::geometry::contact_locus::ContactLocus;
use crate::contact::geometry::frame::SurfaceMissed;
use crate::contact::geometry::grouping::LoadedPatch;
use crate::contact::half_space::grid_operator::GridWorkspace;
use crate::contact::monitor::Monitor;
use crate::contact::normal::gap::answer::NormalError;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::wheel_height::bracket::{Bracket, HeightExit};
use crate::contact::normal::wheel_height::lowered::Fineness;
use crate::contact::normal::wheel_height::task::{Accuracy, NormalPass, WheelLoad, WheelTask};
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};

/// Heights after which the search is given up. Keeps the numbers safe; not tuned.
const HEIGHTS_MAX: u32 = 40;
/// Times that gaps are divided further at most. Keeps the work bounded; each time at least one gap is divided, and most cases need none.
const REGROUPINGS_MAX: usize = 8;
/// Strips of a patch over which the inclination of the rail is averaged.
const STRIPS: usize = 24;
/// Tells from a wheel at some height what friction will carry, see [`NormalPass::friction_share`]; nothing where it cannot be told.
pub type ShareForecast<'a> = dyn Fn(&WheelContact) -> Option<f64> + 'a;

/// What is known before the search for a height begins.
#[derive(Clone, Copy, Default)]
pub struct HeightStart<'a> {
    /// An earlier rest under a similar load.
    pub before: Option<&'a WheelContact>,
    /// Lowering in mm to begin with, where that rest was of other profiles and tells nothing of the forces.
    pub lowering: Option<f64>,
    /// Asked at coarse heights, in place of [`NormalPass::friction_share`].
    pub forecast: Option<&'a ShareForecast<'a>>,
}

impl<'a> HeightStart<'a> {
    /// From an earlier rest.
    pub(crate) fn near(before: &'a WheelContact) -> HeightStart<'a> {
        HeightStart {
            before: Some(before),
            ..HeightStart::default()
        }
    }

    /// From a rest with other readings of the profiles; with these the wheel touches first with its centre at the height `touch` in mm. The
    /// centre at rest hardly moves, however far the highest points of both readings lie apart.
    #[must_use]
    pub fn of_other_profiles(rest: &'a WheelContact, touch: f64) -> HeightStart<'a> {
        HeightStart {
            lowering: Some(touch - rest.centre),
            ..HeightStart::near(rest)
        }
    }

    /// The earlier rest corrected to a force, where that is exact enough.
    fn carrying(&self, force: f64, tolerance: f64) -> Option<WheelContact> {
        let same_profiles = self.before.filter(|_| self.lowering.is_none());
        same_profiles.and_then(|rest| rest.carrying(force, tolerance))
    }

    /// How fine the first height for a force in N is.
    fn first_fineness(&self, wanted: NormalPass, force: f64) -> Fineness {
        let exact = matches!(wanted.accuracy, Accuracy::For(_));
        let is_near = |before: &WheelContact| before.is_near(force, wanted.accuracy);
        Fineness {
            // Other readings of the profiles only tell how far their answers lie apart.
            settles: self.lowering.is_none(),
            ..Fineness::first(wanted, exact && self.before.is_some_and(is_near))
        }
    }

    /// The lowering in mm that a search for a force in N begins with, if the start tells.
    fn first_lowering(&self, bracket: &mut Bracket, force: f64) -> Option<f64> {
        let of_before = |known: &WheelContact| {
            let [carried, slope] = known.found;
            bracket.next(known.lowering, carried, force, slope)
        };
        self.lowering.or_else(|| self.before.map(of_before))
    }
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
        let mut search = ContactLocus::new(&self.geometry)?;
        let expected = match self.loading {
            WheelLoad::Vertical(force) | WheelLoad::Normal(force) => {
                let force = force / self.contact_modulus;
                let lowering = search.estimated_lowering(force);
                search.estimated = Some([force, lowering]);
                lowering
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

    /// Brings the wheel to rest. If a gap then holds patches that must not share a frame, `search` is divided further and the height sought
    /// again.
    ///
    /// # Errors
    /// A reason why there is no answer; or the monitor stopped the work.
    pub fn find_height(
        &self,
        search: &mut ContactLocus,
        wanted: NormalPass,
        start: HeightStart,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        let mut wheel = self.height_as_divided(search, wanted, start, workspace, monitor)?;
        for _ in 0..REGROUPINGS_MAX {
            // A single patch in each gap cannot be divided.
            let single = |gap: &GapContact| gap.field.patches().len() == 1;
            if search.grouping.is_none() && wheel.patches.iter().all(single) {
                break;
            }
            let loaded = self.loaded_patches(search, &wheel);
            let loaded = loaded.map_err(|miss| NormalError::NoAnswer(miss.to_string()))?;
            let Some(grouping) = search.regrouped(&loaded, wheel.lowering) else {
                break;
            };
            search.grouping = Some(grouping);
            // Its force is that of other gaps, so that it must not be scaled to the load.
            wheel.met = false;
            let again = HeightStart {
                before: Some(&wheel),
                lowering: None,
                ..start
            };
            wheel = self.height_as_divided(search, wanted, again, workspace, monitor)?;
        }
        Ok(wheel)
    }

    /// The patches under pressure, gap by gap.
    fn loaded_patches(
        &self,
        search: &ContactLocus,
        wheel: &WheelContact,
    ) -> Result<Vec<Vec<LoadedPatch>>, SurfaceMissed> {
        let of_patch = |gap: &GapContact, k: usize, patch: &Patch| {
            let [.., low, high] = patch.extent;
            let over = |y: f64| self.geometry.rail_over(&gap.frame, y);
            let rail = [over(low)?, over(high)?];
            let (mut force, mut turned) = (0.0, 0.0);
            for [y, own] in gap.strip_loads(k, STRIPS) {
                let [dy, dz] = self.geometry.rail_at(over(y)?).slope;
                force += own;
                turned += own * (dz / dy).atan();
            }
            Ok(LoadedPatch {
                rail,
                lines: rail.map(|rail| search.line_at(rail)),
                angle: if force > 0.0 {
                    turned / force
                } else {
                    gap.frame.angle
                },
                force: patch.normal_force,
            })
        };
        let of_gap = |gap: &GapContact| {
            let patches = gap.field.patches();
            let patches = patches.iter().enumerate();
            patches.map(|(k, patch)| of_patch(gap, k, patch)).collect()
        };
        wheel.patches.iter().map(of_gap).collect()
    }

    /// The wheel at rest with the overlaps divided among gaps as they are.
    fn height_as_divided(
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
        match (start.carrying(force, tolerance), wanted.accuracy) {
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
        start: HeightStart,
        workspace: &mut GridWorkspace<f32>,
        monitor: &dyn Monitor,
    ) -> Result<WheelContact, NormalError> {
        let (before, forecast) = (start.before, start.forecast);
        let target = |friction_share: f64| self.target(friction_share).unwrap_or_default();
        let mut friction_share = wanted.friction_share;
        let mut force = target(friction_share);
        let tolerance = wanted.accuracy.tolerance();
        let exact = matches!(wanted.accuracy, Accuracy::For(_));
        let mut fineness = start.first_fineness(wanted, force);
        let (mut bracket, mut last) = (Bracket::default(), None::<WheelContact>);
        let mut lowering = start
            .first_lowering(&mut bracket, force)
            .unwrap_or_else(|| search.estimated_lowering(force / self.contact_modulus));
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
            let fine = fineness.detail.is_for_answer();
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
            if closed || !fine && found.is_near(force, wanted.accuracy) {
                // Forces of coarse gaps are too inexact as ends of the bracket; their slope is exact enough.
                fineness = fineness.finer();
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
            Err(NormalError::NoAnswer(_)) if !fineness.detail.is_for_answer() => {
                let fine = fineness.finer();
                self.lowered(search, lowering, fine, near, workspace, monitor)
            }
            found => found,
        }
    }
}
