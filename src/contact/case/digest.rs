//! The digest of a case: equal digests mean equal answers.

use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::case::solver::resolution;
use crate::case::words::motion::Motions;
use crate::case::words::solver::Case;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::TractionBound;
use crate::rolling::task::{Motion, PrescribedForces, RelativeTo};

/// Revision of the solver. It is raised whenever a change moves numbers that clients get: cases with equal digests share one answer.
/// `tests/physics/golden.rs` fails if numbers move without a new revision, and states how to record the new ones.
pub const SOLVER_REVISION: u32 = 77;

/// Revision of what only bodies of different materials use.
const COUPLING_REVISION: u32 = 3;

/// Returns the hexadecimal BLAKE3 digest of everything that determines the answer. Name and labels do not.
pub(crate) fn digest(
    case: &Case,
    elasticity: &Elasticity,
    motions: &[Motion],
    forces: &[PrescribedForces],
    speeds: &[Option<f64>],
) -> String {
    let mut text = Vec::new();
    let mut writer = serde_json::Serializer::new(&mut text);
    let written = writer.serialize_map(None).and_then(|mut map| {
        write_members(&mut map, case, elasticity, motions, forces, speeds)?;
        map.end()
    });
    // Writing into memory does not fail, and all keys are texts.
    debug_assert!(written.is_ok());
    blake3::hash(&text).to_hex().to_string()
}

/// Writes the members in the order that digests are defined by.
fn write_members<M: SerializeMap>(
    map: &mut M,
    case: &Case,
    elasticity: &Elasticity,
    motions: &[Motion],
    forces: &[PrescribedForces],
    speeds: &[Option<f64>],
) -> Result<(), M::Error> {
    let solver = &case.solver;
    map.serialize_entry("solver_version", env!("CARGO_PKG_VERSION"))?;
    map.serialize_entry("solver_revision", &SOLVER_REVISION)?;
    let constants = [
        elasticity.shear_modulus,
        elasticity.poisson_ratio,
        elasticity.difference,
    ];
    map.serialize_entry("elasticity", &constants)?;
    // Absent for equal bodies, whose digests do not depend on the revision of the coupling.
    if elasticity.differs() {
        map.serialize_entry("coupling", &(COUPLING_REVISION, elasticity.lower_share))?;
    }
    // A constant coefficient alone is its number, however it is written.
    match case.friction.constant() {
        Some(coefficient) => map.serialize_entry("friction", &coefficient)?,
        None => map.serialize_entry("friction", &case.friction)?,
    }
    map.serialize_entry("contact", &case.contact)?;
    map.serialize_entry("load", &case.load)?;
    map.serialize_entry("motions", motions)?;
    if forces.iter().any(|forces| *forces != [None; 2]) {
        map.serialize_entry("forces", forces)?;
    }
    match &case.motion {
        Motions::Wheelset { wheelset } => map.serialize_entry("wheelset", wheelset)?,
        Motions::Wheelsets { wheelset } => map.serialize_entry("wheelsets", wheelset)?,
        Motions::History { history, start } => map.serialize_entry("history", &(history, start))?,
        Motions::One(_) | Motions::Many(_) | Motions::Sweep { .. } => {}
    }
    map.serialize_entry("method", &solver.method)?;
    // An absent member means the same as its default.
    let bound = solver.traction_bound;
    let bound = bound.filter(|bound| *bound != TractionBound::default());
    write_some(map, "traction_bound", bound)?;
    map.serialize_entry("target_error", &resolution(solver).target())?;
    let relative_to = solver.relative_to;
    let relative_to = relative_to.filter(|of| *of != RelativeTo::default());
    write_some(map, "relative_to", relative_to)?;
    map.serialize_entry("mesh", &solver.mesh)?;
    map.serialize_entry("time_limit_s", &solver.time_limit_s)?;
    map.serialize_entry("outputs", &case.outputs)?;
    if let Some(subsurface) = &case.subsurface {
        map.serialize_entry("subsurface", subsurface)?;
        // Pairs with the same combined constants may consist of different bodies.
        map.serialize_entry("bodies", &case.material)?;
    }
    write_some(map, "damage", case.damage.as_ref())?;
    write_some(map, "thermal", case.thermal)?;
    // Only these depend on the speed.
    if case.damage.is_some() || case.thermal.is_some() || case.friction.law.is_some() {
        map.serialize_entry("speeds", speeds)?;
    }
    Ok(())
}

fn write_some<M: SerializeMap>(
    map: &mut M,
    name: &str,
    value: Option<impl Serialize>,
) -> Result<(), M::Error> {
    value.map_or(Ok(()), |value| map.serialize_entry(name, &value))
}
