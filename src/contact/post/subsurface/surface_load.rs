//! The loads on the surface of a body, and the stresses that they cause at points below it.
//!
//! Every cell is a piece of a strip between two angles of the true outline. What it carries acts as point loads at the points of Gauss's
//! quadrature, in the angle along and in y across, where the pressure of a smooth patch is smooth up to its edge; traction over pressure is
//! interpolated between the cells. How many points there are follows from the size of the cell over its distance; cells that are too near for
//! the rule with most points are halved until they are not. The shift of its ends between its two sides counts as width, so that refined cells
//! fill the outline.

use crate::contact::half_space::point_loads::{
    FeltLoads, LANES, Lanes, PointLoad, Stress, stresses,
};
use crate::contact::mesh::chord::Chord;
use crate::contact::mesh::strips::Segment;
use crate::contact::normal::footprint::Footprint;
use crate::contact::numerics::quadrature::RULES;
use crate::contact::post::subsurface::blocks;
use crate::contact::post::subsurface::lines::{KnownLines, StripLines, StripPart};
use crate::contact::post::subsurface::load_parts::{LoadPart, LoadParts};
use crate::contact::post::subsurface::loaded_strip::{LoadedStrip, POINTS_MAX};
use crate::contact::post::subsurface::seen_parts::{
    LoadResolution, ORDERS, PartBox, PartCodes, look, orders,
};
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::strip_mesh::StripMesh;

/// The loads on one body.
#[derive(Debug)]
pub struct SurfaceLoad<'a> {
    strips: Vec<LoadedStrip<'a>>,
    footprint: &'a Footprint,
    poisson_ratio: f64,
    /// Where single precision counts x and y from, in mm.
    origin: [f64; 2],
    /// The whole cells.
    cells: Vec<(LoadPart, PartBox)>,
}

