//! Laws for arbitrary bytes from a client. The fuzzers look for bytes that break a law; the tests of the
//! service try those that were interesting once (`fuzz/seeds`).

use railhead::contact;
use railhead::contact::case::solver::Limits;
use railhead::contact::geometry::formats::{self, Format};
use railhead::contact::geometry::profile::{Body, Profile, Reading};
use railhead::http::extract::batch::{Add, columns_of, read_elements, read_lines, row_of};
use railhead::http::extract::json::read_strict;
use railhead::jobs::batch::upload::fill;
use railhead::tables::text::CsvRows;
use serde_json::{Value, json};

/// A case in small, so that a table can fill every kind of member.
fn template() -> Value {
    json!({
        "labels": { "line": "A12" },
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": [{ "creepage_x": 0.001 }, { "spin_per_mm": 0.0004 }],
        "solver": { "method": "boundary_element", "mesh": { "strips": 4, "cells": 4 } },
        "outputs": ["resultants"]
    })
}

/// Checks a case: it is taken, twice as the same, or each of its faults says where it is and what is allowed.
fn check(case: &Value) {
    let limits = Limits::default();
    match contact::check(case, &limits) {
        Ok(checked) => {
            let again = contact::check(case, &limits).expect("what was taken once is taken again");
            assert_eq!(checked.label.digest, again.label.digest);
        }
        Err(faults) => {
            assert!(!faults.0.is_empty());
            for fault in &faults.0 {
                assert!(!fault.detail.is_empty());
                let pointer = &fault.pointer;
                assert!(pointer.is_empty() || pointer.starts_with('/'), "{pointer}");
                // A missing member has no position.
                let holder = pointer.rsplit_once('/').map_or("", |(holder, _)| holder);
                assert!(
                    case.pointer(pointer).is_some()
                        || case.pointer(holder).is_some()
                        || case.get("motion").is_some(),
                    "{pointer} leads nowhere"
                );
            }
        }
    }
}

/// The text of a case.
pub fn case(data: &[u8]) {
    if let Ok(case) = read_strict(data) {
        let known: Value = serde_json::from_slice(data).expect("what is strict is JSON");
        assert_eq!(case, known);
        check(&case);
    }
}

/// A profile: the first byte chooses how it is read, the others are the text.
pub fn profile(data: &[u8]) {
    let Some((choice, text)) = data.split_first() else {
        return;
    };
    let format = [Format::Columns, Format::Simpack, Format::Miniprof][usize::from(choice % 3)];
    let body = [Body::Rail, Body::Wheel][usize::from(choice / 3 % 2)];
    let smoothing = [0.0, 3.0][usize::from(choice / 6 % 2)];
    let contents = match formats::read(format, &String::from_utf8_lossy(text)) {
        Ok(contents) => contents,
        Err(reason) => {
            assert!(!reason.is_empty());
            return;
        }
    };
    let finite = |point: &[f64; 2]| point.iter().all(|number| number.is_finite());
    let reading = Reading {
        mirror_y: contents.mirror_y,
        mirror_z: contents.mirror_z,
        smoothing,
    };
    if let Ok(profile) = Profile::new(body, &contents.points, reading) {
        let [from, to] = profile.range();
        assert!(from < to);
        for k in 0..=20 {
            let place = profile.at(from + (to - from) * f64::from(k) / 20.0);
            assert!(finite(&place.at) && finite(&place.slope) && finite(&place.bend));
        }
    }
}

/// A table of cases; the first byte belongs to none of them.
pub fn table(data: &[u8]) {
    let text = data.get(1..).unwrap_or_default();
    let Ok(mut rows) = CsvRows::new(text, 1 << 16) else {
        return;
    };
    let Ok(columns) = columns_of(&rows.titles) else {
        return;
    };
    let template = template();
    while let Ok(Some((_, record))) = rows.record() {
        match row_of(&columns, &mut rows.decimals, &record) {
            Ok(row) => {
                if let Ok(filled) = fill(&template, &row.cells) {
                    check(&filled);
                }
            }
            Err(reason) => assert!(!reason.is_empty()),
        }
    }
}

/// The body of a batch: the first byte chooses its form, the second belongs to none of its cases.
pub fn batch(data: &[u8]) {
    const CASE_MAX: usize = 1 << 16;
    let [form, _, text @ ..] = data else {
        return;
    };
    let mut texts = Vec::new();
    let add: Add<'_> = &mut |_, text| {
        texts.push(text.to_owned());
        Ok(())
    };
    let array = form % 2 == 1;
    let read = match array {
        true => read_elements(text, CASE_MAX, add),
        false => read_lines(text, CASE_MAX, add),
    };
    // Arrays are cut at their commas.
    if array
        && let Ok(Value::Array(items)) = read_strict(text)
        && text.len() < CASE_MAX
    {
        assert!(read.is_ok(), "an array can be cut");
        let parsed = texts
            .iter()
            .map(|text| serde_json::from_slice::<Value>(text));
        let parsed: Vec<Value> = parsed
            .map(|item| item.expect("an element is JSON"))
            .collect();
        assert_eq!(parsed, items);
    }
    texts.iter().for_each(|text| case(text));
}
