//! Tests `POST /v1/evaluate`.

use std::io::{Read, Write};

use reqwest::Method;
use serde_json::{Value, json};

use crate::batches::results;
use crate::caching::gzip;
use crate::errors::assert_problem;
use crate::runs::template;
use crate::server::{Server, Setup, example};
use crate::uploads::upload;

fn columns() -> Value {
    json!({
        "/load/normal_force_n": [100_000, 50_000, 100_000],
        "/motion/creepage_x": [0.001, -0.002, 0.0],
    })
}

async fn evaluate(server: &Server, template: Value, columns: Value) -> crate::server::Answer {
    let body = json!({ "template": template, "columns": columns });
    server.post("/v1/evaluate", &body).await
}

/// Returns an NPZ archive with arrays of float64, as `numpy.savez_compressed` writes it.
pub fn npz(arrays: &[(&str, Vec<f64>)]) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, values) in arrays {
        let header = format!(
            "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}\n",
            values.len()
        );
        let options = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Deflated);
        archive
            .start_file(format!("{name}.npy"), options)
            .expect("an entry");
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend(u16::try_from(header.len()).expect("short").to_le_bytes());
        file.extend(header.as_bytes());
        file.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        archive.write_all(&file).expect("in memory");
    }
    archive.finish().expect("an archive").into_inner()
}

/// Returns the last `bytes` bytes of an array file in an archive, which are its values.
fn values_of(archive: &[u8], name: &str, bytes: usize) -> Vec<u8> {
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(archive)).expect("a ZIP");
    let mut file = Vec::new();
    let mut entry = archive.by_name(name).expect(name);
    entry.read_to_end(&mut file).expect(name);
    file.split_off(file.len() - bytes)
}

#[tokio::test]
async fn arrays_of_numpy_come_in_and_go_out() {
    // The memory that the limits of this service leave must be enough for a row that needs the solver.
    let server = Server::idle().await;
    let mut case = template("boundary_element");
    case["solver"]["target_error"] = json!(0.02);
    case["load"]["normal_force_n"] = json!(1e5);
    case["motion"]["creepage_x"] = json!(0.0);
    let template = server.keep(&case).await;
    let send = async |format: &str, body: Vec<u8>| {
        let path = format!("/v1/evaluate?format={format}&template={template}");
        server.post_as(&path, "application/x-npz", body).await
    };
    let rows = npz(&[
        ("normal_force_n", vec![1e5, 5e4]),
        ("/motion/creepage_x", vec![1e-3, -2e-3]),
    ]);
    let columns = send("json", rows.clone()).await.is(200).json["columns"].take();
    let answer = send("npz", rows).await;
    let forces: Vec<f64> = values_of(&answer.bytes, "force_x_n.npy", 16)
        .chunks(8)
        .map(|bytes| f64::from_le_bytes(bytes.try_into().expect("8 bytes")))
        .collect();
    assert_eq!(json!(forces), columns["force_x_n"]);
    let status = values_of(&answer.bytes, "status.npy", 8);
    assert_eq!(status, b"o\0\0\0k\0\0\0");
    let unequal = vec![("a", vec![1.0]), ("b", vec![])];
    let missing = vec![("normal_force_n", vec![f64::NAN])];
    for (columns, kind, detail) in [
        (unequal, "faulty-table", "`b` has 0 numbers, `a` has 1"),
        (missing, "faulty-case", "normal_force_n/0`: no number given"),
    ] {
        let answer = send("json", npz(&columns)).await;
        assert_problem(&answer, 422, kind, detail);
    }
    // The compressed body is small.
    let small = Server::with(|setup| setup.http.evaluate_max_bytes = 20_000).await;
    let template = small.keep(&case).await;
    let path = format!("/v1/evaluate?template={template}");
    let rows = npz(&[("normal_force_n", vec![1e5; 10_000])]);
    let answer = small.post_as(&path, "application/x-npz", rows).await;
    assert_problem(&answer, 413, "body-too-large", "20000");
}

