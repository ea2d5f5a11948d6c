//! Equivalent ellipses of patches of any shape, and chords that represent a whole strip.
//!
//! The equivalent ellipse has the load centre and the second moments of the load of the patch: `a² = 5⟨(x − x_c)²⟩`, `b² = 5⟨(y − y_c)²⟩` with means weighted
//! by the pressure, which is exact for Hertz's pressure. On 17 patches of arcs and quartics the resultants of this ellipse differ by 0.004 μN in the median and
//! at most 0.015; those of the ellipse with the area and the second moments of area by 0.009 and 0.051.

use crate::mesh::Chord;
use crate::normal::footprint::{Footprint, LineAngles};
use crate::normal::hertz::{Ellipse, NormalLoad};
use crate::normal::pressure_field::field::PressureField;
use crate::numerics::quadrature::FOUR_POINTS;

/// Number of strips over a patch, and of parts of each chord. Moments and mismatch change by less than 0.002 with twice as many.
const PARTS: usize = 48;

/// The equivalent ellipse of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadEllipse {
    /// Load centre in mm.
    pub centre: [f64; 2],
    /// Semi-axes along and across rolling in mm.
    pub semi_axes: [f64; 2],
    /// Share of the load that is placed differently by Hertz's pressure on the ellipse, `½ ∫ |p − p_ellipse| / N`; 0 for an ellipse.
    pub load_mismatch: f64,
}

/// A part of a chord with its load.
struct EllipsePart {
    x: [f64; 2],
    y: f64,
    dy: f64,
    load: f64,
}

impl LoadEllipse {
    /// The ellipse of one patch of a footprint with its mismatch.
    pub fn of(footprint: &Footprint, patch: usize) -> LoadEllipse {
        let ellipse = LoadEllipse::rough(footprint, patch);
        LoadEllipse {
            load_mismatch: match footprint.field() {
                None => 0.0,
                Some(_) => load_mismatch(&parts(footprint, patch), &ellipse),
            },
            ..ellipse
        }
    }

    /// The ellipse of one patch of a footprint, without the mismatch.
    pub(crate) fn rough(footprint: &Footprint, patch: usize) -> LoadEllipse {
        match footprint.field() {
            Some(field) => LoadEllipse::of_samples(field, patch),
            None => LoadEllipse {
                centre: [0.0; 2],
                semi_axes: footprint.patches()[patch].semi_axes.unwrap_or_default(),
                load_mismatch: 0.0,
            },
        }
    }

    /// The equivalent ellipse of a patch from the samples of its pressure, without the mismatch.
    pub(crate) fn of_samples(field: &PressureField, patch: usize) -> LoadEllipse {
        LoadEllipse {
            centre: field.load_centre(Some(patch)),
            semi_axes: field.load_spread(patch).map(|spread| (5.0 * spread).sqrt()),
            load_mismatch: 0.0,
        }
    }

    /// c = √(ab) in mm.
    pub fn length(&self) -> f64 {
        (self.semi_axes[0] * self.semi_axes[1]).sqrt()
    }

    /// a/b.
    pub fn ratio(&self) -> f64 {
        self.semi_axes[0] / self.semi_axes[1]
    }
}

/// The parts of a patch with their loads, in an arbitrary unit.
fn parts(footprint: &Footprint, patch: usize) -> Vec<EllipsePart> {
    let [_, _, low, high] = footprint.patches()[patch].extent;
    let dy = (high - low) / PARTS as f64;
    let strips: Vec<(f64, f64)> = (0..PARTS)
        .map(|k| (low + dy * (k as f64 + 0.5), dy))
        .collect();
    let mut parts = Vec::new();
    for chord in footprint.chords(patch, &strips) {
        let step = (chord.right - chord.left) / PARTS as f64;
        for k in 0..PARTS {
            let x = [k, k + 1].map(|k| chord.left + step * k as f64);
            parts.push(EllipsePart {
                x,
                y: chord.y,
                dy: chord.dy,
                load: footprint.mean_pressure(&chord, x[0], x[1]) * step * chord.dy,
            });
        }
    }
    parts
}

