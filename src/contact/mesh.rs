//! Meshes of strips fitted to a patch, with cells graded towards both ends. This module defines the order of all values per cell.
//!
//! Cells are numbered segment by segment (sorted by patch, then y, then x), and in each segment from the trailing end (smaller x) to the leading end (larger x).

use std::f64::consts::PI;
use std::ops::Range;

use railhead_macros::Members;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::numerics::roots;
use crate::numerics::roots::{CloseEnough, Course};

/// The division of a chord, mapped to `−1 … 1`, into cells with nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Grading {
    /// The `n + 1` cell edges, from −1 to 1.
    pub edges: Vec<f64>,
    /// The `n` nodes, one inside each cell.
    pub nodes: Vec<f64>,
}

impl Grading {
    /// Edges `−cos(kπ/n)` with nodes at the mid-angles. Cells are smallest at both ends, where traction varies as the square root of distance.
    pub fn cosine(cells: usize) -> Grading {
        let at = |k: f64| -(k * PI / cells as f64).cos();
        let mut edges: Vec<f64> = (0..=cells).map(|k| at(k as f64)).collect();
        let mut nodes: Vec<f64> = (0..cells).map(|k| at(k as f64 + 0.5)).collect();
        // Exact symmetry is required because it is detected by comparing coordinates.
        symmetrise(&mut edges);
        symmetrise(&mut nodes);
        Grading { edges, nodes }
    }

    /// Equal cells with nodes at their centres.
    pub fn uniform(cells: usize) -> Grading {
        let at = |k: f64| 2.0 * k / cells as f64 - 1.0;
        let edges = (0..=cells).map(|k| at(k as f64)).collect();
        let nodes = (0..cells).map(|k| at(k as f64 + 0.5)).collect();
        Grading { edges, nodes }
    }

    /// Cells graded toward both ends and toward `pole`: their density is `(1 − β)/2 + β/(π√(1 − ξ²)) + g L(ξ − pole)`.
    pub fn about(pole: f64, cells: usize) -> Grading {
        let gathering = PoleGrading {
            pole,
            at_ends: GATHERED_AT_ENDS,
        };
        let mut shares = (0..=2 * cells).map(|k| 0.5 * k as f64 / cells as f64);
        let mut edges = Vec::with_capacity(cells + 1);
        let mut nodes = Vec::with_capacity(cells);
        let mut last = -1.0;
        while let Some(share) = shares.next() {
            last = gathering.place(share, last);
            edges.push(last);
            if let Some(share) = shares.next() {
                last = gathering.place(share, last);
                nodes.push(last);
            }
        }
        if pole == 0.0 {
            symmetrise(&mut edges);
            symmetrise(&mut nodes);
        }
        Grading { edges, nodes }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.nodes.len()
    }
}

/// Share β of the density of cells that is graded towards the ends if cells are also graded towards a pole. On the first 160 ellipses of
/// `cargo bench --bench calibrate ellipse`, 0.6 and 0.9 change the median error at the targets 0.005 and 0.001 by at most 4 %; they take 24 and 5 % more work at the
/// first target, and 5 % less at the second.
const GATHERED_AT_ENDS: f64 = 0.75;
/// Weight g and half width d of the Lorentzian `L(t) = 1/(πd(1 + t²/d²))` at the pole. Weights from 0.08 to 0.25 and half widths from 0.05 to 0.15 are alike.
const BUMP: (f64, f64) = (0.15, 0.1);

/// A density of cells or strips over −1 … 1 with a peak at the pole.
#[derive(Debug, Clone, Copy)]
struct PoleGrading {
    pole: f64,
    at_ends: f64,
}

impl PoleGrading {
    fn density(self, t: f64) -> f64 {
        let (weight, width) = BUMP;
        let ends = self.at_ends / (PI * (1.0 - t * t).max(1e-12).sqrt());
        let bump = weight / (PI * width * (1.0 + ((t - self.pole) / width).powi(2)));
        0.5 * (1.0 - self.at_ends) + ends + bump
    }

