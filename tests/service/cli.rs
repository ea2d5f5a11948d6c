//! Tests the commands of the program.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};

use serde_json::{Value, json};

use crate::results::number;
use crate::server::count;
use crate::support::{Service, case, endless_case, railhead};

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("api/examples")
        .join(name)
}

/// Runs `railhead solve -` with this text on standard input.
fn solve(text: &str) -> Output {
    let mut child = railhead()
        .args(["solve", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(text.as_bytes()).unwrap();
    drop(input);
    child.wait_with_output().unwrap()
}

/// Asserts that a program ended with this exit code and that its standard error contains `word`. Returns standard error.
#[track_caller]
fn fails(output: &Output, code: i32, word: &str) -> String {
    let complaints = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{complaints}");
    assert!(complaints.contains(word), "{complaints}");
    complaints
}

/// Returns the standard output of a successful run as JSON.
fn said(output: &Output) -> Value {
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_case_is_solved_without_a_server() {
    let file = example("hertz-steel.case.json");
    let output = railhead().arg("solve").arg(&file).output().unwrap();
    let from_file = said(&output);
    assert!(number(&from_file["total"][0]["force_x_n"]).abs() > 1.0);
    assert!(number(&from_file["patches"][0]["points"][0]["slip_area_mm2"]) > 0.0);

    let from_input = said(&solve(&std::fs::read_to_string(file).unwrap()));
    assert_eq!(from_input["total"], from_file["total"]);
    assert_eq!(from_input["case_digest"], from_file["case_digest"]);
}

#[test]
fn values_per_cell_come_along_only_if_asked_for() {
    let mut asked = case("with fields");
    asked["outputs"] = json!(["zones", "tractions", "slip", "pressure"]);
    let answer = said(&solve(&asked.to_string()));
    let fields = &answer["fields"][0];
    let cells = count(&fields["meshes"][0]["x_mm"]);
    assert!(cells > 0);
    assert_eq!(count(&fields["meshes"][0]["pressure_mpa"]), cells);
    let names = "zone traction_x_mpa traction_y_mpa slip_x slip_y";
    for name in names.split(' ') {
        assert_eq!(count(&fields["points"][0][name]), cells, "{name}");
    }
    asked["outputs"] = json!(["resultants"]);
    let answer = said(&solve(&asked.to_string()));
    assert_eq!(answer.get("fields"), None);
}

#[test]
fn a_faulty_case_names_every_fault_and_exits_with_2() {
    let mut solved = railhead();
    let output = solved.arg("solve").arg(example("faulty.case.json"));
    let output = output.output().unwrap();
    assert_eq!(output.stdout, b"");
    let faults = fails(&output, 2, "");
    let are_named = faults.lines().all(|line| line.starts_with("railhead: /"));
    assert!(faults.lines().count() > 1 && are_named, "{faults}");

    fails(&solve("{\"name\": "), 2, "line 1 column 9");
}

#[test]
fn a_case_without_answer_exits_with_1() {
    let mut hurried = case("hurried");
    hurried["solver"]["time_limit_s"] = json!(1e-9);
    fails(&solve(&hurried.to_string()), 1, "out of time");
    let output = railhead().args(["solve", "no/such.json"]).output();
    fails(&output.unwrap(), 1, "no/such.json");
}

#[test]
fn the_contract_can_be_printed() {
    let output = railhead().arg("openapi").output().unwrap();
    assert!(output.status.success());
    let printed = String::from_utf8(output.stdout).unwrap();
    assert_eq!(
        printed.trim_end(),
        railhead::http::openapi_json().trim_end()
    );
}

#[test]
fn a_health_check_tells_a_ready_service_from_none() {
    let (_folder, service) = Service::fresh(&[]);
    let check = |url: &str| {
        railhead()
            .args(["healthcheck", "--url", url])
            .output()
            .unwrap()
    };
    let url = |path: &str| format!("http://{}{path}", service.address());
    let (ready, elsewhere) = (url("/readyz"), url("/nothing"));
    assert!(check(&ready).status.success());
    fails(&check(&elsewhere), 1, "404");
    service.kill();
    fails(&check(&ready), 1, "");
}

#[test]
fn settings_come_from_the_environment_too_and_flags_win() {
    let folder = tempfile::tempdir().unwrap();
    let serve = |flags: &[&str]| {
        let mut command = railhead();
        command.env("RAILHEAD_DATA_DIR", folder.path());
        command.env("RAILHEAD_LISTEN", "127.0.0.1:1:1");
        command.arg("serve").args(flags).output().unwrap()
    };
    fails(&serve(&[]), 2, "127.0.0.1:1:1");

    let mut misspelt = railhead();
    misspelt.envs([("RAILHEAD_WORKRES", "3"), ("RAILHEAD_WORKERS", "1")]);
    let running = Service::start_as(&mut misspelt, "serve", folder.path(), &[]);
    let log = running.log_text();
    assert!(
        log.contains("RAILHEAD_WORKRES") && !log.contains("RAILHEAD_WORKERS"),
        "{log}"
    );
    fails(&serve(&["--listen", "127.0.0.1:0"]), 1, "in use");
    running.kill();
}

#[test]
fn settings_that_cannot_work_are_refused_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    for (flag, code, said) in [
        ("--log=foo bar[", 1, "`foo bar[` is neither a level"),
        ("--log=info,warning", 1, "`warning` is neither a level"),
        ("--allowed-host=http://x", 1, "`http://x` is not a host"),
        ("--cors-origin=https://a.b/x", 2, "`/` is not allowed"),
        ("--anonymous=never", 1, "not answered (`--anonymous never`)"),
    ] {
        let mut serve = railhead();
        serve.args(["serve", "--listen", "127.0.0.1:0", "--data-dir"]);
        fails(&serve.arg(&data).arg(flag).output().unwrap(), code, said);
    }
    for (to, said) in [
        (data.join("sub"), "is inside the data folder"),
        (folder.path().into(), "File exists"),
    ] {
        let mut backup = railhead();
        backup.args(["backup", "--data-dir"]).arg(&data);
        let refusal = fails(&backup.arg("--to").arg(&to).output().unwrap(), 1, said);
        let named = format!("`{}`", to.display());
        assert!(refusal.contains(&named), "{refusal}");
    }
}

#[test]
fn config_tells_every_setting_and_where_it_comes_from() {
    let mut config = railhead();
    config.env("RAILHEAD_RETENTION", "30d");
    config.args(["config", "--queue-max", "7"]);
    config.args(["--cors-origin", "http://a,http://b"]);
    let told = said(&config.output().unwrap());
    for (setting, value, source) in [
        ("queue-max", json!(7), "flag"),
        ("retention", json!("30d"), "environment"),
        ("listen", json!("127.0.0.1:8080"), "default"),
        ("cache", json!(true), "default"),
        ("cors-origin", json!(["http://a", "http://b"]), "flag"),
    ] {
        assert_eq!(told[setting]["value"], value, "{setting}");
        assert_eq!(told[setting]["source"], source, "{setting}");
    }
    assert!(told["workers"]["value"].as_u64() >= Some(1));
    // Every flag of `serve` is listed under its name.
    let help = railhead().args(["serve", "--help"]).output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    let flags = help
        .lines()
        .filter_map(|line| line.trim().strip_prefix("--"));
    let flags: Vec<&str> = flags
        .map(|flag| flag.split([' ', '=']).next().unwrap_or_default())
        .collect();
    assert!(flags.len() > 10, "{help}");
    for flag in flags {
        assert!(told[flag]["variable"].is_string(), "{flag}");
    }
}

#[test]
fn a_data_folder_that_is_made_is_for_nobody_else_to_read() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let _service = Service::start(&data, &[]);
    let mode = std::fs::metadata(&data).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o700);
}

