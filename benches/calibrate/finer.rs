//! Computes reference results: the same contact on much finer meshes than any target needs.

use std::sync::Arc;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal::footprint::{Footprint, NormalTask};
use railhead_contact::normal::hertz::Patch;
use railhead_contact::normal_stage;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::answer::Resultants;
use railhead_contact::rolling::refinement::interpolate::RefinementState;
use railhead_contact::rolling::refinement::mesh_family::MeshFamily;
use railhead_contact::rolling::refinement::on_mesh::{MotionTask, solve_on_mesh};
use railhead_contact::rolling::task::Resolution;
use serde_json::{Value, json};

use crate::patches::{self, PatchAnswer};
use crate::population::{Class, on_planes};
use crate::truth::{Frame, TrueResultants, Truth, distance, print};

/// Numbers of cells of the two meshes that give a reference result.
const CELLS: [u32; 2] = [1024, 2048];
/// Uncertainty in addition to half of the extrapolated change, and the minimum change between two targets.
const LEAST: f64 = 2e-5;
/// Targets for the reference results: of region and pressure of a gap, and of a wheel on a rail.
const TARGET_GAP: f64 = 4e-4;
const TARGET_PROFILES: f64 = 4e-4;
/// Targets of two solves on the curve of the rail. The second solve is the reference result, and its difference from the first is the uncertainty.
const TARGETS_CURVE: [f64; 2] = [5e-4, 2e-4];
/// Uncertainty of the reference result of a wheel on a rail, as a share of its estimate.
const SHARE_PROFILES: f64 = 0.5;

/// Returns the reference result of a case.
///
/// # Errors
/// Returns the reason if the case has no answer.
pub fn find(class: Class, case: &Value) -> Result<Truth, String> {
    match class {
        Class::Profiles => return of_profiles(case),
        Class::Curve => return of_curve(case),
        _ => {}
    }
    let mut fine = case.clone();
    fine["solver"] = json!({ "target_error": TARGET_GAP });
    let checked = contact::check(&fine, &Limits::default()).map_err(|e| e.to_string())?;
    let pressed = normal_stage::solve(&checked, &Unmonitored).map_err(|e| e.to_string())?;
    let (value, change) = two_meshes(&checked, &pressed.footprint).map_err(|e| e.to_string())?;
    let frame = frame_of(&checked, &pressed.footprint);
    let mut uncertainty = change + LEAST;
    let value = frame.relative(value);
    if matches!(checked.problem.task, NormalTask::Gap(_)) {
        // The change from a coarser normal problem, whose error is about three times as large.
        let mut coarse = case.clone();
        coarse["solver"] = json!({ "target_error": 0.001 });
        let checked = contact::check(&coarse, &Limits::default()).map_err(|e| e.to_string())?;
        let coarse = normal_stage::solve(&checked, &Unmonitored).map_err(|e| e.to_string())?;
        let other = [&pressed, &coarse].map(|pressed| {
            one_mesh(&checked, &pressed.footprint, 256)
                .map(|(sum, _)| frame.relative(sum))
                .map_err(|e| e.to_string())
        });
        let [here, there] = other;
        uncertainty += 0.4 * distance(here?, there?);
    }
    Ok(Truth {
        print: print(case),
        whole: TrueResultants {
            value,
            uncertainty,
            centre: frame.centre,
            length: frame.length,
            limit: frame.limit,
        },
        patches: Vec::new(),
    })
}

/// Returns the units and the centre of a problem's resultants.
fn frame_of(checked: &CheckedCase, footprint: &Footprint) -> Frame {
    let patches = footprint.patches();
    let load: f64 = patches.iter().map(|p| p.normal_force).sum();
    let area: f64 = patches.iter().map(|p| p.area).sum();
    let middle = |k: usize| {
        let part = |p: &Patch| 0.5 * (p.extent[2 * k] + p.extent[2 * k + 1]) * p.normal_force;
        patches.iter().map(part).sum::<f64>() / load
    };
    Frame {
        centre: [middle(0), middle(1)],
        length: (area / std::f64::consts::PI).sqrt(),
        limit: checked.problem.friction.largest() * load,
    }
}

/// Returns the sum of the resultants, extrapolated from two fine meshes by half, and the remaining change relative to μN.
fn two_meshes(
    checked: &CheckedCase,
    footprint: &Footprint,
) -> Result<(Resultants, f64), SolveError> {
    let frame = frame_of(checked, footprint);
    let (coarse, coarse_cells) = one_mesh(checked, footprint, CELLS[0])?;
    let (fine, fine_cells) = one_mesh(checked, footprint, CELLS[1])?;
    let share = 1.0 / (fine_cells as f64 / coarse_cells as f64 - 1.0);
    let beyond = fine.beyond(coarse, share, frame.limit);
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let value = Resultants {
        force_x: half(fine.force_x, beyond.force_x),
        force_y: half(fine.force_y, beyond.force_y),
        moment_z: half(fine.moment_z, beyond.moment_z),
    };
    let change = distance(frame.relative(fine), frame.relative(value));
    Ok((value, change))
}

