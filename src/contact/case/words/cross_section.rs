//! A cross-section of a rail or a wheel in a case.

use railhead_macros::{Members, keyword, none_is_absent};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::object::{AllowedRange, Object, names, shown};
use crate::case::words::samples::COORDINATE;
use crate::geometry::formats::Format;
use crate::geometry::profile::LengthUnit;
use crate::geometry::profile::{POINTS_MAX, POINTS_MIN};

/// A cross-section of a rail or a wheel, as points or as the text of a file; exactly one of the two.
///
/// y is positive to the field side and z positive down, unless `mirror_y`, `mirror_z`, the shape or the format specify the opposite
/// direction.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema, Members)]
#[members(faults_of_section)]
pub struct CrossSection {
    /// Points `[y, z]` in order along the cross-section, in mm or in `unit`.
    #[member(with = points)]
    pub points_mm: Option<Vec<[f64; 2]>>,
    /// Points `[y, z]` of a guard rail next to a rail, toward the track centre, in order along its surface; unit, origin and directions are
    /// those of the rail's own points. The gauge and the highest point are those of the running rail.
    #[member(with = points)]
    pub guard_rail_points_mm: Option<Vec<[f64; 2]>>,
    /// Digest of a cross-section stored with `POST /v1/profiles`, in place of points or text.
    #[member(skip)]
    pub profile: Option<String>,
    /// Format of `text`.
    pub format: Option<Format>,
    /// Content of the file, not its path.
    #[member(with = text)]
    pub text: Option<String>,
    /// Unit of the points or of the text. Default: the unit named in the file, otherwise mm. All other lengths of a case are in mm.
    pub unit: Option<LengthUnit>,
    /// `true` if y of the points is positive toward the track centre. Default: the flange of a wheel decides; for a rail, the format
    /// (points: `false`, MiniProf: `true`). A wheel without a flange requires this member, except in Simpack files.
    pub mirror_y: Option<bool>,
    /// `true` if z of the points is positive upward. Default: the flange of a wheel or the head of a rail decides. If the shape does not
    /// show it, the case is refused, except for Simpack files.
    pub mirror_z: Option<bool>,
    /// Waves along the cross-section shorter than about this wavelength in mm are smoothed away; default 0 (no smoothing). `auto` chooses
    /// 0, or 2 to 8 mm, from the noise of the points and the pressure; the result states it.
    #[member(with = smoothing, default)]
    pub smoothing_mm: Smoothing,
}

/// How a cross-section is smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum Smoothing {
    /// A cut-off wavelength in mm; 0 for no smoothing.
    Length(f64),
    /// A wavelength that the service chooses.
    ByNoise(SmoothingWord),
}

impl Default for Smoothing {
    fn default() -> Smoothing {
        Smoothing::Length(0.0)
    }
}

/// A smoothing that the service chooses.
#[keyword]
pub enum SmoothingWord {
    /// From the noise of the points and the pressure.
    Auto,
}

const SMOOTHING: AllowedRange = AllowedRange::closed(0.0, 50.0, "mm");
/// Maximum number of characters of a file.
const TEXT_MAX: usize = 4_000_000;

/// Refuses a cross-section that has neither points nor a text with its format, or both.
pub(crate) fn faults_of_section(block: &mut Object, _: Option<&CrossSection>) -> Option<()> {
    let given = block.exactly_one(&["points_mm", "text"], |block| {
        let detail = "missing; an array of points [y, z] in mm is needed, or text and format of a file instead";
        block.fault("points_mm", detail);
    })?;
    if given == "text" {
        let what = format!("one of {}", names(Format::WORDS));
        return block.required("format", &what).map(|_| ());
    }
    if block.has("format") {
        let detail = "given together with points_mm; a format is only for the text of a file";
        return block.refuse("format", detail);
    }
    Some(())
}

/// Reads the content of a file.
pub(crate) fn text(block: &mut Object, name: &str) -> Option<String> {
    block.text(name, TEXT_MAX)
}

/// Reads a length or the keyword `auto`.
pub(crate) fn smoothing(block: &mut Object, name: &str) -> Option<Smoothing> {
    let value = block.value(name)?;
    if value.as_str() == Some("auto") {
        return Some(Smoothing::ByNoise(SmoothingWord::Auto));
    }
    if !value.is_number() {
        let given = shown(value);
        let detail = format!("{given} given; {SMOOTHING} is allowed, or \"auto\"");
        return block.refuse(name, detail);
    }
    block.number(name, SMOOTHING).map(Smoothing::Length)
}

/// Reads the points of a cross-section. The first [`LISTED_MAX`](crate::case::words::object) faulty ones get a fault each; one more fault counts the rest.
pub(crate) fn points(block: &mut Object, name: &str) -> Option<Vec<[f64; 2]>> {
    let what = format!("an array of {POINTS_MIN} to {POINTS_MAX} points [y, z] in mm");
    block.array(name, POINTS_MIN..=POINTS_MAX, &what)?;
    let (mut points, mut refused) = (block.elements(name)?, 0);
    let read = points.own_elements(&mut refused, point, refuse_point);
    let needed = format!("each must be a pair [y, z], both {COORDINATE}");
    points.count_rest(refused, "points", needed);
    read
}

fn point(element: &Value) -> Option<[f64; 2]> {
    let [y, z] = element.as_array()?.as_slice() else {
        return None;
    };
    Some([COORDINATE.read(y)?, COORDINATE.read(z)?])
}

fn refuse_point(points: &mut Object, index: &str) {
    let element = points.value(index).unwrap_or(&Value::Null);
    if element.as_array().is_none_or(|pair| pair.len() != 2) {
        let given = shown(element);
        let detail = format!("{given} given; a pair [y, z] in mm is needed");
        let pointer = points.pointer_to(index);
        return points.faults().add(pointer, detail);
    }
    if let Some(mut pair) = points.elements(index) {
        pair.number("0", COORDINATE);
        pair.number("1", COORDINATE);
    }
}
