//! The folders of `contact` use each other in one direction, seen as wholes: what a stage needs of a later one belongs to an earlier one.

use std::collections::{BTreeMap, BTreeSet};

use crate::sources::{Sources, uses};

/// Vocabularies: types with a form as JSON and no arithmetic, which stages may use that stand before the rest of their folder.
const WORDS: [&str; 2] = ["contact::case::words", "contact::solution::words"];

/// The folder below `contact` that a module belongs to, or the module itself if it stands in none; nothing outside `contact`.
fn folder(module: &str) -> Option<String> {
    let below = |words: &&&str| module == **words || module.starts_with(&format!("{words}::"));
    if let Some(words) = WORDS.iter().find(below) {
        return Some((*words).to_owned());
    }
    let name = module.strip_prefix("contact::")?.split("::").next()?;
    Some(format!("contact::{name}"))
}

/// Folders that reach themselves over the folders that they use, each with those on the way.
fn circles(sources: &Sources) -> Vec<String> {
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, targets) in uses(&sources.modules()) {
        let Some(from) = folder(&module) else {
            continue;
        };
        let targets = targets.iter().filter_map(|target| folder(target));
        let others = targets.filter(|target| *target != from);
        graph.entry(from.clone()).or_default().extend(others);
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
fn folders_of_the_physics_use_each_other_in_one_direction() {
    assert_eq!(
        circles(&Sources::below(&["src"])),
        Vec::<String>::new(),
        "a type that an earlier folder needs belongs there, or into the words"
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
