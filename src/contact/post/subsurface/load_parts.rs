//! The parts of cells that were looked at, and their points of quadrature, kept from point to point.
//!
//! A part is halved along its larger side, whatever the point: only how far the halving goes depends on the distance. So the parts of a cell
//! are a tree that is the same for all points, and each part is worked out once.

use std::ops::Range;

use crate::contact::half_space::point_loads::PointLoad;
use crate::contact::post::subsurface::lines::{HALVINGS_MAX, StripPart};
use crate::contact::post::subsurface::seen_parts::{ORDERS, PartBox};

/// Parts, and points of quadrature, that are kept, in 60 MB together; only memory depends on them.
const PARTS_MAX: usize = 100_000;
/// See [`PARTS_MAX`].
const POINTS_MAX: usize = 1_000_000;

/// A part of a cell: a piece of the strip between two places along it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPart {
    /// The cell, and the strip it belongs to.
    pub cell: usize,
    /// See `cell`.
    pub strip: usize,
    /// The places: angles of the outline, or x in mm where the strip is not refined.
    pub u: [f64; 2],
    /// The piece across the strip.
    pub piece: StripPart,
}

impl LoadPart {
    /// Its halves, along the strip or across it.
    #[must_use]
    pub fn halves(self, along: bool) -> [LoadPart; 2] {
        if along {
            let [from, to] = self.u;
            let middle = 0.5 * (from + to);
            return [[from, middle], [middle, to]].map(|u| LoadPart { u, ..self });
        }
        self.piece.halves().map(|piece| LoadPart { piece, ..self })
    }
}

/// A part with what was worked out for it.
#[derive(Debug)]
struct Node {
    part: LoadPart,
    seen: PartBox,
    /// Points of quadrature, by the rules along and across.
    points: [[Option<[u32; 2]>; ORDERS]; ORDERS],
    /// The first of its halves, of which the second is the next node.
    halves: Option<u32>,
}

/// The parts of all cells of a mesh; the first ones are the cells.
#[derive(Debug)]
pub struct LoadParts {
    nodes: Vec<Node>,
    cells: usize,
    points: Vec<PointLoad>,
}

impl LoadParts {
    /// The whole cells.
    #[must_use]
    pub fn new(cells: impl Iterator<Item = (LoadPart, PartBox)>) -> LoadParts {
        let nodes: Vec<Node> = cells.map(|(part, seen)| Node::new(part, seen)).collect();
        LoadParts {
            cells: nodes.len(),
            nodes,
            points: Vec::new(),
        }
    }

    /// Forgets all parts of cells and all points if there are too many. Called between points.
    pub fn trim(&mut self) {
        if self.nodes.len() > PARTS_MAX.max(2 * self.cells) || self.points.len() > POINTS_MAX {
            self.nodes.truncate(self.cells);
            for node in &mut self.nodes {
                *node = Node::new(node.part, node.seen);
            }
            self.points.clear();
        }
    }

    /// Number of cells.
    #[must_use]
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// How large a part is.
    #[must_use]
    pub fn seen(&self, number: usize) -> PartBox {
        self.nodes[number].seen
    }

    /// Can only halving along the strip make a part smaller?
    #[must_use]
    pub fn narrow(&self, number: usize) -> bool {
        self.nodes[number].part.piece.level >= HALVINGS_MAX
    }

    /// All points of quadrature.
    #[must_use]
    pub fn points(&self) -> &[PointLoad] {
        &self.points
    }

    /// The halves of a part.
    pub fn halves(
        &mut self,
        number: usize,
        mut make: impl FnMut(&LoadPart) -> PartBox,
    ) -> [usize; 2] {
        let first = if let Some(first) = self.nodes[number].halves {
            first as usize
        } else {
            let Node { part, seen, .. } = self.nodes[number];
            let along = seen.squares[0] >= seen.squares[1] || self.narrow(number);
            let first = self.nodes.len();
            for half in part.halves(along) {
                self.nodes.push(Node::new(half, make(&half)));
            }
            self.nodes[number].halves = Some(first as u32);
            first
        };
        [first, first + 1]
    }

    /// The points of a part for these rules along and across.
    pub fn quadrature(
        &mut self,
        number: usize,
        [along, across]: [usize; 2],
        make: impl FnOnce(&LoadPart, &mut Vec<PointLoad>),
    ) -> Range<usize> {
        let node = &mut self.nodes[number];
        let [first, end] = *node.points[along][across].get_or_insert_with(|| {
            let first = self.points.len();
            make(&node.part, &mut self.points);
            [first as u32, self.points.len() as u32]
        });
        first as usize..end as usize
    }
}

impl Node {
    fn new(part: LoadPart, seen: PartBox) -> Node {
        Node {
            part,
            seen,
            points: [[None; ORDERS]; ORDERS],
            halves: None,
        }
    }
}
