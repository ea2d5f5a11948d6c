//! Rolling contact of elastic bodies with friction: forces, tractions, stick and slip zones, each resultant with an estimate of its error.
//!
//! Lengths are in mm, forces in N, stresses in MPa. x is the rolling direction, y points left, z up. Forces act on the lower body.
//!
//! A case states two materials, their friction, where they touch, the load and the motion:
//!
//! ```
//! use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
//!
//! let solution = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::radii(460.0, 300.0))
//!     .load(Load::normal_force(100e3))
//!     .motion(Motion::creepages(0.001, 0.0, 0.0))
//!     .solve()?;
//! let point = &solution.patches[0].points[0];
//! println!("{:.0} N, +-{:.0} N", point.force_x_n, point.error_estimate.unwrap().force_x_n);
//! # Ok::<(), railhead_contact::Error>(())
//! ```
//!
//! A case as JSON, as the HTTP API takes it, is read by [`check`] and solved by [`solve`]:
//!
//! ```
//! use railhead_contact::{Limits, Unmonitored, check, solve};
//!
//! let case = serde_json::json!({
//!     "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
//!     "friction": { "coefficient": 0.3 },
//!     "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
//!     "load": { "normal_force_n": 100e3 },
//!     "motion": { "creepage_x": 0.001 }
//! });
//! let (solution, fields) = solve(&check(&case, &Limits::default())?, &Unmonitored)?;
//! assert_eq!(solution.patches.len(), fields.patches.len());
//! # Ok::<(), railhead_contact::Error>(())
//! ```
//!
//! `examples/` has a Hertz contact, a creep curve and a wheel on a rail.
//!
//! # Stages
//!
//! The code is synchronous and uses no clock, file, environment or output. A case passes these stages once, in order:
//!
//! | stage | from | to | where |
//! |---|---|---|---|
//! | check | JSON, [`Limits`] | [`CheckedCase`]: [`problem`], run, label | [`case`] |
//! | region and pressure | [`NormalTask`] | [`SolvedFootprint`](normal_stage::SolvedFootprint) | [`normal_stage`], [`geometry`], [`normal`] |
//! | motions, from coarse to fine levels | footprint, [`friction`] | [`MotionAnswer`](rolling::answer::MotionAnswer) | [`rolling_stage`], [`rolling`], [`mesh`], [`half_space`] |
//! | answer | answers of motions | [`Solution`], [`Fields`] | [`post`], [`solution`] |
//!
//! Loops around these stages: [`mod@slices`] of long sweeps, [`unlike_bodies`] (in `unlike_motions`), [`wheel_on_rail`] (in [`profile_assessment`]), [`wheelset`].
//! Frame, signs, units and glossary: [`conventions`].
//!
//! # Steps of a motion
//!
//! 1. **Read**: [`case::draft`] reads a [`Case`] from JSON and lists the faults of the text.
//! 2. **Check**: [`case::checks`] converts each part to numbers and lists the faults of the numbers; [`case::check`] combines the parts to a
//!    [`CheckedCase`], which all later steps use.
//! 3. **Slice**: [`slices()`] divides a long sweep; [`solve_slice`] solves one slice.
//! 4. **Find region and pressure**: [`normal_stage::solve`]. A gap is solved by [`normal::gap::solve`], the vertical equilibrium of a wheel by
//!    [`normal::on_curve`].
//! 5. **Solve the motions in order**: [`rolling_stage`]. [`rolling::force_control`] finds the creepages for prescribed forces. A history is
//!    solved by [`rolling::history::solve`] instead.
//! 6. **Refine**: [`rolling::refinement::adapt`] solves the motion on the meshes of its [family](rolling::refinement::mesh_family), coarse to
//!    fine, and stops when the [estimate](rolling::refinement::error_estimate) meets the target.
//! 7. **Solve one mesh**: [`rolling::refinement::on_mesh`] chooses the start values and calls the [method](rolling::methods).
//! 8. **Answer**: [`solution::assemble`] converts the [`MotionAnswer`](rolling::answer::MotionAnswer) to a [`Solution`] with the requested
//!    outputs ([`solution::maintain`]: stresses, damage, temperatures).
//! 9. **Finish**: [`solution::finish`] distributes the time, adds remarks on implausible numbers, and refuses numbers that are not finite.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![warn(unreachable_pub, unused_qualifications)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]
// Clocks, files, environment, network and output, listed in `clippy.toml` of this folder.
#![cfg_attr(
    not(test),
    warn(
        clippy::disallowed_macros,
        clippy::disallowed_methods,
        clippy::disallowed_types
    )
)]

use std::ops::Range;
use std::sync::Arc;

use serde_json::Value;

use crate::case::rail_pair::KnownPair;
use crate::monitor::MonitorPart;
use crate::normal::footprint::NormalTask;
use crate::profile_assessment::trust;
use crate::rolling::operator_store::OperatorStore;
use crate::slices::{joined, slices};
use crate::solution::finish::finish;
use crate::time_limit::TimeLimit;
use crate::unlike_bodies::UnlikeGap;

