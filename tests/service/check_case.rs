//! Compares the interpretation of a case by `cases/check` with its solution.

use std::time::Duration;

use serde_json::{Value, json};

use crate::results::{number, numbers};
use crate::server::{Server, example};

async fn understood(server: &Server, case: &Value) -> Value {
    let answer = server.post("/v1/cases/check", case).await.is(200);
    answer.json["understood"].clone()
}

/// Returns the corners of a curve.
fn curve(value: &Value) -> Vec<[f64; 2]> {
    let corners = value.as_array().expect("a curve").iter();
    corners
        .map(|corner| <[f64; 2]>::try_from(numbers(corner)).expect("two coordinates"))
        .collect()
}

/// Returns the smallest distance of a point from a curve, in mm.
fn distance(curve: &[[f64; 2]], [y, z]: [f64; 2]) -> f64 {
    let pieces = curve.windows(2).map(|piece| {
        let [from, to] = [piece[0], piece[1]];
        let (dy, dz) = (to[0] - from[0], to[1] - from[1]);
        let along = ((y - from[0]) * dy + (z - from[1]) * dz) / (dy * dy + dz * dz);
        let along = along.clamp(0.0, 1.0);
        (from[0] + along * dy - y).hypot(from[1] + along * dz - z)
    });
    pieces.fold(f64::INFINITY, f64::min)
}

#[tokio::test]
async fn the_patch_that_is_known_beforehand_is_the_one_that_is_solved() {
    let server = Server::start().await;
    for file in [
        "hertz-steel.case.json",
        "spin.case.json",
        "pressure-grid.case.json",
    ] {
        let case = example(file);
        let understood = understood(&server, &case).await;
        let solved = server.solve(&case).await["result"]["patches"][0].take();
        let patch = &understood["patches"][0];
        for name in [
            "normal_force_n",
            "area_mm2",
            "pressure_max_mpa",
            "semi_axes_mm",
            "approach_mm",
            "extent_mm",
        ] {
            assert_eq!(patch[name], solved[name], "{name} of {file}");
        }
        let friction = number(&case["friction"]["coefficient"]);
        let limit = friction * number(&solved["normal_force_n"]);
        assert!((number(&understood["friction_limit_n"]) - limit).abs() < 1e-9 * limit);
        assert!(understood["placement"].is_null());
    }
    let gap = understood(&server, &example("two-patches.case.json")).await;
    assert_eq!(gap["patches"], serde_json::json!([]));
    assert!(gap["friction_limit_n"].is_null());
}

#[tokio::test]
async fn wheel_and_rail_are_placed_where_they_touch_when_solved() {
    let server = Server::start().await;
    for file in ["wheel-rail.case.json", "wheel-rail-flange.case.json"] {
        let case = example(file);
        let checked = server.post("/v1/cases/check", &case).await.is(200).json;
        let placed = &checked["understood"]["placement"];
        let (rail, wheel) = (curve(&placed["rail_mm"]), curve(&placed["wheel_mm"]));
        let touch = &placed["first_touch"];
        let at = numbers(&touch["track_mm"]);
        let off = [
            distance(&rail, [at[1], at[2]]),
            distance(&wheel, [at[1], at[2]]),
        ];
        assert!(
            off[0] < 0.01 && off[1] < 0.05,
            "{file}: {off:?} mm beside the curves"
        );
        // The wheel does not intersect the rail.
        let above = |place: &[f64; 2]| (place[0] - at[1]).abs() < 10.0;
        for place in wheel.iter().filter(|place| above(place)) {
            let beneath = rail
                .iter()
                .min_by(|a, b| (a[0] - place[0]).abs().total_cmp(&(b[0] - place[0]).abs()));
            let [_, z] = *beneath.expect("a rail");
            assert!(
                place[1] > z - 0.3,
                "{file}: {place:?} is below the rail's {z}"
            );
        }
        let solved = server.solve(&case).await["result"].take();
        let patches = solved["patches"].as_array().expect("patches");
        // The quality of the profiles is reported before the solve and under the patch.
        for quality in [&checked["quality"], &patches[0]["quality"]] {
            for side in ["rail", "wheel"] {
                let spacing = &quality[side]["spacing_mm"];
                assert!(spacing.is_number(), "{file}: {side}: {quality}");
            }
        }
        let near = patches.iter().any(|patch| {
            let there = numbers(&patch["position"]["track_mm"]);
            let angle = number(&patch["position"]["contact_angle_rad"]);
            (there[1] - at[1]).hypot(there[2] - at[2]) < 5.0
                && (angle - number(&touch["contact_angle_rad"])).abs() < 0.3
        });
        assert!(
            near,
            "{file}: first touch at {touch}, patches at {patches:?}"
        );
        let lowering = number(&solved["wheel_lowering_mm"]);
        let ratio = number(&placed["lowering_estimate_mm"]) / lowering;
        assert!(
            (0.5..2.0).contains(&ratio),
            "{file}: {ratio} of {lowering} mm"
        );
    }
}

#[tokio::test]
async fn a_solve_that_fails_while_it_is_tried_is_told() {
    let server = Server::with(|setup| setup.http.check_trial = Duration::from_secs(3600)).await;
    let mut case = example("uic60-crown.case.json");
    // The interpenetration is so large that the contact reaches the ends of the samples.
    case["load"] = json!({ "normal_force_n": 1e9 });
    let answer = server.post("/v1/cases/check", &case).await.is(200);
    assert_eq!(
        answer.json["estimate"]["found_by"], "failed_solve",
        "{}",
        answer.json
    );
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "failed", "{job}");
}
