//! Fuzzes the contract with Schemathesis against the real program. Every answer must agree with the contract. `tests/schemathesis.toml` has the
//! settings and the few exceptions.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::{Service, skip};

/// The version that the settings are written for.
const VERSION: &str = "4.32.5";

/// Returns a program of a Python package in this version: the one that the variable names, or the one on the path.
pub fn python_program(name: &str, package: &str, version: &str, variable: &str) -> Option<PathBuf> {
    let named = std::env::var_os(variable);
    let program = named.map_or_else(|| PathBuf::from(name), PathBuf::from);
    let output = Command::new(&program).arg("--version").output();
    if output.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(version)) {
        return Some(program);
    }
    skip(&format!(
        "`{name}` is not there: `pip install {package}=={version}`, or name it in {variable}"
    ));
    None
}

/// Runs a program. Returns its output, and panics if it fails.
pub fn run(program: &Path, arguments: &[&str]) -> String {
    said_by(Command::new(program).args(arguments))
}

/// Runs a prepared command. Returns its standard output, and panics if it fails.
pub fn said_by(program: &mut Command) -> String {
    let output = program.output();
    let output = output.unwrap_or_else(|error| panic!("{program:?}: {error}"));
    let [said, told] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    assert!(output.status.success(), "{program:?}: {said}\n{told}");
    said.into_owned()
}

fn schemathesis() -> Option<PathBuf> {
    let variable = "RAILHEAD_TEST_SCHEMATHESIS";
    python_program("st", "schemathesis", VERSION, variable)
}

#[tokio::test]
async fn what_schemathesis_makes_of_the_contract_is_answered_as_documented() {
    let program = or_skip!(schemathesis());
    let (folder, service) = Service::fresh(&["--log", "warn,railhead::cli=info"]);
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let output = Command::new(program)
        .env("PYTHONPATH", &tests)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("SCHEMATHESIS_HOOKS", "schemathesis_hooks")
        .arg("--config-file")
        .arg(tests.join("schemathesis.toml"))
        .args(["run", "--no-color", "--checks", "all"])
        .arg(format!("http://{}/openapi.json", service.address()))
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{told}");
    assert!(told.contains("Test cases:"), "{told}");
    assert_eq!(service.log_text().matches("panicked").count(), 0);
    service.get("/healthz").await;
}
