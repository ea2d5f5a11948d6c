//! The solved normal problem of one frame: patches, pressures, the load across rolling, and the slip of curved surfaces; and the task that it comes from.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::lazy_field::LazyField;
use crate::mesh::Chord;
use crate::normal::gap::task::GapTask;
use crate::normal::hertz::{Ellipse, Patch};
use crate::normal::pressure_field::field::PressureField;
use crate::normal::wheel::{WheelTask, WheelsetTask};
use crate::numerics::interpolation;

/// The patches of one frame with their pressures; not empty. It gives the patches, the lengths of their chords, and the pressures on them.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    shape: FootprintShape,
    patches: Vec<Patch>,
    uncertainty: Option<NormalUncertainty>,
    slip: Option<Arc<SurfaceSlip>>,
    slip_by_motion: Option<Arc<[SurfaceSlip; 2]>>,
    /// Origins `[x, y]` in mm of the coordinates for places of the patches of a curved surface.
    origins: Vec<[f64; 2]>,
    loads: LazyField<Vec<LoadAcross>>,
}

/// The form of the pressure.
#[derive(Debug, Clone, PartialEq)]
enum FootprintShape {
    /// Hertz's ellipse, in closed form.
    Hertz(Ellipse),
    /// A pressure on one grid of samples or several.
    Sampled(PressureField),
}

/// The uncertainty of a computed region and pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalUncertainty {
    /// Cells of the normal problem across each patch.
    pub cells_across: Vec<f64>,
    /// Relative error of the load.
    pub load: f64,
    /// Largest distance or overlap of the surfaces in contact, relative to the deepest overlap.
    pub distance: f64,
}

/// Cosines and sines of the mid-points of N equal parts of 0 … π.
#[derive(Debug, Clone, Copy)]
pub struct LineAngles<const N: usize> {
    pub(crate) cosines: [f64; N],
    pub(crate) sines: [f64; N],
}

impl<const N: usize> LineAngles<N> {
    /// Computes the angles.
    pub fn new() -> LineAngles<N> {
        let angles: [f64; N] = std::array::from_fn(|k| (k as f64 + 0.5) * PI / N as f64);
        LineAngles {
            cosines: angles.map(f64::cos),
            sines: angles.map(f64::sin),
        }
    }
}

impl<const N: usize> Default for LineAngles<N> {
    fn default() -> LineAngles<N> {
        LineAngles::new()
    }
}

impl Footprint {
    /// The footprint of Hertz's ellipse.
    pub fn hertz(ellipse: Ellipse) -> Footprint {
        Footprint::of(FootprintShape::Hertz(ellipse), vec![ellipse.patch()])
    }

    fn of(shape: FootprintShape, patches: Vec<Patch>) -> Footprint {
        Footprint {
            shape,
            patches,
            uncertainty: None,
            slip: None,
            slip_by_motion: None,
            origins: Vec::new(),
            loads: LazyField::default(),
        }
    }

    /// The footprint of a given pressure, which is exact by definition.
    pub fn given(field: PressureField) -> Footprint {
        let patches = field.patches();
        Footprint::of(FootprintShape::Sampled(field), patches)
    }

    /// The footprint of a computed pressure with a relative `load_error`. `distance` is the largest distance or overlap of the surfaces in contact, relative to the
    /// deepest overlap.
    pub fn computed(field: PressureField, load_error: f64, distance: f64) -> Footprint {
        let uncertainty = NormalUncertainty {
            cells_across: field.cells_across(),
            load: load_error,
            distance,
        };
        Footprint {
            uncertainty: Some(uncertainty),
            ..Footprint::given(field)
        }
    }

    /// Returns this footprint on the surface of a rail: with a rigid slip of every cell that is added to that of the motion, on a curve; with its part per unit of lateral
    /// creepage and of spin in 1/mm, where motions share the footprint; and with the origin `[x, y]` in mm of the coordinates for places of every patch.
    pub(crate) fn on_surface(
        self,
        slip: Option<SurfaceSlip>,
        by_motion: Option<[SurfaceSlip; 2]>,
        origins: impl Iterator<Item = [f64; 2]>,
    ) -> Footprint {
        Footprint {
            slip: slip.map(Arc::new),
            slip_by_motion: by_motion.map(Arc::new),
            origins: origins.collect(),
            ..self
        }
    }

