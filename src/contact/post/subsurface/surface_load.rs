//! The loads on the surface of a body, cell by cell, and the stress that they cause at a point below it.
//!
//! Every cell is a rectangle with constant pressure and traction, whose stress is known in closed form. Seen from near, such steps are
//! artefacts of the mesh. So cells that are large beside their distance are halved, along or across, until they are not: a part of a
//! cell carries the mean pressure over its piece of the true outline, and that times traction over pressure, which is interpolated
//! between the cells. The shift of its ends between its two sides counts as width, so that refined cells fill the outline.

use std::f64::consts::PI;

use crate::contact::half_space::corner_sums::CornerSums;
use crate::contact::half_space::rectangle_stress::Stress;
use crate::contact::mesh::strips::Segment;
use crate::contact::normal::footprint::Footprint;
use crate::contact::post::subsurface::lines::{StripLines, StripPart};
use crate::contact::post::subsurface::load_parts::{LoadPart, LoadParts};
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::strip_mesh::StripMesh;

/// How finely the loads are resolved, by size over distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadResolution {
    /// Cells larger than this are halved.
    pub halved_from: f64,
    /// Neighbours along a strip that together are not larger than this act as one.
    pub joined_to: f64,
}

impl LoadResolution {
    /// For stresses that are answered: the largest error in the reference cases is 0.36 % of the largest pressure on ellipses and 1.0 % under
    /// a gap of two radii (`cargo test --test physics -- stresses_are --nocapture`).
    pub const FINE: LoadResolution = LoadResolution {
        halved_from: 0.25,
        joined_to: 0.15,
    };
    /// For the search of the worst point: a few per cent.
    pub const COARSE: LoadResolution = LoadResolution {
        halved_from: 1.0,
        joined_to: 0.3,
    };
}

/// The loads on one body.
#[derive(Debug)]
pub struct SurfaceLoad<'a> {
    strips: Vec<LoadedStrip<'a>>,
    footprint: &'a Footprint,
    poisson_ratio: f64,
    /// Cells of the mesh.
    cells: usize,
}

/// What is kept from point to point of one [`SurfaceLoad`]: buffers, and the parts of cells that were worked out. The caller owns it.
#[derive(Debug)]
pub struct LoadWorkspace {
    corners: CornerSums,
    parts: LoadParts,
}

/// The loads on a segment of a strip.
#[derive(Debug)]
struct LoadedStrip<'a> {
    segment: &'a Segment,
    /// The number of its first cell in the mesh.
    first_root: usize,
    lines: StripLines<'a>,
    /// Is it the only segment of its strip? Others are not refined.
    alone: bool,
    /// Edges of the cells: x in mm, and the angle u with `x = centre − half cos u`.
    edges: Vec<f64>,
    angles: Vec<f64>,
    /// u of the nodes.
    nodes: Vec<f64>,
    /// Larger of width across and skew, cell by cell.
    widths: Vec<f64>,
    /// Pressure and tractions on the body in MPa, cell by cell.
    loads: Vec<[f64; 3]>,
    /// Tractions over pressure.
    ratios: Vec<[f64; 2]>,
}