#[tokio::test]
async fn creepages_and_spin_that_the_template_leaves_out_are_0() {
    let server = Server::idle().await;
    let mut short = template("table");
    short["motion"] = json!({ "creepage_y": 0.0 });
    let answer = evaluate(&server, short, columns()).await;
    let force = answer.json["columns"]["force_x_n"][0].as_f64();
    assert!(force.is_some_and(|force| force > 1e4), "{}", answer.text);
}

#[tokio::test]
async fn rows_are_answered_without_a_job() {
    let server = Server::idle().await;
    let answer = evaluate(&server, template("auto"), columns()).await.is(200);
    assert_eq!(answer.json["rows"], 3);
    let column = |name: &str, row: usize| answer.json["columns"][name][row].as_f64();
    let force = |row| column("force_x_n", row).expect("a force");
    assert!(
        force(0) > 1e4 && force(1) < -1e4 && force(2).abs() < 1.0,
        "{}",
        answer.text
    );
    for row in 0..3 {
        assert!(column("error_estimate", row).expect("a bound") < 0.02 * 30_000.0);
        assert!(column("friction_power_n", row).expect("a power") >= 0.0);
        let stick = column("stick_share", row).expect("a share");
        assert!((0.0..=1.0).contains(&stick));
        assert_eq!(answer.json["columns"]["status"][row], "ok");
    }
    assert_eq!(server.read("/v1/jobs").await["jobs"], json!([]));
    let mut by_table = template("table");
    by_table["outputs"] = json!(["resultants", "gradients"]);
    let answer = evaluate(&server, by_table, columns()).await;
    let slope = &answer.json["columns"]["force_x_n_by_creepage_x"][2];
    assert!(
        slope.as_f64().is_some_and(|slope| slope > 1e6),
        "{}",
        answer.text
    );
}

#[tokio::test]
async fn faults_of_rows_name_row_and_column_and_limits_hold() {
    let mut setup = Setup::new();
    setup.http.evaluate_max_rows = 3;
    setup.http.evaluate_max_bytes = 4096;
    let server = setup.start().await;
    let pointers = |answer: &crate::server::Answer| -> Vec<String> {
        let errors = answer.json["errors"]
            .as_array()
            .cloned()
            .unwrap_or_default();
        errors
            .iter()
            .map(|error| error["pointer"].as_str().unwrap_or("").to_owned())
            .collect()
    };
    for (forces, creepages, pointer) in [
        (json!([1e5, -5]), json!([0, 0]), "/~1load~1normal_force_n/1"),
        (json!([0, 1e5]), json!([0, 0]), "/~1load~1normal_force_n/0"),
        (json!([1e5, 1e5]), json!([0]), "/~1motion~1creepage_x"),
        (json!([]), json!([]), ""),
        (json!([1, 1, 1, 1]), json!([1, 1, 1, 1]), ""),
    ] {
        let columns = json!({ "/load/normal_force_n": forces, "/motion/creepage_x": creepages });
        let answer = evaluate(&server, template("table"), columns).await;
        assert_problem(&answer, 422, "faulty-case", "");
        let expected = format!("/columns{pointer}");
        assert_eq!(pointers(&answer), [expected], "{}", answer.text);
    }
    for (values, said) in [
        (json!([61000, null]), "row 1: invalid type: null"),
        (json!([61000, true]), "row 1: invalid type: boolean `true`"),
        (json!(["a", 1]), "row 1: `1` is a number, row 0 has a text"),
        (json!([0, "a"]), "row 1: \"a\" is a text, row 0 has"),
    ] {
        let body =
            json!({ "template": template("table"), "columns": { "normal_force_n": values } });
        let answer = server.post("/v1/evaluate", &body).await;
        let said = format!("the JSON of the body cannot be read: column `normal_force_n`, {said}");
        assert_problem(&answer, 400, "malformed-json", &said);
        let allowed = "a text or truth value if no value of the column is a number";
        assert!(answer.text.contains("row 0 has") || answer.text.contains(allowed));
    }
    let many: Vec<f64> = vec![0.001; 2000];
    let answer = evaluate(
        &server,
        template("table"),
        json!({ "/motion/creepage_x": many }),
    )
    .await;
    assert_problem(&answer, 413, "body-too-large", "evaluate-max-mib");
}

