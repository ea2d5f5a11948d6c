//! Recognises the directions of y and z of the points of a cross-section, the flange of a wheel and its back, and the head of a rail.
//!
//! A section is compared in all four combinations of directions with the shape of its body. A wheel has a flange: a lobe of 12 to 45 mm height
//! on one side of its tread. A rail has a head: a convex crown whose sides fall off. Extreme values are not used, because the face of a rim,
//! the back of a flange, a groove or a foot may reach farther than flange or head.

use std::f64::consts::FRAC_PI_2;

use crate::geometry::plane_curve::distance;
use crate::numerics::roots::bounds;

/// The directions of the axes of the points of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Senses {
    /// y is positive to the track centre.
    pub mirror_y: bool,
    /// z is positive up.
    pub mirror_z: bool,
}

impl Senses {
    const fn new(mirror_y: bool, mirror_z: bool) -> Senses {
        Senses { mirror_y, mirror_z }
    }
}

/// Directions as far as they are stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StatedSenses {
    /// Whether y is positive to the track centre.
    pub mirror_y: Option<bool>,
    /// Whether z is positive up.
    pub mirror_z: Option<bool>,
}

/// The directions that the format of the points specifies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FormatSenses {
    /// The usual directions of the format. There is a remark if they are others.
    pub usual: Senses,
    /// The directions to use if the shape does not show them.
    pub fixed: StatedSenses,
}

/// The directions found for a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FoundSenses {
    pub(crate) senses: Senses,
    /// Whether the stated directions of y and of z contradict the shape.
    pub(crate) contradicted: [bool; 2],
}

/// Finds the directions of the points of a wheel.
///
/// # Errors
/// Returns a sentence that names the members to state if neither the shape nor a statement shows the directions.
pub(crate) fn orient_wheel(
    points: &[[f64; 2]],
    stated: StatedSenses,
    fixed: StatedSenses,
) -> Result<FoundSenses, String> {
    let (mut found, whole) = wheel_senses(points);
    let agree = |senses: &Senses, with: StatedSenses| {
        with.mirror_y.is_none_or(|y| y == senses.mirror_y)
            && with.mirror_z.is_none_or(|z| z == senses.mirror_z)
    };
    let agreeing = |with: StatedSenses, among: &[Senses]| -> Vec<Senses> {
        among.iter().copied().filter(|s| agree(s, with)).collect()
    };
    // Only a whole flange can contradict a format.
    if !whole && agreeing(fixed, &found).is_empty() {
        found.clear();
    }
    let mut left = agreeing(stated, &found);
    if left.len() > 1 {
        left = agreeing(fixed, &left);
    }
    if let [senses] = left[..] {
        return Ok(FoundSenses {
            senses,
            contradicted: [false; 2],
        });
    }
    if let Some(shown) = found.first().filter(|_| left.is_empty()) {
        let senses = Senses {
            mirror_y: stated.mirror_y.unwrap_or(shown.mirror_y),
            mirror_z: stated.mirror_z.unwrap_or(shown.mirror_z),
        };
        return Ok(FoundSenses {
            senses,
            contradicted: [
                senses.mirror_y != shown.mirror_y,
                senses.mirror_z != shown.mirror_z,
            ],
        });
    }
    let y = stated.mirror_y.or(fixed.mirror_y);
    let z = stated.mirror_z.or(fixed.mirror_z);
    match (y, z) {
        (Some(mirror_y), Some(mirror_z)) => Ok(FoundSenses {
            senses: Senses { mirror_y, mirror_z },
            contradicted: [false; 2],
        }),
        _ => Err(wheel_unclear(points, !found.is_empty(), y, z)),
    }
}

