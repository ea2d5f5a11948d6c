//! Tests of transient rolling: references, closed forms and laws.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::mesh::MeshSize;
use railhead_contact::monitor::{Monitor, Stop, Unmonitored};
use railhead_contact::normal_stage;
use railhead_contact::rolling::history::level_run::LevelRun;
use railhead_contact::rolling::history::plan::{Pace, PointRecord};
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::strip_mesh::StripMesh;
use railhead_contact::solution::words::answer::{HistoryPoint, PointSolution, Solution};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::reference::{SolvedEllipse, assert_none, read, solve};

/// A reference history. Each row has the distance, forces over the friction limit, the moment over the friction limit times √(ab), the creepage
/// along x, and the uncertainties of the last four.
#[derive(Debug, Deserialize)]
struct Reference {
    #[serde(flatten)]
    contact: SolvedEllipse,
    motion: [f64; 3],
    force_x: Option<f64>,
    /// Shift on the finest mesh, without extrapolation.
    shift_mm: Option<f64>,
    rows: Vec<[f64; 9]>,
}

impl Reference {
    fn case(&self) -> Value {
        let mut distances: Vec<f64> = self.rows.iter().map(|row| row[0]).collect();
        let history = match self.force_x {
            Some(force) => {
                distances.insert(0, 0.0);
                json!({ "distance_mm": distances, "force_x_n": force * self.contact.limit() })
            }
            None => {
                let [x, y, spin] = self.motion;
                json!({ "distance_mm": distances, "creepage_x": x, "creepage_y": y, "spin_per_mm": spin })
            }
        };
        self.contact.case(&json!({ "history": history }))
    }

    /// Returns the errors beyond the uncertainty of the reference, and their estimates: of the forces, and of the creepage over its peak.
    fn errors(&self, point: &PointSolution, row: &[f64; 9]) -> ([f64; 2], [f64; 2]) {
        let [x, y, moment] = self.contact.relative(point);
        let found = [x, y, moment, point.motion.creepage_x];
        let off = [0, 1, 2, 3].map(|k| ((found[k] - row[1 + k]).abs() - row[5 + k]).max(0.0));
        let peak = self
            .rows
            .iter()
            .map(|row| row[4].abs())
            .fold(1e-9, f64::max);
        let of_creepage = of_history(point).creepage_x_error;
        let of_forces = point.error_estimate.unwrap().force_x_n / self.contact.limit();
        (
            [off[0].max(off[1]).max(off[2]), off[3] / peak],
            [of_forces, of_creepage.map_or(1e-6, |error| error / peak)],
        )
    }
}

fn of_history(point: &PointSolution) -> HistoryPoint {
    point.history.expect("a point of a history")
}

#[test]
fn histories_agree_with_contact_and_their_estimates_hold() {
    let all: Vec<Reference> = read("transient.json");
    let mut failures = Vec::new();
    for reference in &all {
        let began = std::time::Instant::now();
        let (solution, _) = solve(&reference.case());
        let seconds = began.elapsed().as_secs_f64();
        let all = &solution.patches[0].points;
        let points = &all[all.len() - reference.rows.len()..];
        let (mut worst, mut most, mut covered) = ([0.0_f64; 2], [0.0_f64; 2], 0);
        for (point, row) in points.iter().zip(&reference.rows) {
            let (errors, estimates) = reference.errors(point, row);
            covered += usize::from(
                errors[0] <= estimates[0]
                    && (reference.force_x.is_none() || errors[1] <= estimates[1]),
            );
            worst = [0, 1].map(|k| worst[k].max(errors[k]));
            most = [0, 1].map(|k| most[k].max(estimates[k]));
        }
        // The first point of a history with a prescribed force is a shift.
        let shift = of_history(&all[0]).shift_x_mm.zip(reference.shift_mm);
        let shift = shift.map_or(0.0, |(found, known)| (found / known - 1.0).abs());
        println!(
            "{}: forces off by {:.4} ({:.4} estimated), creepage by {:.3} ({:.3}) of its peak, shift by {shift:.4}; {covered}/{} covered; {:?}, \
             {} steps of Newton, {seconds:.3} s",
            reference.contact.id,
            worst[0],
            most[0],
            worst[1],
            most[1],
            points.len(),
            points[0].solver.mesh,
            all.iter().map(|p| p.solver.iterations).sum::<u32>(),
        );
        let met = points.iter().all(|point| point.target_met == Some(true));
        if worst[0] > 0.015 || worst[1] > 0.05 || shift > 0.005 || !met {
            failures.push(reference.contact.id.clone());
        }
        if 100 * covered < 95 * points.len() {
            failures.push(format!("{}: {covered} covered", reference.contact.id));
        }
    }
    assert_none("too far from CONTACT", &failures);
}

