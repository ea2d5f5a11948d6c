//! The members of a case that describe a wheel over its rail, and a cache of the pairs that were read from them.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::case::words::contact::OnRails;
use crate::case::words::cross_section::{CrossSection, Smoothing};
use crate::error::Fault;
use crate::geometry::wheel_rail::{Placement, Side, WheelRail};
use crate::normal::wheel::ProfileTrust;
use crate::remark::list::Remark;

/// The members of a case that describe a wheel over its rail.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PairWords<'a> {
    /// Cross-sections of rail and wheel.
    pub(crate) sections: [&'a CrossSection; 2],
    /// JSON pointers to them.
    pub(crate) pointers: [&'static str; 2],
    /// JSON pointer to the rolling radius.
    pub(crate) radius_pointer: &'static str,
    /// y of the back of the flange in mm, if the case states it.
    pub(crate) flange_back: Option<f64>,
    /// Whether rough or exchanged profiles are accepted.
    pub(crate) accept_rough: bool,
    /// The placement, in which the position of the back of the flange is still 0.
    pub(crate) placement: Placement,
}

impl<'a> PairWords<'a> {
    /// The pair of one side, with the wheelset at a shift to the left in mm, a yaw and a roll in rad.
    pub(crate) fn new(
        rails: &OnRails<'a>,
        side: Side,
        [lateral_shift, yaw, roll]: [f64; 3],
    ) -> PairWords<'a> {
        PairWords {
            sections: rails.sections,
            pointers: ["/contact/rail", "/contact/wheel"],
            radius_pointer: "/contact/rolling_radius_mm",
            flange_back: rails.flange_back_position_mm,
            accept_rough: rails.accept_rough_profiles,
            placement: Placement {
                side,
                rolling_radius: rails.rolling_radius_mm,
                rail: rails.rail,
                cant: rails.cant_rad,
                flange_back_distance: rails.flange_back_distance_mm,
                flange_back_position: 0.0,
                lateral_shift,
                yaw,
                roll,
            },
        }
    }

    /// Whether the smoothing of the profiles is automatic and rough profiles are accepted.
    pub(crate) fn trust(&self) -> ProfileTrust {
        let auto = |section: &CrossSection| matches!(section.smoothing_mm, Smoothing::ByNoise(_));
        ProfileTrust {
            auto: self.sections.map(auto),
            accept_rough: self.accept_rough,
        }
    }
}

/// Maximum number of pairs in the cache: left and right wheels of a few vehicles whose cases alternate.
const PAIRS_MAX: usize = 16;

/// A cache of the pairs of cross-sections that were read last, the most recent first.
///
/// Rows of a run and steps of a simulation usually differ in placement, load and motion, but not in their profiles.
#[derive(Debug, Default)]
pub struct KnownPair(Mutex<Vec<Arc<PairRead>>>);

/// A wheel over its rail, with remarks on the position of the wheel's points.
pub(crate) type Placed = (WheelRail, Vec<Remark>);

/// A placed pair, and the members that it was read from.
#[derive(Debug)]
struct PairRead {
    sections: [CrossSection; 2],
    flange_back: Option<f64>,
    accept_rough: bool,
    /// The placement without the pose of the wheelset.
    track: Placement,
    placed: Placed,
}

impl KnownPair {
    /// Returns the pair of rail and wheel in place: a known one with the pose of `words`, or the one that `read` returns.
    pub(crate) fn placed(
        &self,
        words: &PairWords,
        read: impl FnOnce() -> Result<Placed, Vec<Fault>>,
    ) -> Result<Placed, Vec<Fault>> {
        let Placement {
            lateral_shift,
            yaw,
            roll,
            ..
        } = words.placement;
        let track = Placement {
            lateral_shift: 0.0,
            yaw: 0.0,
            roll: 0.0,
            ..words.placement
        };
        let mut pairs = self.pairs();
        let found = pairs.iter().position(|known| {
            known.flange_back == words.flange_back
                && known.accept_rough == words.accept_rough
                && known.track == track
                && known.sections.each_ref() == words.sections
        });
        let known = found.map(|found| {
            pairs[..=found].rotate_right(1);
            Arc::clone(&pairs[0])
        });
        drop(pairs);
        let pair = match known {
            Some(pair) => pair,
            None => {
                let pair = Arc::new(PairRead {
                    sections: words.sections.map(CrossSection::clone),
                    flange_back: words.flange_back,
                    accept_rough: words.accept_rough,
                    track,
                    placed: read()?,
                });
                let mut pairs = self.pairs();
                pairs.insert(0, Arc::clone(&pair));
                pairs.truncate(PAIRS_MAX);
                pair
            }
        };
        let (geometry, remarks) = &pair.placed;
        Ok((geometry.posed(lateral_shift, yaw, roll), remarks.clone()))
    }

    fn pairs(&self) -> MutexGuard<'_, Vec<Arc<PairRead>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
