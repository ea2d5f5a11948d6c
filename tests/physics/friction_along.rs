//! Tests of friction that varies along the track during a history.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::solution::words::answer::{PointSolution, Solution};
use serde_json::{Value, json};

use crate::cases::{assert_fault, with};
use crate::reference::{Ellipse, solve};

const NORMAL: f64 = 60_000.0;
const LIMIT: f64 = 0.3 * NORMAL;

/// Returns half the length of the patch in mm.
fn half_length(case: &Value) -> f64 {
    case["contact"]["a_mm"].as_f64().unwrap()
}

/// Returns a history of one motion in dimensionless creepages over these distances, in half-lengths of the patch, with this friction.
fn history(creepages: [f64; 3], distances: &[f64], friction: impl Fn(f64) -> Value) -> Value {
    let [x, y, spin] = creepages;
    let steady = Ellipse::steel(1.5, 0.28).normalised(x, y, spin);
    let mut case = steady.case(10, 20);
    let a = half_length(&case);
    let motion = case["motion"].take();
    let mut rolled = json!({ "distance_mm": distances.iter().map(|q| q * a).collect::<Vec<_>>() });
    for (name, value) in motion.as_object().unwrap() {
        rolled[name] = value.clone();
    }
    case["motion"] = json!({ "history": rolled });
    case["friction"] = friction(a);
    case
}

/// Returns a table of coefficients at places in half-lengths of the patch.
fn along(a: f64, x: &[f64], coefficient: &[f64]) -> Value {
    let x: Vec<f64> = x.iter().map(|x| x * a).collect();
    json!({ "along": { "x_mm": x, "coefficient": coefficient } })
}

fn points(case: &Value) -> Vec<PointSolution> {
    let (solution, _): (Solution, _) = solve(case);
    solution.patches[0].points.clone()
}

/// Returns the forces over μN with μ = 0.3.
fn forces(point: &PointSolution) -> [f64; 2] {
    [point.force_x_n / LIMIT, point.force_y_n / LIMIT]
}

