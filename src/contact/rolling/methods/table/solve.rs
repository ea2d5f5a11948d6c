//! The table as a method: resultants of the patches of a footprint for a motion.

use std::ops::RangeInclusive;

use crate::error::SolveError;
use crate::friction::law::FrictionLaw;
use crate::friction::path_dependent::Interface;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::Method;
use crate::monitor::Monitor;
use crate::remark::kind::Rounded;
use crate::rolling::answer::{MotionAnswer, PatchGradients, Resultants};
use crate::rolling::load_ellipse::LoadEllipse;
use crate::rolling::methods::table::evaluate::Creep;
use crate::rolling::methods::table::file::table;
use crate::rolling::task::{Motion, RollingTask};

/// Ratios a/b in the table.
pub const RATIO_RANGE: RangeInclusive<f64> = 0.1..=10.0;
/// Largest load mismatch of a patch that is replaced by its equivalent ellipse; above it errors reach 0.08 μN.
const MISPLACED_MAX: f64 = 0.1;
/// Slope of the error of the equivalent ellipse, relative to μN: `0.3 D + 0.006` holds for 27 patches with load mismatches D up to 0.9.
const PER_MISPLACED: f64 = 0.3;
/// The part of this error that does not depend on D.
const ANY_SHAPE: f64 = 0.006;
/// Additional error with several patches, whose elastic interaction is not in the table.
const NEIGHBOURS: f64 = 0.01;

/// Solves a motion for the equivalent ellipses of the patches.
///
/// # Errors
/// The table does not cover a patch.
pub fn solve(
    task: &RollingTask,
    ellipses: &[LoadEllipse],
    motion: &Motion,
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    let began = monitor.elapsed();
    monitor.go_on(0.0)?;
    let patches = task.footprint.patches();
    let mut found = Vec::with_capacity(patches.len());
    let (mut of_all, mut limits) = (0.0, 0.0);
    let mut errors = Vec::with_capacity(patches.len() + 1);
    for (number, ellipse) in ellipses.iter().enumerate() {
        covers(number, ellipse.load_mismatch, ellipse.ratio())?;
        let limit = task.friction.limit(task.footprint, number);
        let answer = on_ellipse(task, ellipse, limit, motion);
        let mut error = answer.error;
        if ellipse.load_mismatch > 0.0 {
            error += PER_MISPLACED * ellipse.load_mismatch + ANY_SHAPE;
        }
        if patches.len() > 1 {
            error += NEIGHBOURS;
        }
        errors.push(Some(if limit > 0.0 { error } else { 0.0 }));
        of_all += error * limit;
        limits += limit;
        found.push(answer);
    }
    errors.push(match errors[..] {
        [only] => only,
        _ if limits > 0.0 => Some(of_all / limits),
        _ => Some(0.0),
    });
    Ok(MotionAnswer {
        motion: *motion,
        resultants: found.iter().map(|answer| answer.resultants).collect(),
        errors,
        stick: Some(found.iter().map(|answer| answer.stick).collect()),
        gradients: found.iter().map(|answer| answer.gradients).collect(),
        method: Method::Table,
        seconds: (monitor.elapsed() - began).as_secs_f64(),
        ..MotionAnswer::default()
    })
}

/// The reason why the table does not cover a pair of materials, if it does not.
pub fn unlike(elasticity: &Elasticity) -> Option<String> {
    (elasticity.difference != 0.0).then(|| {
        format!(
            "bodies with the difference parameter K = {:.3e}; \"method\": \"table\" covers K = 0, use boundary_element",
            elasticity.difference
        )
    })
}

/// The reason why the table does not cover an ellipse with this ratio of semi-axes, if it does not.
pub fn outside(ratio: f64) -> Option<String> {
    (!RATIO_RANGE.contains(&ratio)).then(|| {
        format!(
            "an ellipse with a/b = {}; \"method\": \"table\" covers {} to {}, use boundary_element or fastsim",
            Rounded(ratio, 6),
            RATIO_RANGE.start(),
            RATIO_RANGE.end()
        )
    })
}

fn covers(number: usize, load_mismatch: f64, ratio: f64) -> Result<(), SolveError> {
    let reason = if load_mismatch > MISPLACED_MAX {
        Some(format!(
            "{:.0} % of the load of patch {number} lies outside the best ellipse; at most {:.0} % is allowed, use boundary_element",
            100.0 * load_mismatch,
            100.0 * MISPLACED_MAX
        ))
    } else {
        outside(ratio).map(|reason| format!("patch {number} is {reason}"))
    };
    reason.map_or(Ok(()), |reason| Err(SolveError::NotCovered { reason }))
}

