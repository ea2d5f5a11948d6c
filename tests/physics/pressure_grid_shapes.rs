//! Tests of patches that are not ellipses: several, bent, hollow, flat, rough, tiny, cut off.

use std::f64::consts::PI;

use proptest::prelude::*;
use railhead_contact::normal::pressure_field::field::PressureField;

use crate::pressure_samples::{Samples, strip_load, strips};

#[test]
fn two_patches_keep_their_own_load() {
    let circle = |x: f64, y: f64, cx: f64, cy: f64, p: f64| {
        p * (1.0 - (x - cx).powi(2) - (y - cy).powi(2)).max(0.0).sqrt()
    };
    let samples = Samples::of([-2.5, 2.5, -2.5, 2.5], 51, |x, y| {
        circle(x, y, 0.5, 1.2, 900.0) + circle(x, y, -0.4, -1.15, 600.0)
    });
    let field = samples.field();
    let patches = field.patches();
    assert_eq!(patches.len(), 2);
    for (patch, (y, p)) in [(-1.15, 600.0), (1.2, 900.0)].into_iter().enumerate() {
        let found = patches[patch];
        let off = found.normal_force / (2.0 / 3.0 * PI * p) - 1.0;
        assert!(off.abs() < 1e-2, "{off}");
        assert!((found.area / PI - 1.0).abs() < 1e-4);
        assert!(
            (found.extent[2] - (y - 1.0)).abs() < 1e-4
                && (found.extent[3] - (y + 1.0)).abs() < 1e-4
        );
        assert!((found.pressure_max / p - 1.0).abs() < 0.01);
        let off = strip_load(&field, patch, 12, 12) / found.normal_force - 1.0;
        // Both sums are inexact here: the samples by −0.65 %, the 12 strips by +0.36 %.
        assert!(off.abs() < 0.015, "{off}");
    }
    // A line through one patch is not a chord of the other.
    assert!(field.chords(0, &[(1.2, 0.1)]).is_empty());
    assert_eq!(field.chords(1, &[(1.2, 0.1)]).len(), 1);
}

#[test]
fn patches_one_sample_apart_stay_apart() {
    let mut pressure = vec![vec![5.0; 9]; 9];
    pressure[4] = vec![0.0; 9];
    let axis: Vec<f64> = (0..9).map(f64::from).collect();
    let (field, _) = PressureField::new(&axis, &axis, &pressure).unwrap();
    let patches = field.patches();
    assert_eq!(patches.len(), 2);
    let [below, above] = [patches[0].extent[3], patches[1].extent[2]];
    assert!(
        below > 3.3 && below < 3.7 && (below + above - 8.0).abs() < 1e-9,
        "{below} {above}"
    );
}

/// Returns the pressure of a kidney: a half ring of mean radius 3 and width 2, open toward +y, with a round pressure profile.
fn kidney_pressure(x: f64, y: f64) -> f64 {
    let r = x.hypot(y);
    let bend = if y < 0.0 {
        r - 3.0
    } else {
        (x.abs() - 3.0).hypot(y)
    };
    700.0 * (1.0 - bend * bend).max(0.0).sqrt()
}

#[test]
fn a_bent_patch_has_two_segments_per_strip() {
    let field = Samples::of([-5.0, 5.0, -5.0, 2.0], 81, kidney_pressure).field();
    assert_eq!(field.patches().len(), 1);
    let chords = field.chords(0, &[(-3.5, 0.1), (-1.0, 0.1), (0.5, 0.1)]);
    let strips: Vec<usize> = chords.iter().map(|chord| chord.strip).collect();
    assert_eq!(strips, [0, 1, 1, 2, 2]);
    let (inner, outer) = (3.0_f64.sqrt(), 15.0_f64.sqrt());
    for (found, exact) in [
        (chords[1].left, -outer),
        (chords[1].right, -inner),
        (chords[2].left, inner),
        (chords[2].right, outer),
    ] {
        assert!((found - exact).abs() < 1e-3, "{found} for {exact}");
    }
    // A half ring like a torus (Pappus), and two half-circular ends that together make one circle.
    let load = 700.0 * (PI / 2.0 * 3.0 * PI + 2.0 * PI / 3.0);
    assert!((field.patches()[0].normal_force / load - 1.0).abs() < 5e-3);
    assert!((strip_load(&field, 0, 24, 12) / load - 1.0).abs() < 1e-2);
    assert!(field.segments_per_strip()[0] > 1.4 && field.segments_per_strip()[0] < 2.0);
}

