//! A wheel on a rail, from the shipped example to the parts of its result.

use serde_json::json;

use crate::results::{number, path_of};
use crate::server::{Server, count, example};

#[tokio::test]
async fn a_wheel_on_a_rail_is_submitted_and_read() {
    let server = Server::start().await;
    let case = example("wheel-rail.case.json");
    let force = number(&case["load"]["vertical_force_n"]);
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let (path, result) = (path_of(&job), &job["result"]);
    let patch = &result["patches"][0];
    // How far the profiles can be trusted, before the solve and under the patch.
    let checked = server.post("/v1/cases/check", &case).await.json;
    for (quality, name) in [
        (&checked["quality"], "check"),
        (&patch["quality"], "result"),
    ] {
        for side in ["rail", "wheel"] {
            let spacing = &quality[side]["spacing_mm"];
            assert!(spacing.is_number(), "{name}: {side}: {quality}");
        }
    }
    let position = &patch["position"];
    assert_eq!(count(&position["track_mm"]), 3);
    let radius = number(&position["rolling_radius_mm"]);
    let depth = number(&position["wheel_mm"][1]);
    assert!((radius - number(&case["contact"]["rolling_radius_mm"]) - depth).abs() < 1e-9);
    let total = server.read(&format!("{path}/resultants")).await;
    assert_eq!(total["total"], result["total"]);
    assert!((number(&total["total"][0]["force_z_n"]) + force).abs() < 1e-3 * force);
    assert!(number(&result["wheel_lowering_mm"]) > 0.0);
    let cells = server.read(&format!("{path}/pressure?patch=0")).await["cells"].clone();
    let column = |name: &str| -> Vec<f64> {
        let values = cells[name].as_array().expect("a column").iter();
        values.map(number).collect()
    };
    let (pressure, dx, dy) = (column("pressure_mpa"), column("dx_mm"), column("dy_mm"));
    let sum: f64 = (0..dx.len()).map(|k| pressure[k] * dx[k] * dy[k]).sum();
    assert!((sum / number(&patch["normal_force_n"]) - 1.0).abs() < 1e-9);
    let zones = server.get(&format!("{path}/zones")).await;
    assert_eq!(zones.status, 200);
}

#[tokio::test]
async fn gauge_corner_and_flange_are_two_patches_with_their_own_creepages() {
    let server = Server::start().await;
    let job = server.solve(&example("wheel-rail-flange.case.json")).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let patches = job["result"]["patches"].as_array().expect("patches");
    assert_eq!(patches.len(), 2, "{job}");
    let angle = |k: usize| number(&patches[k]["position"]["contact_angle_rad"]).abs();
    let creepage = |k: usize| number(&patches[k]["points"][0]["motion"]["creepage_x"]);
    let (flange, corner) = if angle(0) > angle(1) { (0, 1) } else { (1, 0) };
    assert!(angle(flange) > 1.1 && angle(corner) < 0.6, "{job}");
    // The flange runs on a larger radius than the corner, so that its material moves back.
    assert!(creepage(flange) < creepage(corner) - 0.01, "{job}");
}

#[tokio::test]
async fn a_wheel_steered_by_forces_is_answered_with_its_creepages_or_told_the_range() {
    let server = Server::start().await;
    let mut case = example("wheel-rail.case.json");
    let load = number(&case["load"]["vertical_force_n"]);
    let limit = load * number(&case["friction"]["coefficient"]);
    for motion in [
        json!({ "creepage_x": 0.0, "force_y_n": 0.2 * limit, "spin_per_mm": 0.0 }),
        json!({ "force_x_n": -0.3 * limit, "force_y_n": 0.2 * limit, "spin_per_mm": 0.0 }),
    ] {
        case["motion"] = motion;
        let job = server.solve(&case).await;
        assert_eq!(job["state"], "succeeded", "{job}");
        let (result, asked) = (&job["result"], &case["motion"]);
        for name in ["force_x_n", "force_y_n"] {
            let Some(force) = asked[name].as_f64() else {
                continue;
            };
            let found = number(&result["total"][0][name]);
            assert!((found - force).abs() < 2e-3 * limit, "{name}: {job}");
        }
        let point = &result["patches"][0]["points"][0];
        let (along, across) = (
            &point["motion"]["creepage_x"],
            &point["motion"]["creepage_y"],
        );
        assert!(number(across) > 0.0, "{point}");
        let driven = asked["force_x_n"].is_number();
        assert_eq!(number(along) < 0.0, driven, "{point}");
    }
    case["motion"] = json!({ "wheelset": { "speed_mm_per_s": 2e4, "force_x_n": -0.3 * limit, "force_y_n": 0.2 * limit } });
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "succeeded", "{job}");
    let (result, asked) = (&job["result"], &case["motion"]["wheelset"]);
    for name in ["force_x_n", "force_y_n"] {
        let missed = number(&result["total"][0][name]) - number(&asked[name]);
        assert!(missed.abs() < 2e-3 * limit, "{name}: {job}");
    }
    // Without yaw the lateral creepage is that of the velocity found.
    let point = &result["patches"][0]["points"][0];
    let across = number(&point["motion"]["creepage_y"]);
    let lateral = number(&result["lateral_velocity_mm_per_s"]);
    assert!((lateral / 2e4 - across).abs() < 1e-4, "{job}");
    assert!(number(&result["angular_velocity_rad_per_s"]) > 0.0);
    case["motion"] = json!({ "creepage_x": 0.0, "force_y_n": 2.0 * limit, "spin_per_mm": 0.0 });
    let job = server.solve(&case).await;
    assert_eq!(job["state"], "failed", "{job}");
    let detail = job["error"]["detail"].as_str().expect("a reason");
    assert!(
        detail.contains("force_y_n") && detail.contains(" N to "),
        "{job}"
    );
}

#[tokio::test]
async fn checking_a_wheel_on_a_rail_names_its_cost_and_its_faults() {
    let server = Server::idle().await;
    let mut case = example("wheel-rail.case.json");
    let checked = server.post("/v1/cases/check", &case).await.is(200);
    assert!(number(&checked.json["estimate"]["seconds"]) > 0.0);
    case["contact"]["rail"] = json!({ "format": "columns", "text": "0 0\n1 x\n" });
    case["contact"]["wheel"]["colour"] = json!("red");
    let refused = server.post("/v1/cases/check", &case).await;
    assert_eq!(refused.status, 422);
    let pointers: Vec<&str> = refused.json["errors"]
        .as_array()
        .expect("errors")
        .iter()
        .filter_map(|error| error["pointer"].as_str())
        .collect();
    assert!(
        pointers.contains(&"/contact/wheel/colour"),
        "{}",
        refused.text
    );
}
