//! Outlines of the stick and slip zones and of the patch, as closed polygons, and the strips of stored cells.
//!
//! Cells are rectangles `x ± dx/2`, `y ± dy/2`. Outer loops run counter-clockwise, holes clockwise (x to the right, y up); the first point
//! is not repeated. No loop touches itself: two loops that meet in a corner are separate.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::IntOverlayOptions;
use i_overlay::core::simplify::Simplify;
use i_overlay::i_float::int::point::IntPoint;
use i_overlay::i_shape::int::shape::IntContour;

use railhead_contact::numerics::interpolation;
use railhead_contact::solution::words::answer::{PatchCells, Zone};

/// Returns the outlines in mm of the union of the cells of one class, such as a zone, or of all cells if `which` is `None`.
///
/// The polygons are rectilinear and enclose exactly the cells: their signed areas (holes negative) add up to the area of the cells. Edges
/// of neighbouring cells that differ by rounding (1e-9 of the cell) count as equal. Loops start at their lowest, then leftmost point, and
/// are sorted by it. Without `classes` there is no outline of a class.
///
/// # Panics
/// If the vectors differ in length.
#[must_use]
pub(crate) fn outlines<T: Copy + PartialEq>(
    fields: &PatchCells,
    classes: Option<&[T]>,
    which: Option<T>,
) -> Vec<Vec<[f64; 2]>> {
    let n = fields.x_mm.len();
    assert!(
        classes.is_none_or(|classes| classes.len() == n),
        "there must be one class per cell"
    );
    let wanted = |i: usize| which.is_none_or(|class| classes.is_some_and(|all| all[i] == class));
    let cells: Vec<usize> = (0..n).filter(|&i| wanted(i)).collect();

    let x = CellBorders::new(&fields.x_mm, &fields.dx_mm, &cells);
    let y = CellBorders::new(&fields.y_mm, &fields.dy_mm, &cells);
    let cells = x.of_cell.iter().zip(&y.of_cell).map(|(x, y)| {
        let corners = [(x.0, y.0), (x.1, y.0), (x.1, y.1), (x.0, y.1)];
        corners.map(|(i, j)| IntPoint::new(i, j)).to_vec()
    });
    let cells: Vec<IntContour<i32>> = cells.collect();
    let union = cells.simplify(FillRule::NonZero, IntOverlayOptions::ogc());
    let mut loops: Vec<IntContour<i32>> = union.into_iter().flatten().collect();
    for corners in &mut loops {
        let lowest = (0..corners.len()).min_by_key(|&k| (corners[k].y, corners[k].x));
        corners.rotate_left(lowest.unwrap_or(0));
    }
    loops.sort_by_key(|corners| (corners[0].y, corners[0].x));
    let place = |corner: &IntPoint<i32>| [x.values[corner.x as usize], y.values[corner.y as usize]];
    loops
        .iter()
        .map(|corners| corners.iter().map(place).collect())
        .collect()
}

/// Returns the outline of the patch through the ends of the chords, in mm.
///
/// If every strip has one segment, the outline follows the leading ends upward, then the trailing ends downward. At the outer borders of
/// the first and the last strip the chord is extrapolated: its squared half-length is a parabola in y, which is exact for an ellipse. The
/// outline is of second order in the width of the strips. The outline of any other patch is that of [`outlines`].
#[must_use]
pub(crate) fn patch_outline(fields: &PatchCells) -> Vec<Vec<[f64; 2]>> {
    let strips = Strips::new(fields);
    if !strips.is_simple() {
        return outlines::<Zone>(fields, None, None);
    }
    let last = strips.segments.len() - 1;
    let (bottom, top) = (&strips.segments[0], &strips.segments[last]);
    let (bottom_y, top_y) = (bottom.y - 0.5 * bottom.dy, top.y + 0.5 * top.dy);
    let (bottom_left, bottom_right) = strips.tip(0, false);
    let (top_left, top_right) = strips.tip(last, true);

    let mut polygon = vec![[bottom_right, bottom_y]];
    polygon.extend(strips.segments.iter().map(|s| [s.right, s.y]));
    polygon.push([top_right, top_y]);
    if top_left < top_right {
        polygon.push([top_left, top_y]);
    }
    polygon.extend(strips.segments.iter().rev().map(|s| [s.left, s.y]));
    if bottom_left < bottom_right {
        polygon.push([bottom_left, bottom_y]);
    }
    vec![polygon]
}

