//! Tests runs, which are many rows that vary one case.

use serde_json::{Value, json};

use crate::errors::assert_problem;
use crate::server::{Answer, Server, Setup, example};
use crate::support::files_below;
use crate::table_forms::lines_of;

pub fn template(method: &str) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 1 },
        "motion": { "creepage_x": 0, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
        "solver": { "method": method, "target_error": 0.01 },
    })
}

/// Returns columns for this many rows: loads, creepages and positions.
pub fn columns(rows: usize) -> Value {
    let each = |of: fn(usize) -> f64| (0..rows).map(of).collect::<Vec<_>>();
    json!({
        "/load/normal_force_n": each(|k| 5e4 + 1e3 * (k % 7) as f64),
        "creepage_x": each(|k| 1e-3 * ((k % 11) as f64 - 5.0)),
        "km": each(|k| k as f64 * 0.1),
        "section": (0..rows).map(|k| if k % 3 == 0 { "curve" } else { "straight" }).collect::<Vec<_>>(),
    })
}

pub async fn submit(server: &Server, body: &Value) -> String {
    let answer = server.post("/v1/runs", body).await.is(202);
    answer.location()
}

/// Waits for the end of a run or an evolution, and returns it.
pub async fn ended(server: &Server, path: &str) -> Value {
    let answer = server.get(&format!("{path}?wait=240")).await.is(200);
    assert!(answer.json["ended_at"].is_string(), "{}", answer.text);
    answer.json
}

/// Waits for the end of a run. Returns its answers.
pub async fn answers(server: &Server, run: &str) -> Vec<Value> {
    ended(server, run).await;
    let results = format!("{run}/results?format=ndjson");
    server.get(&results).await.is(200).lines()
}

#[tokio::test]
async fn a_solved_row_has_the_remarks_of_its_case() {
    let server = Server::start().await;
    let mut template = example("wheel-rail.case.json");
    template["outputs"] = json!(["resultants"]);
    let columns = json!({ "lateral_shift_mm": [0, -60] });
    let run = submit(
        &server,
        &json!({ "template": template, "columns": columns }),
    )
    .await;
    let rows = answers(&server, &run).await;
    for (shift, row) in [0, -60].into_iter().zip(&rows) {
        template["contact"]["lateral_shift_mm"] = json!(shift);
        let job = server.solve(&template).await;
        let remarks = job["result"]["remarks"].as_array().expect("remarks");
        let codes = row["remarks"].as_str().unwrap_or_default();
        let is_named = |remark: &Value| codes.split(' ').any(|code| remark["code"] == code);
        // Rows have no uncertainty of their profiles, and no remark on it.
        let mut warnings = remarks.iter().filter(|one| one["severity"] == "warning");
        assert!(warnings.all(is_named), "{codes}: {remarks:#?}");
    }
    let of_tip = rows[1]["remarks"].as_str().expect("codes");
    assert!(of_tip.contains("contact-on-flange-tip"), "{of_tip}");
}

/// Asserts that an answer refuses a case with an error that contains `word`.
fn assert_faults(answer: &Answer, word: &str) {
    assert_problem(answer, 422, "faulty-case", "fault");
    assert!(
        answer.text.contains(word),
        "`{word}` is not in: {}",
        answer.text
    );
}

/// Asserts that all formats of the answers have the same numbers.
async fn assert_forms(server: &Server, results: &str, all: &[Value]) {
    let path = format!("{results}?format=csv&columns=row,force_x_n&rows=117:");
    let line = |row: &Value| format!("{},{}\n", row["row"], row["force_x_n"]);
    let expected: String = all[117..].iter().map(line).collect();
    let csv = server.get(&path).await.text;
    assert_eq!(csv, format!("row,force_x_n\n{expected}"));
    for format in ["parquet", "arrow"] {
        let answer = server.get(&format!("{results}?format={format}")).await;
        let lines = lines_of(format, &answer);
        assert_eq!(lines.len(), all.len(), "{format}");
        for (line, row) in lines.iter().zip(all) {
            assert_eq!(line["force_x_n"], row["force_x_n"], "{format}");
        }
    }
}

/// Asserts that the files of the manifest have every row once.
async fn assert_manifest(server: &Server, run: &str, rows: u64) {
    let manifest = server.get(&format!("{run}/manifest")).await;
    let files = manifest.json["files"].as_array().expect("files").clone();
    let counts = files.iter().filter_map(|file| file["rows"].as_u64());
    assert_eq!(counts.sum::<u64>(), rows);
    server
        .get(files[0]["url"].as_str().expect("a path"))
        .await
        .is(200);
}

/// Asserts that row 17 has the expected case and answer, and that rows outside the run are not found.
async fn assert_row(server: &Server, run: &str, sent: &Value, line: &Value) {
    let alone = server.get(&format!("{run}/rows/17")).await.is(200);
    assert_eq!(alone.json["answer"], *line);
    let case = &alone.json["case"];
    assert_eq!(
        case["load"]["normal_force_n"],
        sent["/load/normal_force_n"][17]
    );
    assert_eq!(case["motion"]["creepage_x"], sent["creepage_x"][17]);
    server.post("/v1/cases/check", case).await.is(200);
    for beyond in ["120", "-1", "x"] {
        let answer = server.get(&format!("{run}/rows/{beyond}")).await;
        assert_problem(&answer, 404, "row-not-found", "rows");
    }
}