fn wheel_unclear(points: &[[f64; 2]], several: bool, y: Option<bool>, z: Option<bool>) -> String {
    let reason = if sure_body(points, false) == Some(SureBody::Rail) {
        "the points look like the head of a rail (were rail and wheel exchanged?)"
    } else if several {
        "the shape has a flange for more than one direction of y and z"
    } else {
        "no flange beside a tread was found, so the shape does not show the directions of y and z"
    };
    let members = match (y, z) {
        (None, None) => {
            "mirror_y (true: y is positive to the track centre) and mirror_z (true: z is positive up)"
        }
        (None, Some(_)) => "mirror_y (true: y is positive to the track centre)",
        _ => "mirror_z (true: z is positive up)",
    };
    format!("{reason}; state {members}")
}

/// Finds the directions of the points of a rail. The direction of y is never found from the shape, because most heads are nearly symmetric.
///
/// # Errors
/// Returns a sentence that names the member to state if neither the shape nor a statement shows the direction of z.
pub(crate) fn orient_rail(
    points: &[[f64; 2]],
    stated: StatedSenses,
    fixed: StatedSenses,
) -> Result<FoundSenses, String> {
    let sure = sure_rail_mirror_z(points);
    let shown = match fixed.mirror_z {
        // Grooves and other sections of test rigs do not contradict a format.
        Some(usual) => Some(sure.unwrap_or(usual)),
        None => rail_mirror_z(points),
    };
    let mirror_z = stated.mirror_z.or(shown).ok_or_else(|| {
        let reason = if sure_body(points, false) == Some(SureBody::Wheel) {
            "the points look like a wheel with its flange (were rail and wheel exchanged?)"
        } else {
            "no head of a rail was found, so the shape does not show whether z is positive up or down"
        };
        format!("{reason}; state mirror_z (true: z is positive up)")
    })?;
    let mirror_y = stated.mirror_y.or(fixed.mirror_y).unwrap_or(false);
    Ok(FoundSenses {
        senses: Senses { mirror_y, mirror_z },
        contradicted: [false, sure.is_some_and(|sure| sure != mirror_z)],
    })
}

/// All combinations of directions, the documented one first.
const ALL: [Senses; 4] = [
    Senses::new(false, false),
    Senses::new(true, false),
    Senses::new(false, true),
    Senses::new(true, true),
];

/// Spacing in mm at which a section is sampled along its length.
const STEP: f64 = 0.5;
/// Number of samples on either side from which the inclination at a sample is taken. They span 3 mm, so that noise of 50 µm changes it by 1°.
const SIDE: usize = 3;
/// Largest inclination in rad of treads and crowns (20°). Standard wheels stay below 0.2 up to the flange root, and flanges exceed 1.
const FLAT: f64 = 0.35;
/// Least inclination in rad of the face of a rim and of the faces of a head (79°). Flange faces have 60 to 78°.
const STEEP: f64 = 1.38;
/// Height in mm of the piece that is taken as the tip of a flange.
const TIP_DEPTH: f64 = 2.0;
/// Range of the width in mm of the tip. Flanges of EN 13715 and AAR have 12 to 18 mm; the edge of a rim has less than 1 mm. The back of the
/// flange is no farther from the tip than the upper bound. It is 15 mm in EN 13715, while a groove next to a second rail continues farther.
const TIP_WIDTH: [f64; 2] = [4.0, 25.0];
/// Range of the height in mm of a flange above its tread. Trams have 18 mm, worn wheels up to 40 mm; points that end before the tip show
/// less.
const FLANGE_HEIGHT: [f64; 2] = [12.0, 45.0];
/// Least length in mm of a tread, and of the crown of a head. The nose of a crossing has 15 mm where wheels reach it. With twice this length it can only be a rail.
const CROWN: f64 = 15.0;
/// Least fall in mm at one side of a head, least rise behind a groove, and least length of the steep part of a face.
const FALL: f64 = 6.0;
/// Least fall in mm at the other side of a head. Within one descent, lips and steps of worn profiles may rise by this much.
const FALL_LEAST: f64 = 1.0;
/// Largest inclination in rad of a crown toward a cut end, and of the back of a flange from the vertical (6°). Rails are canted by up to 0.05,
/// and feet of rails slope by 0.25. Of a rounding of 20.5 mm, 2 mm lie within this angle.
const CUT_SLOPE: f64 = 0.1;
/// Least turn in rad of a crown that is measured without its sides. 35 mm with a radius of 300 mm turn by 0.12.
const CROWN_TURN: f64 = 0.05;
/// Least length in mm of the back of a flange, and distance between the three points from which the rounding of a back is continued, by half of
/// this at most.
const BACK: f64 = 3.0;

