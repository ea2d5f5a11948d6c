//! Derivatives of the resultants by creepages and spin, by finite differences.
//!
//! Region, pressure and meshes are fixed, so the resultants are smooth functions of the motion. Central differences of two steps are extrapolated to step 0
//! (Richardson).

use crate::error::SolveError;
use crate::monitor::Monitor;
use crate::rolling::answer::{MotionAnswer, PatchGradients, Resultants};
use crate::rolling::refinement::adapt::{solve_forces, solve_on_meshes};
use crate::rolling::refinement::error_estimate::error_by_extrapolation;
use crate::rolling::refinement::interpolate::RefinementState;
use crate::rolling::refinement::on_mesh::MotionTask;
use crate::rolling::task::{Motion, RollingTask};

/// The smaller step over μN/(G c²), with c² = A/π. A creepage of that unit makes nearly everything slip, so the force changes by about 0.02 μN, and the noise
/// of a solve, 1e-5 μN, is far below the error of the mesh.
pub(crate) const STEP: f64 = 0.005;

/// Least size, over the same unit, of the motion whose meshes are used. The meshes of a slower motion meet the target of its small forces, but do not resolve
/// their slopes.
const LEAST: f64 = 0.3;

/// Adds the gradients to an answer.
///
/// # Errors
/// The reason why a neighbouring motion has no solution; or the monitor stopped the work.
pub(crate) fn add_gradients(
    task: &RollingTask,
    state: &mut RefinementState,
    index: usize,
    found: &mut MotionAnswer,
    monitor: &dyn Monitor,
) -> Result<(), SolveError> {
    let patches = task.footprint.patches();
    let limit = task.friction.limit_of_all(task.footprint);
    if limit <= 0.0 {
        found.gradients = Some(vec![PatchGradients::default(); patches.len()]);
        return Ok(());
    }
    let began = monitor.elapsed();
    let task = &RollingTask {
        wants_slips: false,
        wants_gradients: false,
        is_differenced: true,
        ..*task
    };
    let motion = found.motion;
    let area: f64 = patches.iter().map(|patch| patch.area).sum();
    let length = (area / std::f64::consts::PI).sqrt();
    let modulus = task.interface.reduction * task.elasticity.shear_modulus;
    let creepage = limit / (modulus * length * length);
    let units = [creepage, creepage, creepage / length];
    let asked = MotionTask {
        index,
        motion: at_least(LEAST, motion, units),
    };
    let (_, meshes) = solve_forces(task, state, asked, monitor)?;
    let steps = units.map(|unit| STEP * unit);
    // On a client mesh, resultants are not extrapolated.
    let kind = usize::from(task.target().is_none());
    let mut all = vec![PatchGradients::default(); patches.len()];
    for (component, step) in steps.into_iter().enumerate() {
        let mut at = |times: f64| {
            let motion = moved(motion, component, times * step);
            let asked = MotionTask { index, motion };
            let answer = solve_on_meshes(task, state, asked, &meshes, monitor)?;
            found.work.add_lost(answer.work);
            let finest = answer.fields.as_ref().map(|fields| {
                let mesh = state.levels.get(fields.level);
                let traction = &fields.tangential.traction;
                let of_patch = |patch| Resultants::of_patch(&mesh, traction, patch);
                (0..patches.len()).map(of_patch).collect::<Vec<_>>()
            });
            Ok::<_, SolveError>([
                answer.resultants.clone(),
                finest.unwrap_or(answer.resultants),
            ])
        };
        let values = [at(-2.0)?, at(-1.0)?, at(1.0)?, at(2.0)?];
        for (
            patch,
            PatchGradients {
                values: slopes,
                errors,
            },
        ) in all.iter_mut().enumerate()
        {
            let errors = errors.get_or_insert_default();
            let of = |kind: usize, row: usize| {
                slope(
                    [0, 1, 2, 3].map(|k| numbers(values[k][kind][patch])[row]),
                    step,
                )
            };
            for row in 0..3 {
                let (value, by_step) = of(kind, row);
                let (other, _) = of(1 - kind, row);
                slopes[row][component] = value;
                let noise = task.tolerance(index) * [limit, limit, limit * length][row] / step;
                errors[row][component] = by_step + error_by_extrapolation(value, other) + noise;
            }
        }
    }
    found.gradients = Some(all);
    found.seconds += (monitor.elapsed() - began).as_secs_f64();
    Ok(())
}

/// The slope of a function at 0 and its error, from its values at −2, −1, 1 and 2 steps. Where slip begins, forces have a kink of higher order, at which the
/// extrapolated slope is off by up to the change between both steps; the error is twice that change.
pub(crate) fn slope(values: [f64; 4], step: f64) -> (f64, f64) {
    let small = (values[2] - values[1]) / (2.0 * step);
    let large = (values[3] - values[0]) / (4.0 * step);
    (small + (small - large) / 3.0, 2.0 * (small - large).abs())
}

/// A motion of the same direction with at least `size` units. At rest, all components are equal.
fn at_least(size: f64, motion: Motion, units: [f64; 3]) -> Motion {
    let parts = motion.components();
    let relative = [0, 1, 2].map(|k| parts[k] / units[k]);
    let own = relative.iter().fold(0.0_f64, |sum, part| sum.hypot(*part));
    if own >= size {
        return motion;
    }
    let direction = if own > 0.0 {
        relative.map(|part| part / own)
    } else {
        [1.0 / 3.0_f64.sqrt(); 3]
    };
    Motion::of([0, 1, 2].map(|k| size * direction[k] * units[k]))
}

fn moved(motion: Motion, component: usize, step: f64) -> Motion {
    let mut moved = motion.components();
    moved[component] += step;
    Motion::of(moved)
}

fn numbers(resultants: Resultants) -> [f64; 3] {
    [resultants.force_x, resultants.force_y, resultants.moment_z]
}
