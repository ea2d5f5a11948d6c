//! How far apart two sets of resultants are, relative to what friction can carry.

use crate::contact::normal::patch::Patch;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// Distances of two sets of resultants: every patch relative to its own μN with moments about its middle, then the sums.
pub(super) fn distances(
    task: &RollingTask,
    patches: &[Patch],
    found: &[Resultants],
    other: &[Resultants],
) -> Vec<f64> {
    let mut distances = Vec::with_capacity(patches.len() + 1);
    let (mut sum, mut sum_other) = (Resultants::default(), Resultants::default());
    let (mut force, mut area, mut centre) = (0.0, 0.0, [0.0, 0.0]);
    for (k, ((patch, found), other)) in patches.iter().zip(found).zip(other).enumerate() {
        let bound = task.friction.limit(task.footprint, k);
        let at = [
            0.5 * (patch.extent[0] + patch.extent[1]),
            0.5 * (patch.extent[2] + patch.extent[3]),
        ];
        let length = (patch.area / std::f64::consts::PI).sqrt();
        distances.push(found.about(at).distance(&other.about(at), bound, length));
        sum = sum.plus(*found);
        sum_other = sum_other.plus(*other);
        force += bound;
        area += patch.area;
        centre = [centre[0] + bound * at[0], centre[1] + bound * at[1]];
    }
    let centre = centre.map(|c| c / force);
    let length = (area / std::f64::consts::PI).sqrt();
    distances.push(
        sum.about(centre)
            .distance(&sum_other.about(centre), force, length),
    );
    distances
}