/// Returns a sphere on a plane of the same steel with a friction limit of 18 kN and a contact radius of 5 mm.
pub fn sphere(poisson_ratio: f64, history: Value) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": poisson_ratio },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "ellipse", "a_mm": 5, "b_mm": 5 },
        "load": { "normal_force_n": 60000 },
        "motion": history,
    })
}

const LIMIT: f64 = 18_000.0;

/// Returns Cattaneo's shift in mm for a force over the friction limit (Mindlin 1949).
fn cattaneo(poisson_ratio: f64, force: f64) -> f64 {
    let full = 3.0 * LIMIT / (8.0 * 82_000.0 * 5.0) * (2.0 - poisson_ratio);
    full * (1.0 - (1.0 - force).powf(2.0 / 3.0))
}

#[test]
fn a_shift_is_cattaneos_by_force_and_by_displacement() {
    // The closed form neglects transverse tractions, which vanish for ν = 0 only.
    for (nu, allowed) in [(0.0, 0.002), (0.28, 0.004)] {
        let forces = [0.25, 0.5, 0.75];
        let shifts = forces.map(|force| cattaneo(nu, force));
        let given = forces.map(|force| force * LIMIT);
        let still = [0.0; 3];
        let by_force = json!({ "history": { "distance_mm": still, "force_x_n": given } });
        let steps = [shifts[0], shifts[1] - shifts[0], shifts[2] - shifts[1]];
        let by_shift = json!({ "history": { "distance_mm": still, "shift_x_mm": steps } });
        let on_mesh = |motion: Value| {
            let mut case = sphere(nu, motion);
            case["solver"] = json!({ "mesh": { "strips": 20, "cells": 30 } });
            solve(&case).0
        };
        let (of_force, of_shift) = (on_mesh(by_force), on_mesh(by_shift));
        let mut moved = 0.0;
        for (k, force) in forces.into_iter().enumerate() {
            let [by_force, by_shift] = [&of_force, &of_shift].map(|s| &s.patches[0].points[k]);
            moved += of_history(by_force).shift_x_mm.unwrap();
            assert!(
                (moved / shifts[k] - 1.0).abs() < allowed,
                "{nu} {force}: {moved}"
            );
            assert!(
                (by_shift.force_x_n / LIMIT - force).abs() < 2.0 * allowed,
                "{nu} {force}"
            );
            // The stick zone is a circle of the relative radius ∛(1 − F/μN).
            let stick = by_force.stick_area_mm2.unwrap() / of_force.patches[0].area_mm2;
            assert!(
                (stick - (1.0 - force).powf(2.0 / 3.0)).abs() < 0.06,
                "{nu} {force}: {stick}"
            );
        }
    }
}

