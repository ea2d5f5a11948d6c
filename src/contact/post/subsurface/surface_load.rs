//! The loads on the surface of a body, and the stresses that they cause at points below it.
//!
//! Neighbouring strips that cross their patch once are one region, between the angles 0 and π of the true outline. Each cell of other strips is a
//! separate region. The load of a part of a region acts as point loads at the points of Gauss's quadrature, in the angle along x and in y. In these
//! coordinates the pressure of a smooth patch is smooth up to its edge. Traction over pressure is interpolated between the nodes of the cells.
//!
//! The number of points depends on the size of the part over its distance. Parts that are too near for the rule with most points are halved. The shift
//! of the ends of a part between its two sides counts as width, so that refined parts fill the outline. The loads for a point are evaluated in SIMD
//! lanes.

use std::ops::Range;

use crate::half_space::kernels::{LoadPack, Stress, stress};
use crate::mesh::{Chord, Segment, one_strip};
use crate::numerics::quadrature::RULES;
use crate::numerics::simd::LANES;
use crate::post::local_power::SolvedMotion;
use crate::post::subsurface::load_parts::{
    LoadPart, LoadParts, LoadResolution, Node, ORDERS, PartBox,
};
use crate::post::subsurface::loaded_run::{KnownLines, LoadedRun};

/// The loads on one body.
#[derive(Debug)]
pub struct SurfaceLoad<'a> {
    regions: Vec<LoadedRegion<'a>>,
    poisson_ratio: f64,
    /// Origin of x and y in single precision, in mm.
    origin: [f64; 2],
    /// The roots of the tree of parts.
    first_parts: Vec<(LoadPart, PartBox)>,
}

/// A region with loads.
#[derive(Debug)]
enum LoadedRegion<'a> {
    Run(LoadedRun<'a>),
    Cell(LoadedCell),
}

/// The cache of one [`SurfaceLoad`] for all points.
#[derive(Debug)]
pub struct LoadWorkspace {
    parts: LoadParts,
    lines: KnownLines,
    felt: Vec<Range<usize>>,
}

impl<'a> SurfaceLoad<'a> {
    /// The pressures and tractions of a mesh on a body. The tractions on it are those on the lower body times `sign`.
    pub fn new(of: SolvedMotion<'a>, sign: f64, poisson_ratio: f64) -> SurfaceLoad<'a> {
        let (level, footprint) = (of.level, of.footprint);
        let extents = footprint.patches().iter().map(|patch| patch.extent);
        let count = footprint.patches().len() as f64;
        let sum = extents.fold([0.0; 2], |sum, [x0, x1, y0, y1]| {
            [sum[0] + 0.5 * (x0 + x1), sum[1] + 0.5 * (y0 + y1)]
        });
        let unit = sign * level.scale.traction;
        let mut regions = Vec::new();
        for strips in runs(&level.mesh.segments) {
            if strips.len() == 1 || strips[0].chord.strip != strips[1].chord.strip {
                let run = LoadedRun::new(of, unit, (strips, regions.len()));
                regions.push(LoadedRegion::Run(run));
                continue;
            }
            for segment in strips {
                let cells = segment.cells.clone();
                let cell = |i| LoadedCell::new(of, unit, (&segment.chord, i));
                regions.extend(cells.map(cell).map(LoadedRegion::Cell));
            }
        }
        let load = SurfaceLoad {
            first_parts: Vec::new(),
            regions,
            poisson_ratio,
            origin: sum.map(|sum| sum / count),
        };
        let known = &mut KnownLines::default();
        let mut first_parts = Vec::new();
        for (region, loaded) in load.regions.iter().enumerate() {
            let [along, across] = match loaded {
                LoadedRegion::Run(run) => run.halvings,
                LoadedRegion::Cell(_) => [0; 2],
            };
            for part in LoadPart::pieces(region, along, across) {
                first_parts.push((part, load.seen(&part, known)));
            }
        }
        SurfaceLoad {
            first_parts,
            ..load
        }
    }

    /// Makes a workspace, which can be used for this load only.
    pub fn workspace(&self) -> LoadWorkspace {
        LoadWorkspace {
            parts: LoadParts::new(self.first_parts.iter().copied()),
            lines: KnownLines::default(),
            felt: Vec::new(),
        }
    }

    /// The stress at a point `[x, y, depth]` in mm, in axes with z into the body.
    pub fn stress(
        &self,
        [x, y, depth]: [f64; 3],
        resolution: LoadResolution,
        LoadWorkspace { parts, lines, felt }: &mut LoadWorkspace,
    ) -> Stress {
        parts.trim();
        felt.clear();
        let point = [x - self.origin[0], y - self.origin[1], depth].map(|at| at as f32);
        let mut open: Vec<usize> = (0..parts.first).collect();
        while let Some(number) = open.pop() {
            let Node { part, seen, .. } = parts.nodes[number];
            let [along, mut across] = resolution.orders(seen, point);
            if part.is_narrow() {
                across = across.min(ORDERS - 1);
            }
            if along == ORDERS || across == ORDERS {
                open.extend(parts.halves(number, |part| self.seen(part, lines)));
                continue;
            }
            let along = along.max(self.least_rule(part));
            felt.push(parts.quadrature(number, [along, across], |part, to| {
                self.quadrature(part, [along, across], lines, to);
            }));
        }
        stress(&parts.packs, felt, point, self.poisson_ratio)
    }

    /// The bounds of a part.
    fn seen(&self, part: &LoadPart, known: &mut KnownLines) -> PartBox {
        match &self.regions[part.region] {
            LoadedRegion::Run(run) => run.seen(part, self.origin, known),
            LoadedRegion::Cell(cell) => cell.seen(part, self.origin),
        }
    }

    /// The least longitudinal rule of a part at any distance.
    fn least_rule(&self, part: LoadPart) -> usize {
        match &self.regions[part.region] {
            LoadedRegion::Run(_) => LoadedRun::least_rule(part),
            LoadedRegion::Cell(_) => 0,
        }
    }

    /// Appends the point loads of a part for a longitudinal and a lateral rule.
    fn quadrature(
        &self,
        part: &LoadPart,
        rules: [usize; 2],
        known: &mut KnownLines,
        to: &mut Vec<LoadPack>,
    ) {
        match &self.regions[part.region] {
            LoadedRegion::Run(run) => run.quadrature(part, rules, self.origin, known, to),
            LoadedRegion::Cell(cell) => cell.quadrature(part, rules, self.origin, to),
        }
    }
}

/// Divides the segments into runs of neighbouring strips with one segment each, and strips with several segments.
fn runs(segments: &[Segment]) -> Vec<&[Segment]> {
    let strips: Vec<&[Segment]> = segments.chunk_by(one_strip).collect();
    let mut runs = Vec::new();
    let mut first = 0;
    let mut start = 0;
    for k in 0..strips.len() {
        let end = first + strips[k].len();
        let goes_on = strips.get(k + 1).is_some_and(|next| {
            let [here, there] = [&strips[k][0].chord, &next[0].chord];
            let single = strips[k].len() == 1 && next.len() == 1;
            single && here.patch == there.patch && here.strip + 1 == there.strip
        });
        if !goes_on {
            runs.push(&segments[start..end]);
            start = end;
        }
        first = end;
    }
    runs
}

/// The loads on a rectangle.
#[derive(Debug)]
pub(crate) struct LoadedCell {
    /// Ranges of x and y in mm.
    sides: [[f64; 2]; 2],
    /// Longitudinal and lateral load and load into the body, in MPa.
    loads: [f64; 3],
}

impl LoadedCell {
    /// The cell `i` of a strip, with the traction of an answer in units of `unit` MPa.
    pub(crate) fn new(
        SolvedMotion { level, answer, .. }: SolvedMotion,
        unit: f64,
        (chord, i): (&Chord, usize),
    ) -> LoadedCell {
        let [along, across] = [0, 1].map(|k| unit * answer.traction[k][i]);
        let half = 0.5 * chord.dy;
        LoadedCell {
            sides: [
                [level.mesh.left[i], level.mesh.right[i]],
                [chord.y - half, chord.y + half],
            ],
            loads: [along, across, level.pressure[i]],
        }
    }

