//! Tests of laws for a wheelset on both rails: mirror images, balance, closed forms of the conicity, and agreement with single wheels.

use railhead_contact::solution::words::answer::{Kinematics, Solution, WheelsetAnswer};
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_cases::put;
use crate::profile_shapes::{rail_60e1, s1002};
use crate::reference::solve;

/// Returns a wheelset of S1002 on 60E1 inclined 1:40, placed as the single wheels of these tests.
fn wheelset() -> Value {
    on(
        json!({ "points_mm": rail_60e1() }),
        json!({ "points_mm": s1002() }),
        0.025,
    )
}

fn on(rail: Value, wheel: Value, cant: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "wheelset", "rail": rail, "wheel": wheel, "rolling_radius_mm": 460, "cant_rad": cant,
        },
        "load": { "vertical_force_n": 150_000 },
        "motion": { "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": 460 } },
        "outputs": ["resultants"],
    })
}

fn answer(solution: &Solution) -> &WheelsetAnswer {
    solution.wheelset.as_ref().expect("a wheelset")
}

fn kinematics(case: &Value) -> Kinematics {
    let (solution, _) = solve(case);
    let found = answer(&solution).kinematics.clone();
    *found.expect("kinematics")
}

fn near(a: f64, b: f64, within: f64) {
    assert!((a - b).abs() <= within, "{a} {b} within {within}");
}

#[test]
fn a_mirrored_wheelset_has_its_sides_exchanged() {
    let place = json!({ "lateral_shift_mm": { "values": [3, -3] }, "yaw_rad": { "values": [0.002, -0.002] } });
    let case = put(&wheelset(), "contact", place);
    let (solution, _) = solve(&case);
    let [one, other] = answer(&solution).positions.as_slice() else {
        panic!("two positions")
    };
    near(one.roll_rad, -other.roll_rad, 1e-7);
    near(one.centre_height_mm, other.centre_height_mm, 2e-4);
    near(one.radius_difference_mm, -other.radius_difference_mm, 1e-3);
    // With a shift to the left, the left wheel runs on the larger radius.
    assert!(one.radius_difference_mm > 0.1);
    for (left, right) in [(&one.left, &other.right), (&one.right, &other.left)] {
        assert_eq!(left.patches.len(), right.patches.len());
        near(left.force_x_n, right.force_x_n, 20.0);
        near(left.force_y_n, -right.force_y_n, 20.0);
        near(left.force_z_n, right.force_z_n, 40.0);
        near(left.contact_angle_rad, -right.contact_angle_rad, 1e-4);
        near(left.moment_z_n_mm, -right.moment_z_n_mm, 2e4);
    }
}

/// Tests that motions of a list have the answers of separate cases, together with positions and in a grid of both.
#[test]
fn several_motions_are_those_of_cases_of_their_own() {
    let moving = |radius: f64| json!({ "speed_mm_per_s": 20000, "free_rolling_radius_mm": radius });
    let turning = json!({ "speed_mm_per_s": 30000, "drive_torque_n_mm": 2e6 });
    let motions = [moving(459.0), turning];
    let (shifts, yaw) = ([0.0, 2.0], 0.001);
    let ask = |place: Value, motion: Value| {
        let mut case = put(&wheelset(), "contact", place);
        case["motion"] = json!({ "wheelset": motion });
        let (solution, _) = solve(&case);
        answer(&solution).positions.clone()
    };
    let alone = |k: usize, m: usize| {
        let place = json!({ "lateral_shift_mm": shifts[k], "yaw_rad": yaw });
        ask(place, motions[m].clone()).remove(0)
    };
    let several = json!({ "lateral_shift_mm": { "values": shifts }, "yaw_rad": yaw });
    let together = ask(several.clone(), json!(motions));
    let mut in_grid = several;
    in_grid["combine"] = json!("grid");
    let grid = ask(in_grid, json!(motions));
    assert_eq!([together.len(), grid.len()], [2, 4]);
    for (found, k, m) in [
        (&together[0], 0, 0),
        (&together[1], 1, 1),
        (&grid[1], 0, 1),
        (&grid[2], 1, 0),
    ] {
        let known = alone(k, m);
        near(found.lateral_shift_mm, shifts[k], 0.0);
        near(found.roll_rad, known.roll_rad, 1e-6);
        near(
            found.angular_velocity_rad_per_s,
            known.angular_velocity_rad_per_s,
            1e-3,
        );
        for (found, known) in [(&found.left, &known.left), (&found.right, &known.right)] {
            near(found.force_x_n, known.force_x_n, 60.0);
            near(found.force_y_n, known.force_y_n, 60.0);
        }
    }
}

