//! Cross-sections of a rail or a wheel: checked points, the smooth curve through them, and units of length.
//!
//! Input follows the convention of the field: mm, y positive to the field side, z positive down. From here on z is positive
//! up. The curve runs from the track centre to the field side, with the rail below and the wheel above it.

use std::ops::Range;
use std::sync::Arc;

use railhead_macros::{Named, Words, keyword};

use crate::geometry::orientation::{
    self, Flange, FormatSenses, FoundSenses, Senses, StatedSenses, SureBody,
};
use crate::geometry::plane_curve::{
    CurvePoint, PlaneCurve, arc_lengths, chords, crossing, distance,
};
use crate::geometry::profile_quality::{self, Points, PointsRead};
use crate::lazy_field::LazyField;
use crate::numerics::roots::bounds;
use crate::remark::kind::short;
use crate::remark::list::Remark;

/// Allowed range of the arc length of a profile in mm. Other lengths suggest another unit.
pub const ARC_LENGTH: [f64; 2] = [10.0, 500.0];
/// Fewest points of a profile.
pub const POINTS_MIN: usize = 8;
/// Most points of a profile.
pub const POINTS_MAX: usize = 20_000;
/// Spacing in mm of the points of a section that is drawn or wears: a twentieth of a narrow patch, and usual for measured gauge corners.
pub(crate) const POINT_SPACING: f64 = 0.25;
/// Length in mm of the profile needed beyond a contact. With less there is a remark.
pub(crate) const NEEDED_BEYOND: f64 = 5.0;
/// Depth in mm of the groove next to a guard rail below the points at its sides: twice the height of a flange.
pub(crate) const GROOVE_DEPTH: f64 = 60.0;
/// Least step in mm of heights that counts as rounding. Finer steps are below the noise of all instruments.
const ROUNDING_MIN: f64 = 1e-3;
/// Distance in mm below which two points are merged.
pub(crate) const NEAR: f64 = 1e-3;
/// Cosine of the turn from which a point runs backwards (102°). No corner of a measured profile turns as much, while points at a joint of two
/// measurements turn by up to 180°. Chosen by judgement; its influence was not measured.
const BACKWARD_COSINE: f64 = -0.2;
/// Largest share of points that run backwards at joints. With more, the points are out of order. Chosen by judgement; its influence was not
/// measured.
const BACKWARD_SHARE_MAX: f64 = 0.05;

/// The body to which a profile belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Named)]
pub enum Body {
    /// The lower body.
    Rail,
    /// The upper body.
    Wheel,
}

/// Options for reading the points of a profile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reading {
    /// Whether y of the points is positive to the track centre. If absent, the flange of a wheel decides.
    pub mirror_y: Option<bool>,
    /// Whether z of the points is positive up. If absent, the shape decides.
    pub mirror_z: Option<bool>,
    /// Cut wavelength of the smoothing in mm; 0 for none.
    pub smoothing: f64,
}

/// A cross-section as a curve, twice continuously differentiable in its chord length except at sharp corners.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    curve: PlaneCurve,
    measured: Arc<MeasuredCurve>,
    /// Remarks on the points, including those that were merged or dropped.
    pub remarks: Vec<Remark>,
}

/// The points of a curve.
#[derive(Debug, Clone, PartialEq)]
struct MeasuredCurve {
    /// The points with z up, in order from the track centre to the field side.
    points: Vec<[f64; 2]>,
    /// Length of the chords up to each point, which is the knot of the splines.
    along: Vec<f64>,
    /// Cut wavelength of the smoothing in mm.
    smoothing: f64,
    /// Steps in mm of which all given y and all given z are multiples.
    steps: [f64; 2],
    /// The directions of the given points.
    senses: Senses,
    /// Number of points of the guard rail and the groove, which precede those of the running rail.
    beside: usize,
    flange: Option<Flange>,
    sure_body: LazyField<Option<SureBody>>,
}

impl Profile {
    /// Makes the curve through points `[y, z]` in mm, in either order.
    ///
    /// Points nearer than 1 µm are merged, and single points that run backwards are dropped. Both leave a remark.
    ///
    /// # Errors
    /// Returns a sentence if there are too few or too many points, numbers that are not finite, an arc length outside 10 to 500 mm, loops, more
    /// than 5 % of the points running backwards, or directions that are neither stated nor shown by the shape.
    pub fn new(body: Body, points: &[[f64; 2]], reading: Reading) -> Result<Profile, String> {
        Profile::in_format(body, points, reading, FormatSenses::default())
    }

