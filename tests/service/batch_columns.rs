//! Tests results of a batch as a table with selected columns and lines.

use serde_json::{Value, json};

use crate::csv_table::Csv;
use crate::errors::assert_problem;
use crate::results::number;
use crate::server::{Server, example, link};

fn case(file: &str, name: &str, km: &str) -> Value {
    let mut case = example(&format!("{file}.case.json"));
    case["name"] = json!(name);
    case["labels"] = json!({ "km": km });
    case["outputs"] = json!(["resultants", "zones"]);
    case
}

async fn table(server: &Server, path: &str) -> Csv {
    Csv::read(&server.get(path).await.is(200).text)
}

/// Solves a batch. Returns the path of its results, and its results as lines of NDJSON.
async fn solved(server: &Server, cases: &[Value]) -> (String, Vec<Value>) {
    let batch = server.post("/v1/batches", &json!(cases)).await.json;
    let path = link(&batch, "results").to_owned();
    let lines = server.get(&format!("{path}?wait=60")).await.lines();
    assert_eq!(lines.len(), cases.len());
    (path, lines)
}

#[tokio::test]
async fn columns_are_those_asked_for_and_say_what_the_result_says() {
    let server = Server::start().await;
    let mut endless = case("spin", "late", "3");
    endless["solver"]["time_limit_s"] = json!(1e-9);
    let cases = [
        case("hertz-steel", "=a", "1"),
        case("two-patches", "b", "2"),
        endless,
    ];
    let (path, lines) = solved(&server, &cases).await;
    let columns = "label:km,name,area_mm2,pressure_max_mpa,stick_share,friction_limit_n,target_met,saturated,error";
    let path_of_table = format!("{path}?format=csv&columns={columns},name");
    let Csv { head, rows } = table(&server, &path_of_table).await;
    assert_eq!(
        head.join(","),
        columns,
        "a column that is named twice is there once"
    );
    assert_eq!(rows.len(), 3);
    assert_eq!((rows[0][0].as_str(), rows[0][1].as_str()), ("1", "'=a"));
    for (row, line) in rows.iter().zip(&lines).take(2) {
        let patches = line["result"]["patches"].as_array().expect("patches");
        let each = |pointer: &'static str| {
            let of = move |patch: &Value| number(patch.pointer(pointer).expect("a member"));
            patches.iter().map(of)
        };
        let sum = |name| each(name).sum::<f64>();
        let read = |column: usize| row[column].parse::<f64>().expect("a number");
        let expected = [
            sum("/area_mm2"),
            each("/pressure_max_mpa").fold(0.0, f64::max),
            sum("/points/0/stick_area_mm2") / sum("/area_mm2"),
            sum("/friction_limit_n"),
        ];
        for (column, expected) in expected.into_iter().enumerate() {
            assert!(
                (read(2 + column) - expected).abs() <= 1e-12 * expected,
                "{}",
                head[2 + column]
            );
        }
        let met = patches
            .iter()
            .all(|patch| patch["points"][0]["target_met"] == true);
        assert_eq!(
            (row[6].as_str(), row[7].as_str()),
            (met.to_string().as_str(), "false")
        );
    }
    assert_eq!(rows[2][..8], ["3", "late", "", "", "", "", "", ""]);
    assert!(rows[2][8].contains("time"), "{}", rows[2][8]);
}

/// Returns load, area and longitudinal force of each patch, grouped by motion or by position.
fn by_point(result: &Value) -> Vec<Vec<[f64; 3]>> {
    let mut found = vec![Vec::new(); 3];
    let positions = result["wheelset"]["positions"].as_array();
    for (patch_number, patch) in result["patches"].as_array().unwrap().iter().enumerate() {
        let holds = |wheel: &Value| {
            let patches = wheel["patches"].as_array().unwrap();
            patches.contains(&json!(patch_number))
        };
        let position = positions.and_then(|positions| {
            let of = |at: &Value| holds(&at["left"]) || holds(&at["right"]);
            positions.iter().position(of)
        });
        for (place, point) in patch["points"].as_array().unwrap().iter().enumerate() {
            let region = Some(&point["region"]).filter(|region| !region.is_null());
            let region = region.unwrap_or(patch);
            found[position.unwrap_or(place)].push([
                number(&region["normal_force_n"]),
                number(&region["area_mm2"]),
                number(&point["force_x_n"]),
            ]);
        }
    }
    found
}