#[test]
fn faulty_lists_of_motions_are_told() {
    let moving = json!({ "speed_mm_per_s": 20000, "free_rolling_radius_mm": 460 });
    let place = json!({ "lateral_shift_mm": { "values": [0, 1, 2] } });
    let mut case = put(&wheelset(), "contact", place);
    case["motion"] = json!({ "wheelset": [moving, moving] });
    assert_fault(
        &case,
        "/motion/wheelset",
        &["2 motions given for 3 positions"],
    );
    case["motion"] = json!({ "wheelset": [moving, { "speed_mm_per_s": -1, "free_rolling_radius_mm": 460 }, moving] });
    assert_fault(&case, "/motion/wheelset/1/speed_mm_per_s", &["-1"]);
    case["motion"] = json!({ "wheelset": [] });
    assert_fault(&case, "/motion/wheelset", &["an object"]);
}

/// Tests that vertical forces balance the load, that the totals are the sums of both wheels, and that a prescribed torque is balanced.
#[test]
fn a_wheelset_balances_its_load_and_its_torque() {
    let mut case = put(
        &wheelset(),
        "contact",
        json!({ "lateral_shift_mm": 2.0, "yaw_rad": 0.001 }),
    );
    case["load"] = json!({ "vertical_force_n": 120_000, "left_share": 0.6 });
    for torque in [0.0, 5e6, -5e6] {
        case["motion"] =
            json!({ "wheelset": { "speed_mm_per_s": 20000, "drive_torque_n_mm": torque } });
        let (solution, _) = solve(&case);
        let position = &answer(&solution).positions[0];
        near(position.left.force_z_n, -72e3, 72.0);
        near(position.right.force_z_n, -48e3, 48.0);
        let limit = 0.3 * 120e3 * 460.0;
        near(position.drive_torque_n_mm, torque, 1.5e-3 * limit);
        // A driven wheelset pushes the rails backward, and rolls faster than a free one.
        near(
            solution.total[0].force_x_n,
            -torque / 460.0,
            0.01 * 0.3 * 120e3,
        );
        let free = 20000.0 / 460.0;
        let faster = position.angular_velocity_rad_per_s / free - 1.0;
        assert!(torque == 0.0 || faster * torque > 0.0, "{faster} {torque}");
        let sums = [position.left.force_y_n, position.right.force_y_n];
        near(solution.total[0].force_y_n, sums[0] + sums[1], 1e-6);
        let moment = position.left.moment_z_n_mm + position.right.moment_z_n_mm;
        near(solution.total[0].moment_z_n_mm, moment, 1.0);
        let count = position.left.patches.len() + position.right.patches.len();
        assert_eq!(count, solution.patches.len());
    }
}

#[test]
fn a_single_wheel_in_the_place_of_one_of_a_wheelset_has_its_patch() {
    let case = put(
        &wheelset(),
        "contact",
        json!({ "lateral_shift_mm": 1.5, "yaw_rad": 0.002 }),
    );
    let (solution, _) = solve(&case);
    let position = &answer(&solution).positions[0];
    for (side, wheel) in [("left", &position.left), ("right", &position.right)] {
        let mut single = put(
            &case,
            "contact",
            json!({ "type": "profiles", "side": side, "roll_rad": position.roll_rad }),
        );
        single["load"] = json!({ "vertical_force_n": 75_000 });
        let (alone, _) = solve(&single);
        let [patch] = wheel.patches.as_slice() else {
            panic!("one patch")
        };
        let (own, alone) = (&solution.patches[*patch], &alone.patches[0]);
        near(own.area_mm2 / alone.area_mm2, 1.0, 1e-9);
        near(own.points[0].force_x_n, alone.points[0].force_x_n, 1e-6);
        near(
            own.points[0].motion.creepage_y,
            alone.points[0].motion.creepage_y,
            1e-12,
        );
    }
}

fn arc(radius: f64, sign: f64, tilt: f64) -> Value {
    // Heights over y with z down: a convex head or a hollow tread, inclined by the tilt in its middle.
    let depth = |y: f64| sign * (radius - (radius * radius - y * y).sqrt()) - tilt * y;
    let points: Vec<[f64; 2]> = (-100..=100)
        .map(|k| 0.3 * f64::from(k))
        .map(|y| [y, depth(y)])
        .collect();
    json!({ "points_mm": points, "mirror_y": false, "mirror_z": false })
}

fn with_kinematics(mut case: Value) -> Value {
    case["contact"]["kinematics"] =
        json!({ "reach_mm": 5, "step_mm": 0.25, "amplitudes_mm": [1, 3] });
    // The middle of the wheel lies over that of the rail.
    case["contact"]["rail_origin_mm"] = json!(747.5);
    case["contact"]["flange_back_position_mm"] = json!(-67.5);
    case
}

/// Returns the conicity of arcs after Wickens 1965, `λ = δ₀ R_w / (R_w − R_r) · (l + R_r δ₀) / (l − r δ₀)`, with half the distance l of the contacts
/// and the contact angle δ₀ in the middle, and the value without the second factor. For a cone, `R_w` is infinite. The second factor is due to the
/// roll.
fn wickens(slope: f64, rail: f64, wheel: f64, half: f64) -> [f64; 2] {
    let level = slope / (1.0 - rail / wheel);
    [
        level * (half + rail * slope) / (half - 460.0 * slope),
        level,
    ]
}