    fn side(&self, part: &LoadPart, axis: usize, inside: f64) -> f64 {
        let [from, to] = self.sides[axis];
        let piece = [part.along, part.across][axis];
        from + (to - from) * piece.share(inside)
    }

    /// The bounds of a part, in mm from `origin`.
    pub(crate) fn seen(&self, part: &LoadPart, origin: [f64; 2]) -> PartBox {
        let [x, y] =
            [0, 1].map(|axis| [0.0, 1.0].map(|end| self.side(part, axis, end) - origin[axis]));
        PartBox {
            sides: [x[0], x[1], y[0], y[1]].map(|side| side as f32),
            squares: [x, y].map(|[from, to]| ((to - from) * (to - from)) as f32),
        }
    }

    /// Appends the point loads of a part for a longitudinal and a lateral rule, with x and y from `origin`.
    pub(crate) fn quadrature(
        &self,
        part: &LoadPart,
        [along_rule, across_rule]: [usize; 2],
        origin: [f64; 2],
        to: &mut Vec<LoadPack>,
    ) {
        let [x, y] = [0, 1].map(|axis| [0.0, 1.0].map(|end| self.side(part, axis, end)));
        let quarter = 0.25 * (x[1] - x[0]) * (y[1] - y[0]);
        let first = to.len();
        let count = RULES[along_rule].len() * RULES[across_rule].len();
        to.resize(first + count.div_ceil(LANES), LoadPack::default());
        let mut number = 0;
        for (at_y, weight_y) in RULES[across_rule] {
            for (at_x, weight_x) in RULES[along_rule] {
                let area = quarter * weight_x * weight_y;
                let (pack, lane) = (&mut to[first + number / LANES], number % LANES);
                for (axis, ([from, to], at)) in [(x, at_x), (y, at_y)].into_iter().enumerate() {
                    let place = from + 0.5 * (1.0 + at) * (to - from);
                    pack.at[axis][lane] = (place - origin[axis]) as f32;
                }
                for (force, load) in pack.force.iter_mut().zip(self.loads) {
                    force[lane] = (load * area) as f32;
                }
                number += 1;
            }
        }
    }
}
