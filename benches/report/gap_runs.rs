//! Error against run time for contacts from gaps, with CONTACT's own runs for comparison.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use crate::gaps::{CLASSES, error, question};
use crate::machine::{lu_seconds, median};
use crate::plot::{Plot, Series};
use crate::questions::{number, problem, stored, timed};

const REPEATS: usize = 3;
const TARGETS: [f64; 5] = [0.05, 0.02, 0.005, 0.002, 0.001];
/// Number of CONTACT's runs of every case, from coarse to fine.
const RUNS: usize = 3;

pub fn section(lu: f64, pictures: &Path) -> String {
    let mut text = "### Error against run time\n\nMedians over each class, region and pressure included on both sides; our points are the targets 0.05, 0.02, \
                    0.005, 0.002 and 0.001.\n\n| cases | ours: error (LU) | fastsim | CONTACT |\n|---|---|---|---|\n"
        .to_owned();
    let mut shown = String::new();
    let cases = [stored("gap_grids"), stored("gap_profiles")].concat();
    for (name, _, start) in CLASSES {
        let of_class = |case: &&Value| case["id"].as_str().is_some_and(|id| id.starts_with(start));
        let cases: Vec<&Value> = cases.iter().filter(of_class).collect();
        let ours = TARGETS.map(|target| run(&cases, &json!({ "target_error": target })));
        let fastsim = [run(&cases, &json!({ "method": "fastsim" }))];
        let theirs: Vec<(f64, f64)> = (0..RUNS)
            .filter_map(|k| of_contact(&cases, k, lu))
            .collect();
        let list = |points: &[(f64, f64)]| {
            let points = points
                .iter()
                .map(|(time, error)| format!("{error:.4} ({time:.2})"));
            points.collect::<Vec<_>>().join(", ")
        };
        let _ = writeln!(
            text,
            "| {name} | {} | {} | {} |",
            list(&ours),
            list(&fastsim),
            list(&theirs)
        );
        let series = |name: &str, points: &[(f64, f64)]| Series {
            name: name.to_owned(),
            points: points.to_vec(),
        };
        let plot = Plot {
            title: format!("{name}: error against run time"),
            x: "time, LU".to_owned(),
            y: "error".to_owned(),
            series: vec![
                series("target_error", &ours),
                series("fastsim", &fastsim),
                series("CONTACT", &theirs),
            ],
        };
        let file = format!("gap_{}.svg", start.trim_end_matches('_'));
        std::fs::write(pictures.join(&file), plot.svg()).expect("a picture can be written");
        let _ = writeln!(shown, "![{name}](accuracy-and-speed/{file})\n");
    }
    format!("{text}\n{shown}")
}

/// Returns the median time in LU and the median error.
fn run(cases: &[&Value], solver: &Value) -> (f64, f64) {
    let lu = lu_seconds();
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    for case in cases {
        let mut question = question(case);
        question["solver"] = solver.clone();
        let (solution, seconds) = timed(&problem(&question), REPEATS);
        let solution = solution.expect("an answer");
        let area = solution.patches.iter().map(|p| p.area_mm2).sum();
        times.push(seconds / lu);
        errors.push(error(case, &solution, area).0);
    }
    (median(times), median(errors))
}

/// Returns the median time in LU and the median error of CONTACT's own runs, or `None` unless every case has a run of this fineness.
fn of_contact(cases: &[&Value], run: usize, lu: f64) -> Option<(f64, f64)> {
    let runs: Option<Vec<&Value>> = cases
        .iter()
        .map(|case| case["contact_runs"].get(run))
        .collect();
    let runs = runs?;
    let of = |name: &str| median(runs.iter().map(|run| number(run, name)).collect());
    Some((of("cpu_s") / lu, of("error")))
}
