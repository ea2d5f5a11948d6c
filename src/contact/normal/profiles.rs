//! A wheel on a rail by their cross-sections: the height of the wheel at which its patches carry the load.
//!
//! At one height every patch has a gap of its own, in its own frame, and is pressed by the overlap there. The height is
//! sought by secant steps in `N^(2/3)`, which for Hertz's contacts is proportional to the lowering; the first slope comes
//! from the stiffness of flat punches of the same areas, `dN/dδ = 2 E* √(A/π)`. Until the height is nearly found, gaps are sampled
//! and solved coarsely.

use std::f64::consts::PI;

use crate::contact::geometry::contact_search::{Frame, Search};
use crate::contact::geometry::local_gap::{Detail, LocalGap};
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::monitor::Monitor;
use crate::contact::normal::hertz::Pressing;
use crate::contact::normal::non_hertzian::gap::Gap;
use crate::contact::normal::non_hertzian::{Failure, GapContact, Report};
use crate::contact::normal::prescribed::PressureField;
use crate::contact::profile_trust::Trust;
use crate::contact::remark::{Remark, RemarkEntry};

/// Heights looked at before giving up.
const HEIGHTS_MAX: u32 = 40;
/// The force found may differ from the one wanted by this part; the contact is then grown to the force as Hertz's would be. What
/// is left is of second order for Hertz's contacts, about a third of this part in pressures and lengths at worst.
const FORCE_TOLERANCE: f64 = 5e-3;
/// That third, as an error of the load.
const CORRECTED: f64 = 1.0 / 3.0;
/// A coarse look that misses the force by no more than this is followed by a fine one.
const NEAR: f64 = 0.02;
/// A bracket narrower than this part of the lowering holds a jump of the force, where patches merge.
const BRACKET_MIN: f64 = 2e-4;
/// Steps in a row that may leave the bracket more than half as wide.
const SLOW_MAX: u32 = 3;
/// So close to a lowering that cannot be solved, relative to it, the search ends.
const CLOSE: f64 = 0.02;
/// A patch that overlaps by less than this part of the deepest overlap carries nothing to speak of (about its power 3/2).
const DEPTH_SHARE_MIN: f64 = 2e-3;

/// What presses the wheel on the rail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loading {
    /// Vertical force in N.
    Vertical(f64),
    /// Sum of the normal forces of all patches in N.
    Normal(f64),
    /// The wheel is lowered by so many mm below first touch.
    Lowering(f64),
}

/// A wheel over its rail, and what presses them together.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileContact {
    /// Wheel and rail in place.
    pub geometry: WheelRail,
    /// The load.
    pub loading: Loading,
    /// Contact modulus `E* = G/(1−ν)` in MPa.
    pub contact_modulus: f64,
    /// What the case says about the trust in the profiles.
    pub trust: Trust,
}

/// The wheel at rest on its rail.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedWheel {
    /// How far the wheel is below first touch, in mm.
    pub lowering: f64,
    /// The force that is prescribed, in N, as it came out at the last height, and its derivative by the lowering.
    found: [f64; 2],
    /// By how much, relatively, the load of region and pressure may differ from the one wanted.
    pub load_error: f64,
    /// By which part the prescribed force was missed at the last height, before the contact was corrected to it.
    pub force_residual: f64,
    /// Height of the wheel's centre over the top of the rail, in mm.
    pub centre: f64,
    /// Heights looked at.
    pub heights: u32,
    /// What presses, from smaller to larger y of the track; never empty.
    pub patches: Vec<PressedGap>,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

/// The contact in one gap: usually one patch, several where they lie near each other.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedGap {
    /// Frame of the coordinates, with its origin at the load centre.
    pub frame: Frame,
    /// Region and pressure.
    pub field: PressureField,
    /// How it was found.
    pub report: Report,
    /// Remarks for the answer.
    pub remarks: Vec<RemarkEntry>,
}

impl PressedGap {
    /// Sum of the normal forces in N.
    #[must_use]
    pub fn normal_force(&self) -> f64 {
        let patches = self.field.patches();
        patches.iter().map(|patch| patch.normal_force).sum()
    }

    /// Force per mm of approach of flat punches of the same areas (exact for circles), divided by `2 E*`.
    fn stiffness(&self) -> f64 {
        let patches = self.field.patches();
        patches.iter().map(|patch| (patch.area / PI).sqrt()).sum()
    }
}

/// How a wheel should come to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Of a vertical force the normal forces carry the part `1 / (1 + friction_share)`.
    pub friction_share: f64,
    /// The force may be missed by this part; 0 for as little as matters.
    pub tolerance: f64,
}

