//! The pair of cross-sections that was read last, for the next case of the same pair: rows of a run differ in the place of the wheelset, in the load
//! and in the motion, far more often than in their profiles.

use std::cell::RefCell;

use crate::contact::case::words::contact::CrossSection;
use crate::contact::geometry::wheel_rail::{Placement, WheelRail};

/// The pair that was read last; nothing at first.
#[derive(Debug, Default)]
pub struct KnownPair(RefCell<Option<PairRead>>);

/// A pair, and the words that it was read from.
#[derive(Debug)]
struct PairRead {
    sections: [CrossSection; 2],
    /// y of the back of the flange, if the case states it.
    flange_back: Option<f64>,
    geometry: WheelRail,
}

/// Whether the track is the same, wherever the wheelset is. The back of the flange is compared as it was stated.
fn on_same_track(one: &Placement, other: &Placement) -> bool {
    let track = |placement: &Placement| Placement {
        lateral_shift: 0.0,
        yaw: 0.0,
        roll: 0.0,
        flange_back_position: 0.0,
        ..*placement
    };
    track(one) == track(other)
}

impl KnownPair {
    /// The pair of rail and wheel in their places, if it was read last.
    pub(crate) fn placed(
        &self,
        [rail, wheel]: [&CrossSection; 2],
        flange_back: Option<f64>,
        placement: &Placement,
    ) -> Option<WheelRail> {
        let known = self.0.borrow();
        let PairRead {
            sections,
            flange_back: back_before,
            geometry,
        } = known.as_ref()?;
        let same = *back_before == flange_back
            && on_same_track(&geometry.placement, placement)
            && sections[0] == *rail
            && sections[1] == *wheel;
        let Placement {
            lateral_shift,
            yaw,
            roll,
            ..
        } = *placement;
        same.then(|| geometry.posed(lateral_shift, yaw, roll))
    }

    /// Keeps a pair that was read without faults.
    pub(crate) fn keep(
        &self,
        sections: [&CrossSection; 2],
        flange_back: Option<f64>,
        geometry: &WheelRail,
    ) {
        *self.0.borrow_mut() = Some(PairRead {
            sections: sections.map(CrossSection::clone),
            flange_back,
            geometry: geometry.clone(),
        });
    }
}