/// Whether the table can estimate forces: for like bodies without a layer, with friction that does not depend on slip.
pub(crate) fn tells(elasticity: &Elasticity, interface: Interface, friction: &FrictionLaw) -> bool {
    elasticity.difference == 0.0 && interface.layer == 0.0 && !friction.depends_on_slip()
}

/// F_x and F_y in N on an ellipse for a motion about the origin of the case, with a limit μN in N. A ratio of semi-axes outside the table is clamped.
pub(crate) fn forces(
    shear_modulus: f64,
    poisson_ratio: f64,
    ellipse: &LoadEllipse,
    limit: f64,
    motion: &Motion,
) -> [f64; 2] {
    if limit <= 0.0 {
        return [0.0; 2];
    }
    let creepage = dimensionless(shear_modulus, ellipse, limit, motion);
    let ratio = ellipse
        .ratio()
        .clamp(*RATIO_RANGE.start(), *RATIO_RANGE.end());
    let at_ratio = table().ellipse(ratio, poisson_ratio);
    let Creep { force, .. } = at_ratio.interpolated(creepage);
    [limit * force[0], limit * force[1]]
}

/// Converts `[F_x/(μN), F_y/(μN), M_z/(μN√(ab))]` about the centre of an ellipse to resultants about the origin of the case.
fn about_origin(ellipse: &LoadEllipse, limit: f64, force: [f64; 3]) -> Resultants {
    let [x, y] = ellipse.centre;
    let [force_x, force_y] = [force[0], force[1]].map(|part| limit * part);
    Resultants {
        force_x,
        force_y,
        moment_z: limit * ellipse.length() * force[2] + x * force_y - y * force_x,
    }
}

/// Dimensionless creepages about the centre of an ellipse, and spin.
fn dimensionless(
    shear_modulus: f64,
    ellipse: &LoadEllipse,
    limit: f64,
    motion: &Motion,
) -> [f64; 3] {
    let c = ellipse.length();
    let [x, y] = ellipse.centre;
    let unit = shear_modulus * c * c / limit;
    let spin = motion.spin_per_mm;
    [
        unit * (motion.creepage_x - spin * y),
        unit * (motion.creepage_y + spin * x),
        unit * c * spin,
    ]
}

/// The result for one patch.
struct PatchAnswer {
    resultants: Resultants,
    error: f64,
    stick: f64,
    gradients: Option<PatchGradients>,
}

/// Results on an equivalent ellipse about the origin of the case; `limit` is μN in N.
fn on_ellipse(
    task: &RollingTask,
    ellipse: &LoadEllipse,
    limit: f64,
    motion: &Motion,
) -> PatchAnswer {
    if limit <= 0.0 {
        return PatchAnswer {
            resultants: Resultants::default(),
            error: 0.0,
            stick: if motion.is_still() { 1.0 } else { 0.0 },
            gradients: task.wants_gradients.then(PatchGradients::default),
        };
    }
    let c = ellipse.length();
    let modulus = task.interface.reduction * task.elasticity.shear_modulus;
    let unit = modulus * c * c / limit;
    let creepage = dimensionless(modulus, ellipse, limit, motion);
    let here = table().ellipse(ellipse.ratio(), task.elasticity.poisson_ratio);
    let Creep {
        force,
        stick,
        bound,
    } = here.creep(creepage);
    PatchAnswer {
        resultants: about_origin(ellipse, limit, force),
        error: bound,
        stick,
        gradients: task.wants_gradients.then(|| PatchGradients {
            values: gradients(ellipse, limit * unit, here.slopes(creepage)),
            errors: None,
        }),
    }
}

/// Converts the derivatives of an ellipse about its centre to those about the origin of the case, in N and mm; `unit` is G c² in N.
fn gradients(ellipse: &LoadEllipse, unit: f64, slopes: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let c = ellipse.length();
    let [x, y] = ellipse.centre;
    // First in N and mm about the centre, then by ν_x, ν_y and φ about the origin, then with the moment about the origin.
    let arms = [1.0, 1.0, c];
    let own = [0, 1, 2].map(|k| [0, 1, 2].map(|j| slopes[k][j] * unit * arms[k] * arms[j]));
    let by_origin = own.map(|[by_x, by_y, by_spin]| [by_x, by_y, by_spin - y * by_x + x * by_y]);
    let [fx, fy, m] = by_origin;
    let moment = [0, 1, 2].map(|j| m[j] + x * fy[j] - y * fx[j]);
    [fx, fy, moment]
}