pub mod case;
pub mod conventions;
pub mod error;
pub mod evaluate;
pub mod evolution;
pub mod facade;
pub mod finite;
pub mod friction;
pub mod geometry;
pub mod half_space;
pub mod lazy_field;
pub mod mesh;
pub mod method;
pub mod monitor;
pub mod normal;
pub mod normal_stage;
pub mod numerics;
pub mod post;
pub mod problem;
pub mod profile_assessment;
pub mod remark;
pub mod rolling;
pub mod rolling_stage;
pub mod slices;
pub mod solution;
pub(crate) mod surface_fallback;
pub mod time_limit;
pub(crate) mod traction_estimate;
pub mod unlike_bodies;
pub(crate) mod vertical_equilibrium;
pub(crate) mod wheel_force_control;
pub mod wheel_on_rail;
pub mod wheelset;

pub use crate::case::solver::Limits;
pub use crate::case::words::contact::{Contact, Load, SurfaceName as ReferenceSurface};
pub use crate::case::words::cross_section::CrossSection;
pub use crate::case::words::friction::Friction;
pub use crate::case::words::material::{Elastic, Material};
pub use crate::case::words::motion::{AskedMotion as Motion, Motions, Wheelset};
pub use crate::case::words::solver::Case;
pub use crate::case::words::solver::{MethodName as Method, Output, Solver};
pub use crate::error::{CaseError, Fault, SolveError};
pub use crate::facade::Error;
pub use crate::geometry::formats::Format;
pub use crate::geometry::wheel_rail::Side;
pub use crate::half_space::bent_surface::Influence as SurfaceInfluence;
pub use crate::monitor::{Monitor, Unmonitored};
pub use crate::problem::checked_case::CheckedCase;
pub use crate::solution::words::answer::Fields;
pub use crate::solution::words::answer::Solution;

/// Reads and checks a case.
///
/// # Errors
/// All faults of the case: those of the text, and those of its readable members against physics and limits.
pub fn check(case: &Value, limits: &Limits) -> Result<CheckedCase, CaseError> {
    check_with(&KnownPair::default(), case, limits)
}

/// Like [`check`], for one of many cases: profiles in `known` are not read again.
///
/// # Errors
/// See [`check`].
pub fn check_with(
    known: &KnownPair,
    case: &Value,
    limits: &Limits,
) -> Result<CheckedCase, CaseError> {
    CheckedCase::new(case, limits, known)
}

/// Solves a checked case, slice by slice.
///
/// # Errors
/// The reason why there is no answer.
pub fn solve(case: &CheckedCase, monitor: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    solve_with(&Arc::default(), case, monitor)
}

/// Like [`solve`], for one of many problems: the store keeps operators for patches of equal shape.
///
/// # Errors
/// See [`solve`].
pub fn solve_with(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let ranges = slices(case).into_iter();
    joined(ranges.map(|range| solve_slice(operators, case, range, monitor)))
}

/// Solves one slice of a case: a range of motions from [`slices()`]. Motions have their numbers in the case.
///
/// # Errors
/// The reason why there is no answer.
pub fn solve_slice(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    range: Range<usize>,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let all = case.problem.motions.len();
    if range == (0..all) {
        return solve_motions(operators, case, monitor);
    }
    let share = MonitorPart::new(
        monitor,
        range.start as f64 / all as f64,
        range.len() as f64 / all as f64,
    );
    solve_motions(operators, &case.slice(range), &share)
}

/// Runs the stages of a case: region and pressure, motions, answer. For a wheel, the solver iterates over these stages, for each patch in its
/// own frame, until the forces are in equilibrium.
fn solve_motions(
    operators: &Arc<OperatorStore>,
    case: &CheckedCase,
    monitor: &dyn Monitor,
) -> Result<(Solution, Fields), SolveError> {
    let began = monitor.elapsed();
    let answer = match &case.problem.task {
        NormalTask::Wheel(wheel) => {
            let solved = surface_fallback::solve_wheel(case, wheel, monitor, |case, wheel| {
                match case.problem.pull() {
                    None => trust::solve(operators, case, wheel, monitor),
                    Some(forces) => {
                        wheel_force_control::solve(operators, case, wheel, forces, monitor)
                    }
                }
            });
            let ((mut solution, fields), remark) = solved?;
            solution.remarks.extend(remark);
            (solution, fields)
        }
        NormalTask::Wheelset(wheelset) => {
            wheelset::balance::solve(operators, case, wheelset, monitor)?
        }
        NormalTask::Hertz(_) | NormalTask::Given(_) | NormalTask::Gap(_) => {
            let monitor = &TimeLimit::new(monitor, case.run.time_limit, case.problem.motions.len());
            let explained = |error| monitor.explained(error, case);
            if case.problem.is_coupled(&case.run) {
                let gap = UnlikeGap::of_case(case, monitor).map_err(explained)?;
                unlike_bodies::solve(operators, case, &gap, monitor)?
            } else {
                let footprint = normal_stage::solve(case, monitor).map_err(explained)?;
                rolling_stage::solve(operators, case, &footprint, monitor)?
            }
        }
    };
    finish(case, answer, monitor.elapsed().saturating_sub(began))
}