impl PressedWheel {
    /// Forces times a factor near 1, and the wheel lower by so much in mm.
    fn correct(&mut self, factor: f64, lower: f64) {
        self.found[0] *= factor;
        self.lowering += lower;
        self.centre -= lower;
        for gap in &mut self.patches {
            let approach = lower * gap.frame.angle.cos();
            gap.field = gap.field.clone().corrected(factor, approach);
        }
    }

    /// Vertical part of the normal forces in N.
    #[must_use]
    pub fn vertical_force(&self) -> f64 {
        let part = |gap: &PressedGap| gap.normal_force() * gap.frame.angle.cos();
        self.patches.iter().map(part).sum()
    }
}

impl ProfileContact {
    /// The same with other smoothings of rail and wheel, in mm.
    #[must_use]
    pub fn smoothed(&self, smoothing: [f64; 2]) -> ProfileContact {
        ProfileContact {
            geometry: self.geometry.smoothed(smoothing),
            ..self.clone()
        }
    }

    /// Brings the wheel to rest, from an earlier rest under a similar load if there is one.
    ///
    /// # Errors
    /// A reason why there is no answer; or the monitor stopped the work.
    pub fn press(
        &self,
        search: &Search,
        wanted: Wanted,
        before: Option<&PressedWheel>,
        monitor: &dyn Monitor,
    ) -> Result<PressedWheel, Failure> {
        let target = match self.loading {
            Loading::Vertical(force) => force / (1.0 + wanted.friction_share),
            Loading::Normal(force) => force,
            Loading::Lowering(lowering) => {
                return self.lowered(search, lowering, Detail::Fine, monitor);
            }
        };
        let near = |force: f64| (force / target - 1.0).abs() <= NEAR;
        let mut bracket = Bracket::default();
        let mut detail = Detail::Coarse;
        let mut lowering = match before {
            Some(before) => {
                if near(before.found[0]) && wanted.tolerance < NEAR {
                    detail = Detail::Fine;
                }
                bracket.next(before.lowering, before.found[0], target, before.found[1])
            }
            None => search.estimated_lowering(target / self.contact_modulus),
        };
        let mut closed = false;
        for heights in 1..=HEIGHTS_MAX {
            let mut found = match self.looked_at(search, lowering, detail, monitor) {
                Ok(found) => found,
                Err(Failure::NoAnswer(reason)) => {
                    // Too deep, perhaps; the load may be carried higher up.
                    lowering = bracket.refuse(lowering, reason)?;
                    continue;
                }
                Err(stopped) => return Err(stopped),
            };
            let [carried, slope] = found.found;
            let known = bracket.slope;
            let next = bracket.next(lowering, carried, target, slope);
            found.found[1] = bracket.slope.or(known).unwrap_or(slope);
            found.heights = heights;
            if (carried / target - 1.0).abs() <= wanted.tolerance.max(FORCE_TOLERANCE)
                && (detail == Detail::Fine || wanted.tolerance > FORCE_TOLERANCE)
            {
                // A coarse rest is not corrected: it is a place to go on from.
                if wanted.tolerance <= FORCE_TOLERANCE {
                    found.force_residual = (carried / target - 1.0).abs();
                    found.load_error = CORRECTED * (target / carried - 1.0).abs();
                    found.correct(target / carried, (target - carried) / found.found[1]);
                }
                return Ok(found);
            }
            if let Some(reason) = bracket.closed_on_refusal(lowering) {
                return Err(Failure::NoAnswer(reason));
            }
            closed |= bracket.width() < BRACKET_MIN * lowering;
            if closed && detail == Detail::Fine {
                let factor = target / carried;
                found.remarks.push(Remark::ForceJumps { factor }.into());
                found.force_residual = (carried / target - 1.0).abs();
                found.load_error = (target / carried - 1.0).abs();
                found.correct(target / carried, 0.0);
                return Ok(found);
            }
            if detail == Detail::Coarse && (closed || near(carried)) {
                // What coarse looks said of the forces on either side is not sharp enough to go on from, the slope is.
                detail = Detail::Fine;
                bracket = bracket.opened(found.found[1]);
            }
            lowering = if closed { lowering } else { next };
        }
        Err(Failure::NoAnswer(format!(
            "no height of the wheel carries the load after {HEIGHTS_MAX} tries"
        )))
    }

