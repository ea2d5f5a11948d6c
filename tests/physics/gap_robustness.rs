//! Tests that every gap gives a contact that satisfies the contact conditions, or a reason.

#![allow(
    clippy::needless_range_loop,
    clippy::large_enum_variant,
    reason = "cells are addressed by number in several lists; outcomes are few"
)]

use std::ops::ControlFlow;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::error::SolveError;
use railhead_contact::half_space::kernels::{Rectangle, rectangle};
use railhead_contact::monitor::{Monitor, Stop, Unmonitored};
use railhead_contact::normal::gap::surface::GapSurface;
use railhead_contact::remark::kind::Figure;
use railhead_contact::solution::words::answer::{Fields, Solution};
use serde_json::{Value, json};

use crate::gap_samples::{Across, grid, profile, spread, steel};
use crate::random::Random;
use crate::reference::assert_none;

const G: f64 = 82_000.0;
const NU: f64 = 0.28;
/// Roughness of a measured profile in mm.
const ROUGHNESS: f64 = 0.005;

/// A gap with the data that the test needs.
struct Sample {
    name: String,
    contact: Value,
    force: f64,
    rough: bool,
}

/// Returns arcs of random radii that join smoothly, with the contact somewhere on them.
fn arcs(random: &mut Random) -> Across {
    let count = 2 + (random.part() * 4.0) as usize;
    let mut from = -random.between(5.0, 20.0);
    let pieces = (0..count).map(|_| {
        let to = from + random.between(2.0, 15.0);
        let piece = [from, to, random.decades(8.0, 800.0)];
        from = to;
        piece
    });
    Across::Arcs(pieces.collect())
}

fn bumps(random: &mut Random) -> Across {
    let half = random.between(2.0, 12.0);
    let offset = if random.part() < 0.3 {
        0.0
    } else {
        random.decades(1e-3, 0.1)
    };
    Across::Parabolas(vec![
        [-half, random.decades(40.0, 800.0), 0.0],
        [half, random.decades(40.0, 800.0), offset],
    ])
}

fn powers(random: &mut Random) -> Across {
    let square = if random.part() < 0.3 {
        0.0
    } else {
        random.decades(1e-4, 1e-2)
    };
    Across::Powers([square, random.decades(1e-6, 1e-3)])
}

fn samples(count: usize) -> Vec<Sample> {
    let mut random = Random(20_261_121);
    (0..count)
        .map(|k| {
            let (kind, across) = match k % 4 {
                0 => ("arcs", arcs(&mut random)),
                1 => ("powers", powers(&mut random)),
                2 => ("bumps", bumps(&mut random)),
                _ => ("rough arcs", arcs(&mut random)),
            };
            let rough = k % 4 == 3;
            let rolling = random.decades(50.0, 5000.0);
            let force = 30_000.0 * random.decades(1e-3, 1e3);
            let y = spread(-30.0, 30.0, 121 + 60 * (k % 3));
            let mut noise = |size: f64| {
                if rough {
                    size * random.between(-1.0, 1.0)
                } else {
                    0.0
                }
            };
            let contact = if k % 8 < 5 {
                profile(rolling, &y, |y| across.at(y) + noise(ROUGHNESS))
            } else {
                // The gap is rotated in the plane, so that neither axis is special.
                let angle = 0.05 * (k % 17) as f64;
                let (sin, cos) = angle.sin_cos();
                grid(&spread(-25.0, 25.0, 61), &y[..], |x, y| {
                    let (along, over) = (cos * x + sin * y, cos * y - sin * x);
                    0.5 * along * along / rolling + across.at(over) + noise(ROUGHNESS)
                })
            };
            Sample {
                name: format!("{k}: {kind}, {}, {force:.3e} N", contact["type"]),
                contact,
                force,
                rough,
            }
        })
        .collect()
}

/// Returns the smooth surface through the samples, as the solver sees it.
fn surface(contact: &Value) -> GapSurface {
    let list = |name: &str| -> Vec<f64> {
        serde_json::from_value(contact[name].clone()).expect("numbers")
    };
    if contact["type"] == "gap_profile" {
        let rolling = contact["rolling_mm"].as_f64().expect("a radius");
        return GapSurface::profile(rolling, &list("y_mm"), &list("gap_mm"));
    }
    let rows: Vec<Vec<f64>> = serde_json::from_value(contact["gap_mm"].clone()).expect("rows");
    GapSurface::grid(&list("x_mm"), &list("y_mm"), &rows)
}