/// Distinct edges along one axis, and for each cell the indices of its two edges.
struct CellBorders {
    values: Vec<f64>,
    of_cell: Vec<(i32, i32)>,
}

impl CellBorders {
    fn new(centres: &[f64], widths: &[f64], cells: &[usize]) -> CellBorders {
        let mut sides: Vec<(f64, f64, usize)> = Vec::with_capacity(2 * cells.len());
        for (k, &i) in cells.iter().enumerate() {
            let (centre, width) = (centres[i], widths[i]);
            let tolerance = join_tolerance(centre, width);
            sides.push((centre - 0.5 * width, tolerance, 2 * k));
            sides.push((centre + 0.5 * width, tolerance, 2 * k + 1));
        }
        sides.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut values: Vec<f64> = Vec::new();
        let mut ranks = vec![0; sides.len()];
        let mut last_tolerance = 0.0;
        for &(value, tolerance, side) in &sides {
            // An edge is compared with the first one of its group, so that a group cannot spread.
            if values
                .last()
                .is_none_or(|&last| value - last > tolerance.min(last_tolerance))
            {
                values.push(value);
                last_tolerance = tolerance;
            }
            ranks[side] = values.len() as i32 - 1;
        }
        let of_cell = ranks
            .chunks_exact(2)
            .map(|pair| (pair[0], pair[1]))
            .collect();
        CellBorders { values, of_cell }
    }
}

/// Distance between cells below which they are adjacent, as a fraction of the width of a cell.
const JOIN: f64 = 1e-9;

/// A contiguous run of cells of a strip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StoredSegment {
    /// Indices of its cells, in ascending x.
    pub(crate) cells: std::ops::Range<usize>,
    /// Mid-line in mm.
    pub(crate) y: f64,
    /// Width of the strip in mm.
    pub(crate) dy: f64,
    /// Trailing end in mm.
    pub(crate) left: f64,
    /// Leading end in mm.
    pub(crate) right: f64,
    /// Its continuation toward smaller and toward larger y.
    pub(crate) next: [Continuation; 2],
}

/// The continuation of a segment in the next strip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Continuation {
    /// It touches no segment.
    None,
    /// It touches this segment, and each is the only neighbour of the other on that side.
    Segment(usize),
    /// It touches several segments, or one that touches others too.
    Branches,
}

/// A patch as strips, each a range of segments, in ascending y, then x.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Strips {
    /// All segments.
    pub(crate) segments: Vec<StoredSegment>,
    /// Segments of each strip.
    pub(crate) strips: Vec<std::ops::Range<usize>>,
}

impl Strips {
    /// Reads the strips from cells that are stored strip by strip in ascending y, and in ascending x in each strip.
    ///
    /// # Panics
    /// If the vectors of the cells differ in length.
    pub(crate) fn new(fields: &PatchCells) -> Strips {
        let n = fields.x_mm.len();
        assert!(
            [
                fields.y_mm.len(),
                fields.dx_mm.len(),
                fields.dy_mm.len(),
                fields.strip.len()
            ] == [n; 4],
            "the cells of a patch must have one value each in every vector"
        );
        let mut out = Strips::default();
        let mut last_strip = None;
        for i in 0..n {
            let (x, half) = (fields.x_mm[i], 0.5 * fields.dx_mm[i]);
            if last_strip != Some(fields.strip[i]) {
                out.strips.push(out.segments.len()..out.segments.len());
                last_strip = Some(fields.strip[i]);
            } else if let Some(open) = out.segments.last_mut()
                && (x - half - open.right).abs() <= join_tolerance(x, fields.dx_mm[i])
            {
                open.cells.end = i + 1;
                open.right = x + half;
                continue;
            }
            out.segments.push(StoredSegment {
                cells: i..i + 1,
                y: fields.y_mm[i],
                dy: fields.dy_mm[i],
                left: x - half,
                right: x + half,
                next: [Continuation::None; 2],
            });
            if let Some(strip) = out.strips.last_mut() {
                strip.end = out.segments.len();
            }
        }
        out.link();
        out
    }