/// Returns the sum of the resultants on a mesh of about `cells` cells in double precision, and the actual number of cells.
fn one_mesh(
    checked: &CheckedCase,
    footprint: &Footprint,
    cells: u32,
) -> Result<(Resultants, usize), SolveError> {
    let mut exact = checked.clone();
    exact.run.resolution = Resolution::Mesh(contact::mesh::MeshSize {
        strips: 8,
        cells: 8,
    });
    let asked = MotionTask {
        index: 0,
        motion: checked.problem.motions[0],
    };
    let task = exact.rolling_task(footprint);
    let mut state = RefinementState::new(&task, &Arc::default());
    let family = MeshFamily::of(&task, &asked.motion);
    let patches = footprint.patches().len() as f64;
    let mut solved = None;
    for cells in [64, 256, cells] {
        let plan = family.mesh(f64::from(cells) / patches);
        let found = solve_on_mesh(
            &task,
            &mut state,
            asked,
            plan,
            solved.as_ref(),
            &Unmonitored,
        )?;
        solved = Some(found);
    }
    let Some(solved) = solved else {
        unreachable!("there are three meshes")
    };
    let zero = Resultants::default();
    let sum = solved.resultants.iter().fold(zero, |sum, r| sum.plus(*r));
    Ok((sum, solved.mesh.mesh.cells()))
}

/// Returns the tangential resultants of a wheel on a rail on planes of contact, patch by patch, from a fine target.
fn of_profiles(case: &Value) -> Result<Truth, String> {
    let mut fine = case.clone();
    fine["solver"] = json!({ "target_error": TARGET_PROFILES });
    on_planes(Class::Profiles, &mut fine);
    let checked = contact::check(&fine, &Limits::default()).map_err(|e| e.to_string())?;
    let (solution, _) = contact::solve(&checked, &Unmonitored).map_err(|e| e.to_string())?;
    let found = PatchAnswer::of_solution(&solution, 0.0).ok_or("no estimate")?;
    Ok(of_patches(case, &found, of_patch))
}

fn of_patches(
    case: &Value,
    found: &[PatchAnswer],
    of: impl Fn(&PatchAnswer) -> TrueResultants,
) -> Truth {
    let several = found.iter().filter(|_| found.len() > 1);
    Truth {
        print: print(case),
        whole: of(&patches::sum(found)),
        patches: several.map(of).collect(),
    }
}

/// Returns the tangential resultants of a wheel on the curve of its rail, patch by patch, from a fine target. The uncertainty is the change from a
/// coarser one.
fn of_curve(case: &Value) -> Result<Truth, String> {
    let of_target = |target: f64| {
        let mut fine = case.clone();
        fine["solver"] = json!({ "target_error": target });
        let checked = contact::check(&fine, &Limits::default()).map_err(|e| e.to_string())?;
        let (solution, _) = contact::solve(&checked, &Unmonitored).map_err(|e| e.to_string())?;
        PatchAnswer::of_solution(&solution, 0.0).ok_or_else(|| "no estimate".to_owned())
    };
    let [coarse, fine] = TARGETS_CURVE.map(of_target);
    let (coarse, mut truth) = (coarse?, of_patches(case, &fine?, of_patch));
    let whole = std::iter::once(&mut truth.whole).chain(&mut truth.patches);
    for known in whole {
        known.uncertainty = 0.0;
    }
    let change = patches::judged(&truth, &coarse).into_iter();
    let change = change.map(|judged| judged.error).fold(LEAST, f64::max);
    let whole = std::iter::once(&mut truth.whole).chain(&mut truth.patches);
    for known in whole {
        known.uncertainty = change;
    }
    Ok(truth)
}

/// Returns the resultants of a patch as its reference result.
fn of_patch(patch: &PatchAnswer) -> TrueResultants {
    let frame = Frame {
        centre: [0.0; 2],
        length: patch.moment_limit / patch.limit,
        limit: patch.limit,
    };
    TrueResultants {
        value: frame.relative(patch.resultants),
        uncertainty: SHARE_PROFILES * patch.estimate / patch.limit,
        centre: frame.centre,
        length: frame.length,
        limit: frame.limit,
    }
}
