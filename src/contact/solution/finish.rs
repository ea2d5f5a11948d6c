//! The final step for every answer: distributes wall time, sets rounding residues to 0, adds remarks on implausible numbers, and
//! checks that all numbers are finite.
//!
//! Values per cell as the client reads them: with units, and only those requested.
//!
//! Moves the coordinates of a patch to another origin.

use std::f64::consts::PI;
use std::time::Duration;

use crate::case::words::solver::Output;
use crate::error::SolveError;
use crate::finite::Finite;
use crate::numerics::simd::length;
use crate::post::subsurface::states::STORED;
use crate::problem::checked_case;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::{RemarkEntry, merged};
use crate::remark::list::Remark;
use crate::rolling::answer::{LevelAnswer, SolvedFields};
use crate::rolling::strip_mesh::StripMesh;
use crate::solution::words::answer::{
    Fields, GradientErrors, Gradients, PatchCells, PatchFields, PatchSolution, PointFields,
    PointSolution, Solution, Zone,
};
use crate::solution::words::evolution::SubsurfaceSummary;

/// Values below this fraction of their scale are rounding residues and reported as 0.
const DUST: f64 = 1e-14;

/// Finishes the answer to a whole problem, given the wall time it took.
///
/// # Errors
/// [`SolveError::NotFinite`] if a number in the answer is not finite.
pub fn finish(
    case: &CheckedCase,
    (mut solution, fields): (Solution, Fields),
    took: Duration,
) -> Result<(Solution, Fields), SolveError> {
    require_finite(&solution, &fields)?;
    clear_dust(case, &mut solution);
    scale_seconds(&mut solution, took.as_secs_f64());
    let said = implausible(&solution, case.problem.part.before);
    solution.remarks = merged(solution.remarks.into_iter().chain(said));
    Ok((solution, fields))
}

fn require_finite(solution: &Solution, fields: &Fields) -> Result<(), SolveError> {
    let path = solution.not_finite().or_else(|| fields.not_finite());
    path.map_or(Ok(()), |path| {
        let quantity = path.trim_start_matches('.').to_owned();
        Err(SolveError::NotFinite { quantity })
    })
}

/// Divides the wall time of each motion, which stands in each of its patches, among them by their areas.
pub fn share_seconds(solution: &mut Solution) {
    let area: f64 = solution.patches.iter().map(|patch| patch.area_mm2).sum();
    for patch in &mut solution.patches {
        for point in &mut patch.points {
            point.solver.seconds *= patch.area_mm2 / area;
        }
    }
}

/// Scales the times of the motions so that they add up to that of the whole answer: time that belongs to no motion is distributed in
/// proportion.
fn scale_seconds(solution: &mut Solution, took: f64) {
    let points = |patch: &PatchSolution| patch.points.len();
    let count: usize = solution.patches.iter().map(points).sum();
    let of_point = |point: &PointSolution| point.solver.seconds;
    let of_patch = |patch: &PatchSolution| patch.points.iter().map(of_point).sum::<f64>();
    let sum: f64 = solution.patches.iter().map(of_patch).sum();
    for patch in &mut solution.patches {
        for point in &mut patch.points {
            let seconds = &mut point.solver.seconds;
            *seconds = if sum > 0.0 {
                *seconds * (took / sum)
            } else {
                took / count as f64
            };
        }
    }
}

/// Sets values that are rounding residues of larger numbers to 0.
fn clear_dust(case: &CheckedCase, solution: &mut Solution) {
    let (mut limit_all, mut moment_all) = (0.0, 0.0);
    let mut length_all = 0.0_f64;
    for patch in &mut solution.patches {
        let length = (patch.area_mm2 / PI).sqrt();
        let limit = case.problem.friction.largest() * patch.normal_force_n;
        for point in &mut patch.points {
            clear(&mut point.force_x_n, limit);
            clear(&mut point.force_y_n, limit);
            clear(&mut point.moment_z_n_mm, limit * length);
            let motion = &point.motion;
            let creepage = motion.creepage_x.hypot(motion.creepage_y);
            let speed = creepage.hypot(motion.spin_per_mm * length);
            clear(&mut point.friction_power_n, limit * speed);
            clear(&mut point.friction_power_without_spin_n, limit * speed);
            let extent = point
                .region
                .iter_mut()
                .flat_map(|region| &mut region.extent_mm);
            extent.for_each(|end| clear(end, length));
        }
        patch
            .extent_mm
            .iter_mut()
            .for_each(|end| clear(end, length));
        if let Some(position) = &mut patch.position {
            let places = [&mut position.track_mm, &mut position.origin_track_mm];
            for place in places {
                place.iter_mut().for_each(|part| clear(part, length));
            }
        }
        limit_all += limit;
        moment_all += limit * length;
        length_all = length_all.max(length);
    }
    for total in &mut solution.total {
        clear(&mut total.force_x_n, limit_all);
        clear(&mut total.force_y_n, limit_all);
        clear(&mut total.moment_z_n_mm, moment_all);
    }
    clear(&mut solution.origin.x_mm, length_all);
    clear(&mut solution.origin.y_mm, length_all);
}