/// The share of the load that is placed differently by the ellipse.
fn load_mismatch(parts: &[EllipsePart], ellipse: &LoadEllipse) -> f64 {
    let LoadEllipse {
        centre,
        semi_axes: [a, b],
        ..
    } = *ellipse;
    let load: f64 = parts.iter().map(|part| part.load).sum();
    let ellipse = Ellipse::of_semi_axes(a, b, NormalLoad::Force(load), 1.0);
    let (mut apart, mut inside) = (0.0, 0.0);
    for part in parts {
        let y = part.y - centre[1];
        let chord = ellipse.chords(&[(y, part.dy)]);
        let own = chord.first().map_or(0.0, |chord: &Chord| {
            let [low, high] = part.x.map(|x| x - centre[0]);
            let ends = [
                low.clamp(chord.left, chord.right),
                high.clamp(chord.left, chord.right),
            ];
            ellipse.mean_pressure(chord, ends[0], ends[1]) * (ends[1] - ends[0]) * part.dy
        });
        apart += (part.load - own).abs();
        inside += own;
    }
    // Where the patch does not reach, all of the load of the ellipse is misplaced.
    0.5 * (apart + (load - inside).max(0.0)) / load
}

/// The chord of a strip and the line of the region that it is derived from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StripChord {
    /// The meshed chord: centred on the line, with a length between that of the line and the mean over the strip (see [`chords`]).
    pub chord: Chord,
    /// The chord of the region on the mid-line of the strip.
    pub line: Chord,
    /// y of the load centre of the strip; the mid-line where a strip has several chords.
    pub load_y: f64,
    /// Load of the strip over its width in N/mm; `None` where a strip has several chords.
    pub load: Option<f64>,
    /// Load over width in N/mm that the strip cannot place, weighted by its effect on the resultants (see [`chords`]).
    pub unresolved: f64,
}

impl StripChord {
    /// Mean pressure in MPa over `x0 < x < x1` of the chord. The pressure of the line is stretched and scaled with the length, so its profile keeps its form
    /// (exact for Hertz's semi-ellipse).
    pub fn mean_pressure(&self, footprint: &Footprint, x0: f64, x1: f64) -> f64 {
        let ratio = self.stretch();
        let middle = 0.5 * (self.line.left + self.line.right);
        let stretched = |x: f64| middle + (x - middle) / ratio;
        ratio * footprint.mean_pressure(&self.line, stretched(x0), stretched(x1))
    }

    /// Length of the chord over that of the line.
    pub fn stretch(&self) -> f64 {
        (self.chord.right - self.chord.left) / (self.line.right - self.line.left)
    }

    /// Loads over width at equally spaced `(y, load)` of the strip.
    pub fn loads(&self, footprint: &Footprint, patch: usize, samples: usize) -> Vec<(f64, f64)> {
        let step = self.line.dy / samples as f64;
        let places =
            (0..samples).map(|k| self.line.y + (k as f64 + 0.5) * step - 0.5 * self.line.dy);
        let load = |y: f64| {
            let across = footprint.chords(patch, &[(y, step)]);
            let of_chord = |chord: &Chord| {
                (chord.right - chord.left) * footprint.mean_pressure(chord, chord.left, chord.right)
            };
            across.iter().map(of_chord).sum::<f64>()
        };
        places.map(|y| (y, load(y))).collect()
    }
}

/// Chords of one patch on the strips `(y, dy)`.
///
/// The chord of the mid-line is too long where the patch ends inside a strip, and the mean chord, which has the exact area, too short for the forces. With
/// the weights `1 − θ` and θ, `θ = ½ / (1 + ½ (a/b)²)`, where a is the longest half chord and b the half width of the patch, the errors of the resultants of
/// 62 Hertz cases fall by a third, and that of Kalker's C33 as well. Where a strip has several chords, those of the mid-line are kept. With `like_circle` θ is
/// that of a circle, so the meshes of all ellipses are images of each other. The weight of an unresolved load is 2θ: it affects the resultants of wide patches,
/// whose strips act almost independently, and hardly those of long ones.
pub fn chords(
    footprint: &Footprint,
    patch: usize,
    strips: &[(f64, f64)],
    like_circle: bool,
) -> Vec<StripChord> {
    let lines = footprint.chords(patch, strips);
    let alone = |line: &Chord| {
        lines
            .iter()
            .filter(|other| other.strip == line.strip)
            .count()
            == 1
    };
    let longest = lines
        .iter()
        .map(|line| line.right - line.left)
        .fold(0.0, f64::max);
    let width: f64 = strips.iter().map(|(_, dy)| dy).sum();
    let ratio = if like_circle { 1.0 } else { longest / width };
    let share = 0.5 / (1.0 + 0.5 * ratio.powi(2));
    let mut across = StripBuffer::new();
    let fit = |line: &Chord| {
        let strip = alone(line).then(|| StripLoad::of(footprint, line, &mut across));
        let mean = strip.and_then(|strip| strip.length);
        let length = line.right - line.left;
        let half = 0.5 * ((1.0 - share) * length + share * mean.unwrap_or(length));
        let middle = 0.5 * (line.left + line.right);
        StripChord {
            chord: Chord {
                left: middle - half,
                right: middle + half,
                ..*line
            },
            line: *line,
            load_y: strip.map_or(line.y, |strip| strip.load_y),
            load: strip.map(|strip| strip.load).filter(|load| *load > 0.0),
            unresolved: strip.map_or(0.0, |strip| 2.0 * share * strip.unresolved),
        }
    };
    lines.iter().map(fit).collect()
}

