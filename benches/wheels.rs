//! Measures wheels on rails by their profiles: the time of a solve, of the check of the case, and of rows of one pair.
//!
//! `cargo bench --bench wheels` prints the best of several times in LU (the report's unit). `-- rows 1000` prints the means over this number of
//! rows, which differ in shift, yaw and load. They are solved one after the other as in a run, at a target of 0.02 and without fields. `-- shift`
//! draws forces over the shift of the wheelset into `docs/wheel-rail/shift.svg`; the worn pair needs the reference files. `-- curve 20` prints the
//! ratio of the time on the reference curve to that on planes, for 20 random placements of each class. `-- worn` solves the worn pair in 336 states
//! and prints which reach equilibrium and how smoothly forces depend on the load; it fails if more than one state in a hundred has no answer.
//!
//! `RAILHEAD_REFERENCE` names the folder of the reference files.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;

use examples::{example, wheel_places};
use machine::{lu_seconds, median, quantile, seconds_of};
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::{check, check_with, solve, solve_with};
use random::Random;
use serde_json::{Value, json};
use wheel_shift::{Shifted, draw};

#[allow(dead_code, reason = "other pictures use the rest")]
mod drawing;
mod examples;
mod machine;
#[allow(dead_code, reason = "other benches use more of it")]
mod random;
mod wheel_shift;

const REPEATS: usize = 15;
/// Number of rows measured with the same LU.
const ROWS_PER_LU: usize = 50;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it prints nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let form = |name: &str, usual: usize| {
        let place = arguments.iter().position(|argument| argument == name)?;
        let count = arguments
            .get(place + 1)
            .and_then(|count| count.parse().ok());
        Some(count.unwrap_or(usual))
    };
    if let Some(count) = form("rows", 1000) {
        rows(count);
    } else if let Some(count) = form("curve", 20) {
        curve(count);
    } else if form("shift", 1).is_some() {
        shift();
    } else if form("worn", 1).is_some() {
        worn();
    } else {
        cases();
    }
}

fn checked(case: &Value) -> CheckedCase {
    check(case, &Limits::default()).expect("a valid case")
}

fn cases() {
    let lu = lu_seconds();
    println!("1 LU = {:.3} ms", 1e3 * lu);
    println!("| case | whole | check |\n|---|---|---|");
    for (name, case) in wheel_places() {
        let problem = checked(&case);
        let best = |work: &dyn Fn()| {
            let times = (0..REPEATS).map(|_| seconds_of(work).0);
            times.fold(f64::INFINITY, f64::min) / lu
        };
        println!(
            "| {name} | {:.2} | {:.2} |",
            best(&|| drop(black_box(solve(&problem, &Unmonitored)))),
            best(&|| drop(black_box(checked(&case)))),
        );
    }
}

