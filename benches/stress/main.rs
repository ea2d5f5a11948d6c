//! Stability test: thousands of cases over the whole allowed range, with every answer checked against the laws of contact.
//!
//! `cargo bench --bench stress [-- cases seed]` prints the table and writes it to `docs/stability.md`. It ends with an error if a case crashes,
//! hangs or breaks a law. `-- --only` with `times`, `after`, `physics`, `maintenance`, `histories`, `rows`, `routes`, `creep-map`,
//! `sweep-with-zones` or `damaged-profile` prints one section. `-- --case 1511` prints one case as JSON. A seed after the number selects another
//! run.

mod after;
mod class;
mod condition;
mod contacts;
mod damaged;
mod damaged_table;
mod damaged_trials;
#[path = "../examples.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod examples;
#[path = "../../tests/routes/features.rs"]
mod features;
mod histories;
mod laws;
#[path = "../machine.rs"]
mod machine;
mod maintenance;
#[path = "../../tests/routes/matrix.rs"]
mod matrix;
mod physics;
#[path = "../../tests/physics/profile_reference_files.rs"]
mod profile_reference_files;
#[path = "../../tests/physics/profile_shapes.rs"]
mod profile_shapes;
#[path = "../random.rs"]
mod random;
mod rows;
#[path = "../../src/jobs/runtime_probe.rs"]
#[allow(dead_code, reason = "its tests run with the service")]
mod runtime_probe;
mod sweeps;
mod times;
mod trial;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::process::ExitCode;

use contacts::{Sample, samples};
use machine::quantile;
use serde_json::Value;
use times::{CaseTimes, told};
use trial::{End, Trial, trial};

const CASES: usize = 5000;
const SEED: u64 = 20_261_121;
/// Maximum number of cases named in the report.
const NAMED_MAX: usize = 40;

/// Results of the cases of one kind.
#[derive(Default)]
struct Row {
    cases: usize,
    solved: usize,
    refused: usize,
    not_converged: usize,
    iterations: Vec<f64>,
    residual: f64,
    energy: Vec<f64>,
    from_liu_hsu: Vec<f64>,
    /// True errors with their estimates.
    errors: Vec<(f64, f64)>,
    times: times::Times,
}

/// Messages of failures.
#[derive(Default)]
struct Troubles {
    failed: Vec<String>,
    broken: Vec<String>,
    not_converged: Vec<String>,
    underestimated: Vec<String>,
    refusals: BTreeMap<String, usize>,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|argument| argument == "--only") {
        let section = match arguments.get(at + 1).map(String::as_str) {
            Some("times") => times::table(CASES / 2, SEED + 1),
            Some("after") => after::table(),
            Some("physics") => physics::table(SEED),
            Some("maintenance") => maintenance::table(SEED),
            Some("histories") => histories::table(SEED),
            Some("rows") => rows::table(SEED),
            Some("routes") => {
                let shown = matrix::matrix(&features::selection(true));
                println!("{}", shown.table());
                return match shown.wrong.is_empty() {
                    true => ExitCode::SUCCESS,
                    false => ExitCode::FAILURE,
                };
            }
            Some("creep-map") => sweeps::creep_maps(),
            Some("sweep-with-zones") => sweeps::with_zones(),
            Some("damaged-profile") => damaged_table::tables(SEED),
            _ => {
                eprintln!(
                    "--only takes times, after, physics, maintenance, histories, rows, routes, creep-map, sweep-with-zones or damaged-profile"
                );
                return ExitCode::FAILURE;
            }
        };
        println!("{section}");
        return ExitCode::SUCCESS;
    }
    if let Some(at) = arguments.iter().position(|argument| argument == "--case") {
        let number = arguments.get(at + 1).and_then(|text| text.parse().ok());
        let seed = arguments.get(at + 2).and_then(|text| text.parse().ok());
        let seed = seed.unwrap_or(SEED);
        let found = number.and_then(|number: usize| samples(number + 1, seed).nth(number));
        let Some(sample) = found else {
            eprintln!("--case takes the number of a case, and the seed of its run");
            return ExitCode::FAILURE;
        };
        println!("{}", sample.case);
        return ExitCode::SUCCESS;
    }
    let mut numbers = std::env::args()
        .skip(1)
        .filter_map(|text| text.parse().ok());
    let count = numbers.next().map_or(CASES, |count: u64| count as usize);
    let seed = numbers.next().unwrap_or(SEED);
    let mut rows: BTreeMap<&'static str, Row> = BTreeMap::new();
    let mut troubles = Troubles::default();
    for sample in samples(count, seed) {
        let found = trial(&sample);
        rows.entry(sample.kind)
            .or_default()
            .add(&sample.case, &found);
        troubles.add(&sample, found);
        if (sample.number + 1) % 500 == 0 {
            eprintln!("{} cases", sample.number + 1);
        }
    }
    let mut text = report(count, seed, &rows, &troubles);
    text.push_str(&rows::table(SEED));
    text.push_str(&damaged_table::tables(SEED));
    text.push_str(&physics::table(SEED));
    text.push_str(&maintenance::table(SEED));
    text.push_str(&histories::table(SEED));
    println!("{text}");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/stability.md");
    std::fs::write(path, text).expect("docs can be written");
    if troubles.failed.is_empty() && troubles.broken.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

