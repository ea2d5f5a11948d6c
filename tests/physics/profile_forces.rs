//! A longitudinal force prescribed under a wheel on a rail: its creepage or angular velocity is found, with the wheel at rest under its load.

use railhead::contact;
use railhead::contact::case::limits::Limits;
use railhead::contact::error::SolveError;
use railhead::contact::monitor::Unmonitored;
use railhead::contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_cases::{generated, put};
use crate::reference::solve;

const LIMIT: f64 = 0.3 * 75_000.0;

fn moving(motion: Value) -> Value {
    let mut case = generated();
    case["motion"] = motion;
    case
}

fn answer(case: &Value) -> Solution {
    solve(case).0
}

#[test]
fn the_force_of_a_creepage_gives_the_creepage_back() {
    for x in [-0.0012, 0.0004] {
        let motion = json!({ "creepage_x": x, "creepage_y": 0.0005, "spin_per_mm": 0.0001 });
        let force = answer(&moving(motion)).total[0].force_x_n;
        let asked = json!({ "force_x_n": force, "creepage_y": 0.0005, "spin_per_mm": 0.0001 });
        let found = answer(&moving(asked));
        assert!((found.total[0].force_x_n - force).abs() < 6e-4 * LIMIT);
        let creepage = found.patches[0].points[0].motion.creepage_x;
        assert!((creepage / x - 1.0).abs() < 0.01, "{creepage} {x}");
        assert!(found.angular_velocity_rad_per_s.is_none());
        // Both components together still balance the load.
        let vertical = found.total[0].force_z_n.expect("of profiles");
        assert!((vertical / 75_000.0 + 1.0).abs() < 1e-3, "{vertical}");
    }
}

#[test]
fn a_wheelset_turns_as_fast_as_the_force_of_two_patches_needs() {
    let place = json!({ "lateral_shift_mm": -6.45, "yaw_rad": -0.02 });
    let of = |wheelset: Value| {
        let mut motion = json!({ "speed_mm_per_s": 20_000.0 });
        let members = motion.as_object_mut().expect("an object");
        members.extend(wheelset.as_object().expect("members").clone());
        answer(&put(
            &moving(json!({ "wheelset": motion })),
            "contact",
            place.clone(),
        ))
    };
    let given = of(json!({ "angular_velocity_rad_per_s": 43.3 }));
    assert!(given.patches.len() > 1, "gauge corner and flange");
    let force = given.total[0].force_x_n;
    assert!(force.abs() < 0.9 * LIMIT, "{force}");
    let found = of(json!({ "force_x_n": force }));
    assert!((found.total[0].force_x_n - force).abs() < 1e-3 * LIMIT);
    let turning = found.angular_velocity_rad_per_s.expect("was found");
    assert!((turning / 43.3 - 1.0).abs() < 2e-5, "{turning}");
    // A driven wheel turns faster, and its forces drive the rail back.
    let driven = of(json!({ "force_x_n": -8000 }));
    let braked = of(json!({ "force_x_n": 8000 }));
    let [fast, slow] =
        [&driven, &braked].map(|found| found.angular_velocity_rad_per_s.expect("was found"));
    assert!(fast > slow, "{fast} {slow}");
    assert!((driven.total[0].force_x_n + 8000.0).abs() < 1e-3 * LIMIT);
}

#[test]
fn forces_that_a_wheel_cannot_have_are_refused_by_name() {
    assert_fault(
        &moving(json!({ "force_y_n": 100 })),
        "/motion/force_y_n",
        &["profiles", "creepage_y"],
    );
    let several = json!([{ "force_x_n": 100 }, { "creepage_x": 0.001 }]);
    assert_fault(&moving(several), "/motion/0/force_x_n", &["one motion"]);
    let both = json!({ "wheelset": { "speed_mm_per_s": 1e4, "force_x_n": 100, "free_rolling_radius_mm": 460 } });
    assert_fault(
        &moving(both),
        "/motion/wheelset/force_x_n",
        &["free_rolling_radius_mm"],
    );
    let too_much = moving(json!({ "force_x_n": 30_000 }));
    let checked =
        contact::check(&too_much, &Limits::default()).expect("the normal force is not known yet");
    let Err(SolveError::NormalProblem { reason }) = contact::solve(&checked, &Unmonitored) else {
        panic!("friction does not carry it")
    };
    assert!(
        reason.contains("30000 N") && reason.contains("22"),
        "{reason}"
    );
}
