//! The parts of regions that were looked at, and their point loads, kept from point to point.
//!
//! A part is halved along its larger side, whatever the point: only how far the halving goes depends on the distance. So the parts of a region
//! are a tree that is the same for all points, and each part is worked out once.
//!
//! Chooses the quadrature of each part of the loads by its size and its distance from a point: how many points along and across.

use std::ops::Range;

use crate::half_space::kernels::LoadPack;
use crate::numerics::quadrature::RULES;

/// Parts, and packs of point loads, that are kept, in 45 MB together; only memory depends on it.
const KEPT_MAX: usize = 100_000;

/// A region is halved across at most so often: of a patch a hundred times as wide as long a part is then a third of the least depth that is
/// answered wide.
const HALVINGS_MAX: u32 = 16;

/// A part of a loaded region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPart {
    /// The region.
    pub region: usize,
    /// The piece of it along: of the angles of the outline, or of the length of a rectangle.
    pub along: Piece,
    /// The piece across.
    pub across: Piece,
}

impl LoadPart {
    /// The parts of a region after so many halvings along and across.
    pub fn pieces(region: usize, along: u32, across: u32) -> impl Iterator<Item = LoadPart> {
        Piece::all(along).flat_map(move |along| {
            Piece::all(across).map(move |across| LoadPart {
                region,
                along,
                across,
            })
        })
    }

    /// Its halves, along the strips or across them.
    pub fn halves(self, along: bool) -> [LoadPart; 2] {
        if along {
            return self.along.halves().map(|along| LoadPart { along, ..self });
        }
        self.across
            .halves()
            .map(|across| LoadPart { across, ..self })
    }
}

/// Packs that were not asked for.
const NONE: [u32; 2] = [u32::MAX; 2];

/// A part with what was worked out for it.
#[derive(Debug)]
struct Node {
    part: LoadPart,
    seen: PartBox,
    /// The first and the end of its packs, by the rules along and across; [`NONE`] where they were not asked for.
    packs: [[[u32; 2]; ORDERS]; ORDERS],
    /// The first of its halves, of which the second is the next node.
    halves: Option<u32>,
}

/// The parts of all regions; the first ones are those to begin with.
#[derive(Debug)]
pub struct LoadParts {
    nodes: Vec<Node>,
    first: usize,
    packs: Vec<LoadPack>,
}

impl LoadParts {
    /// The parts to begin with.
    pub fn new(first: impl Iterator<Item = (LoadPart, PartBox)>) -> LoadParts {
        let nodes: Vec<Node> = first.map(|(part, seen)| Node::new(part, seen)).collect();
        LoadParts {
            first: nodes.len(),
            nodes,
            packs: Vec::new(),
        }
    }

    /// Forgets all later parts and all packs if there are too many. Called between points.
    pub fn trim(&mut self) {
        if self.nodes.len() > KEPT_MAX.max(2 * self.first) || self.packs.len() > KEPT_MAX {
            self.nodes.truncate(self.first);
            for node in &mut self.nodes {
                *node = Node::new(node.part, node.seen);
            }
            self.packs.clear();
        }
    }

    /// Number of parts to begin with.
    pub fn first(&self) -> usize {
        self.first
    }

    /// A part.
    pub fn part(&self, number: usize) -> LoadPart {
        self.nodes[number].part
    }

    /// How large a part is.
    pub fn seen(&self, number: usize) -> PartBox {
        self.nodes[number].seen
    }

    /// Can only halving along the strips make a part smaller?
    pub fn narrow(&self, number: usize) -> bool {
        self.nodes[number].part.across.level >= HALVINGS_MAX
    }

    /// All packs.
    pub fn packs(&self) -> &[LoadPack] {
        &self.packs
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

    /// The packs of a part for these rules along and across.
    pub fn quadrature(
        &mut self,
        number: usize,
        [along, across]: [usize; 2],
        make: impl FnOnce(&LoadPart, &mut Vec<LoadPack>),
    ) -> Range<usize> {
        let node = &mut self.nodes[number];
        let known = &mut node.packs[along][across];
        if *known == NONE {
            let first = self.packs.len();
            make(&node.part, &mut self.packs);
            *known = [first as u32, self.packs.len() as u32];
        }
        let [first, end] = *known;
        first as usize..end as usize
    }
}

impl Node {
    fn new(part: LoadPart, seen: PartBox) -> Node {
        Node {
            part,
            seen,
            packs: [[NONE; ORDERS]; ORDERS],
            halves: None,
        }
    }
}

/// The `index`-th of the `2^level` equal pieces of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// How often the interval was halved.
    pub level: u32,
    /// Which piece, counted from the beginning of the interval.
    pub index: u32,
}