/// Points along a chord for its mean pressure. With 16 as many estimates hold in the tables `gap` and `profiles` of `cargo bench --bench calibrate`, and a row
/// of `cargo bench --bench wheels -- rows` takes 1 % more instructions.
const POINTS: usize = 8;

/// Buffers and angles that all strips share.
struct StripBuffer {
    /// The chords of one line.
    across: Vec<Chord>,
    angles: LineAngles<POINTS>,
}

impl StripBuffer {
    fn new() -> StripBuffer {
        StripBuffer {
            across: Vec::new(),
            angles: LineAngles::new(),
        }
    }
}

/// Mean length, load and load centre of a strip.
#[derive(Debug, Clone, Copy)]
struct StripLoad {
    /// Mean length of the chords; `None` if a line of the strip has more than one.
    length: Option<f64>,
    /// y of the centre of the load.
    load_y: f64,
    /// Load over width.
    load: f64,
    /// Half the mean distance of the line load from the straight line with the same load and load centre. A strip resolves no finer detail.
    unresolved: f64,
}

impl StripLoad {
    /// Integrates over the strip about a line.
    fn of(
        footprint: &Footprint,
        line: &Chord,
        StripBuffer { across, angles }: &mut StripBuffer,
    ) -> StripLoad {
        let (mut length, mut load, mut moment) = (Some(0.0), 0.0, 0.0);
        let mut line_loads = [0.0; FOUR_POINTS.len()];
        for (line_load, (place, weight)) in line_loads.iter_mut().zip(FOUR_POINTS) {
            let y = line.y + 0.5 * line.dy * place;
            footprint.chords_into(line.patch, &[(y, line.dy)], across);
            if across.len() > 1 {
                length = None;
            }
            for chord in &*across {
                let long = 0.5 * weight * (chord.right - chord.left);
                let share = long * footprint.mean_of_line(chord, angles);
                length = length.map(|sum: f64| sum + long);
                *line_load += 2.0 / weight * share;
                load += share;
                moment += share * (y - line.y);
            }
        }
        let load_y = if load > 0.0 {
            line.y + moment / load
        } else {
            line.y
        };
        // The line load changes by this much from the middle to an end of the strip.
        let slope = 6.0 * moment / line.dy;
        let apart = |(line_load, (place, weight)): (f64, (f64, f64))| {
            0.25 * weight * (line_load - load - slope * place).abs()
        };
        StripLoad {
            length,
            load_y,
            load,
            unresolved: line_loads.into_iter().zip(FOUR_POINTS).map(apart).sum(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on_grid(pressure: impl Fn(f64, f64) -> f64) -> Footprint {
        Footprint::given(field_of(pressure))
    }

    fn field_of(pressure: impl Fn(f64, f64) -> f64) -> PressureField {
        let axis: Vec<f64> = (-60..=60).map(|k| 0.1 * f64::from(k)).collect();
        let row = |y: &f64| axis.iter().map(|x| pressure(*x, *y).max(0.0)).collect();
        let rows: Vec<Vec<f64>> = axis.iter().map(row).collect();
        PressureField::new(&axis, &axis, &rows).unwrap().0
    }

    fn hertz(x: f64, y: f64) -> f64 {
        800.0
            * (1.0 - (x - 0.4).powi(2) / 16.0 - (y + 1.0).powi(2) / 4.0)
                .max(0.0)
                .sqrt()
    }

    #[test]
    fn hertz_on_a_grid_is_its_own_ellipse_with_no_load_elsewhere() {
        let found = LoadEllipse::of(&on_grid(hertz), 0);
        let known = [0.4, -1.0, 4.0, 2.0];
        let all = [found.centre, found.semi_axes].concat();
        for (found, known) in all.iter().zip(known) {
            assert!((found - known).abs() < 0.02, "{found} {known}");
        }
        assert!(found.load_mismatch < 0.015, "{found:?}");
        let rough = LoadEllipse::of_samples(&field_of(hertz), 0);
        for (rough, fine) in [rough.centre, rough.semi_axes].concat().iter().zip(&all) {
            assert!((rough - fine).abs() < 0.01, "{rough} {fine}");
        }
    }

    #[test]
    fn two_lobes_of_load_have_much_of_it_elsewhere() {
        let lobes = |x: f64, y: f64| {
            let lobe = |y0: f64| (1.0 - x * x / 9.0 - (y - y0).powi(2) / 4.0).max(0.0).sqrt();
            700.0 * (lobe(-1.9) + lobe(1.9))
        };
        let found = LoadEllipse::of(&on_grid(lobes), 0);
        assert!(
            found.load_mismatch > 0.15 && found.load_mismatch < 0.4,
            "{found:?}"
        );
    }
}

#[cfg(test)]
mod strip_chords_tests {
    use super::*;
    use crate::mesh::equal_strips;
    use crate::normal::hertz::{Ellipse, NormalLoad};
    use crate::normal::pressure_field::field::PressureField;

    fn circle() -> Footprint {
        let force = NormalLoad::Force(2.0 * std::f64::consts::PI / 3.0);
        Footprint::hertz(Ellipse::of_semi_axes(1.0, 1.0, force, 1.0))
    }

    fn area(strips: usize) -> (f64, f64) {
        let fitted = chords(&circle(), 0, &equal_strips(-1.0, 1.0, strips), false);
        let sum = |f: fn(&StripChord) -> f64| fitted.iter().map(f).sum::<f64>();
        (
            sum(|f| (f.chord.right - f.chord.left) * f.chord.dy),
            sum(|f| (f.line.right - f.line.left) * f.line.dy),
        )
    }

    #[test]
    fn the_area_of_the_chords_is_nearer_to_the_circle_than_that_of_the_lines() {
        for strips in [4, 8, 16] {
            let (chords, lines) = area(strips);
            let error = |area: f64| (area - std::f64::consts::PI).abs();
            assert!(
                error(chords) < 0.8 * error(lines),
                "{strips} {chords} {lines}"
            );
        }
    }

    #[test]
    fn the_pressure_still_ends_at_the_ends_of_the_chord() {
        let footprint = circle();
        for fitted in chords(&footprint, 0, &equal_strips(-1.0, 1.0, 6), false) {
            let Chord { left, right, .. } = fitted.chord;
            let near = fitted.mean_pressure(&footprint, right - 1e-6 * (right - left), right);
            let middle = fitted.mean_pressure(&footprint, -1e-6, 1e-6);
            assert!(near < 2e-3 * middle && near > 0.0, "{near} {middle}");
        }
    }

    /// Of a pressure that was given every interval of the samples is integrated, of one that was computed a few points of the line.
    #[test]
    fn loads_from_a_few_points_are_those_of_all_intervals() {
        let axis: Vec<f64> = (-34..=34).map(|k| 0.04 * f64::from(k)).collect();
        let lens = |x: f64, y: f64| 1.0 - x * x - y * y * (1.0 + 0.4 * y - 0.3 * x);
        let line = |y: &f64| -> Vec<f64> {
            let pressure = |x: &f64| 900.0 * lens(*x, *y).max(0.0).sqrt();
            axis.iter().map(pressure).collect()
        };
        let rows: Vec<Vec<f64>> = axis.iter().map(line).collect();
        let (field, _) = PressureField::new(&axis, &axis, &rows).unwrap();
        let [.., low, high] = field.patches()[0].extent;
        let strips = equal_strips(low, high, 8);
        let exact = chords(&Footprint::given(field.clone()), 0, &strips, false);
        let found = chords(&Footprint::computed(field, 0.0, 0.0), 0, &strips, false);
        for (exact, found) in exact.iter().zip(&found) {
            let ratio = found.load.unwrap() / exact.load.unwrap();
            assert!((ratio - 1.0).abs() < 5e-4, "{}: {ratio}", exact.line.y);
            assert_eq!(exact.chord, found.chord);
        }
    }
}