/// The flange of a wheel, in the directions in which it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flange {
    /// Least and largest y of the tip; `None` if the points end before the tip.
    pub tip: Option<[f64; 2]>,
    /// y of the back, if the back or at least its rounding was measured.
    pub back: Option<f64>,
    /// y of the last point on the side of the flange.
    pub end: f64,
}

/// A body whose shape cannot be confused with that of the other body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SureBody {
    /// A head of a rail with both faces.
    Rail,
    /// A wheel with its whole flange.
    Wheel,
}

/// Returns points given in the directions `senses` with y to the field side and z up, in order from the track centre to the field side.
pub fn in_senses(points: &[[f64; 2]], senses: Senses) -> Vec<[f64; 2]> {
    let y_sign = if senses.mirror_y { -1.0 } else { 1.0 };
    let z_sign = if senses.mirror_z { 1.0 } else { -1.0 };
    let mut turned: Vec<[f64; 2]> = points
        .iter()
        .map(|[y, z]| [y_sign * y, z_sign * z])
        .collect();
    if let [first, .., last] = turned[..]
        && first[0] > last[0]
    {
        turned.reverse();
    }
    turned
}

/// The directions in which the points of a wheel show a flange, and whether the flange is whole. Parts of a flange count only if there is no
/// whole one.
fn wheel_senses(points: &[[f64; 2]]) -> (Vec<Senses>, bool) {
    let found = ALL.map(|senses| flange(&in_senses(points, senses)).map(|flange| (senses, flange)));
    let found: Vec<(Senses, Flange)> = found.into_iter().flatten().collect();
    let whole = found.iter().any(|(_, flange)| flange.tip.is_some());
    let counted = found
        .into_iter()
        .filter(|(_, flange)| flange.tip.is_some() || !whole);
    (counted.map(|(senses, _)| senses).collect(), whole)
}

/// The heads of rails in points given in the directions `senses`.
fn heads(points: &[[f64; 2]], senses: Senses) -> Vec<Head> {
    Section::new(&in_senses(points, senses)).heads()
}

/// Returns whether z of the points of a rail is positive up, or `None` if the shape does not show it.
pub fn rail_mirror_z(points: &[[f64; 2]]) -> Option<bool> {
    let crowns = |mirror_z: bool| -> f64 {
        let heads = heads(points, Senses::new(false, mirror_z));
        heads.iter().map(|head| head.crown).sum()
    };
    let [down, up] = [false, true].map(crowns);
    // The crowns in one direction must be more than twice as long as those in the other.
    (up > 2.0 * down || down > 2.0 * up).then_some(up > down)
}

/// Returns whether z of points is positive up, if they can only be those of a rail with at least one of its faces.
fn sure_rail_mirror_z(points: &[[f64; 2]]) -> Option<bool> {
    let mirror_z = rail_mirror_z(points)?;
    let sure = |head: &Head| head.is_long() && head.falls.iter().flatten().any(Fall::is_face);
    let heads = heads(points, Senses::new(false, mirror_z));
    heads.iter().any(sure).then_some(mirror_z)
}

