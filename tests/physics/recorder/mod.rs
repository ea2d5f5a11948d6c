//! Compares the answers with the recorded ones, for refactorings that must not change a number.
//!
//! `RAILHEAD_RECORD=write cargo test --test physics recorder -- --nocapture` writes the present answers to `tests/data/recorded.txt`, at the SIMD
//! level of the record, and prints the changes. Without the variable, the test solves all cases at every SIMD level of the processor. A level with
//! the arithmetic of the record (see [`machine`]) must reproduce every bit of every force, estimate and zone, and all iterations and meshes. Other
//! levels sum in another order. For them, the numbers that a client reads are compared, within [`ELSEWHERE`] or [`FOUND_ELSEWHERE`].

use std::path::PathBuf;
use std::sync::Arc;

use railhead_contact as contact;
use railhead_contact::case::digest::SOLVER_REVISION;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::numerics::simd::SimdLevel;
use railhead_contact::rolling::operator_store::OperatorStore;
use serde_json::Value;

use crate::recorder::comparison::{Precision, compare};
use crate::recorder::machine::arithmetic;
use crate::recorder::record::{Record, Recording};

mod cases;
mod comparison;
mod machine;
mod record;

/// Largest change of a given contact with another arithmetic, relative to the scale of the quantity. It is less than half of the default target.
/// Kernels without SIMD change creepages that are found for a force by 9e-4, peaks of the traction by 1.2e-4 and all other numbers by 7e-7.
const ELSEWHERE: f64 = 2e-3;
/// Largest change of the resultants of gaps and wheels, for which nothing else is compared. The last bits can change decisions about grids and
/// heights. Answers then differ within the target (those of wheels without SIMD by 5e-3 of the friction limit).
const FOUND_ELSEWHERE: f64 = 0.01;

/// One in this number of cases is solved a second time, without the operators of earlier cases.
const ALONE_EVERY: usize = 8;

fn path() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("tests/data/recorded.txt")
}

/// Returns the answer to one case, or the reason why there is none.
fn solved(operators: &Arc<OperatorStore>, case: &Value) -> Record {
    let checked = match contact::check(case, &Limits::default()) {
        Ok(checked) => checked,
        Err(error) => return Record::refused(&error.to_string()),
    };
    let friction = checked.problem.friction.largest();
    match contact::solve_with(operators, &checked, &Unmonitored) {
        Ok((solution, fields)) => Record::of(friction, &solution, &fields),
        Err(error) => Record::refused(&error.to_string()),
    }
}

/// Solves every case with one store of operators, as a worker does.
fn present(level: SimdLevel) -> Recording {
    let operators = Arc::default();
    let mut answers = Vec::new();
    for (index, (name, case)) in cases::all().into_iter().enumerate() {
        let answer = solved(&operators, &case);
        if index % ALONE_EVERY == 0 {
            let alone = solved(&Arc::default(), &case);
            assert_eq!(alone, answer, "{name} depends on the cases before it");
        }
        answers.push((name, answer));
    }
    Recording {
        revision: SOLVER_REVISION,
        arithmetic: arithmetic(level),
        answers,
    }
}

#[test]
fn answers_are_those_of_the_recorder_at_every_simd_level() {
    let text = std::fs::read_to_string(path()).unwrap_or_default();
    let recorded = Recording::read(&text).unwrap_or_default();
    let levels = SimdLevel::available();
    if std::env::var_os("RAILHEAD_RECORD").is_some_and(|wish| wish == "write") {
        let best = *levels.last().expect("a level");
        let of_record = |level: &&SimdLevel| arithmetic(**level) == recorded.arithmetic;
        let level = *levels.iter().find(of_record).unwrap_or(&best);
        let present = level.during(|| present(level));
        println!("{}", compare(&recorded, &present, Precision::Bits));
        return std::fs::write(path(), present.to_string()).expect("recorded.txt can be written");
    }
    for level in levels {
        let present = level.during(|| present(level));
        let precision = if recorded.arithmetic == present.arithmetic {
            Precision::Bits
        } else {
            Precision::Within {
                given: ELSEWHERE,
                found: FOUND_ELSEWHERE,
            }
        };
        let report = compare(&recorded, &present, precision);
        assert!(
            report.is_empty(),
            "{report}\nIf the answers were meant to change: RAILHEAD_RECORD=write cargo test --test physics recorder\n\
             (recorded with {}, this is {})",
            recorded.arithmetic,
            present.arithmetic
        );
    }
}
