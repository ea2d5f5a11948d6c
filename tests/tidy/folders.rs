//! Folders use each other in one direction, seen as wholes and at every depth: what a folder needs of a later one belongs to an earlier one.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{Sources, uses};

/// Vocabularies: types with a form as JSON and no arithmetic, which stages may use that stand before the rest of their folder. They
/// count as folders of the room.
const WORDS: [&str; 2] = ["contact::case::words", "contact::solution::words"];

/// The path of a module, in which vocabularies stand beside their folders.
fn path(module: &str) -> Vec<String> {
    let lifted = WORDS.iter().find_map(|words| {
        let rest = module.strip_prefix(words)?;
        let (room, name) = words.split_once("::")?;
        (rest.is_empty() || rest.starts_with("::"))
            .then(|| format!("{room}::{}{rest}", name.replace("::", " ")))
    });
    let parts = lifted.as_deref().unwrap_or(module).split("::");
    parts.map(str::to_owned).collect()
}

/// The two folders or files of one folder to which two modules belong; nothing if one of the modules is a folder of the other.
fn siblings(user: &str, used: &str) -> Option<[String; 2]> {
    let paths = [path(user), path(used)];
    let depth = paths[0].iter().zip(&paths[1]).position(|(a, b)| a != b)?;
    Some(paths.map(|path| path[..=depth].join("::")))
}

/// Folders and files that reach themselves over those beside them that they use, each with those on the way.
fn circles(sources: &Sources) -> Vec<String> {
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, targets) in uses(&sources.modules()) {
        for [user, used] in targets.iter().filter_map(|used| siblings(&module, used)) {
            graph.entry(user).or_default().insert(used);
        }
    }
    let reached = |start: &str| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&str> = vec![start];
        while let Some(folder) = next.pop() {
            for target in graph.get(folder).into_iter().flatten() {
                if seen.insert(target.as_str()) {
                    next.push(target);
                }
            }
        }
        seen
    };
    let all: BTreeMap<&str, BTreeSet<&str>> = graph
        .keys()
        .map(|folder| (folder.as_str(), reached(folder)))
        .collect();
    let back = |(folder, seen): (&&str, &BTreeSet<&str>)| {
        let round = seen
            .iter()
            .filter(|other| all.get(*other).is_some_and(|seen| seen.contains(folder)));
        let round: Vec<&str> = round.copied().collect();
        (!round.is_empty()).then(|| format!("{folder}: {}", round.join(", ")))
    };
    all.iter().filter_map(back).collect()
}

#[test]
fn folders_use_each_other_in_one_direction() {
    assert_eq!(
        circles(&Sources::below(&["src"])),
        Vec::<String>::new(),
        "a type that an earlier folder needs belongs there, or into the words of the room"
    );
}

#[test]
fn folders_that_use_each_other_are_found_also_over_a_third_one_and_words_stand_alone() {
    let planted = Sources::planted(&[
        (
            "src/contact/post/a.rs",
            "use crate::contact::solution::words::b::B;",
        ),
        ("src/contact/solution/words/b.rs", "pub struct B;"),
        (
            "src/contact/solution/c.rs",
            "use crate::contact::post::a::A;",
        ),
    ]);
    assert_eq!(circles(&planted), Vec::<String>::new());
    let planted = Sources::planted(&[
        (
            "src/contact/post/a.rs",
            "use crate::contact::rolling::d::D;",
        ),
        (
            "src/contact/rolling/d.rs",
            "use crate::contact::solution::c::C;",
        ),
        (
            "src/contact/solution/c.rs",
            "use crate::contact::post::e::E;",
        ),
        ("src/contact/post/e.rs", "pub struct E;"),
    ]);
    assert_eq!(circles(&planted).len(), 3, "{:?}", circles(&planted));
}

#[test]
fn a_circle_is_found_at_any_depth_and_between_a_folder_and_a_file() {
    let planted = Sources::planted(&[
        ("src/jobs/store/sql/a.rs", "use crate::jobs::error::E;"),
        ("src/jobs/store/fault.rs", "pub struct F;"),
        ("src/jobs/error.rs", "use crate::jobs::store::fault::F;"),
        (
            "src/http/render/map/b.rs",
            "use crate::http::render::table::T;",
        ),
        ("src/http/render/map/mod.rs", "pub mod b;"),
        (
            "src/http/render/table.rs",
            "use crate::http::render::map::c::C;",
        ),
        ("src/http/render/map/c.rs", "pub struct C;"),
    ]);
    let found = circles(&planted);
    let folders: Vec<_> = found
        .iter()
        .filter_map(|line| line.split(": ").next())
        .collect();
    assert_eq!(
        folders,
        [
            "http::render::map",
            "http::render::table",
            "jobs::error",
            "jobs::store"
        ]
    );
}