impl Row {
    fn add(&mut self, case: &Value, trial: &Trial) {
        self.cases += 1;
        match &trial.end {
            End::Solved => self.solved += 1,
            End::Refused(_) => self.refused += 1,
            End::NotConverged(_) => self.not_converged += 1,
            End::Failed(_) => {}
        }
        self.iterations.extend(trial.iterations.map(f64::from));
        self.residual = self.residual.max(trial.residual.unwrap_or(0.0));
        self.energy.extend(trial.energy.map(f64::abs));
        self.from_liu_hsu.extend(trial.from_liu_hsu);
        self.errors.extend(trial.error);
        self.times
            .extend(trial.times.map(|[taken, formulas]| CaseTimes {
                taken,
                formulas,
                told: told(case),
            }));
    }
}

impl Troubles {
    fn add(&mut self, sample: &Sample, trial: Trial) {
        let name = |what: &str| format!("{} ({}): {what}", sample.number, sample.kind);
        self.broken.extend(trial.broken.iter().map(|law| name(law)));
        if let Some((error, estimate)) = trial.error.filter(|(error, estimate)| error > estimate) {
            let target = &sample.case["solver"]["target_error"];
            self.underestimated.push(name(&format!(
                "target {target}, difference {error:.4}, estimates {estimate:.4}"
            )));
        }
        match trial.end {
            End::Solved => {}
            End::Failed(reason) => self.failed.push(name(&reason)),
            End::NotConverged(reason) => self.not_converged.push(name(&reason)),
            End::Refused(reason) => {
                // Numbers differ from case to case.
                let words: String = reason
                    .chars()
                    .filter(|c| !c.is_ascii_digit())
                    .take(90)
                    .collect();
                *self.refusals.entry(words).or_default() += 1;
            }
        }
    }
}