#[tokio::test]
async fn a_run_answers_each_of_its_rows_once_in_every_format() {
    for server in Server::on_every_store().await {
        let (rows, sent) = (120, columns(120));
        let run = submit(
            &server,
            &json!({ "template": template("auto"), "columns": sent }),
        )
        .await;
        let about = ended(&server, &run).await;
        assert_eq!(about["state"], "succeeded", "{about}");
        assert_eq!([&about["rows"], &about["rows_done"]], [120, 120]);
        assert_eq!(about["rows_without_answer"], 0);
        let results = format!("{run}/results");
        let all = server.get(&results).await.lines();
        let numbers: Vec<_> = all.iter().map(|row| row["row"].as_u64()).collect();
        assert_eq!(numbers, (0..rows).map(Some).collect::<Vec<_>>());
        for (place, row) in all.iter().enumerate() {
            let load = sent["/load/normal_force_n"][place]
                .as_f64()
                .expect("a load");
            assert!((row["normal_force_n"].as_f64().expect("a force") - load).abs() < 1e-3 * load);
            let creepage = sent["creepage_x"][place].as_f64().expect("a creepage");
            let force = row["force_x_n"].as_f64().expect("a force");
            assert!(force * creepage > 0.0 || creepage == 0.0, "{row}");
            assert_eq!(
                [&row["km"], &row["section"]],
                [&sent["km"][place], &sent["section"][place]]
            );
            assert!(row["status"] == "ok" && row["method"].is_string(), "{row}");
        }
        assert_forms(&server, &results, &all).await;
        assert_manifest(&server, &run, rows).await;
        assert_row(&server, &run, &sent, &all[17]).await;
        for other in [
            format!("/v1/batches/{}", &run[9..]),
            format!("/v1/jobs/{}", &run[9..]),
        ] {
            assert_eq!(server.get(&other).await.status, 404);
        }
        // The chunks of a run are not jobs of the client.
        assert_eq!(server.read("/v1/jobs").await["total"], 0);
        let listed = server.read("/v1/runs?limit=1").await;
        assert_eq!(listed["runs"][0]["id"], about["id"]);
        assert_eq!(server.delete(&run).await.status, 204);
        assert_problem(&server.get(&results).await, 404, "run-not-found", "run");
    }
}

#[tokio::test]
async fn totals_are_those_of_the_rows_in_all_and_by_section() {
    let server = Server::start().await;
    let run = submit(
        &server,
        &json!({ "template": template("table"), "columns": columns(90) }),
    )
    .await;
    let rows = answers(&server, &run).await;
    let path = format!("{run}/totals?columns=force_x_n&percentiles=100&above=5000&by=section");
    let totals = server.read(&path).await;
    let sizes = |section: Option<&str>| -> Vec<f64> {
        let of = rows
            .iter()
            .filter(|row| section.is_none_or(|name| row["section"] == name));
        of.map(|row| row["force_x_n"].as_f64().expect("a force").abs())
            .collect()
    };
    let compare = |totals: &Value, section: Option<&str>| {
        let sizes = sizes(section);
        let column = &totals["columns"]["force_x_n"];
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        assert_eq!(column["percentiles"]["100"], largest, "{totals}");
        let above = sizes.iter().filter(|size| **size >= 5000.0).count();
        assert_eq!(column["above"]["5000"], above, "{totals}");
        assert_eq!(totals["rows"], sizes.len());
    };
    compare(&totals["all"], None);
    let sections = totals["sections"].as_array().expect("sections");
    assert_eq!(sections.len(), 2);
    for section in sections {
        compare(section, section["value"].as_str());
    }
    let by_length = server.read(&format!("{run}/totals?by=km&width=3")).await;
    let lengths = by_length["sections"].as_array().expect("sections");
    let counts = lengths
        .iter()
        .filter_map(|section| section["rows"].as_u64());
    assert_eq!(counts.sum::<u64>(), 90);
    assert_eq!(lengths[1]["from"], 3.0);
    let fault = server.get(&format!("{run}/totals?by=km")).await;
    assert_problem(&fault, 400, "bad-query", "width");
}

