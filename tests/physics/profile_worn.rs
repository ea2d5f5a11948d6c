//! Tests a measured worn wheel on a worn rail, where tread, gauge corner and flange touch close to each other. Needs the reference files next to the
//! checkout. `profile_conforming.rs` tests the same with a generated pair.

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::profile_cases::{on_planes, put, wheel_on_rail};
use crate::profile_reference_files::reference_file;
use crate::reference::assert_none;

/// Returns the worn pair at a lateral shift in mm under a vertical force in N, with yaw in rad.
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

pub fn solved(case: &Value) -> Result<Solution, String> {
    let checked = check(case, &Limits::default()).map_err(|e| e.to_string())?;
    solve(&checked, &Unmonitored)
        .map(|(solution, _)| solution)
        .map_err(|e| e.to_string())
}

/// Between these shifts, the patch on the tread ends within a millimetre of the patch on the gauge corner, inclined to it by half a radian. (`cargo
/// bench --bench wheels -- worn` solves all 336 states.)
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

/// The expected loads are those of an independent prototype that separates neighbouring gaps by the same rule.
#[test]
fn tread_gauge_corner_and_flange_share_the_load() {
    let Some(case) = worn(-14.74, 137e3, 0.0) else {
        return;
    };
    let solution = solved(&on_planes(&case)).expect("an answer");
    let expected = [(91.1e3, 837.0), (53.7e3, 1606.0), (0.98e3, 381.0)];
    assert_eq!(solution.patches.len(), expected.len());
    for (patch, (force, pressure)) in solution.patches.iter().zip(expected) {
        let missed = (patch.normal_force_n - force).abs();
        assert!(missed < 0.01 * force + 30.0, "{}", patch.normal_force_n);
        // The patch on the flange has few cells across.
        let allowed = if force < 1e3 { 0.06 } else { 0.01 };
        let found = patch.pressure_max_mpa;
        assert!((found / pressure - 1.0).abs() < allowed, "{found}");
    }
}

/// Tests heavier loads than a wheel carries: tread and gauge corner grow into each other and then share a plane.
#[test]
fn patches_that_grow_into_each_other_make_no_ridge_of_pressure() {
    for lowering in [0.065, 0.17, 0.21] {
        let Some(case) = worn(-14.74, 0.0, 0.0) else {
            return;
        };
        let mut case = on_planes(&case);
        case["load"] = json!({ "approach_mm": lowering });
        let solution = solved(&case).expect("an answer");
        let peaks = solution.patches.iter().map(|patch| patch.pressure_max_mpa);
        let peak = peaks.fold(0.0, f64::max);
        assert!(peak < 4000.0, "{lowering}: {peak} MPa");
    }
}
