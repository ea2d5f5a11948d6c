//! Are the answers still those that were recorded? For changes of structure, which must not move a number: the last bit of every force,
//! estimate and zone counts, and so do the iterations, the products and the mesh of every motion.
//!
//! `RAILHEAD_RECORD=write cargo test --test physics recorder -- --nocapture` records the present answers in `tests/data/recorded.txt` and prints
//! what changed; without the variable the test compares with them. Bits are compared where the arithmetic is that of the record, see
//! [`machine`]. On another SIMD level sums are taken in another order: there only the numbers that a client reads are compared, within
//! [`ELSEWHERE`] or [`FOUND_ELSEWHERE`].

mod cases;
mod comparison;
mod machine;
mod record;

use std::path::PathBuf;
use std::sync::Arc;

use railhead::contact;
use railhead::contact::case::digest::SOLVER_REVISION;
use railhead::contact::case::limits::Limits;
use railhead::contact::monitor::Unmonitored;
use railhead::contact::rolling::operator_store::OperatorStore;
use serde_json::Value;

use crate::recorder::comparison::{Precision, compare};
use crate::recorder::machine::arithmetic;
use crate::recorder::record::{Record, Recording};

/// Largest changes with another arithmetic, relative to the scale of the quantity. Kernels without SIMD moved the numbers of contacts that are
/// given by 7e-7 at most (matrices are kept in single precision), pressures whose samples are rounded to twelve digits by 7e-5.
const ELSEWHERE: f64 = 1e-4;
/// The same of the resultants of gaps and wheels, of which nothing else is compared. Their regions are found by decisions about grids and heights,
/// which the last bits can turn; answers then differ as two within the usual target do (wheels without SIMD by 5e-3 of the friction limit, a
/// gap with its samples rounded to twelve digits by 9e-4).
const FOUND_ELSEWHERE: f64 = 0.01;

/// Every so many cases one is solved a second time, without the operators that the cases before it left.
const ALONE_EVERY: usize = 8;

fn path() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join("tests/data/recorded.txt")
}

/// The answer to one case, or why there is none.
fn solved(operators: &Arc<OperatorStore>, case: &Value) -> Record {
    let checked = match contact::check(case, &Limits::default()) {
        Ok(checked) => checked,
        Err(error) => return Record::refused(&error.to_string()),
    };
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.0);
    match contact::solve_with(operators, &checked, &Unmonitored) {
        Ok((solution, fields)) => Record::of(friction, &solution, &fields),
        Err(error) => Record::refused(&error.to_string()),
    }
}

/// Solves every case with one store of operators, as a worker does.
fn present() -> Recording {
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
        arithmetic: arithmetic(),
        answers,
    }
}

#[test]
fn answers_are_those_of_the_recorder() {
    let present = present();
    let text = std::fs::read_to_string(path()).unwrap_or_default();
    let recorded = Recording::read(&text).unwrap_or_default();
    let precision = if recorded.arithmetic == present.arithmetic {
        Precision::Bits
    } else {
        Precision::Within {
            given: ELSEWHERE,
            found: FOUND_ELSEWHERE,
        }
    };
    let report = compare(&recorded, &present, precision);
    if std::env::var_os("RAILHEAD_RECORD").is_some_and(|wish| wish == "write") {
        println!("{report}");
        return std::fs::write(path(), present.to_string()).expect("recorded.txt can be written");
    }
    assert!(
        report.is_empty(),
        "{report}\nIf the answers were meant to change: RAILHEAD_RECORD=write cargo test --test physics recorder\n\
         (recorded with {}, this is {})",
        recorded.arithmetic,
        present.arithmetic
    );
}
