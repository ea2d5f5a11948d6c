//! The faults found in a case so far, and the numbers that a member may have.

use std::fmt;

use serde_json::{Number, Value};

use crate::contact::error::{Fault, FaultCode, FaultFigures};

/// Faults listed one by one before the rest is only counted.
pub(crate) const FAULTS_MAX: usize = 100;
/// Characters of a received value that a fault repeats.
pub(crate) const SHOWN_MAX: usize = 60;

/// The faults found so far, in the order of the examination.
#[derive(Debug, Default)]
pub(crate) struct Faults {
    listed: Vec<Fault>,
    unlisted: usize,
}

impl Faults {
    /// Notes one fault; beyond the first hundred only their number is kept.
    pub(crate) fn add(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        self.add_with(pointer, detail, FaultFigures::default());
    }

    /// The same with what programs can read of it.
    pub(crate) fn add_with(
        &mut self,
        pointer: impl Into<String>,
        detail: impl Into<String>,
        figures: FaultFigures,
    ) {
        if self.listed.len() < FAULTS_MAX {
            self.listed.push(Fault {
                pointer: pointer.into(),
                detail: detail.into(),
                figures: Box::new(figures),
            });
        } else {
            self.unlisted += 1;
        }
    }

    /// The list, with a last entry that counts what did not fit.
    pub(crate) fn into_list(self) -> Vec<Fault> {
        let mut listed = self.listed;
        if self.unlisted > 0 {
            let detail = format!("{} more faults are not listed", self.unlisted);
            listed.push(Fault::new("", detail));
        }
        listed
    }
}

/// The numbers a member may have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AllowedRange {
    low: f64,
    low_excluded: bool,
    high: f64,
    unit: &'static str,
}

impl AllowedRange {
    /// `low <= value <= high`.
    pub(crate) const fn closed(low: f64, high: f64, unit: &'static str) -> Self {
        AllowedRange {
            low,
            low_excluded: false,
            high,
            unit,
        }
    }

    /// `0 < value <= high`.
    pub(crate) const fn positive(high: f64, unit: &'static str) -> Self {
        AllowedRange {
            low: 0.0,
            low_excluded: true,
            high,
            unit,
        }
    }

    /// What a fault of a member says of it.
    pub(crate) fn figures(&self, code: FaultCode, value: Option<&Value>) -> FaultFigures {
        FaultFigures {
            minimum: Number::from_f64(self.low),
            minimum_excluded: self.low_excluded,
            maximum: Number::from_f64(self.high),
            unit: Some(self.unit).filter(|unit| !unit.is_empty()),
            ..figures(code, value)
        }
    }

    /// Is the number allowed?
    pub(crate) fn contains(&self, number: f64) -> bool {
        let above = if self.low_excluded {
            number > self.low
        } else {
            number >= self.low
        };
        above && number <= self.high
    }
}

impl fmt::Display for AllowedRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (plain(self.low), plain(self.high));
        if self.low_excluded {
            write!(f, "a number more than {low} and at most {high}")?;
        } else {
            write!(f, "a number from {low} to {high}")?;
        }
        if self.unit.is_empty() {
            Ok(())
        } else {
            write!(f, " {}", self.unit)
        }
    }
}

/// The kind of a fault, and the value given if it is short.
pub(crate) fn figures(code: FaultCode, value: Option<&Value>) -> FaultFigures {
    let short = |value: &&Value| match value {
        Value::Array(_) | Value::Object(_) => false,
        Value::String(text) => text.len() <= SHOWN_MAX,
        _ => true,
    };
    FaultFigures {
        code,
        value: value.filter(short).cloned(),
        ..FaultFigures::default()
    }
}

/// The code of a value of the right type that is out of range, or of one of another type.
pub(crate) fn code_of(value: &Value, right: fn(&Value) -> bool) -> FaultCode {
    match right(value) {
        true => FaultCode::OutOfRange,
        false => FaultCode::WrongType,
    }
}

/// A limit as people write it: `1e9` rather than `1000000000`.
fn plain(number: f64) -> String {
    if number.abs() >= 1e5 {
        format!("{number:e}")
    } else {
        format!("{number}")
    }
}
