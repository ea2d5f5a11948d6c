//! Which cases have the same answer? A digest of everything that determines it, the solver's revision included.

use crate::case::solver::resolution;
use crate::case::words::motion::Motions;
use crate::case::words::solver::{Canonical, Case};
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::TractionBound;
use crate::rolling::task::{Motion, PrescribedForces, RelativeTo, Resolution};

/// Raised whenever a change moves numbers that clients get: equal cases share one answer, and answers of an older revision are not theirs.
/// `tests/physics/golden.rs` fails if numbers move without it, and says how to record the new ones.
pub const SOLVER_REVISION: u32 = 72;

/// The same for bodies that differ alone.
const COUPLING_REVISION: u32 = 3;

/// Hexadecimal BLAKE3 digest of the canonical case.
pub(crate) fn digest(
    case: &Case,
    elasticity: &Elasticity,
    motions: &[Motion],
    forces: &[PrescribedForces],
    speeds: &[Option<f64>],
) -> String {
    let target_error = match resolution(&case.solver) {
        Resolution::Target(target) => Some(target),
        Resolution::Mesh(_) => None,
    };
    let canonical = Canonical {
        solver_version: env!("CARGO_PKG_VERSION"),
        solver_revision: SOLVER_REVISION,
        elasticity: [
            elasticity.shear_modulus,
            elasticity.poisson_ratio,
            elasticity.difference,
        ],
        coupling: elasticity
            .differs()
            .then_some((COUPLING_REVISION, elasticity.lower_share)),
        friction: (&case.friction).into(),
        contact: &case.contact,
        load: case.load.as_ref(),
        motions: motions.iter().map(|motion| (*motion).into()).collect(),
        forces: Some(forces).filter(|all| all.iter().any(|f| *f != [None; 2])),
        wheelset: match &case.motion {
            Motions::Wheelset { wheelset } => Some(wheelset),
            _ => None,
        },
        wheelsets: match &case.motion {
            Motions::Wheelsets { wheelset } => Some(wheelset),
            _ => None,
        },
        history: match &case.motion {
            Motions::History { history, start } => Some((history, *start)),
            _ => None,
        },
        method: case.solver.method,
        // What is left out means the same as the default.
        traction_bound: case
            .solver
            .traction_bound
            .filter(|bound| *bound != TractionBound::default()),
        target_error,
        relative_to: case
            .solver
            .relative_to
            .filter(|of| *of != RelativeTo::default()),
        mesh: case.solver.mesh,
        time_limit_s: case.solver.time_limit_s,
        outputs: &case.outputs,
        subsurface: case.subsurface.as_ref(),
        // Pairs with the same combined constants may have bodies of their own.
        bodies: case.subsurface.as_ref().map(|_| &case.material),
        damage: case.damage.as_ref(),
        thermal: case.thermal.as_ref(),
        // Nothing else depends on them.
        speeds: Some(speeds).filter(|_| {
            case.damage.is_some() || case.thermal.is_some() || case.friction.law.is_some()
        }),
    };
    // Hashed at once, which takes half the time of number by number. Writing into memory cannot fail, and the structure has no map with keys that
    // are not texts.
    let mut text = Vec::new();
    let written = serde_json::to_writer(&mut text, &canonical);
    debug_assert!(written.is_ok());
    blake3::hash(&text).to_hex().to_string()
}
