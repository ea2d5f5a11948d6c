//! One cross-section of a rail or a wheel: checked points and the smooth curve through them.
//!
//! Input follows the habit of the field: y positive to the field side, z positive down, mm. From here on z is positive
//! up. The curve runs from the track centre to the field side, with the rail below and the wheel above it.
//!
//! Units of length in which cross-sections are given.

use std::ops::Range;
use std::sync::Arc;

use railhead_macros::{Named, Words};
use serde::Serialize;
use utoipa::ToSchema;

use crate::geometry::orientation::{
    self, Flange, FormatSenses, FoundSenses, Senses, StatedSenses, SureBody,
};
use crate::geometry::plane_curve::{CurvePoint, PlaneCurve};
use crate::geometry::profile_quality::{Points, PointsRead};
use crate::geometry::{plane_curve, profile_quality};
use crate::lazy_field::LazyField;
use crate::remark::list::Remark;

/// Length of the whole curve in mm that a profile may have; anything else is in another unit.
pub const ARC_LENGTH: [f64; 2] = [5.0, 500.0];
/// Points of one profile.
pub const POINTS_MIN: usize = 8;
/// Most points of one profile.
pub const POINTS_MAX: usize = 20_000;
/// Distance in mm of the points of a section that is drawn or wears: a twentieth of a narrow patch, and what measured sections have at the gauge
/// corner.
pub(crate) const POINT_SPACING: f64 = 0.25;
/// Length in mm of profile needed beyond a contact; with less there is a remark.
pub(crate) const NEEDED_BEYOND: f64 = 5.0;
/// Least depth in mm of the groove beside a guard rail below the highest point of the running rail: twice the height of a flange.
const GROOVE_DEPTH: f64 = 60.0;
/// Least depth in mm of the groove below the points at its sides.
const GROOVE_WALL: f64 = 5.0;
/// Points nearer to each other than this are one, in mm.
pub(crate) const NEAR: f64 = 1e-3;
/// Cosine of the turn from which on a point runs back against its neighbours: 102°, which no corner of a measured profile has, while points
/// at a joint of two measurements turn by up to 180°. Chosen by judgement; how much it matters was not measured.
const FLANGE_BACK_TURN: f64 = -0.2;
/// Part of the points that may run back; more are no joint, but points out of order. Chosen by judgement; how much it matters was not
/// measured.
const ZIGZAG_SHARE_MAX: f64 = 0.05;

/// Which body a profile belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum Body {
    /// The lower body.
    Rail,
    /// The upper body.
    Wheel,
}

/// How the points of a profile are to be read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// The y of the points is positive to the track centre. Without a statement the flange of a wheel decides.
    pub mirror_y: Option<bool>,
    /// The z of the points is positive up. Without a statement the shape decides.
    pub mirror_z: Option<bool>,
    /// Cut wavelength of the smoothing in mm; 0 for none.
    pub smoothing: f64,
}

/// A cross-section as a curve, twice continuously differentiable in its chord length except at sharp corners.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    curve: PlaneCurve,
    measured: Arc<MeasuredCurve>,
    /// Remarks on what was found and changed when it was read.
    pub remarks: Vec<Remark>,
}

/// The points that a curve was made from.
#[derive(Debug, Clone, PartialEq)]
struct MeasuredCurve {
    /// z up, in order from the track centre to the field side.
    points: Vec<[f64; 2]>,
    /// Length of the chords up to each point: the knots of the splines.
    along: Vec<f64>,
    /// Cut wavelength of the smoothing in mm.
    smoothing: f64,
    /// Step of which the given heights are multiples, in mm.
    rounding: Option<f64>,
    /// Step of which all given coordinates are multiples, in mm.
    digits: f64,
    /// The senses of the given points.
    senses: Senses,
    /// Number of points of the guard rail and the groove, which come before those of the running rail.
    beside: usize,
    flange: Option<Flange>,
    sure_body: LazyField<Option<SureBody>>,
}

impl Profile {
    /// The curve through points `[y, z]` in mm, y to the field side and z down unless `reading` says otherwise, in
    /// either order.
    ///
    /// Points nearer than 1 µm are merged, single points that run back are dropped; both leave a remark.
    ///
    /// # Errors
    /// A sentence: too few or too many points, numbers that are not finite, a total arc length outside 5 to 500 mm, loops, more than 5 %
    /// of the points running back, or senses that are neither stated nor shown by the shape.
    pub fn new(body: Body, points: &[[f64; 2]], reading: Reading) -> Result<Profile, String> {
        Profile::in_format(body, points, reading, FormatSenses::default())
    }

