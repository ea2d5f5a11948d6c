//! Tests evolutions: submission, events, interruption and results.

use std::time::{Duration, Instant};

use railhead::tables::parquet::TableReader;
use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::runs::ended;
use crate::server::{Server, example};
use crate::support::{Service, pause};

/// Timeout of a test that hangs.
const WITHIN: Duration = Duration::from_secs(240);

/// Returns a request for the example wheel and rail in two operating states over a short extent.
pub fn request(records: u32) -> Value {
    let mut template = example("wheel-rail.case.json");
    for name in ["name", "outputs"] {
        template.as_object_mut().unwrap().remove(name);
    }
    template["solver"] = json!({ "target_error": 0.05 });
    json!({
        "template": template,
        "traffic": { "columns": { "lateral_shift [cm]": [-0.1, 0.2], "wheel_load [kN]": [70, 80] }, "passes": [1, 3] },
        "extent": { "axle_passes": 4e3, "wheel_distance_km": 200 },
        "records": records,
        "accuracy": { "step_tolerance": 1.0 },
        "limits": { "height_mm": 1e-6 },
    })
}

#[tokio::test]
async fn an_evolution_is_answered_as_json_tables_and_sections() {
    let server = Server::start().await;
    let answer = server
        .post("/v1/evolutions?name=short&label=line:A", &request(2))
        .await
        .is(202);
    let path = answer.location();
    let done = ended(&server, &path).await;
    assert_eq!(done["state"], "succeeded");
    assert_eq!(done["name"], "short");
    // The evolution appears only in the list of evolutions. It is not a job.
    let id = done["id"].as_str().unwrap();
    let list = server.read("/v1/evolutions?label=line:A").await;
    assert_eq!(
        (&list["evolutions"][0]["id"], &list["total"]),
        (&json!(id), &json!(1))
    );
    let jobs = server.read("/v1/jobs").await;
    assert_eq!(jobs["jobs"], json!([]));
    let answer = server.get(&format!("/v1/jobs/{id}/result")).await;
    assert_problem(&answer, 404, "job-not-found", "job");

    let result = server.read(&format!("{path}/result")).await;
    let records = result["records"].as_array().unwrap();
    assert_eq!(records.len(), 3);
    let last = &records[2];
    let pointers = json!(["/contact/lateral_shift_mm", "/load/vertical_force_n"]);
    assert_eq!(result["traffic"]["pointers"], pointers);
    let mut states: Vec<f64> = result["traffic"]["states"]
        .as_array()
        .unwrap()
        .iter()
        .map(|state| state["values"][1].as_f64().unwrap())
        .collect();
    states.sort_by(f64::total_cmp);
    assert_eq!(states, [70e3, 80e3], "in the units of the case");
    assert!(last["rail"]["worn_area_mm2"].as_f64().unwrap() > 0.0);
    assert!(last["wheel"]["worn_area_mm2"].as_f64().unwrap() > 0.0);
    assert!(
        result["limits"][0]["reached"]["share"].as_f64().unwrap() < 1.0,
        "{}",
        result["limits"]
    );

    let csv = server.get(&format!("{path}/table?format=csv")).await;
    let lines: Vec<&str> = csv.text.lines().collect();
    assert!(
        lines[0].starts_with("record,share,mgt,axle_passes") && lines.len() == 4,
        "{}",
        csv.text
    );
    let parquet = server
        .get(&format!("{path}/table?of=points&format=parquet"))
        .await;
    let points = records.iter().map(|record| {
        record["rail"]["points_mm"].as_array().unwrap().len()
            + record["wheel"]["points_mm"].as_array().unwrap().len()
    });
    let table = TableReader::new(bytes::Bytes::from(parquet.bytes)).unwrap();
    assert_eq!(table.group_size(0).0 as usize, points.sum::<usize>());

    // The exported sections are accepted as cross-sections of cases.
    for (body, format, form) in [
        ("rail", "miniprof", "miniprof"),
        ("wheel", "simpack", "simpack"),
        ("wheel", "miniprof", "miniprof"),
        ("rail", "columns", "columns"),
    ] {
        let file = server
            .get(&format!("{path}/sections/{body}?format={format}"))
            .await
            .is(200);
        let mut case = example("wheel-rail.case.json");
        case["contact"][body] = json!({ "format": form, "text": file.text });
        let checked = server.post("/v1/cases/check", &case).await;
        assert_eq!(checked.status, 200, "{body} {format}: {}", checked.text);
        let mut own = example("wheel-rail.case.json");
        own["contact"][body] = json!({ "points_mm": last[body]["points_mm"] });
        let own = server.post("/v1/cases/check", &own).await;
        let touch = "/understood/placement/first_touch/track_mm/1";
        let [found, known] =
            [&checked, &own].map(|answer| answer.json.pointer(touch).unwrap().as_f64().unwrap());
        assert!(
            (found - known).abs() < 0.1,
            "{body} {format}: {found} {known}"
        );
    }
    server.delete(&path).await.is(204);
    assert_problem(&server.get(&path).await, 404, "job-not-found", "id");
}

#[tokio::test]
async fn events_can_name_stored_sections() {
    let server = Server::idle().await;
    let mut given = request(2);
    let rail = given["template"]["contact"]["rail"].clone();
    let stored = server.post("/v1/profiles", &rail).await.is(201);
    let mut event = json!({ "at": 2e3, "grind": { "profile": stored.json["digest"] } });
    given["events"] = json!([event]);
    server.post("/v1/evolutions", &given).await.is(202);
    event["grind"]["points_mm"] = rail["points_mm"].clone();
    for (wrong, said) in [
        (event, "given together with points"),
        (
            json!({ "at": 2e3, "grind": { "profile": "0" } }),
            "not a profile",
        ),
    ] {
        given["events"] = json!([wrong]);
        let refused = server.post("/v1/evolutions", &given).await;
        assert_problem(&refused, 422, "faulty-case", "/events/0/grind/profile");
        assert!(refused.text.contains(said), "{}", refused.text);
    }
}

