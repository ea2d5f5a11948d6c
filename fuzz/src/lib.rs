//! What must hold for any bytes that a client may send. The fuzzers look for bytes for which it does not; the tests of the
//! service try those that were interesting once (`fuzz/seeds`).

use railhead::contact;
use railhead::contact::case::solver::Limits;
use railhead::contact::geometry::formats::{self, Format};
use railhead::contact::geometry::profile::{Body, Profile, Reading};
use railhead::http::extract::batch::{Element, Layout, Splitter, columns_of, row_of};
use railhead::http::extract::json::read_strict;
use railhead::http::extract::tables::CsvRows;
use railhead::jobs::batch::upload::{fill_in_place, restore};
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
                // What is missing has no place of its own.
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

/// A body cut into cases, whole and in pieces of some size; both must say the same.
fn cut(layout: Layout, data: &[u8], piece: usize) -> Option<Vec<Element>> {
    const CASE_MAX: usize = 1 << 16;
    let cut = |piece: usize| {
        let mut splitter = Splitter::new(layout, CASE_MAX);
        let mut out = Vec::new();
        for piece in data.chunks(piece.max(1)) {
            splitter.feed(piece, &mut out).ok()?;
        }
        splitter.end(&mut out).ok()?;
        Some(out)
    };
    let whole = cut(data.len());
    if data.len() < CASE_MAX {
        assert_eq!(whole, cut(piece));
    }
    whole
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
    let mut filled = template();
    while let Ok(Some((_, record))) = rows.record() {
        match row_of(&columns, rows.decimal_comma, &record) {
            Ok(row) => {
                if let Ok(replaced) = fill_in_place(&mut filled, &row.cells) {
                    check(&filled);
                    restore(&mut filled, &row.cells, replaced);
                }
                assert_eq!(filled, template());
            }
            Err(reason) => assert!(!reason.is_empty()),
        }
    }
}

/// The body of a batch: the first byte chooses its form, the second is the size of the pieces in which the others arrive.
pub fn batch(data: &[u8]) {
    let [form, piece, text @ ..] = data else {
        return;
    };
    if form % 2 == 0 {
        for line in cut(Layout::Lines, text, usize::from(*piece)).unwrap_or_default() {
            case(&line.text);
        }
        return;
    }
    let elements = cut(Layout::Array, text, usize::from(*piece));
    // Whatever is an array is cut at its commas.
    if let Ok(Value::Array(items)) = read_strict(text)
        && text.len() < 1 << 16
    {
        let elements = elements.as_ref().expect("an array can be cut");
        let read: Vec<Value> = elements
            .iter()
            .map(|element| serde_json::from_slice(&element.text).expect("an element is JSON"))
            .collect();
        assert_eq!(read, items);
    }
    for element in elements.unwrap_or_default() {
        case(&element.text);
    }
}
