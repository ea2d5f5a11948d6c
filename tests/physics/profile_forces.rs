//! Tests of longitudinal and lateral forces prescribed under a wheel on a rail. The solver finds creepages or angular velocity, with the wheel in
//! equilibrium under its load.

use std::time::Instant;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_cases::{generated, put};
use crate::random::Random;
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
        let missed = (found.total[0].force_x_n - force).abs() / LIMIT;
        assert!(missed < 6e-4, "{missed}");
        let creepage = found.patches[0].points[0].motion.creepage_x;
        assert!((creepage / x - 1.0).abs() < 0.01, "{creepage} {x}");
        assert!(found.angular_velocity_rad_per_s.is_none());
        // Both components together balance the load.
        let vertical = found.total[0].force_z_n.expect("profiles");
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
    // A driven wheel turns faster, and its forces push the rail backward.
    let driven = of(json!({ "force_x_n": -8000 }));
    let braked = of(json!({ "force_x_n": 8000 }));
    let [fast, slow] =
        [&driven, &braked].map(|found| found.angular_velocity_rad_per_s.expect("was found"));
    assert!(fast > slow, "{fast} {slow}");
    assert!((driven.total[0].force_x_n + 8000.0).abs() < 1e-3 * LIMIT);
}

#[test]
fn forces_that_a_wheel_cannot_have_are_refused_by_name() {
    for name in ["force_x_n", "force_y_n"] {
        let several = json!([{ name: 100 }, { "creepage_x": 0.001 }]);
        assert_fault(
            &moving(several),
            &format!("/motion/0/{name}"),
            &["one motion"],
        );
    }
    let both = json!({ "wheelset": { "speed_mm_per_s": 1e4, "force_x_n": 100, "free_rolling_radius_mm": 460 } });
    assert_fault(
        &moving(both),
        "/motion/wheelset/force_x_n",
        &["free_rolling_radius_mm"],
    );
    let reason = refusal(&moving(json!({ "force_x_n": 30_000 })));
    assert!(
        reason.contains("30000 N") && reason.contains("22"),
        "{reason}"
    );
}

/// Returns the reason why a case that passes the checks has no answer.
fn refusal(case: &Value) -> String {
    let checked =
        contact::check(case, &Limits::default()).expect("valid before the normal force is known");
    let Err(SolveError::NormalProblem { reason }) = contact::solve(&checked, &Unmonitored) else {
        panic!("the force exceeds what the rail can carry")
    };
    reason
}

/// Returns the same position of the wheel on the right rail (1) or, mirrored, on the left (−1).
fn at_shift(shift: f64, side: f64, motion: Value) -> Value {
    let name = if side > 0.0 { "right" } else { "left" };
    put(
        &moving(motion),
        "contact",
        json!({ "lateral_shift_mm": side * shift, "side": name }),
    )
}

#[test]
fn the_lateral_force_of_a_creepage_gives_the_creepage_back() {
    // Tread, gauge corner, and tread with flange.
    for (shift, y) in [
        (0.0, -0.0015),
        (0.0, 0.0004),
        (-5.5, 0.001),
        (-6.45, -0.0008),
    ] {
        let free = json!({ "creepage_x": 0.0005, "creepage_y": y, "spin_per_mm": 0.0001 });
        let given = answer(&at_shift(shift, 1.0, free));
        let force = given.total[0].force_y_n;
        let asked = json!({ "creepage_x": 0.0005, "force_y_n": force, "spin_per_mm": 0.0001 });
        let found = answer(&at_shift(shift, 1.0, asked));
        let own = found.total[0].force_y_n;
        assert!((own - force).abs() < 2e-3 * LIMIT, "{shift}: {own} {force}");
        assert_eq!(found.patches.len(), given.patches.len());
        let creepage = found.patches[0].points[0].motion.creepage_y;
        assert!((creepage / y - 1.0).abs() < 0.02, "{shift}: {creepage} {y}");
        // The other creepage is unchanged, and all forces balance the load.
        assert_eq!(found.patches[0].points[0].motion.creepage_x, 0.0005);
        let vertical = found.total[0].force_z_n.expect("profiles");
        assert!((vertical / 75_000.0 + 1.0).abs() < 1e-3, "{vertical}");
    }
}

