//! The loads of neighbouring strips that each cross the patch once: pressure on the true outline, and tractions over pressure between the nodes.

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::half_space::kernels::LoadPack;
use crate::mesh::{Chord, Segment};
use crate::normal::footprint::Footprint;
use crate::numerics::quadrature::RULES;
use crate::numerics::roots::bounds;
use crate::numerics::simd::LANES;
use crate::post::local_power::SolvedMotion;
use crate::post::subsurface::load_parts::{KEPT_MAX, LoadPart, ORDERS, PartBox};
use crate::rolling::strip_mesh::StripMesh;

/// Number of points of the largest rule.
const POINTS_MAX: usize = RULES[ORDERS - 1].len();

/// Number of longitudinal and lateral halvings in any case: first for smooth patches, then for patches with a rough pressure or with hollows.
///
/// Without lateral halvings, errors relative to the largest pressure grow from 0.0015 to 0.0055 on ellipses with a pole of spin, from 0.0009 to 0.0055
/// if friction jumps laterally from 0.4 to 0.1, and from 0.001 to 0.004 on a gap of two radii. Without the second pair, they grow from 0.007 to 0.02
/// where the pressure jumps.
const HALVINGS: [[u32; 2]; 2] = [[0, 4], [4, 4]];
/// Value of [`steepest`] above which a pressure is rough. It is at most 0.30 on ellipses and gaps, where the outermost cells differ only by their
/// width. It is at least 0.54 where the pressure jumps, at hollows, and where a gap opens so steeply that the pressure rises toward the edge.
const STEEP: f64 = 0.4;

/// The loads on a run of strips.
#[derive(Debug)]
pub(crate) struct LoadedRun<'a> {
    footprint: &'a Footprint,
    /// Number of the patch.
    patch: usize,
    /// Number of the run in the mesh.
    number: usize,
    /// Least y of the run in mm.
    low: f64,
    /// Width of the run in mm.
    width: f64,
    /// Smallest and largest x of its chords.
    extent: [f64; 2],
    /// y of the mid-lines of the strips.
    lines: Vec<f64>,
    /// Angles of the nodes, which are the same in all strips.
    nodes: Vec<f64>,
    /// Number of longitudinal and lateral halvings in any case.
    pub(crate) halvings: [u32; 2],
    /// Tractions over pressure, node by node, strip by strip.
    ratios: Vec<[f32; 2]>,
}

/// A position between two entries of a list: their numbers, and the weight of the second. Beyond the ends it is the outermost entry.
#[derive(Debug, Clone, Copy, Default)]
struct Between {
    pair: [usize; 2],
    share: f64,
}

impl Between {
    /// The position of `at` in an increasing list. At least `passed` entries must lie below it; this number is updated.
    fn new(list: &[f64], at: f64, passed: &mut usize) -> Between {
        while *passed < list.len() && list[*passed] < at {
            *passed += 1;
        }
        if *passed == 0 || *passed == list.len() {
            let outermost = passed.saturating_sub(1);
            return Between {
                pair: [outermost; 2],
                share: 0.0,
            };
        }
        let (low, high) = (list[*passed - 1], list[*passed]);
        Between {
            pair: [*passed - 1, *passed],
            share: (at - low) / (high - low),
        }
    }
}

/// The number of entries of an increasing list below a value.
fn below(list: &[f64], at: f64) -> usize {
    list.partition_point(|place| *place < at)
}

/// The points of a longitudinal rule. Unused entries are 0.
struct Turns {
    count: usize,
    sines: [f64; POINTS_MAX],
    cosines: [f64; POINTS_MAX],
    weights: [f64; POINTS_MAX],
    nodes: [Between; POINTS_MAX],
}