    /// The curve through points of a format that specifies their senses.
    ///
    /// # Errors
    /// As [`Profile::new`].
    pub fn in_format(
        body: Body,
        points: &[[f64; 2]],
        reading: Reading,
        format: FormatSenses,
    ) -> Result<Profile, String> {
        let mut remarks = Vec::new();
        let (rounding, digits) = (
            profile_quality::rounding(points),
            profile_quality::digits(points),
        );
        let mut points = checked(points)?;
        let length = arc_length(&points);
        let [shortest, longest] = ARC_LENGTH;
        if !(shortest..=longest).contains(&length) {
            let hint = match likely_unit(body, &points) {
                Some((width, unit)) => {
                    let unit = unit.name();
                    format!(
                        "the section is {width:.4} mm wide; if its numbers are in {unit} and not in mm, state unit: \"{unit}\""
                    )
                }
                None => "is another unit than mm used, or are the points not in order?".to_owned(),
            };
            return Err(format!(
                "the arc length of the points is {length:.4} mm; {shortest} to {longest} mm are allowed ({hint})"
            ));
        }
        if let Some((width_mm, unit)) = likely_unit(body, &points) {
            remarks.push(Remark::ProfileSizeUnusual {
                profile: body.name(),
                width_mm,
                unit: unit.name(),
            });
        }
        let (senses, flange) = orient(body, &mut points, reading, format, &mut remarks)?;
        straighten(body, &mut points, &mut remarks)?;
        cut_stray_ends(body, &mut points, &mut remarks);
        let given = points.len();
        points.dedup_by(|after, before| distance(*after, *before) < NEAR);
        if points.len() < given {
            remarks.push(Remark::ProfilePointsMerged {
                profile: body.name(),
                count: given - points.len(),
                nearer_than_mm: NEAR,
            });
        }
        if points.len() < POINTS_MIN {
            return Err(format!(
                "{} different points given; at least {POINTS_MIN} are needed",
                points.len()
            ));
        }
        let measured = MeasuredCurve {
            along: lengths(&points)?,
            points,
            smoothing: reading.smoothing,
            rounding,
            digits,
            senses,
            beside: 0,
            flange,
            sure_body: LazyField::default(),
        };
        Ok(Profile::of(measured, remarks))
    }

    /// The profile of a rail together with a guard rail at the side of the track centre, whose points are given in the same senses. A groove joins the two,
    /// so deep that no wheel reaches its bottom.
    ///
    /// # Errors
    /// Returns a sentence if a number is not finite, the arc length is outside 5 to 500 mm, the points form a loop, or the guard rail is not beside the rail.
    pub fn with_guard_rail(&self, points: &[[f64; 2]]) -> Result<Profile, String> {
        let own = &self.measured;
        let mut joined = orientation::in_senses(&checked(points)?, own.senses);
        let length = arc_length(&joined);
        let [shortest, longest] = ARC_LENGTH;
        if !(shortest..=longest).contains(&length) {
            return Err(format!(
                "the arc length of the points is {length:.4} mm; {shortest} to {longest} mm are allowed"
            ));
        }
        joined.dedup_by(|after, before| distance(*after, *before) < NEAR);
        let [end, _] = self.width();
        let reach = joined
            .iter()
            .map(|at| at[0])
            .fold(f64::NEG_INFINITY, f64::max);
        if reach >= end {
            return Err(format!(
                "the guard rail reaches y = {reach:.2} mm (positive to the field side), and the running rail begins at {end:.2} mm; a \
                 guard rail lies beside the running rail, on the side of the track centre"
            ));
        }
        let heights = own.points.iter().map(|at| at[1]);
        let top = heights.fold(f64::NEG_INFINITY, f64::max);
        let [from, to] = [joined[joined.len() - 1], own.points[0]];
        let bottom = from[1].min(to[1]).min(top - GROOVE_DEPTH) - GROOVE_WALL;
        joined.extend([[from[0], bottom], [to[0], bottom]]);
        let beside = joined.len();
        joined.extend(&own.points);
        let measured = MeasuredCurve {
            along: lengths(&joined)?,
            points: joined,
            beside,
            ..(**own).clone()
        };
        Ok(Profile::of(measured, self.remarks.clone()))
    }

    fn of(measured: MeasuredCurve, remarks: Vec<Remark>) -> Profile {
        Profile {
            curve: PlaneCurve::through(&measured.points, &measured.along, measured.smoothing),
            measured: Arc::new(measured),
            remarks,
        }
    }

