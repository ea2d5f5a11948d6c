//! Merges the answers for the parts of a wheel–rail contact, with their positions and the sums in track axes.

use crate::contact::geometry::frame::Frame;
use crate::contact::geometry::frame::SurfaceMissed;
use crate::contact::geometry::wheel_rail::WheelRail;
use crate::contact::normal::wheel_height::wheel_contact::{GapContact, WheelContact};
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::solution::words::answer::{
    ErrorEstimate, NormalReport, Origin, Position, Solution, Total,
};
use crate::contact::solution::words::fields::Fields;

/// Axes, origins and signs in words.
const FRAME: &str = "every patch in its own axes: x along rolling (leading edge at larger x), y to the left in the plane of \
                     contact, z out of the rail, origin at its load centre; total in track axes: x along rolling, y to the left, \
                     z up; forces, moments and tractions act on the lower body, slip is that of the upper body relative to the \
                     lower one";

/// Merges the answers for the parts, in the order of the wheel's patches; `case` is the whole case, `answers` has at
/// least one entry.
///
/// `total` holds the sums in track axes: `F_x`, `F_y cos α + N sin α` across, `F_y sin α − N cos α` upward, with the contact angle α and
/// the normal force N, and the moment about the vertical line through the load centre of all patches, to which a part adds
/// `M_z cos α` and its forces times their distance.
///
/// # Errors
/// Rail or wheel were not found over the load centre of a patch.
pub fn in_track(
    case: &CheckedCase,
    geometry: &WheelRail,
    wheel: &WheelContact,
    answers: Vec<(Solution, Fields)>,
) -> Result<(Solution, Fields), SurfaceMissed> {
    let parts: Vec<FramedLoad> = wheel.patches.iter().map(FramedLoad::new).collect();
    let origin = load_centre(&parts);
    let total = totals(&parts, origin, &answers);
    let mut remarks = case.remarks.clone();
    remarks.extend_from_slice(&wheel.remarks);
    let alone = answers.len() == 1;
    let mut whole: Option<(Solution, Fields)> = None;
    for (gap, (mut solution, fields)) in wheel.patches.iter().zip(answers) {
        let before = whole.as_ref().map_or(0, |(whole, _)| whole.patches.len());
        let own = gap.remarks.iter().chain(&solution.remarks);
        remarks.extend(own.map(|remark| in_wheel(remark, before, alone)));
        for (k, patch) in solution.patches.iter_mut().enumerate() {
            let centre = gap.field.load_centre(Some(k));
            let place = geometry.moved(&gap.frame, centre, wheel.centre)?;
            patch.position = Some(position(geometry, &place, &gap.frame));
            let (sin, cos) = gap.frame.angle.sin_cos();
            for point in &mut patch.points {
                let normal = patch.normal_force_n;
                point.force_track_n = Some([
                    point.force_x_n,
                    point.force_y_n * cos + normal * sin,
                    point.force_y_n * sin - normal * cos,
                ]);
            }
        }
        match &mut whole {
            None => whole = Some((solution, fields)),
            Some((all, all_fields)) => {
                all.normal = both(all.normal, solution.normal);
                all.patches.extend(solution.patches);
                all_fields.patches.extend(fields.patches);
            }
        }
    }
    let Some((solution, fields)) = whole else {
        unreachable!("a wheel at rest touches its rail")
    };
    let solution = Solution {
        total,
        remarks: merged(remarks),
        wheel_lowering_mm: Some(wheel.lowering),
        origin: Origin {
            x_mm: origin[0],
            y_mm: origin[1],
            meaning: "load centre of all patches in track axes, for the total; the origin of a patch is in its position"
                .to_owned(),
        },
        frame: FRAME.to_owned(),
        ..solution
    };
    Ok((solution, fields))
}

/// The totals of all motions in track axes.
fn totals(parts: &[FramedLoad], origin: [f64; 2], answers: &[(Solution, Fields)]) -> Vec<Total> {
    let motions = answers.first().map_or(0, |(first, _)| first.total.len());
    (0..motions)
        .map(|motion| {
            let part = |(part, (answer, _)): (&FramedLoad, &(Solution, Fields))| {
                part.in_track(&answer.total[motion], origin)
            };
            parts.iter().zip(answers).map(part).fold(None, sum)
        })
        .collect::<Option<Vec<Total>>>()
        .unwrap_or_default()
}

