//! Reads a case from JSON and says everything that is wrong with it, at once.
//!
//! A member that is absent, of the wrong type, out of range, unknown or contradictory gets a fault with its JSON
//! pointer (RFC 6901), the value received and what is allowed. Nothing is repaired.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::case::checks::PartialCase;
use crate::case::solver::KnownPair;
use crate::case::words::contact::{Contact, Load};
use crate::case::words::friction::Friction;
use crate::case::words::material::{Material, ThermalWords};
use crate::case::words::motion::Motions;
use crate::case::words::object::{Faults, Member, Object, has_controls, join, shown};
use crate::case::words::solver::{Case, Output, Solver};
use crate::case::words::subsurface::{DamageWords, SubsurfaceWords};
use crate::case::words::{contact, material, motion, solver, subsurface};
use crate::error::{CaseError, Fault};
use crate::method::Method;

/// Most characters of the name of a case.
const NAME_LENGTH_MAX: usize = 200;
/// Most labels of a case.
const LABELS_MAX: usize = 32;
/// Most characters of the key of a label.
const LABEL_KEY_LENGTH_MAX: usize = 64;
/// Most characters of its value.
const LABEL_VALUE_LENGTH_MAX: usize = 256;

/// What could be read of a case: the parts without a fault.
///
/// `None` in a required part means that it is faulty or absent; the fault is in the list that came with the draft.
#[derive(Debug, Default)]
pub(crate) struct CaseDraft {
    name: Option<String>,
    labels: BTreeMap<String, String>,
    material: Option<Material>,
    friction: Option<Friction>,
    contact: Option<Contact>,
    load: Option<Load>,
    motion: Option<Motions>,
    solver: Option<Solver>,
    outputs: Option<Vec<Output>>,
    /// Of these the inner `None` means that the case does not want them.
    subsurface: Option<Option<SubsurfaceWords>>,
    damage: Option<Option<DamageWords>>,
    thermal: Option<Option<ThermalWords>>,
}

impl Case {
    /// Reads a case from JSON.
    ///
    /// Left-out `solver` and `outputs` get their defaults; `outputs` are sorted and named once.
    ///
    /// # Errors
    /// Every fault of the text, at most the first hundred one by one.
    pub fn read(value: &Value) -> Result<Case, CaseError> {
        let (draft, faults) = draft(value);
        draft
            .complete()
            .filter(|_| faults.is_empty())
            .ok_or(CaseError(faults))
    }
}

/// Reads what can be read, and lists the faults of the rest.
pub(crate) fn draft(value: &Value) -> (CaseDraft, Vec<Fault>) {
    let mut faults = Faults::default();
    let draft = Object::open(value, String::new(), &mut faults)
        .map(|mut case| read(&mut case))
        .unwrap_or_default();
    (draft, faults.into_list())
}

impl CaseDraft {
    /// The parts that could be read. Without a load no patch of a contact can be found that needs one.
    pub(crate) fn given<'a>(&'a self, known: &'a KnownPair) -> PartialCase<'a> {
        let without_load = matches!(
            self.contact,
            Some(
                Contact::PressureGrid { .. } | Contact::Profiles { .. } | Contact::Wheelset { .. }
            )
        );
        let contact = self.contact.as_ref();
        PartialCase {
            known,
            material: self.material.as_ref(),
            friction: self.friction.as_ref(),
            contact: contact.filter(|_| without_load || self.load.is_some()),
            load: self.load.as_ref(),
            motion: self.motion.as_ref(),
            solver: self.solver.as_ref(),
            outputs: self.outputs.as_deref().unwrap_or_default(),
            subsurface: self.subsurface.as_ref().and_then(Option::as_ref),
            damage: self.damage.as_ref().and_then(Option::as_ref),
            thermal: self.thermal.as_ref().and_then(Option::as_ref),
        }
    }

    /// The case, if every required part could be read.
    pub(crate) fn complete(self) -> Option<Case> {
        Some(Case {
            name: self.name,
            labels: self.labels,
            material: self.material?,
            friction: self.friction?,
            contact: self.contact?,
            load: self.load,
            motion: self.motion?,
            solver: self.solver?,
            outputs: self.outputs?,
            subsurface: self.subsurface?,
            damage: self.damage?,
            thermal: self.thermal?,
        })
    }
}

fn read(case: &mut Object) -> CaseDraft {
    case.only(&[
        "name",
        "labels",
        "material",
        "friction",
        "contact",
        "load",
        "motion",
        "solver",
        "outputs",
        "subsurface",
        "damage",
        "thermal",
    ]);
    let name = case.line("name", NAME_LENGTH_MAX);
    let labels = labels(case);
    let material = material::read_material(case);
    let friction = Friction::read(case, "friction");
    let contact = contact::read(case);
    let load = contact::read_load(case);
    let motion = motion::read(case);
    let solver = solver::read(case);
    let method = solver.as_ref().map(|solver| solver.method);
    let without_fields = method.filter(|method| !Method::from(*method).has_fields());
    let outputs = solver::read_outputs(case, without_fields);
    let asks = |output| outputs.as_ref().map(|outputs| outputs.contains(&output));
    let wanted = |output| asks(output).unwrap_or(true);
    let subsurface = subsurface::read_subsurface(case, wanted(Output::Subsurface));
    let damage = subsurface::read_damage(case, wanted(Output::Damage), without_fields.is_some());
    let heated = friction
        .as_ref()
        .map(|friction| friction.by_temperature.is_some());
    let thermal = match (heated, asks(Output::Temperature)) {
        (Some(true), _) | (_, Some(true)) => Some(true),
        (Some(false), Some(false)) => Some(false),
        _ => None,
    };
    let thermal = material::read_thermal(case, thermal);
    CaseDraft {
        name,
        labels,
        material,
        friction,
        contact,
        load,
        motion,
        solver,
        outputs,
        subsurface,
        damage,
        thermal,
    }
}

fn labels(case: &mut Object) -> BTreeMap<String, String> {
    let mut labels = BTreeMap::new();
    let Some(value) = case.value("labels") else {
        return labels;
    };
    let pointer = case.pointer_to("labels");
    let Value::Object(members) = value else {
        case.fault(
            "labels",
            format!("{} given; an object of texts is needed", shown(value)),
        );
        return labels;
    };
    if members.len() > LABELS_MAX {
        case.fault(
            "labels",
            format!(
                "{} labels given; at most {LABELS_MAX} are allowed",
                members.len()
            ),
        );
        return labels;
    }
    for (key, value) in members {
        let length = key.chars().count();
        if length == 0 || length > LABEL_KEY_LENGTH_MAX {
            case.faults().add(
                join(&pointer, key),
                format!(
                    "a key of {length} characters given; 1 to {LABEL_KEY_LENGTH_MAX} are allowed"
                ),
            );
        } else if has_controls(key) || key.contains(':') {
            case.faults().add(
                join(&pointer, key),
                format!(
                    "the key {key:?} given; colons and control characters are not allowed in keys"
                ),
            );
        }
        match value.as_str() {
            Some(text)
                if text.chars().count() <= LABEL_VALUE_LENGTH_MAX && !has_controls(text) =>
            {
                labels.insert(key.clone(), text.to_owned());
            }
            _ => case.faults().add(
                join(&pointer, key),
                format!(
                    "{} given; a text of at most {LABEL_VALUE_LENGTH_MAX} characters without control characters is needed",
                    shown(value)
                ),
            ),
        }
    }
    labels
}