    /// The curve of the same points with another smoothing, its cut wavelength in mm (0: none).
    #[must_use]
    pub fn smoothed(&self, smoothing: f64) -> Profile {
        let measured = MeasuredCurve {
            smoothing,
            ..(*self.measured).clone()
        };
        Profile::of(measured, self.remarks.clone())
    }

    /// The body that its points show without doubt.
    pub(crate) fn sure_body(&self) -> Option<SureBody> {
        let points = &self.measured.points[self.measured.beside..];
        *self
            .measured
            .sure_body
            .get_or_make(|| orientation::sure_body(points))
    }

    /// The flange of a wheel, if the points show one at the side of the track centre.
    pub(crate) fn flange(&self) -> Option<Flange> {
        self.measured.flange
    }

    /// The parameter at which the running rail begins, after the guard rail and the groove; 0 without a guard rail.
    pub(crate) fn first(&self) -> f64 {
        self.measured.along[self.measured.beside]
    }

    /// The chords of the groove that joins a guard rail and its running rail; empty without a guard rail.
    pub(crate) fn groove(&self) -> Range<usize> {
        self.measured.beside.saturating_sub(3)..self.measured.beside
    }

    /// Least and largest y in mm of the points, those of a guard rail excluded.
    pub(crate) fn width(&self) -> [f64; 2] {
        let points = &self.measured.points[self.measured.beside..];
        let y = || points.iter().map(|at| at[0]);
        [
            y().fold(f64::INFINITY, f64::min),
            y().fold(f64::NEG_INFINITY, f64::max),
        ]
    }

    /// The points the curve was made from, z up, by increasing parameter of the curve.
    pub fn points(&self) -> Points<'_> {
        Points {
            at: &self.measured.points,
            along: &self.measured.along,
        }
    }

    /// The points and the curve through them.
    pub fn read(&self) -> PointsRead<'_> {
        PointsRead {
            points: self.points(),
            curve: &self.curve,
            smoothing: self.smoothing(),
            digits: self.measured.digits,
            rounding: self.measured.rounding,
        }
    }

    /// Median distance between neighbouring points in mm.
    pub fn usual_chord(&self) -> f64 {
        let mut chords: Vec<f64> = self.chords().collect();
        profile_quality::median(&mut chords)
    }

    /// Largest distance between neighbouring points in mm.
    pub fn longest_chord(&self) -> f64 {
        self.chords().fold(0.0, f64::max)
    }

    fn chords(&self) -> impl Iterator<Item = f64> {
        self.measured.along.windows(2).map(|pair| pair[1] - pair[0])
    }

    /// Cut wavelength of the smoothing in mm; 0 for none.
    pub fn smoothing(&self) -> f64 {
        self.measured.smoothing
    }

    /// The step in mm of which the coordinates were given as multiples, if it is 0.001 mm or more.
    pub fn rounding(&self) -> Option<f64> {
        self.measured.rounding
    }

    /// The curve, y to the field side, z up.
    pub fn curve(&self) -> &PlaneCurve {
        &self.curve
    }

    /// First and last parameter, in mm along the chords of the points.
    pub fn range(&self) -> [f64; 2] {
        self.curve.range()
    }

    /// The curve at a parameter; beyond the ends the tangent there.
    pub fn at(&self, s: f64) -> CurvePoint {
        self.curve.at(s)
    }

    /// Parameters at most `step` apart over the whole curve, ends included.
    pub fn parameters(&self, step: f64) -> Vec<f64> {
        self.curve.parameters(step)
    }
}

fn checked(points: &[[f64; 2]]) -> Result<Vec<[f64; 2]>, String> {
    if !(POINTS_MIN..=POINTS_MAX).contains(&points.len()) {
        return Err(format!(
            "{} points given; {POINTS_MIN} to {POINTS_MAX} are allowed",
            points.len()
        ));
    }
    match points
        .iter()
        .position(|point| !point.iter().all(|part| part.is_finite()))
    {
        Some(k) => Err(format!("point {k} is not finite")),
        None => Ok(points.to_vec()),
    }
}

