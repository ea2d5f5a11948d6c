//! Tests of transient rolling of a wheel on a rail in a fixed position: every patch has its own history of the same creepages.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::solution::words::answer::{PatchSolution, PointSolution, Solution, Total};
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_cases::{generated, on_planes, put};
use crate::reference::{assert_none, solve};

const MU: f64 = 0.3;
const CREEPAGES: [f64; 3] = [0.0015, -0.001, 2e-4];

/// Returns a wheel with load on the gauge corner and on the flange, which touches ahead because the wheelset is yawed.
fn two_patches() -> Value {
    let place = json!({ "lateral_shift_mm": -6.45, "yaw_rad": -0.02 });
    let mut case = put(&generated(), "contact", place);
    case["load"] = json!({ "normal_force_n": 75_000 });
    case
}

fn rolled(distances: &[f64], creepages: [f64; 3]) -> Value {
    let [x, y, spin] = creepages;
    json!({ "history": { "distance_mm": distances, "creepage_x": x, "creepage_y": y, "spin_per_mm": spin } })
}

fn moving(case: &Value, motion: Value) -> Solution {
    let mut case = case.clone();
    case["motion"] = motion;
    solve(&case).0
}

/// Returns the rear and front end of a patch along the track in mm.
fn ends(patch: &PatchSolution) -> [f64; 2] {
    let origin = patch.position.as_ref().expect("profiles").origin_track_mm[0];
    [0, 1].map(|k| origin + patch.extent_mm[k])
}

/// Also tests the curve with factors for its curvature, where tractions change the pressures of steady rolling but not those of a history.
#[test]
fn every_patch_ends_in_steady_rolling() {
    let mut failures = Vec::new();
    let surfaces = |case: Value| {
        let half_space = json!({ "influence": "half_space" });
        [
            on_planes(&case),
            put(&case, "contact", half_space),
            put(&case, "contact", json!({ "reference_surface": "curve" })),
        ]
    };
    for mut case in [generated(), two_patches()].into_iter().flat_map(surfaces) {
        case["load"] = json!({ "normal_force_n": 75_000 });
        let [x, y, spin] = CREEPAGES;
        let steady = moving(
            &case,
            json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin }),
        );
        let longest = steady
            .patches
            .iter()
            .map(|p| p.extent_mm[1] - p.extent_mm[0]);
        let length = longest.fold(0.0, f64::max);
        let rolled = moving(&case, rolled(&[0.2 * length, 5.0 * length], CREEPAGES));
        assert_eq!(rolled.patches.len(), steady.patches.len());
        for (k, (patch, known)) in rolled.patches.iter().zip(&steady.patches).enumerate() {
            let ([early, late], [known]) = (&patch.points[..], &known.points[..]) else {
                panic!("two points and one")
            };
            let limit = MU * patch.normal_force_n;
            let error = |point: &PointSolution| {
                let error = point.error_estimate.expect("an estimate");
                [error.force_x_n, error.force_y_n]
            };
            let (own, other) = (error(late), error(known));
            let off = [
                late.force_x_n - known.force_x_n,
                late.force_y_n - known.force_y_n,
            ];
            if (0..2).any(|i| off[i].abs() > own[i] + other[i]) {
                failures.push(format!(
                    "patch {k}: {off:?} of {limit}, {own:?} and {other:?}"
                ));
            }
            // The early point is not yet steady.
            assert!(early.force_x_n.abs() < 0.7 * late.force_x_n.abs(), "{k}");
            let taken = |k: usize| patch.points[k].history.expect("a history").dissipated_n_mm;
            assert!(0.0 <= taken(0) && taken(0) < taken(1));
        }
    }
    assert_none("not steady", &failures);
}

#[test]
fn totals_are_sums_in_track_axes_at_every_distance() {
    let solution = moving(&two_patches(), rolled(&[1.0, 4.0, 9.0], CREEPAGES));
    assert!(solution.patches.len() > 1, "gauge corner and flange");
    assert_eq!(solution.total.len(), 3);
    for (k, total) in solution.total.iter().enumerate() {
        let found = [
            total.force_x_n,
            total.force_y_n,
            total.force_z_n.expect("profiles"),
        ];
        for (axis, found) in found.into_iter().enumerate() {
            let force =
                |patch: &PatchSolution| patch.points[k].force_track_n.expect("profiles")[axis];
            let sum: f64 = solution.patches.iter().map(force).sum();
            assert!((sum - found).abs() < 1e-6 * 75e3, "{axis}: {sum} {found}");
        }
    }
}

