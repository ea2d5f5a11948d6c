//! Is the house in order? Directions of use, forbidden words, file sizes.

use std::fs;
use std::path::{Path, PathBuf};

const LINES_MAX: usize = 600;
/// The list of remarks is one table, which is read an entry at a time.
const TABLE: (&str, usize) = ("src/contact/remark/list.rs", 800);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Rust files below a folder (or the one file), with their text.
fn sources(below: &str) -> Vec<(PathBuf, String)> {
    let start = root().join(below);
    if start.is_file() {
        let text = fs::read_to_string(&start).expect("a source");
        return vec![(start, text)];
    }
    let mut found = Vec::new();
    let mut folders = vec![start];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).expect("a source");
                found.push((path, text));
            }
        }
    }
    assert!(!found.is_empty(), "no sources below {below}");
    found
}

/// Lines of code that contain one of the words; comments do not count.
fn mentions(below: &str, words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for (path, text) in sources(below) {
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or_default();
            for word in words.iter().filter(|word| code.contains(*word)) {
                let place = path.strip_prefix(root()).unwrap_or(&path).display();
                found.push(format!("{place}:{}: {word}", number + 1));
            }
        }
    }
    found
}

#[test]
fn rooms_use_only_the_rooms_before_them() {
    for (room, forbidden) in [
        (
            "src/contact",
            &[
                "crate::jobs",
                "crate::http",
                "crate::cli",
                "crate::telemetry",
            ][..],
        ),
        (
            "src/jobs",
            &["crate::http", "crate::cli", "crate::telemetry"],
        ),
        ("src/http", &["crate::cli", "crate::telemetry"]),
        (
            "src/telemetry.rs",
            &["crate::contact", "crate::jobs", "crate::http", "crate::cli"],
        ),
    ] {
        assert_eq!(mentions(room, forbidden), Vec::<String>::new(), "{room}");
    }
}

#[test]
fn stages_of_contact_use_only_the_stages_before_them() {
    for (stage, forbidden) in [
        (
            "src/contact/case.rs",
            &[
                "contact::problem",
                "contact::normal",
                "contact::tangential",
                "contact::outputs",
            ][..],
        ),
        (
            "src/contact/mesh.rs",
            &[
                "contact::normal",
                "contact::influence",
                "contact::tangential",
                "contact::outputs",
            ],
        ),
        (
            "src/contact/geometry",
            &[
                "contact::influence",
                "contact::normal",
                "contact::tangential",
                "contact::outputs",
                "contact::problem",
            ],
        ),
        (
            "src/contact/influence",
            &[
                "contact::normal",
                "contact::tangential",
                "contact::outputs",
                "contact::problem",
            ],
        ),
        (
            "src/contact/normal",
            &[
                "contact::tangential",
                "contact::outputs",
                "contact::problem",
            ],
        ),
        ("src/contact/tangential", &["contact::solution"]),
    ] {
        assert_eq!(mentions(stage, forbidden), Vec::<String>::new(), "{stage}");
    }
}

#[test]
fn contact_knows_no_files_no_clock_no_network_and_prints_nothing() {
    let words = [
        "tokio",
        "axum",
        "sqlx",
        "object_store",
        "std::env",
        "std::fs",
        "std::time::Instant",
        "std::time::SystemTime",
        "println!",
        "eprintln!",
        "tracing::",
    ];
    assert_eq!(mentions("src/contact", &words), Vec::<String>::new());
}

#[test]
fn outside_libraries_stay_in_their_rooms() {
    for (room, forbidden) in [
        (
            "src/jobs",
            &["axum", "StatusCode", "faer", "clap", "opentelemetry_otlp"][..],
        ),
        (
            "src/http",
            &[
                "sqlx",
                "object_store",
                "faer",
                "clap",
                "std::env",
                "opentelemetry_otlp",
                "opentelemetry_sdk",
            ],
        ),
        (
            "src/cli",
            &["sqlx", "object_store", "faer", "opentelemetry"],
        ),
    ] {
        assert_eq!(mentions(room, forbidden), Vec::<String>::new(), "{room}");
    }
}

#[test]
fn imports_from_the_crate_name_one_path_each() {
    assert_eq!(mentions("src", &["use crate::{"]), Vec::<String>::new());
}

#[test]
fn every_file_says_what_it_is_for_and_stays_readable() {
    for (path, text) in sources("src")
        .into_iter()
        .chain(sources("tests"))
        .chain(sources("benches"))
    {
        let name = path.display();
        assert!(
            text.starts_with("//!"),
            "{name} does not begin with its purpose"
        );
        let lines = text.lines().count();
        let most = if path.ends_with(TABLE.0) {
            TABLE.1
        } else {
            LINES_MAX
        };
        assert!(lines <= most, "{name} has {lines} lines");
    }
}

#[test]
fn every_example_is_a_case_that_can_be_asked_or_the_faulty_one() {
    for entry in fs::read_dir(root().join("api/examples")).expect("the examples") {
        let path = entry.expect("an entry").path();
        let name = path.display().to_string();
        let text = fs::read_to_string(&path).expect("an example");
        let value = serde_json::from_str(&text).expect("an example is JSON");
        if name.ends_with(".case.json") {
            let limits = railhead::contact::problem::Limits::default();
            let checked = railhead::contact::check(&value, &limits);
            assert_eq!(checked.is_err(), name.contains("faulty"), "{name}");
        }
    }
}