#[test]
fn a_ring_keeps_its_hole() {
    let field = Samples::of([-3.0, 3.0, -3.0, 3.0], 41, |x, y| {
        100.0 * (1.0 - ((x.hypot(y) - 1.5) / 0.8).powi(2)).max(0.0).sqrt()
    })
    .field();
    assert_eq!(field.patches().len(), 1);
    let chords = field.chords(0, &[(0.0, 0.1)]);
    assert_eq!(chords.len(), 2);
    assert!(
        (chords[0].right + 0.7).abs() < 2e-3 && (chords[1].left - 0.7).abs() < 2e-3,
        "{chords:?}"
    );
    assert!((field.patches()[0].area / (PI * (2.3 * 2.3 - 0.7 * 0.7)) - 1.0).abs() < 2e-3);
}

#[test]
fn a_block_of_equal_pressure_ends_half_a_spacing_beyond_its_samples() {
    let inside = |x: f64, y: f64| x.abs() < 2.05 && y.abs() < 1.05;
    let samples = Samples::of([-3.0, 3.0, -3.0, 3.0], 31, |x, y| {
        if inside(x, y) { 50.0 } else { 0.0 }
    });
    let field = samples.field();
    let patch = field.patches()[0];
    for (found, exact) in patch.extent.into_iter().zip([-2.1, 2.1, -1.1, 1.1]) {
        assert!((found - exact).abs() < 0.01, "{:?}", patch.extent);
    }
    assert!((patch.normal_force / (4.2 * 2.2 * 50.0) - 1.0).abs() < 1e-12);
    assert!(
        (patch.area / (4.2 * 2.2) - 1.0).abs() < 5e-3,
        "{}",
        patch.area
    );
    let chord = field.chords(0, &[(0.0, 0.1)])[0];
    assert!((field.mean_pressure(&chord, -1.0, 1.5) / 50.0 - 1.0).abs() < 1e-12);
}

#[test]
fn rough_pressure_does_not_tear_a_patch() {
    // Deep dips between positive samples would make the interpolating curve overshoot below 0.
    let axis: Vec<f64> = (0..12).map(f64::from).collect();
    let pressure = |i: usize, j: usize| {
        if (i / 2 + j / 2).is_multiple_of(2) {
            100.0
        } else {
            3.0
        }
    };
    let rows: Vec<Vec<f64>> = (0..12)
        .map(|j| {
            let inner = |k: usize| (1..11).contains(&k);
            (0..12)
                .map(|i| {
                    if inner(i) && inner(j) {
                        pressure(i, j)
                    } else {
                        0.0
                    }
                })
                .collect()
        })
        .collect();
    let (field, _) = PressureField::new(&axis, &axis, &rows).unwrap();
    assert_eq!(field.patches().len(), 1);
    let lines: Vec<(f64, f64)> = (0..40).map(|k| (1.5 + 0.2 * f64::from(k), 0.2)).collect();
    assert_eq!(field.chords(0, &lines).len(), lines.len());
}

#[test]
fn a_single_sample_is_a_patch() {
    let samples = Samples::of([-1.0, 1.0, -1.0, 1.0], 3, |x, y| {
        if x == 0.0 && y == 0.0 { 10.0 } else { 0.0 }
    });
    let (field, remarks) = samples.field_with_remarks();
    let patch = field.patches()[0];
    assert!((patch.normal_force - 10.0).abs() < 1e-12);
    let [x_min, x_max, y_min, y_max] = patch.extent;
    assert!(
        x_max > 0.4 && x_max < 0.7 && (x_min + x_max).abs() < 1e-9,
        "{patch:?}"
    );
    assert!(
        (y_max - x_max).abs() < 1e-9 && (y_min + y_max).abs() < 1e-9,
        "{patch:?}"
    );
    assert!(remarks[0].detail.contains("1 by 1 samples"), "{remarks:?}");
}