/// Returns the largest distance of the deformed surfaces over the inner cells of the tangential mesh, relative to the interpenetration. This is an
/// independent check of region, pressure, approach and mesh.
fn distance_inside(sample: &Sample, solution: &Solution, fields: &Fields) -> f64 {
    let mut cells = Vec::new();
    for (solution, fields) in solution.patches.iter().zip(&fields.patches) {
        let fields = fields.cells(0);
        let pressure = fields.pressure_mpa.as_ref().expect("pressures");
        for (k, pressure) in pressure.iter().enumerate() {
            let [x, y] = [fields.x_mm[k], fields.y_mm[k]];
            let [dx, dy] = [fields.dx_mm[k], fields.dy_mm[k]];
            let cell = Rectangle {
                x0: x - 0.5 * dx,
                x1: x + 0.5 * dx,
                y0: y - 0.5 * dy,
                y1: y + 0.5 * dy,
            };
            cells.push((
                x,
                y,
                cell,
                *pressure,
                *pressure > 0.6 * solution.pressure_max_mpa,
            ));
        }
    }
    let approach = solution.patches[0].approach_mm.expect("an approach");
    let gap = surface(&sample.contact);
    let mut largest = 0.0_f64;
    let mut least = f64::INFINITY;
    for (x, y, .., inner) in &cells {
        let undeformed = gap.on(&[*x], &[*y])[0];
        least = least.min(undeformed);
        if *inner {
            let u: f64 = cells
                .iter()
                .map(|(_, _, cell, p, _)| rectangle(*x, *y, *cell, NU).zz * p / G)
                .sum();
            largest = largest.max((u + undeformed - approach).abs());
        }
    }
    largest / (approach - least)
}

/// The outcome of a random gap.
enum Outcome {
    /// A contact, with the result of [`distance_inside`].
    Solved(Box<Solution>, f64),
    Refused(String),
}

fn solve(sample: &Sample) -> Result<Outcome, String> {
    let load = json!({ "normal_force_n": sample.force });
    let mut case = steel(sample.contact.clone(), load, [0.001, 0.0, 0.0]);
    case["solver"] = json!({ "mesh": { "strips": 12, "cells": 14 } });
    case["outputs"] = json!(["pressure"]);
    let checked = match check(&case, &Limits::default()) {
        Ok(checked) => checked,
        Err(error) => return Ok(Outcome::Refused(error.to_string())),
    };
    match contact::solve(&checked, &Unmonitored) {
        Ok((solution, fields)) => {
            let distance = distance_inside(sample, &solution, &fields);
            Ok(Outcome::Solved(Box::new(solution), distance))
        }
        Err(SolveError::NormalProblem { reason }) => Ok(Outcome::Refused(reason)),
        Err(error) => Err(format!("{}: {error}", sample.name)),
    }
}

#[test]
fn random_gaps_end_in_a_sound_contact_or_a_reason() {
    let mut failures = Vec::new();
    let mut distances = Vec::new();
    let mut refused = 0;
    for sample in samples(120) {
        match solve(&sample) {
            Err(failure) => failures.push(failure),
            Ok(Outcome::Refused(reason)) => {
                refused += 1;
                // Loads up to 30 MN extend some contacts beyond the data. No other refusal is allowed.
                if !reason.contains("cut off") {
                    failures.push(format!("{}: {reason}", sample.name));
                }
            }
            Ok(Outcome::Solved(solution, distance)) => {
                let report = solution.normal.expect("a report on the normal problem");
                let load: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
                if report.residual > 1e-3 {
                    failures.push(format!("{}: residual {}", sample.name, report.residual));
                }
                if (load / sample.force - 1.0).abs() > 1e-6 {
                    failures.push(format!("{}: carries {load}", sample.name));
                }
                if solution.patches.len() == 1 && !sample.rough {
                    distances.push((distance, sample.name));
                }
            }
        }
    }
    assert_none("unsound", &failures);
    assert!(refused <= 16, "{refused} refused");
    // The tangential mesh of 12 strips causes most of these distances.
    distances.sort_by(|a, b| a.0.total_cmp(&b.0));
    let at = |share: f64| &distances[((distances.len() - 1) as f64 * share) as usize];
    for (share, allowed) in [(0.5, 0.008), (0.95, 0.02), (1.0, 0.06)] {
        assert!(
            at(share).0 < allowed,
            "{share} of the gaps: {:?}",
            at(share)
        );
    }
}