    /// The origin `[x, y]` in mm of the coordinates of places below a patch.
    pub fn origin(&self, patch: usize) -> [f64; 2] {
        self.origins.get(patch).copied().unwrap_or_default()
    }

    /// The slip of the surface in addition to that of the motion, if it has one.
    pub fn slip(&self) -> Option<&SurfaceSlip> {
        self.slip.as_deref()
    }

    /// Additional slip per unit of lateral creepage, and per unit of spin in 1/mm, where motions share the footprint.
    pub fn slip_by_motion(&self) -> Option<&[SurfaceSlip; 2]> {
        self.slip_by_motion.as_deref()
    }

    /// The patches, in order of their smallest y.
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// The distribution of the load of a patch across, computed on first use.
    pub fn load_across(&self, patch: usize) -> &LoadAcross {
        let loads = self.loads.get_or_make(|| match &self.shape {
            FootprintShape::Hertz(ellipse) => vec![LoadAcross::of_ellipse([-ellipse.b, ellipse.b])],
            FootprintShape::Sampled(field) => (0..self.patches.len())
                .map(|k| LoadAcross::of_samples(field, k))
                .collect(),
        });
        &loads[patch]
    }

    /// The uncertainty of region and pressure; `None` unless they were computed.
    pub fn uncertainty(&self) -> Option<&NormalUncertainty> {
        self.uncertainty.as_ref()
    }

    /// Whether the footprint is Hertz's ellipse in closed form.
    pub fn is_closed_form(&self) -> bool {
        matches!(self.shape, FootprintShape::Hertz(_))
    }

    /// Hertz's ellipse, if the footprint is one.
    pub fn ellipse(&self) -> Option<&Ellipse> {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => Some(ellipse),
            FootprintShape::Sampled(_) => None,
        }
    }

    /// The sampled pressure, unless the footprint is Hertz's ellipse.
    pub(crate) fn field(&self) -> Option<&PressureField> {
        match &self.shape {
            FootprintShape::Hertz(_) => None,
            FootprintShape::Sampled(field) => Some(field),
        }
    }

    /// Whether the pressure jumps from one sample to the next.
    pub fn jumps(&self) -> bool {
        matches!(&self.shape, FootprintShape::Sampled(field) if field.jump().is_some())
    }

    /// Average number of segments of a strip, for each patch: more than 1 for hollow or bent patches.
    pub fn segments_per_strip(&self) -> Vec<f64> {
        match &self.shape {
            FootprintShape::Hertz(_) => vec![1.0],
            FootprintShape::Sampled(field) => field.segments_per_strip(),
        }
    }

    /// Chords of one patch along the lines `y`, each for a strip of width `dy`. Strips that miss the patch have no chord, strips that cross it several times have
    /// several, by increasing x.
    ///
    /// `strips` lists `(y, dy)` of the strips from smaller to larger y; all lengths in mm.
    pub fn chords(&self, patch: usize, strips: &[(f64, f64)]) -> Vec<Chord> {
        let mut chords = Vec::new();
        self.chords_into(patch, strips, &mut chords);
        chords
    }

    /// Writes chords to a buffer; see [`Footprint::chords`].
    pub fn chords_into(&self, patch: usize, strips: &[(f64, f64)], chords: &mut Vec<Chord>) {
        chords.clear();
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.add_chords(strips, chords),
            FootprintShape::Sampled(field) => field.add_chords(patch, strips, chords),
        }
    }

    /// The chord of one patch along a line `y` for a strip of width `dy`, if there is exactly one.
    #[inline]
    pub fn single_chord(&self, patch: usize, line: (f64, f64)) -> Option<Chord> {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.chord(0, line),
            FootprintShape::Sampled(field) => match field.chords(patch, &[line])[..] {
                [chord] => Some(chord),
                _ => None,
            },
        }
    }

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord (not yet scaled to the patch's force).
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => ellipse.mean_pressure(chord, x0, x1),
            FootprintShape::Sampled(field) => field.mean_pressure(chord, x0, x1),
        }
    }

    /// Mean pressure in MPa over the line of a chord (not yet scaled to the patch's force).
    ///
    /// A computed pressure is integrated with the mid-points of N equal angles u, at which `x = −half · cos u` from the middle. This is exact for Hertz's semi-ellipse
    /// and otherwise as accurate as N points resolve the pressure.
    pub fn mean_of_line<const N: usize>(&self, chord: &Chord, angles: &LineAngles<N>) -> f64 {
        match &self.shape {
            FootprintShape::Sampled(field) if self.uncertainty.is_some() => {
                let pressures = self.pressures(chord, (&angles.cosines, &angles.sines));
                let sum: f64 = pressures
                    .iter()
                    .zip(&angles.sines)
                    .map(|(p, sin)| p * sin)
                    .sum();
                0.5 * PI / N as f64 * sum
            }
            _ => self.mean_pressure(chord, chord.left, chord.right),
        }
    }

    /// Pressures in MPa at points of a chord (not yet scaled to the patch's force), given by cosines and sines of increasing angles u, at which `x = −half · cos u` from
    /// the middle of the chord.
    #[inline]
    pub fn pressures<const N: usize>(
        &self,
        chord: &Chord,
        (cosines, sines): (&[f64; N], &[f64; N]),
    ) -> [f64; N] {
        match &self.shape {
            FootprintShape::Hertz(ellipse) => {
                let steepness = ellipse.pressure(chord, 1.0);
                sines.map(|sine| steepness * sine)
            }
            FootprintShape::Sampled(field) => {
                field.pressures(chord, cosines.map(|cosine| chord.along(cosine)))
            }
        }
    }
}