#[test]
fn the_error_of_a_shift_covers_that_to_cattaneo() {
    let mut failures = Vec::new();
    for part in 1..=17 {
        let part = 0.05 * f64::from(part);
        let motion =
            json!({ "history": { "distance_mm": 0, "force_x_n": part * LIMIT }, "start": "rest" });
        let (solution, _) = solve(&sphere(0.0, motion));
        let found = of_history(&solution.patches[0].points[0]);
        let shift = found.shift_x_mm.unwrap();
        let off = (shift - cattaneo(0.0, part)).abs();
        println!(
            "{part:.2}: {:.5} {:.5}",
            off / shift,
            found.shift_x_error_mm.unwrap() / shift
        );
        if off > found.shift_x_error_mm.unwrap() {
            failures.push(format!("{part}: {off} of {shift}"));
        }
    }
    assert_none("shifts without cover", &failures);
}

/// Returns the points of a history on one mesh, with the energies that answers do not include.
fn on_level(case: &Value, size: MeshSize, longest: f64) -> Vec<PointRecord> {
    let case = contact::check(case, &Limits::default()).unwrap();
    let pressed = normal_stage::solve(&case, &Unmonitored).unwrap();
    let task = case.rolling_task(&pressed.footprint);
    let level = StripMesh::new(&task, size).unwrap();
    let history = case.problem.history.as_ref().unwrap();
    let mut workspace = NewtonWorkspace::default();
    let run = LevelRun::new(
        &task,
        history,
        &level,
        [1e-7; 2],
        &mut workspace,
        &Unmonitored,
    );
    let pace = Pace {
        first: longest,
        finer: 1.0,
    };
    run.unwrap().run(pace).unwrap()
}

const SIZE: MeshSize = MeshSize {
    strips: 8,
    cells: 16,
};

#[test]
fn what_motion_gives_is_dissipated_or_stored() {
    let distances: Vec<f64> = (1..=120).map(|k| 0.125 * f64::from(k)).collect();
    let history = json!({ "history": { "distance_mm": distances, "creepage_x": 0.001, "spin_per_mm": 0.0002, "creepage_y": -0.0004 } });
    let points = on_level(&sphere(0.28, history), SIZE, 0.125);
    let (mut given, mut before) = (0.0, 0.0);
    for (point, from) in points
        .iter()
        .zip(std::iter::once(0.0).chain(distances.iter().copied()))
    {
        let (forces, motion) = (point.resultants[0], point.motion);
        let power = motion.creepage_x * forces.force_x
            + motion.creepage_y * forces.force_y
            + motion.spin_per_mm * forces.moment_z;
        let step = distances[0].min(15.0 - from);
        given += 0.5 * step * (before + power);
        before = power;
    }
    let last = points.last().unwrap();
    let kept = last.dissipated[0] + last.elastic;
    println!(
        "given {given:.3}, dissipated {:.3}, stored {:.3} N mm",
        last.dissipated[0], last.elastic
    );
    assert!(last.elastic > 0.05 * given, "{}", last.elastic);
    assert!((kept / given - 1.0).abs() < 0.04, "{kept} of {given}");
}

#[test]
fn friction_never_gives_energy_whatever_the_motion_does() {
    let distances = [0.0, 1.0, 2.0, 2.0, 3.0, 3.0, 5.0, 6.0, 6.5, 6.5, 9.0];
    let creepage = [
        0.001, -0.002, 0.0, 0.003, -0.001, 0.0, 0.0005, -0.0005, 0.0, 0.0, 0.0,
    ];
    let mut case = sphere(
        0.28,
        json!({ "history": {
            "distance_mm": distances,
            "creepage_x": creepage,
            "force_y_n": [0, 4000, -8000, -8000, 9000, -3000, -3000, 0, 0, 12000, 0],
            "shift_x_mm": [0.004, 0, 0, -0.01, 0, 0.006, 0, 0, 0, -0.002, 0],
        } }),
    );
    case["friction"]["layer"] = json!({ "shear_modulus_mpa": 1500, "thickness_mm": 0.01 });
    let points = on_level(&case, SIZE, 0.5);
    let mut before = 0.0;
    for (k, point) in points.iter().enumerate() {
        assert!(point.power[0] >= -1e-9, "{k}: {point:?}");
        assert!(point.dissipated[0] >= before - 1e-9, "{k}");
        assert!(point.elastic >= -1e-9, "{k}");
        before = point.dissipated[0];
        let force = point.resultants[0]
            .force_x
            .hypot(point.resultants[0].force_y);
        assert!(force <= 1.0001 * LIMIT, "{k}: {force}");
    }
    let wanted = case["motion"]["history"]["force_y_n"].as_array().unwrap();
    for (point, wanted) in points.iter().zip(wanted) {
        let off = point.resultants[0].force_y - wanted.as_f64().unwrap();
        assert!(off.abs() < 1e-4 * LIMIT, "{off}");
    }
}