    fn cumulated(self, t: f64) -> f64 {
        let (weight, width) = BUMP;
        let bump = |t: f64| weight / PI * ((t - self.pole) / width).atan();
        let ends = self.at_ends * (0.5 + t.asin() / PI);
        0.5 * (1.0 - self.at_ends) * (t + 1.0) + ends + bump(t) - bump(-1.0)
    }

    /// The coordinate to the left of which `share` of the density lies; `from` is a coordinate further left.
    fn place(self, share: f64, from: f64) -> f64 {
        if share <= 0.0 || share >= 1.0 {
            return 2.0 * share.clamp(0.0, 1.0) - 1.0;
        }
        let goal = share * self.cumulated(1.0);
        let start = from + (goal - self.cumulated(from)) / self.density(from).min(2.0);
        let close = CloseEnough {
            value: 1e-14,
            place: 0.0,
        };
        roots::find([from, 1.0], start, Course::Rising, close, |t| {
            [self.cumulated(t) - goal, self.density(t)]
        })
    }
}

fn symmetrise(values: &mut [f64]) {
    let n = values.len();
    for i in 0..n / 2 {
        let half = 0.5 * (values[n - 1 - i] - values[i]);
        values[i] = -half;
        values[n - 1 - i] = half;
    }
    if n % 2 == 1 {
        values[n / 2] = 0.0;
    }
}

/// A chord with its cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// The chord in mm.
    pub chord: Chord,
    /// Indices of its cells.
    pub cells: Range<usize>,
}

/// Whether two segments belong to the same strip of a patch.
pub(crate) fn one_strip(a: &Segment, b: &Segment) -> bool {
    a.chord.patch == b.chord.patch && a.chord.strip == b.chord.strip
}

/// Strips of cells over all patches.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// The segments in the order of the cells.
    pub segments: Vec<Segment>,
    /// Trailing edge of each cell, in mm.
    pub left: Vec<f64>,
    /// Leading edge of each cell, in mm.
    pub right: Vec<f64>,
    /// Node of each cell in mm, at which displacement is evaluated and the traction acts.
    pub node: Vec<f64>,
    /// y in mm at which the tractions of each segment act and its rigid slip is evaluated: the mid-line of the strip unless a more accurate y is known.
    pub load_y: Vec<f64>,
}

impl Mesh {
    /// Divides every chord in the same way. Chords must be sorted by patch, then y, then x.
    pub fn new(chords: &[Chord], grading: &Grading) -> Mesh {
        let n = grading.cells();
        let mut mesh = Mesh {
            segments: Vec::with_capacity(chords.len()),
            left: Vec::with_capacity(chords.len() * n),
            right: Vec::with_capacity(chords.len() * n),
            node: Vec::with_capacity(chords.len() * n),
            load_y: chords.iter().map(|chord| chord.y).collect(),
        };
        for chord in chords {
            let start = mesh.node.len();
            let centre = 0.5 * (chord.left + chord.right);
            let half = 0.5 * (chord.right - chord.left);
            for k in 0..n {
                mesh.left.push(centre + half * grading.edges[k]);
                mesh.right.push(centre + half * grading.edges[k + 1]);
                mesh.node.push(centre + half * grading.nodes[k]);
            }
            mesh.segments.push(Segment {
                chord: *chord,
                cells: start..start + n,
            });
        }
        mesh
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.node.len()
    }

    /// Returns the segments of each strip of a patch.
    pub(crate) fn strips(&self, patch: usize) -> impl Iterator<Item = &[Segment]> {
        let strips = self.segments.chunk_by(one_strip);
        strips.filter(move |strip| strip[0].chord.patch == patch)
    }

