//! Values per cell as the client reads them: with units, and only those requested.

use crate::contact::case::words::solver::Output;
use crate::contact::numerics::length::length;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::motion_answer::SolvedFields;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::solution::words::fields::Zone;
use crate::contact::solution::words::fields::{PatchCells, PointFields};

/// The cells of a patch.
pub(crate) fn patch_cells(case: &CheckedCase, level: &StripMesh, patch: usize) -> PatchCells {
    let cells = level.patch_cells(patch);
    let mesh = &level.mesh;
    let mut fields = PatchCells::default();
    for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
        for i in segment.cells.clone() {
            fields.x_mm.push(0.5 * (mesh.left[i] + mesh.right[i]));
            fields.y_mm.push(segment.chord.y);
            fields.dx_mm.push(mesh.right[i] - mesh.left[i]);
            fields.dy_mm.push(segment.chord.dy);
            fields
                .strip
                .push(u32::try_from(segment.chord.strip).unwrap_or(u32::MAX));
        }
    }
    fields.pressure_mpa = case
        .run
        .wants(Output::Pressure)
        .then(|| level.pressure[cells].to_vec());
    fields
}

/// The values of a patch for one motion that its tractions alone give.
pub(crate) fn point_fields(
    case: &CheckedCase,
    level: &StripMesh,
    cells: std::ops::Range<usize>,
    answer: &LevelAnswer,
) -> PointFields {
    let scaled = |values: &[f64], factor: f64| {
        values[cells.clone()]
            .iter()
            .map(|v| v * factor)
            .collect::<Vec<_>>()
    };
    let traction = |k: usize| {
        case.run
            .wants(Output::Tractions)
            .then(|| scaled(&answer.traction[k], level.scale.traction))
    };
    let zone = |slips: &bool| if *slips { Zone::Slip } else { Zone::Stick };
    PointFields {
        mesh: 0,
        zone: case
            .run
            .wants(Output::Zones)
            .then(|| answer.slips[cells.clone()].iter().map(zone).collect()),
        traction_x_mpa: traction(0),
        traction_y_mpa: traction(1),
        ..PointFields::default()
    }
}

/// Largest tangential traction in the cells of a patch, in MPa.
pub(crate) fn traction_max(level: &StripMesh, fields: &SolvedFields, patch: usize) -> f64 {
    let [x, y] = &fields.tangential.traction;
    let lengths = level.patch_cells(patch).map(|i| length(x[i], y[i]));
    lengths.fold(0.0, f64::max) * level.scale.traction
}