#[test]
fn a_mirrored_wheel_needs_the_mirrored_lateral_creepage() {
    let of = |side: f64| {
        let motion = json!({ "force_y_n": -20_000.0 * side, "creepage_x": 0.0, "spin_per_mm": 0.0002 * side });
        let found = answer(&at_shift(-5.5, side, motion));
        assert!((found.total[0].force_y_n + 20_000.0 * side).abs() < 2e-3 * LIMIT);
        found.patches[0].points[0].motion.creepage_y * side
    };
    let [right, left] = [of(1.0), of(-1.0)];
    assert!((right / left - 1.0).abs() < 0.02, "{right} {left}");
}

#[test]
fn a_lateral_force_is_found_up_to_full_slip_and_refused_beyond() {
    // In full slip, friction adds its angle to that of the contact: V tan(α ± φ) if all patches have the same angle.
    let still = answer(&moving(json!({ "creepage_y": 0.0 })));
    let position = still.patches[0].position.as_ref().expect("profiles");
    let angle = position.contact_angle_rad;
    for side in [-1.0, 1.0] {
        let most = 75_000.0 * (angle + side * f64::atan(0.3)).tan();
        let slipping = answer(&moving(json!({ "creepage_y": 0.2 * side })));
        let force = slipping.total[0].force_y_n;
        assert!((force / most - 1.0).abs() < 0.01, "{force} {most}");
        let near = answer(&moving(json!({ "force_y_n": 0.97 * force })));
        assert!((near.total[0].force_y_n - 0.97 * force).abs() < 2e-3 * LIMIT);
        for part in [1.02, 1.5] {
            let reason = refusal(&moving(json!({ "force_y_n": part * force })));
            let told: Vec<f64> = reason
                .split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect();
            let [asked, least, open] = told[..] else {
                panic!("{reason}")
            };
            assert!(reason.contains("force_y_n"), "{reason}");
            assert_eq!(asked, part * force);
            let end = if side < 0.0 { least } else { open };
            assert!((end / force - 1.0).abs() < 0.01, "{reason}");
        }
    }
}

#[test]
fn without_friction_no_force_is_sought() {
    for motion in [json!({ "force_x_n": 0 }), json!({ "force_y_n": 5000 })] {
        let smooth = put(&moving(motion), "friction", json!({ "coefficient": 0.0 }));
        let reason = refusal(&smooth);
        assert!(reason.contains("without friction"), "{reason}");
    }
}

#[test]
fn both_forces_of_a_motion_give_both_creepages_back() {
    // Tread, nearly sliding, and tread with flange.
    for (shift, x, y) in [
        (0.0, -0.0006, 0.0009),
        (0.0, 0.002, -0.002),
        (-6.45, 0.0005, -0.0008),
    ] {
        let free = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": -0.0001 });
        let given = answer(&at_shift(shift, 1.0, free));
        let [along, across] = [given.total[0].force_x_n, given.total[0].force_y_n];
        let asked = json!({ "force_x_n": along, "force_y_n": across, "spin_per_mm": -0.0001 });
        let found = answer(&at_shift(shift, 1.0, asked));
        let own = found.total[0];
        let missed = (own.force_x_n - along).hypot(own.force_y_n - across);
        assert!(missed < 3e-3 * LIMIT, "{shift}: {missed}");
        assert_eq!(found.patches.len(), given.patches.len());
        let motion = found.patches[0].points[0].motion;
        let off = (motion.creepage_x - x).hypot(motion.creepage_y - y);
        assert!(off < 0.03 * x.hypot(y), "{shift}: {motion:?}");
        let vertical = own.force_z_n.expect("profiles");
        assert!((vertical / 75_000.0 + 1.0).abs() < 1e-3, "{vertical}");
    }
}

