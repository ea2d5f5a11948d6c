//! What the segments of strips carry: loads cell by cell, and tractions over pressure along them.

use std::f64::consts::PI;

use crate::contact::mesh::strips::Segment;
use crate::contact::numerics::quadrature::RULES;
use crate::contact::post::subsurface::lines::{KnownLines, StripLines};
use crate::contact::post::subsurface::seen_parts::ORDERS;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::strip_mesh::StripMesh;

/// Points of the rule with most of them.
pub(crate) const POINTS_MAX: usize = RULES[ORDERS - 1].len();

/// The loads on a segment of a strip.
#[derive(Debug)]
pub(crate) struct LoadedStrip<'a> {
    pub(crate) segment: &'a Segment,
    pub(crate) lines: StripLines<'a>,
    /// Is it the only segment of its strip? The outline of others is not followed: their cells are rectangles with constant loads.
    pub(crate) alone: bool,
    /// Where the cells end: u.
    pub(crate) places: Vec<f64>,
    /// u of the nodes.
    pub(crate) nodes: Vec<f64>,
    /// Load over the width of the strip in N/mm, cell by cell.
    pub(crate) loads: Vec<f64>,
    /// Tractions over pressure.
    pub(crate) ratios: Vec<[f64; 2]>,
}

/// A point of the quadrature along a strip.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Turn {
    pub(crate) u: f64,
    pub(crate) sine: f64,
    pub(crate) cosine: f64,
    pub(crate) weight: f64,
    /// Traction over pressure on the strip.
    pub(crate) ratio: [f64; 2],
}

impl<'a> LoadedStrip<'a> {
    /// A segment with its loads; tractions come with [`LoadedStrip::loaded`].
    pub(crate) fn new(
        level: &StripMesh,
        segment: &'a Segment,
        lines: StripLines<'a>,
        alone: bool,
        known: &mut KnownLines,
    ) -> LoadedStrip<'a> {
        let (mesh, cells) = (&level.mesh, segment.cells.clone());
        let mut edges = mesh.left[cells.clone()].to_vec();
        edges.push(mesh.right[cells.end - 1]);
        let length = |(k, i): (usize, usize)| level.pressure[i] * (edges[k + 1] - edges[k]);
        let own = cells.clone().enumerate().map(length);
        let nodes = &mesh.node[cells.clone()];
        if !alone {
            return LoadedStrip {
                segment,
                lines,
                alone,
                nodes: nodes.to_vec(),
                loads: own.collect(),
                places: edges,
                ratios: Vec::new(),
            };
        }
        let [left, right] = [edges[0], edges[edges.len() - 1]];
        let (centre, half) = (0.5 * (left + right), 0.5 * (right - left));
        let angle = |x: &f64| ((centre - x) / half).clamp(-1.0, 1.0).acos();
        let mut places: Vec<f64> = edges.iter().map(angle).collect();
        // Exactly the ends of the outline.
        places[0] = 0.0;
        places[cells.len()] = PI;
        let pairs = places.windows(2).zip(own);
        let loads = pairs.map(|(u, own)| lines.load([u[0], u[1]], known).unwrap_or(own));
        LoadedStrip {
            segment,
            lines,
            alone,
            nodes: nodes.iter().map(angle).collect(),
            loads: loads.collect(),
            places,
            ratios: Vec::new(),
        }
    }

    /// The same with the tractions of an answer, which are in `unit` MPa.
    pub(crate) fn loaded(
        mut self,
        level: &StripMesh,
        answer: &LevelAnswer,
        unit: f64,
    ) -> LoadedStrip<'a> {
        let ratio = |i: usize| match level.pressure[i] {
            p if p > 0.0 => [0, 1].map(|k| unit * answer.traction[k][i] / p),
            _ => [0.0; 2],
        };
        self.ratios = self.segment.cells.clone().map(ratio).collect();
        self
    }

    /// Where a cell ends: u.
    pub(crate) fn ends(&self, number: usize) -> [f64; 2] {
        [self.places[number], self.places[number + 1]]
    }

    /// Over a cell that is a rectangle, in MPa.
    pub(crate) fn mean_pressure(&self, number: usize) -> f64 {
        let [x0, x1] = self.ends(number);
        self.loads[number] / (x1 - x0)
    }

    /// The points of a rule between two angles in a cell.
    pub(crate) fn turns(&self, rule: usize, [u0, u1]: [f64; 2], cell: usize) -> [Turn; POINTS_MAX] {
        let mut turns = [Turn::default(); POINTS_MAX];
        for (turn, (at, weight)) in turns.iter_mut().zip(RULES[rule]) {
            let u = 0.5 * (u0 + u1) + 0.5 * (u1 - u0) * at;
            let (sine, cosine) = u.sin_cos();
            *turn = Turn {
                u,
                sine,
                cosine,
                weight: *weight,
                ratio: self.ratio(u, cell),
            };
        }
        turns
    }

    /// Traction over pressure at a place that lies in or near a cell, linear between the nodes and constant beyond the outermost.
    pub(crate) fn ratio(&self, u: f64, cell: usize) -> [f64; 2] {
        let nodes = &self.nodes;
        let mut after = cell.min(nodes.len());
        while after < nodes.len() && nodes[after] < u {
            after += 1;
        }
        while after > 0 && nodes[after - 1] >= u {
            after -= 1;
        }
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