/// Each motion that changes the pressure, and each position of a wheelset, has its own load in every table.
#[tokio::test]
async fn each_motion_and_each_position_has_its_own_load() {
    let server = Server::start().await;
    let mut wheelset = case("wheelset", "positions", "1");
    wheelset["contact"]["lateral_shift_mm"] = json!({ "values": [-6.0, 0.0, 3.0] });
    let mut pressed = case("wheel-rail", "motions", "2");
    pressed["motion"] =
        json!([{ "creepage_y": -0.01 }, { "creepage_y": 0.0 }, { "creepage_y": 0.01 }]);
    pressed["contact"]["lateral_shift_mm"] = json!(7.0);
    let (path, lines) = solved(&server, &[wheelset, pressed]).await;
    let columns = "index,point,normal_force_n,area_mm2,force_x_n";
    let batch = table(&server, &format!("{path}?format=csv&columns={columns}")).await;
    let by_patch = table(
        &server,
        &format!("{path}?format=csv&columns={columns},patch"),
    )
    .await;
    for (index, line) in lines.iter().enumerate() {
        let expected = by_point(&line["result"]);
        let rows = |table: &Csv| -> Vec<Vec<f64>> {
            let own = table.rows.iter().filter(|row| row[0] == index.to_string());
            own.map(|row| {
                row.iter()
                    .map(|field| field.parse().expect("a number"))
                    .collect()
            })
            .collect()
        };
        let sums = expected
            .iter()
            .map(|parts| parts.iter().map(|part| part[0]).sum::<f64>());
        let sums: Vec<f64> = sums.collect();
        let found = rows(&batch);
        assert_eq!(found.len(), 3);
        for (row, sum) in found.iter().zip(&sums) {
            assert!((row[2] - sum).abs() <= 1e-12 * sum, "{row:?} {sum}");
        }
        let distinct = sums
            .windows(2)
            .all(|pair| (pair[0] - pair[1]).abs() > 1e-3 * pair[0]);
        assert!(distinct, "{sums:?}");
        let single: Vec<Vec<f64>> = rows(&by_patch);
        let each = expected.iter().flatten();
        assert_eq!(single.len(), each.clone().count());
        for (row, part) in single.iter().zip(each) {
            assert_eq!(row[2..5], part[..], "{row:?}");
        }
        let id = line["id"].as_str().expect("an id");
        let job = format!("/v1/jobs/{id}/resultants");
        let csv = table(&server, &format!("{job}?format=csv")).await;
        let place = |name: &str| {
            csv.head
                .iter()
                .position(|head| head == name)
                .expect("a column")
        };
        let totals = csv.rows.iter().filter(|row| row[place("patch")] == "total");
        let totals: Vec<f64> = totals
            .map(|row| row[place("normal_force_n")].parse().unwrap())
            .collect();
        assert_eq!(totals.len(), 3);
        for (total, sum) in totals.iter().zip(&sums) {
            assert!((total - sum).abs() <= 1e-12 * sum, "{totals:?} {sums:?}");
        }
        let second = server.get(&format!("{job}?point=1")).await.json;
        let patches = second["patches"].as_array().expect("patches");
        assert_eq!(patches.len(), expected[1].len());
        for (patch, part) in patches.iter().zip(&expected[1]) {
            assert_eq!(
                (
                    number(&patch["points"][0]["normal_force_n"]),
                    patch["points"][0]["point"].as_i64()
                ),
                (part[0], Some(1))
            );
        }
    }
}

