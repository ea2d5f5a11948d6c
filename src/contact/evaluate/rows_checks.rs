//! What cases and columns of rows cannot be.

use serde_json::Value;

use crate::contact::case::words::solver::MethodName;
use crate::contact::error::{Fault, FaultCode};
use crate::contact::evaluate::column::Column;
use crate::contact::evaluate::variable::Variable;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::resolution::Resolution;

/// Faults of rows that are listed.
pub(crate) const FAULTS_MAX: usize = 20;

/// What rows cannot be asked about.
pub(crate) fn faults_of_case(case: &Value, checked: &CheckedCase) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut refuse = |wrong: bool, pointer: &str, detail: &str| {
        if wrong {
            faults.push(Fault::new(format!("/template{pointer}"), detail));
        }
    };
    let method = checked.run.method_asked;
    let fast = matches!(
        method,
        MethodName::Auto | MethodName::Table | MethodName::Fastsim
    );
    if !matches!(checked.problem.task, NormalTask::Hertz(_)) {
        refuse(
            true,
            "/contact/type",
            "rows are of `radii` or `ellipse`; other contacts need a job",
        );
    }
    refuse(
        !fast,
        "/solver/method",
        "rows are evaluated by `table`, `fastsim` or `auto`; other methods need a job",
    );
    let mesh = matches!(checked.run.resolution, Resolution::Mesh(_));
    refuse(
        mesh && method == MethodName::Auto,
        "/solver/mesh",
        "given, but `auto` takes the table for rows, which has no mesh",
    );
    refuse(
        checked.problem.elasticity.difference != 0.0 && method != MethodName::Fastsim,
        "/material",
        "bodies of unlike material (K other than 0), which the table does not cover",
    );
    let asked = checked
        .problem
        .forces
        .iter()
        .any(|forces| *forces != [None; 2]);
    refuse(
        checked.problem.motions.len() != 1 || asked || checked.problem.history.is_some(),
        "/motion",
        "rows have one motion each, given by creepages; sweeps, histories and prescribed forces need a job",
    );
    let by_force = case.pointer(Variable::NormalForce.pointer()).is_some();
    refuse(!by_force, "/load", "rows are loaded by `normal_force_n`");
    faults
}

/// The variable of a column, or what is wrong with it.
pub(crate) fn faults_of_column(
    column: &Column,
    rows: usize,
    case: &Value,
) -> Result<Variable, Vec<Fault>> {
    let escaped = column.pointer.replace('~', "~0").replace('/', "~1");
    let here = format!("/columns/{escaped}");
    let Some(variable) = Variable::at(&column.pointer) else {
        let known: Vec<&str> = Variable::all().map(Variable::pointer).collect();
        let detail = format!(
            "`{}` cannot differ from row to row; allowed: {}",
            column.pointer,
            known.join(", ")
        );
        return Err(vec![Fault::new(here, detail)]);
    };
    if column.values.len() != rows {
        let detail = format!(
            "{} values given, the first column has {rows}; all columns need as many",
            column.values.len()
        );
        return Err(vec![Fault::new(here, detail)]);
    }
    if case.pointer("/material/lower").is_some() && column.pointer.starts_with("/material") {
        let detail =
            "given, but the template names the materials of both bodies; rows vary a common one";
        return Err(vec![Fault::new(here, detail)]);
    }
    let allowed = variable.allowed();
    let wrong = column
        .values
        .iter()
        .enumerate()
        .filter(|(_, value)| !allowed.contains(**value));
    let faults: Vec<Fault> = wrong
        .take(FAULTS_MAX)
        .map(|(row, value)| Fault {
            figures: Box::new(allowed.figures(FaultCode::OutOfRange, Some(&Value::from(*value)))),
            ..Fault::new(
                format!("{here}/{row}"),
                format!("{value} given; {allowed} is needed"),
            )
        })
        .collect();
    match faults.is_empty() {
        true => Ok(variable),
        false => Err(faults),
    }
}