/// Returns the quantiles of some values as cells of a table, or dashes without values.
fn cells(values: &[f64], shares: &[f64], text: fn(f64) -> String) -> String {
    let cell = |share: &f64| match values.is_empty() {
        true => "–".to_owned(),
        false => text(quantile(values.to_vec(), *share)),
    };
    shares.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn small(value: f64) -> String {
    format!("{value:.1e}")
}

fn report(count: usize, seed: u64, rows: &BTreeMap<&str, Row>, troubles: &Troubles) -> String {
    let mut text = format!(
        "# Stability\n\nWritten by `cargo bench --bench stress -- {count} {seed}`; do not edit.\n\n\
         {count} random cases: a/b 1/50 to 50, ν 0 to 0.5, μ 0.001 to 2, loads 1 N to 1 MN, creepages 1e-12 to 1 or 1e-6 to 100 times\n\
         what saturates, normalised spin to 100, lengths and stresses in other units, meshes from one cell to 2200, gaps with kinks\n\
         and roughness, pressures with holes, zeros and denormal numbers, patches that nearly touch.\n\n\
         - crashed or hung: {}\n- answers that break a law: {}\n- without convergence: {}\n\n\
         *Laws*: finite numbers; patches and cells carry the load; tractions within μp, slip along them, none where a cell sticks; forces\n\
         within μN and equal to the sums of the tractions (with a target, within the estimated error); friction takes power (from nine cells on, within the estimated error); the same forces in other units and, reversed, for the\n\
         reversed motion (within 2e-5 on one mesh, 3e-3 where region and pressure are found from a gap).\n\n\
         | cases | number | solved | refused | not converged | iterations: median | 95 % | most | largest residual | energy: median | 95 % | from liu_hsu: median | largest |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        troubles.failed.len(),
        troubles.broken.len(),
        troubles.not_converged.len(),
    );
    for (kind, row) in rows {
        let _ = writeln!(
            text,
            "| {kind} | {} | {} | {} | {} | {} | {:.1e} | {} | {} |",
            row.cases,
            row.solved,
            row.refused,
            row.not_converged,
            cells(&row.iterations, &[0.5, 0.95, 1.0], |n| format!("{n:.0}")),
            row.residual,
            cells(&row.energy, &[0.5, 0.95], small),
            cells(&row.from_liu_hsu, &[0.5, 1.0], small),
        );
    }
    text.push_str(
        "\n*Iterations* are Newton's over all levels and rules; *energy*: power of the cells over power of the motion, less 1; *from liu_hsu*:\n\
         largest difference of F_x/μN, F_y/μN, M_z/(μN√(A/π)) from the paper's method on the same mesh, where both converge.\n\n",
    );
    text.push_str(&accuracy(rows));
    text.push_str(&times::section(
        rows.iter().map(|(kind, row)| (*kind, &row.times)),
        seed,
    ));
    text.push_str(&sweeps::creep_maps());
    text.push_str(&sweeps::with_zones());
    text.push_str(&condition::section());
    for (title, list) in [
        ("Crashes and hangs", &troubles.failed),
        ("Broken laws", &troubles.broken),
        ("Not converged", &troubles.not_converged),
        ("Errors beyond their estimates", &troubles.underestimated),
    ] {
        if !list.is_empty() {
            let _ = writeln!(text, "## {title}\n");
            list.iter().take(NAMED_MAX).for_each(|name| {
                let _ = writeln!(text, "- {name}");
            });
            text.push('\n');
        }
    }
    if !troubles.refusals.is_empty() {
        text.push_str("## Refused, by reason (numbers left out)\n\n");
        for (reason, count) in &troubles.refusals {
            let _ = writeln!(text, "- {count}: {reason}");
        }
    }
    text
}

/// Compares answers with answers to an eight times smaller target.
fn accuracy(rows: &BTreeMap<&str, Row>) -> String {
    let mut text = "## Against finer meshes\n\nCases with a target, against the answer for a target eight times smaller (at least 0.0003). *Covered*: the\n\
         difference is at most the sum of both estimates.\n\n| cases | compared | covered | difference: median | largest |\n|---|---|---|---|---|\n"
        .to_owned();
    for (kind, row) in rows.iter().filter(|(_, row)| !row.errors.is_empty()) {
        let errors: Vec<f64> = row.errors.iter().map(|(error, _)| *error).collect();
        let covered = row
            .errors
            .iter()
            .filter(|(error, estimate)| error <= estimate)
            .count();
        let _ = writeln!(
            text,
            "| {kind} | {} | {covered} | {} |",
            errors.len(),
            cells(&errors, &[0.5, 1.0], small),
        );
    }
    text.push('\n');
    text
}