impl<'a> LoadedRun<'a> {
    /// The run of these segments, the `number`-th of the mesh, with the tractions of an answer in units of `unit` MPa.
    pub(crate) fn new(
        of: SolvedMotion<'a>,
        unit: f64,
        (segments, number): (&[Segment], usize),
    ) -> LoadedRun<'a> {
        let (level, footprint, answer) = (of.level, of.footprint, of.answer);
        let [first, last] = [0, segments.len() - 1].map(|k| &segments[k].chord);
        let low = first.y - 0.5 * first.dy;
        let ratio = |i: usize| match level.pressure[i] {
            p if p > 0.0 => [0, 1].map(|k| (unit * answer.traction[k][i] / p) as f32),
            _ => [0.0; 2],
        };
        let (centre, half) = (
            0.5 * (first.left + first.right),
            0.5 * (first.right - first.left),
        );
        let angle = |x: &f64| ((centre - x) / half).clamp(-1.0, 1.0).acos();
        let nodes = &level.mesh.node[segments[0].cells.clone()];
        let chords = segments.iter().map(|segment| &segment.chord);
        LoadedRun {
            footprint,
            patch: first.patch,
            number,
            low,
            width: last.y + 0.5 * last.dy - low,
            extent: bounds(chords.clone().flat_map(|chord| [chord.left, chord.right])),
            halvings: halvings(level, footprint, segments),
            lines: chords.map(|chord| chord.y).collect(),
            nodes: nodes.iter().map(angle).collect(),
            ratios: segments
                .iter()
                .flat_map(|segment| segment.cells.clone())
                .map(ratio)
                .collect(),
        }
    }

    /// The least longitudinal rule of a part. The load on a chord is nearly proportional to sin² u, whose integral over all angles has an error of 0.1 %
    /// with four points.
    pub(crate) fn least_rule(part: LoadPart) -> usize {
        match part.along.level {
            0 => ORDERS - 1,
            1 => ORDERS - 2,
            _ => 0,
        }
    }

    /// The bounds of a part, in mm from `origin`.
    pub(crate) fn seen(
        &self,
        part: &LoadPart,
        origin: [f64; 2],
        known: &mut KnownLines,
    ) -> PartBox {
        let cosines = [0.0, 1.0].map(|side| (PI * part.along.share(side)).cos());
        let [y0, y1] = [0.0, 1.0].map(|side| self.y(part.across.share(side)));
        let [low, middle, high] =
            [0.0, 0.5, 1.0].map(|side| self.chord(part.across.share(side), known));
        // Change of x over the part if it changed everywhere as in its middle, over the length of the chord.
        let slope = 0.5 * PI * part.along.width() * (PI * part.along.share(0.5)).sin();
        let (x, length, skew) = match middle {
            Some(chord) => {
                // If the region ends inside the part, the middle of the chord replaces the missing chord.
                let end = [0.5 * (chord.left + chord.right); 2];
                let ends = |chord: Chord| cosines.map(|cosine| chord.along(cosine));
                let own = ends(chord);
                let [low, high] = [low, high].map(|chord| chord.map_or(end, ends));
                let least = [0, 1].map(|k| own[k].min(low[k]).min(high[k]));
                let most = [0, 1].map(|k| own[k].max(low[k]).max(high[k]));
                let skew = (most[0] - least[0]).max(most[1] - least[1]);
                (
                    [least[0], most[1]],
                    slope * (chord.right - chord.left),
                    skew,
                )
            }
            None => {
                let [left, right] = self.extent;
                (self.extent, slope * (right - left), 0.0)
            }
        };
        let across = (y1 - y0).max(skew);
        PartBox {
            sides: [
                x[0] - origin[0],
                x[1] - origin[0],
                y0 - origin[1],
                y1 - origin[1],
            ]
            .map(|side| side as f32),
            squares: [length * length, across * across].map(|square| square as f32),
        }
    }

    /// Appends the point loads of a part for a longitudinal and a lateral rule, with x and y from `origin`.
    pub(crate) fn quadrature(
        &self,
        part: &LoadPart,
        [along_rule, across_rule]: [usize; 2],
        origin: [f64; 2],
        known: &mut KnownLines,
        to: &mut Vec<LoadPack>,
    ) {
        let turns = self.turns(part, along_rule);
        let count = turns.count;
        let rule = RULES[across_rule];
        let first = to.len();
        to.resize(
            first + (count * rule.len()).div_ceil(LANES),
            LoadPack::default(),
        );
        let mut passed = below(&self.lines, self.y(part.across.share(0.0)));
        let width = 0.5 * self.width * part.across.width();
        let angles = (&turns.cosines, &turns.sines);
        let cosines = turns.cosines.map(|cosine| cosine as f32);
        for (k, (at, weight)) in rule.iter().enumerate() {
            let share = part.across.share(0.5 * (1.0 + at));
            let Some(chord) = self.chord(share, known) else {
                continue;
            };
            let between = Between::new(&self.lines, chord.y, &mut passed);
            let [below, above] = between.pair.map(|strip| self.row(strip, &turns));
            let pressures = self.footprint.pressures(&chord, angles);
            let half = 0.5 * (chord.right - chord.left);
            let reach = half * width * weight;
            let middle = (0.5 * (chord.right + chord.left) - origin[0]) as f32;
            let (half, share) = (half as f32, between.share as f32);
            let mut values = [[0.0_f32; POINTS_MAX]; 5];
            for k in 0..POINTS_MAX {
                let load = (pressures[k] * (reach * turns.weights[k])) as f32;
                let ratio = |c: usize| below[c][k] + share * (above[c][k] - below[c][k]);
                values[0][k] = middle - half * cosines[k];
                values[1][k] = (chord.y - origin[1]) as f32;
                values[2][k] = load * ratio(0);
                values[3][k] = load * ratio(1);
                values[4][k] = load;
            }
            let pack = &mut to[first + k * count / LANES];
            let lane = k * count % LANES;
            for (place, values) in pack.at.iter_mut().chain(&mut pack.force).zip(&values) {
                place[lane..lane + count].copy_from_slice(&values[..count]);
            }
        }
    }

    /// The points of a longitudinal rule on a part.
    fn turns(&self, part: &LoadPart, rule: usize) -> Turns {
        let mut turns = Turns {
            count: RULES[rule].len(),
            sines: [0.0; POINTS_MAX],
            cosines: [0.0; POINTS_MAX],
            weights: [0.0; POINTS_MAX],
            nodes: [Between::default(); POINTS_MAX],
        };
        let (middle, half) = (PI * part.along.share(0.5), 0.5 * PI * part.along.width());
        let (sine, cosine) = middle.sin_cos();
        let mut passed = below(&self.nodes, middle - half);
        for (k, (at, weight)) in RULES[rule].iter().enumerate() {
            let turn = half * at;
            let (sine_turn, cosine_turn) = turn.sin_cos();
            turns.sines[k] = sine * cosine_turn + cosine * sine_turn;
            turns.cosines[k] = cosine * cosine_turn - sine * sine_turn;
            turns.weights[k] = half * weight * turns.sines[k];
            turns.nodes[k] = Between::new(&self.nodes, middle + turn, &mut passed);
        }
        turns
    }

    /// Longitudinal and lateral traction over pressure at the points of a rule on the mid-line of a strip.
    fn row(&self, strip: usize, turns: &Turns) -> [[f32; POINTS_MAX]; 2] {
        let nodes = self.nodes.len();
        let own = &self.ratios[strip * nodes..][..nodes];
        let mut row = [[0.0; POINTS_MAX]; 2];
        for (k, between) in turns.nodes[..turns.count].iter().enumerate() {
            let [low, high] = between.pair.map(|node| own[node]);
            let share = between.share as f32;
            row[0][k] = low[0] + share * (high[0] - low[0]);
            row[1][k] = low[1] + share * (high[1] - low[1]);
        }
        row
    }

    /// y in mm of a position in the run, from 0 to 1.
    fn y(&self, share: f64) -> f64 {
        self.low + self.width * share
    }

    /// The chord on the line at a position from 0 to 1, if there is exactly one.
    fn chord(&self, share: f64, known: &mut KnownLines) -> Option<Chord> {
        let look = || {
            let line = (self.y(share), self.width);
            self.footprint.single_chord(self.patch, line)
        };
        if self.footprint.is_closed_form() {
            return look();
        }
        let KnownLines(known) = known;
        if known.len() > KEPT_MAX {
            known.clear();
        }
        *known
            .entry((self.number, share.to_bits()))
            .or_insert_with(look)
    }
}