fn forces(solution: &Solution) -> Vec<[f64; 3]> {
    let points = solution.patches[0].points.iter();
    let forces = points.map(|p| [p.force_x_n, p.force_y_n, p.moment_z_n_mm / 5.0]);
    forces.map(|all| all.map(|force| force / LIMIT)).collect()
}

#[test]
fn a_long_way_ends_in_steady_rolling_and_steady_rolling_stays() {
    let motion = json!({ "creepage_x": 0.0008, "creepage_y": -0.0005, "spin_per_mm": 0.0002 });
    let with_distances = |distances: Value, start: &str| {
        let mut history = motion.clone();
        history["distance_mm"] = distances;
        sphere(0.28, json!({ "history": history, "start": start }))
    };
    let (steady, _) = solve(&sphere(0.28, motion.clone()));
    let steady = forces(&steady)[0];
    let (late, _) = solve(&with_distances(json!([5, 10, 20, 40]), "rest"));
    let (begun, _) = solve(&with_distances(json!([0, 0.5, 3, 9]), "steady"));
    let begun = forces(&begun);
    for k in 0..3 {
        let end = forces(&late)[3][k];
        // Both forces are within their target of 0.005.
        assert!((end - steady[k]).abs() < 0.01, "{k}: {end} {}", steady[k]);
        assert!(
            begun.iter().all(|at| (at[k] - begun[0][k]).abs() < 1e-3),
            "{k}: {begun:?}"
        );
        assert!((begun[0][k] - steady[k]).abs() < 0.01, "{k}: {begun:?}");
    }
    // Prescribing the forces of steady rolling gives its creepages.
    let history = json!({ "history": { "distance_mm": [0, 30], "force_x_n": steady[0] * LIMIT, "force_y_n": steady[1] * LIMIT, "spin_per_mm": 0.0002 }, "start": "steady" });
    let (forced, _) = solve(&sphere(0.28, history));
    for point in &forced.patches[0].points {
        assert!(
            (point.motion.creepage_x / 0.0008 - 1.0).abs() < 0.02,
            "{:?}",
            point.motion
        );
        assert!(
            (point.motion.creepage_y / -0.0005 - 1.0).abs() < 0.02,
            "{:?}",
            point.motion
        );
    }
}

/// Tests small creepages, for which a step changes so little that tractions far from steady rolling nearly solve it.
#[test]
fn small_creepages_that_no_longer_change_end_in_steady_rolling() {
    let a = 7.43;
    let contact = json!({ "type": "ellipse", "a_mm": a, "b_mm": 3.37 });
    let last = -2.35e-5;
    let history = json!({ "history": { "distance_mm": [2.2, 9.6, 11.0, 13.8, 13.8 + 10.0 * a],
        "creepage_x": [4.9e-5, -3.5e-5, 1.25e-4, last, last] }, "start": "steady" });
    let [rolled, steady] = [history, json!({ "creepage_x": last })].map(|motion| {
        let mut case = sphere(0.28, motion);
        case["contact"] = contact.clone();
        case["load"] = json!({ "normal_force_n": 87_600 });
        case["solver"] = json!({ "target_error": 0.02 });
        let (solution, _) = solve(&case);
        solution.patches[0].points.last().unwrap().clone()
    });
    let estimate = |point: &PointSolution| point.error_estimate.unwrap().force_x_n;
    let off = (rolled.force_x_n - steady.force_x_n).abs();
    assert!(
        off < estimate(&rolled) + estimate(&steady),
        "{} {}",
        rolled.force_x_n,
        steady.force_x_n
    );
    assert!(off < 0.1 * steady.force_x_n.abs());
}