/// The body whose shape the points have; `None` if the other body may have this shape. A flange is looked for in all directions. A head is
/// looked for with z up only if `z_up` is true, because the rim of a wheel is like a head upside down.
pub fn sure_body(points: &[[f64; 2]], z_up: bool) -> Option<SureBody> {
    let is_head = |senses: &&Senses| senses.mirror_z || !z_up;
    let head = |senses: &Senses| heads(points, *senses).iter().any(Head::has_both_faces);
    let whole =
        |senses: &Senses| flange(&in_senses(points, *senses)).is_some_and(|f| f.tip.is_some());
    let is_rail = ALL.iter().filter(is_head).any(head);
    match (is_rail, ALL.iter().any(whole)) {
        (true, false) => Some(SureBody::Rail),
        (false, true) => Some(SureBody::Wheel),
        _ => None,
    }
}

/// The flange of a wheel whose points are in order from the track centre to the field side, with z up.
pub fn flange(points: &[[f64; 2]]) -> Option<Flange> {
    let section = Section::new(points);
    let mut treads = section.flat_runs(CROWN);
    treads.sort_by_key(|[first, last]| first.abs_diff(*last));
    treads.iter().rev().find_map(|tread| section.flange(*tread))
}

/// A section sampled at even spacing.
struct Section<'p> {
    given: &'p [[f64; 2]],
    points: Vec<[f64; 2]>,
    /// Angle in rad from y to the tangent at each sample.
    angles: Vec<f64>,
}

/// A descent from the end of a flat run.
#[derive(Debug, Clone, Copy)]
struct Fall {
    depth: f64,
    /// The lowest sample.
    lowest: usize,
    /// Length in mm of its steep stretches.
    steep: f64,
}

impl Fall {
    fn is_face(&self) -> bool {
        self.steep >= FALL
    }
}

/// A convex crown with its sides.
struct Head {
    /// Length of the crown in mm.
    crown: f64,
    /// The descents at both sides; `None` if the points end on the crown.
    falls: [Option<Fall>; 2],
}

impl Head {
    fn is_long(&self) -> bool {
        self.crown >= 2.0 * CROWN
    }

    fn has_both_faces(&self) -> bool {
        let [Some(first), Some(last)] = self.falls else {
            return false;
        };
        first.is_face() && last.is_face() && self.is_long()
    }
}

