//! The interpretation of a case without solving it: patches that are known beforehand, and wheel and rail in place.

use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::profile::{Body, POINT_SPACING};
use crate::geometry::wheel_rail::WheelRail;
use crate::normal::footprint::{Footprint, NormalTask};
use crate::normal::hertz::Patch;
use crate::normal::wheel::{WheelLoad, WheelTask};
use crate::problem::checked_case::{CheckedCase, at_edge};
use crate::remark::entry::{RemarkEntry, merged};
use crate::solution::words::answer::{FirstTouch, KnownPatch, PlacedProfiles, Understanding};

impl CheckedCase {
    /// Returns what is known of the contact without solving it.
    ///
    /// # Errors
    /// The reason, if no part of the wheel lies above the rail.
    pub fn understood(&self) -> Result<Understanding, String> {
        let known = self.problem.task.known_footprint();
        let friction = &self.problem.friction;
        let placement = match &self.problem.task {
            NormalTask::Wheel(task) => Some(placed(task)?),
            _ => None,
        };
        Ok(Understanding {
            friction_limit_n: known.as_ref().map(|known| friction.limit_of_all(known)),
            patches: known
                .iter()
                .flat_map(Footprint::patches)
                .map(known_patch)
                .collect(),
            placement,
        })
    }

    /// Returns remarks on a point of first touch that is on the tip of the flange or near the end of a profile. A solve assesses each patch
    /// itself.
    pub fn touch_remarks(&self) -> Vec<RemarkEntry> {
        let sides = match &self.problem.task {
            NormalTask::Wheel(task) => vec![&task.geometry],
            NormalTask::Wheelset(task) => task.sides.iter().map(|side| &side.geometry).collect(),
            _ => Vec::new(),
        };
        merged(sides.into_iter().flat_map(touch_remarks))
    }
}

fn touch_remarks(geometry: &WheelRail) -> Vec<RemarkEntry> {
    let Ok(locus) = ContactLocus::new(geometry) else {
        return Vec::new();
    };
    let bodies = [Body::Rail, Body::Wheel];
    let places = geometry.profiles().into_iter().zip(locus.first_touch());
    let judged = places.zip(bodies).filter_map(|((profile, s), body)| {
        let remark = at_edge(profile, body, [s; 2])?;
        Some(remark.at_pointer(&format!("/contact/{}", body.name())))
    });
    judged.collect()
}

fn known_patch(patch: &Patch) -> KnownPatch {
    KnownPatch {
        normal_force_n: patch.normal_force,
        approach_mm: patch.approach,
        area_mm2: patch.area,
        pressure_max_mpa: patch.pressure_max,
        semi_axes_mm: patch.semi_axes,
        extent_mm: patch.extent,
    }
}

fn placed(task: &WheelTask) -> Result<PlacedProfiles, String> {
    let geometry = &task.geometry;
    let locus = ContactLocus::new(geometry)?;
    let [rail, wheel] = geometry.parameters(POINT_SPACING);
    let rail_mm = rail.into_iter().map(|s| rounded(geometry.rail_at(s).at));
    let wheel_mm = wheel.into_iter().map(|s| {
        let [y, z] = match geometry.lowest(s) {
            Some([_, y, z]) => [y, z],
            None => geometry.wheel_section(s),
        };
        rounded([y, z + locus.touch])
    });
    let lowering_estimate_mm = match task.loading {
        WheelLoad::Vertical(force) | WheelLoad::Normal(force) => {
            locus.estimated_lowering(force / task.contact_modulus)
        }
        WheelLoad::Lowering(lowering) => lowering,
    };
    Ok(PlacedProfiles {
        rail_mm: rail_mm.collect(),
        wheel_mm: wheel_mm.collect(),
        first_touch: first_touch(&locus, geometry),
        lowering_estimate_mm,
    })
}

fn first_touch(locus: &ContactLocus<'_>, geometry: &WheelRail) -> FirstTouch {
    let [rail, wheel] = locus.first_touch();
    let on_rail = geometry.rail_at(rail);
    // The tangent toward the left, for either direction of the curve.
    let [dy, dz] = on_rail.slope;
    let x = geometry.lowest(wheel).map_or(0.0, |[x, ..]| x);
    FirstTouch {
        track_mm: [x, on_rail.at[0], on_rail.at[1]],
        rail_mm: geometry.on_rail(rail),
        wheel_mm: geometry.on_wheel(wheel),
        contact_angle_rad: (dz * dy.signum()).atan2(dy.abs()),
    }
}

/// Rounds coordinates to four decimals.
fn rounded(at: [f64; 2]) -> [f64; 2] {
    at.map(|value| (value * 1e4).round() / 1e4)
}
