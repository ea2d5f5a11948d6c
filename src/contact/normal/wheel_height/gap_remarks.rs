//! What a client should know of the gap of a patch, beyond its region and its pressure.

use crate::contact::geometry::frame::{SurfaceExit, SurfaceMissed};
use crate::contact::geometry::local_gap::LocalGap;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// A patch that ends within this part of its width, half a cell, of a line beyond which its gap was bent apart ends because of that.
/// Population: a worn pair lowered by 0.065 to 0.245 mm: patches that end by themselves are 0.028 of their width away at least.
const CUT_REACHED: f64 = 0.01;

/// A remark on samples of a gap over which the wheel's surface was not found, if some lie in a patch or next to it: elsewhere
/// the bodies are apart all the same.
pub(crate) fn missed_beside(gap: &LocalGap, field: &PressureField) -> Option<RemarkEntry> {
    let spacing = |axis: &[f64]| axis[1] - axis[0];
    let [along, across] = [spacing(&gap.x), spacing(&gap.y)];
    let patches = field.patches();
    let beside = |[x, y]: &[f64; 2]| {
        patches.iter().any(|patch| {
            let [x_min, x_max, y_min, y_max] = patch.extent;
            (x_min - along..=x_max + along).contains(x)
                && (y_min - across..=y_max + across).contains(y)
        })
    };
    let count = gap.missed.iter().filter(|place| beside(place)).count();
    let share = count as f64 / (gap.x.len() * gap.y.len()) as f64;
    let remark = Remark::IterationInexact {
        iteration: "samples of the wheel's surface over the plane of contact",
        reason: SurfaceExit::StepsUsedUp.reason(),
        residual: share,
        tolerance: 0.0,
    };
    (count > 0).then(|| remark.into())
}

/// Remarks on patches that reach a line beyond which their gap was bent apart: there they end by a decision, not as a contact does.
///
/// # Errors
/// The rail was not found over such a line.
pub(crate) fn cut_patches(
    geometry: &WheelRail,
    gap: &LocalGap,
    field: &PressureField,
) -> Result<Vec<RemarkEntry>, SurfaceMissed> {
    let [lower, upper] = gap.limits;
    let mut remarks = Vec::new();
    for (k, patch) in field.patches().iter().enumerate() {
        let [.., low, high] = patch.extent;
        let close = CUT_REACHED * (high - low);
        let reached = [
            lower.filter(|end| low - end < close),
            upper.filter(|end| end - high < close),
        ];
        for end in reached.into_iter().flatten() {
            let [rail_y_mm, _] = geometry.on_rail(geometry.rail_over(&gap.frame, end)?);
            remarks.push(Remark::PatchCut { rail_y_mm }.at_patch(k));
        }
    }
    Ok(remarks)
}
