//! Tests a wheel on a rail, from the example to the parts of its result.

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
    // The quality of the profiles is reported before the solve and under the patch.
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