    /// Area of every cell, in the square of the mesh's length unit.
    pub fn areas(&self) -> Vec<f64> {
        let mut areas = Vec::with_capacity(self.cells());
        for segment in &self.segments {
            areas.extend(
                segment
                    .cells
                    .clone()
                    .map(|i| (self.right[i] - self.left[i]) * segment.chord.dy),
            );
        }
        areas
    }

    /// y in mm at which the traction of every cell acts.
    pub fn cell_load_y(&self) -> Vec<f64> {
        let mut ys = Vec::with_capacity(self.cells());
        for (segment, y) in self.segments.iter().zip(&self.load_y) {
            ys.resize(segment.cells.end, *y);
        }
        ys
    }

    /// The mesh moved so that `origin` becomes `(0, 0)`, then with all lengths multiplied by `factor`.
    #[must_use]
    pub fn normalised(&self, origin: [f64; 2], factor: f64) -> Mesh {
        let along = |values: &[f64]| values.iter().map(|x| (x - origin[0]) * factor).collect();
        let segments = self.segments.iter().map(|s| Segment {
            chord: Chord {
                y: (s.chord.y - origin[1]) * factor,
                dy: s.chord.dy * factor,
                left: (s.chord.left - origin[0]) * factor,
                right: (s.chord.right - origin[0]) * factor,
                ..s.chord
            },
            cells: s.cells.clone(),
        });
        Mesh {
            segments: segments.collect(),
            left: along(&self.left),
            right: along(&self.right),
            node: along(&self.node),
            load_y: self
                .load_y
                .iter()
                .map(|y| (y - origin[1]) * factor)
                .collect(),
        }
    }

    /// Rounds all lengths to multiples of `step`; adjacent cells stay adjacent.
    pub fn round(&mut self, step: f64) {
        let round = |value: &mut f64| *value = (*value / step).round() * step;
        let places = [
            &mut self.left,
            &mut self.right,
            &mut self.node,
            &mut self.load_y,
        ];
        places.into_iter().flatten().for_each(round);
        for segment in &mut self.segments {
            let Chord {
                y, dy, left, right, ..
            } = &mut segment.chord;
            [y, dy, left, right].into_iter().for_each(round);
        }
    }

    /// Whether every segment is exactly its own image under x → −x. The influence of cells on points is then that of their images on the images of the points.
    pub fn is_reversible(&self) -> bool {
        let own_image = |segment: &Segment| {
            let cells = segment.cells.clone();
            let images = cells.clone().rev();
            cells.zip(images).all(|(i, image)| {
                self.left[i] == -self.right[image] && self.node[i] == -self.node[image]
            })
        };
        self.segments.iter().all(own_image)
    }

    /// The y about which segment `j` is the mirror image of segment `m − 1 − j` for every `j`, if there is one and no segment is its own image. Lengths are compared to
    /// 1e-9 of the extent of the mesh, a tolerance that rounding to single precision does not exceed.
    pub fn mirror_line(&self) -> Option<f64> {
        let m = self.segments.len();
        if m == 0 || m % 2 == 1 {
            return None;
        }
        let (first, last) = (&self.segments[0].chord, &self.segments[m - 1].chord);
        let line = 0.5 * (first.y + last.y);
        let extent = self
            .segments
            .iter()
            .map(|s| (s.chord.y - line).abs().max(s.chord.right - s.chord.left));
        let tolerance = 1e-9 * extent.fold(0.0, f64::max);
        let alike = |j: usize| {
            let (a, b) = (&self.segments[j], &self.segments[m - 1 - j]);
            let close = |u: f64, v: f64| (u - v).abs() <= tolerance;
            a.cells.len() == b.cells.len()
                && close(a.chord.y + b.chord.y, 2.0 * line)
                && close(a.chord.dy, b.chord.dy)
                && close(a.chord.left, b.chord.left)
                && close(a.chord.right, b.chord.right)
                && !close(a.chord.y, b.chord.y)
        };
        (0..m / 2).all(alike).then_some(line)
    }
}