#[tokio::test]
async fn a_row_that_cannot_be_solved_has_a_status_and_faults_of_a_run_are_named() {
    let server = Server::start().await;
    let mut rows = json!({ "template": template("boundary_element"), "columns": { "/friction/coefficient": [0.3, 0.2], "/material/poisson_ratio": [0.28, 0.3] } });
    rows["template"]["load"]["normal_force_n"] = json!(8e4);
    // This error of a single row cannot be detected in one column alone.
    rows["columns"]["/contact/gauge_mm"] = json!([1435.0, 1435.0]);
    let fault = server.post("/v1/runs", &rows).await;
    assert_faults(&fault, "gauge_mm");
    rows["columns"] = json!({ "/solver/target_error": [0.01, 7.0, 0.01], "/friction/coefficient": [0.3, 0.2, 0.1] });
    let run = submit(&server, &rows).await;
    let about = ended(&server, &run).await;
    assert_eq!(
        [&about["state"], &about["rows_without_answer"]],
        [&json!("succeeded"), &json!(1)]
    );
    let all = server.get(&format!("{run}/results")).await.lines();
    let statuses: Vec<_> = all.iter().map(|row| row["status"].as_str()).collect();
    assert_eq!(statuses, [Some("ok"), Some("refused"), Some("ok")]);
    assert!(all[1]["force_x_n"].is_null() && all[1]["method"].is_null());
    let load = "/load/normal_force_n";
    let of_load = "/columns/~1load~1normal_force_n/1";
    for (pointer, values, word) in [
        (load, json!([1e5, -1.0]), of_load),
        (load, json!([1e5]), "all columns need as many"),
        (load, json!([]), "all columns need as many"),
        ("force_x_n", json!(["a", "b"]), "/columns/force_x_n/0"),
        ("status", json!(["a", "b"]), "a column that is copied"),
    ] {
        let mut body =
            json!({ "template": template("auto"), "columns": { "creepage_x": [0.0, 1e-3] } });
        body["columns"][pointer] = values;
        let answer = server.post("/v1/runs", &body).await;
        assert_faults(&answer, word);
    }
    let mut sweep =
        json!({ "template": template("auto"), "columns": { "/load/normal_force_n": [1e5] } });
    sweep["template"]["motion"] = json!([{ "creepage_x": 0.0 }, { "creepage_x": 0.1 }]);
    sweep["template"]["outputs"] = json!(["resultants", "tractions"]);
    let answer = server.post("/v1/runs", &sweep).await;
    assert_faults(&answer, "one motion");
    assert!(answer.text.contains("/template/outputs"), "{}", answer.text);
}

#[tokio::test]
async fn a_run_is_listed_by_name_and_label_and_a_cancelled_one_keeps_what_it_has() {
    for server in Server::on_every_store().await {
        let body = json!({ "template": template("table"), "columns": columns(30) });
        let sent = server
            .post("/v1/runs?name=night&label=line:A12", &body)
            .await;
        let run = sent.is(202).location();
        ended(&server, &run).await;
        assert_eq!(
            server.read("/v1/runs?label=line:A12&name=NIGHT").await["total"],
            1
        );
        let cancelled = server.cancel(&run).await;
        assert_eq!(cancelled.json["state"], "succeeded");
    }
    let mut columns = columns(130);
    columns["/solver/target_error"] = json!(vec![0.001; 130]);
    let body = json!({ "template": template("boundary_element"), "columns": columns });
    let server = Server::start().await;
    let run = submit(&server, &body).await;
    while server.read(&run).await["progress"].as_f64() < Some(0.4) {
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    // The last chunk has fewer rows than the others.
    server.cancel(&run).await;
    let about = ended(&server, &run).await;
    let rows = server.get(&format!("{run}/results")).await.lines();
    let lost = rows.iter().filter(|row| row["force_x_n"].is_null()).count();
    assert_eq!(about["rows_without_answer"], lost, "{about}");
    let idle = Server::idle().await;
    let run = submit(&idle, &body).await;
    let early = idle.get(&format!("{run}/results")).await;
    assert_problem(&early, 409, "result-not-ready", "queued");
    let cancelled = idle.cancel(&run).await.is(200);
    assert_eq!(cancelled.json["state"], "cancelled");
    assert_eq!(cancelled.json["rows_without_answer"], 130);
    let all = idle.get(&format!("{run}/results")).await.lines();
    assert_eq!(all.len(), 130);
    assert!(
        all.iter()
            .all(|row| row["status"] == "cancelled" && row["section"].is_string())
    );
}

#[tokio::test]
async fn answers_that_are_damaged_or_missing_are_an_error_and_no_broken_answer() {
    let setup = Setup::new();
    let folder = setup.options.data_dir.clone();
    let server = setup.start().await;
    let body = json!({ "template": template("table"), "columns": columns(3) });
    let run = submit(&server, &body).await;
    ended(&server, &run).await;
    let mut files = files_below(&folder);
    files.retain(|path| path.ends_with("rows.parquet"));
    assert_eq!(files.len(), 1, "{files:?}");
    let damages: [fn(&std::path::Path); 3] = [
        |file| std::fs::write(file, "PAR1 damaged PAR1").expect("written"),
        |file| std::fs::write(file, "").expect("written"),
        |file| std::fs::remove_file(file).expect("removed"),
    ];
    for damage in damages {
        damage(&files[0]);
        for format in ["ndjson", "csv", "arrow", "parquet"] {
            let path = format!("{run}/results?format={format}");
            assert_problem(&server.get(&path).await, 500, "internal", "");
        }
    }
}
