//! Tests a Python client generated from the contract: its classes have the names of the contract, and it works with the real program. The tests of
//! the page cover the TypeScript types.

use std::path::Path;

use crate::schemathesis::{python_program, run};
use crate::support::Service;

/// The version of the generator that `client.py` is written for.
const VERSION: &str = "0.29.1";

#[tokio::test]
async fn a_python_client_made_from_the_contract_solves_a_case() {
    let name = "openapi-python-client";
    let variable = "RAILHEAD_TEST_PYTHON_CLIENT";
    let program = or_skip!(python_program(name, name, VERSION, variable));
    let folder = tempfile::tempdir().expect("a folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let client = text(&folder.path().join("railhead_client"));
    let contract = text(&root.join("api/openapi.json"));
    let made = ["generate", "--meta", "none", "--path", &contract];
    run(&program, &[&made[..], &["--output-path", &client]].concat());
    let service = Service::start(&folder.path().join("data"), &[]);
    let address = format!("http://{}", service.address());
    let script = text(&root.join("tests/service/client.py"));
    let examples = text(&root.join("api/examples"));
    // The environment of the generator has the packages that the client needs.
    let python = program.with_file_name("python");
    let told = run(
        &python,
        &[&script, &text(folder.path()), &address, &examples],
    );
    let force: f64 = told.trim().parse().expect("a force");
    assert!(force > 0.0, "{told}");
}