/// `count` equal strips between `low` and `high` as `(y, dy)`, by increasing y.
pub fn equal_strips(low: f64, high: f64, count: usize) -> Vec<(f64, f64)> {
    let dy = (high - low) / count as f64;
    let middle = 0.5 * (low + high);
    (0..count)
        .map(|j| (middle + (j as f64 + 0.5 - 0.5 * count as f64) * dy, dy))
        .collect()
}

/// `count` strips between `low` and `high` as `(y, dy)`, narrower about `pole`, a place between −1 and 1.
pub fn strips_about(pole: f64, low: f64, high: f64, count: usize) -> Vec<(f64, f64)> {
    let gathering = PoleGrading { pole, at_ends: 0.0 };
    let mut edges = vec![-1.0];
    for k in 1..=count {
        let last = edges[k - 1];
        edges.push(gathering.place(k as f64 / count as f64, last));
    }
    if pole == 0.0 {
        symmetrise(&mut edges);
    }
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    edges
        .windows(2)
        .map(|e| (middle + 0.5 * half * (e[0] + e[1]), half * (e[1] - e[0])))
        .collect()
}

/// Number of strips, and of cells in a strip, from which a mesh given by the client counts as fine.
pub(crate) const SIDE_GOOD: u32 = 8;

/// An explicit mesh: equal strips, cosine-graded cells along x, no clustering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, Members)]
pub struct MeshSize {
    /// Strips across each patch.
    #[schema(minimum = 1)]
    #[member(1..=1000)]
    pub strips: u32,
    /// Cells along x in each strip.
    #[schema(minimum = 1)]
    #[member(1..=1000)]
    pub cells: u32,
}

/// The part of a strip's mid-line that lies in a patch, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// The patch it belongs to, counted from 0.
    pub patch: usize,
    /// The strip of the patch, counted from 0 in the direction of y.
    pub strip: usize,
    /// y of the strip's mid-line.
    pub y: f64,
    /// Width of the strip.
    pub dy: f64,
    /// Trailing end.
    pub left: f64,
    /// Leading end.
    pub right: f64,
}

impl Chord {
    /// x in mm of the place `−half · cosine` from the middle.
    pub fn along(&self, cosine: f64) -> f64 {
        0.5 * (self.left + self.right) - 0.5 * (self.right - self.left) * cosine
    }
}

/// The observation points of a segment: its nodes, its leading edge, and its last two nodes reflected in that edge.
pub fn observation_points(mesh: &Mesh, segment: &Segment) -> Vec<f64> {
    let mut points = Vec::with_capacity(segment.cells.len() + 3);
    observe(mesh, segment, &mut points);
    points
}

/// As [`observation_points`], but written into `points`, whose contents are replaced.
pub fn observe(mesh: &Mesh, segment: &Segment, points: &mut Vec<f64>) {
    let nodes = &mesh.node[segment.cells.clone()];
    let edge = segment.chord.right;
    let n = nodes.len();
    let last = nodes[n - 1];
    let before = if n > 1 {
        nodes[n - 2]
    } else {
        segment.chord.left
    };
    points.clear();
    points.reserve(n + 3);
    points.extend_from_slice(nodes);
    points.extend([edge, 2.0 * edge - last, 2.0 * edge - before]);
}

#[cfg(test)]
pub(crate) mod samples {
    //! Meshes for unit tests.

    use crate::mesh::Chord;
    use crate::mesh::{Grading, Mesh, equal_strips};

