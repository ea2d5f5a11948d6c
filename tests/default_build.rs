//! Tests of the program built without optional features.
#![cfg(not(any(feature = "cluster", feature = "otlp")))]

use std::path::Path;
use std::process::{Command, Output};

fn railhead(args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_railhead"));
    command.args(args).output().expect("the program runs")
}

#[test]
fn a_case_is_solved_without_features() {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("api/examples/spin.case.json");
    let output = railhead(&["solve", case.to_str().expect("UTF-8")]);
    assert!(output.status.success(), "{output:?}");
    let result = String::from_utf8(output.stdout).expect("UTF-8");
    assert!(result.contains("\"force_y_n\""), "{result}");
}

#[test]
fn a_flag_of_an_absent_feature_is_refused_with_the_command_that_builds_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let data_dir = folder.path().join("data");
    let data_dir = data_dir.to_str().expect("UTF-8");
    let serve = ["serve", "--listen", "127.0.0.1:0", "--data-dir", data_dir];
    let database = ["--database-url", "postgres://railhead@127.0.0.1:1/railhead"];
    let commands: [(&[&str], [&str; 2], &str); 7] = [
        (&serve, database, "cluster"),
        (&serve, ["--results-url", "s3://bucket"], "cluster"),
        (&serve, ["--results-url", "gs://bucket"], "gs"),
        (&serve, ["--results-url", "az://container"], "az"),
        (&serve, ["--otlp-endpoint", "http://127.0.0.1:1"], "otlp"),
        (&["migrate"], database, "cluster"),
        (&["keys", "list"], database, "cluster"),
    ];
    for (command, flags, feature) in commands {
        let output = railhead(&[command, &flags].concat());
        assert!(!output.status.success(), "{command:?} {flags:?}");
        let complaint = String::from_utf8_lossy(&output.stderr);
        let build = format!("cargo build --release --features {feature}");
        assert!(complaint.contains(&build), "{command:?}: {complaint}");
    }
}