#[test]
fn a_solve_of_a_rough_gap_can_be_stopped() {
    let sample = samples(4).pop().expect("a rough gap");
    let load = json!({ "normal_force_n": sample.force });
    let mut case = steel(sample.contact, load, [0.001, 0.0, 0.0]);
    case["solver"] = json!({ "time_limit_s": 1.0 });
    let problem = check(&case, &Limits::default()).expect("a valid case");
    let late = Late(std::cell::Cell::new(0));
    let error = contact::solve(&problem, &late).expect_err("no time");
    let (limit_s, motions) = (Some(1.0), Some([0, 1]));
    assert_eq!(error, SolveError::OutOfTime { limit_s, motions });
    assert!(error.to_string().contains("time_limit_s 1"), "{error}");
    assert!(late.0.get() < 20, "{} looks at the clock", late.0.get());
}

/// A clock that passes the limit of a second after ten readings.
struct Late(std::cell::Cell<u32>);

impl Monitor for Late {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.0.set(self.0.get() + 1);
        Duration::from_millis(if self.0.get() > 10 { 1500 } else { 0 })
    }
}

/// Returns the case of a lateral gap under a load in N, with resultants only.
fn across_gap(y: &[f64], gap: &[f64], force: f64) -> Value {
    json!({
        "contact": { "type": "gap_profile", "rolling_mm": 460.0, "y_mm": y, "gap_mm": gap },
        "material": { "shear_modulus_mpa": G, "poisson_ratio": NU },
        "friction": { "coefficient": 0.3 },
        "load": { "normal_force_n": force },
        "motion": { "creepage_x": 0.001 },
        "outputs": ["resultants"],
        "solver": { "target_error": 0.02 },
    })
}

/// Returns places from −12 to 12 mm.
fn places(count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| -12.0 + 24.0 * i as f64 / (count - 1) as f64)
        .collect()
}

fn answer(case: &Value) -> Solution {
    let checked = check(case, &Limits::default()).expect("a case");
    contact::solve(&checked, &Unmonitored).expect("an answer").0
}

#[test]
fn patches_that_end_with_few_cells_say_so_with_their_numbers() {
    // Eleven crests share the load.
    let y = places(81);
    let teeth = |y: &f64| 0.038_6 * (std::f64::consts::PI * y / 0.6).sin().abs();
    let gap: Vec<f64> = y.iter().map(|y| y * y / 2_000.0 + teeth(y)).collect();
    let found = answer(&across_gap(&y, &gap, 5_000.0));
    let coarse: Vec<_> = found
        .remarks
        .iter()
        .filter(|remark| remark.code == "patch-coarse")
        .collect();
    assert!(coarse.len() > 1, "{:?}", found.remarks);
    for remark in coarse {
        let figure = |name: &str| match remark.figures[name] {
            Figure::Number(number) => number,
            ref other => panic!("{name}: {other:?}"),
        };
        let (cells, share) = (figure("cells_across"), figure("load_share"));
        assert!(cells < 20.0 && share > 0.0 && share < 1.0, "{remark:?}");
        assert!(
            remark
                .patch
                .is_some_and(|patch| patch < found.patches.len())
        );
    }
}

#[test]
fn a_contact_whose_pressure_still_changes_is_called_rough() {
    let mut random = Random(3);
    let y = places(81);
    let gap: Vec<f64> = y
        .iter()
        .map(|y| y * y / 600.0 + 0.005_4 * random.part())
        .collect();
    let found = answer(&across_gap(&y, &gap, 17_000.0));
    let codes: Vec<&str> = found.remarks.iter().map(|r| r.code.as_str()).collect();
    assert!(codes.contains(&"gap-rough"), "{codes:?}");
    // A smooth surface has no remarks.
    let smooth: Vec<f64> = y.iter().map(|y| y * y / 600.0).collect();
    let found = answer(&across_gap(&y, &smooth, 17_000.0));
    assert!(found.remarks.is_empty(), "{:?}", found.remarks);
}
