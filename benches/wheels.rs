//! Wheels on rails by their profiles, and gaps: times and answers, to pair an old build with a new one.

extern crate railhead_contact as railhead;

#[path = "report/gaps.rs"]
#[allow(dead_code)]
mod gaps;
mod machine;
#[path = "calibrate/population.rs"]
#[allow(dead_code)]
mod population;
#[path = "../tests/physics/profile_shapes.rs"]
#[allow(dead_code)]
mod profile_shapes;
#[path = "report/questions.rs"]
#[allow(dead_code)]
mod questions;
#[path = "stress/random.rs"]
#[allow(dead_code)]
mod random;

use machine::{lu_seconds, seconds_of};
use questions::stored;
use railhead::contact::case::limits::Limits;
use railhead::contact::half_space::grid_operator::GridWorkspace;
use railhead::contact::monitor::Unmonitored;
use railhead::contact::normal::normal_task::NormalTask;
use railhead::contact::normal::wheel_height::search::{Accuracy, HeightStart, NormalPass};
use railhead::contact::normal_stage;
use railhead::contact::problem::checked_case::CheckedCase;
use railhead::contact::{check, solve, solve_with};
use serde_json::{Value, json};
use std::hint::black_box;
use std::sync::Arc;

fn example(name: &str) -> Value {
    let path = format!(
        "{}/api/examples/{name}",
        concat!(env!("CARGO_MANIFEST_DIR"), "/../..")
    );
    serde_json::from_str(&std::fs::read_to_string(path).expect("an example")).expect("JSON")
}

fn cases() -> Vec<(String, Value)> {
    let mut cases: Vec<(String, Value)> = [3.0, 1.0, 0.0, -1.0, -2.0, -4.0, -5.5]
        .into_iter()
        .map(|shift| {
            let mut case = example("wheel-rail.case.json");
            case["contact"]["lateral_shift_mm"] = json!(shift);
            (format!("shift{shift}"), case)
        })
        .collect();
    cases.push(("flange".to_owned(), example("wheel-rail-flange.case.json")));
    for (_, case) in &mut cases {
        case["outputs"] = json!(["resultants"]);
    }
    for case in [stored("gap_grids"), stored("gap_profiles")].concat() {
        cases.push((
            case["id"].as_str().unwrap().to_owned(),
            gaps::question(&case),
        ));
    }
    cases
}

fn best(n: usize, mut work: impl FnMut()) -> f64 {
    (0..n)
        .map(|_| seconds_of(&mut work).0)
        .fold(f64::INFINITY, f64::min)
}

fn normal(checked: &CheckedCase) -> u32 {
    match &checked.problem.task {
        NormalTask::Wheel(contact) => {
            let wanted = NormalPass {
                friction_share: 0.0,
                accuracy: Accuracy::For(checked.run.target()),
            };
            let search = contact.search().expect("search");
            contact
                .find_height(
                    &search,
                    wanted,
                    HeightStart::default(),
                    &mut GridWorkspace::default(),
                    &Unmonitored,
                )
                .expect("rest")
                .heights
        }
        _ => {
            let _ = black_box(normal_stage::solve(checked, &Unmonitored));
            0
        }
    }
}

fn row_case(pair: &Value, k: usize) -> Value {
    let mut state = (k as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut random = move |low: f64, high: f64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        low + (high - low) * ((state >> 11) as f64 / (1u64 << 53) as f64)
    };
    let mut case = pair.clone();
    case["contact"]["lateral_shift_mm"] = json!(random(-5.0, 4.0));
    case["contact"]["yaw_rad"] = json!(random(-0.01, 0.01));
    case["load"]["vertical_force_n"] = json!(random(40e3, 110e3));
    case["solver"] = json!({ "method": "boundary_element", "target_error": 0.02 });
    case["outputs"] = json!(["resultants"]);
    case
}

