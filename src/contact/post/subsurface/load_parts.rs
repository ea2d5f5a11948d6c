//! The tree of parts of the loaded regions with their point loads, cached for all points below the surface, and the choice of the quadrature.
//!
//! A part is always halved along its larger side. Only the depth of the halving depends on the distance of a point. The tree is therefore the same for
//! all points, and each part is computed once. The number of quadrature points of a part depends on its size and its distance.

use std::ops::Range;

use crate::half_space::kernels::LoadPack;
use crate::numerics::quadrature::RULES;

/// Most cached parts, most cached packs of point loads, and most cached chords, with 53 MB together. Only memory depends on it.
pub(crate) const KEPT_MAX: usize = 100_000;

/// Most lateral halvings of a region. A part of a patch that is a hundred times as wide as long is then a third of the least allowed depth wide.
const HALVINGS_MAX: u32 = 16;

/// A part of a loaded region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadPart {
    /// Number of the region.
    pub region: usize,
    /// The longitudinal piece: of the angles of the outline, or of the length of a rectangle.
    pub along: Piece,
    /// The lateral piece.
    pub across: Piece,
}

impl LoadPart {
    /// The parts of a region after `along` longitudinal and `across` lateral halvings.
    pub fn pieces(region: usize, along: u32, across: u32) -> impl Iterator<Item = LoadPart> {
        Piece::all(along).flat_map(move |along| {
            Piece::all(across).map(move |across| LoadPart {
                region,
                along,
                across,
            })
        })
    }

    /// Returns whether the part can only be halved longitudinally.
    pub(crate) fn is_narrow(self) -> bool {
        self.across.level >= HALVINGS_MAX
    }

    /// The halves of the part, longitudinal or lateral ones.
    pub fn halves(self, along: bool) -> [LoadPart; 2] {
        if along {
            return self.along.halves().map(|along| LoadPart { along, ..self });
        }
        self.across
            .halves()
            .map(|across| LoadPart { across, ..self })
    }
}

/// Marks packs that were not computed yet.
const NONE: [u32; 2] = [u32::MAX; 2];

/// A part with the values computed for it.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) part: LoadPart,
    /// Its bounds.
    pub(crate) seen: PartBox,
    /// Range of its packs, by the longitudinal and the lateral rule; [`NONE`] if they were not computed yet.
    packs: [[[u32; 2]; ORDERS]; ORDERS],
    /// The number of its first half. The second half is the next node.
    halves: Option<u32>,
}

/// The tree of the parts of all regions. The roots come first.
#[derive(Debug)]
pub(crate) struct LoadParts {
    pub(crate) nodes: Vec<Node>,
    /// Number of roots.
    pub(crate) first: usize,
    /// All packs.
    pub(crate) packs: Vec<LoadPack>,
}

impl LoadParts {
    /// Makes a tree with these roots.
    pub(crate) fn new(first: impl Iterator<Item = (LoadPart, PartBox)>) -> LoadParts {
        let nodes: Vec<Node> = first.map(|(part, seen)| Node::new(part, seen)).collect();
        LoadParts {
            first: nodes.len(),
            nodes,
            packs: Vec::new(),
        }
    }

    /// Removes all parts except the roots, and all packs, if there are too many. It is called between points.
    pub(crate) fn trim(&mut self) {
        if self.nodes.len() > KEPT_MAX.max(2 * self.first) || self.packs.len() > KEPT_MAX {
            self.nodes.truncate(self.first);
            for node in &mut self.nodes {
                *node = Node::new(node.part, node.seen);
            }
            self.packs.clear();
        }
    }

    /// The halves of a part.
    pub(crate) fn halves(
        &mut self,
        number: usize,
        mut make: impl FnMut(&LoadPart) -> PartBox,
    ) -> [usize; 2] {
        let first = if let Some(first) = self.nodes[number].halves {
            first as usize
        } else {
            let Node { part, seen, .. } = self.nodes[number];
            let along = seen.squares[0] >= seen.squares[1] || part.is_narrow();
            let first = self.nodes.len();
            for half in part.halves(along) {
                self.nodes.push(Node::new(half, make(&half)));
            }
            self.nodes[number].halves = Some(first as u32);
            first
        };
        [first, first + 1]
    }

    /// The packs of a part for a longitudinal and a lateral rule.
    pub(crate) fn quadrature(
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
    /// Number of halvings of the interval.
    pub level: u32,
    /// Number of the piece, counted from the beginning of the interval.
    pub index: u32,
}

impl Piece {
    /// All pieces after `level` halvings.
    pub fn all(level: u32) -> impl Iterator<Item = Piece> {
        (0..1 << level).map(move |index| Piece { level, index })
    }

    /// The halves of the piece.
    pub fn halves(self) -> [Piece; 2] {
        [0, 1].map(|k| Piece {
            level: self.level + 1,
            index: 2 * self.index + k,
        })
    }

    /// Converts a position in the piece, from 0 to 1, to a position in the interval.
    pub fn share(self, inside: f64) -> f64 {
        (f64::from(self.index) + inside) * self.width()
    }

    /// Width relative to that of the interval.
    pub fn width(self) -> f64 {
        1.0 / f64::from(1_u32 << self.level)
    }
}

/// Number of quadrature rules. This number instead of that of a rule means that a part has to be halved.
pub const ORDERS: usize = RULES.len();

/// The resolution of the loads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadResolution {
    /// Ratios of size to distance from which the next rule is used; from the last one a part is halved. Errors of Gauss's rule decrease with the
    /// distance to the power of twice its number of points.
    pub sizes: [f32; ORDERS],
}

impl LoadResolution {
    /// Resolution of reported stresses.
    ///
    /// They differ by up to 0.0016 of the largest pressure, and by 0.0001 in the median, from those with ratios of 0.05 to 0.67 and a quadrature cell by
    /// cell. This holds on the 18 ellipses of `cargo bench --bench stress -- --only after`, three in full slip and four at other targets. On two gaps
    /// the difference is up to 0.0009. There were 3500 random points each, in depths from 0.012 to 4 half-widths. For a constant load on a square,
    /// ratios of 0.62, 1.4 and 3 give errors of 0.001.
    pub const FINE: LoadResolution = LoadResolution {
        sizes: [0.5, 1.0, 2.6],
    };
    /// Resolution of scans before a search. The errors at the same points are 0.001 in the median and at most 0.08.
    pub const COARSE: LoadResolution = LoadResolution {
        sizes: [1.2, 2.5, 5.5],
    };
}

/// The bounds of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartBox {
    /// `[x0, x1, y0, y1]` in mm.
    pub sides: [f32; 4],
    /// Squares of its longitudinal and lateral size in mm².
    pub squares: [f32; 2],
}

impl LoadResolution {
    /// The longitudinal and the lateral rule of a part for a point `[x, y, z]` in mm; [`ORDERS`] if the part has to be halved.
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
        // The part is twice as long as wide.
        assert!(seen.iter().all(|[along, across]| along >= across));
    }
}
