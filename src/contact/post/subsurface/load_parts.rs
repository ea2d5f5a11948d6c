//! The parts of cells that were looked at, kept from point to point.
//!
//! A part is halved along its larger side, whatever the point: only how far the halving goes depends on the distance. So the parts of a cell
//! are a tree that is the same for all points, and each part is worked out once.

use crate::contact::post::subsurface::lines::{HALVINGS_MAX, StripPart};

/// Parts that are kept; 200 bytes each, so that they take at most 40 MB.
const KEPT_MAX: usize = 200_000;

/// A part of a cell: a piece of the strip between two angles of the outline.
#[derive(Debug, Clone)]
pub struct LoadPart {
    /// The angles.
    pub u: [f64; 2],
    /// The piece across the strip.
    pub part: StripPart,
    /// `[x0, x1, y0, y1]` in mm.
    pub sides: [f64; 4],
    /// The larger of its sides in mm.
    pub size: f64,
    halved_along: bool,
    loads: Option<[f64; 3]>,
    halves: Option<[Option<u32>; 2]>,
}

impl LoadPart {
    /// A part with this width across, which counts the shift of its ends.
    #[must_use]
    pub fn new(u: [f64; 2], part: StripPart, sides: [f64; 4], across: f64) -> LoadPart {
        let along = sides[1] - sides[0];
        // A part that is halved across no more counts with its length alone.
        let halved_along = along >= across || part.level >= HALVINGS_MAX;
        LoadPart {
            u,
            part,
            sides,
            size: if halved_along { along } else { across },
            halved_along,
            loads: None,
            halves: None,
        }
    }

    /// Distance of a point from the rectangle.
    #[must_use]
    pub fn distance(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [x0, x1, y0, y1] = self.sides;
        let outside = |low: f64, high: f64, at: f64| (low - at).max(at - high).max(0.0);
        let (dx, dy) = (outside(x0, x1, x), outside(y0, y1, y));
        (dx * dx + dy * dy + z * z).sqrt()
    }

    fn cut(&self) -> [([f64; 2], StripPart); 2] {
        if self.halved_along {
            let middle = 0.5 * (self.u[0] + self.u[1]);
            return [
                ([self.u[0], middle], self.part),
                ([middle, self.u[1]], self.part),
            ];
        }
        self.part.halves().map(|half| (self.u, half))
    }
}

/// The parts of all cells of a mesh.
#[derive(Debug)]
pub struct LoadParts {
    nodes: Vec<LoadPart>,
    /// Of every cell; the outer `None` means that it was not looked at yet.
    roots: Vec<Option<Option<u32>>>,
}

impl LoadParts {
    /// None yet, of so many cells.
    #[must_use]
    pub fn new(cells: usize) -> LoadParts {
        LoadParts {
            nodes: Vec::new(),
            roots: vec![None; cells],
        }
    }

    /// Forgets all parts if there are too many. Called between points.
    pub fn trim(&mut self) {
        if self.nodes.len() > KEPT_MAX {
            self.nodes.clear();
            self.roots.fill(None);
        }
    }

    /// The part that is the whole cell; it is made if it was not looked at yet.
    pub fn root(&mut self, cell: usize, make: impl FnOnce() -> Option<LoadPart>) -> Option<u32> {
        if let Some(known) = self.roots[cell] {
            return known;
        }
        let number = make().map(|part| self.add(part));
        self.roots[cell] = Some(number);
        number
    }

    /// A part by its number.
    #[must_use]
    pub fn node(&self, number: u32) -> &LoadPart {
        &self.nodes[number as usize]
    }

    /// The halves of a part; nothing of a half that the region does not reach.
    pub fn halves(
        &mut self,
        number: u32,
        make: impl FnOnce([([f64; 2], StripPart); 2]) -> [Option<LoadPart>; 2],
    ) -> [Option<u32>; 2] {
        if let Some(known) = self.node(number).halves {
            return known;
        }
        let halves = make(self.node(number).cut()).map(|half| half.map(|part| self.add(part)));
        self.nodes[number as usize].halves = Some(halves);
        halves
    }

    /// The loads of a part: pressure, and tractions along x and along y.
    pub fn loads(&mut self, number: u32, make: impl FnOnce(&LoadPart) -> [f64; 3]) -> [f64; 3] {
        if let Some(known) = self.node(number).loads {
            return known;
        }
        let loads = make(self.node(number));
        self.nodes[number as usize].loads = Some(loads);
        loads
    }

    fn add(&mut self, part: LoadPart) -> u32 {
        self.nodes.push(part);
        (self.nodes.len() - 1) as u32
    }
}
