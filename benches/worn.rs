//! Solves a worn wheel on a worn rail in 336 states, and prints which reach equilibrium and how smoothly forces depend on the load.
//!
//! `cargo bench --bench worn` needs the reference files next to the checkout (or `RAILHEAD_REFERENCE`). It ends with an error if more than one state
//! in a hundred has no answer.

use std::collections::BTreeMap;
use std::process::ExitCode;

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve};
use serde_json::{Value, json};
use worn_pair::worn_pair;

mod worn_pair;

fn main() -> ExitCode {
    let Some(pair) = worn_pair() else {
        println!("no reference files: RAILHEAD_REFERENCE names the folder that they are in");
        return ExitCode::FAILURE;
    };
    let (mut count, mut failures) = (0, BTreeMap::<String, u32>::new());
    for shift in (0..12).map(|k| -13.0 - 0.2 * f64::from(k)) {
        for force in [120e3, 129e3, 137e3, 145e3] {
            for yaw in [-0.01, -0.005, -0.001, 0.0, 0.001, 0.005, 0.01] {
                count += 1;
                if let Err(reason) = solved(&placed(&pair, shift, force, yaw)) {
                    println!("shift {shift:.2} mm, {force} N, yaw {yaw}: {reason}");
                    let words = reason.chars().filter(|c| !c.is_ascii_digit()).take(80);
                    *failures.entry(words.collect()).or_default() += 1;
                }
            }
        }
    }
    let failed: u32 = failures.values().sum();
    println!("{failed} of {count} states have no answer: {failures:#?}");
    println!();
    println!("| load, kN | lateral force, N | largest pressure, MPa | patches |");
    println!("|---|---|---|---|");
    for force in (0..=10).map(|k| 100e3 + 5e3 * f64::from(k)) {
        match solved(&placed(&pair, -14.7, force, 0.005)) {
            Ok(solution) => {
                let peaks = solution.patches.iter().map(|p| p.pressure_max_mpa);
                println!(
                    "| {} | {:.0} | {:.0} | {} |",
                    1e-3 * force,
                    solution.total[0].force_y_n,
                    peaks.fold(0.0, f64::max),
                    solution.patches.len()
                );
            }
            Err(reason) => println!("| {} | {reason} | | |", 1e-3 * force),
        }
    }
    if 100 * failed <= count {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn solved(case: &Value) -> Result<Solution, String> {
    let checked = check(case, &Limits::default()).map_err(|error| error.to_string())?;
    let answer = solve(&checked, &Unmonitored).map_err(|error| error.to_string())?;
    Ok(answer.0)
}

fn placed([rail, wheel]: &[Value; 2], shift: f64, force: f64, yaw: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "profiles", "rail": rail, "wheel": wheel, "side": "right",
            "rolling_radius_mm": 444, "gauge_mm": 1435.1, "gauge_height_mm": 15.875,
            "flange_back_distance_mm": 1347.4, "flange_back_position_mm": 0,
            "lateral_shift_mm": shift, "yaw_rad": yaw, "roll_rad": -0.0013,
        },
        "load": { "vertical_force_n": force },
        "motion": { "wheelset": { "speed_mm_per_s": 15000, "free_rolling_radius_mm": 444 } },
        "outputs": ["resultants"],
    })
}