/// Tests that columns of a speed and of truth values vary the motion of a wheelset and the contact, in rows and in a batch.
#[tokio::test]
async fn columns_of_speeds_and_truth_values_vary_a_wheel_on_a_rail() {
    let server = Server::start().await;
    let (mut case, _) = wheel_on_rail();
    case["motion"] = json!({ "wheelset": {
        "speed_mm_per_s": 20_000, "free_rolling_radius_mm": 460, "yaw_rate_rad_per_s": 0.5
    } });
    let place = "/contact/accept_rough_profiles";
    let mut expected = Vec::new();
    for speed in [10_000.0, 30_000.0] {
        let mut single = case.clone();
        single["motion"]["wheelset"]["speed_mm_per_s"] = json!(speed);
        let solved = server.solve(&single).await;
        expected.push(solved["result"]["total"][0]["force_y_n"].clone());
    }
    assert_ne!(expected[0], expected[1]);
    let columns = json!({ "V [km/h]": [36, 108], place: [true, false] });
    let rows = evaluate(&server, case.clone(), columns).await.is(200);
    assert_eq!(rows.json["columns"]["force_y_n"], json!(expected));
    let (case, table) = (
        case.to_string(),
        format!("V [km/h],{place}\n36,True\n108,FALSE\n"),
    );
    let parts = [("name=\"template\"", &*case), ("name=\"table\"", &*table)];
    let batch = upload(&server, "/v1/batches", &parts).await.is(202);
    let solved = results(&server, &batch.json, "?wait=60").await;
    let solved = solved
        .iter()
        .map(|one| &one["result"]["total"][0]["force_y_n"]);
    assert!(solved.eq(&expected));
}

/// Returns the example of a wheel on a rail with a single motion, and columns with one row that repeats this motion.
fn wheel_on_rail() -> (Value, Value) {
    let mut case = crate::server::example("wheel-rail.case.json");
    case["outputs"] = json!(["resultants", "zones"]);
    case["motion"] = json!({ "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0002 });
    (case, json!({ "/motion/creepage_x": [0.001] }))
}

#[tokio::test]
async fn rows_beyond_the_budget_of_the_solver_belong_to_a_run() {
    let server =
        Server::idle_with(|setup| setup.http.evaluate_time = std::time::Duration::ZERO).await;
    let (case, columns) = wheel_on_rail();
    let late = evaluate(&server, case.clone(), columns).await;
    assert_problem(&late, 422, "evaluation-too-long", "/v1/runs");
    let many: Vec<f64> = (0..201).map(|row| 1e-5 * f64::from(row)).collect();
    let many = json!({ "/motion/creepage_x": many });
    let answer = evaluate(&server, case, many).await;
    assert_problem(&answer, 422, "evaluation-too-long", "201 rows");
    // The method `table` has no such limit.
    evaluate(&server, template("table"), columns_of(201))
        .await
        .is(200);
}

fn columns_of(rows: usize) -> Value {
    json!({ "/load/normal_force_n": vec![1e5; rows], "/motion/creepage_x": vec![1e-3; rows] })
}

/// A compressed table reserves the memory of the largest table until it is parsed. The memory of the solver is reserved after that.
#[tokio::test]
async fn a_packed_table_leaves_memory_for_the_solver() {
    let server = Server::start().await;
    let mut case = example("hertz-steel.case.json");
    case["solver"] = json!({ "method": "fastsim", "mesh": { "strips": 30, "cells": 30 } });
    let id = server.keep(&case).await;
    for rows in [2, 1000] {
        let row = |row: usize| format!("{}\n", 1e-6 * row as f64);
        let table = format!("creepage_x\n{}", (0..rows).map(row).collect::<String>());
        let table = gzip(table.as_bytes());
        let shape = |request: reqwest::RequestBuilder| {
            let request = request.header("content-type", "text/csv");
            request.header("content-encoding", "gzip").body(table)
        };
        let path = format!("/v1/evaluate?template={id}");
        let answer = server.send(Method::POST, &path, shape).await;
        assert_eq!(answer.status, 200, "{rows} rows: {}", answer.text);
        assert_eq!(answer.json["rows"], rows);
    }
}