/// What is kept from point to point of one [`SurfaceLoad`]. The caller owns it.
#[derive(Debug)]
pub struct LoadWorkspace {
    parts: LoadParts,
    lines: KnownLines,
    codes: Vec<PartCodes>,
    felt: Vec<FeltLoads>,
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
        let segments = &level.mesh.segments;
        let alike = |a: &Segment, b: &Segment| {
            a.chord.patch == b.chord.patch && a.chord.strip == b.chord.strip
        };
        let extents = footprint.patches().iter().map(|patch| patch.extent);
        let count = footprint.patches().len() as f64;
        let sum = extents.fold([0.0; 2], |sum, [x0, x1, y0, y1]| {
            [sum[0] + 0.5 * (x0 + x1), sum[1] + 0.5 * (y0 + y1)]
        });
        let mut load = SurfaceLoad {
            strips: Vec::with_capacity(segments.len()),
            footprint,
            poisson_ratio,
            origin: sum.map(|sum| sum / count),
            cells: Vec::with_capacity(level.mesh.cells()),
        };
        let known = &mut KnownLines::default();
        let unit = sign * level.scale.traction;
        for (number, segment) in segments.iter().enumerate() {
            let beside = segments.iter().filter(|other| alike(segment, other));
            let lines = StripLines::new(footprint, &segment.chord, number);
            let alone = beside.count() == 1;
            let strip = LoadedStrip::new(level, segment, lines, alone, known);
            load.strips.push(strip.loaded(level, answer, unit));
            for (k, cell) in segment.cells.clone().enumerate() {
                let part = LoadPart {
                    cell,
                    strip: number,
                    u: load.strips[number].ends(k),
                    piece: StripPart::WHOLE,
                };
                let seen = load.seen(&part, known);
                load.cells.push((part, seen));
            }
        }
        load
    }

    /// A workspace for this load, which serves no other.
    #[must_use]
    pub fn workspace(&self) -> LoadWorkspace {
        LoadWorkspace {
            parts: LoadParts::new(self.cells.iter().copied()),
            lines: KnownLines::default(),
            codes: Vec::new(),
            felt: Vec::new(),
        }
    }

    /// The stress at one place, see [`SurfaceLoad::stresses`].
    pub fn stress(
        &self,
        at: [f64; 3],
        resolution: LoadResolution,
        workspace: &mut LoadWorkspace,
    ) -> Stress {
        let mut found = [[0.0; 6]; LANES];
        self.stresses_of_block(&[at], resolution, workspace, &mut found);
        found[0]
    }

    /// The stresses at places `[x, y, depth]` in mm, in axes with z into the body. What is found at a place does not depend on the
    /// others.
    pub fn stresses(
        &self,
        places: &[[f64; 3]],
        resolution: LoadResolution,
        workspace: &mut LoadWorkspace,
    ) -> Vec<Stress> {
        let mut order: Vec<usize> = (0..places.len()).collect();
        blocks::gather(places, &mut order);
        let mut stresses = vec![[0.0; 6]; places.len()];
        let mut found = [[0.0; 6]; LANES];
        for block in order.chunks(LANES) {
            let own: Vec<[f64; 3]> = block.iter().map(|k| places[*k]).collect();
            self.stresses_of_block(&own, resolution, workspace, &mut found);
            for (k, stress) in block.iter().zip(found) {
                stresses[*k] = stress;
            }
        }
        stresses
    }

    /// At most [`LANES`] places side by side.
    fn stresses_of_block(
        &self,
        places: &[[f64; 3]],
        resolution: LoadResolution,
        LoadWorkspace {
            parts,
            lines,
            codes,
            felt,
        }: &mut LoadWorkspace,
        found: &mut [Stress; LANES],
    ) {
        parts.trim();
        felt.clear();
        let mut points: [Lanes; 3] = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let [x, y, z] = places[lane.min(places.len() - 1)];
            points[0][lane] = (x - self.origin[0]) as f32;
            points[1][lane] = (y - self.origin[1]) as f32;
            points[2][lane] = z as f32;
        }
        let asked = u16::MAX >> (LANES - places.len());
        let mut open: Vec<(usize, u16)> = (0..parts.cells()).map(|k| (k, asked)).collect();
        let mut next = Vec::new();
        while !open.is_empty() {
            codes.clear();
            let seen = open.iter().map(|(k, _)| parts.seen(*k));
            look(seen, &points, resolution, codes);
            for ((number, lanes), codes) in open.drain(..).zip(codes.iter()) {
                for_each_code(codes, lanes, |code, lanes| {
                    let [along, mut across] = orders(code);
                    if parts.narrow(number) {
                        across = across.min(ORDERS - 1);
                    }
                    if along == ORDERS || across == ORDERS {
                        let make = |part: &LoadPart| self.seen(part, lines);
                        let halves = parts.halves(number, make);
                        next.extend(halves.map(|half| (half, lanes)));
                        return;
                    }
                    let make = |part: &LoadPart, to: &mut Vec<PointLoad>| {
                        self.quadrature(part, [along, across], lines, to);
                    };
                    let loads = parts.quadrature(number, [along, across], make);
                    felt.push(FeltLoads { loads, lanes });
                });
            }
            std::mem::swap(&mut open, &mut next);
        }
        *found = stresses(parts.points(), felt, &points, self.poisson_ratio);
    }

    /// How large a part is.
    fn seen(&self, part: &LoadPart, known: &mut KnownLines) -> PartBox {
        let strip = &self.strips[part.strip];
        let [y0, y1] = [0.0, 1.0].map(|side| strip.lines.y(part.piece.share(side)));
        let [u0, u1] = part.u;
        let (x, length, skew) = if strip.alone {
            match strip.lines.reach(part.piece, part.u, known) {
                Some(reach) => ([reach.from, reach.to], reach.length, reach.skew),
                // The region does not reach the middle of the part.
                None => (
                    [strip.segment.chord.left, strip.segment.chord.right],
                    0.0,
                    0.0,
                ),
            }
        } else {
            ([u0, u1], u1 - u0, 0.0)
        };
        let [centre_x, centre_y] = self.origin;
        let across = (y1 - y0).max(skew);
        PartBox {
            sides: [
                x[0] - centre_x,
                x[1] - centre_x,
                y0 - centre_y,
                y1 - centre_y,
            ]
            .map(|side| side as f32),
            squares: [length * length, across * across].map(|square| square as f32),
        }
    }

    /// Appends what a part carries as point loads, for rules along and across.
    fn quadrature(
        &self,
        part: &LoadPart,
        [along_rule, across_rule]: [usize; 2],
        known: &mut KnownLines,
        to: &mut Vec<PointLoad>,
    ) {
        let strip = &self.strips[part.strip];
        let number = part.cell - strip.segment.cells.start;
        let [u0, u1] = part.u;
        let (middle, half) = (0.5 * (u0 + u1), 0.5 * (u1 - u0));
        let width = strip.segment.chord.dy * part.piece.width();
        let mut push = |x: f64, y: f64, load: f64, ratio: [f64; 2]| {
            let [centre_x, centre_y] = self.origin;
            to.push(PointLoad {
                at: [(x - centre_x) as f32, (y - centre_y) as f32],
                force: [load * ratio[0], load * ratio[1], load].map(|force| force as f32),
            });
        };
        let turns = strip.turns(along_rule, part.u, number);
        let turns = &turns[..RULES[along_rule].len()];
        // On the neighbour below or above at the same angles.
        let mut there = [[0.0; 2]; POINTS_MAX];
        let mut known_side = None;
        for (at, weight) in RULES[across_rule] {
            let share = part.piece.share(0.5 * (1.0 + at));
            let (y, across) = (strip.lines.y(share), 0.5 * weight * width);
            if !strip.alone {
                let pressure = strip.mean_pressure(number);
                for (at, weight) in RULES[along_rule] {
                    let load = pressure * across * weight * half;
                    push(middle + half * at, y, load, strip.ratios[number]);
                }
                continue;
            }
            let Some(chord) = strip.lines.chord(share, known) else {
                continue;
            };
            // Linear between the nodes in u and y, and constant beyond the outermost.
            let (side, beside) = (y < strip.segment.chord.y, self.beside(part.strip, y));
            let share = beside.map_or(0.0, |(_, share)| share);
            if let Some((other, _)) = beside
                && known_side.replace(side) != Some(side)
            {
                let pairs = there.iter_mut().zip(turns);
                pairs.for_each(|(there, turn)| *there = other.ratio(turn.u, number));
            }
            let ratio = |k: usize| {
                let (here, there) = (turns[k].ratio, there[k]);
                [0, 1].map(|c| (1.0 - share) * here[c] + share * there[c])
            };
            if along_rule == 0 {
                let whole = across_rule == 0 && part.piece == StripPart::WHOLE;
                let load = if whole && part.u == strip.ends(number) {
                    strip.loads[number]
                } else {
                    self.footprint.mean_load(&[chord], part.u)
                };
                push(middle_of_load(&chord, part.u), y, load * across, ratio(0));
                continue;
            }
            let reach = 0.5 * (chord.right - chord.left) * half * across;
            for (k, turn) in turns.iter().enumerate() {
                let x = chord.along(turn.cosine);
                let pressure = self.footprint.pressure(&chord, x, turn.sine);
                push(x, y, pressure * reach * turn.sine * turn.weight, ratio(k));
            }
        }
    }

    /// The strip beside, below or above a line, whose tractions count on it, and its share.
    fn beside(&self, j: usize, y: f64) -> Option<(&LoadedStrip<'a>, f64)> {
        let own = &self.strips[j].segment.chord;
        let beside = if y < own.y {
            j.checked_sub(1)
        } else {
            Some(j + 1)
        };
        let beside = beside.and_then(|k| self.strips.get(k))?;
        let chord = &beside.segment.chord;
        let counts = beside.alone && chord.patch == own.patch;
        counts.then(|| (beside, (y - own.y) / (chord.y - own.y)))
    }
}

/// x of the centre of the load of a chord between two angles, for a pressure proportional to sin u as Hertz's is.
fn middle_of_load(chord: &Chord, [u0, u1]: [f64; 2]) -> f64 {
    let load = 0.5 * ((u1 - u0) - (u1 - u0).sin() * (u1 + u0).cos());
    let moment = (u1.sin().powi(3) - u0.sin().powi(3)) / 3.0;
    let (nearer, farther) = (u1.cos(), u0.cos());
    let cosine = (moment / load).clamp(nearer, farther);
    0.5 * (chord.left + chord.right) - 0.5 * (chord.right - chord.left) * cosine
}

/// Calls with every code of these lanes, and with the lanes that have it.
fn for_each_code(codes: &PartCodes, lanes: u16, mut with: impl FnMut(u8, u16)) {
    let mut left = lanes;
    while left != 0 {
        let code = codes[left.trailing_zeros() as usize];
        let mut alike = 0_u16;
        for (lane, other) in codes.iter().enumerate() {
            alike |= u16::from(*other == code) << lane;
        }
        with(code, left & alike);
        left &= !alike;
    }
}
