//! Rules of structure, each as a function that lists the places that break it.

use std::collections::BTreeSet;

use crate::order::{DOOR, place};
use crate::sources::{Sources, code, uses};

/// Where types of `contact` may have a form as JSON.
const WORDS: [&str; 3] = [
    "src/contact/case/words/",
    "src/contact/remark/",
    "src/contact/solution/words/",
];

/// Places that break a rule, sorted.
type Findings = BTreeSet<String>;

#[test]
fn modules_use_only_what_stands_before_them_in_the_order() {
    assert_kept(order);
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    assert_kept(circles);
}

#[test]
fn other_rooms_enter_contact_by_its_door() {
    assert_kept(door);
}

#[test]
fn behind_the_check_only_problem_is_used_and_nothing_else_makes_a_problem() {
    assert_kept(checked_once);
}

#[test]
fn only_words_of_contact_derive_traits_of_serde() {
    assert_kept(words);
}

/// Fails with the places that break a rule.
fn assert_kept(rule: fn(&Sources) -> Findings) {
    let sources = Sources::below(&["src", "tests", "benches"]);
    assert_eq!(rule(&sources), Findings::new());
}

fn order(sources: &Sources) -> Findings {
    let modules = sources.modules();
    let mut wrong = Vec::new();
    for (module, targets) in uses(&modules) {
        let Some(at) = place(&module) else {
            wrong.push(format!("{module} has no place in the order"));
            continue;
        };
        for target in targets.iter().filter(|target| **target != page(&module)) {
            if place(target).is_some_and(|target| target > at) {
                wrong.push(format!("{module} uses {target}"));
            }
        }
    }
    wrong.into_iter().collect()
}

/// Files that reach themselves over the files that they use.
fn circles(sources: &Sources) -> Findings {
    let mut uses = uses(&sources.modules());
    // A file and the `mod.rs` of its folder are one unit.
    for (module, targets) in &mut uses {
        targets.remove(page(module));
    }
    let reaches_itself = |start: &&String| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&String> = uses[*start].iter().collect();
        while let Some(module) = next.pop() {
            if module == *start {
                return true;
            }
            if seen.insert(module) {
                next.extend(uses.get(module).into_iter().flatten());
            }
        }
        false
    };
    uses.keys().filter(reaches_itself).cloned().collect()
}

fn door(sources: &Sources) -> Findings {
    let inside = |module: &str| module == "contact" || module.starts_with("contact::");
    let by_door = |target: &str| {
        let below = |entry: &&str| {
            target
                .strip_prefix(*entry)
                .is_some_and(|r| r.starts_with("::"))
        };
        DOOR.contains(&target) || DOOR.iter().skip(1).any(below)
    };
    let mut wrong = Vec::new();
    for (module, targets) in uses(&sources.modules()) {
        for target in targets {
            if !inside(&module) && inside(&target) && !by_door(&target) {
                wrong.push(format!("{module} uses {target}"));
            }
        }
    }
    wrong.into_iter().collect()
}

/// The module of the `mod.rs` in the folder of a file.
fn page(module: &str) -> &str {
    module.rsplit_once("::").map_or("", |(folder, _)| folder)
}

/// The stages behind the check. Slices are cut, and rows are put together, from cases.
fn checked_once(sources: &Sources) -> Findings {
    let before = |module: &str| {
        let parts = ["case", "evaluate", "evolution", "facade", "slices"];
        module == "contact"
            || parts.iter().any(|part| {
                module
                    .strip_prefix("contact::")
                    .is_some_and(|rest| rest.split("::").next() == Some(part))
            })
    };
    let modules = sources.modules();
    let mut wrong = Vec::new();
    for (module, targets) in uses(&modules) {
        if !module.starts_with("contact") || before(&module) {
            continue;
        }
        let checks = targets.iter().filter(|target| {
            target.starts_with("contact::case") && !target.starts_with("contact::case::words")
        });
        wrong.extend(checks.map(|target| format!("{module} uses {target}")));
    }
    let makers = ["src/contact/case/", "src/contact/problem/"];
    for (path, text) in sources.within("src/") {
        let maker = makers.iter().any(|folder| path.starts_with(folder));
        let code = code(text);
        if !maker
            && ["Checked::without_faults", " Problem {"]
                .iter()
                .any(|made| code.contains(made))
        {
            wrong.push(format!("{path} makes a `Problem`"));
        }
    }
    wrong.into_iter().collect()
}

