//! Tests of a pressure given on a grid: the edge between samples, the pressure on cells, the load.

use std::f64::consts::PI;

use crate::cases::{grid_case, problem};
use crate::pressure_samples::{Samples, chord_load, strip_load, strips};

/// Hertz's pressure with semi-axes 6 and 3.5 about (1.3, −0.7), rotated by an angle. The largest value is 1000.
struct Askew {
    xx: f64,
    xy: f64,
    yy: f64,
}

const CENTRE: [f64; 2] = [1.3, -0.7];
const SEMI_AXES: [f64; 2] = [6.0, 3.5];

impl Askew {
    fn turned_by(angle: f64) -> Askew {
        let [a, b] = SEMI_AXES.map(|s| 1.0 / (s * s));
        let (sin, cos) = angle.sin_cos();
        Askew {
            xx: a * cos * cos + b * sin * sin,
            xy: 2.0 * (a - b) * sin * cos,
            yy: a * sin * sin + b * cos * cos,
        }
    }

    fn pressure(&self, x: f64, y: f64) -> f64 {
        let (x, y) = (x - CENTRE[0], y - CENTRE[1]);
        let q = 1.0 - self.xx * x * x - self.xy * x * y - self.yy * y * y;
        1000.0 * q.max(0.0).sqrt()
    }

    fn chord(&self, y: f64) -> [f64; 2] {
        let y = y - CENTRE[1];
        let root = ((self.xy * y).powi(2) - 4.0 * self.xx * (self.yy * y * y - 1.0)).sqrt();
        [-root, root].map(|root| CENTRE[0] + (root - self.xy * y) / (2.0 * self.xx))
    }

    fn half_height(&self) -> f64 {
        (self.yy - self.xy * self.xy / (4.0 * self.xx)).powf(-0.5)
    }

    fn half_length(&self) -> f64 {
        (self.xx - self.xy * self.xy / (4.0 * self.yy)).powf(-0.5)
    }

    fn load() -> f64 {
        2.0 / 3.0 * PI * SEMI_AXES[0] * SEMI_AXES[1] * 1000.0
    }

    fn samples(&self, n: u32) -> Samples {
        let (l, h) = (1.13 * self.half_length(), 1.09 * self.half_height());
        let extent = [
            CENTRE[0] - l,
            CENTRE[0] + 1.02 * l,
            CENTRE[1] - h,
            CENTRE[1] + 1.05 * h,
        ];
        Samples::of(extent, n, |x, y| self.pressure(x, y))
    }
}

#[test]
fn hertz_samples_give_the_edge_of_the_ellipse() {
    for angle in [0.0, PI / 2.0, 0.4, -1.1] {
        let askew = Askew::turned_by(angle);
        for n in [12, 20, 37] {
            let (field, remarks) = askew.samples(n).field_with_remarks();
            assert!(remarks.is_empty(), "{remarks:?}");
            let patches = field.patches();
            assert_eq!(patches.len(), 1);
            let [x_min, x_max, y_min, y_max] = patches[0].extent;
            let (l, h) = (askew.half_length(), askew.half_height());
            for (found, exact) in [
                (x_min, CENTRE[0] - l),
                (x_max, CENTRE[0] + l),
                (y_min, CENTRE[1] - h),
                (y_max, CENTRE[1] + h),
            ] {
                assert!(
                    (found - exact).abs() < 1e-6 * l,
                    "{angle} {n}: {found} for {exact}"
                );
            }
            assert!((patches[0].area / (PI * SEMI_AXES[0] * SEMI_AXES[1]) - 1.0).abs() < 1e-4);
            let strips = strips(&field, 0, 16);
            let chords = field.chords(0, &strips);
            assert_eq!(chords.len(), strips.len());
            for (k, chord) in chords.iter().enumerate() {
                let [left, right] = askew.chord(chord.y);
                assert_eq!((chord.patch, chord.strip), (0, k));
                let worst = (chord.left - left).abs().max((chord.right - right).abs());
                assert!(
                    worst < 1e-6 * l,
                    "{angle} {n} strip {k}: {chord:?} for {left}..{right}"
                );
            }
        }
    }
}

#[test]
fn hertz_pressure_is_reproduced_on_cells() {
    let askew = Askew::turned_by(0.4);
    let field = askew.samples(20).field();
    for chord in field.chords(0, &strips(&field, 0, 9)) {
        let [left, right] = askew.chord(chord.y);
        // On a chord Hertz's pressure is 1000 √(xx) √((x − left)(right − x)).
        let exact = 1000.0 * askew.xx.sqrt() * PI / 8.0 * (right - left).powi(2);
        for cells in [1, 2, 16] {
            let load = chord_load(&field, &chord, cells);
            assert!(
                (load / exact - 1.0).abs() < 1e-7,
                "{cells} cells: {load} for {exact}"
            );
        }
        let x = 0.3 * left + 0.7 * right;
        assert!((field.mean_pressure(&chord, x, x) - askew.pressure(x, chord.y)).abs() < 1e-8);
        assert_eq!(field.mean_pressure(&chord, right + 0.1, right + 0.2), 0.0);
        let beyond = field.mean_pressure(&chord, x, right + 1.0) * (right + 1.0 - x);
        let inside = field.mean_pressure(&chord, x, right) * (right - x);
        assert!((beyond / inside - 1.0).abs() < 1e-9);
    }
}

