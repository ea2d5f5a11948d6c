//! Is the shape of a patch the reason why a solve does not converge?

use crate::contact::normal::patch::Patch;
use crate::contact::rolling::task::RollingTask;

/// If a solve does not converge, a patch longer along rolling than this many times its width is named as the likely reason; nearly all
/// such patches are solved.
const SLENDER: f64 = 20.0;

/// A clause that names the patch of the largest ratio of length along rolling to width, if this may be why there is no answer.
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