#[tokio::test]
async fn without_columns_there_are_the_usual_ones_and_unknown_ones_are_refused() {
    let server = Server::start().await;
    let (path, _) = solved(&server, &[case("spin", "a", "1")]).await;
    let table = table(&server, &format!("{path}?format=csv")).await;
    for name in ["area_mm2", "pressure_max_mpa", "target_met"] {
        assert_eq!(table.column(name).len(), 1);
    }
    for (query, word) in [
        ("format=csv&columns=colour", "columns"),
        ("columns=index", "columns"),
        ("state=done", "state"),
        ("after=1", "after"),
    ] {
        let answer = server.get(&format!("{path}?{query}")).await;
        assert_problem(&answer, 400, "bad-query", word);
    }
}

#[tokio::test]
async fn a_table_by_patch_has_the_forces_of_each_in_track_axes() {
    let server = Server::start().await;
    let (path, lines) = solved(&server, &[case("wheel-rail-flange", "curve", "1")]).await;
    let columns = "patch,normal_force_n,force_x_n,contact_angle_rad,rolling_radius_mm,force_track_y_n,force_track_z_n";
    let Csv { rows, .. } = table(&server, &format!("{path}?format=csv&columns={columns}")).await;
    let result = &lines[0]["result"];
    let patches = result["patches"].as_array().expect("patches");
    assert!(patches.len() > 1 && rows.len() == patches.len());
    let mut sums = [0.0; 3];
    for (row, patch) in rows.iter().zip(patches) {
        let row: Vec<f64> = row
            .iter()
            .map(|value| value.parse().expect("a number"))
            .collect();
        assert_eq!(row[1], number(&patch["normal_force_n"]));
        assert_eq!(row[3], number(&patch["position"]["contact_angle_rad"]));
        assert_eq!(row[4], number(&patch["position"]["rolling_radius_mm"]));
        for (sum, column) in sums.iter_mut().zip([2, 5, 6]) {
            *sum += row[column];
        }
    }
    let total = &result["total"][0];
    for (sum, name) in sums
        .into_iter()
        .zip(["force_x_n", "force_y_n", "force_z_n"])
    {
        let expected = number(&total[name]);
        assert!(
            (sum - expected).abs() < 1e-6 * expected.abs().max(1e3),
            "{name}: {sum}, not {expected}"
        );
    }
}

#[tokio::test]
async fn lines_are_chosen_by_state_and_go_on_after_the_last_one_read() {
    let server = Server::start().await;
    let mut cases: Vec<Value> = (0..7)
        .map(|km| case("spin", "good", &km.to_string()))
        .collect();
    for (number, case) in cases.iter_mut().enumerate() {
        case["load"]["normal_force_n"] = json!(50_000 + number);
        if number % 3 == 1 {
            case["solver"]["time_limit_s"] = json!(1e-9);
        }
    }
    let (path, lines) = solved(&server, &cases).await;
    let indices = async |query: &str| {
        let lines = server.get(&format!("{path}?{query}")).await.lines();
        lines
            .iter()
            .map(|line| line["index"].as_u64().expect("an index"))
            .collect::<Vec<_>>()
    };
    assert_eq!(indices("state=failed").await, [1, 4]);
    assert_eq!(indices("state=succeeded&wait=1").await, [0, 2, 3, 5, 6]);
    assert_eq!(
        indices("state=failed&state=succeeded").await,
        [0, 1, 2, 3, 4, 5, 6]
    );
    assert_eq!(indices("state=queued").await, [0; 0]);
    let third = lines[2]["id"].as_str().expect("an id");
    assert_eq!(indices(&format!("after={third}")).await, [3, 4, 5, 6]);
    assert_eq!(indices(&format!("after={third}&state=failed")).await, [4]);
}