impl Piece {
    /// All pieces after so many halvings.
    pub fn all(level: u32) -> impl Iterator<Item = Piece> {
        (0..1 << level).map(move |index| Piece { level, index })
    }

    /// Its halves.
    pub fn halves(self) -> [Piece; 2] {
        [0, 1].map(|k| Piece {
            level: self.level + 1,
            index: 2 * self.index + k,
        })
    }

    /// A place in the piece, from 0 to 1, as one in the interval.
    pub fn share(self, inside: f64) -> f64 {
        (f64::from(self.index) + inside) * self.width()
    }

    /// Its width over that of the interval.
    pub fn width(self) -> f64 {
        1.0 / f64::from(1_u32 << self.level)
    }
}

/// Number of rules; one above the last asks for a division of the part.
pub const ORDERS: usize = RULES.len();
/// How finely the loads are resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadResolution {
    /// Sizes over distance from which on the rule with the next number of points is used, and from the last on a part is halved. Errors of
    /// Gauss's rule fall with the distance to the power of twice its points.
    pub sizes: [f32; ORDERS],
}

impl LoadResolution {
    /// For stresses that are answered: within 0.0016 of the largest pressure of those with sizes of 0.05 to 0.67 and a quadrature cell by cell, and within
    /// 0.0001 in the median, on the 18 ellipses of `cargo bench --bench stress -- --only after`, three in full slip and four at other targets; within
    /// 0.0009 on two gaps; at 3500 random points each in depths from 0.012 to 4 half-widths. Of a constant load on a square, 0.62, 1.4 and 3 leave 0.001.
    pub const FINE: LoadResolution = LoadResolution {
        sizes: [0.5, 1.0, 2.6],
    };
    /// For scans before a search: within 0.001 in the median on the same points, and 0.08 at the worst.
    pub const COARSE: LoadResolution = LoadResolution {
        sizes: [1.2, 2.5, 5.5],
    };
}

/// What decides how a part is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartBox {
    /// `[x0, x1, y0, y1]` in mm.
    pub sides: [f32; 4],
    /// Squares of its lengths along and across in mm².
    pub squares: [f32; 2],
}

impl LoadResolution {
    /// Which rules a part needs along and across as seen from a point `[x, y, z]` in mm; [`ORDERS`] where it has to be divided.
    pub fn orders(&self, PartBox { sides, squares }: PartBox, [x, y, z]: [f32; 3]) -> [usize; 2] {
        let [x0, x1, y0, y1] = sides;
        let dx = (x0 - x).max(x - x1).max(0.0);
        let dy = (y0 - y).max(y - y1).max(0.0);
        let distance = dx * dx + dy * dy + z * z;
        let sizes = self.sizes.iter();
        squares.map(|own| {
            sizes
                .clone()
                .filter(|size| own > *size * *size * distance)
                .count()
        })
    }
}

#[cfg(test)]
mod seen_parts_tests {
    use super::*;

    #[test]
    fn near_parts_need_more_points_than_far_ones() {
        let part = PartBox {
            sides: [-1.0, 1.0, -0.5, 0.5],
            squares: [4.0, 1.0],
        };
        let depths = (0..16).map(|k| 0.1 * 1.6_f32.powi(k));
        let seen: Vec<[usize; 2]> = depths
            .map(|depth| LoadResolution::FINE.orders(part, [0.0, 0.0, depth]))
            .collect();
        assert_eq!((seen[0], seen[15]), ([ORDERS; 2], [0; 2]));
        for pair in seen.windows(2) {
            assert!(pair[0][0] >= pair[1][0] && pair[0][1] >= pair[1][1]);
        }
        // Along it is twice as long as across.
        assert!(seen.iter().all(|[along, across]| along >= across));
    }
}
