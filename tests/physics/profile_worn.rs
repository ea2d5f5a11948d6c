//! A worn wheel on a worn rail, where tread, gauge corner and flange touch close to each other. Needs the reference files beside
//! the checkout.

use railhead::contact::monitor::Unwatched;
use railhead::contact::problem::Limits;
use railhead::contact::solution::Solution;
use railhead::contact::{check, solve};
use serde_json::{Value, json};

use crate::profile_cases::{generated, put, wheel_on_rail};
use crate::profile_reference_files::reference_file;
use crate::reference::assert_none;

/// The worn pair at a lateral shift in mm under a vertical force in N, with yaw in rad.
pub fn worn(shift: f64, force: f64, yaw: f64) -> Option<Value> {
    let file = |name: &str| Some(json!({ "format": "simpack", "text": reference_file(name)? }));
    let case = wheel_on_rail(
        file("extended/profiles/site_b_hr.prr")?,
        file("extended/profiles/worn_high_mileage.prw")?,
        0.0,
    );
    let members = json!({
        "rolling_radius_mm": 444, "gauge_mm": 1435.1, "gauge_height_mm": 15.875,
        "flange_back_distance_mm": 1347.4, "flange_back_position_mm": 0,
        "lateral_shift_mm": shift, "yaw_rad": yaw, "roll_rad": -0.0013,
    });
    let mut case = put(&case, "contact", members);
    case["load"] = json!({ "vertical_force_n": force });
    case["motion"] =
        json!({ "wheelset": { "speed_mm_per_s": 15000, "free_rolling_radius_mm": 444 } });
    Some(case)
}

fn solved(case: &Value) -> Result<Solution, String> {
    let problem = check(case, &Limits::default()).map_err(|e| e.to_string())?;
    solve(&problem, &Unwatched)
        .map(|(solution, _)| solution)
        .map_err(|e| e.to_string())
}

/// Between these shifts the tread's patch ends within a millimetre of that of the gauge corner, at an inclination of half a
/// radian to it. (`cargo bench --bench worn` solves all 336 states.)
#[test]
fn a_patch_that_ends_next_to_another_one_is_solved() {
    let mut failures = Vec::new();
    for (shift, force, yaw) in [
        (-13.0, 120e3, 0.0),
        (-13.4, 137e3, -0.005),
        (-13.8, 145e3, 0.001),
        (-14.2, 129e3, 0.01),
        (-14.4, 137e3, 0.0),
        (-14.6, 120e3, -0.01),
        (-14.74, 125e3, 0.0),
        (-14.74, 137e3, 0.001),
        (-14.74, 140e3, -0.001),
        (-14.8, 145e3, 0.0),
        (-15.0, 137e3, -0.005),
        (-15.2, 120e3, 0.001),
    ] {
        let Some(case) = worn(shift, force, yaw) else {
            return;
        };
        match solved(&case) {
            Ok(solution) => {
                let vertical = -solution.total[0].force_z_n.expect("a vertical force");
                if (vertical / force - 1.0).abs() > 1e-3 {
                    failures.push(format!("{shift} {force} {yaw}: {vertical} N"));
                }
            }
            Err(reason) => failures.push(format!("{shift} {force} {yaw}: {reason}")),
        }
    }
    assert_none("not solved", &failures);
}

/// Loads are those of a prototype that keeps neighbouring gaps apart by the same rule, written independently.
#[test]
fn tread_gauge_corner_and_flange_share_the_load() {
    let Some(case) = worn(-14.74, 137e3, 0.0) else {
        return;
    };
    let solution = solved(&case).expect("an answer");
    let expected = [(91.1e3, 837.0), (53.7e3, 1606.0), (0.98e3, 381.0)];
    assert_eq!(solution.patches.len(), expected.len());
    for (patch, (force, pressure)) in solution.patches.iter().zip(expected) {
        let missed = (patch.normal_force_n - force).abs();
        assert!(missed < 0.01 * force + 20.0, "{}", patch.normal_force_n);
        assert!((patch.pressure_max_mpa / pressure - 1.0).abs() < 0.01);
    }
}

/// Largest second difference of a row of values, relative to the values: a jump shows in it as a whole.
fn bend(values: &[f64]) -> f64 {
    let bend = |w: &[f64]| ((w[2] - 2.0 * w[1] + w[0]) / w[1]).abs();
    values.windows(3).map(bend).fold(0.0, f64::max)
}

fn peak(solution: &Solution) -> f64 {
    let peaks = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
    peaks.fold(0.0, f64::max)
}

/// Tread and gauge corner lie side by side here, inclined to each other by about half a radian: the threshold at which they share a gap.
#[test]
fn forces_and_pressures_do_not_jump_with_the_load() {
    let (mut lateral, mut peaks) = (Vec::new(), Vec::new());
    for force in (0..=8).map(|k| 125e3 + 5e3 * f64::from(k)) {
        let Some(case) = worn(-14.7, force, 0.005) else {
            return;
        };
        let solution = solved(&case).expect("an answer");
        lateral.push(solution.total[0].force_y_n);
        peaks.push(peak(&solution));
    }
    assert!(bend(&lateral) < 0.003, "{lateral:?}");
    assert!(bend(&peaks) < 0.01, "{peaks:?}");
}

/// Normal force and largest pressure over lowerings of 0.07 to 0.14 mm, by steps of 1 µm.
fn over_heights(case: &Value) -> [Vec<f64>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    for k in 0..=66 {
        let mut case = case.clone();
        case["load"] = json!({ "approach_mm": 0.073 + 0.001 * f64::from(k) });
        case["solver"] = json!({ "method": "fastsim" });
        let solution = solved(&case).expect("an answer");
        let forces = solution.patches.iter().map(|patch| patch.normal_force_n);
        found[0].push(forces.sum());
        found[1].push(peak(&solution));
    }
    found
}

#[test]
fn forces_rise_smoothly_as_the_wheel_is_lowered() {
    let at_flange = |shift: f64| {
        put(
            &generated(),
            "contact",
            json!({ "lateral_shift_mm": shift }),
        )
    };
    let mut cases = vec![("two points", at_flange(-5.4)), ("one", at_flange(-6.0))];
    for (shift, yaw) in [(-14.7, 0.005), (-14.74, 0.0), (-14.0, 0.0)] {
        cases.extend(worn(shift, 100e3, yaw).map(|case| ("worn", case)));
    }
    for (name, case) in cases {
        let [forces, peaks] = over_heights(&case);
        assert!(
            forces.windows(2).all(|pair| pair[1] > pair[0]),
            "{name}: {forces:?}"
        );
        // Rows of a force of the power 3/2 bend by 4e-5 here; what is more is that of the grids.
        assert!(bend(&forces) < 0.008, "{name}: {}", bend(&forces));
        assert!(bend(&peaks) < 0.015, "{name}: {}", bend(&peaks));
    }
}
