//! Error against run time: explicit meshes, targets and methods, with CONTACT's grids for comparison.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::machine::{median, quantile};
use crate::plot::{Plot, Series};
use crate::questions::{CLASSES, hertz, hertz_error, number, timed};

const REPEATS: usize = 5;
/// CONTACT's grids, as numbers of elements along a side of the window.
const GRIDS: [u64; 3] = [15, 30, 60];

/// Errors and seconds of the solved cases.
#[derive(Default)]
struct Run {
    classes: Vec<String>,
    errors: Vec<f64>,
    seconds: Vec<f64>,
}

impl Run {
    fn of(cases: &[Value], solver: &Value) -> Run {
        let mut run = Run::default();
        for case in cases {
            let checked = hertz(case, solver, &json!(["resultants"]));
            let (solution, seconds) = timed(&checked, REPEATS);
            if let Some(solution) = solution {
                run.add(case, hertz_error(&solution.total[0], case).0, seconds);
            }
        }
        run
    }

    /// Returns CONTACT's own runs on one grid.
    fn of_contact(cases: &[Value], grid: u64) -> Run {
        let mut run = Run::default();
        for case in cases {
            let grids = case["grids"].as_array().expect("grids");
            for entry in grids.iter().filter(|g| g["n"].as_u64() == Some(grid)) {
                let error = ["force_x", "force_y", "moment_z"]
                    .iter()
                    .map(|name| number(entry, name).abs())
                    .fold(0.0, f64::max);
                run.add(case, error, number(entry, "cpu_s"));
            }
        }
        run
    }

    fn add(&mut self, case: &Value, error: f64, seconds: f64) {
        let class = case["class"].as_str().unwrap_or_default();
        self.classes.push(class.to_owned());
        self.errors.push(error);
        self.seconds.push(seconds);
    }

    /// Returns the median time in LU and the median error over one class.
    fn point(&self, class: &str, lu: f64) -> Option<(f64, f64)> {
        let pick = |values: &[f64]| -> Vec<f64> {
            let pairs = self.classes.iter().zip(values);
            pairs
                .filter(|(c, _)| *c == class)
                .map(|(_, v)| *v)
                .collect()
        };
        let errors = pick(&self.errors);
        (!errors.is_empty()).then(|| (median(pick(&self.seconds)) / lu, median(errors).max(1e-5)))
    }
}

pub fn section(cases: &[Value], lu: f64, pictures: &Path) -> String {
    let mut text = "## Error against run time\n\n".to_owned();
    let mut series: Vec<(&str, Vec<Run>)> = Vec::new();
    let mut table = "| method | cells × strips | solved | error: median | 90 % | largest | LU: median | 90 % | largest |\n\
                     |---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for (method, meshes) in [
        (
            "boundary_element",
            &[
                (8, 8),
                (12, 12),
                (16, 16),
                (24, 12),
                (24, 24),
                (32, 32),
                (48, 24),
            ][..],
        ),
        ("liu_hsu", &[(8, 8), (12, 12), (16, 16)][..]),
        ("fastsim", &[(8, 8), (16, 10), (32, 20)][..]),
    ] {
        let mut runs = Vec::new();
        for (cells, strips) in meshes {
            let solver = json!({ "method": method, "mesh": { "strips": strips, "cells": cells } });
            let run = Run::of(cases, &solver);
            row(
                &mut table,
                method,
                &format!("{cells} × {strips}"),
                &run,
                cases.len(),
                lu,
            );
            runs.push(run);
        }
        series.push((method, runs));
    }
    let targets = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001];
    let runs = targets.map(|target| Run::of(cases, &json!({ "target_error": target })));
    series.push(("target_error", Vec::from(runs)));
    let mut contact = Vec::new();
    for grid in GRIDS {
        let run = Run::of_contact(cases, grid);
        row(
            &mut table,
            "CONTACT",
            &format!("{grid} × {grid} window"),
            &run,
            cases.len(),
            lu,
        );
        contact.push(run);
    }
    series.push(("CONTACT", contact));
    for class in CLASSES {
        let file = format!("{class}.svg");
        let plot = plot(class, &series, lu);
        std::fs::write(pictures.join(&file), plot.svg()).expect("a picture can be written");
        let _ = writeln!(text, "![{class}](accuracy-and-speed/{file})\n");
    }
    text.push_str(&table);
    text.push_str(
        "\nExplicit meshes are solved in double precision to a residual of 1e-6; targets in single precision as exactly as they \
         need. CONTACT's CPU seconds were taken on another machine of this kind, shared and up to twice too slow \
         (`tests/data/README.md`), and include its normal problem; here region and pressure of an ellipse are closed forms.\n\n",
    );
    text
}

/// Returns a plot of the errors of a class of cases against their times, with a series for each method.
fn plot(class: &str, series: &[(&str, Vec<Run>)], lu: f64) -> Plot {
    Plot {
        title: format!("{class}: median error against median time"),
        x: "time of a solve, LU".to_owned(),
        y: "error".to_owned(),
        series: series
            .iter()
            .map(|(name, runs)| Series {
                name: (*name).to_owned(),
                points: runs.iter().filter_map(|run| run.point(class, lu)).collect(),
            })
            .collect(),
    }
}

fn row(table: &mut String, method: &str, mesh: &str, run: &Run, cases: usize, lu: f64) {
    if run.errors.is_empty() {
        let _ = writeln!(table, "| {method} | {mesh} | 0/{cases} | | | | | | |");
        return;
    }
    let _ = writeln!(
        table,
        "| {method} | {mesh} | {}/{cases} | {:.4} | {:.4} | {:.4} | {:.3} | {:.3} | {:.3} |",
        run.errors.len(),
        median(run.errors.clone()),
        quantile(run.errors.clone(), 0.9),
        quantile(run.errors.clone(), 1.0),
        median(run.seconds.clone()) / lu,
        quantile(run.seconds.clone(), 0.9) / lu,
        quantile(run.seconds.clone(), 1.0) / lu,
    );
}