    /// Whether every strip has one segment and touches the next strip.
    pub(crate) fn is_simple(&self) -> bool {
        !self.segments.is_empty()
            && self.strips.iter().all(|strip| strip.len() == 1)
            && self.segments[1..]
                .iter()
                .all(|segment| matches!(segment.next[0], Continuation::Segment(_)))
    }

    /// Returns the trailing and the leading end of a segment without continuation at the border of its strip; `upper` selects the border at
    /// larger y.
    ///
    /// The squared half-length is extrapolated through up to three strips as a parabola in y, which is exact for an ellipse, and the centre as
    /// a line. The half-length is limited to that of the segment. If segments branch, the ends of the segment are returned unchanged.
    pub(crate) fn tip(&self, segment: usize, upper: bool) -> (f64, f64) {
        let (first, side) = (&self.segments[segment], usize::from(upper));
        if first.next[side] == Continuation::Branches {
            return (first.left, first.right);
        }
        let mut chain = vec![first];
        while let Continuation::Segment(next) = chain[chain.len() - 1].next[1 - side]
            && chain.len() < 3
        {
            chain.push(&self.segments[next]);
        }
        let y = first.y + [-0.5, 0.5][side] * first.dy;
        let squared: Vec<(f64, f64)> = chain
            .iter()
            .map(|s| (s.y, (0.5 * (s.right - s.left)).powi(2)))
            .collect();
        let centres: Vec<(f64, f64)> = chain
            .iter()
            .take(2)
            .map(|s| (s.y, 0.5 * (s.left + s.right)))
            .collect();
        let half = interpolation::polynomial_value(&squared, y)
            .clamp(0.0, squared[0].1)
            .sqrt();
        // Rounding of the parabola gives half-lengths of this size for 0.
        let half = if half < 1e-6 * squared[0].1.sqrt() {
            0.0
        } else {
            half
        };
        let centre = interpolation::polynomial_value(&centres, y)
            .clamp(first.left + half, first.right - half);
        (centre - half, centre + half)
    }

    /// Records which segments of neighbouring strips continue each other.
    fn link(&mut self) {
        for j in 1..self.strips.len() {
            let (lower, upper) = (self.strips[j - 1].clone(), self.strips[j].clone());
            let (a, b) = (&self.segments[lower.start], &self.segments[upper.start]);
            let gap = (b.y - 0.5 * b.dy) - (a.y + 0.5 * a.dy);
            if gap.abs() > join_tolerance(a.y.abs().max(b.y.abs()), a.dy.min(b.dy)) {
                continue;
            }
            let pairs: Vec<(usize, usize)> = lower
                .flat_map(|l| upper.clone().map(move |u| (l, u)))
                .filter(|&(l, u)| {
                    let (l, u) = (&self.segments[l], &self.segments[u]);
                    l.left < u.right && u.left < l.right
                })
                .collect();
            for &(l, u) in &pairs {
                let alone = pairs.iter().filter(|&&(l2, u2)| l2 == l || u2 == u).count() == 1;
                let next = |segment| match alone {
                    true => Continuation::Segment(segment),
                    false => Continuation::Branches,
                };
                self.segments[l].next[1] = next(u);
                self.segments[u].next[0] = next(l);
            }
        }
    }
}