/// Records the progress that a solve reports.
#[derive(Default)]
struct Listener(RefCell<Vec<f64>>);

impl Monitor for Listener {
    fn tick(&self, progress: f64) -> ControlFlow<Stop> {
        self.0.borrow_mut().push(progress);
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}

/// Returns the largest distance between the forces of every `pieces`-th point of the second case and those of the points of the first, over the sum of both
/// estimates.
fn apart_over_estimates(case: &Value, divided: &Value, pieces: usize) -> f64 {
    let [points, divided] = [case, divided].map(|case| solve(case).0.patches[0].points.clone());
    let over = |(a, b): (&PointSolution, &PointSolution)| {
        let [one, other] = [a, b].map(|p| p.error_estimate.unwrap().force_x_n);
        let apart = [a.force_x_n - b.force_x_n, a.force_y_n - b.force_y_n];
        println!("{apart:.1?} N, estimates {one:.1} and {other:.1} N");
        apart[0].abs().max(apart[1].abs()) / (one + other)
    };
    let pairs = points.iter().zip(divided.iter().step_by(pieces));
    pairs.map(over).fold(0.0, f64::max)
}

/// Tests motions that change within less than a step. Points on the straight lines between those of a history do not change the motion.
#[test]
fn points_between_those_of_a_history_change_forces_within_the_estimates() {
    const PIECES: usize = 8;
    let waves: Vec<f64> = (0..24)
        .map(|k| 0.002 * (0.9 * f64::from(k)).sin())
        .collect();
    let places: Vec<f64> = (0..24).map(|k| 0.9 * f64::from(k)).collect();
    for (places, along, across) in [
        (
            vec![0.0, 10.0, 10.5, 20.0],
            vec![0.002, 0.002, -0.002, -0.002],
            vec![0.0, 0.0, 0.002, 0.002],
        ),
        (vec![0.0, 0.4, 5.0], vec![0.0, 0.004, 0.004], vec![0.0; 3]),
        (places, waves, vec![0.0; 24]),
    ] {
        let case = |pieces: usize| {
            let divided = |values: &[f64]| -> Vec<f64> {
                let piece = |ends: &[f64]| {
                    let [from, to] = [ends[0], ends[1]];
                    (0..pieces).map(move |k| from + (to - from) * k as f64 / pieces as f64)
                };
                let last = values.last().copied();
                values.windows(2).flat_map(piece).chain(last).collect()
            };
            sphere(
                0.28,
                json!({ "history": {
                    "distance_mm": divided(&places),
                    "creepage_x": divided(&along),
                    "creepage_y": divided(&across),
                } }),
            )
        };
        let apart = apart_over_estimates(&case(1), &case(PIECES), PIECES);
        assert!(apart < 1.0, "{places:?}: {apart} of the estimates");
    }
}

/// A creepage that grows and vanishes again leaves neither force nor stored energy: its work is dissipated.
#[test]
fn the_energy_dissipated_at_rest_is_the_work_of_the_motion() {
    let creepage = |q: f64| 0.003 * (0.5 * q).min(0.5 * (18.0 - q)).clamp(0.0, 1.0);
    let solved = |places: &[f64]| {
        let along: Vec<f64> = places.iter().map(|q| creepage(*q)).collect();
        let motion = json!({ "history": { "distance_mm": places, "creepage_x": along } });
        let (solution, _) = solve(&sphere(0.28, motion));
        let points = solution.patches[0].points.iter();
        let of = |point: &PointSolution| {
            let history = point.history.as_ref().expect("a history");
            [point.force_x_n, history.dissipated_n_mm]
        };
        points.map(of).collect::<Vec<_>>()
    };
    let fine: Vec<f64> = (0..=40).map(|k| 0.5 * f64::from(k)).collect();
    let work: f64 = (fine.windows(2).zip(solved(&fine).windows(2)))
        .map(|(q, points)| {
            let power = |k: usize| creepage(q[k]) * points[k][0].abs();
            0.5 * (q[1] - q[0]) * (power(0) + power(1))
        })
        .sum();
    for places in [
        vec![0.0, 2.0, 16.0, 18.0, 90.0],
        [&fine[..], &[90.0]].concat(),
    ] {
        let points = solved(&places);
        let [_, dissipated] = points[points.len() - 1];
        assert!(
            (dissipated / work - 1.0).abs() < 0.01,
            "{dissipated} {work}"
        );
    }
}

#[test]
fn progress_of_a_history_grows_while_it_is_solved() {
    let history = json!({ "history": { "distance_mm": [0, 5, 10, 20], "creepage_x": 0.001 } });
    let case = contact::check(&sphere(0.28, history), &Limits::default()).unwrap();
    let listener = Listener::default();
    contact::solve(&case, &listener).unwrap();
    let heard = listener.0.into_inner();
    assert!(heard.is_sorted(), "progress never falls");
    let between = heard.iter().filter(|p| (0.2..0.8).contains(*p)).count();
    assert!(
        between > 20 && heard.iter().all(|p| *p <= 1.0),
        "{between} of {}",
        heard.len()
    );
}

#[test]
fn the_reverse_of_a_history_has_the_reverse_forces() {
    let history = |sign: f64| {
        let list = |values: [f64; 5]| values.map(|value| sign * value);
        sphere(
            0.28,
            json!({ "history": {
                "distance_mm": [0, 0, 1.5, 3, 3],
                "shift_x_mm": list([0.0, 0.006, 0.0, 0.0, -0.004]),
                "creepage_y": list([0.0, 0.0, 0.001, 0.0, 0.0]),
                "spin_per_mm": list([0.0, 0.0, 0.0003, 0.0001, 0.0]),
            } }),
        )
    };
    let there = forces(&solve(&history(1.0)).0);
    let back = forces(&solve(&history(-1.0)).0);
    assert_eq!(there[0], [0.0; 3]);
    for (there, back) in there.iter().zip(&back) {
        for k in 0..3 {
            assert!((there[k] + back[k]).abs() < 1e-6, "{there:?} {back:?}");
        }
    }
}

#[test]
fn other_contacts_and_laws_follow_a_history_too() {
    let history = json!({ "history": { "distance_mm": { "from": 2, "to": 20, "points": 4 }, "creepage_x": 0.001 } });
    let mut case = sphere(0.28, history);
    case["solver"] = json!({ "mesh": { "strips": 10, "cells": 20 } });
    let of_ellipse = forces(&solve(&case).0);
    // A lateral friction table with one value everywhere.
    let mut across = case.clone();
    across["friction"] = json!({ "across": { "y_mm": [-5, 5], "coefficient": [0.3, 0.3] } });
    let of_law = forces(&solve(&across).0);
    // A gap whose patch is the ellipse.
    let mut gap = case.clone();
    let radius = 0.5 / 0.001_580_487_8;
    let y: Vec<f64> = (-20..=20).map(|k| 0.4 * f64::from(k)).collect();
    let h: Vec<f64> = y.iter().map(|y| y * y / (2.0 * radius)).collect();
    gap["contact"] = json!({ "type": "gap_profile", "rolling_mm": radius, "y_mm": y, "gap_mm": h });
    let of_gap = forces(&solve(&gap).0);
    for k in 0..4 {
        assert!(
            (of_law[k][0] - of_ellipse[k][0]).abs() < 1e-4,
            "{of_law:?} {of_ellipse:?}"
        );
        assert!(
            (of_gap[k][0] - of_ellipse[k][0]).abs() < 0.005,
            "{of_gap:?} {of_ellipse:?}"
        );
    }
}
