//! Tests of rules that neither the compiler nor clippy checks: comments, links and examples.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// Returns the Rust files below some folders of the project, by their path from its root.
fn sources(folders: &[&str]) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    let mut folders: Vec<PathBuf> = folders.iter().map(|name| root().join(name)).collect();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let place = path.strip_prefix(root()).expect("below the root");
                let text = fs::read_to_string(&path).expect("a source");
                found.insert(place.display().to_string(), text);
            }
        }
    }
    found
}

/// Requires a comment on every constant of the physics: on the line above it, or above the group that it belongs to. In files dedicated to
/// constants, every constant needs its own.
#[test]
fn every_number_of_the_physics_says_what_it_is() {
    let mut bare = Vec::new();
    for (path, text) in sources(&["src/contact"]) {
        let mut above = "";
        for (number, line) in text.lines().enumerate() {
            if line.starts_with("mod tests") || path.ends_with("/tests.rs") {
                break;
            }
            let declared = line.trim_start_matches("pub(crate) ");
            let declared = declared.trim_start_matches("pub ");
            let kind = declared
                .strip_prefix("const ")
                .and_then(|rest| rest.split_once(": "))
                .map_or("", |(_, kind)| kind);
            let is_number = ["f64", "f32", "u32", "u64", "usize", "[f64", "(f64"]
                .iter()
                .any(|number| kind.starts_with(number));
            let grouped = above.contains("const ") && !path.ends_with("/constants.rs");
            if is_number && !above.starts_with("///") && !grouped {
                bare.push(format!("{path}:{}: {line}", number + 1));
            }
            above = line;
        }
    }
    assert_eq!(bare, Vec::<String>::new());
}

#[test]
fn every_file_says_what_it_is_for() {
    let silent = sources(&["src", "tests", "benches"])
        .into_iter()
        .filter(|(_, text)| !text.starts_with("//!"));
    let silent: Vec<String> = silent.map(|(path, _)| path).collect();
    assert_eq!(silent, Vec::<String>::new());
}

/// Returns files that comments name as `name.rs` and that exist neither in the package of the comment nor among tests and benches.
fn names_of_no_file(sources: &BTreeMap<String, String>) -> Vec<String> {
    let mut stale = Vec::new();
    for (path, text) in sources.iter().filter(|(path, _)| path.starts_with("src/")) {
        let package: Vec<&str> = path.split('/').take(2).collect();
        let package = package.join("/");
        let places = [package.as_str(), "tests/", "benches/"];
        let exists = |name: &str| {
            let beside = |file: &&String| places.iter().any(|place| file.starts_with(place));
            let named = |file: &String| file.ends_with(&format!("/{name}")) || file == name;
            sources.keys().filter(beside).any(named)
        };
        for (number, line) in text.lines().enumerate() {
            let comment = line.split_once("//").map_or("", |(_, comment)| comment);
            let quoted = comment.split('`').skip(1).step_by(2);
            let names = quoted.filter(|name| name.ends_with(".rs") && !name.contains('*'));
            let gone = names.filter(|name| !exists(name));
            stale.extend(gone.map(|name| format!("{path}:{}: {name}", number + 1)));
        }
    }
    stale
}

#[test]
fn files_that_comments_name_exist() {
    let planted = [
        ("src/jobs/a.rs", "//! See `b.rs`, `c/d.rs` and `gone.rs`."),
        ("src/jobs/b.rs", "// `a.rs`, `tests/t.rs` and `c/b.rs`"),
        ("tests/t.rs", ""),
        ("src/jobs/c/d.rs", ""),
        ("src/http/gone.rs", ""),
    ]
    .map(|(path, text)| (path.to_owned(), text.to_owned()));
    assert_eq!(
        names_of_no_file(&planted.into()),
        ["src/jobs/a.rs:1: gone.rs", "src/jobs/b.rs:1: c/b.rs"]
    );
    let found = names_of_no_file(&sources(&["src", "tests", "benches"]));
    assert_eq!(found, Vec::<String>::new());
}

/// Returns the targets of a document's relative links that do not exist.
fn dead_links(document: &Path, text: &str) -> Vec<String> {
    let folder = document.parent().expect("a folder");
    let links = text.split("](").skip(1);
    let targets = links.filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    let targets = targets.filter(|target| !target.contains("://") && !target.starts_with('#'));
    let files = targets.map(|target| target.split('#').next().unwrap_or_default());
    files
        .filter(|file| !folder.join(file).exists())
        .map(|file| format!("{}: {file}", document.display()))
        .collect()
}

#[test]
fn links_of_the_documents_lead_somewhere() {
    let mut dead = dead_links(&root().join("x.md"), "[a](src) [b](none.rs) [c](https://x)");
    assert_eq!(dead.len(), 1, "{dead:?}");
    dead.clear();
    for folder in [
        "",
        "docs",
        "api",
        "tests/data",
        "docs/paper-figures",
        "docs/page",
    ] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|e| e == "md") {
                let text = fs::read_to_string(&path).expect("a document");
                dead.extend(dead_links(&path, &text));
            }
        }
    }
    assert_eq!(dead, Vec::<String>::new());
}

#[test]
fn scripts_of_the_page_begin_with_their_purpose() {
    let mut folders = vec![
        root().join("src/http/page/web/js"),
        root().join("tests/page"),
    ];
    let mut silent = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.display().to_string();
            if path.is_dir() {
                let made = ["node_modules", "types", "output"];
                if !made.iter().any(|made| path.ends_with(made)) {
                    folders.push(path);
                }
            } else if name.ends_with(".js") || name.ends_with(".mjs") {
                let text = fs::read_to_string(&path).expect("a script");
                if !text.starts_with("// ") {
                    silent.push(name);
                }
            }
        }
    }
    assert_eq!(silent, Vec::<String>::new());
}

#[test]
fn every_example_is_a_case_that_can_be_asked_or_the_faulty_one() {
    for entry in fs::read_dir(root().join("api/examples")).expect("the examples") {
        let path = entry.expect("an entry").path();
        let name = path.display().to_string();
        let text = fs::read_to_string(&path).expect("an example");
        let value = serde_json::from_str(&text).expect("an example is JSON");
        if name.ends_with(".case.json") {
            let limits = railhead_contact::case::solver::Limits::default();
            let checked = railhead_contact::check(&value, &limits);
            assert_eq!(checked.is_err(), name.contains("faulty"), "{name}");
        }
    }
}
