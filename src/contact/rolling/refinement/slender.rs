//! Is the shape of a patch the reason why a solve does not converge?

use crate::contact::normal::patch::Patch;
use crate::contact::rolling::task::RollingTask;

/// Patches longer along rolling than so many times their width are named where a solve does not converge; nearly all of them are solved.
const SLENDER: f64 = 20.0;

/// The patch that is longest along rolling for its width, as a clause, if it may be the reason why there is no answer.
pub(crate) fn slender(task: &RollingTask) -> Option<String> {
    let ratio = |patch: &Patch| {
        let [x_min, x_max, y_min, y_max] = patch.extent;
        (x_max - x_min) / (y_max - y_min)
    };
    let patches = task.footprint.patches();
    let (number, patch) = patches
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| ratio(a).total_cmp(&ratio(b)))?;
    let [x_min, x_max, y_min, y_max] = patch.extent;
    (ratio(patch) > SLENDER).then(|| {
        format!(
            "patch {number} at x {x_min:.2} to {x_max:.2} mm, y {y_min:.3} to {y_max:.3} mm is {:.0} times as long along \
             rolling as wide, which fastsim solves in any case",
            ratio(patch)
        )
    })
}
