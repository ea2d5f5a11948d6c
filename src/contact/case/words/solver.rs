//! A case as a client writes it, and its members `solver` and `outputs`.
//!
//! Lengths are in mm, forces in N, stresses in MPa, spin in 1/mm; creepages are dimensionless.

use std::collections::BTreeMap;

use railhead_macros::{Finite, Members, Named, Words, keyword, none_is_absent};
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::case::words::contact::{Contact, Load};
use crate::case::words::friction::Friction;
use crate::case::words::material::{Material, Thermal};
use crate::case::words::motion::Motions;
use crate::case::words::object::{Member, Object};
use crate::case::words::subsurface::{DamageWords, Subsurface};
use crate::mesh::MeshSize;
use crate::method::TractionBound;
use crate::rolling::task::{RelativeTo, TARGET_LEAST, TARGET_USUAL};

/// Method and accuracy of the solution.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, ToSchema, Members)]
#[members(mismatches)]
pub struct Solver {
    /// The method.
    #[member(default)]
    pub method: MethodName,
    /// Allowed error of the resultants relative to μN (moment: μN√(A/π)), 1e-4 to 0.5. Excludes `mesh`.
    ///
    /// Most cases reach 0.001, few 1e-4. A case that ends above its target has `target_met: false` and the remark `target-missed`. Default
    /// 0.005, except for `fastsim`: its stated error is fixed, so it has no target and no `target_met` unless a target is given.
    #[schema(minimum = 0.0001, maximum = 0.5)]
    #[member(closed(TARGET_LEAST, 0.5, ""))]
    pub target_error: Option<f64>,
    /// What the allowed error is relative to; default `friction_limit`. With `force`, a motion is solved again until its error is
    /// `target_error` of its own tangential force, but not below 1e-4 of μN. Not allowed with `mesh` or for histories.
    pub relative_to: Option<RelativeTo>,
    /// An explicit mesh instead of a target.
    pub mesh: Option<MeshSize>,
    /// Traction bound of `fastsim`; default `elliptic`. Not allowed for other methods.
    pub traction_bound: Option<TractionBound>,
    /// Give up after this many seconds of solving.
    #[member(positive(86_400.0, "s"))]
    pub time_limit_s: Option<f64>,
}

/// The methods a client can choose.
#[keyword(Default, Words, Named, Finite)]
#[schema(as = Method)]
pub enum MethodName {
    /// Resultants by `table` where its error bound meets the target, and else by `boundary_element`, which also gives the values per cell.
    #[default]
    Auto,
    /// Semismooth Newton on the projected equations, strip-preconditioned GMRES.
    BoundaryElement,
    /// The method of Liu and Hsu: Newton–Raphson with two initial guesses.
    LiuHsu,
    /// Kalker's simplified theory: a draft in microseconds.
    Fastsim,
    /// Interpolates resultants of elliptic patches in a table computed by `boundary_element`, in less than a microsecond, with an error
    /// bound. A patch of another shape is replaced by the ellipse with the same load distribution.
    Table,
}

/// A quantity that a case can request. The result contains requested quantities only.
#[keyword(PartialOrd, Ord, Words, Named)]
pub enum Output {
    /// Forces, moment, dissipated power.
    Resultants,
    /// Stick and slip zones: cells, areas, outlines.
    Zones,
    /// Tractions per cell.
    Tractions,
    /// Pressure per cell.
    Pressure,
    /// Slip per cell.
    Slip,
    /// Stresses below the surface, at the points of `subsurface`.
    Subsurface,
    /// Wear and fatigue by the models of `damage`.
    Damage,
    /// Temperature of both surfaces per cell, with the constants of `thermal`.
    Temperature,
    /// Derivatives of forces and moment by creepages and spin, the creep coefficients.
    Gradients,
}

impl Output {
    /// Whether it needs tractions, slips or zones, which only some methods compute.
    pub fn needs_fields(self) -> bool {
        !matches!(
            self,
            Output::Resultants | Output::Gradients | Output::Damage
        )
    }