#[test]
fn a_force_of_0_along_beside_one_across_is_that_force_alone_where_nothing_drives() {
    let alone = answer(&moving(json!({ "creepage_x": 0.0, "force_y_n": 6000 })));
    let both = answer(&moving(json!({ "force_x_n": 0, "force_y_n": 6000 })));
    let [alone, both] = [alone, both].map(|found| found.patches[0].points[0].motion);
    assert!(
        (both.creepage_y / alone.creepage_y - 1.0).abs() < 0.01,
        "{both:?} {alone:?}"
    );
    assert!(
        both.creepage_x.abs() < 0.01 * both.creepage_y.abs(),
        "{both:?}"
    );
}

#[test]
fn two_forces_that_friction_carries_one_by_one_but_not_together_are_refused() {
    let asked = json!({ "force_x_n": 0.8 * LIMIT, "force_y_n": 0.8 * LIMIT });
    let reason = refusal(&moving(asked));
    assert!(
        reason.contains("force_x_n") && reason.contains("force_y_n"),
        "{reason}"
    );
    assert!(
        reason.contains("together with a longitudinal force"),
        "{reason}"
    );
}

/// Compares the measured and the estimated ratio of the time for prescribed forces to the time for creepages: medians over random motions on tread
/// and flange. `RAILHEAD_PULLS=40 cargo test --locked --test physics -- forces_take --nocapture` prints the ratios for 40 motions.
#[test]
fn forces_take_about_the_time_told_for_them() {
    let named = std::env::var("RAILHEAD_PULLS").ok();
    let count = named.map_or(3, |count| count.parse().expect("a number"));
    for names in [
        &["force_x_n"][..],
        &["force_y_n"],
        &["force_x_n", "force_y_n"],
    ] {
        let mut random = Random(15);
        let mut ratios: Vec<[f64; 2]> = (0..count)
            .map(|_| ratio_of_times(&mut random, names))
            .collect();
        ratios.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let [taken, _] = ratios[ratios.len() / 2];
        let told = ratios[0][1];
        let [least, most] = [ratios[0][0], ratios[ratios.len() - 1][0]];
        println!("{names:?}: {taken:.1} times, {least:.1} to {most:.1}; told {told:.1}");
        assert!(
            (0.25..4.0).contains(&(taken / told)),
            "{names:?}: {ratios:?}"
        );
    }
}

/// Returns the ratios of the time of a random motion by forces to that by creepages: measured and estimated.
fn ratio_of_times(random: &mut Random, names: &[&str]) -> [f64; 2] {
    let [x, y] = [0, 1].map(|_| random.between(-0.002, 0.002));
    let spin = random.between(-2e-4, 2e-4);
    let shift = random.between(-6.45, 0.0);
    let mut motion = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
    let free = at_shift(shift, 1.0, motion.clone());
    let timed = |case: &Value| {
        let checked = contact::check(case, &Limits::default()).expect("a case");
        let began = Instant::now();
        let answer = contact::solve(&checked, &Unmonitored).expect("attainable forces");
        (
            answer.0,
            began.elapsed().as_secs_f64(),
            checked.cost().seconds,
        )
    };
    let (given, once, told) = timed(&free);
    let members = motion.as_object_mut().expect("an object");
    for name in names {
        let (force, creepage) = match *name {
            "force_x_n" => (given.total[0].force_x_n, "creepage_x"),
            _ => (given.total[0].force_y_n, "creepage_y"),
        };
        members.remove(creepage);
        members.insert((*name).to_owned(), json!(force));
    }
    let (_, sought, told_sought) = timed(&at_shift(shift, 1.0, motion));
    [sought / once, told_sought / told]
}