/// Number of parabolas of a sampled pressure, narrower towards both ends, where its line load changes fastest. Twice as many change the limit of Hertz's patch, given
/// as a grid, under a table with a jump by less than 1e-5. Chosen by judgement.
const PARABOLAS: usize = 24;

/// Line load of a patch in N/mm across rolling, up to a factor, as a chain of parabolas.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadAcross {
    /// Place in mm and line load at both ends and in the middle of every parabola; neighbours share their ends.
    points: Vec<(f64, f64)>,
}

impl LoadAcross {
    /// The line load of an elliptic patch between two y: one parabola.
    pub fn of_ellipse([low, high]: [f64; 2]) -> LoadAcross {
        let points = vec![(low, 0.0), (0.5 * (low + high), 1.0), (high, 0.0)];
        LoadAcross { points }
    }

    /// The line load of a sampled pressure.
    pub fn of_samples(field: &PressureField, patch: usize) -> LoadAcross {
        let [.., low, high] = field.patches()[patch].extent;
        let count = 2 * PARABOLAS;
        let place = |k: usize| {
            let part = 0.5 - 0.5 * (PI * k as f64 / count as f64).cos();
            low + (high - low) * part
        };
        let line_load = |y: f64| -> f64 {
            let chords = field.chords(patch, &[(y, 1.0)]);
            let load = |x: [f64; 2], mean: f64| (x[1] - x[0]) * mean;
            let each = chords.iter().map(|chord| {
                let [left, right] = [chord.left, chord.right];
                load([left, right], field.mean_pressure(chord, left, right))
            });
            each.sum()
        };
        let inner = (1..count).map(|k| (place(k), line_load(place(k))));
        let ends = [(low, 0.0), (high, 0.0)];
        LoadAcross {
            points: std::iter::once(ends[0])
                .chain(inner)
                .chain([ends[1]])
                .collect(),
        }
    }

    /// Load-weighted mean of a function that is linear between at least one points `(y, value)` with increasing y, and constant beyond them. Two points at one place are a
    /// jump.
    ///
    /// The result is exact for a load of parabolas: its products with straight lines are cubic, which Simpson's rule integrates.
    pub fn mean(&self, table: &[(f64, f64)]) -> f64 {
        let (first, last) = (table[0], table[table.len() - 1]);
        let (low, high) = (self.points[0].0, self.points[self.points.len() - 1].0);
        let before = [(low.min(first.0), first.1), first];
        let behind = [last, (high.max(last.0), last.1)];
        let inner = table.windows(2).map(|pair| [pair[0], pair[1]]);
        let pieces = inner.chain([before, behind]);
        let sum: f64 = pieces.map(|piece| self.integral(piece)).sum();
        let load = self.integral([(low, 1.0), (high, 1.0)]);
        sum / load
    }

