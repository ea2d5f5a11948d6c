//! Wheels on rails by their profiles: what a solve, the rest of the wheel and the check of the case take, and what rows of one pair take.
//!
//! `cargo bench --bench wheels` prints times in LU (the report's unit), best of several; `-- rows 1000` the means of so many rows that differ in
//! shift, yaw and load, solved one after the other as a run solves them, at a target of 0.02 and without fields.

extern crate railhead_contact as railhead;

mod machine;

use std::hint::black_box;
use std::sync::Arc;

use railhead::contact::case::known_pair::KnownPair;
use railhead::contact::case::limits::Limits;
use railhead::contact::half_space::grid_operator::GridWorkspace;
use railhead::contact::monitor::Unmonitored;
use railhead::contact::normal::normal_task::NormalTask;
use railhead::contact::normal::wheel_height::search::HeightStart;
use railhead::contact::normal::wheel_height::task::{Accuracy, NormalPass};
use railhead::contact::problem::checked_case::CheckedCase;
use railhead::contact::{check, check_with, solve, solve_with};
use serde_json::{Value, json};

use machine::{lu_seconds, median, quantile, seconds_of};

/// Lateral shifts of the wheelset in mm, from the tread to the gauge corner.
const SHIFTS: [f64; 7] = [3.0, 1.0, 0.0, -1.0, -2.0, -4.0, -5.5];
const REPEATS: usize = 15;
/// Rows that are measured in the same LU.
const ROWS_PER_LU: usize = 50;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // Run by `cargo test --benches` as well, where there is nothing to print.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let place = arguments.iter().position(|argument| argument == "rows");
    match place.map(|k| arguments.get(k + 1).and_then(|count| count.parse().ok())) {
        None => cases(),
        Some(count) => rows(count.unwrap_or(1000)),
    }
}

fn example(name: &str) -> Value {
    let path = format!(
        "{}/../api/examples/{name}",
        concat!(env!("CARGO_MANIFEST_DIR"))
    );
    let text = std::fs::read_to_string(path).expect("an example");
    serde_json::from_str(&text).expect("an example is JSON")
}

fn checked(case: &Value) -> CheckedCase {
    check(case, &Limits::default()).expect("a valid case")
}

fn cases() {
    let lu = lu_seconds();
    println!("1 LU = {:.3} ms", 1e3 * lu);
    println!("| case | whole | rest | check | heights |\n|---|---|---|---|---|");
    let of_shift = |shift: f64| {
        let mut case = example("wheel-rail.case.json");
        case["contact"]["lateral_shift_mm"] = json!(shift);
        (format!("shift {shift} mm"), case)
    };
    let flange = ("flange".to_owned(), example("wheel-rail-flange.case.json"));
    for (name, mut case) in SHIFTS.into_iter().map(of_shift).chain([flange]) {
        case["outputs"] = json!(["resultants"]);
        let problem = checked(&case);
        let best = |work: &dyn Fn()| {
            let times = (0..REPEATS).map(|_| seconds_of(work).0);
            times.fold(f64::INFINITY, f64::min) / lu
        };
        println!(
            "| {name} | {:.2} | {:.2} | {:.2} | {} |",
            best(&|| drop(black_box(solve(&problem, &Unmonitored)))),
            best(&|| {
                black_box(rest(&problem));
            }),
            best(&|| drop(black_box(checked(&case)))),
            rest(&problem),
        );
    }
}

/// Brings the wheel of a problem to rest; returns the heights looked at.
fn rest(problem: &CheckedCase) -> u32 {
    let NormalTask::Wheel(contact) = &problem.problem.task else {
        unreachable!("the examples give profiles")
    };
    let wanted = NormalPass {
        friction_share: 0.0,
        accuracy: Accuracy::For(problem.run.target()),
    };
    let mut search = contact.search().expect("a wheel over a rail");
    let workspace = &mut GridWorkspace::default();
    let start = HeightStart::default();
    let found = contact.find_height(&mut search, wanted, start, workspace, &Unmonitored);
    found.expect("a rest").heights
}

fn rows(count: usize) {
    let pair = example("wheel-rail.case.json");
    let (operators, known) = (Arc::default(), KnownPair::default());
    let (mut lu, mut units) = (0.0, Vec::new());
    // The first solve of a process reads the table of creep forces.
    let first = check_with(&known, &row(&pair, count), &Limits::default()).expect("a valid case");
    drop(solve_with(&operators, &first, &Unmonitored));
    let (mut checks, mut solves, mut failed) = (Vec::new(), Vec::new(), 0);
    for k in 0..count {
        // The machine does not keep its speed.
        if k % ROWS_PER_LU == 0 {
            lu = lu_seconds();
            units.push(lu);
        }
        let case = row(&pair, k);
        let (seconds, problem) = seconds_of(|| check_with(&known, &case, &Limits::default()));
        let problem = problem.expect("a valid case");
        checks.push(seconds / lu);
        let (seconds, answer) = seconds_of(|| solve_with(&operators, &problem, &Unmonitored));
        solves.push(seconds / lu);
        failed += u32::from(answer.is_err());
    }
    let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len() as f64;
    println!(
        "1 LU = {:.3} ms; {count} rows, {failed} without an answer: check {:.2} LU a row, solve {:.2} (median {:.2}, 90 % {:.2})",
        1e3 * median(units),
        mean(&checks),
        mean(&solves),
        quantile(solves.clone(), 0.5),
        quantile(solves.clone(), 0.9),
    );
}

/// The case of a row, on the tread and at the gauge corner: the same on every machine.
fn row(pair: &Value, number: usize) -> Value {
    let mut state = (number as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut between = move |low: f64, high: f64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        low + (high - low) * ((state >> 11) as f64 / (1_u64 << 53) as f64)
    };
    let mut case = pair.clone();
    case["contact"]["lateral_shift_mm"] = json!(between(-5.0, 4.0));
    case["contact"]["yaw_rad"] = json!(between(-0.01, 0.01));
    case["load"]["vertical_force_n"] = json!(between(40e3, 110e3));
    case["solver"] = json!({ "method": "boundary_element", "target_error": 0.02 });
    case["outputs"] = json!(["resultants"]);
    case
}