#[tokio::test]
async fn faults_are_named_with_their_place_and_what_is_allowed() {
    let server = Server::idle().await;
    for (place, value, pointer, words) in [
        (
            "/extent",
            json!({ "mgt": 1 }),
            "/extent/wheel_distance_km",
            "distance",
        ),
        ("/traffic/passes", json!([1, -3]), "/traffic/passes/1", "-3"),
        // Errors name columns by the titles in the request.
        (
            "/traffic/columns/wheel_load [kN]",
            json!([70, 0]),
            "/traffic/columns/wheel_load [kN]/1",
            "0.0 given",
        ),
        // A position in which the wheel misses the rail is an error of its row.
        (
            "/traffic/columns/lateral_shift [cm]",
            json!([0.1, 90]),
            "/traffic/columns/lateral_shift [cm]/1",
            "no part of the wheel",
        ),
        (
            "/template/solver",
            json!({ "method": "table" }),
            "/template/solver/method",
            "values per cell",
        ),
    ] {
        let mut bad = request(2);
        let (parent, name) = place.rsplit_once('/').unwrap();
        bad.pointer_mut(parent).unwrap()[name] = value;
        let answer = server.post("/v1/evolutions", &bad).await;
        assert_problem(&answer, 422, "faulty-case", "fault");
        let fault = &answer.json["errors"][0];
        assert_eq!(fault["pointer"], pointer, "{}", answer.text);
        assert!(
            fault["detail"].as_str().unwrap().contains(words),
            "{}",
            answer.text
        );
    }
}

/// An evolution whose process is killed several times has the same bytes as an uninterrupted one.
#[tokio::test]
async fn an_evolution_gives_the_same_bytes_although_the_process_is_killed() {
    let whole = tempfile::tempdir().unwrap();
    let torn = tempfile::tempdir().unwrap();
    let body = request(4);
    let submit = async |service: &Service| {
        service
            .post("/v1/evolutions", &body)
            .await
            .is(202)
            .location()
    };
    let result = async |service: &Service, path: &str| {
        let begun = Instant::now();
        while service.get(path).await["state"] != "succeeded" {
            assert!(begun.elapsed() < WITHIN, "{}", service.get(path).await);
            pause().await;
        }
        service.ask(&format!("{path}/result")).await.text
    };
    let service = Service::start(whole.path(), &["--workers", "1"]);
    let path = submit(&service).await;
    let expected = result(&service, &path).await;
    service.kill();

    let mut service = Service::start(torn.path(), &["--workers", "2"]);
    let path = submit(&service).await;
    let (mut kills, mut seen) = (0, 0.0);
    while kills < 3 {
        let job = service.get(&path).await;
        if job["state"] == "succeeded" {
            break;
        }
        let progress = job["progress"].as_f64().unwrap();
        if progress > seen + 0.1 {
            seen = progress;
            kills += 1;
            service.kill();
            service = Service::start(torn.path(), &["--workers", "2"]);
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    assert!(kills > 0, "it was met while running");
    assert_eq!(result(&service, &path).await, expected);
    service.kill();
}

/// The records up to the largest number of steps are readable, with a remark that names it. Warnings of states are remarks of the result and codes of
/// the evolution.
#[tokio::test]
async fn an_evolution_ends_at_its_largest_number_of_steps_with_its_records() {
    let server = Server::start().await;
    let mut plan = request(2);
    plan["traffic"] = json!({ "columns": { "lateral_shift_mm": [0, -30] }, "passes": [19, 1] });
    plan["accuracy"] = json!({ "step_tolerance": 1.0, "steps_max": 1 });
    let answer = server.post("/v1/evolutions", &plan).await.is(202);
    let path = answer.location();
    let done = ended(&server, &path).await;
    assert_eq!(done["state"], "succeeded", "{done}");
    let result = server.read(&format!("{path}/result")).await;
    let share = |record: &Value| record["progress"]["share"].as_f64().unwrap();
    let records: Vec<f64> = result["records"]
        .as_array()
        .unwrap()
        .iter()
        .map(share)
        .collect();
    assert!(
        records.len() == 2 && records[0] == 0.0 && records[1] > 0.0 && records[1] < 1.0,
        "{records:?}"
    );
    let detail = |code: &str| {
        let remarks = result["remarks"].as_array().unwrap();
        let mut found = remarks.iter().filter(|remark| remark["code"] == code);
        let first = found
            .next()
            .unwrap_or_else(|| panic!("{code}: {remarks:?}"));
        assert!(found.next().is_none(), "{code} twice");
        first["detail"].as_str().unwrap().to_owned()
    };
    assert!(detail("evolution-ended-early").contains("steps_max = 1"));
    let tip = detail("contact-on-flange-tip");
    let of_row = "(lateral_shift_mm -30), 5 % of the traffic in all";
    assert!(
        tip.starts_with("record 0, state ") && tip.contains(of_row),
        "{tip}"
    );
    let csv = server
        .get(&format!("{path}/table?format=csv"))
        .await
        .is(200);
    assert_eq!(csv.text.lines().count(), 3);
    server.get(&format!("{path}/sections/rail")).await.is(200);
}