impl<'a> SurfaceLoad<'a> {
    /// The pressures and tractions of a level on a body; tractions on the lower body times `sign` act on it.
    #[must_use]
    pub fn new(
        level: &'a StripMesh,
        footprint: &'a Footprint,
        answer: &LevelAnswer,
        sign: f64,
        poisson_ratio: f64,
    ) -> SurfaceLoad<'a> {
        let strips = &level.mesh.segments;
        let alike = |a: &Segment, b: &Segment| {
            a.chord.patch == b.chord.patch && a.chord.strip == b.chord.strip
        };
        let strip = |segment: &'a Segment| {
            let alone = strips.iter().filter(|other| alike(segment, other)).count() == 1;
            LoadedStrip::new(level, footprint, segment, alone, answer, sign)
        };
        let cells = level.mesh.cells();
        SurfaceLoad {
            strips: strips.iter().map(strip).collect(),
            footprint,
            poisson_ratio,
            cells,
        }
    }

    /// A workspace for this load, which serves no other.
    #[must_use]
    pub fn workspace(&self) -> LoadWorkspace {
        LoadWorkspace {
            corners: CornerSums::default(),
            parts: LoadParts::new(self.cells),
        }
    }

    /// The stress at `[x, y, depth]` in mm, in axes with z into the body.
    pub fn stress(
        &self,
        at: [f64; 3],
        resolution: LoadResolution,
        workspace: &mut LoadWorkspace,
    ) -> Stress {
        workspace.corners.clear();
        workspace.parts.trim();
        for j in 0..self.strips.len() {
            self.push_strip(j, at, resolution, workspace);
        }
        workspace.corners.stress(at[2], self.poisson_ratio)
    }

    fn push_strip(
        &self,
        j: usize,
        at: [f64; 3],
        resolution: LoadResolution,
        workspace: &mut LoadWorkspace,
    ) {
        let corners = &mut workspace.corners;
        let strip = &self.strips[j];
        let chord = &strip.segment.chord;
        let sides = [chord.y - 0.5 * chord.dy, chord.y + 0.5 * chord.dy];
        let across = (sides[0] - at[1]).max(at[1] - sides[1]).max(0.0);
        let off_line = across.hypot(at[2]);
        // Where rectangles meet, the difference of their loads counts.
        let mut push_edge = |place: usize, load: [f64; 3]| {
            let p = at[0] - strip.edges[place];
            corners.push(p, at[1] - sides[0], load);
            corners.push(p, at[1] - sides[1], load.map(|load| -load));
        };
        let mut near = Vec::new();
        let mut before = [0.0; 3];
        let cells = strip.loads.len();
        let mut k = 0;
        while k < cells {
            let distance = |k: usize| {
                let along = (strip.edges[k] - at[0]).max(at[0] - strip.edges[k + 1]);
                along.max(0.0).hypot(off_line)
            };
            let size = |k: usize| strip.widths[k].max(strip.edges[k + 1] - strip.edges[k]);
            if strip.alone && size(k) > resolution.halved_from * distance(k) {
                push_edge(k, before.map(|load| -load));
                before = [0.0; 3];
                near.push(k);
                k += 1;
                continue;
            }
            let first = k;
            let width = |last: usize| strip.edges[last + 1] - strip.edges[first];
            let mut load = [0.0; 3];
            loop {
                let own = strip.edges[k + 1] - strip.edges[k];
                for (sum, load) in load.iter_mut().zip(strip.loads[k]) {
                    *sum += load * own;
                }
                k += 1;
                let joins = |k: usize| {
                    width(k) <= resolution.joined_to * distance(k).min(distance(first))
                        && (!strip.alone || size(k) <= resolution.halved_from * distance(k))
                };
                if k >= cells || !joins(k) {
                    break;
                }
            }
            let joined = width(k - 1);
            let load = load.map(|load| load / joined);
            push_edge(first, [0, 1, 2].map(|c| load[c] - before[c]));
            before = load;
        }
        push_edge(cells, before.map(|load| -load));
        for k in near {
            self.push_parts(j, k, at, resolution, workspace);
        }
    }

    /// A cell of a strip from near: its parts down to those that are small beside their distance.
    fn push_parts(
        &self,
        j: usize,
        cell: usize,
        at: [f64; 3],
        resolution: LoadResolution,
        LoadWorkspace { corners, parts }: &mut LoadWorkspace,
    ) {
        let root = self.strips[j].first_root + cell;
        let u = [0, 1].map(|k| self.strips[j].angles[cell + k]);
        let mut open = match parts.root(root, || self.part(j, u, StripPart::WHOLE)) {
            Some(first) => vec![first],
            None => return,
        };
        while let Some(number) = open.pop() {
            let node = parts.node(number);
            if node.size > resolution.halved_from * node.distance(at) {
                let cut = |halves: [([f64; 2], StripPart); 2]| {
                    halves.map(|(u, part)| self.part(j, u, part))
                };
                open.extend(parts.halves(number, cut).into_iter().flatten());
                continue;
            }
            let loads = parts.loads(number, |node| self.carried(j, node));
            let sides = parts.node(number).sides;
            corners.push_rectangle([at[0], at[1]], sides, loads);
        }
    }

    /// A part of a strip over the angles `u`; nothing where the region does not reach it.
    fn part(&self, j: usize, u: [f64; 2], part: StripPart) -> Option<LoadPart> {
        let lines = &self.strips[j].lines;
        let chord = lines.middle(part)?;
        let centre = 0.5 * (chord.left + chord.right);
        let half = 0.5 * (chord.right - chord.left);
        let [x0, x1] = u.map(|u| centre - half * u.cos());
        let [y0, y1] = lines.sides(part);
        let across = (y1 - y0).max(lines.skew(part, u));
        Some(LoadPart::new(u, part, [x0, x1, y0, y1], across))
    }

    /// Mean pressure of a part, and that times traction over pressure.
    fn carried(&self, j: usize, part: &LoadPart) -> [f64; 3] {
        let Some(chord) = self.strips[j].lines.middle(part.part) else {
            return [0.0; 3];
        };
        let [x0, x1, ..] = part.sides;
        let pressure = self.footprint.mean_pressure(&chord, x0, x1);
        let ratio = self.ratio(j, 0.5 * (part.u[0] + part.u[1]), chord.y);
        [pressure, pressure * ratio[0], pressure * ratio[1]]
    }

    /// Traction over pressure, linear between the nodes in u and y, and constant beyond the outermost.
    fn ratio(&self, j: usize, u: f64, y: f64) -> [f64; 2] {
        let own = &self.strips[j];
        let here = own.ratio(u);
        let from = own.segment.chord.y;
        let beside = if y < from {
            j.checked_sub(1)
        } else {
            Some(j + 1)
        };
        let beside = beside.and_then(|k| self.strips.get(k));
        let patch = own.segment.chord.patch;
        let Some(other) = beside.filter(|s| s.alone && s.segment.chord.patch == patch) else {
            return here;
        };
        let share = (y - from) / (other.segment.chord.y - from);
        let there = other.ratio(u);
        [0, 1].map(|k| (1.0 - share) * here[k] + share * there[k])
    }
}