fn rows(count: usize) {
    let pair = example("wheel-rail");
    let (operators, known) = (Arc::default(), KnownPair::default());
    let (mut lu, mut units) = (0.0, Vec::new());
    // The first solve of a process loads the table of creep forces.
    let first = check_with(&known, &row(&pair, count), &Limits::default()).expect("a valid case");
    drop(solve_with(&operators, &first, &Unmonitored));
    let (mut checks, mut solves, mut failed) = (Vec::new(), Vec::new(), 0);
    for k in 0..count {
        // The speed of the machine varies.
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

/// Returns the case of a row, on the tread or at the gauge corner.
fn row(pair: &Value, number: usize) -> Value {
    let mut random = Random(number as u64);
    let mut case = pair.clone();
    case["contact"]["lateral_shift_mm"] = json!(random.between(-5.0, 4.0));
    case["contact"]["yaw_rad"] = json!(random.between(-0.01, 0.01));
    case["load"]["vertical_force_n"] = json!(random.between(40e3, 110e3));
    case["solver"] = json!({ "method": "boundary_element", "target_error": 0.02 });
    case["outputs"] = json!(["resultants"]);
    case
}

/// A class of placements of a pair.
struct Class {
    name: &'static str,
    pair: Value,
    /// Lateral shifts in mm.
    shifts: [f64; 2],
    /// Yaw in rad.
    yaw: [f64; 2],
    /// Vertical forces in N.
    force: [f64; 2],
    /// Whether the placements are solved one after the other with a common store of operators at a target of 0.02. Otherwise they are solved
    /// separately at 0.005.
    rows: bool,
}

/// Compares contact on the reference curve with contact on planes: ratios of processor time of single solves and of rows of one pair.
fn curve(count: usize) {
    println!(
        "| class | cases | patches | plane, ms | curve, ms | ratio: median | 90 % | largest | without an answer |\n|---|---|---|---|---|---|---|---|---|"
    );
    for (seed, class) in classes().into_iter().enumerate() {
        let (mut times, mut ratios) = ([Vec::new(), Vec::new()], Vec::new());
        let (mut patches, mut failed) = (Vec::new(), 0);
        let (operators, known) = ([Arc::default(), Arc::default()], KnownPair::default());
        for k in 0..count {
            let mut random = Random((1000 * seed + k) as u64);
            let mut between = |[low, high]: [f64; 2]| random.between(low, high);
            let mut case = class.pair.clone();
            case["contact"]["lateral_shift_mm"] = json!(between(class.shifts));
            case["contact"]["yaw_rad"] = json!(between(class.yaw));
            case["load"] = json!({ "vertical_force_n": between(class.force) });
            case["solver"] = json!({ "method": "boundary_element", "target_error": if class.rows { 0.02 } else { 0.005 } });
            case["outputs"] = json!(["resultants"]);
            let problems = ["plane", "curve"].map(|surface| {
                case["contact"]["reference_surface"] = json!(surface);
                check_with(&known, &case, &Limits::default()).expect("a valid case")
            });
            let mut best = [f64::INFINITY; 2];
            let mut answers = [None, None];
            for _ in 0..if class.rows { 1 } else { 3 } {
                for (surface, problem) in problems.iter().enumerate() {
                    let alone = Arc::default();
                    let operators = if class.rows {
                        &operators[surface]
                    } else {
                        &alone
                    };
                    let (seconds, answer) =
                        seconds_of(|| solve_with(operators, problem, &Unmonitored));
                    best[surface] = best[surface].min(seconds);
                    answers[surface] = answer.ok();
                }
            }
            if let [Some(_), Some((solution, _))] = answers {
                patches.push(solution.patches.len() as f64);
                ratios.push(best[1] / best[0]);
                times
                    .iter_mut()
                    .zip(best)
                    .for_each(|(times, best)| times.push(1e3 * best));
            } else {
                failed += 1;
            }
        }
        let [plane, curve] = times.map(median);
        println!(
            "| {} | {count} | {} | {plane:.1} | {curve:.1} | {:.2} | {:.2} | {:.2} | {failed} |",
            class.name,
            median(patches),
            median(ratios.clone()),
            quantile(ratios.clone(), 0.9),
            quantile(ratios, 1.0),
        );
    }
}

fn classes() -> Vec<Class> {
    let mut new = example("wheel-rail");
    new["contact"]["accept_rough_profiles"] = json!(true);
    let of_new = |name, shifts, rows| Class {
        name,
        pair: new.clone(),
        shifts,
        yaw: [-0.01, 0.01],
        force: [40e3, 110e3],
        rows,
    };
    let mut classes = vec![
        of_new("tread", [-2.0, 4.0], false),
        of_new("gauge corner", [-5.9, -3.5], false),
        of_new("gauge corner and flange", [-6.5, -6.2], false),
        of_new("tread, rows", [-2.0, 4.0], true),
        of_new("gauge corner, rows", [-5.9, -3.5], true),
    ];
    if let Some(mut pair) = worn_case() {
        pair["contact"]["accept_rough_profiles"] = json!(true);
        for (name, shifts) in [
            ("worn, tread", [-13.8, -12.5]),
            ("worn, tread and flange", [-15.2, -14.5]),
        ] {
            classes.push(Class {
                name,
                pair: pair.clone(),
                shifts,
                yaw: [-0.01, 0.01],
                force: [100e3, 140e3],
                rows: false,
            });
        }
    }
    classes
}

fn shift() {
    let new = Shifted {
        name: "S1002 on 60E1, 75 kN, yaw 3 mrad",
        pair: example("wheel-rail"),
        load: 75e3,
        yaw: 0.003,
    };
    let worn = worn_case().map(|mut pair| {
        pair["contact"]["accept_rough_profiles"] = json!(true);
        Shifted {
            name: "worn pair, 137 kN",
            pair,
            load: 137e3,
            yaw: 0.005,
        }
    });
    let pairs: Vec<Shifted> = std::iter::once(new).chain(worn).collect();
    let path = format!(
        "{}/../docs/wheel-rail/shift.svg",
        env!("CARGO_MANIFEST_DIR")
    );
    std::fs::write(&path, draw(&pairs).svg()).expect("a picture can be written");
    println!("{path}");
}

/// Solves the worn pair in 336 states, and over the load in one of them.
fn worn() {
    let mut case = worn_case().expect("RAILHEAD_REFERENCE names the folder of the reference files");
    case["outputs"] = json!(["resultants"]);
    let solved = |shift: f64, force: f64, yaw: f64| {
        let mut case = case.clone();
        case["contact"]["lateral_shift_mm"] = json!(shift);
        case["contact"]["yaw_rad"] = json!(yaw);
        case["load"] = json!({ "vertical_force_n": force });
        let checked = check(&case, &Limits::default()).map_err(|error| error.to_string())?;
        solve(&checked, &Unmonitored).map_err(|error| error.to_string())
    };
    let (mut count, mut failures) = (0, BTreeMap::<String, u32>::new());
    for shift in (0..12).map(|k| -13.0 - 0.2 * f64::from(k)) {
        for force in [120e3, 129e3, 137e3, 145e3] {
            for yaw in [-0.01, -0.005, -0.001, 0.0, 0.001, 0.005, 0.01] {
                count += 1;
                if let Err(reason) = solved(shift, force, yaw) {
                    println!("shift {shift:.2} mm, {force} N, yaw {yaw}: {reason}");
                    let words = reason.chars().filter(|c| !c.is_ascii_digit()).take(80);
                    *failures.entry(words.collect()).or_default() += 1;
                }
            }
        }
    }
    let failed: u32 = failures.values().sum();
    println!("{failed} of {count} states have no answer: {failures:#?}\n");
    println!(
        "| load, kN | lateral force, N | largest pressure, MPa | patches |\n|---|---|---|---|"
    );
    for load in (0..=10).map(|k| 100.0 + 5.0 * f64::from(k)) {
        match solved(-14.7, 1e3 * load, 0.005) {
            Ok((solution, _)) => {
                let peaks = solution.patches.iter().map(|p| p.pressure_max_mpa);
                println!(
                    "| {load} | {:.0} | {:.0} | {} |",
                    solution.total[0].force_y_n,
                    peaks.fold(0.0, f64::max),
                    solution.patches.len()
                );
            }
            Err(reason) => println!("| {load} | {reason} | | |"),
        }
    }
    assert!(100 * failed <= count, "too many states have no answer");
}

/// Returns the worn pair of the reference files for the right-hand rail, or `None` without the files.
fn worn_case() -> Option<Value> {
    let folder = PathBuf::from(std::env::var_os("RAILHEAD_REFERENCE")?);
    let section = |name: &str| {
        let text = std::fs::read_to_string(folder.join("extended/profiles").join(name)).ok()?;
        Some(json!({ "format": "simpack", "text": text }))
    };
    let (rail, wheel) = (section("site_b_hr.prr")?, section("worn_high_mileage.prw")?);
    Some(json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "profiles", "rail": rail, "wheel": wheel,
            "side": "right", "rolling_radius_mm": 444, "gauge_mm": 1435.1, "gauge_height_mm": 15.875,
            "flange_back_distance_mm": 1347.4, "flange_back_position_mm": 0, "roll_rad": -0.0013,
        },
        "motion": { "wheelset": { "speed_mm_per_s": 15000, "free_rolling_radius_mm": 444 } },
    }))
}
