//! The rules with exceptions: what breaks each of them. The exceptions that are left stand in `exceptions.txt`.

use std::collections::{BTreeMap, BTreeSet};

use crate::lengths::functions;
use crate::order::{DOOR, place};
use crate::sources::{Sources, code, uses};

/// Lines of a file at most.
pub const FILE_LINES_MAX: usize = 450;
/// Lines of a function at most, from `fn` to its closing brace.
pub const FUNCTION_LINES_MAX: usize = 70;
/// Where types of `contact` may have a form as JSON.
const WORDS: [&str; 3] = [
    "src/contact/case/words/",
    "src/contact/remark/",
    "src/contact/solution/words/",
];

/// What breaks a rule, and by how much where that can be counted.
pub type Findings = BTreeMap<String, usize>;

/// A rule: its name in the list of exceptions, what it asks for, and what breaks it.
pub struct Rule {
    pub name: &'static str,
    pub asks: &'static str,
    pub find: fn(&Sources) -> Findings,
}

/// All rules that may have exceptions.
pub const RULES: [Rule; 10] = [
    Rule {
        name: "order",
        asks: "modules use only what stands before them in `order.rs`",
        find: order,
    },
    Rule {
        name: "circles",
        asks: "no files use each other in a circle",
        find: circles,
    },
    Rule {
        name: "door",
        asks: "other rooms enter `contact` by its door, see `order.rs`",
        find: door,
    },
    Rule {
        name: "visible imports",
        asks: "imports are `use crate::` with one path each, at the top",
        find: hidden_imports,
    },
    Rule {
        name: "pages",
        asks: "no file imports the `mod.rs` of its own folder",
        find: pages,
    },
    Rule {
        name: "type names",
        asks: "no type name occurs twice in a room",
        find: type_names,
    },
    Rule {
        name: "checked once",
        asks: "behind the check only `problem` is used, not the checks of `case`, and nothing else makes a `Problem`",
        find: checked_once,
    },
    Rule {
        name: "words",
        asks: "in `contact` only the words of case, remarks and solution derive serde's traits",
        find: words,
    },
    Rule {
        name: "file lines",
        asks: "a file has at most 450 lines",
        find: file_lines,
    },
    Rule {
        name: "function lines",
        asks: "a function has at most 70 lines",
        find: function_lines,
    },
];

fn found(what: impl IntoIterator<Item = String>) -> Findings {
    what.into_iter().map(|what| (what, 0)).collect()
}

fn order(sources: &Sources) -> Findings {
    let modules = sources.modules();
    let mut wrong = Vec::new();
    for (module, targets) in uses(&modules) {
        let Some(at) = place(&module) else {
            wrong.push(format!("{module} has no place in the order"));
            continue;
        };
        // The own page is a matter of the rule on pages.
        for target in targets.iter().filter(|target| **target != page(&module)) {
            if place(target).is_some_and(|target| target > at) {
                wrong.push(format!("{module} uses {target}"));
            }
        }
    }
    found(wrong)
}

/// Files that reach themselves over the files that they use.
fn circles(sources: &Sources) -> Findings {
    let uses = uses(&sources.modules());
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
    found(uses.keys().filter(reaches_itself).cloned())
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
    found(wrong)
}

fn hidden_imports(sources: &Sources) -> Findings {
    let mut wrong = Vec::new();
    for (path, text) in sources.within("src/") {
        // The shared statements are compiled below each database and have no path of their own.
        if path.ends_with("/tests.rs") || path.starts_with("src/jobs/store/sql/") {
            continue;
        }
        for line in code(text).lines().map(str::trim) {
            // `pub(in crate::…)` names a scope, and a macro cannot import where it is used.
            let shown = line.replace("pub(in crate::", "").replace("$crate::", "");
            let grouped = shown.contains("use crate::{");
            let in_between = shown.contains("crate::") && !shown.contains("use crate::");
            if grouped || in_between || shown.contains("super::") {
                wrong.push(format!("{path}: {line}"));
            }
        }
    }
    found(wrong)
}

/// The module of the `mod.rs` in the folder of a file.
fn page(module: &str) -> &str {
    module.rsplit_once("::").map_or("", |(folder, _)| folder)
}

fn pages(sources: &Sources) -> Findings {
    let modules = sources.modules();
    let uses = uses(&modules);
    let wrong = uses
        .iter()
        .filter(|(module, targets)| targets.contains(page(module)));
    found(wrong.map(|(module, _)| module.clone()))
}

