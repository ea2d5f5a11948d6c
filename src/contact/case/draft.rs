//! Reads a case from JSON and lists all of its faults.
//!
//! A member that is absent, of the wrong type, out of range, unknown or contradictory gets a fault with its JSON pointer (RFC 6901), the
//! value received and what is allowed. Nothing is repaired.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::case::words::contact::{Contact, Load};
use crate::case::words::friction::Friction;
use crate::case::words::material::{Material, Thermal};
use crate::case::words::motion::Motions;
use crate::case::words::object::{Faults, Member, Object, figures, has_controls, join, shown};
use crate::case::words::solver::{Case, MethodName, Output, Solver};
use crate::case::words::subsurface::{DamageWords, Subsurface};
use crate::case::words::{contact, material, motion, solver, subsurface};
use crate::error::{CaseError, Fault, FaultCode};
use crate::method::Method;

/// Maximum number of characters of the name of a case.
const NAME_LENGTH_MAX: usize = 200;
/// Maximum number of labels of a case.
const LABELS_MAX: usize = 32;
/// Maximum number of characters of the key of a label.
const LABEL_KEY_LENGTH_MAX: usize = 64;
/// Maximum number of characters of the value of a label.
const LABEL_VALUE_LENGTH_MAX: usize = 256;

/// The members of a case that could be read. A member is `None` if it is absent or faulty.
#[derive(Debug, Default)]
pub(crate) struct CaseDraft {
    name: Option<String>,
    labels: BTreeMap<String, String>,
    pub(crate) material: Option<Material>,
    pub(crate) friction: Option<Friction>,
    /// Also `None` if the contact needs a load and has none.
    pub(crate) contact: Option<Contact>,
    pub(crate) load: Option<Load>,
    pub(crate) motion: Option<Motions>,
    pub(crate) solver: Option<Solver>,
    pub(crate) outputs: Option<Vec<Output>>,
    pub(crate) subsurface: Option<Subsurface>,
    pub(crate) damage: Option<DamageWords>,
    pub(crate) thermal: Option<Thermal>,
}

impl Case {
    /// Reads a case from JSON.
    ///
    /// Absent members `solver` and `outputs` get their defaults; `outputs` are sorted and without repetition.
    ///
    /// # Errors
    /// All faults of the text; beyond the first hundred only their number.
    pub fn read(value: &Value) -> Result<Case, CaseError> {
        let (draft, faults) = draft(value);
        let case = draft.complete().filter(|_| faults.is_empty());
        case.ok_or(CaseError(faults))
    }
}

/// Reads the members of a case and returns them with the faults of the others.
pub(crate) fn draft(value: &Value) -> (CaseDraft, Vec<Fault>) {
    let mut faults = Faults::default();
    let draft = Object::open(value, String::new(), &mut faults)
        .map(|mut case| read(&mut case))
        .unwrap_or_default();
    (draft, faults.into_list())
}

impl CaseDraft {
    /// The method, if the case names one that exists.
    pub(crate) fn method(&self) -> Option<MethodName> {
        self.solver.map(|solver| solver.method)
    }

    /// Whether the method is `boundary_element`, `auto` or unknown.
    pub(crate) fn may_use_boundary_elements(&self) -> bool {
        matches!(
            self.method(),
            None | Some(MethodName::Auto | MethodName::BoundaryElement)
        )
    }

    /// Returns the requested outputs.
    pub(crate) fn outputs(&self) -> &[Output] {
        self.outputs.as_deref().unwrap_or_default()
    }

    /// Returns the case, if all required members could be read.
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
            subsurface: self.subsurface,
            damage: self.damage,
            thermal: self.thermal,
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
    let mut draft = CaseDraft {
        name: case.line("name", NAME_LENGTH_MAX),
        labels: labels(case),
        material: material::read_material(case),
        friction: Friction::read(case, "friction"),
        contact: contact::read(case),
        load: contact::read_load(case),
        motion: motion::read(case),
        solver: solver::read(case),
        ..CaseDraft::default()
    };
    // Faults of a contact without its load would only repeat that the load is missing.
    draft.contact = draft.contact.filter(|contact| {
        let has_load = matches!(contact, Contact::PressureGrid { .. }) || contact.has_profiles();
        draft.load.is_some() || has_load
    });
    let method = draft.method();
    let without_fields = method.filter(|method| !Method::from(*method).has_fields());
    draft.outputs = solver::read_outputs(case, without_fields);
    let asks = |output| Some(draft.outputs.as_ref()?.contains(&output));
    let wanted = |output| asks(output).unwrap_or(true);
    draft.subsurface = subsurface::read_subsurface(case, wanted(Output::Subsurface)).flatten();
    let damage = subsurface::read_damage(case, wanted(Output::Damage), without_fields.is_some());
    draft.damage = damage.flatten();
    let friction = draft.friction.as_ref();
    let heated = friction.map(|friction| friction.by_temperature.is_some());
    let thermal = match (heated, asks(Output::Temperature)) {
        (Some(true), _) | (_, Some(true)) => Some(true),
        (Some(false), Some(false)) => Some(false),
        _ => None,
    };
    draft.thermal = material::read_thermal(case, thermal).flatten();
    draft
}

fn labels(case: &mut Object) -> BTreeMap<String, String> {
    let mut labels = BTreeMap::new();
    let Some(value) = case.value("labels") else {
        return labels;
    };
    let Value::Object(members) = value else {
        let _: Option<()> = case.mistaken("labels", "an object of texts");
        return labels;
    };
    if members.len() > LABELS_MAX {
        let count = members.len();
        let detail = format!("{count} labels given; at most {LABELS_MAX} are allowed");
        case.fault("labels", detail);
        return labels;
    }
    let pointer = case.pointer_to("labels");
    for (key, value) in members {
        let pointer = join(&pointer, key);
        let length = key.chars().count();
        if length == 0 || length > LABEL_KEY_LENGTH_MAX {
            let detail = format!(
                "a key of {length} characters given; 1 to {LABEL_KEY_LENGTH_MAX} are allowed"
            );
            case.faults().add(&pointer, detail);
        } else if has_controls(key) || key.contains(':') {
            let detail = format!(
                "the key {key:?} given; colons and control characters are not allowed in keys"
            );
            case.faults().add(&pointer, detail);
        }
        let is_sound =
            |text: &&str| text.chars().count() <= LABEL_VALUE_LENGTH_MAX && !has_controls(text);
        if let Some(text) = value.as_str().filter(is_sound) {
            labels.insert(key.clone(), text.to_owned());
        } else {
            let given = shown(value);
            let detail = format!(
                "{given} given; a text of at most {LABEL_VALUE_LENGTH_MAX} characters without control characters is needed"
            );
            let code = match value.is_string() {
                true => FaultCode::Invalid,
                false => FaultCode::WrongType,
            };
            let figures = figures(code, Some(value));
            case.faults().add_with(&pointer, detail, figures);
        }
    }
    labels
}