    /// Whether it has one value per cell.
    pub fn is_per_cell(self) -> bool {
        !matches!(
            self,
            Output::Resultants | Output::Gradients | Output::Damage | Output::Subsurface
        )
    }
}

/// One contact case: two bodies, their load and their motion.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct Case {
    /// Free text for people, at most 200 characters, no control characters.
    pub name: Option<String>,
    /// Key–value pairs for finding the case again: at most 32, without control characters; keys contain no colon.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    #[schema(required = false)]
    pub labels: BTreeMap<String, String>,
    /// Elastic constants of the two bodies.
    pub material: Material,
    /// Friction between the bodies.
    pub friction: Friction,
    /// Where and how the bodies touch.
    pub contact: Contact,
    /// The load that presses the bodies together; required unless `contact` gives the pressure.
    pub load: Option<Load>,
    /// One motion, a list of motions, or a sweep.
    pub motion: Motions,
    /// Method and accuracy; default `{"method": "auto", "target_error": 0.005}`.
    #[schema(required = false)]
    pub solver: Solver,
    /// Quantities to compute; default `["resultants", "zones"]`.
    #[schema(required = false)]
    pub outputs: Vec<Output>,
    /// Points for the output `subsurface`, which computes stresses below the surface; default: only the worst point is found.
    pub subsurface: Option<Subsurface>,
    /// Damage models for the output `damage`. Default: the models with confirmed parameters.
    pub damage: Option<DamageWords>,
    /// Thermal properties of the bodies, for the output `temperature`.
    pub thermal: Option<Thermal>,
}

/// Reads the member `solver` of a case. The default is `auto` with the default target.
pub(crate) fn read(case: &mut Object) -> Option<Solver> {
    let solver = Solver::members(&mut case.child_or_empty("solver")?)?;
    // FASTSIM has one mesh and a stated error, which a target does not change.
    let wanted = solver.mesh.is_none() && solver.method != MethodName::Fastsim;
    let usual = wanted.then_some(TARGET_USUAL);
    Some(Solver {
        target_error: solver.target_error.or(usual),
        ..solver
    })
}

/// Refuses members that exclude each other.
pub(crate) fn mismatches(block: &mut Object, _: Option<&Solver>) -> Option<()> {
    let method = block.value("method").and_then(Value::as_str);
    let is = |name: &str| method == Some(name);
    let (target, mesh) = (block.has("target_error"), block.has("mesh"));
    let targeted = target || !mesh && !is("fastsim");
    let mut sound = Some(());
    for (wrong, name, detail) in [
        (
            block.has("traction_bound") && !is("fastsim"),
            "traction_bound",
            "given for a method without a choice of bounds; only \"method\": \"fastsim\" has one",
        ),
        (
            mesh && is("table"),
            "mesh",
            "given for \"method\": \"table\", which has no mesh",
        ),
        (
            target && mesh,
            "mesh",
            "given together with target_error; exactly one of the two is allowed",
        ),
        (
            block.has("relative_to") && !targeted,
            "relative_to",
            "given without a target; give target_error, or leave relative_to out",
        ),
    ] {
        if wrong {
            sound = block.refuse(name, detail);
        }
    }
    sound
}

/// Reads the member `outputs` of a case, sorted and without repetition. The default is resultants and zones. A method `without_fields`
/// computes resultants, gradients and damage only; every other output is refused.
pub(crate) fn read_outputs(
    case: &mut Object,
    without_fields: Option<MethodName>,
) -> Option<Vec<Output>> {
    if !case.has("outputs") {
        let mut usual = vec![Output::Resultants, Output::Zones];
        usual.retain(|output| without_fields.is_none() || !output.needs_fields());
        return Some(usual);
    }
    case.words("outputs", Output::WORDS, |outputs, index| {
        let output = Output::read(outputs, index)?;
        let detail = match without_fields {
            Some(method) if output.needs_fields() => format!(
                "\"{}\" given; \"method\": \"{}\" computes only \"resultants\", \"gradients\" and \"damage\"",
                output.name(),
                method.name()
            ),
            _ => return Some(output),
        };
        let pointer = outputs.pointer_to(index);
        outputs.faults().refuse(pointer, detail)
    })
}
