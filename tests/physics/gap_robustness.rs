//! Whatever the gap: a contact that satisfies the contact conditions, or a reason.

use railhead::contact::error::SolveError;
use railhead::contact::influence::coefficients::{Rectangle, rectangle};
use railhead::contact::monitor::Unwatched;
use railhead::contact::normal::non_hertzian::gap::Gap;
use railhead::contact::problem::Limits;
use railhead::contact::solution::{Fields, Solution};
use railhead::contact::{self, check};
use serde_json::{Value, json};

use crate::gap_samples::{Across, grid, profile, spread, steel};
use crate::reference::assert_none;
use crate::robustness::Random;

const G: f64 = 82_000.0;
const NU: f64 = 0.28;
/// Roughness of a measured profile in mm.
const ROUGHNESS: f64 = 0.005;

/// A gap with what the test needs to know about it.
struct Sample {
    name: String,
    contact: Value,
    force: f64,
    rough: bool,
}

/// Arcs of random radii that join smoothly, the contact somewhere on them.
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
                // Turned in the plane, so that neither axis is special.
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

/// The gap as the solver sees it: a smooth surface through the samples.
fn surface(contact: &Value) -> Gap {
    let list = |name: &str| -> Vec<f64> {
        serde_json::from_value(contact[name].clone()).expect("numbers")
    };
    if contact["type"] == "gap_profile" {
        let rolling = contact["rolling_mm"].as_f64().expect("a radius");
        return Gap::profile(rolling, &list("y_mm"), &list("gap_mm"));
    }
    let rows: Vec<Vec<f64>> = serde_json::from_value(contact["gap_mm"].clone()).expect("rows");
    Gap::grid(&list("x_mm"), &list("y_mm"), &rows)
}

/// Largest distance of the deformed surfaces over the inner cells of the tangential mesh, relative to the depth to which
/// they were pressed together: an independent look at region, pressure, approach and mesh at once.
fn distance_inside(sample: &Sample, solution: &Solution, fields: &Fields) -> f64 {
    let mut cells = Vec::new();
    for (solution, fields) in solution.patches.iter().zip(&fields.patches) {
        let pressure = fields.pressure_mpa.as_ref().expect("pressures");
        for k in 0..fields.x_mm.len() {
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
                pressure[k],
                pressure[k] > 0.6 * solution.pressure_max_mpa,
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

#[test]
fn random_gaps_end_in_a_sound_contact_or_a_reason() {
    let all = samples(320);
    let mut failures = Vec::new();
    let (mut solved, mut refused, mut distances) = (0, Vec::new(), Vec::new());
    for sample in &all {
        let mut case = steel(
            sample.contact.clone(),
            json!({ "normal_force_n": sample.force }),
            [0.001, 0.0, 0.0],
        );
        case["solver"] = json!({ "mesh": { "strips": 12, "cells": 14 } });
        case["outputs"] = json!(["pressure"]);
        let problem = match check(&case, &Limits::default()) {
            Ok(problem) => problem,
            Err(error) => {
                refused.push(format!("{}: {error}", sample.name));
                continue;
            }
        };
        match contact::solve(&problem, &Unwatched) {
            Ok((solution, fields)) => {
                solved += 1;
                let report = solution.normal.expect("a report on the normal problem");
                let load: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
                let distance = distance_inside(sample, &solution, &fields);
                println!(
                    "{} {distance:.4} {report:?} {} {:?}",
                    sample.name,
                    solution.patches.len(),
                    solution.warnings
                );
                if report.residual > 1e-3 {
                    failures.push(format!("{}: residual {}", sample.name, report.residual));
                }
                if (load / sample.force - 1.0).abs() > 1e-6 {
                    failures.push(format!("{}: carries {load}", sample.name));
                }
                let alone = solution.patches.len() == 1;
                if alone && !sample.rough {
                    distances.push((distance, sample.name.clone()));
                }
            }
            Err(SolveError::NormalProblem { reason }) => {
                refused.push(format!("{}: {reason}", sample.name));
            }
            Err(error) => failures.push(format!("{}: {error}", sample.name)),
        }
    }
    distances.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!(
        "{solved} solved; largest distances {:?} median {:?}",
        &distances[..30],
        distances[distances.len() / 2]
    );
    println!("{}", refused.join("\n"));
    assert_none("unsound", &failures);
}
