//! What the shape of a profile tells: is it a rail or a wheel, where is the tip of the flange, which chord leads astray?

use crate::contact::geometry::profile_quality::Points;
use crate::contact::geometry::profile_quality::noise::median;

/// How far below the highest point the head of a rail is measured, and above the lowest one the tip of a flange, in mm.
const PIECE: f64 = 2.0;
/// Least width of the head in mm, and least distance of its top from both ends.
/// Population: 12 rails and rollers with heads of 37 to 56 mm, 15 to 64 mm from an end.
const HEAD_MIN: f64 = 25.0;
const HEAD_FROM_END: f64 = 10.0;
/// Width of the tip of a flange in mm, and its least distance from both ends.
/// Population: 8 complete wheels with tips of 12 to 18 mm, 5 to 60 mm from an end.
const TIP: [f64; 2] = [5.0, 25.0];
const TIP_FROM_END: f64 = 3.0;
/// A chord at an end of the profile is stray from this length in mm and this multiple of the median chord on.
const STRAY: f64 = 10.0;
const STRAY_MEDIANS: f64 = 8.0;
/// Points beyond a stray chord at most.
const STRAY_POINTS_MAX: usize = 2;

/// What a shape looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Looks {
    /// A rail's head: wide on top and far from both ends.
    Rail,
    /// A wheel: a narrow tip that stands out.
    Wheel,
}

/// Which body the points look like, whatever the sense of z; `None` if the shape does not tell.
#[must_use]
pub fn looks_like(points: &[[f64; 2]]) -> Option<Looks> {
    let mirrored: Vec<[f64; 2]> = points.iter().map(|[y, z]| [*y, -z]).collect();
    let either = |test: fn(&[[f64; 2]]) -> bool| test(points) || test(&mirrored);
    match (either(has_head), either(has_tip)) {
        (true, false) => Some(Looks::Rail),
        (false, true) => Some(Looks::Wheel),
        _ => None,
    }
}

/// Is the piece within 2 mm of the highest point wide and away from the ends?
fn has_head(points: &[[f64; 2]]) -> bool {
    let Some((top, piece)) = piece_at_top(points) else {
        return false;
    };
    let [first, last] = ends(points);
    piece[1] - piece[0] >= HEAD_MIN
        && points[top][0] - first >= HEAD_FROM_END
        && last - points[top][0] >= HEAD_FROM_END
}

/// Is the piece within 2 mm of the lowest point narrow and away from the ends?
fn has_tip(points: &[[f64; 2]]) -> bool {
    let mirrored: Vec<[f64; 2]> = points.iter().map(|[y, z]| [*y, -z]).collect();
    let Some((tip, piece)) = piece_at_top(&mirrored) else {
        return false;
    };
    let [first, last] = ends(points);
    (TIP[0]..=TIP[1]).contains(&(piece[1] - piece[0]))
        && points[tip][0] - first >= TIP_FROM_END
        && last - points[tip][0] >= TIP_FROM_END
}

/// The range of y of the tip of a wheel's flange (within 2 mm of its lowest point, z up).
#[must_use]
pub fn flange_tip(points: Points) -> Option<[f64; 2]> {
    let mirrored: Vec<[f64; 2]> = points.at.iter().map(|[y, z]| [*y, -z]).collect();
    has_tip(points.at).then(|| piece_at_top(&mirrored).map(|(_, piece)| piece))?
}

fn ends(points: &[[f64; 2]]) -> [f64; 2] {
    let y = || points.iter().map(|at| at[0]);
    [
        y().fold(f64::INFINITY, f64::min),
        y().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// The number of the highest point, and the range of y of its neighbours that are at most 2 mm lower.
fn piece_at_top(points: &[[f64; 2]]) -> Option<(usize, [f64; 2])> {
    let top = (0..points.len()).max_by(|a, b| points[*a][1].total_cmp(&points[*b][1]))?;
    let near = |k: &usize| points[*k][1] > points[top][1] - PIECE;
    let after = (top..points.len()).take_while(near).last()?;
    let before = (0..=top).rev().take_while(near).last()?;
    let (a, b) = (points[before][0], points[after][0]);
    Some((top, [a.min(b), a.max(b)]))
}

/// Points at either end that lie beyond a stray chord, with the length of that chord in mm: `[count, length]` at the first and
/// at the last end.
#[must_use]
pub fn stray_ends(points: &[[f64; 2]]) -> [Option<(usize, f64)>; 2] {
    let chords: Vec<f64> = points
        .windows(2)
        .map(|pair| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]))
        .collect();
    let usual = median(&mut chords.clone());
    let stray = |k: usize| {
        let chord = *chords.get(k)?;
        (chord > STRAY && chord > STRAY_MEDIANS * usual).then_some(chord)
    };
    let count = chords.len();
    let first = (0..STRAY_POINTS_MAX)
        .rev()
        .find_map(|k| Some((k + 1, stray(k)?)));
    let last = (0..STRAY_POINTS_MAX)
        .rev()
        .find_map(|k| Some((k + 1, stray(count.checked_sub(k + 1)?)?)));
    [first, last]
}
