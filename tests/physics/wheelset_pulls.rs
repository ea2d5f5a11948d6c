//! Tests of forces prescribed under one wheel of a moving wheelset. The solver finds the lateral and the angular velocity, with the wheel in
//! equilibrium under its load.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_cases::{generated, put};
use crate::reference::solve;

const LIMIT: f64 = 0.3 * 75_000.0;
const SPEED: f64 = 20_000.0;

/// Returns a wheel on the right rail (1) or, mirrored, on the left (−1), shifted in mm and yawed in rad, with this motion of the wheelset.
fn moving([shift, yaw]: [f64; 2], side: f64, wheelset: &Value) -> Value {
    let mut case = generated();
    case["motion"] = json!({ "wheelset": { "speed_mm_per_s": SPEED } });
    let members = case["motion"]["wheelset"].as_object_mut();
    let given = wheelset.as_object().expect("members").clone();
    members.expect("an object").extend(given);
    let name = if side > 0.0 { "right" } else { "left" };
    let place = json!({ "lateral_shift_mm": side * shift, "yaw_rad": side * yaw, "side": name });
    put(&case, "contact", place)
}

fn answer(place: [f64; 2], side: f64, wheelset: &Value) -> Solution {
    solve(&moving(place, side, wheelset)).0
}

#[test]
fn the_lateral_force_of_a_lateral_velocity_gives_the_velocity_back() {
    // Tread without and with yaw, gauge corner and flange with yaw.
    for (place, velocity) in [
        ([0.0, 0.0], 12.0),
        ([0.0, 0.006], 100.0),
        ([-6.45, -0.02], -380.0),
    ] {
        let free =
            json!({ "free_rolling_radius_mm": 460.0, "lateral_velocity_mm_per_s": velocity });
        let given = answer(place, 1.0, &free);
        assert!(given.lateral_velocity_mm_per_s.is_none());
        let force = given.total[0].force_y_n;
        let asked = json!({ "free_rolling_radius_mm": 460.0, "force_y_n": force });
        let found = answer(place, 1.0, &asked);
        let own = found.total[0].force_y_n;
        assert!(
            (own - force).abs() < 2e-3 * LIMIT,
            "{place:?}: {own} {force}"
        );
        let lateral = found.lateral_velocity_mm_per_s.expect("was found");
        let off = (lateral - velocity).abs() / SPEED;
        assert!(off < 5e-5, "{place:?}: {lateral} {velocity}");
        assert!(found.angular_velocity_rad_per_s.is_none());
        assert_eq!(found.patches.len(), given.patches.len());
        // The creepage along x is that of the given angular velocity, and all forces balance the load.
        let along = |solution: &Solution| solution.patches[0].points[0].motion.creepage_x;
        assert!((along(&found) - along(&given)).abs() < 1e-5);
        let vertical = found.total[0].force_z_n.expect("profiles");
        assert!((vertical / 75_000.0 + 1.0).abs() < 1e-3, "{vertical}");
    }
}

#[test]
fn a_mirrored_wheelset_needs_the_mirrored_lateral_velocity() {
    let of = |side: f64| {
        let wheelset = json!({ "free_rolling_radius_mm": 461.0, "force_y_n": -15_000.0 * side });
        let found = answer([-5.5, 0.004], side, &wheelset);
        assert!((found.total[0].force_y_n + 15_000.0 * side).abs() < 2e-3 * LIMIT);
        found.lateral_velocity_mm_per_s.expect("was found") * side
    };
    let [right, left] = [of(1.0), of(-1.0)];
    assert!((right - left).abs() < 5e-5 * SPEED, "{right} {left}");
}

#[test]
fn both_forces_give_both_velocities_back() {
    for (place, turning, velocity) in [([0.0, 0.004], 43.42, 100.0), ([-6.45, -0.02], 43.3, -395.0)]
    {
        let free =
            json!({ "angular_velocity_rad_per_s": turning, "lateral_velocity_mm_per_s": velocity });
        let given = answer(place, 1.0, &free);
        let [along, across] = [given.total[0].force_x_n, given.total[0].force_y_n];
        let asked = json!({ "force_x_n": along, "force_y_n": across });
        let found = answer(place, 1.0, &asked);
        let own = found.total[0];
        let missed = (own.force_x_n - along).hypot(own.force_y_n - across);
        assert!(missed < 3e-3 * LIMIT, "{place:?}: {missed}");
        let lateral = found.lateral_velocity_mm_per_s.expect("was found");
        let angular = found.angular_velocity_rad_per_s.expect("was found");
        let off = [(lateral - velocity) / SPEED, angular / turning - 1.0];
        assert!(
            off[0].hypot(off[1]) < 1e-4,
            "{place:?}: {lateral} {angular}"
        );
    }
}

#[test]
fn without_yaw_the_lateral_force_needs_the_lateral_creepage_that_a_case_by_creepages_finds() {
    let by_velocity = answer(
        [0.0, 0.0],
        1.0,
        &json!({ "free_rolling_radius_mm": 460.0, "force_y_n": 4000.0 }),
    );
    let motion = by_velocity.patches[0].points[0].motion;
    let mut case = moving([0.0, 0.0], 1.0, &json!({}));
    case["motion"] = json!({ "creepage_x": motion.creepage_x, "force_y_n": 4000.0, "spin_per_mm": motion.spin_per_mm });
    let by_creepage = solve(&case).0.patches[0].points[0].motion;
    let off = (motion.creepage_y - by_creepage.creepage_y).abs();
    assert!(off < 5e-5, "{motion:?} {by_creepage:?}");
}

#[test]
fn lateral_forces_that_a_wheelset_cannot_have_are_refused_by_name() {
    let pointer = "/motion/wheelset/force_y_n";
    let radius = 460.0;
    let both = json!({ "free_rolling_radius_mm": radius, "force_y_n": 100, "lateral_velocity_mm_per_s": 0 });
    let both = moving([0.0; 2], 1.0, &both);
    assert_fault(
        &both,
        pointer,
        &["lateral_velocity_mm_per_s", "exactly one"],
    );
    let word = json!({ "free_rolling_radius_mm": radius, "force_y_n": "all" });
    assert_fault(&moving([0.0; 2], 1.0, &word), pointer, &["all"]);
    // The angular velocity of the wheelset is still required.
    assert_fault(
        &moving([0.0; 2], 1.0, &json!({ "force_y_n": 100 })),
        "/motion/wheelset/angular_velocity_rad_per_s",
        &["missing", "force_x_n"],
    );
    let asked = json!({ "free_rolling_radius_mm": radius, "force_y_n": 40_000 });
    let mut falling = moving([0.0; 2], 1.0, &asked);
    let terms = json!([{ "coefficient": 0.2, "half_speed_mm_per_s": 300 }]);
    falling["friction"] = json!({ "law": "exponential", "limit": 0.1, "terms": terms });
    assert_fault(&falling, pointer, &["falls", "lateral velocities"]);
    let checked = contact::check(&moving([0.0; 2], 1.0, &asked), &Limits::default());
    let checked = checked.expect("valid before the range is known");
    let Err(SolveError::NormalProblem { reason }) = contact::solve(&checked, &Unmonitored) else {
        panic!("the force exceeds what the rail can carry")
    };
    assert!(reason.contains("force_y_n of 40000 N"), "{reason}");
    assert!(reason.contains(" N to "), "{reason}");
}