fn line(name: &str, case: &Value) {
    let limits = Limits::default();
    let checked = match check(case, &limits) {
        Ok(c) => c,
        Err(e) => {
            println!("{name} FAULT {e}");
            return;
        }
    };
    match solve(&checked, &Unmonitored) {
        Ok((s, _)) => {
            let t = &s.total[0];
            let e = t.error_estimate.unwrap_or_default();
            let n: f64 = s.patches.iter().map(|p| p.normal_force_n).sum();
            let a: f64 = s.patches.iter().map(|p| p.area_mm2).sum();
            let p = s
                .patches
                .iter()
                .map(|p| p.pressure_max_mpa)
                .fold(0.0, f64::max);
            println!(
                "{name} {} {n:.4} {:.5} {:.5} {:.5} {p:.5} {a:.6} {:.8} {:.4} {:.4} mu {} rem {}",
                s.patches.len(),
                t.force_x_n,
                t.force_y_n,
                t.moment_z_n_mm,
                s.patches[0].approach_mm.unwrap_or(0.0),
                e.force_x_n,
                e.force_y_n,
                checked.problem.friction.largest(),
                s.remarks
                    .iter()
                    .map(|r| r.code.to_string())
                    .collect::<Vec<_>>()
                    .join(",")
            );
        }
        Err(e) => println!("{name} ERROR {e}"),
    }
}

fn main() {
    let args: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let limits = Limits::default();
    match args[0].as_str() {
        "times" => {
            let n: usize = args[1].parse().unwrap();
            let filter = args.get(2).cloned().unwrap_or_default();
            let lu = lu_seconds();
            println!("LU {:.3} ms", 1e3 * lu);
            for (name, case) in cases() {
                if !name.contains(&filter) {
                    continue;
                }
                let checked = check(&case, &limits).expect("valid");
                let heights = normal(&checked);
                let whole = best(n, || {
                    let _ = black_box(solve(&checked, &Unmonitored));
                });
                let rest = best(n, || {
                    black_box(normal(&checked));
                });
                let checking = best(n, || {
                    let _ = black_box(check(&case, &limits));
                });
                println!(
                    "{name:28} whole {:.2} normal {:.2} check {:.2} heights {heights}",
                    whole / lu,
                    rest / lu,
                    checking / lu
                );
            }
        }
        "rows" => {
            let n: usize = args[1].parse().unwrap();
            let pair = example(args.get(2).map_or("wheel-rail.case.json", String::as_str));
            let lu = lu_seconds();
            let operators = Arc::default();
            let (mut checks, mut solves) = (Vec::new(), Vec::new());
            for k in 0..n {
                let (made, case) = seconds_of(|| row_case(&pair, k));
                let (c, checked) = seconds_of(|| check(&case, &limits).expect("valid"));
                let (s, answer) = seconds_of(|| solve_with(&operators, &checked, &Unmonitored));
                if let Err(e) = answer {
                    println!("row {k}: {e}");
                }
                checks.push(c + made);
                solves.push(s);
            }
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64 / lu;
            println!(
                "LU {:.3} ms; rows {n}: check {:.3} solve {:.3} (median {:.3}, 90% {:.3}) sum {:.3} LU",
                1e3 * lu,
                mean(&checks),
                mean(&solves),
                machine::quantile(solves.clone(), 0.5) / lu,
                machine::quantile(solves.clone(), 0.9) / lu,
                mean(&checks) + mean(&solves)
            );
        }
        "dump" => {
            let target = args.get(1).map(|t| t.parse::<f64>().unwrap());
            let with = |mut case: Value| {
                if let Some(t) = target {
                    case["solver"] = json!({ "target_error": t });
                }
                case
            };
            for (name, case) in cases() {
                line(&name, &with(case));
            }
            for k in 0..population::Class::Profiles.count() {
                line(
                    &format!("prof{k}"),
                    &with(population::case(population::Class::Profiles, k)),
                );
            }
            if target.is_none() {
                let pair = example("wheel-rail.case.json");
                for k in 0..100 {
                    line(&format!("row{k}"), &row_case(&pair, k));
                }
            }
            for k in 0..100 {
                line(
                    &format!("gap{k}"),
                    &with(population::case(population::Class::Gap, k)),
                );
            }
        }
        "one" => {
            let (what, n): (&str, usize) = (&args[2], args[3].parse().unwrap());
            let case = if let Some(k) = args[1].strip_prefix("row") {
                row_case(&example("wheel-rail.case.json"), k.parse().unwrap())
            } else {
                cases()
                    .into_iter()
                    .find(|c| c.0 == args[1])
                    .expect("a case")
                    .1
            };
            let checked = check(&case, &limits).expect("valid");
            for _ in 0..n {
                match what {
                    "solve" => {
                        let _ = black_box(solve(&checked, &Unmonitored));
                    }
                    "check" => {
                        let _ = black_box(check(&case, &limits));
                    }
                    _ => {
                        black_box(normal(&checked));
                    }
                }
            }
        }
        _ => panic!("?"),
    }
}
