//! The bulk operator against the closed forms, point by point, and against itself folded.

use std::ops::ControlFlow;

use super::*;
use crate::contact::half_space::kernels::{Rectangle, rectangle};
use crate::contact::mesh::samples::mesh_between;
use crate::contact::mesh::{Chord, Grading, observation_points};
use crate::contact::monitor::Unmonitored;

fn ellipse(a: f64, b: f64, strips: usize, cells: usize) -> Mesh {
    mesh_between(b, [strips, cells], |y| {
        let half = a * (1.0 - (y / b).powi(2)).sqrt();
        [-half, half]
    })
}

/// Two patches of different strip widths side by side, one with two segments in a strip.
fn scattered() -> Mesh {
    let chord = |patch, strip, y, dy, left, right| Chord {
        patch,
        strip,
        y,
        dy,
        left,
        right,
    };
    let chords = [
        chord(0, 0, -1.0, 0.5, -1.0, 0.4),
        chord(0, 1, -0.5, 0.5, -1.2, -0.3),
        chord(0, 1, -0.5, 0.5, 0.1, 0.9),
        chord(1, 0, 0.25, 0.3, -0.2, 0.2),
        chord(1, 1, 0.55, 0.3, -0.4, 0.1),
    ];
    Mesh::new(&chords, &Grading::cosine(4))
}

fn by_closed_form(mesh: &Mesh, nu: f64, tx: &[f64], ty: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let displacement = |x: f64, y: f64| {
        let (mut ux, mut uy) = (0.0, 0.0);
        for segment in &mesh.segments {
            let (y0, y1) = (
                segment.chord.y - 0.5 * segment.chord.dy,
                segment.chord.y + 0.5 * segment.chord.dy,
            );
            for i in segment.cells.clone() {
                let cell = Rectangle {
                    x0: mesh.left[i],
                    x1: mesh.right[i],
                    y0,
                    y1,
                };
                let influence = rectangle(x, y, cell, nu);
                ux += influence.xx * tx[i] + influence.xy * ty[i];
                uy += influence.xy * tx[i] + influence.yy * ty[i];
            }
        }
        (ux, uy)
    };
    let mut out = (Vec::new(), Vec::new());
    for segment in &mesh.segments {
        let points = observation_points(mesh, segment);
        let u: Vec<(f64, f64)> = points
            .iter()
            .map(|x| displacement(*x, segment.chord.y))
            .collect();
        for pair in u.windows(2) {
            out.0.push(pair[1].0 - pair[0].0);
            out.1.push(pair[1].1 - pair[0].1);
        }
    }
    out
}

fn tractions(mesh: &Mesh, padded: usize) -> (Vec<f64>, Vec<f64>) {
    let wave = |a: f64, b: f64| {
        let mut values: Vec<f64> = (0..mesh.cells())
            .map(|i| (a * i as f64 + b).sin())
            .collect();
        values.resize(padded, 0.0);
        values
    };
    (wave(0.7, 0.1), wave(1.3, 2.0))
}

fn largest_gap(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
        / size
}

fn applied(differences: &StripOperator, mesh: &Mesh) -> (Vec<f64>, Vec<f64>) {
    let (tx, ty) = tractions(mesh, differences.padded(None));
    let rows: usize = mesh.segments.iter().map(|s| rows_of(s.cells.len())).sum();
    let (mut ux, mut uy) = (vec![0.0; rows], vec![0.0; rows]);
    differences.apply(
        None,
        &tx,
        &ty,
        &mut ux,
        &mut uy,
        &mut OperatorScratch::default(),
    );
    (ux, uy)
}

#[test]
fn products_agree_with_the_closed_forms() {
    for mesh in [
        ellipse(1.0, 1.0, 5, 7),
        ellipse(0.05, 1.0, 6, 4),
        ellipse(50.0, 1.0, 4, 6),
        scattered(),
    ] {
        for nu in [0.0, 0.28, 0.5] {
            let differences =
                StripOperator::new(&mesh, nu, false, Precision::Double, &Unmonitored).unwrap();
            let (ux, uy) = applied(&differences, &mesh);
            let (tx, ty) = tractions(&mesh, mesh.cells());
            let (expected_x, expected_y) = by_closed_form(&mesh, nu, &tx, &ty);
            assert!(
                largest_gap(&ux, &expected_x) < 2e-13,
                "{}",
                largest_gap(&ux, &expected_x)
            );
            assert!(
                largest_gap(&uy, &expected_y) < 2e-13,
                "{}",
                largest_gap(&uy, &expected_y)
            );
        }
    }
}