#[test]
fn a_cone_on_any_crown_has_its_tangent_for_its_conicity() {
    for (tangent, crown) in [(0.05, 300.0), (0.025, 300.0), (0.05, 80.0)] {
        let cone: Vec<[f64; 2]> = (-60..=60)
            .map(f64::from)
            .map(|y| [y, -tangent * y])
            .collect();
        let cone = json!({ "points_mm": cone, "mirror_y": false, "mirror_z": false });
        let found = kinematics(&with_kinematics(on(arc(crown, 1.0, 0.0), cone, 0.0)));
        let [rolled, level] = wickens(
            tangent,
            crown,
            f64::INFINITY,
            0.5 * found.contact_distance_mm,
        );
        for entry in &found.conicity {
            near(entry.conicity.unwrap() / level, 1.0, 1e-3);
            near(entry.conicity_with_roll.unwrap() / rolled, 1.0, 3e-3);
            near(entry.conicity_harmonic.unwrap() / level, 1.0, 1e-3);
            assert_eq!(entry.conicity_without_roll, entry.conicity);
            assert_eq!(entry.reason, None);
            assert!(entry.error_estimate.unwrap() < 1e-3 * tangent, "{entry:?}");
        }
        near(found.equilibrium_shift_mm.unwrap(), 0.0, 1e-6);
        let wavelength = found.conicity[1].wavelength_mm.unwrap();
        let half = 0.5 * found.contact_distance_mm;
        // Klingel's formula.
        let klingel = 2.0 * std::f64::consts::PI * (460.0 * half / level).sqrt();
        near(wavelength / klingel, 1.0, 5e-3);
    }
}

#[test]
fn two_arcs_have_wickens_conicity() {
    let wheel = arc(500.0, 1.0, 0.02);
    let found = kinematics(&with_kinematics(on(arc(300.0, 1.0, 0.0), wheel, 0.0)));
    // The slopes agree at the contact: y/300 on the rail, 0.05 + (y − y₀)/500 on the wheel, with the contact angle that is found.
    let middle = found.lateral_shift_mm.len() / 2;
    let slope = found.left.contact_angle_rad[middle].tan();
    let [rolled, level] = wickens(slope, 300.0, 500.0, 0.5 * found.contact_distance_mm);
    for entry in &found.conicity {
        near(entry.conicity.unwrap() / level, 1.0, 0.01);
        near(entry.conicity_with_roll.unwrap() / rolled, 1.0, 0.01);
    }
}

/// Tests that a wheelset with wheels of different radii moves to the position where both roll on the same radius.
#[test]
fn wheels_that_differ_move_the_equilibrium() {
    let cone: Vec<[f64; 2]> = (-60..=60).map(f64::from).map(|y| [y, -0.05 * y]).collect();
    let cone = json!({ "points_mm": cone, "mirror_y": false, "mirror_z": false });
    let mut case = with_kinematics(on(arc(300.0, 1.0, 0.0), cone, 0.0));
    case["contact"]["right"] = json!({ "rolling_radius_mm": 460.1 });
    let found = kinematics(&case);
    // The left wheel needs 0.1 mm more radius difference: 1 mm of shift at a conicity of 0.05.
    let shift = found.equilibrium_shift_mm.expect("an equilibrium");
    near(shift, 1.0, 1e-3);
}

#[test]
fn the_shipped_wheelset_answers_every_position_and_amplitude() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../api/examples/wheelset.case.json"
    );
    let text = std::fs::read_to_string(path).expect("an example");
    let case: Value = serde_json::from_str(&text).expect("a case");
    let (solution, _) = solve(&case);
    let found = answer(&solution);
    assert_eq!(found.positions.len(), 3);
    assert_eq!(solution.total.len(), 3);
    let kinematics = found.kinematics.as_ref().expect("kinematics");
    for position in &found.positions {
        // The loaded wheels roll where the rigid ones touch, within the width of a patch.
        let shifts = &kinematics.lateral_shift_mm;
        let at = shifts
            .iter()
            .position(|s| (s - position.lateral_shift_mm).abs() < 1e-6);
        let rigid =
            kinematics.radius_difference_with_roll_mm[at.expect("a shift")].expect("a roll");
        near(position.radius_difference_mm, rigid, 0.1);
    }
    assert_eq!(kinematics.conicity.len(), 5);
    for entry in &kinematics.conicity {
        let conicity = entry.conicity.expect("a conicity");
        assert!((0.02..0.6).contains(&conicity), "{entry:?}");
        assert!(
            entry.error_estimate.expect("an estimate") < 0.1 * conicity,
            "{entry:?}"
        );
    }
}