/// A remark on a part of the contact, renumbered for the whole; `first` is the index of the part's first patch. A remark without a
/// patch is attributed to that one, unless the part is the whole contact.
fn in_wheel(remark: &RemarkEntry, first: usize, alone: bool) -> RemarkEntry {
    let patch = match remark.patch {
        Some(own) => Some(first + own),
        None => (!alone).then_some(first),
    };
    RemarkEntry {
        patch,
        ..remark.clone()
    }
}

/// A part of the contact in track axes.
struct FramedLoad {
    frame: Frame,
    normal_force: f64,
}

impl FramedLoad {
    fn new(gap: &GapContact) -> FramedLoad {
        FramedLoad {
            frame: gap.frame,
            normal_force: gap.normal_force(),
        }
    }

    /// Sums over a part, turned into track axes, with the moment about the vertical line through `[x, y]`.
    fn in_track(&self, own: &Total, about: [f64; 2]) -> Total {
        let (sin, cos) = self.frame.angle.sin_cos();
        let arm = [0, 1].map(|k| self.frame.origin[k] - about[k]);
        let force_y = own.force_y_n * cos + self.normal_force * sin;
        Total {
            force_x_n: own.force_x_n,
            force_y_n: force_y,
            force_z_n: Some(own.force_y_n * sin - self.normal_force * cos),
            moment_z_n_mm: own.moment_z_n_mm * cos + arm[0] * force_y - arm[1] * own.force_x_n,
            error_estimate: own.error_estimate.map(|error| {
                let across = error.force_y_n * cos.abs();
                ErrorEstimate {
                    force_x_n: error.force_x_n,
                    force_y_n: across,
                    moment_z_n_mm: error.moment_z_n_mm * cos.abs()
                        + arm[0].abs() * across
                        + arm[1].abs() * error.force_x_n,
                }
            }),
            profile_uncertainty: None,
        }
    }
}

/// Mean position of the parts in track axes, weighted with their normal forces.
fn load_centre(parts: &[FramedLoad]) -> [f64; 2] {
    let force: f64 = parts.iter().map(|part| part.normal_force).sum();
    [0, 1].map(|k| {
        let weighted = parts
            .iter()
            .map(|part| part.normal_force * part.frame.origin[k]);
        weighted.sum::<f64>() / force
    })
}

fn sum(so_far: Option<Total>, part: Total) -> Option<Total> {
    let Some(so_far) = so_far else {
        return Some(part);
    };
    Some(Total {
        force_x_n: so_far.force_x_n + part.force_x_n,
        force_y_n: so_far.force_y_n + part.force_y_n,
        force_z_n: so_far.force_z_n.zip(part.force_z_n).map(|(a, b)| a + b),
        moment_z_n_mm: so_far.moment_z_n_mm + part.moment_z_n_mm,
        error_estimate: so_far
            .error_estimate
            .zip(part.error_estimate)
            .map(|(a, b)| a.plus(b)),
        profile_uncertainty: None,
    })
}

/// One report for two parts: the finer grid, all the work, the worse residual.
pub(crate) fn both(one: Option<NormalReport>, other: Option<NormalReport>) -> Option<NormalReport> {
    let (Some(one), Some(other)) = (one, other) else {
        return one.or(other);
    };
    Some(NormalReport {
        cells: if one.cells >= other.cells {
            one.cells
        } else {
            other.cells
        },
        grids: one.grids + other.grids,
        iterations: one.iterations + other.iterations,
        residual: one.residual.max(other.residual),
        pressure_change: if one.pressure_change.abs() >= other.pressure_change.abs() {
            one.pressure_change
        } else {
            other.pressure_change
        },
        force_residual: one.force_residual.max(other.force_residual),
        seconds: one.seconds + other.seconds,
    })
}

fn position(geometry: &WheelRail, place: &Frame, frame: &Frame) -> Position {
    Position {
        track_mm: place.origin,
        rail_mm: geometry.on_rail(place.rail),
        wheel_mm: geometry.on_wheel(place.wheel),
        contact_angle_rad: frame.angle,
        rolling_radius_mm: geometry.meridian(place.wheel).radius,
        origin_track_mm: frame.origin,
    }
}
