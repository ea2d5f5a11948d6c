//! Cache of the pairs of cross-sections that were read last.
//!
//! Rows of a run, and steps of a simulation, differ in placement, load and motion far more often than in their profiles.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::contact::case::words::contact::CrossSection;
use crate::contact::geometry::wheel_rail::{Placement, WheelRail};

/// Pairs kept: those of a few vehicles, left and right, whose steps alternate.
const PAIRS_MAX: usize = 16;

/// The pairs read last, the most recent first.
#[derive(Debug, Default)]
pub struct KnownPair(Mutex<Vec<Arc<PairRead>>>);

/// A pair, and the words that it was read from.
#[derive(Debug)]
struct PairRead {
    sections: [CrossSection; 2],
    /// y of the back of the flange, if the case states it.
    flange_back: Option<f64>,
    geometry: WheelRail,
}

/// Whether the track is the same, for any placement of the wheelset. The back of the flange is compared as it was stated.
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
    /// The pair of rail and wheel in their places, if it is kept.
    pub(crate) fn placed(
        &self,
        [rail, wheel]: [&CrossSection; 2],
        flange_back: Option<f64>,
        placement: &Placement,
    ) -> Option<WheelRail> {
        let mut pairs = self.pairs();
        let found = pairs.iter().position(|known| {
            known.flange_back == flange_back
                && on_same_track(&known.geometry.placement, placement)
                && known.sections[0] == *rail
                && known.sections[1] == *wheel
        })?;
        let pair = pairs.remove(found);
        pairs.insert(0, pair.clone());
        drop(pairs);
        let Placement {
            lateral_shift,
            yaw,
            roll,
            ..
        } = *placement;
        Some(pair.geometry.posed(lateral_shift, yaw, roll))
    }

    /// Keeps a pair that was read without faults.
    pub(crate) fn keep(
        &self,
        sections: [&CrossSection; 2],
        flange_back: Option<f64>,
        geometry: &WheelRail,
    ) {
        let pair = Arc::new(PairRead {
            sections: sections.map(CrossSection::clone),
            flange_back,
            geometry: geometry.clone(),
        });
        let mut pairs = self.pairs();
        pairs.insert(0, pair);
        pairs.truncate(PAIRS_MAX);
    }

    fn pairs(&self) -> MutexGuard<'_, Vec<Arc<PairRead>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
