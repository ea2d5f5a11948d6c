//! A cache of the pairs of rail and wheel that were read from the members of a case.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::case::words::contact::OnRails;
use crate::case::words::cross_section::{CrossSection, Smoothing};
use crate::error::Fault;
use crate::geometry::wheel_rail::{Placement, WheelRail};
use crate::normal::wheel::ProfileTrust;
use crate::remark::list::Remark;

impl OnRails<'_> {
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
        words: &OnRails,
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
