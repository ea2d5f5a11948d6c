//! The final steps of an answer: wall times, rounding residues, remarks on implausible numbers and the check that all numbers are finite. The
//! values per cell and the change of a patch's origin are here too.

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
    Fields, Gradients, PatchCells, PatchFields, PatchSolution, PointFields, PointSolution,
    Solution, Zone,
};
use crate::solution::words::evolution::SubsurfaceSummary;

/// Values below this fraction of their scale are rounding residues and are reported as 0.
const ROUNDING_RESIDUE: f64 = 1e-14;

/// Finishes the answer to a problem that took a wall time.
///
/// # Errors
/// [`SolveError::NotFinite`] if a number in the answer is not finite.
pub fn finish(
    case: &CheckedCase,
    (mut solution, fields): (Solution, Fields),
    took: Duration,
) -> Result<(Solution, Fields), SolveError> {
    if let Some(path) = solution.not_finite().or_else(|| fields.not_finite()) {
        let quantity = path.trim_start_matches('.').to_owned();
        return Err(SolveError::NotFinite { quantity });
    }
    clear_residues(case, &mut solution);
    scale_seconds(&mut solution, took.as_secs_f64());
    let implausible = implausible(&solution, case.problem.part.before);
    solution.remarks = merged(solution.remarks.into_iter().chain(implausible));
    Ok((solution, fields))
}

/// Divides the wall time of each motion among its patches by their areas. Before, each patch has the whole time.
pub fn share_seconds(solution: &mut Solution) {
    let area: f64 = solution.patches.iter().map(|patch| patch.area_mm2).sum();
    for patch in &mut solution.patches {
        for point in &mut patch.points {
            point.solver.seconds *= patch.area_mm2 / area;
        }
    }
}

/// Scales the wall times of the motions to the sum `took`. Time that belongs to no motion is distributed in proportion.
fn scale_seconds(solution: &mut Solution, took: f64) {
    let points = || solution.patches.iter().flat_map(|patch| &patch.points);
    let count = points().count();
    let sum: f64 = points().map(|point| point.solver.seconds).sum();
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

/// Sets rounding residues of larger numbers to 0.
fn clear_residues(case: &CheckedCase, solution: &mut Solution) {
    let (mut limit_all, mut moment_all, mut length_all) = (0.0, 0.0, 0.0_f64);
    for patch in &mut solution.patches {
        let length = (patch.area_mm2 / PI).sqrt();
        let limit = case.problem.friction.largest() * patch.normal_force_n;
        for point in &mut patch.points {
            let motion = &point.motion;
            let creepage = motion.creepage_x.hypot(motion.creepage_y);
            let power = limit * creepage.hypot(motion.spin_per_mm * length);
            clear([&mut point.force_x_n, &mut point.force_y_n], limit);
            clear([&mut point.moment_z_n_mm], limit * length);
            clear([&mut point.friction_power_n], power);
            clear([&mut point.friction_power_without_spin_n], power);
            if let Some(region) = &mut point.region {
                clear(&mut region.extent_mm, length);
            }
        }
        clear(&mut patch.extent_mm, length);
        if let Some(position) = &mut patch.position {
            clear(&mut position.track_mm, length);
            clear(&mut position.origin_track_mm, length);
        }
        limit_all += limit;
        moment_all += limit * length;
        length_all = length_all.max(length);
    }
    for total in &mut solution.total {
        clear([&mut total.force_x_n, &mut total.force_y_n], limit_all);
        clear([&mut total.moment_z_n_mm], moment_all);
    }
    let origin = &mut solution.origin;
    clear([&mut origin.x_mm, &mut origin.y_mm], length_all);
}

/// Replaces rounding residues relative to `scale`, and −0, by 0.
fn clear<'a>(values: impl IntoIterator<Item = &'a mut f64>, scale: f64) {
    for value in values {
        if value.abs() <= ROUNDING_RESIDUE * scale {
            *value = 0.0;
        }
    }
}