fn type_names(sources: &Sources) -> Findings {
    let mut places: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    for (module, code) in sources.modules() {
        let room = module.split("::").next().unwrap_or_default().to_owned();
        for line in code.lines() {
            let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_');
            let first = words.find(|word| !["pub", "crate", "super", "in", ""].contains(word));
            let declares = matches!(first, Some("struct" | "enum" | "trait" | "type"));
            let indented = line.starts_with(' ');
            // What the types of each database are called for the shared statements.
            let engine = first == Some("type") && module.ends_with("::engine");
            if let (true, false, Some(name)) = (declares && !engine, indented, words.next()) {
                let key = (room.clone(), name.to_owned());
                places.entry(key).or_default().push(module.clone());
            }
        }
    }
    let twice = places.into_iter().filter(|(_, places)| places.len() > 1);
    found(twice.map(|((_, name), places)| format!("{name}: {}", places.join(", "))))
}

/// The stages behind the check. Slices are cut, and rows are put together, from cases.
fn checked_once(sources: &Sources) -> Findings {
    let before = |module: &str| {
        let parts = ["case", "evaluate", "slices"];
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
    found(wrong)
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
    found(wrong.map(|(path, _)| path.to_owned()))
}

fn file_lines(sources: &Sources) -> Findings {
    let files = sources.within("");
    files
        .map(|(path, text)| (path.to_owned(), text.lines().count()))
        .filter(|(_, lines)| *lines > FILE_LINES_MAX)
        .collect()
}

fn function_lines(sources: &Sources) -> Findings {
    let mut wrong = Findings::new();
    for (path, text) in sources.within("") {
        for (name, lines) in functions(text) {
            if lines > FUNCTION_LINES_MAX {
                let entry = wrong.entry(format!("{path}: {name}")).or_default();
                *entry = lines.max(*entry);
            }
        }
    }
    wrong
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(findings: &Findings) -> Vec<&str> {
        findings.keys().map(String::as_str).collect()
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
    fn imports_that_the_check_cannot_see_are_named() {
        let planted = Sources::planted(&[(
            "src/a.rs",
            "use crate::{b, c};\nuse crate::d::D;\nuse super::e;\nlet f = crate::g::h();\npub(in crate::b) fn x() {}\n#[cfg(test)]\nmod tests { use super::*; }",
        )]);
        assert_eq!(
            names(&hidden_imports(&planted)),
            [
                "src/a.rs: let f = crate::g::h();",
                "src/a.rs: use crate::{b, c};",
                "src/a.rs: use super::e;",
            ]
        );
    }

    #[test]
    fn an_import_of_the_own_page_is_named() {
        let planted = Sources::planted(&[
            ("src/a/mod.rs", "use crate::a::c::C;"),
            ("src/a/b.rs", "use crate::a::Page;"),
            ("src/a/c.rs", "use crate::a::b::B;"),
        ]);
        assert_eq!(names(&pages(&planted)), ["a::b"]);
    }

    #[test]
    fn a_name_may_occur_in_two_rooms_but_not_twice_in_one() {
        let planted = Sources::planted(&[
            ("src/a/b.rs", "pub(super) struct Work {\n}\nstruct Other;"),
            (
                "src/a/c.rs",
                "enum Work<'a> {\n}\nimpl X {\n    type Other = u8;\n}",
            ),
            ("src/d.rs", "pub struct Other;"),
        ]);
        assert_eq!(names(&type_names(&planted)), ["Work: a::b, a::c"]);
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

    #[test]
    fn long_files_and_functions_are_counted() {
        let body = "        let x = 1;\n".repeat(69);
        let long = format!(
            "impl A {{\n    pub(crate) const fn long(\n        a: u8,\n    ) {{\n{body}    }}\n}}\n"
        );
        let fits = format!("fn fits() {{\n{}}}\n", "    a();\n".repeat(68));
        let text = format!(
            "{long}{fits}trait T {{\n    fn declared(&self);\n}}\nfn short() {{}}\n{}",
            "// \n".repeat(400)
        );
        let planted = Sources::planted(&[("benches/a.rs", &text), ("src/b.rs", &fits)]);
        let lines = text.lines().count();
        assert_eq!(
            file_lines(&planted),
            Findings::from([("benches/a.rs".to_owned(), lines)])
        );
        assert_eq!(
            function_lines(&planted),
            Findings::from([("benches/a.rs: long".to_owned(), 73)])
        );
    }
}
