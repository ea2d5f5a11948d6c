//! Reads `solver` and `outputs`: how to solve, how exactly, and what to answer.

use crate::contact::case::read::object::{AllowedRange, Object, join, names, shown, word};
use crate::contact::case::solver::TARGET_ERROR_DEFAULT;
use crate::contact::case::words::solver::{
    MeshSizeWords, MethodName, Output, RelativeToName, Solver, TractionBoundName,
};
use crate::contact::rolling::task::TARGET_LEAST;

const TARGET_ERROR: AllowedRange = AllowedRange::closed(TARGET_LEAST, 0.5, "");
const TIME_LIMIT: AllowedRange = AllowedRange::positive(86_400.0, "s");
/// Most strips, and cells in one, of an explicit mesh.
const MESH_SIDE_MAX: u32 = 1000;

const MEMBERS: [&str; 6] = [
    "method",
    "target_error",
    "relative_to",
    "mesh",
    "traction_bound",
    "time_limit_s",
];

/// Reads the member `solver` of a case; left out, it is `auto` with the default target.
pub(crate) fn read(case: &mut Object) -> Option<Solver> {
    if !case.has("solver") {
        return Some(Solver {
            method: MethodName::Auto,
            target_error: Some(TARGET_ERROR_DEFAULT),
            relative_to: None,
            mesh: None,
            traction_bound: None,
            time_limit_s: None,
        });
    }
    let mut block = case.child("solver")?;
    block.only(&MEMBERS);
    let method = block.word("method", MethodName::WORDS);
    let target_error = block.number("target_error", TARGET_ERROR);
    let mesh = block.optional("mesh", mesh).flatten();
    let traction_bound = block.word("traction_bound", TractionBoundName::WORDS);
    let time_limit_s = block.number("time_limit_s", TIME_LIMIT);
    let relative_to = block.word("relative_to", RelativeToName::WORDS);
    let read = [
        traction_bound.is_some(),
        mesh.is_some(),
        relative_to.is_some(),
    ];
    mismatches(&mut block, method, read);
    for (name, read) in [
        ("method", method.is_some()),
        ("relative_to", relative_to.is_some()),
        ("target_error", target_error.is_some()),
        ("mesh", mesh.is_some()),
        ("traction_bound", traction_bound.is_some()),
        ("time_limit_s", time_limit_s.is_some()),
    ] {
        if block.has(name) && !read {
            return None;
        }
    }
    let method = method.unwrap_or_default();
    // The simplified theory has one mesh and a stated error, which no target changes: it has none of its own.
    let wanted = mesh.is_none() && method != MethodName::Fastsim;
    let default = wanted.then_some(TARGET_ERROR_DEFAULT);
    Some(Solver {
        method,
        target_error: target_error.or(default),
        relative_to,
        mesh,
        traction_bound,
        time_limit_s,
    })
}

/// Refuses members that do not go together; of three it counts whether they were read.
fn mismatches(
    block: &mut Object,
    method: Option<MethodName>,
    [traction_bound, mesh, relative_to]: [bool; 3],
) {
    let another =
        !block.has("method") || method.is_some_and(|method| method != MethodName::Fastsim);
    let targeted =
        block.has("target_error") || !block.has("mesh") && method != Some(MethodName::Fastsim);
    for (wrong, name, detail) in [
        (
            traction_bound && another,
            "traction_bound",
            "given for a method without a choice of bounds; only \"method\": \"fastsim\" has one",
        ),
        (
            mesh && method == Some(MethodName::Table),
            "mesh",
            "given for \"method\": \"table\", which has no mesh",
        ),
        (
            block.has("target_error") && block.has("mesh"),
            "mesh",
            "given together with target_error; exactly one of the two is allowed",
        ),
        (
            relative_to && !targeted,
            "relative_to",
            "given without a target; give target_error, or leave relative_to out",
        ),
    ] {
        if wrong {
            block.fault(name, detail);
        }
    }
}

/// Reads the member `outputs` of a case: sorted, each once; left out, resultants and zones. A method `without_fields` computes
/// resultants only, and every other output is refused.
pub(crate) fn read_outputs(
    case: &mut Object,
    without_fields: Option<MethodName>,
) -> Option<Vec<Output>> {
    if !case.has("outputs") {
        let mut usual = vec![Output::Resultants, Output::Zones];
        usual.retain(|output| without_fields.is_none() || !output.needs_fields());
        return Some(usual);
    }
    let what = format!("an array with at least one of {}", names(Output::WORDS));
    let elements = case.array("outputs", 1..=usize::MAX, &what)?;
    let pointer = case.pointer_to("outputs");
    let faults = case.faults();
    let read: Vec<Option<Output>> = elements
        .iter()
        .enumerate()
        .map(|(k, element)| {
            let pointer = join(&pointer, k);
            let output = word(element, &pointer, Output::WORDS, faults)?;
            let detail = match without_fields {
                Some(method) if output.needs_fields() => format!(
                    "{} given; \"method\": \"{}\" computes only \"resultants\", \"gradients\" and \"damage\"",
                    shown(element),
                    method.name()
                ),
                _ => return Some(output),
            };
            faults.add(pointer, detail);
            None
        })
        .collect();
    let mut outputs: Vec<Output> = read.into_iter().collect::<Option<_>>()?;
    outputs.sort_unstable();
    outputs.dedup();
    Some(outputs)
}

fn mesh(block: &mut Object, name: &str) -> Option<MeshSizeWords> {
    let mut block = block.child(name)?;
    block.only(&["strips", "cells"]);
    let strips = block.required_count("strips", 1, MESH_SIDE_MAX);
    let cells = block.required_count("cells", 1, MESH_SIDE_MAX);
    Some(MeshSizeWords {
        strips: strips?,
        cells: cells?,
    })
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::contact::case::read::object::Faults;
    use crate::contact::error::Fault;

    /// What is read of a case, by a method that computes resultants only.
    fn read_without_fields(case: &Value) -> (Option<Vec<Output>>, Vec<Fault>) {
        let mut faults = Faults::default();
        let mut case = Object::open(case, String::new(), &mut faults).expect("an object");
        let outputs = read_outputs(&mut case, Some(MethodName::Table));
        (outputs, faults.into_list())
    }

    #[test]
    fn a_method_without_fields_refuses_outputs_that_need_them_one_by_one() {
        let asked = json!({ "outputs": ["zones", "resultants", "slip"] });
        let (outputs, faults) = read_without_fields(&asked);
        assert_eq!(outputs, None);
        let pointers: Vec<&str> = faults.iter().map(|fault| &*fault.pointer).collect();
        assert_eq!(pointers, ["/outputs/0", "/outputs/2"]);
        assert!(faults[0].detail.contains("\"zones\" given"), "{faults:?}");
    }

    #[test]
    fn a_method_without_fields_is_asked_for_resultants_when_nothing_is_said() {
        for case in [json!({}), json!({ "outputs": ["resultants"] })] {
            let (outputs, faults) = read_without_fields(&case);
            assert_eq!((outputs, faults), (Some(vec![Output::Resultants]), vec![]));
        }
    }
}
