//! Reads a contact of the type `profiles`: two cross-sections and how they lie.

use serde_json::Value;

use crate::contact::case::read::object::{
    AllowedRange, LISTED_MAX, Object, join, names, number, shown,
};
use crate::contact::case::words::contact::{
    Contact, CrossSection, FormatName, InfluenceName, SideName, Smoothing, SmoothingWord,
    SurfaceName, UnitName,
};
use crate::contact::geometry::profile::{POINTS_MAX, POINTS_MIN};

pub(crate) const ROLLING_RADIUS: AllowedRange = AllowedRange::positive(1e5, "mm");
pub(crate) const GAUGE: AllowedRange = AllowedRange::positive(1e5, "mm");
pub(crate) const DISTANCE: AllowedRange = AllowedRange::closed(0.0, 1e5, "mm");
pub(crate) const PLACE: AllowedRange = AllowedRange::closed(-1e3, 1e3, "mm");
pub(crate) const DEPTH: AllowedRange = AllowedRange::closed(0.0, 100.0, "mm");
pub(crate) const CANT: AllowedRange = AllowedRange::closed(-0.5, 0.5, "rad");
pub(crate) const ANGLE: AllowedRange = AllowedRange::closed(-0.3, 0.3, "rad");
const COORDINATE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const SMOOTHING: AllowedRange = AllowedRange::closed(0.0, 50.0, "mm");
/// Characters of a file.
const TEXT_MAX: usize = 4_000_000;
const MEMBERS: [&str; 17] = [
    "type",
    "rail",
    "wheel",
    "side",
    "rolling_radius_mm",
    "gauge_mm",
    "gauge_height_mm",
    "rail_origin_mm",
    "cant_rad",
    "flange_back_distance_mm",
    "flange_back_position_mm",
    "lateral_shift_mm",
    "yaw_rad",
    "roll_rad",
    "accept_rough_profiles",
    "reference_surface",
    "influence",
];

/// Reads the members of the contact; whether the cross-sections are sound is told when they are laid over each other.
pub(crate) fn read(block: &mut Object) -> Option<Contact> {
    block.only(&MEMBERS);
    let rail = section(block, "rail");
    let wheel = section(block, "wheel");
    let what = "left or right";
    let side = block
        .required("side", what)
        .and_then(|_| block.word("side", SideName::WORDS));
    let rolling_radius_mm = block.required_number("rolling_radius_mm", ROLLING_RADIUS);
    let cant_rad = block.number_or("cant_rad", CANT, 0.0);
    let flange_back_distance_mm = block.number_or("flange_back_distance_mm", DISTANCE, 1360.0);
    let lateral_shift_mm = block.number_or("lateral_shift_mm", PLACE, 0.0);
    let yaw_rad = block.number_or("yaw_rad", ANGLE, 0.0);
    let roll_rad = block.number_or("roll_rad", ANGLE, 0.0);
    let flange_back_position_mm = block.optional_number("flange_back_position_mm", PLACE);
    let place = rail_place(block);
    let accept_rough_profiles = flag(block, "accept_rough_profiles");
    let (reference_surface, influence) = surface(block)?;
    Some(Contact::Profiles {
        rail: Box::new(rail?),
        wheel: Box::new(wheel?),
        side: side?,
        rolling_radius_mm: rolling_radius_mm?,
        gauge_mm: place?.gauge_mm,
        gauge_height_mm: place?.gauge_height_mm,
        rail_origin_mm: place?.rail_origin_mm,
        cant_rad: cant_rad?,
        flange_back_distance_mm: flange_back_distance_mm?,
        flange_back_position_mm: flange_back_position_mm?,
        lateral_shift_mm: lateral_shift_mm?,
        yaw_rad: yaw_rad?,
        roll_rad: roll_rad?,
        accept_rough_profiles: accept_rough_profiles?.unwrap_or(false),
        reference_surface,
        influence,
    })
}

/// Reads the surface of a contact of profiles.
pub(crate) fn surface(block: &mut Object) -> Option<(Option<SurfaceName>, Option<InfluenceName>)> {
    let surface = block.optional_word("reference_surface", SurfaceName::WORDS)?;
    let influence = block.optional_word("influence", InfluenceName::WORDS)?;
    if surface == Some(SurfaceName::Plane) && influence.is_some() {
        block.fault(
            "influence",
            "given for planes of contact, which are half-spaces; leave it out, or give reference_surface: \"curve\"",
        );
        return None;
    }
    Some((surface, influence))
}

/// How the rail is placed across the track: by gauge and gauge height, or by its origin.
#[derive(Clone, Copy)]
pub(crate) struct RailPlaceWords {
    pub(crate) gauge_mm: Option<f64>,
    pub(crate) gauge_height_mm: Option<f64>,
    pub(crate) rail_origin_mm: Option<f64>,
}