    /// Makes the curve through points of a format that specifies their directions.
    ///
    /// # Errors
    /// Returns the same errors as [`Profile::new`].
    pub fn in_format(
        body: Body,
        points: &[[f64; 2]],
        reading: Reading,
        format: FormatSenses,
    ) -> Result<Profile, String> {
        let mut remarks = Vec::new();
        let given = without_stray_ends(body, checked(points)?, &mut remarks);
        let likely = likely_unit(body, given);
        check_length(given).map_err(|reason| match likely {
            Some((width, unit)) => {
                let unit = unit.name();
                format!(
                    "{reason} (the section is {width:.4} mm wide; if its numbers are in {unit} and not in mm, state unit: \"{unit}\")"
                )
            }
            None => format!(
                "{reason} (is another unit than mm used, are the points not in order, or is the foot of the rail included?)"
            ),
        })?;
        remarks.extend(likely.map(|(width_mm, unit)| Remark::ProfileSizeUnusual {
            profile: body.name(),
            width_mm,
            unit: unit.name(),
        }));
        let scale = likely.map_or(1.0, |(_, unit)| unit.mm());
        // Spikes hide the shape. Points that are not in order are refused below.
        let mut without_spikes = given.to_vec();
        let dropped = drop_backward_points(body, &mut without_spikes, &mut Vec::new());
        let shown = dropped.map_or(given, |()| &without_spikes);
        let (senses, flange) = orient(body, shown, scale, reading, format, &mut remarks)?;
        let mut points = orientation::in_senses(given, senses);
        check_order(&points)?;
        drop_backward_points(body, &mut points, &mut remarks)?;
        let before = points.len();
        points.dedup_by(|after, before| distance(*after, *before) < NEAR);
        if points.len() < before {
            remarks.push(Remark::ProfilePointsMerged {
                profile: body.name(),
                count: before - points.len(),
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
            steps: [0, 1].map(|part| profile_quality::decimal_step(given, part)),
            senses,
            beside: 0,
            flange,
            sure_body: LazyField::default(),
        };
        Ok(Profile::of(measured, remarks))
    }

    /// Adds a guard rail on the side of the track centre, whose points are given in the directions of those of the rail. A groove joins the
    /// two, so deep that no wheel reaches its bottom.
    ///
    /// # Errors
    /// Returns a sentence if a number is not finite, the arc length is outside 10 to 500 mm, the points form a loop, or the guard rail is not
    /// next to the rail.
    pub fn with_guard_rail(&self, points: &[[f64; 2]]) -> Result<Profile, String> {
        let own = &self.measured;
        check_length(checked(points)?)?;
        let mut joined = orientation::in_senses(points, own.senses);
        joined.dedup_by(|after, before| distance(*after, *before) < NEAR);
        let [end, _] = self.width();
        let [_, reach] = bounds(joined.iter().map(|at| at[0]));
        if reach >= end {
            return Err(format!(
                "the guard rail reaches y = {reach:.2} mm (positive to the field side), and the running rail begins at {end:.2} mm; a \
                 guard rail lies beside the running rail, on the side of the track centre"
            ));
        }
        let [from, to] = [joined[joined.len() - 1], own.points[0]];
        let bottom = from[1].min(to[1]) - GROOVE_DEPTH;
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

    /// Makes the curve of the same points with another smoothing. Its cut wavelength is in mm; 0 for none.
    #[must_use]
    pub fn smoothed(&self, smoothing: f64) -> Profile {
        let measured = MeasuredCurve {
            smoothing,
            ..(*self.measured).clone()
        };
        Profile::of(measured, self.remarks.clone())
    }

    /// The body whose shape the points have, if it cannot be confused with that of the other body.
    pub(crate) fn sure_body(&self) -> Option<SureBody> {
        let points = &self.measured.points[self.measured.beside..];
        *self
            .measured
            .sure_body
            .get_or_make(|| orientation::sure_body(points, true))
    }

    /// The flange of a wheel, if the points show one on the side of the track centre.
    pub(crate) fn flange(&self) -> Option<Flange> {
        self.measured.flange
    }

    /// The parameter at which the running rail begins after the guard rail and the groove; 0 without a guard rail.
    pub(crate) fn first(&self) -> f64 {
        self.measured.along[self.measured.beside]
    }

    /// The indices of the chords of the groove between a guard rail and its running rail; empty without a guard rail.
    pub(crate) fn groove(&self) -> Range<usize> {
        self.measured.beside.saturating_sub(3)..self.measured.beside
    }

    /// Least and largest y in mm of the points, without those of a guard rail.
    pub(crate) fn width(&self) -> [f64; 2] {
        let points = &self.measured.points[self.measured.beside..];
        bounds(points.iter().map(|at| at[0]))
    }

    /// The least z in mm at which the chords of the points pass `y`, with z up.
    pub(crate) fn lowest_at(&self, y: f64) -> Option<f64> {
        let passing = self.measured.points.windows(2).filter_map(|ends| {
            let [[y0, z0], [y1, z1]] = [ends[0], ends[1]];
            let part = (y - y0) / (y1 - y0);
            (0.0..=1.0).contains(&part).then_some(z0 + part * (z1 - z0))
        });
        passing.reduce(f64::min)
    }

    /// The points of the curve with z up, in order of the parameter.
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
            digits: self.measured.steps[0].max(self.measured.steps[1]),
            rounding: self.rounding(),
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

    /// The step in mm of which all given heights are multiples, if it is at least 0.001 mm.
    pub fn rounding(&self) -> Option<f64> {
        let [_, step] = self.measured.steps;
        (step >= ROUNDING_MIN).then_some(step)
    }

    /// The curve, with y to the field side and z up.
    pub fn curve(&self) -> &PlaneCurve {
        &self.curve
    }

    /// First and last parameter, in mm along the chords of the points.
    pub fn range(&self) -> [f64; 2] {
        self.curve.range()
    }

    /// The curve at a parameter. Beyond its ends the curve continues along the tangent.
    pub fn at(&self, s: f64) -> CurvePoint {
        self.curve.at(s)
    }

    /// Parameters at most `step` apart over the whole curve, ends included.
    pub fn parameters(&self, step: f64) -> Vec<f64> {
        self.curve.parameters(step)
    }
}

/// Returns the points if their number is allowed and all are finite.
fn checked(points: &[[f64; 2]]) -> Result<&[[f64; 2]], String> {
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
        None => Ok(points),
    }
}

/// Refuses points whose arc length is not allowed.
fn check_length(points: &[[f64; 2]]) -> Result<(), String> {
    let length: f64 = chords(points).sum();
    let [shortest, longest] = ARC_LENGTH;
    if (shortest..=longest).contains(&length) {
        return Ok(());
    }
    let steps = points.windows(2);
    let far = steps.max_by(|a, b| distance(a[0], a[1]).total_cmp(&distance(b[0], b[1])));
    let far = far.map_or(String::new(), |step| {
        let [from, to] =
            [step[0], step[1]].map(|at| format!("({}, {})", short(at[0]), short(at[1])));
        format!("; the longest step is from {from} to {to}")
    });
    Err(format!(
        "the arc length of the points is {} mm; {shortest} to {longest} mm are allowed{far}",
        short(length)
    ))
}

/// Finds the directions of the points and the flange of a wheel. The numbers are lengths in `scale` mm: a section in another unit than stated
/// shows its directions all the same.
fn orient(
    body: Body,
    points: &[[f64; 2]],
    scale: f64,
    reading: Reading,
    format: FormatSenses,
    remarks: &mut Vec<Remark>,
) -> Result<(Senses, Option<Flange>), String> {
    let stated = StatedSenses {
        mirror_y: reading.mirror_y,
        mirror_z: reading.mirror_z,
    };
    let scaled = points.iter().map(|point| point.map(|part| scale * part));
    let shown: Vec<[f64; 2]> = scaled.collect();
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
    Ok((senses, flange))
}

/// The width of a section, and the unit in which it would be the width of a usual rail head or wheel, if that is not mm.
fn likely_unit(body: Body, points: &[[f64; 2]]) -> Option<(f64, LengthUnit)> {
    let usual = match body {
        // The head of a usual rail (60E1), and a usual wheel (EN 13715).
        Body::Rail => 72.0,
        Body::Wheel => 135.0,
    };
    let [least, largest] = bounds(points.iter().map(|point| point[0]));
    let width = largest - least;
    let unit = LengthUnit::likely(width, usual)?;
    (unit != LengthUnit::Mm).then_some((width, unit))
}

/// Drops points that run backwards between their neighbours, as they occur where measurements were joined.
fn drop_backward_points(
    body: Body,
    points: &mut Vec<[f64; 2]>,
    remarks: &mut Vec<Remark>,
) -> Result<(), String> {
    let given = points.len();
    let allowed = (BACKWARD_SHARE_MAX * given as f64).ceil() as usize;
    let is_back = |at: [[f64; 2]; 3]| {
        let [first, second] = [0, 1].map(|k| [at[k + 1][0] - at[k][0], at[k + 1][1] - at[k][1]]);
        let lengths = first[0].hypot(first[1]) * second[0].hypot(second[1]);
        first[0] * second[0] + first[1] * second[1] < BACKWARD_COSINE * lengths
    };
    loop {
        let back = points
            .windows(3)
            .position(|at| is_back([at[0], at[1], at[2]]));
        let Some(k) = back else { break };
        // A point that lies behind the one before it is the stray one if the next point goes on.
        let stray = match points[k..] {
            [a, b, c, d, ..] if is_back([a, c, d]) && !is_back([a, b, d]) => k + 2,
            _ => k + 1,
        };
        points.remove(stray);
        if given - points.len() > allowed {
            return Err(format!(
                "more than {allowed} of {given} points run back against their neighbours; are they in order along the profile, or is their noise larger than a third of their distance? Then thin them out or average them"
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

/// Drops one or two points at an end that a long chord separates from the others, as they occur in measurements and in closed outlines.
fn without_stray_ends<'p>(
    body: Body,
    points: &'p [[f64; 2]],
    remarks: &mut Vec<Remark>,
) -> &'p [[f64; 2]] {
    let stray = profile_quality::stray_ends(points);
    let dropped = |(count, distance_mm)| Remark::ProfileEndDropped {
        profile: body.name(),
        count,
        distance_mm,
    };
    remarks.extend(stray.into_iter().flatten().map(dropped));
    let [first, last] = stray.map(|end| end.map_or(0, |(count, _)| count));
    &points[first..points.len() - last]
}

/// Refuses a chord that passes most of the points, as between two halves of a section in the wrong order.
fn check_order(points: &[[f64; 2]]) -> Result<(), String> {
    let long = profile_quality::long_chord(points);
    let passes_most = |ends: &&[[f64; 2]]| {
        let [least, largest] = bounds(ends.iter().map(|point| point[0]));
        let passed = points.iter().filter(|[y, _]| *y > least && *y < largest);
        distance(ends[0], ends[1]) > long && 2 * passed.count() > points.len()
    };
    points.windows(2).find(passes_most).map_or(Ok(()), |ends| {
        let [[y0, z0], [y1, z1]] = [ends[0], ends[1]];
        Err(format!(
            "the profile jumps over most of its points, from [{y0:.3}, {:.3}] to [{y1:.3}, {:.3}]; are its parts in the wrong order, or given twice?",
            -z0, -z1
        ))
    })
}

/// Length of the chords up to each point.
///
/// # Errors
/// Returns a sentence if the points form a loop.
fn lengths(points: &[[f64; 2]]) -> Result<Vec<f64>, String> {
    if let Some([first, second]) = crossing(points) {
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
    Ok(arc_lengths(points))
}

/// A point through which the profile passes twice. An outline may end where it begins.
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

/// A unit of length of cross-sections.
#[keyword(Words, Named)]
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
    /// The length of the unit in mm.
    pub fn mm(self) -> f64 {
        UNITS[self as usize].1
    }

    /// Parses the name of a unit in a file, in any case, with or without brackets or quotes.
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

    /// The unit in which `width` is nearest to a usual width in mm. Returns `None` if it is far from that in every unit.
    pub fn likely(width: f64, usual: f64) -> Option<LengthUnit> {
        // Half of the smallest ratio of two units, those of inch and cm, so that at most one unit fits.
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
