//! A case in the form of which its digest is taken.

use serde::Serialize;

use crate::contact::case::words::contact::{Contact, Load};
use crate::contact::case::words::damage::DamageWords;
use crate::contact::case::words::friction::Friction;
use crate::contact::case::words::history::{History, HistoryStartName};
use crate::contact::case::words::material::Material;
use crate::contact::case::words::material::ThermalWords;
use crate::contact::case::words::motion::{MotionWords, Wheelset};
use crate::contact::case::words::solver::{
    MeshSizeWords, MethodName, Output, RelativeToName, TractionBoundName,
};
use crate::contact::case::words::subsurface::SubsurfaceWords;
use crate::contact::rolling::motion::PrescribedForces;

/// Everything that determines the answer, in a fixed order; name and labels do not.
#[derive(Serialize)]
pub(crate) struct Canonical<'a> {
    pub(crate) solver_version: &'static str,
    pub(crate) solver_revision: u32,
    pub(crate) elasticity: [f64; 3],
    /// Revision of the method for bodies that differ, and the lower body's share of the displacement. Absent for equal bodies, whose digests do not depend
    /// on that method.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) coupling: Option<(u32, f64)>,
    pub(crate) friction: FrictionForm<'a>,
    pub(crate) contact: &'a Contact,
    pub(crate) load: Option<&'a Load>,
    pub(crate) motions: Vec<MotionWords>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) forces: Option<&'a [PrescribedForces]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) wheelset: Option<&'a Wheelset>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) wheelsets: Option<&'a [Wheelset]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) history: Option<(&'a History, HistoryStartName)>,
    pub(crate) method: MethodName,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) traction_bound: Option<TractionBoundName>,
    pub(crate) target_error: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) relative_to: Option<RelativeToName>,
    pub(crate) mesh: Option<MeshSizeWords>,
    pub(crate) time_limit_s: Option<f64>,
    pub(crate) outputs: &'a [Output],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) subsurface: Option<&'a SubsurfaceWords>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) bodies: Option<&'a Material>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) damage: Option<&'a DamageWords>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) thermal: Option<&'a ThermalWords>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) speeds: Option<&'a [Option<f64>]>,
}

/// A constant coefficient alone is its number, however it is written.
#[derive(Serialize)]
#[serde(untagged)]
pub(crate) enum FrictionForm<'a> {
    Constant(f64),
    Other(&'a Friction),
}

impl<'a> From<&'a Friction> for FrictionForm<'a> {
    fn from(friction: &'a Friction) -> FrictionForm<'a> {
        match friction.constant() {
            Some(coefficient) => FrictionForm::Constant(coefficient),
            None => FrictionForm::Other(friction),
        }
    }
}
