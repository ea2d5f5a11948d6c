//! Tests of the page: unit tests of its modules in Node, a type check against the contract, and browser tests against the real program.
//!
//! `.ci/run` installs Node, its packages, Chromium and Firefox. If one is missing, the tests are skipped with a message; under `CI` they fail.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The oldest Node version that runs the tests. It detects from the source text whether a file is a module.
const NODE_MIN: [u32; 2] = [20, 19];
const BROWSERS: [&str; 4] = [
    "/usr/bin/chromium",
    "/usr/bin/chromium-browser",
    "/usr/bin/google-chrome",
    "/usr/bin/google-chrome-stable",
];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/page")
}

/// Reports why tests are skipped. Panics if the variable `CI` is set.
fn skip(reason: &str) {
    assert!(env::var_os("CI").is_none(), "not run: {reason}");
    eprintln!("SKIPPED: {reason}");
}

fn node_is_there() -> bool {
    let told = Command::new("node").arg("--version").output();
    let Ok(version) = told.map(|output| String::from_utf8_lossy(&output.stdout).into_owned())
    else {
        return false;
    };
    let mut numbers = version.trim().trim_start_matches('v').split('.');
    let mut number = || {
        numbers
            .next()
            .and_then(|part| part.parse().ok())
            .unwrap_or(0)
    };
    [number(), number()] >= NODE_MIN
}

/// Returns whether Node and the packages are installed, and reports what is missing.
fn ready() -> bool {
    if !node_is_there() {
        let [major, minor] = NODE_MIN;
        skip(&format!("Node {major}.{minor} or later is not installed"));
        return false;
    }
    if !folder().join("node_modules/playwright-core").exists() {
        skip("the packages are not installed: `npm ci --prefix tests/page`");
        return false;
    }
    true
}

fn browser() -> Option<PathBuf> {
    let chosen = env::var_os("RAILHEAD_TEST_BROWSER").map(PathBuf::from);
    let known = BROWSERS.iter().map(PathBuf::from);
    chosen.into_iter().chain(known).find(|path| path.exists())
}

/// Runs Node in the folder of these tests. Panics with its output if it fails.
fn node(arguments: &[&str], variables: &[(&str, &Path)]) {
    let mut command = Command::new("node");
    command.current_dir(folder()).args(arguments);
    command.envs(variables.iter().copied());
    let output = command.output().expect("Node runs");
    let printed = [output.stdout, output.stderr].concat();
    let printed = String::from_utf8_lossy(&printed);
    assert!(output.status.success(), "{arguments:?}\n{printed}");
    println!("{printed}");
}

/// Returns the sorted paths of the test files in a folder.
fn test_files(name: &str) -> Vec<String> {
    let entries = fs::read_dir(folder().join(name)).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let mut files: Vec<String> = names
        .filter_map(|file| file.into_string().ok())
        .filter(|file| file.ends_with(".test.mjs"))
        .map(|file| format!("{name}/{file}"))
        .collect();
    files.sort();
    assert!(!files.is_empty(), "no tests in {name}");
    files
}

fn run_tests(name: &str, variables: &[(&str, &Path)]) {
    let files = test_files(name);
    let mut arguments = vec!["--test", "--test-concurrency=2", "--test-reporter=spec"];
    arguments.extend(files.iter().map(String::as_str));
    node(&arguments, variables);
}

#[test]
fn modules_of_the_page_compute_what_they_say() {
    if ready() {
        run_tests("unit", &[]);
    }
}

#[test]
fn types_of_the_page_fit_the_contract() {
    if ready() {
        node(&["types.mjs"], &[]);
    }
}

#[test]
fn page_works_in_a_browser_against_the_real_program() {
    if !ready() {
        return;
    }
    let Some(browser) = browser() else {
        skip("no Chromium is installed; `RAILHEAD_TEST_BROWSER` names another one");
        return;
    };
    let program = Path::new(env!("CARGO_BIN_EXE_railhead"));
    let variables = [
        ("RAILHEAD_TEST_BROWSER", &*browser),
        ("RAILHEAD_BINARY", program),
    ];
    run_tests("browser", &variables);
}