#[test]
fn a_cut_contact_is_remarked() {
    let circle = |x: f64, y: f64| (1.0 - x * x - y * y).max(0.0).sqrt();
    let (_, whole) = Samples::of([-1.0, 1.0, -1.0, 1.0], 21, circle).field_with_remarks();
    assert!(whole.is_empty(), "{whole:?}");
    let (field, cut) = Samples::of([-1.2, 0.5, -1.2, 1.2], 21, circle).field_with_remarks();
    assert_eq!(cut[0].code, "pressure-cut-at-edge", "{cut:?}");
    let x_max = field.patches()[0].extent[1];
    assert!(x_max > 0.5 && x_max < 0.5 + 1.7 / 20.0, "{x_max}");
}

/// Returns any grid: axes with spacings over two decades, pressures over six, many zeros.
fn any_grid() -> impl Strategy<Value = (Vec<f64>, Vec<f64>, Vec<Vec<f64>>)> {
    let axis = |n: usize| {
        let spacings = prop::collection::vec(-1.0..1.0_f64, n);
        spacings.prop_map(|exponents| {
            let sum = |at: &mut f64, exponent: f64| {
                *at += 10.0_f64.powf(exponent);
                Some(*at)
            };
            exponents.into_iter().scan(0.0, sum).collect::<Vec<f64>>()
        })
    };
    let pressure = prop_oneof![3 => Just(0.0), 5 => (-3.0..3.0_f64).prop_map(|e| 10.0_f64.powf(e))];
    (2..9_usize, 2..9_usize).prop_flat_map(move |(nx, ny)| {
        let rows = prop::collection::vec(prop::collection::vec(pressure.clone(), nx), ny);
        (axis(nx), axis(ny), rows)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_grid_gives_sound_patches_and_chords((x, y, pressure) in any_grid()) {
        let Ok((field, _)) = PressureField::new(&x, &y, &pressure) else {
            prop_assert!(pressure.iter().flatten().all(|p| *p == 0.0));
            return Ok(());
        };
        let width = |axis: &[f64], k: usize| {
            let last = axis.len() - 1;
            let step = |k: usize| axis[k] - axis[k - 1];
            0.5 * (step(k.max(1)) + step((k + 1).min(last)))
        };
        let samples: f64 = (0..y.len())
            .flat_map(|j| (0..x.len()).map(move |i| (i, j)))
            .map(|(i, j)| pressure[j][i] * width(&x, i) * width(&y, j))
            .sum();
        let force: f64 = field.patches().iter().map(|patch| patch.normal_force).sum();
        prop_assert!((force / samples - 1.0).abs() < 1e-12, "{force} {samples}");
        for (k, patch) in field.patches().iter().enumerate() {
            let [x_min, x_max, y_min, y_max] = patch.extent;
            prop_assert!(x_min < x_max && y_min < y_max && patch.area > 0.0, "{patch:?}");
            prop_assert!(patch.area <= (x_max - x_min) * (y_max - y_min) * 1.02, "{patch:?}");
            let chords = field.chords(k, &strips(&field, k, 13));
            prop_assert!(!chords.is_empty());
            for pair in chords.windows(2) {
                prop_assert!(pair[0].strip < pair[1].strip || pair[0].right < pair[1].left, "{pair:?}");
            }
            for chord in &chords {
                prop_assert!(chord.left < chord.right && chord.patch == k);
                prop_assert!(chord.left >= x_min && chord.right <= x_max, "{chord:?} {patch:?}");
                let mean = field.mean_pressure(chord, chord.left, chord.right);
                prop_assert!(mean > 0.0 && mean <= 1.5e3, "{mean}");
            }
        }
    }

    #[test]
    fn turning_the_grid_round_turns_the_patches((x, y, pressure) in any_grid()) {
        let Ok((field, _)) = PressureField::new(&x, &y, &pressure) else {
            return Ok(());
        };
        let back = |axis: &[f64]| axis.iter().rev().map(|x| -x).collect::<Vec<f64>>();
        let rows: Vec<Vec<f64>> = pressure.iter().map(|row| row.iter().rev().copied().collect()).collect();
        let (mirrored, _) = PressureField::new(&back(&x), &y, &rows).unwrap();
        let total = |field: &PressureField| field.patches().iter().map(|patch| patch.area).sum::<f64>();
        prop_assert!((total(&field) / total(&mirrored) - 1.0).abs() < 1e-4, "{} {}", total(&field), total(&mirrored));
    }
}