/// Number of longitudinal and lateral halvings of a run in any case. They resolve the changes of the loads between strips and cells even at a large
/// distance.
fn halvings(level: &StripMesh, footprint: &Footprint, segments: &[Segment]) -> [u32; 2] {
    let patch = segments[0].chord.patch;
    let all = level.mesh.segments.iter();
    let hollow = all.filter(|segment| segment.chord.patch == patch).count() > segments.len();
    match footprint.jumps() || hollow || steepest(level, segments) > STEEP {
        true => HALVINGS[1],
        false => HALVINGS[0],
    }
}

/// The largest relative change from cell to cell along a strip of the pressure divided by that of an ellipse, which is proportional to sin u. Strips with
/// less than a tenth of the largest pressure are ignored.
fn steepest(level: &StripMesh, segments: &[Segment]) -> f64 {
    let cells = segments[0].cells.start..segments[segments.len() - 1].cells.end;
    let pressures = &level.pressure;
    let largest = pressures[cells].iter().copied().fold(0.0, f64::max);
    let mut steepest = 0.0_f64;
    for Segment { chord, cells } in segments {
        let top = pressures[cells.clone()].iter().copied().fold(0.0, f64::max);
        if top < 0.1 * largest {
            continue;
        }
        let form = |i: usize| {
            let x = level.mesh.node[i];
            pressures[i] / ((x - chord.left) * (chord.right - x)).max(0.0).sqrt()
        };
        for i in cells.start + 1..cells.end {
            let [before, here] = [i - 1, i].map(form);
            steepest = steepest.max((here - before).abs() / before.min(here));
        }
    }
    steepest
}

/// Cache of the chords on lines across the runs of one mesh, by the run and the position in it. It is not used for Hertz's ellipse.
#[derive(Debug, Default)]
pub(crate) struct KnownLines(HashMap<(usize, u64), Option<Chord>>);