/// Reads the place of the rail, with the defaults of the gauge where no origin is given.
pub(crate) fn rail_place(block: &mut Object) -> Option<RailPlaceWords> {
    const BY_GAUGE: [(&str, AllowedRange, f64); 2] = [
        ("gauge_mm", GAUGE, 1435.0),
        ("gauge_height_mm", DEPTH, 14.0),
    ];
    if block.has("rail_origin_mm") {
        let both = block.given(&BY_GAUGE.map(|(name, ..)| name));
        if !both.is_empty() {
            block.fault(
                "rail_origin_mm",
                format!(
                    "given together with {}; give rail_origin_mm alone to place the rail by its origin, or gauge_mm and gauge_height_mm to \
                     place it by its gauge face",
                    both.join(" and ")
                ),
            );
            return None;
        }
        return Some(RailPlaceWords {
            gauge_mm: None,
            gauge_height_mm: None,
            rail_origin_mm: Some(block.number("rail_origin_mm", DISTANCE)?),
        });
    }
    let [gauge, height] =
        BY_GAUGE.map(|(name, allowed, default)| block.number_or(name, allowed, default));
    Some(RailPlaceWords {
        gauge_mm: Some(gauge?),
        gauge_height_mm: Some(height?),
        rail_origin_mm: None,
    })
}

/// Reads a cross-section that is needed.
pub(crate) fn section(contact: &mut Object, name: &str) -> Option<CrossSection> {
    section_of(&mut contact.child(name)?)
}

/// Reads the members of a cross-section.
pub(crate) fn section_of(block: &mut Object) -> Option<CrossSection> {
    block.only(&[
        "points_mm",
        "format",
        "text",
        "unit",
        "mirror_y",
        "mirror_z",
        "smoothing_mm",
    ]);
    let mirror_y = flag(block, "mirror_y");
    let mirror_z = flag(block, "mirror_z");
    let smoothing_mm = smoothing(block);
    let unit = block.optional_word("unit", UnitName::WORDS);
    let (points_mm, format, text) = match (block.has("points_mm"), block.has("text")) {
        (true, false) => {
            if block.has("format") {
                block.fault(
                    "format",
                    "given together with points_mm; a format is only for the text of a file",
                );
                return None;
            }
            (Some(points(block)?), None, None)
        }
        (false, true) => {
            block.required("format", &format!("one of {}", names(FormatName::WORDS)))?;
            let format = block.word("format", FormatName::WORDS);
            let text = block.text("text", TEXT_MAX);
            (None, Some(format?), Some(text?))
        }
        (false, false) => {
            block.fault(
                "points_mm",
                "missing; an array of points [y, z] in mm is needed, or text and format of a file instead",
            );
            return None;
        }
        (true, true) => {
            block.exclude("points_mm", "text");
            return None;
        }
    };
    Some(CrossSection {
        points_mm,
        profile: None,
        format,
        text,
        unit: unit?,
        mirror_y: mirror_y?,
        mirror_z: mirror_z?,
        smoothing_mm: smoothing_mm?,
    })
}

/// A length, or the word `auto`.
fn smoothing(block: &mut Object) -> Option<Smoothing> {
    let Some(value) = block.value("smoothing_mm") else {
        return Some(Smoothing::Length(0.0));
    };
    if value.as_str() == Some("auto") {
        return Some(Smoothing::ByNoise(SmoothingWord::Auto));
    }
    if !value.is_number() {
        let given = shown(value);
        block.fault(
            "smoothing_mm",
            format!("{given} given; {SMOOTHING} is allowed, or \"auto\""),
        );
        return None;
    }
    block
        .number("smoothing_mm", SMOOTHING)
        .map(Smoothing::Length)
}

/// A truth value that may be left out; the outer `None` is a fault.
pub(crate) fn flag(block: &mut Object, name: &str) -> Option<Option<bool>> {
    let Some(value) = block.value(name) else {
        return Some(None);
    };
    let pointer = block.pointer_to(name);
    let read = value.as_bool();
    if read.is_none() {
        block.faults().add(
            pointer,
            format!("{} given; true or false is needed", shown(value)),
        );
    }
    read.map(Some)
}

fn points(block: &mut Object) -> Option<Vec<[f64; 2]>> {
    let what = format!("an array of {POINTS_MIN} to {POINTS_MAX} points [y, z] in mm");
    let elements = block.array("points_mm", POINTS_MIN..=POINTS_MAX, &what)?;
    let pointer = block.pointer_to("points_mm");
    let mut read = Vec::with_capacity(elements.len());
    let mut refused = 0;
    for (k, element) in elements.iter().enumerate() {
        if let Some(point) = point(element) {
            read.push(point);
            continue;
        }
        refused += 1;
        if refused <= LISTED_MAX {
            fault_of_point(element, &join(&pointer, k), block);
        }
    }
    if refused > LISTED_MAX {
        block.faults().add(
            pointer,
            format!(
                "{} more points are refused like those before; each has to be a pair [y, z], both {COORDINATE}",
                refused - LISTED_MAX
            ),
        );
    }
    (refused == 0).then_some(read)
}

fn point(element: &Value) -> Option<[f64; 2]> {
    let [y, z] = element.as_array()?.as_slice() else {
        return None;
    };
    let part = |value: &Value| value.as_f64().filter(|number| COORDINATE.contains(*number));
    Some([part(y)? + 0.0, part(z)? + 0.0])
}

fn fault_of_point(element: &Value, pointer: &str, block: &mut Object) {
    match element.as_array().map(Vec::as_slice) {
        Some(pair @ [_, _]) => {
            for (k, value) in pair.iter().enumerate() {
                number(value, &join(pointer, k), COORDINATE, block.faults());
            }
        }
        _ => block.faults().add(
            pointer,
            format!("{} given; a pair [y, z] in mm is needed", shown(element)),
        ),
    }
}