/// Returns the distance below which two edges are equal: a fraction of the width of the cell, but at least the rounding of coordinates.
fn join_tolerance(coordinate: f64, width: f64) -> f64 {
    (JOIN * width).max(8.0 * f64::EPSILON * coordinate.abs())
}

/// Patches for the unit tests of this folder.
#[cfg(test)]
pub(crate) mod samples {
    use std::f64::consts::PI;

    use railhead_contact::solution::words::answer::PatchCells;

    /// Adds a segment with the given cell edges to a patch.
    pub(crate) fn push_segment(
        fields: &mut PatchCells,
        strip: u32,
        y: f64,
        dy: f64,
        edges: &[f64],
    ) {
        for pair in edges.windows(2) {
            fields.x_mm.push(0.5 * (pair[0] + pair[1]));
            fields.dx_mm.push(pair[1] - pair[0]);
            fields.y_mm.push(y);
            fields.dy_mm.push(dy);
            fields.strip.push(strip);
        }
    }

    /// Strips with cosine-graded cells on an ellipse whose centre line is `x = lean · y`.
    pub(crate) fn ellipse(a: f64, b: f64, lean: f64, strips: u32, cells: u32) -> PatchCells {
        let mut fields = PatchCells::default();
        let dy = 2.0 * b / f64::from(strips);
        for j in 0..strips {
            let y = -b + (f64::from(j) + 0.5) * dy;
            let half = a * (1.0 - (y / b).powi(2)).sqrt();
            let edges: Vec<f64> = (0..=cells)
                .map(|k| lean * y - half * (PI * f64::from(k) / f64::from(cells)).cos())
                .collect();
            push_segment(&mut fields, j, y, dy, &edges);
        }
        fields
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::samples::{ellipse, push_segment};
    use super::*;

    fn area(polygon: &[[f64; 2]]) -> f64 {
        let next = polygon.iter().cycle().skip(1);
        0.5 * polygon
            .iter()
            .zip(next)
            .map(|(p, q)| p[0] * q[1] - q[0] * p[1])
            .sum::<f64>()
    }

    fn total(polygons: &[Vec<[f64; 2]>]) -> f64 {
        polygons.iter().map(|p| area(p)).sum()
    }

    /// Unit cells where the pattern has `#`; the last line is the lowest strip.
    fn pattern(lines: &[&str]) -> PatchCells {
        let mut fields = PatchCells::default();
        for (j, line) in (0u32..).zip(lines.iter().rev()) {
            for (i, _) in line.bytes().enumerate().filter(|&(_, c)| c == b'#') {
                let x = i as f64;
                push_segment(&mut fields, j, f64::from(j) + 0.5, 1.0, &[x, x + 1.0]);
            }
        }
        fields
    }

    fn assert_well_formed(polygons: &[Vec<[f64; 2]>]) {
        for polygon in polygons {
            let n = polygon.len();
            assert!(
                n >= 4 && n.is_multiple_of(2),
                "a rectilinear loop has an even number of corners: {polygon:?}"
            );
            let mut corners = BTreeSet::new();
            for k in 0..n {
                let (p, q, r) = (polygon[k], polygon[(k + 1) % n], polygon[(k + 2) % n]);
                let flat = p[1] == q[1];
                assert!(
                    flat != (p[0] == q[0]),
                    "neither along x nor along y: {p:?} {q:?}"
                );
                assert!(
                    flat != (q[1] == r[1]),
                    "passed straight on: {p:?} {q:?} {r:?}"
                );
                assert!(
                    corners.insert((q[0].to_bits(), q[1].to_bits())),
                    "passed twice: {q:?} in {polygon:?}"
                );
            }
        }
    }

    #[test]
    fn one_cell_is_its_own_outline() {
        let mut fields = PatchCells::default();
        push_segment(&mut fields, 0, 5.0, 2.0, &[1.0, 4.0]);
        let square = vec![vec![[1.0, 4.0], [4.0, 4.0], [4.0, 6.0], [1.0, 6.0]]];
        assert_eq!(outlines::<Zone>(&fields, None, None), square);
        assert_eq!(
            patch_outline(&fields).iter().map(|p| area(p)).sum::<f64>(),
            6.0
        );
        assert!(outlines(&fields, Some(&[Zone::Slip]), Some(Zone::Stick)).is_empty());
        assert!(outlines(&fields, None, Some(Zone::Stick)).is_empty());
        assert!(outlines::<Zone>(&PatchCells::default(), None, None).is_empty());
    }

    #[test]
    fn a_hole_is_a_clockwise_loop() {
        let loops = outlines::<Zone>(&pattern(&["####", "#..#", "####"]), None, None);
        assert_well_formed(&loops);
        assert_eq!(
            loops.iter().map(|l| area(l)).collect::<Vec<_>>(),
            vec![12.0, -2.0]
        );
    }

    #[test]
    fn diagonal_cells_and_diagonal_holes_stay_apart() {
        let loops = outlines::<Zone>(&pattern(&["#.#.", ".#.#", "#.#.", ".#.#"]), None, None);
        assert_well_formed(&loops);
        assert_eq!(
            loops.iter().map(|l| area(l)).collect::<Vec<_>>(),
            vec![1.0; 8]
        );

        let loops = outlines::<Zone>(&pattern(&["####", "##.#", "#.##", "####"]), None, None);
        assert_well_formed(&loops);
        assert_eq!(
            loops.iter().map(|l| area(l)).collect::<Vec<_>>(),
            vec![16.0, -1.0, -1.0]
        );
    }

    #[test]
    fn a_hole_that_touches_the_outside_in_a_corner_is_still_a_hole() {
        let loops = outlines::<Zone>(&pattern(&["###", "#.#", "##."]), None, None);
        assert_well_formed(&loops);
        assert_eq!(
            loops.iter().map(|l| area(l)).collect::<Vec<_>>(),
            vec![8.0, -1.0]
        );
    }

    #[test]
    fn rounding_of_edges_does_not_tear_the_outline() {
        let mut fields = PatchCells::default();
        let edges: Vec<f64> = (0..=10).map(|k| 0.1 + 0.7 * f64::from(k) / 3.0).collect();
        for j in 0..10 {
            push_segment(&mut fields, j, 0.3 * f64::from(j) + 1e3, 0.3, &edges);
        }
        for (k, x) in fields.x_mm.iter_mut().enumerate() {
            *x += 1e-11 * (k as f64 * 7.3).sin();
        }
        let loops = outlines::<Zone>(&fields, None, None);
        assert_eq!(loops.len(), 1);
        assert_eq!(loops[0].len(), 4);
        // A gap is kept even if it is narrow.
        for (x, dx) in fields.x_mm.iter_mut().zip(&mut fields.dx_mm).take(1) {
            *x -= 1e-7;
            *dx -= 1e-7;
        }
        assert!(outlines::<Zone>(&fields, None, None)[0].len() > 4);
    }

    #[test]
    fn patch_outline_of_an_ellipse_converges_to_its_area() {
        let error = |strips| {
            let loops = patch_outline(&ellipse(2.0, 3.0, 0.2, strips, 4));
            assert_eq!(loops.len(), 1);
            area(&loops[0]) / (6.0 * PI) - 1.0
        };
        assert!(error(16).abs() < 0.011, "{}", error(16));
        let rate = error(16) / error(64);
        assert!(
            (7.0..9.0).contains(&rate),
            "strips of the tips cost h^1.5: {rate}"
        );
        let loops = patch_outline(&ellipse(2.0, 3.0, 0.2, 16, 4));
        let tip = loops[0][0];
        assert!((tip[0] + 0.6).abs() < 1e-9 && tip[1] == -3.0, "{tip:?}");
        assert_eq!(loops[0].len(), 34, "both tips close in one point");
    }

    #[test]
    fn patch_outline_of_a_patch_with_two_lobes_is_rectilinear() {
        let fields = pattern(&["#.#", "###"]);
        assert_eq!(
            patch_outline(&fields),
            outlines::<Zone>(&fields, None, None)
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn loops_enclose_exactly_the_cells(
            strips in prop::collection::vec((0.1f64..2.0, prop::collection::vec((0.05f64..1.5, 0u8..3), 1..9)), 1..9),
        ) {
            let mut fields = PatchCells::default();
            let mut zones = Vec::new();
            let mut y = -1.0;
            for (j, (dy, cells)) in (0u32..).zip(&strips) {
                let mut x = -2.0;
                for &(width, state) in cells {
                    // Coarse steps make edges of neighbouring strips meet.
                    let width = (width * 4.0).ceil() / 4.0;
                    if state < 2 {
                        push_segment(&mut fields, j, y + 0.5 * dy, *dy, &[x, x + width]);
                        zones.push(if state == 0 { Zone::Stick } else { Zone::Slip });
                    }
                    x += width;
                }
                y += dy;
            }
            let cell_area = |wanted: Option<Zone>| -> f64 {
                (0..zones.len())
                    .filter(|&i| wanted.is_none_or(|w| zones[i] == w))
                    .map(|i| fields.dx_mm[i] * fields.dy_mm[i])
                    .sum()
            };
            for wanted in [None, Some(Zone::Stick), Some(Zone::Slip)] {
                let loops = outlines(&fields, Some(&zones), wanted);
                assert_well_formed(&loops);
                prop_assert!((total(&loops) - cell_area(wanted)).abs() < 1e-9);
            }
            let [all, stick, slip] = [None, Some(Zone::Stick), Some(Zone::Slip)].map(|w| total(&outlines(&fields, Some(&zones), w)));
            prop_assert!((stick + slip - all).abs() < 1e-9);
        }
    }
}

#[cfg(test)]
mod strip_segments_tests {
    use super::*;

    #[test]
    fn an_ellipse_is_one_segment_per_strip_and_its_tips_close() {
        let strips = Strips::new(&samples::ellipse(2.0, 3.0, 0.1, 9, 7));
        assert!(strips.is_simple());
        assert_eq!(strips.segments.len(), 9);
        let (left, right) = strips.tip(8, true);
        assert!(
            (left - 0.3).abs() < 1e-9 && (right - 0.3).abs() < 1e-9,
            "{left} {right}"
        );
        let (left, right) = strips.tip(0, false);
        assert!(
            (left + 0.3).abs() < 1e-9 && (right + 0.3).abs() < 1e-9,
            "{left} {right}"
        );
    }

    #[test]
    fn a_fork_is_seen_as_a_branch_and_keeps_its_ends() {
        let mut fields = PatchCells::default();
        samples::push_segment(&mut fields, 0, 0.5, 1.0, &[0.0, 1.0, 2.0, 3.0]);
        samples::push_segment(&mut fields, 1, 1.5, 1.0, &[0.0, 1.0]);
        samples::push_segment(&mut fields, 1, 1.5, 1.0, &[2.0, 3.0]);
        let strips = Strips::new(&fields);
        assert_eq!(strips.strips, vec![0..1, 1..3]);
        assert!(!strips.is_simple());
        assert_eq!(strips.segments[0].next[1], Continuation::Branches);
        assert_eq!(strips.segments[2].next[0], Continuation::Branches);
        assert_eq!(strips.tip(0, true), (0.0, 3.0));
    }

    #[test]
    fn strips_apart_are_not_linked() {
        let mut fields = PatchCells::default();
        samples::push_segment(&mut fields, 0, 0.5, 1.0, &[0.0, 1.0]);
        samples::push_segment(&mut fields, 2, 2.5, 1.0, &[0.0, 1.0]);
        let strips = Strips::new(&fields);
        assert_eq!(strips.segments[0].next[1], Continuation::None);
        assert!(!strips.is_simple());
    }
}
