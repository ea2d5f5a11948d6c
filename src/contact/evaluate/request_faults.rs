//! Faults of rows with pointers into the request that brought them: `/template/…` and `/columns/<pointer>/<row>`.

use serde_json::Value;

use crate::contact::error::{CaseError, Fault, FaultCode};
use crate::contact::evaluate::rows::FAULTS_MAX;
use crate::contact::evaluate::variable::Variable;
use crate::contact::evaluate::varied::Values;

/// The pointer of a column in the request.
#[must_use]
pub fn column_pointer(name: &str) -> String {
    format!("/columns/{}", name.replace('~', "~0").replace('/', "~1"))
}

/// Faults of the case of the first row, with pointers into the request; of each column the pointer into the case and its name.
#[must_use]
pub fn of_first_row(CaseError(faults): CaseError, columns: &[(&str, &str)]) -> CaseError {
    in_template(CaseError(faults), |pointer| {
        let (_, name) = columns.iter().find(|(known, _)| *known == pointer)?;
        Some(format!("{}/0", column_pointer(name)))
    })
}

/// Faults of the case of a row, with pointers into the request: that of a column where `column` knows the pointer into the case, below the template
/// elsewhere.
#[must_use]
pub fn in_template(
    CaseError(faults): CaseError,
    column: impl Fn(&str) -> Option<String>,
) -> CaseError {
    let moved = faults.into_iter().map(|fault| Fault {
        pointer: column(&fault.pointer).unwrap_or_else(|| format!("/template{}", fault.pointer)),
        ..fault
    });
    CaseError(moved.collect())
}

/// Faults of some values of a column, the first of which belongs to the row `first`: numbers that are not finite, or that no case may have at
/// this place, as far as that is known of the place alone.
#[must_use]
pub fn of_values(name: &str, pointer: &str, values: &Values, first: u64) -> Vec<Fault> {
    let Values::Numbers(numbers) = values else {
        return Vec::new();
    };
    let allowed = Variable::at(pointer).map(Variable::allowed);
    let good =
        |number: f64| number.is_finite() && allowed.is_none_or(|range| range.contains(number));
    let wrong = (first..).zip(numbers).filter(|(_, number)| !good(**number));
    wrong
        .take(FAULTS_MAX)
        .map(|(row, number)| {
            let place = format!("{}/{row}", column_pointer(name));
            match allowed {
                Some(allowed) => Fault {
                    figures: Box::new(
                        allowed.figures(FaultCode::OutOfRange, Some(&Value::from(*number))),
                    ),
                    ..Fault::new(
                        place,
                        match number.is_nan() {
                            true => format!("no number given; {allowed} is needed"),
                            false => format!("{number} given; {allowed} is needed"),
                        },
                    )
                },
                None => Fault::new(place, "no number given; a finite number is needed"),
            }
        })
        .collect()
}