#[test]
fn a_folded_matrix_gives_the_same_products_as_the_full_one() {
    for mesh in [ellipse(1.0, 2.0, 6, 16), ellipse(3.0, 1.0, 4, 16)] {
        let full = StripOperator::new(&mesh, 0.3, false, Precision::Double, &Unmonitored).unwrap();
        let folded = StripOperator::new(&mesh, 0.3, true, Precision::Double, &Unmonitored).unwrap();
        let (expected_x, expected_y) = applied(&full, &mesh);
        let (ux, uy) = applied(&folded, &mesh);
        assert!(largest_gap(&ux, &expected_x) < 1e-13 && largest_gap(&uy, &expected_y) < 1e-13);
        assert_eq!(2 * folded.entries(None), full.entries(None));
    }
}

#[test]
fn single_precision_keeps_five_digits() {
    for folded in [false, true] {
        let mesh = ellipse(1.5, 1.0, 6, 8);
        let double =
            StripOperator::new(&mesh, 0.3, folded, Precision::Double, &Unmonitored).unwrap();
        let single =
            StripOperator::new(&mesh, 0.3, folded, Precision::Single, &Unmonitored).unwrap();
        let (expected_x, expected_y) = applied(&double, &mesh);
        let (ux, uy) = applied(&single, &mesh);
        assert!(largest_gap(&ux, &expected_x) < 1e-5 && largest_gap(&uy, &expected_y) < 1e-5);
        assert!(ux != expected_x, "it is another matrix");
    }
}

#[test]
fn one_parity_needs_half_the_cells_only() {
    let mesh = ellipse(1.5, 1.0, 6, 8);
    let folded = StripOperator::new(&mesh, 0.3, true, Precision::Double, &Unmonitored).unwrap();
    let half = mesh.cells() / 2;
    for (parity, sign_x, sign_y) in [
        (Parity::Longitudinal, 1.0, -1.0),
        (Parity::Lateral, -1.0, 1.0),
    ] {
        let (mut tx, mut ty) = tractions(&mesh, folded.padded(None));
        for segment in &mesh.segments[..mesh.segments.len() / 2] {
            for i in segment.cells.clone() {
                let image = mesh.cells() - segment.cells.end + (i - segment.cells.start);
                tx[image] = sign_x * tx[i];
                ty[image] = sign_y * ty[i];
            }
        }
        let rows = folded.row_count();
        let (mut all_x, mut all_y) = (vec![0.0; 2 * rows], vec![0.0; 2 * rows]);
        folded.apply(
            None,
            &tx,
            &ty,
            &mut all_x,
            &mut all_y,
            &mut OperatorScratch::default(),
        );
        let (mut ux, mut uy) = (vec![0.0; rows], vec![0.0; rows]);
        tx.truncate(half);
        ty.truncate(half);
        tx.resize(folded.padded(Some(parity)), 0.0);
        ty.resize(folded.padded(Some(parity)), 0.0);
        folded.apply(
            Some(parity),
            &tx,
            &ty,
            &mut ux,
            &mut uy,
            &mut OperatorScratch::default(),
        );
        assert!(
            largest_gap(&ux, &all_x[..rows]) < 1e-13 && largest_gap(&uy, &all_y[..rows]) < 1e-13
        );
    }
}

#[test]
fn a_stop_is_seen_between_segments() {
    struct Stopped;
    impl Monitor for Stopped {
        fn tick(&self, _: f64) -> ControlFlow<Stop> {
            ControlFlow::Break(Stop::Cancelled)
        }
        fn elapsed(&self) -> std::time::Duration {
            std::time::Duration::ZERO
        }
    }
    let stopped = StripOperator::new(
        &ellipse(1.0, 1.0, 4, 4),
        0.3,
        false,
        Precision::Double,
        &Stopped,
    );
    assert_eq!(stopped.map(|_| ()), Err(Stop::Cancelled));
}

/// A mesh that is its own image has its trailing rows from the leading ones; moved along x it is none any more.
#[test]
fn rows_of_a_reversible_mesh_are_those_of_the_same_mesh_elsewhere() {
    for cells in [1, 2, 3, 4, 9, 19] {
        let mesh = ellipse(1.3, 0.8, 6, cells);
        let moved = mesh.normalised([0.25, 0.0], 1.0);
        assert!(mesh.is_reversible() && !moved.is_reversible());
        for folded in [false, true] {
            let [here, there] = [&mesh, &moved].map(|mesh| {
                StripOperator::new(mesh, 0.3, folded, Precision::Double, &Unmonitored).unwrap()
            });
            let parity = folded.then_some(Parity::Lateral);
            for row in 0..here.row_count() {
                for cell in 0..here.cells(here.segments() - 1).end {
                    let pairs = [&here, &there].map(|all| all.entry(parity, row, cell));
                    for (a, b) in pairs[0].into_iter().zip(pairs[1]) {
                        assert!(
                            (a - b).abs() < 1e-12,
                            "{cells} {folded} {row} {cell}: {a} {b}"
                        );
                    }
                }
            }
        }
    }
}