fn words(sources: &Sources) -> Findings {
    let derives = |text: &str| {
        let code = code(text);
        let derives = code.split("#[derive(").skip(1);
        derives
            .filter_map(|rest| rest.split_once(')'))
            .any(|(traits, _)| traits.contains("Serialize") || traits.contains("Deserialize"))
    };
    let files = sources.within("src/contact/");
    let wrong = files.filter(|(path, text)| {
        !WORDS.iter().any(|folder| path.starts_with(folder)) && derives(text)
    });
    wrong.map(|(path, _)| path.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(findings: &Findings) -> Vec<&str> {
        findings.iter().map(String::as_str).collect()
    }

    #[test]
    fn a_stage_that_checks_again_or_makes_a_problem_is_found() {
        let planted = Sources::planted(&[
            (
                "src/contact/normal_stage.rs",
                "use crate::contact::case::checks::normal_force;",
            ),
            (
                "src/contact/solution/finish.rs",
                "use crate::contact::case::words::question::Case;",
            ),
            ("src/contact/case/checks.rs", "let asked = Problem {};"),
            ("src/contact/case/words/question.rs", ""),
            ("src/contact/forecast.rs", "let other = Problem {};"),
        ]);
        let found = checked_once(&planted);
        assert_eq!(
            names(&found),
            [
                "contact::normal_stage uses contact::case::checks",
                "src/contact/forecast.rs makes a `Problem`",
            ]
        );
    }

    #[test]
    fn a_use_of_a_later_stage_breaks_the_order() {
        let planted = Sources::planted(&[
            (
                "src/contact/mesh/strips.rs",
                "use crate::contact::normal::hertz::Ellipse;",
            ),
            (
                "src/contact/normal/hertz.rs",
                "use crate::contact::mesh::strips::Mesh;",
            ),
            ("src/contact/unheard_of.rs", ""),
            ("src/jobs/clock.rs", "use crate::http::Options;"),
            ("src/http/mod.rs", ""),
        ]);
        assert_eq!(
            names(&order(&planted)),
            [
                "contact::mesh::strips uses contact::normal::hertz",
                "contact::unheard_of has no place in the order",
                "jobs::clock uses http",
            ]
        );
    }

    #[test]
    fn files_that_use_each_other_are_named_and_those_between_circles_are_not() {
        let planted = Sources::planted(&[
            ("src/a.rs", "use crate::b::B;"),
            ("src/b.rs", "use crate::c::C;"),
            ("src/c.rs", "use crate::a::A;\nuse crate::d::D;"),
            ("src/d.rs", "use crate::e::E;"),
            ("src/e.rs", "use crate::f::F;"),
            ("src/f.rs", "use crate::e::E;"),
        ]);
        assert_eq!(names(&circles(&planted)), ["a", "b", "c", "e", "f"]);
        let rootless = Sources::planted(&[("src/a.rs", "use crate::absent::B;")]);
        assert_eq!(circles(&rootless), Findings::new());
    }

    #[test]
    fn the_inside_of_contact_is_behind_its_door() {
        let planted = Sources::planted(&[
            (
                "src/contact/mod.rs",
                "use crate::contact::normal::hertz::solve;",
            ),
            ("src/contact/normal/hertz.rs", ""),
            ("src/contact/error.rs", ""),
            (
                "src/jobs/worker.rs",
                "use crate::contact::error::SolveError;\nuse crate::contact::normal::hertz::solve;\nuse crate::contact::check;",
            ),
        ]);
        assert_eq!(
            names(&door(&planted)),
            ["jobs::worker uses contact::normal::hertz"]
        );
    }

    #[test]
    fn numbers_with_a_form_as_json_are_named() {
        let planted = Sources::planted(&[
            (
                "src/contact/level.rs",
                "#[derive(\n    Debug,\n    Serialize,\n)]\nstruct Level;",
            ),
            (
                "src/contact/mesh/strips.rs",
                "#[derive(Debug)]\nstruct Mesh;",
            ),
            (
                "src/contact/solution/words/answer.rs",
                "#[derive(Serialize)]\nstruct Words;",
            ),
            ("src/http/job.rs", "#[derive(Serialize)]\nstruct Job;"),
        ]);
        assert_eq!(names(&words(&planted)), ["src/contact/level.rs"]);
    }
}
