//! Tests stresses, damage and temperatures over HTTP: the parts equal those of the result, and exist only if requested.

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::results::{number, numbers, path_of};
use crate::server::{Server, example, link};

#[tokio::test]
async fn parts_of_maintenance_say_what_the_result_says() {
    let server = Server::start().await;
    let case = example("maintenance.case.json");
    let job = server.solve(&case).await;
    let (path, point) = (path_of(&job), &job["result"]["patches"][0]["points"][0]);
    let links = job["result"]["links"].as_object().expect("links");
    for part in ["subsurface", "damage", "temperature"] {
        assert_eq!(links[part], format!("{path}/{part}"));
    }
    let stresses = server
        .read(&format!("{path}/subsurface?patch=0&point=0"))
        .await;
    assert_eq!(stresses["worst"], point["subsurface"]["worst"]);
    assert_eq!(stresses["body"], "lower");
    let points = stresses["points"].as_array().expect("points");
    let depths: Vec<f64> = points.iter().map(|p| numbers(&p["at_mm"])[2]).collect();
    assert_eq!(json!(depths), json!([0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0]));
    let worst = number(&stresses["worst"]["von_mises_mpa"]);
    assert!(
        points
            .iter()
            .all(|p| number(&p["von_mises_mpa"]) <= 1.001 * worst)
    );
    let csv = server
        .get(&format!("{path}/subsurface?format=csv"))
        .await
        .text;
    assert_eq!(csv.lines().count(), 8);
    assert!(csv.starts_with("x_mm,y_mm,depth_mm,stress_xx_mpa"));
    let damage = server.read(&format!("{path}/damage")).await;
    assert_eq!(damage["t_gamma"], point["damage"]["t_gamma"]);
    assert_eq!(damage["parameters"], job["result"]["damage_parameters"]);
    assert_eq!(damage["parameters"]["set"], "900a-r8t-1");
    let field = server.read(&format!("{path}/temperature")).await;
    let hottest = numbers(&field["cells"]["temperature_c"])
        .into_iter()
        .fold(0.0, f64::max);
    let known = number(&point["temperature"]["max_c"]);
    assert!(
        hottest <= known && hottest > 0.97 * known,
        "{hottest} {known}"
    );
    let picture = server.get(&format!("{path}/temperature?format=svg")).await;
    assert!(picture.status == 200 && picture.text.contains("temperature"));
}

#[tokio::test]
async fn a_part_that_was_not_asked_for_says_so_and_a_batch_has_columns_for_it() {
    let server = Server::start().await;
    let job = server.solve(&example("hertz-steel.case.json")).await;
    for part in ["subsurface", "damage", "temperature"] {
        let answer = server.get(&format!("{}/{part}", path_of(&job))).await;
        assert_problem(&answer, 404, "output-not-asked", part);
    }
    let mut plain = example("maintenance.case.json");
    let check = server.post("/v1/cases/check", &plain).await.json;
    let batch = server.post("/v1/batches", &json!([plain])).await.json;
    let results = link(&batch, "results");
    let columns = "usfd_depth_nm,archard_depth_nm,wlrm_damage,von_mises_max_mpa,temperature_max_c";
    let table = server
        .get(&format!("{results}?wait=60&format=csv&columns={columns}"))
        .await
        .text;
    let line = table.lines().nth(1).expect("a line");
    let values: Vec<f64> = line
        .split(',')
        .map(|v| v.parse().expect("a number"))
        .collect();
    assert!(
        values.len() == 5 && values.iter().all(|v| *v != 0.0),
        "{line}"
    );
    for member in ["subsurface", "damage", "thermal"] {
        plain.as_object_mut().expect("a case").remove(member);
    }
    plain["outputs"] = json!(["resultants"]);
    let bare = server.post("/v1/cases/check", &plain).await.json;
    let cost = |check: &Value| number(&check["estimate"]["seconds"]);
    assert!(cost(&check) > cost(&bare), "{check} {bare}");
}
