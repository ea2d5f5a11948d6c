//! Lengths of track and wheelset that would be usual in another unit than mm.

use crate::contact::case::words::contact::Contact;
use crate::contact::error::Fault;
use crate::contact::geometry::length_unit::LengthUnit;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// Usual gauge in mm: standard gauge.
const GAUGE: f64 = 1435.0;
/// Usual distance of the middle of a rail from that of the track in mm, on standard gauge.
const RAIL_ORIGIN: f64 = 752.5;
/// Usual distance of the backs of the flanges in mm, on standard gauge.
const FLANGE_BACKS: f64 = 1360.0;
/// Usual rolling radius in mm (UIC wheels of 920 mm diameter).
const RADIUS: f64 = 460.0;

/// Remarks on the lengths of a wheel or a wheelset on rails, each with the pointer to its member.
pub(crate) fn unusual(contact: &Contact) -> Vec<RemarkEntry> {
    let (Contact::Profiles {
        gauge_mm,
        rail_origin_mm,
        flange_back_distance_mm,
        rolling_radius_mm,
        ..
    }
    | Contact::Wheelset {
        gauge_mm,
        rail_origin_mm,
        flange_back_distance_mm,
        rolling_radius_mm,
        ..
    }) = contact
    else {
        return Vec::new();
    };
    let lengths = [
        ("/contact/gauge_mm", *gauge_mm, GAUGE),
        ("/contact/rail_origin_mm", *rail_origin_mm, RAIL_ORIGIN),
        (
            "/contact/flange_back_distance_mm",
            Some(*flange_back_distance_mm),
            FLANGE_BACKS,
        ),
        (
            "/contact/rolling_radius_mm",
            Some(*rolling_radius_mm),
            RADIUS,
        ),
    ];
    let remark = |(pointer, length_mm, usual): (&str, Option<f64>, f64)| {
        let length_mm = length_mm?;
        let unit = LengthUnit::likely(length_mm, usual).filter(|unit| *unit != LengthUnit::Mm)?;
        let unit = unit.symbol();
        Some(Remark::LengthUnusual { length_mm, unit }.at_pointer(pointer))
    };
    lengths.into_iter().filter_map(remark).collect()
}

/// Faults of the placement, with the lengths that may be the reason.
pub(crate) fn explained(faults: Vec<Fault>, unusual: &[RemarkEntry]) -> Vec<Fault> {
    let explain = |mut fault: Fault| {
        let about_place = ["/contact", "/contact/rolling_radius_mm"];
        if about_place.contains(&fault.pointer.as_str()) {
            for remark in unusual {
                let pointer = remark.pointer.as_deref().unwrap_or_default();
                fault.detail = format!("{}; {pointer}: {}", fault.detail, remark.detail);
            }
        }
        fault
    };
    faults.into_iter().map(explain).collect()
}
