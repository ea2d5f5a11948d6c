//! What a history goes with: contact, method, material and outputs, and how long it may be.

use crate::contact::case::limits::Limits;
use crate::contact::case::words::contact::Contact;
use crate::contact::case::words::friction::Friction;
use crate::contact::case::words::solver::{MethodName, Output, Solver};
use crate::contact::error::Fault;
use crate::contact::normal::patch::Patch;
use crate::contact::rolling::history::solve::too_long;
use crate::contact::rolling::history::task::{HistoryStart, HistoryTask};

/// Outputs that hold for steady rolling only.
const OUTPUTS_REFUSED: [(Output, &str); 3] = [
    (Output::Damage, "damage"),
    (Output::Temperature, "temperature"),
    (Output::Gradients, "gradients"),
];

/// What of a case a history has to go with, as far as it could be read.
pub(crate) struct BesideHistory<'a> {
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) solver: Option<&'a Solver>,
    pub(crate) outputs: &'a [Output],
    pub(crate) friction: Option<&'a Friction>,
    /// Those that are known before a solve.
    pub(crate) patches: &'a [Patch],
}

/// The fault of friction that depends on all the slip behind a place of the contact.
fn friction_fault(friction: &Friction) -> Option<Fault> {
    let yields = friction
        .layer
        .is_some_and(|layer| layer.yield_mpa.is_some());
    let pointer = match &friction.by_temperature {
        Some(_) => "/friction/by_temperature",
        None if yields => "/friction/layer/yield_mpa",
        None => return None,
    };
    let detail = "given with a history, which follows a coefficient that does not depend on temperature and layers that do not yield";
    Some(Fault::new(pointer, detail))
}

/// The fault of a case that begins pressed together and whose patch would not stay similar to itself while it grows.
fn pressed_fault(given: &BesideHistory) -> Option<Fault> {
    let similar = given
        .contact
        .is_none_or(|c| matches!(c, Contact::Radii { .. } | Contact::Ellipse { .. }));
    if !similar {
        let detail = "\"pressed\" given for another contact than \"type\": \"radii\" or \"ellipse\", whose patches stay similar while they grow; give \"rest\"";
        return Some(Fault::new("/motion/start", detail));
    }
    let friction = given.friction?;
    let (pointer, what) = match friction {
        Friction {
            across: Some(_), ..
        } => ("/friction/across", "a coefficient that varies across"),
        Friction { along: Some(_), .. } => ("/friction/along", "a coefficient that varies along"),
        Friction { law: Some(_), .. } => ("/friction/law", "a coefficient that falls with slip"),
        Friction { layer: Some(_), .. } => ("/friction/layer", "a layer"),
        _ => return None,
    };
    let detail = format!(
        "{what} given for bodies that are \"pressed\", whose patch stays similar while it grows with one coefficient and without a layer only"
    );
    Some(Fault::new(pointer, detail))
}

/// Faults of a case with a history.
pub(crate) fn faults(history: &HistoryTask, given: &BesideHistory, limits: &Limits) -> Vec<Fault> {
    let mut faults = Vec::new();
    if matches!(given.contact, Some(Contact::Wheelset { .. })) {
        let detail = "given with a wheelset, whose pose and forces are found for steady rolling; give one of its wheels as \"type\": \"profiles\"";
        faults.push(Fault::new("/motion/history", detail));
    }
    let method = given.solver.map(|solver| solver.method);
    if method.is_some_and(|m| !matches!(m, MethodName::Auto | MethodName::BoundaryElement)) {
        let detail = "only boundary_element (or auto) follows a history";
        faults.push(Fault::new("/solver/method", detail));
    }
    if history.start == HistoryStart::Pressed {
        faults.extend(pressed_fault(given));
    }
    if given
        .friction
        .is_some_and(|friction| friction.largest() == 0.0)
    {
        let detail = "no friction given; without tractions nothing is remembered";
        faults.push(Fault::new("/friction", detail));
    }
    faults.extend(given.friction.and_then(friction_fault));
    for (output, name) in OUTPUTS_REFUSED {
        if given.outputs.contains(&output) {
            let detail = format!("{name} given with a history; it is computed for steady rolling");
            faults.push(Fault::new("/outputs", detail));
        }
    }
    let extents: Vec<[f64; 4]> = given.patches.iter().map(|patch| patch.extent).collect();
    if let Some(detail) = too_long(history, &extents, limits.motions_max) {
        faults.push(Fault::new("/motion/history/distance_mm", detail));
    }
    faults
}