/// Tests that the pressures of a history belong to its last point. There the forces are those of steady rolling. Before it, friction carries less.
#[test]
fn a_vertical_force_is_met_at_the_last_point_and_a_remark_tells_of_the_others() {
    let mut case = two_patches();
    case["load"] = json!({ "vertical_force_n": 75_000 });
    for case in [on_planes(&case), case] {
        let [x, y, spin] = CREEPAGES;
        let motion = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
        let steady = moving(&case, motion).total[0];
        // Nothing is displaced at distance 0.
        let solution = moving(&case, rolled(&[0.0, 60.0], CREEPAGES));
        let code = "pressures-of-last-point";
        assert!(solution.remarks.iter().any(|remark| remark.code == code));
        let vertical = |total: &Total| total.force_z_n.expect("profiles");
        let [still, rolling] = [&solution.total[0], &solution.total[1]];
        assert!(
            (vertical(rolling) / -75e3 - 1.0).abs() < 1e-3,
            "{rolling:?}"
        );
        assert!((vertical(still) / -75e3 - 1.0).abs() > 0.01, "{still:?}");
        for (own, known) in [
            (rolling.force_x_n, steady.force_x_n),
            (rolling.force_y_n, steady.force_y_n),
        ] {
            assert!(
                (own - known).abs() < 0.01 * MU * 75e3,
                "{rolling:?} {steady:?}"
            );
        }
    }
}

/// Tests full slip: each patch carries the friction limit of its place on the track, and the patches of a yawed wheel reach a wet place one after
/// the other.
#[test]
fn patches_reach_a_jump_of_friction_where_they_are() {
    let mut case = two_patches();
    let mut still = moving(&case, json!({ "creepage_x": 0.2 }));
    still
        .patches
        .sort_by(|a, b| ends(a)[0].total_cmp(&ends(b)[0]));
    let (behind, ahead) = (&still.patches[0], &still.patches[still.patches.len() - 1]);
    let apart = ends(ahead)[0] - ends(behind)[0];
    assert!(apart > 3.0, "{apart}");
    let jump = 60.0;
    // The distances put every patch just before and just beyond the jump.
    let places = still.patches.iter().flat_map(|patch| {
        let [rear, front] = ends(patch);
        [jump - front - 0.05, jump - rear + 0.05]
    });
    let mut distances: Vec<f64> = places.collect();
    distances.sort_by(f64::total_cmp);
    case["friction"] = json!({ "along": { "x_mm": [jump, jump], "coefficient": [MU, 0.1] } });
    let found = moving(&case, rolled(&distances, [0.2, 0.0, 0.0]));
    assert!(
        found
            .remarks
            .iter()
            .all(|remark| remark.code != "on-planes")
    );
    let mut seen = [0; 2];
    for patch in &found.patches {
        let [rear, front] = ends(patch);
        for (point, q) in patch.points.iter().zip(&distances) {
            let expected = match (q + front < jump, q + rear > jump) {
                (true, _) => MU,
                (_, true) => 0.1,
                _ => continue,
            };
            let found = point.force_x_n.abs() / patch.normal_force_n;
            assert!(
                (found - expected).abs() < 0.003,
                "{found} for {expected} at {q}"
            );
            seen[usize::from(expected < MU)] += 1;
        }
    }
    assert!(seen[0] > 2 && seen[1] > 2, "{seen:?}");
}

#[test]
fn what_does_not_go_with_a_wheel_that_stays_is_refused_by_name() {
    let forced = json!({ "history": { "distance_mm": [0, 5], "force_x_n": 1000 } });
    let mut case = generated();
    case["motion"] = forced;
    assert_fault(
        &case,
        "/motion/history/force_x_n",
        &["profiles", "creepage_x"],
    );
    case["motion"] = json!({ "history": { "distance_mm": [5], "force_y_n": 1000 } });
    assert_fault(
        &case,
        "/motion/history/force_y_n",
        &["profiles", "creepage_x"],
    );
    let mut pressed = rolled(&[0.0, 5.0], CREEPAGES);
    pressed["start"] = json!("pressed");
    case["motion"] = pressed;
    assert_fault(&case, "/motion/start", &["similar"]);
}

/// Tests that a history longer than the solver allows is refused once the patches are known.
#[test]
fn a_history_with_too_many_steps_is_refused() {
    let mut case = generated();
    case["motion"] = rolled(&[0.0, 1e7], CREEPAGES);
    let case = contact::check(&case, &Limits::default()).expect("a good case");
    let error = contact::solve(&case, &contact::monitor::Unmonitored).unwrap_err();
    assert!(error.to_string().contains("steps"), "{error}");
}
