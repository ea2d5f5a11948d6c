//! The contract fuzzed by Schemathesis, against the real program: whatever it makes of the contract is answered as the
//! contract says. `tests/schemathesis.toml` has the settings and the few exceptions.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::support::{Service, skip};

/// The version that the settings are written for.
const VERSION: &str = "4.32.5";

/// `st` of that version: `RAILHEAD_TEST_SCHEMATHESIS`, the one on the path, or in continuous integration one installed for this.
fn schemathesis() -> Option<PathBuf> {
    let fits = |program: &Path| {
        let output = Command::new(program).arg("--version").output();
        output.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).contains(VERSION))
    };
    let named = std::env::var_os("RAILHEAD_TEST_SCHEMATHESIS");
    let program = named.map_or_else(|| PathBuf::from("st"), PathBuf::from);
    if fits(&program) {
        return Some(program);
    }
    if std::env::var_os("CI").is_some() {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("schemathesis-venv");
        let run = |program: &Path, arguments: &[&str]| {
            let output = Command::new(program).args(arguments).output();
            let output = output.unwrap_or_else(|error| panic!("{}: {error}", program.display()));
            let told = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{}: {told}", program.display());
        };
        run(
            Path::new("python3"),
            &["-m", "venv", &place.to_string_lossy()],
        );
        let package = format!("schemathesis=={VERSION}");
        let install = ["-m", "pip", "install", "--quiet", &package];
        run(&place.join("bin/python"), &install);
        let own = place.join("bin/st");
        assert!(fits(&own), "{}", own.display());
        return Some(own);
    }
    skip(&format!(
        "the contract is not fuzzed; `pip install schemathesis=={VERSION}`, or name its `st` in RAILHEAD_TEST_SCHEMATHESIS"
    ));
    None
}

#[tokio::test]
async fn what_schemathesis_makes_of_the_contract_is_answered_as_documented() {
    let Some(program) = schemathesis() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let service = Service::start(folder.path(), &["--log", "warn,railhead::cli=info"]);
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
