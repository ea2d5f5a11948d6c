//! The Rust files of the project as text, and what can be read from their lines.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Rust files by their path from the root of the project, with `/`.
#[derive(Debug, Default)]
pub struct Sources(pub BTreeMap<String, String>);

pub fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

impl Sources {
    /// All files below some folders of the project.
    pub fn below(folders: &[&str]) -> Sources {
        let mut found = BTreeMap::new();
        let mut folders: Vec<PathBuf> = folders.iter().map(|name| root().join(name)).collect();
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|e| e == "rs") {
                    let place = path.strip_prefix(root()).expect("below the root");
                    let name = place.display().to_string().replace('\\', "/");
                    let text = fs::read_to_string(&path).expect("a source");
                    found.insert(name, text);
                }
            }
        }
        Sources(found)
    }

    /// Files made up for a test of a rule.
    pub fn planted(files: &[(&str, &str)]) -> Sources {
        let owned = |(path, text): &(&str, &str)| ((*path).to_owned(), (*text).to_owned());
        Sources(files.iter().map(owned).collect())
    }

    /// The files whose path begins so.
    pub fn within<'a>(&'a self, start: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
        let files = self.0.iter();
        files
            .filter(move |(path, _)| path.starts_with(start))
            .map(|(path, text)| (path.as_str(), text.as_str()))
    }

    /// The modules of the program with their code, unit tests left out; the crate root is `""`.
    pub fn modules(&self) -> BTreeMap<String, String> {
        let files = self.within("src/");
        files
            .filter(|(path, _)| *path != "src/main.rs" && !path.ends_with("/tests.rs"))
            .filter(|(path, _)| !path.contains("/examples/"))
            .map(|(path, text)| (module(path), code(text)))
            .collect()
    }
}

/// `src/contact/normal/region.rs` is the module `contact::normal`.
pub fn module(path: &str) -> String {
    let path = path.strip_prefix("src/").unwrap_or(path);
    let path = path.strip_suffix(".rs").unwrap_or(path);
    let path = path.strip_suffix("/mod").unwrap_or(path);
    if path == "lib" {
        return String::new();
    }
    path.replace('/', "::")
}

/// The lines of a file without comments, up to its unit tests.
pub fn code(text: &str) -> String {
    let lines = text.lines();
    let before_tests = lines.take_while(|line| !line.starts_with("#[cfg(test)]"));
    let without_comments = before_tests.map(|line| line.split("//").next().unwrap_or_default());
    without_comments.collect::<Vec<_>>().join("\n")
}

/// The paths of one `use` tree, groups written out.
fn paths(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((prefix, rest)) = tree.split_once('{') else {
        return vec![tree.to_owned()];
    };
    let rest = rest.trim_end();
    let inner = rest.strip_suffix('}').unwrap_or(rest);
    let (mut depth, mut parts, mut part) = (0, Vec::new(), String::new());
    for c in inner.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if c == ',' && depth == 0 {
            parts.push(std::mem::take(&mut part));
        } else {
            part.push(c);
        }
    }
    parts.push(part);
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts
        .flat_map(|part| paths(part))
        .map(|path| format!("{prefix}{path}"))
        .collect()
}

/// Which modules each module uses: the longest module that a path of a `use crate::` statement begins with, at last the crate root.
pub fn uses(modules: &BTreeMap<String, String>) -> BTreeMap<String, BTreeSet<String>> {
    let target = |path: String| {
        // The shared statements are compiled below each database.
        let path = ["sqlite", "postgres"].iter().fold(path, |path, database| {
            let copy = format!("jobs::store::{database}::sql::");
            path.replace(&copy, "jobs::store::sql::")
        });
        let mut module = path.as_str();
        // Planted sources need not contain the root or all ancestors of a module.
        while !module.is_empty() && !modules.contains_key(module) {
            module = module.rsplit_once("::").map_or("", |(before, _)| before);
        }
        module.to_owned()
    };
    let used = |name: &String, code: &String| {
        let statements = code.split("use crate::").skip(1);
        let trees = statements.filter_map(|rest| rest.split_once(';'));
        let targets = trees.flat_map(|(tree, _)| paths(tree)).map(target);
        targets.filter(|target| target != name).collect()
    };
    let pairs = modules.iter();
    pairs
        .map(|(name, code)| (name.clone(), used(name, code)))
        .collect()
}

#[test]
fn trees_of_imports_are_written_out() {
    assert_eq!(
        paths("a::{b, c::{D, e::F}, G}"),
        ["a::b", "a::c::D", "a::c::e::F", "a::G"]
    );
    assert_eq!(paths("a::{\n    b,\n    c,\n}"), ["a::b", "a::c"]);
}

#[test]
fn modules_are_named_by_their_files_and_tests_do_not_count() {
    let sources = Sources::planted(&[
        ("src/lib.rs", "pub mod a;"),
        ("src/a/mod.rs", "mod b;"),
        (
            "src/a/b.rs",
            "use crate::a::C; // use crate::x\n#[cfg(test)]\nmod tests { use crate::c::D; }",
        ),
        ("src/c.rs", "pub use crate::a::{b::E,\n    F};"),
    ]);
    let modules = sources.modules();
    assert_eq!(modules.keys().collect::<Vec<_>>(), ["", "a", "a::b", "c"]);
    let uses = uses(&modules);
    assert_eq!(uses["a::b"], BTreeSet::from(["a".to_owned()]));
    assert_eq!(
        uses["c"],
        BTreeSet::from(["a".to_owned(), "a::b".to_owned()])
    );
}

#[test]
fn a_path_without_a_module_of_its_own_counts_for_the_root() {
    let sources = Sources::planted(&[("src/a.rs", "use crate::absent::deeper::B;")]);
    let uses = uses(&sources.modules());
    assert_eq!(uses["a"], BTreeSet::from([String::new()]));
}