    /// Integral of the line load times a straight line between two points.
    fn integral(&self, [(y0, v0), (y1, v1)]: [(f64, f64); 2]) -> f64 {
        let parabolas = self.points.windows(3).step_by(2);
        let over = |parabola: &[(f64, f64)]| {
            let (begin, end) = (y0.max(parabola[0].0), y1.min(parabola[2].0));
            if begin >= end {
                return 0.0;
            }
            let value = |y: f64| {
                (v0 + (y - y0) / (y1 - y0) * (v1 - v0))
                    * interpolation::polynomial_value(parabola, y)
            };
            let middle = value(0.5 * (begin + end));
            (end - begin) / 6.0 * (value(begin) + 4.0 * middle + value(end))
        };
        parabolas.map(over).sum()
    }
}

/// Slip of a surface in addition to that of the motion, divided by the rolling speed, interpolated between samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceSlip {
    /// Samples along x: place of the first and distance in mm, and their number, at least 1.
    pub x: (f64, f64, usize),
    /// Samples along y in mm, ascending, at least 1.
    pub y: Vec<f64>,
    /// Slip of the upper body relative to the lower one along x and y; sample (i, j) at `j * x.2 + i`.
    pub slip: [Vec<f64>; 2],
}

impl SurfaceSlip {
    /// Slip at a place `[x, y]` in mm, which is clamped to the samples.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (first, step, samples) = self.x;
        let last = (samples - 1) as f64;
        let at = ((x - first) / step).clamp(0.0, last);
        let from = at.floor().min((last - 1.0).max(0.0));
        let x = (from as usize, at - from, usize::from(last > 0.0));
        let last = self.y.len() - 1;
        let from = self
            .y
            .partition_point(|sample| *sample <= y)
            .clamp(1, last.max(1))
            - 1;
        let to = (from + 1).min(last);
        let length = self.y[to] - self.y[from];
        let part = if length > 0.0 {
            ((y - self.y[from]) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let y = (from, part, to - from);
        let value = |values: &[f64], i: usize, j: usize| values[j * self.x.2 + i];
        [0, 1].map(|k| {
            let row = |j: usize| {
                let [low, high] = [x.0, x.0 + x.2].map(|i| value(&self.slip[k], i, j));
                low + x.1 * (high - low)
            };
            let [low, high] = [row(y.0), row(y.0 + y.2)];
            low + y.1 * (high - low)
        })
    }

    /// Mean slip between two places along x, by Simpson's rule.
    pub fn mean(&self, [from, to]: [f64; 2], y: f64) -> [f64; 2] {
        let [low, middle, high] = [from, 0.5 * (from + to), to].map(|x| self.at([x, y]));
        [0, 1].map(|k| (low[k] + 4.0 * middle[k] + high[k]) / 6.0)
    }
}

/// The normal problem, whose solution is a [`Footprint`].
#[derive(Debug, Clone, PartialEq)]
pub enum NormalTask {
    /// Hertz's ellipse, in closed form.
    Hertz(Ellipse),
    /// A given pressure on a grid.
    Given(PressureField),
    /// A gap, of which patches and pressures are unknown.
    Gap(Box<GapTask>),
    /// A wheel on a rail, of which the places of the patches are unknown as well.
    Wheel(Arc<WheelTask>),
    /// A wheelset on both rails, in one or several positions.
    Wheelset(Arc<WheelsetTask>),
}

impl NormalTask {
    /// Number of positions of the bodies; only wheelsets have several.
    pub fn positions(&self) -> usize {
        match self {
            NormalTask::Wheelset(task) => task.poses.len(),
            NormalTask::Hertz(_)
            | NormalTask::Given(_)
            | NormalTask::Gap(_)
            | NormalTask::Wheel(_) => 1,
        }
    }

    /// The footprint; `None` if it must be computed.
    pub fn known_footprint(&self) -> Option<Footprint> {
        match self {
            NormalTask::Hertz(ellipse) => Some(Footprint::hertz(*ellipse)),
            NormalTask::Given(field) => Some(Footprint::given(field.clone())),
            NormalTask::Gap(_) | NormalTask::Wheel(_) | NormalTask::Wheelset(_) => None,
        }
    }

    /// The patches by increasing smallest y; `None` if they must be computed.
    pub fn known_patches(&self) -> Option<Vec<Patch>> {
        let footprint = self.known_footprint()?;
        Some(footprint.patches)
    }
}

#[cfg(test)]
mod load_across_tests {
    use super::*;

    const TABLE: [(f64, f64); 4] = [(-1.0, 0.1), (1.0, 0.3), (1.0, 0.5), (2.0, 0.2)];