fn apart(a: &PointSolution, b: &PointSolution) -> f64 {
    let (a, b) = (forces(a), forces(b));
    (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
}

/// Returns the share of an ellipse's load behind x, in half-lengths: the integral of 3/4 (1 − x²).
fn behind(x: f64) -> f64 {
    let x = x.clamp(-1.0, 1.0);
    0.25 * (2.0 + 3.0 * x - x * x * x)
}

#[test]
fn an_even_table_has_the_forces_of_its_coefficient_and_so_has_a_jump_that_is_not_reached() {
    let distances = [0.5, 1.0, 2.0, 3.0];
    let motion = [0.7, -0.4, 0.6];
    let plain = points(&history(
        motion,
        &distances,
        |_| json!({ "coefficient": 0.3 }),
    ));
    for (x, mu) in [([0.0, 1.0], [0.3, 0.3]), ([5.0, 5.0], [0.3, 0.1])] {
        let found = points(&history(motion, &distances, |a| along(a, &x, &mu)));
        for (found, plain) in found.iter().zip(&plain) {
            assert!(apart(found, plain) < 1e-9, "{:?}", forces(found));
        }
    }
}

#[test]
fn beyond_a_jump_rolling_becomes_steady_with_the_coefficient_there() {
    let motion = [0.9, 0.3, 0.4];
    let found = points(&history(motion, &[4.0, 12.0], |a| {
        along(a, &[2.0, 2.0], &[0.3, 0.15])
    }));
    let mut steady = Ellipse::steel(1.5, 0.28)
        .normalised(motion[0], motion[1], motion[2])
        .case(10, 20);
    steady["friction"] = json!({ "coefficient": 0.15 });
    let steady = &points(&steady)[0];
    let last = &found[1];
    let estimates = last.error_estimate.unwrap().force_x_n / LIMIT;
    assert!(
        apart(last, steady) < estimates + 0.003,
        "{:?}",
        forces(last)
    );
}

/// Tests full slip: the force is the integral of pressure times coefficient.
#[test]
fn in_full_slip_a_jump_passes_through_the_force_with_the_load_behind_it() {
    let distances = [1.0, 1.3, 1.75, 2.0, 2.4, 2.9, 3.5];
    let found = points(&history([40.0, 0.0, 0.0], &distances, |a| {
        along(a, &[2.0, 2.0], &[0.3, 0.12])
    }));
    for (point, q) in found.iter().zip(distances) {
        let slippery = 1.0 - behind(2.0 - q);
        let force = 1.0 - slippery * (1.0 - 0.12 / 0.3);
        let off = (forces(point)[0].abs() - force).abs();
        assert!(off < 0.003, "{q}: {off}");
        assert_eq!(point.stick_area_mm2, Some(0.0), "{q}");
    }
}

#[test]
fn over_a_long_slope_the_force_in_full_slip_is_that_of_the_middle() {
    let distances = [2.0, 10.0, 20.0];
    let found = points(&history([40.0, 0.0, 0.0], &distances, |a| {
        along(a, &[0.0, 40.0], &[0.3, 0.1])
    }));
    for (point, q) in found.iter().zip(distances) {
        let coefficient = 0.3 - 0.2 * q / 40.0;
        let off = (forces(point)[0].abs() - coefficient / 0.3).abs();
        assert!(off < 0.002, "{q}: {off}");
    }
}

/// Tests that a force below the friction limit of every place is met on both sides of a jump, with a larger creepage where friction is lower.
#[test]
fn a_prescribed_force_is_met_over_a_jump() {
    let mut case = history([0.0, 0.0, 0.0], &[0.0, 9.0, 20.0], |a| {
        along(a, &[11.0, 11.0], &[0.3, 0.15])
    });
    let rolled = case["motion"]["history"].as_object_mut().unwrap();
    rolled.remove("creepage_x");
    rolled.insert("force_x_n".into(), json!(0.3 * LIMIT));
    let found = points(&case);
    for point in &found[1..] {
        assert!((forces(point)[0] - 0.3).abs() < 1e-3, "{:?}", forces(point));
    }
    // Both creepages are those of steady rolling under the same force.
    for (point, coefficient) in found[1..].iter().zip([0.3, 0.15]) {
        let mut steady = case.clone();
        steady["friction"] = json!({ "coefficient": coefficient });
        steady["motion"] = json!({ "force_x_n": 0.3 * LIMIT });
        let steady = points(&steady)[0].motion.creepage_x;
        let off = point.motion.creepage_x / steady - 1.0;
        assert!(off.abs() < 0.03, "{coefficient}: {off}");
    }
}

#[test]
fn what_does_not_go_with_it_is_refused_with_the_member() {
    let case = history([0.7, 0.0, 0.0], &[1.0], |a| {
        along(a, &[0.0, 1.0], &[0.3, 0.2])
    });
    let mut steady = case.clone();
    steady["motion"] = json!({ "creepage_x": 0.001 });
    assert_fault(&steady, "/friction/along", &["/motion/history"]);
    assert_fault(
        &with(&case, "/motion/start", Some(json!("pressed"))),
        "/friction/along",
        &["pressed"],
    );
    assert_fault(
        &with(&case, "/friction/along/x_mm", Some(json!([1.0, 0.0]))),
        "/friction/along/x_mm/1",
        &["0 given after 1"],
    );
    // Two equal places mark a jump, three are a mistake.
    let jump = json!({ "x_mm": [0.0, 1.0, 1.0], "coefficient": [0.3, 0.3, 0.2] });
    let jump = with(&case, "/friction/along", Some(jump));
    assert!(
        contact::check(&jump, &Limits::default()).is_ok(),
        "two equal positions"
    );
    let thrice = json!({ "x_mm": [0.0, 1.0, 1.0, 1.0], "coefficient": [0.3, 0.3, 0.2, 0.1] });
    assert_fault(
        &with(&case, "/friction/along", Some(thrice)),
        "/friction/along/x_mm/3",
        &["1 given three times", "two equal positions"],
    );
    assert_fault(
        &with(&case, "/friction/along/coefficient", Some(json!([0.3]))),
        "/friction/along/coefficient",
        &["2 to 1000"],
    );
    assert_fault(
        &with(&case, "/friction/coefficient", Some(json!(0.3))),
        "/friction/along",
        &["coefficient"],
    );
}
