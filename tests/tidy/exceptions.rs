//! The list of exceptions, which may only shrink: a rule that is broken beyond it fails, and so does an entry that is needed no more.
//!
//! `RAILHEAD_TIDY=shrink cargo test --test tidy` takes out of `exceptions.txt` what is needed no more and lowers the numbers; it never adds.

use std::collections::BTreeMap;
use std::fs;

use crate::rules::{Findings, RULES};
use crate::sources::{Sources, root};

const PATH: &str = "tests/tidy/exceptions.txt";
const HEAD: &str = "\
# What breaks the rules of `rules.rs`, by rule. The list may only shrink:
# RAILHEAD_TIDY=shrink cargo test --test tidy
# takes out what is needed no more. A number is the most that is allowed.
";

/// The exceptions of each rule.
type Exceptions = BTreeMap<String, Findings>;

fn read(text: &str) -> Exceptions {
    let mut exceptions = Exceptions::new();
    let mut rule = String::new();
    for line in text.lines() {
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        if let Some(name) = line
            .strip_prefix('[')
            .and_then(|rest| rest.strip_suffix(']'))
        {
            rule = name.to_owned();
            continue;
        }
        let number = line.rsplit_once(' ').and_then(|(what, number)| {
            let number = number.parse().ok()?;
            Some((what.to_owned(), number))
        });
        let (what, most) = number.unwrap_or_else(|| (line.to_owned(), 0));
        exceptions
            .entry(rule.clone())
            .or_default()
            .insert(what, most);
    }
    exceptions
}

fn written(exceptions: &Exceptions) -> String {
    format!("{HEAD}{}", entries(exceptions))
}

/// Exceptions as they stand in the list, in the order of the rules.
fn entries(exceptions: &Exceptions) -> String {
    let mut text = String::new();
    for rule in &RULES {
        let Some(entries) = exceptions.get(rule.name).filter(|e| !e.is_empty()) else {
            continue;
        };
        text.push_str(&format!("\n[{}]\n", rule.name));
        for (what, most) in entries {
            match most {
                0 => text.push_str(&format!("{what}\n")),
                _ => text.push_str(&format!("{what} {most}\n")),
            }
        }
    }
    text
}

/// What breaks a rule beyond its exceptions.
fn beyond(found: &Findings, allowed: &Findings) -> Findings {
    let beyond = found
        .iter()
        .filter(|(what, number)| allowed.get(*what).is_none_or(|most| *number > most));
    beyond
        .map(|(what, number)| (what.clone(), *number))
        .collect()
}

/// Exceptions that nothing needs, or not that much of.
fn shrunk(found: &Findings, allowed: &Findings) -> Findings {
    let needed = allowed.iter().filter_map(|(what, most)| {
        let number = found.get(what)?;
        Some((what.clone(), *number.min(most)))
    });
    needed.collect()
}

fn all() -> (Sources, Exceptions) {
    let text = fs::read_to_string(root().join(PATH)).unwrap_or_default();
    (Sources::below(&["src", "tests", "benches"]), read(&text))
}

#[test]
fn no_rule_is_broken_beyond_its_exceptions() {
    let (sources, exceptions) = all();
    let none = Findings::new();
    let mut broken = Exceptions::new();
    for rule in &RULES {
        let allowed = exceptions.get(rule.name).unwrap_or(&none);
        let beyond = beyond(&(rule.find)(&sources), allowed);
        if !beyond.is_empty() {
            broken.insert(rule.name.to_owned(), beyond);
        }
    }
    let rules = RULES.iter().filter(|rule| broken.contains_key(rule.name));
    let asked: Vec<&str> = rules.map(|rule| rule.asks).collect();
    assert!(
        broken.is_empty(),
        "broken: {}\n{}",
        asked.join("; "),
        entries(&broken)
    );
}

#[test]
fn every_exception_is_still_needed() {
    let (sources, exceptions) = all();
    let mut needed = Exceptions::new();
    let mut idle = Vec::new();
    for (name, allowed) in &exceptions {
        let rule = RULES.iter().find(|rule| rule.name == name);
        let rule = rule.unwrap_or_else(|| panic!("{PATH}: no rule is called {name}"));
        let left = shrunk(&(rule.find)(&sources), allowed);
        let gone = allowed.keys().filter(|what| !left.contains_key(*what));
        idle.extend(gone.map(|what| format!("[{name}] {what}")));
        needed.insert(name.clone(), left);
    }
    if std::env::var_os("RAILHEAD_TIDY").is_some_and(|wish| wish == "shrink") {
        return fs::write(root().join(PATH), written(&needed)).expect("the list can be written");
    }
    assert!(
        idle.is_empty(),
        "needed no more, take them out with RAILHEAD_TIDY=shrink cargo test --test tidy:\n{}",
        idle.join("\n")
    );
}

#[test]
fn a_new_fault_and_an_idle_exception_are_found_and_shrinking_never_adds() {
    let text = "# why\n\n[file lines]\nsrc/a.rs 500\nsrc/gone.rs 600\n\n[pages]\na::b\n";
    let exceptions = read(text);
    let allowed = &exceptions["file lines"];
    let found = Findings::from([("src/a.rs".to_owned(), 501), ("src/b.rs".to_owned(), 460)]);
    assert_eq!(beyond(&found, allowed), found);
    let same = Findings::from([("src/a.rs".to_owned(), 500)]);
    assert_eq!(beyond(&same, allowed), Findings::new());
    let shorter = Findings::from([("src/a.rs".to_owned(), 470), ("src/b.rs".to_owned(), 460)]);
    assert_eq!(
        shrunk(&shorter, allowed),
        Findings::from([("src/a.rs".to_owned(), 470)])
    );
    assert_eq!(read(&written(&exceptions)), exceptions);
}
