//! Are the answers still those that were recorded? For changes of structure, which must not move a number: the last bit of every force,
//! estimate and zone counts, and so do the iterations, the products and the mesh of every motion.
//!
//! `RAILHEAD_RECORD=write cargo test --test physics recorder -- --nocapture` records the present answers in `tests/data/recorded.txt` and prints
//! what changed; without the variable the test compares with them. Bits are compared where the arithmetic is that of the record, see
//! [`machine`]. On another SIMD level sums are taken in another order: there only the numbers that a client reads are compared, within
//! [`ELSEWHERE`].

mod cases;
mod comparison;
mod machine;
mod record;

use std::path::PathBuf;
use std::sync::Arc;

use railhead::contact;
use railhead::contact::monitor::Unwatched;
use railhead::contact::problem::{Limits, SOLVER_REVISION};
use railhead::contact::tangential::operator_store::OperatorStore;
use serde_json::Value;

use crate::recorder::comparison::{Precision, compare};
use crate::recorder::machine::arithmetic;
use crate::recorder::record::{Record, Recording};

/// Largest change with another arithmetic, relative to the scale of the quantity.
const ELSEWHERE: f64 = 2e-6;

/// Every so many cases one is solved a second time, without the operators that the cases before it left.
const ALONE_EVERY: usize = 8;

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/recorded.txt")
}

/// The answer to one case, or why there is none.
fn solved(operators: &Arc<OperatorStore>, case: &Value) -> Record {
    let problem = match contact::check(case, &Limits::default()) {
        Ok(problem) => problem,
        Err(error) => return Record::refused(&error.to_string()),
    };
    let friction = case["friction"]["coefficient"].as_f64().unwrap_or(0.0);
    match contact::solve_with(operators, &problem, &Unwatched) {
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
        Precision::Within(ELSEWHERE)
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