impl<'a> LoadedStrip<'a> {
    fn new(
        level: &'a StripMesh,
        footprint: &'a Footprint,
        segment: &'a Segment,
        alone: bool,
        answer: &LevelAnswer,
        sign: f64,
    ) -> LoadedStrip<'a> {
        let (mesh, cells) = (&level.mesh, segment.cells.clone());
        let mut edges = mesh.left[cells.clone()].to_vec();
        edges.push(mesh.right[cells.end - 1]);
        let [left, right] = [edges[0], edges[edges.len() - 1]];
        let (centre, half) = (0.5 * (left + right), 0.5 * (right - left));
        let angle = |x: &f64| ((centre - x) / half).clamp(-1.0, 1.0).acos();
        let mut angles: Vec<f64> = edges.iter().map(angle).collect();
        // Exactly the ends of the outline.
        angles[0] = 0.0;
        angles[cells.len()] = PI;
        let lines = StripLines::new(footprint, &segment.chord);
        let widths = angles.windows(2).map(|u| {
            segment
                .chord
                .dy
                .max(lines.skew(StripPart::WHOLE, [u[0], u[1]]))
        });
        let unit = sign * level.scale.traction;
        let ratio = |i: usize| match level.pressure[i] {
            p if p > 0.0 => [0, 1].map(|k| unit * answer.traction[k][i] / p),
            _ => [0.0; 2],
        };
        let ratios: Vec<[f64; 2]> = cells.clone().map(ratio).collect();
        let load = |(k, i): (usize, usize)| {
            let u = [angles[k], angles[k + 1]];
            let carried = alone.then(|| lines.load(u)).flatten();
            let length = edges[k + 1] - edges[k];
            let pressure = carried.map_or(level.pressure[i], |load| load / length);
            [pressure, pressure * ratios[k][0], pressure * ratios[k][1]]
        };
        let loads: Vec<[f64; 3]> = cells.clone().enumerate().map(load).collect();
        LoadedStrip {
            segment,
            first_root: segment.cells.start,
            alone,
            nodes: mesh.node[cells].iter().map(angle).collect(),
            widths: widths.collect(),
            ratios,
            lines,
            edges,
            angles,
            loads,
        }
    }

    fn ratio(&self, u: f64) -> [f64; 2] {
        let after = self.nodes.partition_point(|node| *node < u);
        if after == 0 {
            return self.ratios[0];
        }
        if after == self.nodes.len() {
            return self.ratios[after - 1];
        }
        let (low, high) = (self.nodes[after - 1], self.nodes[after]);
        let share = (u - low) / (high - low);
        [0, 1].map(|k| (1.0 - share) * self.ratios[after - 1][k] + share * self.ratios[after][k])
    }
}
