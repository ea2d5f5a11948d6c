//! Tests the contact of the back of a flange with a guard rail that is part of the rail's section.

use railhead_contact::case::check::check_section;
use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::assert_fault;

/// Radius in mm of the arc at tip and back of the flange. `CENTRE` is the depth of its centre below the tread.
const TIP: f64 = 20.5;
const CENTRE: f64 = 9.519;
/// y of the face of the guard rail in mm.
const FACE: f64 = -77.5;
const ROLLING_RADIUS: f64 = 460.0;
const CANT: f64 = 0.025;

fn solve(case: &Value) -> Solution {
    let checked = check(case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (solution, _) = railhead_contact::solve(&checked, &Unmonitored).unwrap();
    solution
}

/// Returns S1002 on 60E1 next to a guard rail with a straight face. The back of the flange has the same radius as its tip.
fn beside_guard_rail(shift: f64) -> Value {
    let text = include_str!("../../api/examples/guard-rail.case.json");
    let mut case: Value = serde_json::from_str(text).unwrap();
    case["contact"]["lateral_shift_mm"] = json!(shift);
    case["outputs"] = json!(["resultants"]);
    case
}

fn guard_rail() -> Vec<Value> {
    let case = beside_guard_rail(0.0);
    let points = &case["contact"]["rail"]["guard_rail_points_mm"];
    points.as_array().unwrap().clone()
}

/// Returns the gap between the back of the flange and the face of the guard rail: a torus and a plane that is inclined to its axis by the cant.
fn torus_on_plane() -> Value {
    let ring = ROLLING_RADIUS + CENTRE;
    let (sin, cos) = CANT.sin_cos();
    let gap = |x: f64, up: f64| {
        let down = ring + TIP * sin - up * cos;
        let beside = TIP * cos + up * sin;
        (x.hypot(down) - ring).hypot(beside) - TIP
    };
    let axis = |half: f64, count: i32| -> Vec<f64> {
        (-count..=count)
            .map(|k| half * f64::from(k) / f64::from(count))
            .collect()
    };
    let (x, y) = (axis(60.0, 120), axis(5.0, 100));
    let rows = y.iter().map(|y| x.iter().map(|x| gap(*x, *y)).collect());
    let rows: Vec<Vec<f64>> = rows.collect();
    json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": rows })
}

#[test]
fn the_face_of_a_guard_rail_takes_the_back_of_a_flange_and_the_tread_carries_the_wheel() {
    let mut before = 0.0;
    for shift in [4.245, 4.27] {
        let case = beside_guard_rail(shift);
        let solution = solve(&case);
        let [tread, guard] = &solution.patches[..] else {
            panic!("{shift}: {} patches", solution.patches.len());
        };
        let total = solution.total[0].force_z_n.unwrap();
        let load = case["load"]["vertical_force_n"].as_f64().unwrap();
        assert!((total.abs() / load - 1.0).abs() < 1e-3, "{total}");
        let place = guard.position.as_ref().unwrap();
        assert!((place.rail_mm[0] - FACE).abs() < 0.01, "{place:?}");
        assert!(tread.position.as_ref().unwrap().rail_mm[0].abs() < 10.0);
        assert!(guard.normal_force_n > 1.5 * before, "{shift}");
        before = guard.normal_force_n;
        // Compares with the gap of the two surfaces, solved alone under the force on the guard rail.
        let mut alone = case.clone();
        alone["contact"] = torus_on_plane();
        alone["load"] = json!({ "normal_force_n": guard.normal_force_n });
        alone["motion"] = json!({ "creepage_x": 1e-3, "creepage_y": 0.0, "spin_per_mm": 0.0 });
        let alone = &solve(&alone).patches[0];
        let pressure = guard.pressure_max_mpa / alone.pressure_max_mpa - 1.0;
        assert!(pressure.abs() < 0.02, "{shift}: {pressure}");
        let length = |[rear, front, ..]: [f64; 4]| front - rear;
        let longer = length(guard.extent_mm) / length(alone.extent_mm) - 1.0;
        assert!(longer.abs() < 0.03, "{shift}: {longer}");
    }
}

#[test]
fn a_guard_rail_is_part_of_the_section_and_moves_nothing_else() {
    // Without contact on the guard rail, the answer is that of the rail alone: the gauge is measured on the running rail.
    let with = beside_guard_rail(1.0);
    let mut without = with.clone();
    let rail = without["contact"]["rail"].as_object_mut().unwrap();
    rail.remove("guard_rail_points_mm");
    let [with, without] = [with, without].map(|case| solve(&case));
    let limit = without.patches[0].friction_limit_n.unwrap();
    let [a, b] = [&with, &without].map(|solution| solution.total[0]);
    let moved = (a.force_x_n - b.force_x_n).hypot(a.force_y_n - b.force_y_n);
    assert!(moved < 2e-3 * limit, "{moved}");
    // The groove does not count as a hole in the points.
    let rail = &beside_guard_rail(0.0)["contact"]["rail"];
    let report = check_section(rail).unwrap();
    let given = ["points_mm", "guard_rail_points_mm"].map(|name| rail[name].as_array().unwrap());
    assert_eq!(
        report.quality.points as usize,
        given[0].len() + given[1].len()
    );
    assert!(report.quality.hole_mm < 15.0, "{}", report.quality.hole_mm);
    // A single list that includes points of the groove, placed by the origin, gives the same loads.
    let mut one = beside_guard_rail(3.8);
    one["contact"]["rail_origin_mm"] = json!(753.5);
    let mut two = one.clone();
    let rail = one["contact"]["rail"].as_object_mut().unwrap();
    rail.remove("guard_rail_points_mm");
    let groove = (0..=10).map(|k| json!([FACE + 1.0 + 3.9 * f64::from(k), 60.0]));
    let own = rail["points_mm"].as_array().unwrap().clone();
    let points = guard_rail().into_iter().chain(groove).chain(own);
    rail.insert("points_mm".to_owned(), points.collect());
    rail.insert("mirror_z".to_owned(), json!(false));
    two["contact"]["rail_origin_mm"] = json!(753.5);
    let loads = [one, two].map(|case| {
        let patches = solve(&case).patches;
        let loads = patches.iter().map(|patch| patch.normal_force_n);
        loads.collect::<Vec<f64>>()
    });
    assert_eq!(loads[0].len(), 2, "{loads:?}");
    for (one, two) in loads[0].iter().zip(&loads[1]) {
        assert!((one / two - 1.0).abs() < 0.02, "{loads:?}");
    }
}

#[test]
fn guard_rails_have_the_unit_and_the_senses_of_the_rail_and_either_order() {
    let first = solve(&beside_guard_rail(4.25));
    let mut turned = beside_guard_rail(4.25);
    let rail = &mut turned["contact"]["rail"];
    for name in ["points_mm", "guard_rail_points_mm"] {
        let points = rail[name].as_array().unwrap().iter().map(|point| {
            let part = |k: usize| -1e-3 * point[k].as_f64().unwrap();
            json!([part(0), part(1)])
        });
        rail[name] = points.rev().collect();
    }
    rail["unit"] = json!("m");
    rail["mirror_y"] = json!(true);
    rail["mirror_z"] = json!(true);
    let second = solve(&turned);
    for (a, b) in first.patches.iter().zip(&second.patches) {
        let differs = (a.normal_force_n / b.normal_force_n - 1.0).abs();
        assert!(differs < 1e-3, "{differs}");
    }
    assert_eq!(first.patches.len(), second.patches.len());
}

#[test]
fn a_straight_face_that_is_touched_is_no_hole_in_its_points() {
    for load in [
        json!({ "approach_mm": 0.1 }),
        json!({ "normal_force_n": 3000 }),
    ] {
        let mut case = beside_guard_rail(4.25);
        case["load"] = load;
        let solution = solve(&case);
        let place = solution.patches[0].position.as_ref().unwrap();
        assert!((place.rail_mm[0] - FACE).abs() < 0.01, "{place:?}");
    }
}

#[test]
fn kinematics_of_a_wheelset_refuse_a_guard_rail() {
    let mut case = beside_guard_rail(0.0);
    let contact = case["contact"].as_object_mut().unwrap();
    contact.insert("type".to_owned(), json!("wheelset"));
    contact.remove("side");
    contact.insert("kinematics".to_owned(), json!({}));
    assert_fault(&case, "/contact/rail/guard_rail_points_mm", &["kinematics"]);
}

#[test]
fn guard_rails_in_other_places_are_refused() {
    let mut wheel = beside_guard_rail(0.0);
    wheel["contact"]["wheel"]["guard_rail_points_mm"] = json!(guard_rail());
    assert_fault(&wheel, "/contact/wheel/guard_rail_points_mm", &["wheel"]);
    let mut inside = beside_guard_rail(0.0);
    let nearer = |point: Value| json!([point[0].as_f64().unwrap() + 60.0, point[1]]);
    let points = guard_rail().into_iter().map(nearer);
    inside["contact"]["rail"]["guard_rail_points_mm"] = points.collect();
    let place = "/contact/rail/guard_rail_points_mm";
    assert_fault(&inside, place, &["-17.50 mm"]);
    let mut few = beside_guard_rail(0.0);
    few["contact"]["rail"]["guard_rail_points_mm"] = json!([[-80, 0], [-79, 0]]);
    assert_fault(&few, place, &["8 to 20000 points"]);
    let mut long = beside_guard_rail(0.0);
    let points = (0..10).map(|k| json!([-1000.0 + 90.0 * f64::from(k), 0.0]));
    long["contact"]["rail"]["guard_rail_points_mm"] = points.collect();
    assert_fault(&long, place, &["500 mm"]);
}