    /// The field of a pressure on a grid of equal spacings, 61 along and 81 across.
    fn field(pressure: impl Fn(f64, f64) -> f64) -> PressureField {
        let axis = |half: f64, count: u32| -> Vec<f64> {
            let step = 2.0 * half / f64::from(count - 1);
            (0..count).map(|k| f64::from(k) * step - half).collect()
        };
        let (x, y) = (axis(4.0, 61), axis(6.0, 81));
        let rows: Vec<Vec<f64>> = y
            .iter()
            .map(|y| x.iter().map(|x| pressure(*x, *y)).collect())
            .collect();
        PressureField::new(&x, &y, &rows).unwrap().0
    }

    #[test]
    fn samples_of_an_ellipse_carry_as_the_ellipse() {
        let [a, b, y] = [3.0, 2.2, 0.7];
        let lens = |x: f64, at: f64| 1.0 - (x / a).powi(2) - ((at - y) / b).powi(2);
        let field = field(|x, y| 1000.0 * lens(x, y).max(0.0).sqrt());
        let sampled = LoadAcross::of_samples(&field, 0).mean(&TABLE);
        let exact = LoadAcross::of_ellipse([y - b, y + b]).mean(&TABLE);
        assert!((sampled / exact - 1.0).abs() < 1e-4, "{sampled} {exact}");
    }

    /// A pressure that is even along and straight across, from 0 at one side to its largest at the other.
    #[test]
    fn a_wedge_carries_most_under_its_thick_side() {
        let field = field(|x, y| {
            let inside = x.abs() < 3.0 && (-2.05..=4.0).contains(&y);
            if inside { 100.0 * (y + 2.1) } else { 0.0 }
        });
        let load = LoadAcross::of_samples(&field, 0);
        let step = load.mean(&[(1.0, 0.0), (1.0, 1.0)]);
        let [.., low, high] = field.patches()[0].extent;
        let part = 1.0 - ((1.0 + 2.1) / (high + 2.1)).powi(2);
        assert!((step - part).abs() < 0.02, "{step} {part} {low} {high}");
        // The parabola between the same ends has the value of its middle.
        let parabola = LoadAcross::of_ellipse([low, high]);
        assert!(step - parabola.mean(&[(1.0, 0.0), (1.0, 1.0)]) > 0.1);
    }

    #[test]
    fn patches_beside_each_other_have_loads_of_their_own() {
        let lens = |x: f64, y: f64| (1.0 - (x / 2.0).powi(2) - (y / 1.6).powi(2)).max(0.0);
        let field = field(|x, y| 900.0 * (lens(x, y - 3.0) + 0.5 * lens(x, y + 3.0)).sqrt());
        let by_side = [(0.0, 0.1), (0.0, 0.4)];
        let means = [0, 1].map(|k| LoadAcross::of_samples(&field, k).mean(&by_side));
        assert!((means[0] - 0.1).abs() < 1e-12 && (means[1] - 0.4).abs() < 1e-12);
    }
}

#[cfg(test)]
mod surface_slip_tests {
    use super::*;

    #[test]
    fn a_linear_slip_is_reproduced_and_constant_beyond() {
        let of = |x: f64, y: f64| [0.1 * x - 0.3 * y, 0.2 + 0.05 * x];
        let mut slip = [Vec::new(), Vec::new()];
        for j in 0..4 {
            for i in 0..3 {
                let [along, across] = of(1.0 + 0.5 * f64::from(i), -2.0 + 0.25 * f64::from(j));
                slip[0].push(along);
                slip[1].push(across);
            }
        }
        let surface = SurfaceSlip {
            x: (1.0, 0.5, 3),
            y: vec![-2.0, -1.75, -1.5, -1.25],
            slip,
        };
        for (x, y) in [(1.0, -2.0), (1.3, -1.6), (2.0, -1.25)] {
            let (found, expected) = (surface.at([x, y]), of(x, y));
            assert!((found[0] - expected[0]).abs() < 1e-15);
            assert!((found[1] - expected[1]).abs() < 1e-15);
        }
        let mean = surface.mean([1.2, 1.8], -1.5);
        assert!((mean[0] - of(1.5, -1.5)[0]).abs() < 1e-15);
        assert_eq!(surface.at([9.0, 3.0]), surface.at([2.0, -1.25]));
    }
}