fn distance(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

fn arc_length(points: &[[f64; 2]]) -> f64 {
    points
        .windows(2)
        .map(|pair| distance(pair[0], pair[1]))
        .sum()
}

/// Brings the points to y toward the field side, z up, and increasing y from the first to the last. Returns the senses and the flange of a
/// wheel.
fn orient(
    body: Body,
    points: &mut Vec<[f64; 2]>,
    reading: Reading,
    format: FormatSenses,
    remarks: &mut Vec<Remark>,
) -> Result<(Senses, Option<Flange>), String> {
    let stated = StatedSenses {
        mirror_y: reading.mirror_y,
        mirror_z: reading.mirror_z,
    };
    let [first, last] =
        profile_quality::stray_ends(points).map(|stray| stray.map_or(0, |(count, _)| count));
    // A section in another unit than stated shows its senses all the same.
    let scale = likely_unit(body, points).map_or(1.0, |(_, unit)| unit.mm());
    let shown: Vec<[f64; 2]> = points[first..points.len() - last]
        .iter()
        .map(|point| point.map(|part| scale * part))
        .collect();
    let FoundSenses {
        senses,
        contradicted,
    } = match body {
        Body::Rail => orientation::orient_rail(&shown, stated, format.fixed)?,
        Body::Wheel => orientation::orient_wheel(&shown, stated, format.fixed)?,
    };
    let profile = body.name();
    if stated.mirror_z.is_none() && senses.mirror_z != format.usual.mirror_z {
        remarks.push(Remark::ProfileZMirrored { profile });
    }
    if body == Body::Wheel && stated.mirror_y.is_none() && senses.mirror_y != format.usual.mirror_y
    {
        let flange = if senses.mirror_y {
            "positive"
        } else {
            "negative"
        };
        remarks.push(Remark::ProfileYMirrored { profile, flange });
    }
    let given = [("mirror_y", senses.mirror_y), ("mirror_z", senses.mirror_z)];
    let refuted = given.into_iter().zip(contradicted);
    remarks.extend(refuted.filter(|(_, contradicted)| *contradicted).map(
        |((member, given), _)| Remark::ProfileSenseContradicted {
            profile,
            member,
            given: if given { "true" } else { "false" },
        },
    ));
    let flange = match body {
        Body::Rail => None,
        Body::Wheel if scale == 1.0 => orientation::flange(&orientation::in_senses(&shown, senses)),
        Body::Wheel => None,
    };
    *points = orientation::in_senses(points, senses);
    Ok((senses, flange))
}

/// The width of a section, and the unit in which it would be that of a usual rail head or wheel, if that is not mm.
fn likely_unit(body: Body, points: &[[f64; 2]]) -> Option<(f64, LengthUnit)> {
    let usual = match body {
        // The head of a usual rail (60E1), and a usual wheel (EN 13715).
        Body::Rail => 72.0,
        Body::Wheel => 135.0,
    };
    let y = || points.iter().map(|point| point[0]);
    let width = y().fold(f64::NEG_INFINITY, f64::max) - y().fold(f64::INFINITY, f64::min);
    let unit = LengthUnit::likely(width, usual)?;
    (unit != LengthUnit::Mm).then_some((width, unit))
}

/// Drops points that run back between their neighbours, as they occur where measurements were stitched.
fn straighten(
    body: Body,
    points: &mut Vec<[f64; 2]>,
    remarks: &mut Vec<Remark>,
) -> Result<(), String> {
    let given = points.len();
    let allowed = (ZIGZAG_SHARE_MAX * given as f64).ceil() as usize;
    loop {
        let back = points.windows(3).position(|at| {
            let (first, second) = (step(at[0], at[1]), step(at[1], at[2]));
            let lengths = first[0].hypot(first[1]) * second[0].hypot(second[1]);
            first[0] * second[0] + first[1] * second[1] < FLANGE_BACK_TURN * lengths
        });
        let Some(k) = back else { break };
        points.remove(k + 1);
        if given - points.len() > allowed {
            return Err(format!(
                "more than {allowed} of {given} points run back against their neighbours; are they in order along the profile?"
            ));
        }
    }
    if points.len() < given {
        remarks.push(Remark::ProfilePointsDropped {
            profile: body.name(),
            count: given - points.len(),
        });
    }
    Ok(())
}

/// Drops one or two points at an end that a long chord separates from all others, as they occur in measurements.
fn cut_stray_ends(body: Body, points: &mut Vec<[f64; 2]>, remarks: &mut Vec<Remark>) {
    let [first, last] = profile_quality::stray_ends(points);
    let stray = |end: Option<(usize, f64)>| end.map_or(0, |(count, _)| count);
    points.truncate(points.len() - stray(last));
    points.drain(..stray(first));
    let dropped = |(count, distance_mm)| Remark::ProfileEndDropped {
        profile: body.name(),
        count,
        distance_mm,
    };
    remarks.extend([last, first].into_iter().flatten().map(dropped));
}

/// Lengths of the chords up to each point.
fn lengths(points: &[[f64; 2]]) -> Result<Vec<f64>, String> {
    if let Some([first, second]) = plane_curve::first(points) {
        return Err(format!(
            "the profile runs through itself near [{:.3}, {:.3}] and [{:.3}, {:.3}]; loops are refused",
            first[0], -first[1], second[0], -second[1]
        ));
    }
    if let Some([y, z]) = visited_again(points) {
        return Err(format!(
            "the profile passes the point [{y:.3}, {:.3}] twice; are its points given twice? loops are refused",
            -z
        ));
    }
    let mut along = vec![0.0];
    for pair in points.windows(2) {
        along.push(along[along.len() - 1] + distance(pair[0], pair[1]));
    }
    Ok(along)
}

/// A point that the profile comes back to. An outline may end where it begins.
fn visited_again(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    let by_place = |a: &[f64; 2], b: &[f64; 2]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
    order.sort_by(|a, b| by_place(&points[*a], &points[*b]).then(a.cmp(b)));
    let again = order.windows(2).find(|pair| {
        let ends = [0, points.len() - 1];
        points[pair[0]] == points[pair[1]] && pair[..] != ends
    });
    again.map(|pair| points[pair[0]])
}

fn step(from: [f64; 2], to: [f64; 2]) -> [f64; 2] {
    [to[0] - from[0], to[1] - from[1]]
}

/// A unit of length of cross-sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema, Words, Named)]
#[serde(rename_all = "snake_case")]
pub enum LengthUnit {
    /// Millimetre.
    Mm,
    /// Centimetre.
    Cm,
    /// Metre.
    M,
    /// Inch, 25.4 mm.
    Inch,
}

/// All units, with their length in mm.
const UNITS: [(LengthUnit, f64); 4] = [
    (LengthUnit::Mm, 1.0),
    (LengthUnit::Cm, 10.0),
    (LengthUnit::M, 1000.0),
    (LengthUnit::Inch, 25.4),
];

impl LengthUnit {
    /// Its length in mm.
    pub fn mm(self) -> f64 {
        UNITS[self as usize].1
    }

    /// The unit that a word of a file names, in any case and possibly in brackets or quotes.
    pub fn named(word: &str) -> Option<LengthUnit> {
        let word = word
            .trim_matches(|c: char| !c.is_alphanumeric() && c != '"')
            .to_ascii_lowercase();
        match word.as_str() {
            "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => {
                Some(LengthUnit::Mm)
            }
            "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => {
                Some(LengthUnit::Cm)
            }
            "m" | "meter" | "meters" | "metre" | "metres" => Some(LengthUnit::M),
            "in" | "\"" | "inch" | "inches" => Some(LengthUnit::Inch),
            _ => None,
        }
    }

    /// The unit in which `width` is nearest to a usual width in mm; none if it is far from that in every unit.
    pub fn likely(width: f64, usual: f64) -> Option<LengthUnit> {
        // Half of the smallest ratio of two units, cm and inch, so that at most one unit fits.
        let nearest = 25.4_f64.ln() - 10.0_f64.ln();
        UNITS
            .iter()
            .find(|(_, mm)| (width * mm / usual).ln().abs() < 0.5 * nearest)
            .map(|(unit, _)| *unit)
    }
}

#[cfg(test)]
mod length_unit_tests {
    use super::*;

    #[test]
    fn a_width_has_at_most_one_likely_unit() {
        for (width, usual, unit) in [
            (0.072, 72.0, Some(LengthUnit::M)),
            (7.0, 72.0, Some(LengthUnit::Cm)),
            (2.9, 72.0, Some(LengthUnit::Inch)),
            (5.3, 135.0, Some(LengthUnit::Inch)),
            (13.5, 135.0, Some(LengthUnit::Cm)),
            (60.0, 72.0, Some(LengthUnit::Mm)),
            (400.0, 72.0, None),
        ] {
            assert_eq!(LengthUnit::likely(width, usual), unit, "{width}");
        }
    }

    #[test]
    fn words_of_files_name_units() {
        for (word, unit) in [
            ("[mm]", Some(LengthUnit::Mm)),
            ("'M'", Some(LengthUnit::M)),
            ("Inches", Some(LengthUnit::Inch)),
            ("(cm)", Some(LengthUnit::Cm)),
            ("km", None),
            ("", None),
        ] {
            assert_eq!(LengthUnit::named(word), unit, "{word}");
        }
    }
}
