//! Cases of a batch that have options of their own: `{"case": …, "priority": …, "deadline_s": …}` in place of a case, or columns of a
//! table of these names.

use serde_json::Value;

use crate::contact::error::Fault;
use crate::http::extract::submit_options::DEADLINE_MAX_SECONDS;
use crate::jobs::batch::upload::BatchCase;
use crate::jobs::model::submit_options::{CaseOptions, Priority};

/// Names of the options, as members and as columns.
pub const NAMES: [&str; 2] = ["priority", "deadline_s"];

/// The case that an element of a batch is or has.
///
/// # Errors
/// Every fault of its options.
pub fn read(mut element: Value) -> Result<BatchCase, Vec<Fault>> {
    let members = element.as_object_mut();
    let Some((members, case)) = members.and_then(|members| {
        let case = members.remove("case")?;
        Some((members, case))
    }) else {
        return Ok(BatchCase {
            case: element,
            wrapped: false,
            own: CaseOptions::default(),
        });
    };
    let mut own = CaseOptions::default();
    let mut faults = Vec::new();
    for (name, value) in members {
        if let Err(detail) = set(&mut own, name, value) {
            faults.push(Fault::new(
                format!("/{}", name.replace('~', "~0").replace('/', "~1")),
                detail,
            ));
        }
    }
    match faults.is_empty() {
        true => Ok(BatchCase {
            case,
            wrapped: true,
            own,
        }),
        false => Err(faults),
    }
}

/// Sets the option of this name.
///
/// # Errors
/// There is none, or the value is not one of it.
pub fn set(own: &mut CaseOptions, name: &str, value: &Value) -> Result<(), String> {
    match name {
        "priority" => {
            let priority = value.as_str().and_then(Priority::from_name);
            let words = Priority::ALL.map(Priority::name).join(", ");
            own.priority =
                Some(priority.ok_or_else(|| format!("{value} given; allowed: {words}"))?);
        }
        "deadline_s" => {
            let seconds = value
                .as_u64()
                .and_then(|seconds| u32::try_from(seconds).ok());
            let seconds = seconds.filter(|seconds| (1..=DEADLINE_MAX_SECONDS).contains(seconds));
            own.deadline_s = Some(seconds.ok_or_else(|| {
                format!(
                    "{value} given; a whole number from 1 to {DEADLINE_MAX_SECONDS} is needed, in s"
                )
            })?);
        }
        _ => {
            return Err(format!(
                "unknown member; beside `case` there may be `{}`",
                NAMES.join("`, `")
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn an_element_is_a_case_or_has_one_with_options() {
        let bare = read(json!({ "motion": {} })).unwrap();
        assert_eq!((bare.wrapped, bare.own), (false, CaseOptions::default()));
        let own = read(json!({ "case": { "motion": {} }, "priority": "high", "deadline_s": 60 }));
        let own = own.unwrap();
        assert_eq!((own.case, own.wrapped), (bare.case, true));
        assert_eq!(own.own.priority, Some(Priority::High));
        assert_eq!(own.own.deadline_s, Some(60));
    }

    #[test]
    fn every_faulty_option_is_named() {
        let element = json!({ "case": {}, "priority": "soon", "deadline_s": 0, "a/b": 1 });
        let mut pointers: Vec<String> = read(element)
            .unwrap_err()
            .into_iter()
            .map(|fault| fault.pointer)
            .collect();
        pointers.sort();
        assert_eq!(pointers, ["/a~1b", "/deadline_s", "/priority"]);
    }
}