#[tokio::test]
async fn a_backup_of_a_working_service_can_be_started() {
    let folder = tempfile::tempdir().unwrap();
    let (data_dir, copy) = (folder.path().join("data"), folder.path().join("copy"));
    let service = Service::start(&data_dir, &["--cache", "false"]);
    // Small results are stored in the table, and large results outside it.
    let mut large = case("large");
    large["solver"]["mesh"] = json!({ "strips": 40, "cells": 40 });
    let mut results = Vec::new();
    for case in [case("small"), large] {
        let id = service.submit(&case).await;
        service.until(&id, "succeeded").await;
        let path = format!("/v1/jobs/{id}");
        let result = service.get(&format!("{path}/result")).await;
        let fields = service.get(&format!("{path}/tractions")).await;
        results.push((path, result, fields));
    }
    let endless = service.submit(&endless_case("runs meanwhile")).await;
    service.until(&endless, "running").await;
    let backup = || {
        let mut command = railhead();
        let command = command.arg("backup").arg("--to").arg(&copy);
        command.arg("--data-dir").arg(&data_dir).output().unwrap()
    };
    let made = backup();
    assert!(made.status.success(), "{made:?}");
    // An existing file is not overwritten.
    fails(&backup(), 1, "");
    service.kill();
    std::fs::remove_dir_all(&data_dir).unwrap();

    let service = Service::start(&copy, &[]);
    for (path, result, fields) in results {
        assert_eq!(service.get(&format!("{path}/result")).await, result);
        assert_eq!(service.get(&format!("{path}/tractions")).await, fields);
    }
    service.until(&endless, "running").await;
}