    /// The wheel at one height; where a coarse look has no answer, a fine one may.
    fn looked_at(
        &self,
        search: &Search,
        lowering: f64,
        detail: Detail,
        monitor: &dyn Monitor,
    ) -> Result<PressedWheel, Failure> {
        match self.lowered(search, lowering, detail, monitor) {
            Err(Failure::NoAnswer(_)) if detail == Detail::Coarse => {
                self.lowered(search, lowering, Detail::Fine, monitor)
            }
            found => found,
        }
    }

    /// The wheel at one height.
    fn lowered(
        &self,
        search: &Search,
        lowering: f64,
        detail: Detail,
        monitor: &dyn Monitor,
    ) -> Result<PressedWheel, Failure> {
        let centre = search.touch - lowering;
        let gaps = search.gaps(lowering, detail).map_err(Failure::NoAnswer)?;
        let depths: Vec<f64> = gaps.iter().map(depth).collect();
        let least = DEPTH_SHARE_MIN * depths.iter().copied().fold(0.0, f64::max);
        let touching = gaps.iter().zip(&depths).filter(|(_, d)| **d > least);
        let patches = touching
            .map(|(gap, depth)| self.pressed(gap, *depth, centre, detail, monitor))
            .collect::<Result<Vec<_>, _>>()?;
        if patches.is_empty() {
            return Err(Failure::NoAnswer(
                "wheel and rail do not overlap at this height of the wheel".to_owned(),
            ));
        }
        let mut wheel = PressedWheel {
            lowering,
            found: [0.0; 2],
            load_error: 0.0,
            force_residual: 0.0,
            centre,
            heights: 1,
            patches,
            remarks: Vec::new(),
        };
        let carried = self.carried(&wheel);
        wheel.found = [carried, self.slope(&wheel, carried)];
        Ok(wheel)
    }

    /// One gap under the overlap it has; approaches count from the first touch of its patch along the normal.
    fn pressed(
        &self,
        gap: &LocalGap,
        depth: f64,
        centre: f64,
        detail: Detail,
        monitor: &dyn Monitor,
    ) -> Result<PressedGap, Failure> {
        let above: Vec<Vec<f64>> = gap
            .gap
            .iter()
            .map(|row| row.iter().map(|height| height + depth).collect())
            .collect();
        let contact = GapContact {
            gap: Gap::grid(&gap.x, &gap.y, &above),
            pressing: Pressing::Approach(depth),
            contact_modulus: self.contact_modulus,
        };
        let found = match detail {
            Detail::Coarse => contact.estimate(monitor)?,
            Detail::Fine => contact.solve(monitor)?,
        };
        let middle = found.field.load_centre(None);
        Ok(PressedGap {
            frame: self.geometry.moved(&gap.frame, middle, centre),
            field: found.field.from_origin(middle),
            report: found.report,
            remarks: found.remarks,
        })
    }

    /// The force that is prescribed, as it came out.
    fn carried(&self, found: &PressedWheel) -> f64 {
        match self.loading {
            Loading::Vertical(_) => found.vertical_force(),
            Loading::Normal(_) | Loading::Lowering(_) => {
                found.patches.iter().map(PressedGap::normal_force).sum()
            }
        }
    }

    /// Estimated derivative of that force by the lowering.
    fn slope(&self, found: &PressedWheel, carried: f64) -> f64 {
        let part = |gap: &PressedGap| {
            let cos = gap.frame.angle.cos();
            let own = 2.0 * self.contact_modulus * gap.stiffness() * cos;
            match self.loading {
                Loading::Vertical(_) => own * cos,
                Loading::Normal(_) | Loading::Lowering(_) => own,
            }
        };
        let slope: f64 = found.patches.iter().map(part).sum();
        // The power 3/2 of Hertz's contacts is a bound for anything that grows as it is pressed.
        slope.max(carried / found.lowering)
    }
}

/// Deepest overlap of a gap in mm.
fn depth(gap: &LocalGap) -> f64 {
    -gap.gap
        .iter()
        .flatten()
        .copied()
        .fold(f64::INFINITY, f64::min)
}

/// What is known of the height sought.
#[derive(Debug, Default)]
struct Bracket {
    /// Lowering with too little force.
    low: f64,
    /// Lowering with too much force, or one that could not be solved.
    high: Option<f64>,
    /// Why `high` could not be solved.
    refused: Option<String>,
    /// The height before, with the power 2/3 of its force.
    before: Option<[f64; 2]>,
    /// The width at the step before, and steps in a row that hardly changed it.
    width_before: f64,
    slow: u32,
    /// Derivative of the force by the lowering between the last two heights, where it can be trusted.
    slope: Option<f64>,
    /// The same from elsewhere, for the next step.
    known: Option<f64>,
}

impl Bracket {
    fn width(&self) -> f64 {
        self.high.map_or(f64::INFINITY, |high| high - self.low)
    }

