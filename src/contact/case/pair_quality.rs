//! How good the points of both profiles of a case are, before anything is solved.

use crate::contact::normal::normal_task::NormalTask;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::profile_points;
use crate::contact::solution::words::profile_quality::PairQuality;

impl CheckedCase {
    /// How far the points of the profiles can be trusted, as far as that is known without the contact; only of a wheel on a rail.
    #[must_use]
    pub fn quality(&self) -> Option<PairQuality> {
        let NormalTask::Wheel(contact) = &self.problem.task else {
            return None;
        };
        Some(profile_points::quality(
            &contact.geometry,
            contact.contact_modulus,
        ))
    }
}