/// Returns remarks on numbers that are implausible for wheel and rail. The first motion has the index `before` in the case.
fn implausible(solution: &Solution, before: usize) -> Vec<RemarkEntry> {
    let alone = solution.patches.len() == 1;
    let force = solution.patches.iter().map(|patch| patch.normal_force_n);
    let mut remarks: Vec<RemarkEntry> = Vec::new();
    for (k, patch) in solution.patches.iter().enumerate() {
        let number = (!alone).then_some(k);
        let at = |remark: Remark, point| RemarkEntry {
            patch: number,
            point,
            ..remark.into()
        };
        let length = Some((patch.area_mm2 / PI).sqrt());
        let pressure = checked_case::pressure(patch.pressure_max_mpa);
        remarks.extend(pressure.map(|remark| at(remark, None)));
        for (motion, point) in patch.points.iter().enumerate() {
            let remark = checked_case::creepage(&point.motion, length);
            remarks.extend(remark.map(|remark| at(remark, Some(before + motion))));
        }
    }
    let positions = solution
        .wheelset
        .as_ref()
        .map_or(1, |all| all.positions.len());
    let load = force.sum::<f64>() / positions as f64;
    remarks.extend(checked_case::load(load).map(RemarkEntry::from));
    remarks
}

/// Returns the cells of a patch.
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

/// Adds the requested zones and tractions of a patch to its values for one motion.
pub(crate) fn with_tractions(
    case: &CheckedCase,
    level: &StripMesh,
    cells: std::ops::Range<usize>,
    answer: &LevelAnswer,
    values: PointFields,
) -> PointFields {
    let run = &case.run;
    let traction = |k: usize| {
        let values = answer.traction[k][cells.clone()].iter();
        run.wants(Output::Tractions)
            .then(|| values.map(|value| value * level.scale.traction).collect())
    };
    let zone = |slips: &bool| if *slips { Zone::Slip } else { Zone::Stick };
    let zones = answer.slips[cells.clone()].iter().map(zone);
    PointFields {
        zone: run.wants(Output::Zones).then(|| zones.collect()),
        traction_x_mpa: traction(0),
        traction_y_mpa: traction(1),
        ..values
    }
}

/// Returns the largest tangential traction in the cells of a patch, in MPa.
pub(crate) fn traction_max(level: &StripMesh, fields: &SolvedFields, patch: usize) -> f64 {
    let [x, y] = &fields.tangential.traction;
    let lengths = level.patch_cells(patch).map(|i| length(x[i], y[i]));
    lengths.fold(0.0, f64::max) * level.scale.traction
}

/// Moves the origin of a patch by `[x, y]` in mm: changes its extent, moments, derivatives and all coordinates in its answer and fields.
pub(crate) fn move_origin(
    patch: &mut PatchSolution,
    fields: Option<&mut PatchFields>,
    by: [f64; 2],
) {
    for (end, by) in patch.extent_mm.iter_mut().zip([by[0], by[0], by[1], by[1]]) {
        *end -= by;
    }
    for point in &mut patch.points {
        move_point(point, by);
    }
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

/// Moves the origin of derivatives: a spin about the new origin moves the old one sideways, and the moment includes the forces.
fn move_gradients(gradients: &mut Gradients, [dx, dy]: [f64; 2]) {
    let own = gradients;
    let rows = [
        &mut own.force_x_n,
        &mut own.force_y_n,
        &mut own.moment_z_n_mm,
    ];
    moved(rows, [dy, -dx]);
    if let Some(own) = &mut own.error_estimate {
        let rows = [
            &mut own.force_x_n,
            &mut own.force_y_n,
            &mut own.moment_z_n_mm,
        ];
        moved(rows, [dy.abs(), dx.abs()]);
    }
}

/// Adds the forces times their arms to the row of the moment, and the creepages times theirs to the column of the spin.
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