    /// A patch from y = −`half_width` to `half_width` with cosine-graded cells; `ends` returns the trailing and leading end of the chord at y.
    pub(crate) fn mesh_between(
        half_width: f64,
        [strips, cells]: [usize; 2],
        ends: impl Fn(f64) -> [f64; 2],
    ) -> Mesh {
        let strips = equal_strips(-half_width, half_width, strips).into_iter();
        let chords: Vec<Chord> = strips
            .enumerate()
            .map(|(strip, (y, dy))| {
                let [left, right] = ends(y);
                Chord {
                    patch: 0,
                    strip,
                    y,
                    dy,
                    left,
                    right,
                }
            })
            .collect();
        Mesh::new(&chords, &Grading::cosine(cells))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_about_a_pole_follow_their_density() {
        for pole in [0.0, 0.37, -0.95] {
            let gathering = PoleGrading {
                pole,
                at_ends: GATHERED_AT_ENDS,
            };
            let grading = Grading::about(pole, 12);
            let total = gathering.cumulated(1.0);
            for (k, edge) in grading.edges.iter().enumerate() {
                assert!((gathering.cumulated(*edge) / total - k as f64 / 12.0).abs() < 1e-12);
            }
            for (k, node) in grading.nodes.iter().enumerate() {
                assert!(
                    (gathering.cumulated(*node) / total - (k as f64 + 0.5) / 12.0).abs() < 1e-12
                );
            }
            // The density is the derivative of its integral.
            for t in [-0.8, 0.1, 0.6] {
                let slope = (gathering.cumulated(t + 1e-6) - gathering.cumulated(t - 1e-6)) / 2e-6;
                assert!((slope / gathering.density(t) - 1.0).abs() < 1e-6);
            }
            let strips = strips_about(pole, 2.0, 6.0, 9);
            let width: f64 = strips.iter().map(|(_, dy)| dy).sum();
            assert!((width - 4.0).abs() < 1e-12);
            let narrowest = strips.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            assert!((narrowest.0 - (4.0 + 2.0 * pole)).abs() <= narrowest.1);
        }
    }

    fn circle(strips: usize) -> Vec<Chord> {
        equal_strips(-1.0, 1.0, strips)
            .into_iter()
            .enumerate()
            .map(|(strip, (y, dy))| {
                let half = (1.0 - y * y).sqrt();
                Chord {
                    patch: 0,
                    strip,
                    y,
                    dy,
                    left: -half,
                    right: half,
                }
            })
            .collect()
    }

    #[test]
    fn cells_fill_their_chord_without_gaps() {
        for grading in [Grading::cosine(7), Grading::uniform(7)] {
            let mesh = Mesh::new(&circle(4), &grading);
            for segment in &mesh.segments {
                let cells = segment.cells.clone();
                assert!((mesh.left[cells.start] - segment.chord.left).abs() < 1e-15);
                assert!((mesh.right[cells.end - 1] - segment.chord.right).abs() < 1e-15);
                for i in cells.clone() {
                    assert!(mesh.left[i] < mesh.node[i] && mesh.node[i] < mesh.right[i]);
                }
                for i in cells.start..cells.end - 1 {
                    assert!((mesh.right[i] - mesh.left[i + 1]).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn strip_area_converges_to_the_circle_with_second_order() {
        let error = |m: usize| {
            let area: f64 = Mesh::new(&circle(m), &Grading::cosine(4))
                .areas()
                .iter()
                .sum();
            (area - PI).abs()
        };
        assert!(error(32) < error(16) / 2.5, "{} {}", error(16), error(32));
    }

    #[test]
    fn even_strips_on_a_circle_have_a_mirror_line_and_odd_ones_have_none() {
        assert_eq!(
            Mesh::new(&circle(6), &Grading::cosine(5)).mirror_line(),
            Some(0.0)
        );
        assert_eq!(
            Mesh::new(&circle(5), &Grading::cosine(5)).mirror_line(),
            None
        );
    }

    #[test]
    fn a_shifted_strip_breaks_the_mirror_line() {
        let mut chords = circle(6);
        chords[1].left += 1e-6;
        assert_eq!(Mesh::new(&chords, &Grading::cosine(5)).mirror_line(), None);
    }
}