#[test]
fn the_load_of_samples_converges_to_that_of_hertz() {
    let mut last = f64::INFINITY;
    for (n, allowed) in [(20, 5e-3), (80, 1e-3), (320, 1e-4)] {
        let worst = [0.0, 0.4, PI / 2.0]
            .into_iter()
            .map(|angle| Askew::turned_by(angle).samples(n).field().patches()[0].normal_force)
            .map(|load| (load / Askew::load() - 1.0).abs())
            .fold(0.0, f64::max);
        assert!(worst < allowed && worst < last, "{n}: {worst}");
        last = worst;
    }
}

#[test]
fn strips_carry_the_load_of_the_samples_before_scaling() {
    let askew = Askew::turned_by(0.4);
    let hertz = askew.samples(20).field();
    let off = strip_load(&hertz, 0, 16, 16) / hertz.patches()[0].normal_force - 1.0;
    assert!(off.abs() < 5e-3, "Hertz: {off}");
    // The error of the strips alone, without sampling: the midpoint rule on an elliptic load.
    let off = strip_load(&hertz, 0, 16, 16) / Askew::load() - 1.0;
    assert!(off.abs() < 2e-3, "strips: {off}");
    let egg = Samples::of([-3.0, 3.0, -3.0, 3.0], 20, egg_pressure).field();
    let off = strip_load(&egg, 0, 16, 16) / egg.patches()[0].normal_force - 1.0;
    assert!(off.abs() < 5e-3, "egg: {off}");
}

/// Returns the pressure of an egg: blunt toward +y, pointed toward −y, decreasing like the root of the distance to its edge.
fn egg_pressure(x: f64, y: f64) -> f64 {
    let width = 1.5 + 0.35 * y;
    let q = 1.0 - (x / width).powi(2) - (y / 2.5).powi(2);
    if width > 0.0 {
        800.0 * q.max(0.0).sqrt()
    } else {
        0.0
    }
}

#[test]
fn the_edge_of_an_egg_converges() {
    let chord = |y: f64| (1.5 + 0.35 * y) * (1.0 - (y / 2.5).powi(2)).sqrt();
    let worst = |n: u32| {
        let field = Samples::of([-3.0, 3.0, -3.0, 3.0], n, egg_pressure).field();
        let found = field.chords(0, &[(-1.9, 0.1), (-0.33, 0.1), (1.0, 0.1), (2.1, 0.1)]);
        assert_eq!(found.len(), 4);
        found
            .iter()
            .map(|c| {
                (c.right - chord(c.y))
                    .abs()
                    .max((c.left + chord(c.y)).abs())
            })
            .fold(0.0, f64::max)
    };
    let (coarse, medium, fine) = (worst(20), worst(40), worst(80));
    assert!(
        coarse < 0.02 && fine < medium && medium < coarse,
        "{coarse} {medium} {fine}"
    );
    assert!(
        coarse / fine > 10.0,
        "the error falls nearly with the square of the spacing: {coarse} {fine}"
    );
}

#[test]
fn unequal_spacing_gives_the_same_ellipse() {
    let askew = Askew::turned_by(0.4);
    let graded = |n: u32, low: f64, high: f64| -> Vec<f64> {
        (0..n)
            .map(|k| {
                0.5 * (low + high)
                    - 0.5 * (high - low) * (PI * f64::from(k) / f64::from(n - 1)).cos()
            })
            .collect()
    };
    let samples = Samples::on(graded(30, -6.0, 8.0), graded(25, -6.0, 5.0), |x, y| {
        askew.pressure(x, y)
    });
    let field = samples.field();
    for chord in field.chords(0, &strips(&field, 0, 11)) {
        let [left, right] = askew.chord(chord.y);
        assert!((chord.left - left).abs() < 1e-6 && (chord.right - right).abs() < 1e-6);
    }
    assert!((field.patches()[0].normal_force / Askew::load() - 1.0).abs() < 5e-3);
}

#[test]
fn a_case_of_a_grid_becomes_a_region() {
    let samples = Askew::turned_by(0.4).samples(20);
    let checked = problem(&grid_case(samples.contact()));
    let patch = checked.problem.task.known_patches().expect("known")[0];
    assert!((patch.normal_force / Askew::load() - 1.0).abs() < 5e-3);
    assert_eq!((patch.approach, patch.semi_axes), (None, None));
}