impl Section<'_> {
    fn new(given: &[[f64; 2]]) -> Section<'_> {
        let points = evenly(given);
        let last = points.len().saturating_sub(1);
        let angle = |k: usize| {
            let (from, to) = (points[k.saturating_sub(SIDE)], points[(k + SIDE).min(last)]);
            (to[1] - from[1]).atan2(to[0] - from[0])
        };
        let angles = (0..points.len()).map(angle).collect();
        Section {
            given,
            points,
            angles,
        }
    }

    /// First and last sample of every flat run with at least the length `least` in mm.
    fn flat_runs(&self, least: f64) -> Vec<[usize; 2]> {
        let mut runs: Vec<[usize; 2]> = Vec::new();
        for (k, angle) in self.angles.iter().enumerate() {
            if angle.abs() > FLAT {
                continue;
            }
            match runs.last_mut() {
                // A single steeper sample does not end a run.
                Some(run) if k - run[1] <= 2 => run[1] = k,
                _ => runs.push([k, k]),
            }
        }
        runs.retain(|[first, last]| (last - first) as f64 * STEP >= least);
        runs
    }

    /// The descent from a sample toward the first (`back`) or the last one.
    fn fall(&self, from: usize, back: bool) -> Fall {
        let mut found = Fall {
            depth: 0.0,
            lowest: from,
            steep: 0.0,
        };
        let start = self.points[from][1];
        let mut steep = 0.0;
        let mut at = from;
        loop {
            let next = if back {
                at.checked_sub(1)
            } else {
                Some(at + 1)
            };
            let Some(next) = next.filter(|next| *next < self.points.len()) else {
                return found;
            };
            at = next;
            let depth = start - self.points[at][1];
            if self.angles[at].abs() >= STEEP {
                steep += STEP;
            }
            if depth > found.depth {
                found = Fall {
                    depth,
                    lowest: at,
                    steep,
                };
            } else if depth < found.depth - FALL_LEAST {
                return found;
            }
        }
    }

    /// The flange on the inner side of a tread.
    fn flange(&self, [first, last]: [usize; 2]) -> Option<Flange> {
        let inner = self.fall(first, true);
        // A section that falls on both sides is a rail, or has two flanges.
        if self.fall(last, false).depth >= FALL {
            return None;
        }
        let mut heights: Vec<f64> = self.points[first..=last].iter().map(|at| at[1]).collect();
        heights.sort_by(f64::total_cmp);
        let height = heights[heights.len() / 2] - self.points[inner.lowest][1];
        let tip = self.tip(inner.lowest);
        let within = |[least, most]: [f64; 2], value: f64| (least..=most).contains(&value);
        if !within(FLANGE_HEIGHT, height) {
            return None;
        }
        let [end, _] = bounds(self.points[..=first].iter().map(|at| at[0]));
        let whole =
            within(TIP_WIDTH, tip[1] - tip[0]) && 0.5 * (tip[0] + tip[1]) - end <= TIP_WIDTH[1];
        if whole {
            return Some(Flange {
                tip: Some(tip),
                back: self.back(inner.lowest),
                end,
            });
        }
        let steepest = self.angles[inner.lowest..=first]
            .iter()
            .copied()
            .fold(0.0, f64::max);
        let part = inner.lowest == 0 && steepest <= STEEP;
        part.then_some(Flange {
            tip: None,
            back: None,
            end,
        })
    }

    /// Range of y of the piece around a sample that is at most 2 mm higher.
    fn tip(&self, lowest: usize) -> [f64; 2] {
        let low = |at: &&[f64; 2]| at[1] < self.points[lowest][1] + TIP_DEPTH;
        let after = self.points[lowest..].iter().take_while(low);
        let before = self.points[..=lowest].iter().rev().take_while(low);
        bounds(after.chain(before).map(|at| at[0]))
    }

    /// y of the back of the flange whose lowest sample is given.
    fn back(&self, lowest: usize) -> Option<f64> {
        let steep = (0..lowest).filter(|k| (self.angles[*k] + FRAC_PI_2).abs() <= CUT_SLOPE);
        let mut places: Vec<f64> = steep.map(|k| self.points[k][0]).collect();
        if places.len() as f64 * STEP >= BACK {
            places.sort_by(f64::total_cmp);
            return Some(places[places.len() / 2]);
        }
        self.rounding_end(lowest)
    }

    /// y at which the rounding of a back would be vertical if the points end before that. It is found from the given points, because samples
    /// between them lie on chords.
    fn rounding_end(&self, lowest: usize) -> Option<f64> {
        let end = *self.given.first()?;
        let beyond = |least: f64| {
            let far = |at: &&[f64; 2]| distance(end, **at) >= least;
            self.given.iter().find(far).copied()
        };
        let (middle, inner) = (beyond(BACK)?, beyond(2.0 * BACK)?);
        if inner[0] > self.points[lowest][0] {
            return None;
        }
        let (centre, radius) = circle(end, middle, inner)?;
        let leftmost = centre[0] - radius;
        (0.0..=0.5 * BACK)
            .contains(&(end[0] - leftmost))
            .then_some(leftmost)
    }

    /// Returns whether the section rises again behind the lowest sample of a descent, toward the first (`back`) or the last sample.
    fn rises_behind(&self, lowest: usize, back: bool) -> bool {
        let behind = if back {
            0..lowest
        } else {
            lowest..self.points.len()
        };
        let bottom = self.points[lowest][1];
        self.points[behind].iter().any(|at| at[1] >= bottom + FALL)
    }

    /// The heads of rails in this section.
    fn heads(&self) -> Vec<Head> {
        let runs = self.flat_runs(CROWN).into_iter();
        runs.filter_map(|[first, last]| {
            let end = self.points.len() - 1;
            let falls = [
                (first > SIDE).then(|| self.fall(first, true)),
                (last + SIDE < end).then(|| self.fall(last, false)),
            ];
            let [from, to] = [self.angles[first], self.angles[last]];
            // If the points end on the crown, they must not rise toward the end.
            let cut_well = (falls[0].is_some() || from >= -CUT_SLOPE)
                && (falls[1].is_some() || to <= CUT_SLOPE);
            let deepest = falls.iter().flatten().map(|fall| fall.depth);
            let deepest = deepest.fold(0.0, f64::max);
            // A side whose points end soon after the crown may fall less.
            let falls_there =
                |fall: &Fall| fall.depth >= FALL_LEAST || [0, end].contains(&fall.lowest);
            let convex = deepest >= FALL || from - to >= CROWN_TURN;
            let convex = convex && falls.iter().flatten().all(falls_there);
            // Upside down, the bottom of a groove is a crown between two bodies.
            let between = matches!(falls, [Some(first), Some(last)]
                if self.rises_behind(first.lowest, true) && self.rises_behind(last.lowest, false));
            (cut_well && convex && !between).then_some(Head {
                crown: (last - first) as f64 * STEP,
                falls,
            })
        })
        .collect()
    }
}