    /// The next lowering to try, after one that carries a force.
    fn next(&mut self, lowering: f64, carried: f64, target: f64, slope: f64) -> f64 {
        const POWER: f64 = 2.0 / 3.0;
        let [here, wanted] = [carried, target].map(|force| force.powf(POWER));
        if carried < target {
            self.low = lowering;
        } else {
            self.high = Some(lowering);
            self.refused = None;
        }
        let estimate = POWER * here / carried * self.known.take().unwrap_or(slope);
        let secant = self
            .before
            .map(|[at, value]| (here - value) / (lowering - at))
            // Between heights that are nearly the same the difference is that of their grids.
            .filter(|secant| (0.7..1.5).contains(&(secant / estimate)));
        self.before = Some([lowering, here]);
        self.slope = secant.map(|secant| secant / POWER * carried / here);
        let next = lowering + (wanted - here) / secant.unwrap_or(estimate);
        let next = next.clamp(0.25 * lowering, 4.0 * lowering);
        self.within(next)
    }

    /// The next lowering to try, after one that could not be solved.
    fn refuse(&mut self, lowering: f64, reason: String) -> Result<f64, Failure> {
        self.high = Some(lowering);
        if lowering - self.low < CLOSE * lowering || lowering < 1e-6 {
            return Err(Failure::NoAnswer(reason));
        }
        self.refused = Some(reason);
        Ok(0.5 * (self.low + lowering))
    }

    /// The same without its sides, except for what could not be solved, and with a derivative that is known.
    fn opened(self, slope: f64) -> Bracket {
        Bracket {
            high: self.high.filter(|_| self.refused.is_some()),
            refused: self.refused,
            slope: Some(slope),
            known: Some(slope),
            ..Bracket::default()
        }
    }

    /// Why nothing deeper could be solved, once the bracket has closed on it from below.
    fn closed_on_refusal(&self, lowering: f64) -> Option<String> {
        let closed = self.width() < CLOSE * lowering;
        self.refused.clone().filter(|_| closed)
    }

    /// The next lowering, in the middle of the bracket if it lies outside or the bracket does not shrink.
    fn within(&mut self, next: f64) -> f64 {
        let Some(high) = self.high else {
            return next;
        };
        let width = high - self.low;
        self.slow = if width > 0.5 * self.width_before {
            self.slow + 1
        } else {
            0
        };
        self.width_before = width;
        if next < high && next > self.low && self.slow < SLOW_MAX {
            return next;
        }
        self.slow = 0;
        0.5 * (self.low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force of lowering^1.5 with a jump at 0.5.
    fn force(lowering: f64, jump: f64) -> f64 {
        lowering.powf(1.5) + if lowering > 0.5 { jump } else { 0.0 }
    }

    fn sought(target: f64, jump: f64, start: f64) -> (f64, u32) {
        let mut bracket = Bracket::default();
        let mut lowering = start;
        for count in 1..100 {
            let carried = force(lowering, jump);
            let next = bracket.next(lowering, carried, target, 1.3 * lowering.sqrt());
            if (carried / target - 1.0).abs() < FORCE_TOLERANCE
                || bracket.width() < BRACKET_MIN * lowering
            {
                return (lowering, count);
            }
            lowering = next;
        }
        panic!("not found")
    }

    #[test]
    fn hertzian_forces_are_met_in_a_few_steps_from_far_away() {
        for start in [0.01, 0.2, 0.9, 7.0] {
            let (lowering, count) = sought(0.2, 0.0, start);
            assert!((force(lowering, 0.0) / 0.2 - 1.0).abs() < FORCE_TOLERANCE);
            assert!(count <= 8, "{count} steps from {start}");
        }
        assert!(sought(0.2, 0.0, 0.33).1 <= 3);
    }

    #[test]
    fn a_jump_of_the_force_is_closed_in_on() {
        let (lowering, count) = sought(0.4, 0.2, 0.3);
        assert!((lowering - 0.5).abs() < 2e-4, "{lowering}");
        assert!(count < 40, "{count}");
    }

    #[test]
    fn what_cannot_be_solved_bounds_the_search_and_is_the_reason_in_the_end() {
        let mut bracket = Bracket::default();
        let mut lowering = 1.0;
        let reason = loop {
            match bracket.refuse(lowering, "cut off".to_owned()) {
                Ok(next) => lowering = next,
                Err(Failure::NoAnswer(reason)) => break reason,
                Err(other) => panic!("{other:?}"),
            }
        };
        assert_eq!(reason, "cut off");
    }
}
