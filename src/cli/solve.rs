//! `railhead solve`: solves one case without a server or a data folder.

use std::io::Read;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::Serialize;
use serde_json::{Value, json};

use crate::cli::commands::SolveArgs;
use crate::cli::output::{print, print_error};
use crate::contact::monitor::{Monitor, Stop};
use crate::contact::post::subsurface::states::points;
use crate::contact::solution::words::answer::{
    Fields, PatchCells, PatchFields, PointFields, Solution,
};
use crate::contact::{check, solve_with};

/// Exit code for a faulty case.
const FAULTY_CASE: u8 = 2;

/// Measures the time of a solve and never stops it; a user at a terminal interrupts the process.
struct Clock(Instant);

impl Monitor for Clock {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }

    fn elapsed(&self) -> Duration {
        self.0.elapsed()
    }
}

/// The printed result: the solution, and the values per cell as its member `fields`.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    solution: &'a Solution,
    #[serde(skip_serializing_if = "Option::is_none")]
    fields: Option<Value>,
}

/// Solves the case of a file and prints the result; the values per cell, if asked for, are its member `fields`.
pub(super) fn run(args: &SolveArgs) -> anyhow::Result<ExitCode> {
    let text =
        read(&args.file).with_context(|| format!("{} cannot be read", args.file.display()))?;
    let case: Value = match serde_json::from_slice(&text) {
        Ok(case) => case,
        Err(error) => {
            print_error(&format!(
                "{} cannot be read as JSON: {error}",
                args.file.display()
            ));
            return Ok(ExitCode::from(FAULTY_CASE));
        }
    };
    let checked = match check(&case, &args.case.limits()) {
        Ok(checked) => checked,
        Err(faults) => {
            for fault in &faults.0 {
                let place = match fault.pointer.as_str() {
                    "" => "the case",
                    pointer => pointer,
                };
                print_error(&format!("{place}: {}", fault.detail));
            }
            return Ok(ExitCode::from(FAULTY_CASE));
        }
    };
    let operators = Arc::new(args.case.operators());
    let (solution, fields) = solve_with(&operators, &checked, &Clock(Instant::now()))?;
    let result = Printed {
        solution: &solution,
        fields: (!fields.patches.is_empty()).then(|| fields_json(&fields)),
    };
    print(&serde_json::to_string_pretty(&result)?)
}

fn read(file: &Path) -> std::io::Result<Vec<u8>> {
    if file == Path::new("-") {
        let mut text = Vec::new();
        std::io::stdin().read_to_end(&mut text)?;
        return Ok(text);
    }
    std::fs::read(file)
}

/// One entry per patch, with the names of the API: its meshes, and for every motion its mesh and values. Arrays that were
/// not computed are absent.
fn fields_json(fields: &Fields) -> Value {
    fields.patches.iter().map(patch_json).collect()
}

fn patch_json(fields: &PatchFields) -> Value {
    let meshes: Value = fields.meshes.iter().map(cells_json).collect();
    let points: Value = fields.points.iter().map(point_json).collect();
    json!({ "meshes": meshes, "points": points })
}

fn cells_json(cells: &PatchCells) -> Value {
    computed(json!({
        "x_mm": cells.x_mm,
        "y_mm": cells.y_mm,
        "dx_mm": cells.dx_mm,
        "dy_mm": cells.dy_mm,
        "strip": cells.strip,
        "pressure_mpa": cells.pressure_mpa,
    }))
}

fn point_json(values: &PointFields) -> Value {
    computed(json!({
        "mesh": values.mesh,
        "zone": values.zone,
        "traction_x_mpa": values.traction_x_mpa,
        "traction_y_mpa": values.traction_y_mpa,
        "slip_x": values.slip_x,
        "slip_y": values.slip_y,
        "temperature_c": values.temperature_c,
        "subsurface": values.subsurface.as_deref().map(points),
    }))
}

/// Removes the members that are null.
fn computed(mut values: Value) -> Value {
    let members = values.as_object_mut().into_iter();
    members.for_each(|members| members.retain(|_, value| !value.is_null()));
    values
}
