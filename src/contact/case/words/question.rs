//! The question as the client writes it: one contact case.
//!
//! A [`Case`] is only ever made by [`Case::read`](crate::contact::case::words::question::Case::read), which collects every fault of the
//! JSON text at once. Lengths in mm, forces in N, stresses in MPa, creepages dimensionless, spin in 1/mm.

use std::collections::BTreeMap;

use railhead_macros::none_is_absent;
use serde::Serialize;
use utoipa::ToSchema;

use crate::contact::case::words::contact::{Contact, Load};
use crate::contact::case::words::damage::DamageWords;
use crate::contact::case::words::friction::Friction;
use crate::contact::case::words::material::Material;
use crate::contact::case::words::material::ThermalWords;
use crate::contact::case::words::motion::Motions;
use crate::contact::case::words::solver::{Output, Solver};
use crate::contact::case::words::subsurface::SubsurfaceWords;

/// One contact case: two bodies, how they are pressed together and how they roll.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Case {
    /// Free text for people, at most 200 characters, none of them a control character.
    pub name: Option<String>,
    /// Free key–value pairs to find the case again, at most 32 of them, without control characters; no key has a colon.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(required = false)]
    pub labels: BTreeMap<String, String>,
    /// Elastic constants of the two bodies.
    pub material: Material,
    /// Friction between them.
    pub friction: Friction,
    /// Where and how the bodies touch.
    pub contact: Contact,
    /// How hard they are pressed together; needed unless the contact carries its own pressure.
    pub load: Option<Load>,
    /// One motion, a list of motions, or a sweep.
    pub motion: Motions,
    /// Method and accuracy; `{"method": "auto", "target_error": 0.005}` when left out.
    #[schema(required = false)]
    pub solver: Solver,
    /// What to compute; `["resultants", "zones"]` when left out.
    #[schema(required = false)]
    pub outputs: Vec<Output>,
    /// Where stresses below the surface are computed; for the output `subsurface`, which finds the worst point without it.
    pub subsurface: Option<SubsurfaceWords>,
    /// Damage models for the output `damage`. When left out, the models with confirmed parameters are evaluated.
    pub damage: Option<DamageWords>,
    /// What the bodies do with heat; for the output `temperature`.
    pub thermal: Option<ThermalWords>,
}