/// Centre and radius of the circle through three points.
fn circle(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Option<([f64; 2], f64)> {
    let ([bx, by], [cx, cy]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let double = 2.0 * (bx * cy - by * cx);
    if double == 0.0 {
        return None;
    }
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    let centre = [(cy * b2 - by * c2) / double, (bx * c2 - cx * b2) / double];
    let radius = centre[0].hypot(centre[1]);
    Some(([a[0] + centre[0], a[1] + centre[1]], radius))
}

/// Samples at even spacing along the chords.
fn evenly(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut even: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
    let mut left = STEP;
    for pair in points.windows(2) {
        let chord = distance(pair[0], pair[1]);
        let mut along = left;
        while along <= chord {
            let part = along / chord;
            even.push([0, 1].map(|k| pair[0][k] + part * (pair[1][k] - pair[0][k])));
            along += STEP;
        }
        left = along - chord;
    }
    even
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wheel, z up: a flange of 28 mm with a round tip of 15 mm next to a tread of 100 mm.
    fn wheel() -> Vec<[f64; 2]> {
        (-650..=600)
            .map(|k| 0.1 * f64::from(k))
            .map(|y: f64| [y, -28.0 * (-((y + 45.0) / 15.0).powi(2)).exp()])
            .collect()
    }

    #[test]
    fn the_tip_of_a_flange_is_the_piece_within_two_millimetres_of_its_lowest_point() {
        let found = flange(&wheel()).expect("a flange");
        let [from, to] = found.tip.expect("a tip");
        // 28 exp(−(d/15)²) = 26 at d = 15 √ln(28/26), up to the spacing of the samples.
        let half = 15.0 * (28.0_f64 / 26.0).ln().sqrt();
        assert!((from + 45.0 + half).abs() < STEP, "{from}");
        assert!((to + 45.0 - half).abs() < STEP, "{to}");
    }

    #[test]
    fn a_rounding_is_continued_to_the_back_and_a_slope_is_not() {
        let arc = |last: i32| -> Vec<[f64; 2]> {
            // The tip at y = 0 and a rounding of 20 mm, whose back is at y = -20.
            let rounding = (0..=last).rev().map(|k| {
                let angle = f64::from(k).to_radians();
                [-20.0 * angle.sin(), -28.0 + 20.0 * (1.0 - angle.cos())]
            });
            let face = (1..=24).map(|k| [f64::from(k), -28.0 + 28.0 / 24.0 * f64::from(k)]);
            let tread = (1..=80).map(|k| [24.0 + f64::from(k), 0.0]);
            rounding.chain(face).chain(tread).collect()
        };
        let back = |last: i32| flange(&arc(last)).expect("a flange").back;
        for measured in [75, 80, 85] {
            let found = back(measured).expect("a back");
            assert!((found + 20.0).abs() < 0.05, "{measured}°: {found}");
        }
        assert_eq!(back(65), None);
    }
}
