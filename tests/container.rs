//! Does the image fit the program? `Dockerfile` and `.dockerignore` against manifest, sources and command line.

use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

fn read(path: impl AsRef<Path>) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The instructions of the Dockerfile, one per line and without comments.
fn instructions() -> Vec<String> {
    let lines: Vec<String> = read("Dockerfile")
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(str::to_owned)
        .collect();
    lines
        .join("\n")
        .replace("\\\n", " ")
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect()
}

/// What follows the instruction's name, for every instruction of that name.
fn arguments(name: &str) -> Vec<String> {
    let found: Vec<String> = instructions()
        .iter()
        .filter_map(|line| Some(line.strip_prefix(name)?.strip_prefix(' ')?.to_owned()))
        .collect();
    assert!(!found.is_empty(), "no {name} in the Dockerfile");
    found
}

/// Environment variables of the image, with their values.
fn variables() -> Vec<(String, String)> {
    arguments("ENV")
        .iter()
        .flat_map(|line| line.split(' '))
        .map(|pair| {
            let (name, value) = pair.split_once('=').expect("NAME=value");
            (name.to_owned(), value.to_owned())
        })
        .collect()
}

fn help(command: &str) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_railhead"))
        .args([command, "--help"])
        .output()
        .expect("the program");
    assert!(out.status.success(), "{command} --help");
    String::from_utf8(out.stdout).expect("text")
}

#[test]
fn every_variable_of_the_image_is_a_setting_of_the_service() {
    let help = help("serve");
    for (name, _) in variables() {
        assert!(help.contains(&format!("[env: {name}=")), "{name}");
    }
}

#[test]
fn the_health_check_asks_where_the_image_listens() {
    let listen = variables()
        .into_iter()
        .find(|(name, _)| name == "RAILHEAD_LISTEN")
        .map(|(_, value)| value)
        .expect("an address to listen on");
    let port = listen.strip_prefix("0.0.0.0:").expect("all interfaces");
    assert_eq!(arguments("EXPOSE"), [port]);
    // It reads the same variable.
    assert!(help("healthcheck").contains("[env: RAILHEAD_LISTEN="));
}

#[test]
fn the_image_is_built_by_the_rust_of_the_manifest() {
    let manifest = read("Cargo.toml");
    let version = manifest
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = \""))
        .and_then(|rest| rest.strip_suffix('"'))
        .expect("rust-version");
    let builder = format!("BUILDER=docker.io/library/rust:{version}-slim-bookworm");
    assert!(arguments("ARG").contains(&builder), "{builder}");
}

#[test]
fn the_image_gets_every_file_that_is_compiled_in() {
    let ignore = read(".dockerignore");
    let sent: Vec<&str> = ignore.lines().filter_map(|l| l.strip_prefix('!')).collect();
    let copied = arguments("COPY");
    let copied: Vec<&str> = copied
        .iter()
        .filter(|line| !line.starts_with("--from"))
        .flat_map(|line| line.split(' '))
        .collect();
    let mut included = 0;
    let mut folders = vec![PathBuf::from("src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(&folder)).unwrap() {
            let entry = entry.unwrap();
            let path = folder.join(entry.file_name());
            if entry.file_type().unwrap().is_dir() {
                folders.push(path);
                continue;
            }
            if path.extension().is_none_or(|extension| extension != "rs") {
                continue;
            }
            for file in files_compiled_into(&path) {
                let top = file.iter().next().unwrap().to_str().unwrap();
                assert!(sent.contains(&top), "{file:?} is not sent to the build");
                assert!(copied.contains(&top), "{file:?} is not copied");
                included += 1;
            }
        }
    }
    assert!(included > 0, "nothing is compiled in");
}

/// The source itself and what its `include_str!` and `include_bytes!` name, from the root of the project.
fn files_compiled_into(source: &Path) -> Vec<PathBuf> {
    let text = read(source);
    let mut files = vec![source.to_owned()];
    for name in ["include_str!(", "include_bytes!("] {
        for rest in text.split(name).skip(1) {
            // Of a path that a macro puts together its folder is known.
            let rest = rest.trim_start();
            let rest = rest.strip_prefix("concat!(").unwrap_or(rest);
            let literal = rest.strip_prefix('"');
            let (path, _) = literal
                .and_then(|rest| rest.split_once('"'))
                .expect("a path");
            let mut file = source.parent().unwrap().to_owned();
            for part in Path::new(path).components() {
                match part {
                    Component::ParentDir => assert!(file.pop(), "{path} in {source:?}"),
                    other => file.push(other),
                }
            }
            files.push(file);
        }
    }
    files
}
