//! Recovers strips and their segments from stored cells, and finds the neighbours that continue a segment.

use crate::contact::numerics::interpolation;
use crate::contact::solution::words::answer::PatchCells;

/// Distance between cells, as a fraction of a cell's width, below which they count as adjacent.
pub(crate) const JOIN: f64 = 1e-9;

/// An unbroken run of cells of one strip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StoredSegment {
    /// Its cells, as indices into the fields, from smaller to larger x.
    pub cells: std::ops::Range<usize>,
    /// Mid-line in mm.
    pub y: f64,
    /// Width of the strip in mm.
    pub dy: f64,
    /// Trailing end in mm.
    pub left: f64,
    /// Leading end in mm.
    pub right: f64,
    /// The segment that continues it toward smaller y, if each is the only neighbour of the other on that side.
    pub below: Option<usize>,
    /// The segment that continues it toward larger y, if each is the only neighbour of the other on that side.
    pub above: Option<usize>,
    /// It touches several segments below, or one that touches other segments above.
    pub branches_below: bool,
    /// It touches several segments above, or one that touches other segments below.
    pub branches_above: bool,
}

/// The patch as strips, each a range of segments; both from smaller to larger y, then x.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Strips {
    /// All segments.
    pub segments: Vec<StoredSegment>,
    /// Segments of each strip.
    pub strips: Vec<std::ops::Range<usize>>,
}

impl Strips {
    /// Reads the strips from cells stored strip by strip (smaller to larger y), in each by x.
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
                below: None,
                above: None,
                branches_below: false,
                branches_above: false,
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
                .all(|segment| segment.below.is_some())
    }

    /// Trailing and leading end of a segment without continuation at the border of its strip (`upper`: the border at
    /// larger y).
    ///
    /// The squared half-length is extrapolated through up to three strips, as a parabola in y (exact for an
    /// ellipse), the centre as a line; the half-length stays between 0 and that of the segment. Where segments
    /// branch, the ends of the segment are returned unchanged.
    pub(crate) fn tip(&self, segment: usize, upper: bool) -> (f64, f64) {
        let first = &self.segments[segment];
        let branches = if upper {
            first.branches_above
        } else {
            first.branches_below
        };
        if branches {
            return (first.left, first.right);
        }
        let mut chain = vec![first];
        while chain.len() < 3 {
            let last = chain[chain.len() - 1];
            match if upper { last.below } else { last.above } {
                Some(next) => chain.push(&self.segments[next]),
                None => break,
            }
        }
        let y = if upper {
            first.y + 0.5 * first.dy
        } else {
            first.y - 0.5 * first.dy
        };
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
        // Rounding of the parabola gives half-lengths of this size where the true one is 0.
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
                self.segments[l].above = alone.then_some(u);
                self.segments[u].below = alone.then_some(l);
                self.segments[l].branches_above = !alone;
                self.segments[u].branches_below = !alone;
            }
        }
    }
}

/// Distance below which two edges are the same: a fraction of the cell's width, but at least the rounding of coordinates.
pub(crate) fn join_tolerance(coordinate: f64, width: f64) -> f64 {
    (JOIN * width).max(8.0 * f64::EPSILON * coordinate.abs())
}

/// Patches for the unit tests of this folder.
#[cfg(test)]
pub(crate) mod samples {
    use std::f64::consts::PI;

    use crate::contact::solution::words::answer::PatchCells;

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
        assert!(strips.segments[0].branches_above && strips.segments[2].branches_below);
        assert_eq!(strips.segments[0].above, None);
        assert_eq!(strips.tip(0, true), (0.0, 3.0));
    }

    #[test]
    fn strips_apart_are_not_linked() {
        let mut fields = PatchCells::default();
        samples::push_segment(&mut fields, 0, 0.5, 1.0, &[0.0, 1.0]);
        samples::push_segment(&mut fields, 2, 2.5, 1.0, &[0.0, 1.0]);
        let strips = Strips::new(&fields);
        assert_eq!(strips.segments[0].above, None);
        assert!(!strips.is_simple());
    }
}
