//! Tests that the image fits the program: `Dockerfile` and `.dockerignore` against manifest, sources and command line.

use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

fn read(path: impl AsRef<Path>) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Returns the instructions of the Dockerfile, one per line and without comments.
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

/// Returns the arguments of every instruction with this name.
fn arguments(name: &str) -> Vec<String> {
    let found: Vec<String> = instructions()
        .iter()
        .filter_map(|line| Some(line.strip_prefix(name)?.strip_prefix(' ')?.to_owned()))
        .collect();
    assert!(!found.is_empty(), "no {name} in the Dockerfile");
    found
}

/// Returns the environment variables of the image, with their values.
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
    // The health check reads the same variable.
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

/// Returns the source and the files in its `include_str!` and `include_bytes!`, from the root of the project.
fn files_compiled_into(source: &Path) -> Vec<PathBuf> {
    let text = read(source);
    let mut files = vec![source.to_owned()];
    for name in ["include_str!(", "include_bytes!("] {
        for rest in text.split(name).skip(1) {
            // For a path built by a macro, only its folder is known.
            let rest = rest.trim_start();
            let rest = rest.strip_prefix("concat!(").unwrap_or(rest);
            let literal = rest.strip_prefix('"');
            let (path, _) = literal
                .and_then(|rest| rest.split_once('"'))
                .expect("a path");
            let mut file = source.parent().unwrap().to_owned();
            for part in Path::new(path).components() {
                match part {
                    Component::ParentDir => assert!(file.pop(), "{path} in {}", source.display()),
                    other => file.push(other),
                }
            }
            files.push(file);
        }
    }
    files
}

/// Returns the manifests by name, without the one that lists them.
fn manifests() -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("deploy/kustomize");
    let names = fs::read_dir(folder).expect("the manifests");
    let names = names.map(|entry| {
        entry
            .expect("an entry")
            .file_name()
            .into_string()
            .expect("a name")
    });
    let mut names: Vec<String> = names.filter(|name| name != "kustomization.yaml").collect();
    names.sort();
    let text = |name: String| (name.clone(), read(format!("deploy/kustomize/{name}")));
    names.into_iter().map(text).collect()
}

#[test]
fn every_manifest_is_applied() {
    let list = read("deploy/kustomize/kustomization.yaml");
    let mut listed: Vec<&str> = list
        .lines()
        .filter_map(|line| line.strip_prefix("  - "))
        .collect();
    listed.retain(|line| line.ends_with(".yaml"));
    listed.sort_unstable();
    let there = manifests();
    assert_eq!(
        there.iter().map(|(name, _)| name).collect::<Vec<_>>(),
        listed
    );
    let version = env!("CARGO_PKG_VERSION");
    assert!(
        list.contains(&format!("newTag: \"{version}\"")),
        "another version"
    );
}

#[test]
fn every_flag_and_variable_of_a_manifest_is_a_setting() {
    let mut flags = 0;
    for (name, text) in manifests() {
        let arguments = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix("args: ["));
        for line in arguments {
            let words: Vec<&str> = line.trim_end_matches(']').split(", ").collect();
            let help = help(words[0]);
            for flag in words.iter().filter(|word| word.starts_with("--")) {
                assert!(help.contains(&format!("{flag} ")), "{name}: {flag}");
                flags += 1;
            }
        }
        let help = help("serve");
        let variables = text.lines().filter_map(|line| line.trim().split_once(':'));
        for (variable, _) in variables.filter(|(variable, _)| variable.starts_with("RAILHEAD_")) {
            assert!(help.contains(&format!("{variable}=")), "{name}: {variable}");
        }
    }
    assert!(flags > 5);
}

#[test]
fn every_figure_that_alerts_and_the_autoscaler_ask_for_is_told() {
    let manual = read("docs/operations.md");
    let asked = read("deploy/alerts.yaml") + &read("deploy/kustomize/autoscaling.yaml");
    let word = |c: char| !c.is_ascii_alphanumeric() && c != '_';
    let figures: Vec<&str> = asked
        .split(word)
        .filter(|word| word.starts_with("railhead_"))
        .collect();
    assert!(figures.len() > 8);
    for figure in figures {
        assert!(
            manual.contains(figure),
            "{figure} is not in docs/operations.md"
        );
    }
}