/// Replaces a rounding residue relative to `scale`, and −0, by 0.
fn clear(value: &mut f64, scale: f64) {
    if value.abs() <= DUST * scale {
        *value = 0.0;
    }
}

/// Remarks on numbers that are implausible for wheel and rail; `before` is the number of motions of the case before the first of these.
fn implausible(solution: &Solution, before: usize) -> Vec<RemarkEntry> {
    let alone = solution.patches.len() == 1;
    let force = solution.patches.iter().map(|patch| patch.normal_force_n);
    let mut said: Vec<RemarkEntry> = Vec::new();
    for (k, patch) in solution.patches.iter().enumerate() {
        let number = (!alone).then_some(k);
        let at = |remark: Remark, point| RemarkEntry {
            patch: number,
            point,
            ..remark.into()
        };
        let length = Some((patch.area_mm2 / PI).sqrt());
        said.extend(checked_case::pressure(patch.pressure_max_mpa).map(|remark| at(remark, None)));
        for (motion, point) in patch.points.iter().enumerate() {
            let remark = checked_case::creepage(&point.motion.into(), length);
            said.extend(remark.map(|remark| at(remark, Some(before + motion))));
        }
    }
    let positions = solution
        .wheelset
        .as_ref()
        .map_or(1, |all| all.positions.len());
    let load = force.sum::<f64>() / positions as f64;
    said.extend(checked_case::load(load).map(RemarkEntry::from));
    said
}

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

/// Moves the origin of a patch by `[x, y]` in mm: its extent, its moments and derivatives, and all places in its answer and its fields.
pub(crate) fn move_origin(
    patch: &mut PatchSolution,
    fields: Option<&mut PatchFields>,
    by: [f64; 2],
) {
    for (end, by) in patch.extent_mm.iter_mut().zip([by[0], by[0], by[1], by[1]]) {
        *end -= by;
    }
    patch
        .points
        .iter_mut()
        .for_each(|point| move_point(point, by));
    let [dx, dy] = by;
    let Some(PatchFields { meshes, points }) = fields else {
        return;
    };
    for cells in meshes {
        cells.x_mm.iter_mut().for_each(|x| *x -= dx);
        cells.y_mm.iter_mut().for_each(|y| *y -= dy);
    }
    let stored = points.iter_mut().flat_map(|point| &mut point.subsurface);
    for place in stored.flat_map(|stored| stored.chunks_exact_mut(STORED)) {
        place[0] -= dx;
        place[1] -= dy;
    }
}

fn move_point(point: &mut PointSolution, [dx, dy]: [f64; 2]) {
    point.moment_z_n_mm += dy * point.force_x_n - dx * point.force_y_n;
    if let Some(gradients) = &mut point.gradients {
        move_gradients(gradients, [dx, dy]);
    }
    if let Some(SubsurfaceSummary { worst, passage, .. }) = &mut point.subsurface {
        if let Some(worst) = worst {
            worst.at_mm[0] -= dx;
            worst.at_mm[1] -= dy;
        }
        if let Some(passage) = passage {
            let places = [
                &mut passage.yield_without_residual,
                &mut passage.yield_with_residual,
            ];
            for place in places.into_iter().chain(&mut passage.dang_van) {
                place.at_mm[0] -= dy;
            }
        }
    }
    if let Some(temperature) = &mut point.temperature {
        temperature.at_mm = [temperature.at_mm[0] - dx, temperature.at_mm[1] - dy];
    }
    let across = point
        .damage
        .as_mut()
        .and_then(|damage| damage.across.as_mut());
    for y in across.into_iter().flat_map(|across| &mut across.y_mm) {
        *y -= dy;
    }
}

/// A spin about the new origin moves the old one sideways; the moment takes the forces with it.
fn move_gradients(gradients: &mut Gradients, [dx, dy]: [f64; 2]) {
    let Gradients {
        force_x_n: x,
        force_y_n: y,
        moment_z_n_mm: m,
        error_estimate,
        ..
    } = gradients;
    moved([x, y, m], [dy, -dx]);
    if let Some(GradientErrors {
        force_x_n: x,
        force_y_n: y,
        moment_z_n_mm: m,
        ..
    }) = error_estimate
    {
        moved([x, y, m], [dy.abs(), dx.abs()]);
    }
}

/// Adds to the row of the moment, and to the column of the spin, those of the forces and creepages times their arms.
fn moved([x, y, m]: [&mut [f64; 3]; 3], [along, across]: [f64; 2]) {
    *m = [0, 1, 2].map(|k| m[k] + along * x[k] + across * y[k]);
    for row in [x, y, m] {
        row[2] += along * row[0] + across * row[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_searched_for_numbers_that_are_not_finite() {
        let mut patch = PatchFields {
            meshes: vec![PatchCells::default()],
            points: vec![PointFields::default(); 2],
        };
        let path = |patch: &PatchFields| {
            let patches = vec![PatchFields::default(), patch.clone()];
            Fields { patches }.not_finite()
        };
        assert_eq!(path(&patch), None);
        patch.points[1].slip_y = Some(vec![0.0, f64::NEG_INFINITY]);
        let found = path(&patch);
        assert_eq!(found.as_deref(), Some(".patches[1].points[1].slip_y[1]"));
    }
}
