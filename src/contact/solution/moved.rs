//! Moves the coordinates of a patch to another origin.

use crate::contact::post::subsurface::states::STORED;
use crate::contact::solution::words::answer::{
    GradientErrors, Gradients, PatchFields, PatchSolution, PointSolution,
};
use crate::contact::solution::words::evolution::SubsurfaceSummary;

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
