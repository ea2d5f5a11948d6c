//! Checks the members of a case that could be read, independently of each other, so that all faults are reported together.
//!
//! The elastic constants of two bodies are combined into those of the pair here.

use crate::case::draft::CaseDraft;
use crate::case::motions::ExpandedMotions;
use crate::case::rail_pair::KnownPair;
use crate::case::solver::{Limits, resolution};
use crate::case::words::contact::{Contact, OnRails, SurfaceName};
use crate::case::words::friction::Friction;
use crate::case::words::material::Material;
use crate::case::words::motion::Motions;
use crate::case::words::solver::MethodName;
use crate::case::words::subsurface::DamageModel;
use crate::case::{after_tasks, contact_task, motions, wheel_task, wheelsets};
use crate::error::Fault;
use crate::friction::law::FrictionLaw;
use crate::friction::path_dependent::Interface;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::Method;
use crate::normal::footprint::NormalTask;
use crate::normal::hertz::Patch;
use crate::normal::wheel::ReferenceSurface;
use crate::numerics::roots::ROUNDING;
use crate::problem::memory::{SizeInput, length_over_width, segments, spinning};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::methods::table::solve as table;

/// Friction coefficient above which the answer carries a remark.
const FRICTION_USUAL_MAX: f64 = 1.0;

/// The checked parts of a problem. A part is `None` if it is faulty or depends on a faulty member.
#[derive(Debug)]
pub(crate) struct CheckedParts {
    pub(crate) elasticity: Option<Elasticity>,
    pub(crate) task: Option<(NormalTask, Vec<RemarkEntry>)>,
    pub(crate) motions: Option<ExpandedMotions>,
}

impl CheckedParts {
    pub(crate) fn check(
        draft: &CaseDraft,
        known: &KnownPair,
        limits: &Limits,
    ) -> (CheckedParts, Vec<Fault>) {
        let mut faults = Vec::new();
        let elasticity = draft.material.as_ref().map(Elasticity::combine);
        let method = draft.method().map(Method::from);
        // The table has a fault of its own for unlike bodies.
        let uncoupled = elasticity.zip(method.filter(|method| *method != Method::Table));
        faults.extend(uncoupled.and_then(|(pair, method)| pair.uncoupled_fault(method)));
        let motion = draft.motion.as_ref();
        let motions = motion.map(|motion| motions::expand(motion, limits));
        let motions = motions.and_then(|motions| {
            let expanded = motions.map_err(|fault| faults.push(fault));
            expanded.ok()
        });
        let task = draft.contact.as_ref().and_then(|contact| {
            let task = normal_task(contact, draft, elasticity, known, limits);
            task.map_err(|found| faults.extend(found)).ok().flatten()
        });
        let region = task.as_ref().map(|(task, _)| task);
        let patches = region.and_then(NormalTask::known_patches);
        let patches = patches.unwrap_or_default();
        if let Some((motions, motion)) = motions.as_ref().zip(motion) {
            faults.extend(motion_faults(draft, motion, motions, &patches, limits));
        }
        if let Some(history) = motions.as_ref().and_then(|all| all.history.as_ref()) {
            faults.extend(motions::history_faults(history, draft, &patches, limits));
        }
        faults.extend(size_faults(draft, region, motions.as_ref(), limits));
        let of_friction = friction_fault(draft).or_else(|| {
            let speeds = &motions.as_ref()?.speeds;
            region?;
            // Friction may fall too fast on known patches.
            let friction = draft.friction.as_ref()?;
            let interface = Interface::from(friction);
            let modulus = elasticity?.shear_modulus * interface.reduction;
            let law = FrictionLaw::new(friction, draft.thermal.as_ref());
            let detail = law.too_fast(&patches, (modulus, interface.layer), speeds)?;
            Some(Fault::new("/friction", detail))
        });
        faults.extend(of_friction);
        if method == Some(Method::Table) {
            // The table covers some ellipses of like bodies. Other patches are not known yet.
            let unlike = elasticity.as_ref().and_then(table::unlike);
            faults.extend(unlike.map(|detail| Fault::new("/material", detail)));
            let outside = region.and_then(length_over_width).and_then(table::outside);
            faults.extend(outside.map(|detail| Fault::new("/contact", detail)));
        }
        let parts = CheckedParts {
            elasticity,
            task,
            motions,
        };
        (parts, faults)
    }
}

/// Returns the normal problem with its remarks; `None` without faults if it depends on a faulty member.
fn normal_task(
    contact: &Contact,
    draft: &CaseDraft,
    elasticity: Option<Elasticity>,
    known: &KnownPair,
    limits: &Limits,
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let modulus = elasticity.map(|elasticity| elasticity.contact_modulus());
    let load = draft.load.as_ref();
    let Some(rails) = contact.on_rails() else {
        let task = contact_task::task(contact, load, modulus, limits.samples_max);
        return task.transpose().map_err(|fault| vec![fault]);
    };
    let (surface, on_planes, fault) = match surface(draft, &rails) {
        Ok((surface, remark)) => (surface, remark, None),
        Err(fault) => (ReferenceSurface::Planes, None, Some(fault)),
    };
    let unusual = contact_task::unusual(&rails);
    let task = match contact {
        Contact::Wheelset { .. } => {
            let motion = draft.motion.as_ref();
            wheelsets::task(contact, load, motion, modulus, surface, (known, limits))
        }
        _ => wheel_task::task(&rails, load, modulus, surface, known),
    };
    let task = task.map_err(|faults| contact_task::explained(faults, &unusual));
    match (task, fault) {
        (Ok(_), Some(fault)) => Err(vec![fault]),
        (Err(faults), fault) => Err(fault.into_iter().chain(faults).collect()),
        (Ok(task), None) => Ok(task.map(|(task, mut remarks)| {
            remarks.extend(unusual);
            remarks.extend(on_planes.map(RemarkEntry::from));
            (task, remarks)
        })),
    }
}

/// Returns the surface on which the contact of cross-sections is solved: the curve of the rail, unless the case requests planes. A case that
/// requests neither and whose method does not support the curve is solved on planes, with a remark.
///
/// # Errors
/// A method that does not support the requested curve.
fn surface(
    draft: &CaseDraft,
    rails: &OnRails,
) -> Result<(ReferenceSurface, Option<Remark>), Fault> {
    let requested = rails.reference_surface;
    if requested == Some(SurfaceName::Plane) {
        return Ok((ReferenceSurface::Planes, None));
    }
    let required = requested.is_some() || rails.influence.is_some();
    if !draft.may_use_boundary_elements() {
        let reason = "only boundary_element is solved on the curve of the rail";
        if required {
            let detail = format!("{reason}; give contact.reference_surface \"plane\" for it");
            return Err(Fault::new("/solver/method", detail));
        }
        let reason = reason.to_owned();
        return Ok((ReferenceSurface::Planes, Some(Remark::OnPlanes { reason })));
    }
    let surface = ReferenceSurface::Curve {
        influence: rails.influence.unwrap_or_default(),
        required,
    };
    Ok((surface, None))
}

/// Returns the faults of motions together with the contact, friction and the outputs that are computed from the solved contact.
fn motion_faults(
    draft: &CaseDraft,
    motion: &Motions,
    expanded: &ExpandedMotions,
    patches: &[Patch],
    limits: &Limits,
) -> Vec<Fault> {
    let friction = draft.friction.as_ref();
    let of_profiles = matches!(draft.contact, Some(Contact::Profiles { .. }));
    let known = (!patches.is_empty()).then(|| patches.iter().map(|patch| patch.normal_force).sum());
    let force: Option<f64> = draft.load.and_then(|load| load.normal_force_n).or(known);
    let limit = friction.zip(force).map(|(mu, force)| mu.largest() * force);
    let mut faults = expanded.faults(motion, limit, of_profiles);
    let lies_along = friction.is_some_and(|friction| friction.along.is_some());
    if lies_along && expanded.history.is_none() {
        let detail = "given without a history; rolling is steady only where nothing changes along the track: give /motion/history, or a coefficient";
        faults.push(Fault::new("/friction/along", detail));
    }
    if let Some(what) = friction.and_then(Friction::falls_with) {
        // Temperatures need speeds in any case, see below.
        if what == "slip" {
            faults.extend(expanded.speed_fault(motion, "friction that falls with slip"));
        }
        faults.extend(expanded.force_fault(motion, what));
        faults.extend(wheelset_force_fault(motion, what));
    }
    if let Some(words) = &draft.subsurface {
        let motions = expanded.motions.len();
        faults.extend(after_tasks::faults(words, motion, motions, limits));
    }
    let damage = draft.damage.as_ref();
    let archard = damage.is_some_and(|damage| damage.models.contains(&DamageModel::ArchardWear));
    let needed = match (draft.thermal, archard) {
        (Some(_), _) => Some("temperature"),
        (None, true) => Some("archard_wear"),
        (None, false) => None,
    };
    faults.extend(needed.and_then(|what| expanded.speed_fault(motion, what)));
    faults
}

/// Returns the faults of a case that needs more cells, memory or motions than allowed. Unknown quantities count with their smallest values.
fn size_faults(
    draft: &CaseDraft,
    region: Option<&NormalTask>,
    motions: Option<&ExpandedMotions>,
    limits: &Limits,
) -> Vec<Fault> {
    let Some(solver) = &draft.solver else {
        return Vec::new();
    };
    let positions = region.map_or(1, NormalTask::positions);
    let history = motions.and_then(|motions| motions.history.as_ref());
    let size = SizeInput {
        method: solver.method.into(),
        resolution: resolution(solver),
        segments: region.map_or_else(|| vec![1.0], segments),
        motions: motions.map_or(1, |motions| motions.motions.len()) * positions,
        spinning: motions.map_or(0, |motions| spinning(&motions.motions)) * positions,
        history: history.map(|history| history.start),
        fields: draft.outputs().iter().any(|output| output.is_per_cell()),
        stress_points: draft.subsurface.as_ref().map_or(0, after_tasks::count),
        ellipse: region.and_then(length_over_width),
        store: limits.operator_store_bytes,
    };
    size.faults(limits)
}

/// Returns the fault of a force under the wheel of a wheelset, if friction falls so that two velocities may give the force.
fn wheelset_force_fault(motion: &Motions, what: &str) -> Option<Fault> {
    let [along, across] = wheel_task::wheelset_forces(motion);
    let (name, velocity, several) = match (along, across) {
        (Some(_), _) => ("force_x_n", "angular velocity", "angular velocities"),
        (None, Some(_)) => ("force_y_n", "lateral velocity", "lateral velocities"),
        (None, None) => return None,
    };
    let detail = format!(
        "given with friction that falls with {what}, where two {several} may give one force; give the {velocity} instead"
    );
    let pointer = format!("/motion/wheelset/{name}");
    Some(Fault::new(pointer, detail))
}

/// Returns the fault of friction that the contact or the method does not support.
fn friction_fault(draft: &CaseDraft) -> Option<Fault> {
    let friction = draft.friction.as_ref()?;
    let across = friction.across.as_ref();
    let angles = across.is_some_and(|across| across.angle_rad.is_some());
    let contact = draft.contact.as_ref();
    if angles && contact.is_some_and(|contact| !contact.has_profiles()) {
        let detail = "given for another contact than \"type\": \"profiles\" or \"wheelset\"; give y_mm instead";
        return Some(Fault::new("/friction/across/angle_rad", detail));
    }
    let by_table = draft.method() == Some(MethodName::Table);
    let reduced = by_table && friction.coefficient.is_some() && friction.layer.is_none();
    if draft.may_use_boundary_elements() || friction.constant().is_some() || reduced {
        return None;
    }
    let detail = "only a coefficient is covered by this method (table also covers a reduction); boundary_element covers laws, layers and reductions";
    Some(Fault::new("/friction", detail))
}

/// Returns the remark on an unusually large friction coefficient.
pub(crate) fn unusual_friction(friction: &Friction) -> Option<RemarkEntry> {
    let coefficient = friction.largest();
    let member = match friction.coefficient {
        Some(_) => "/friction/coefficient",
        None => "/friction",
    };
    let remark = Remark::FrictionUnusual {
        coefficient,
        usual_max: FRICTION_USUAL_MAX,
    };
    (coefficient > FRICTION_USUAL_MAX).then(|| remark.at_pointer(member))
}

/// Largest |K| of methods that do not couple pressure and traction.
const DIFFERENCE_UNCOUPLED: f64 = 0.05;

impl Elasticity {
    /// Combines the elastic constants of two bodies: `1/G = ½(1/G₁ + 1/G₂)`, `ν/G = ½(ν₁/G₁ + ν₂/G₂)`,
    /// `K/G = ¼((1−2ν₁)/G₁ − (1−2ν₂)/G₂)` with 1 the upper and 2 the lower body; `G = E/(2(1+ν))` where Young's
    /// modulus is given. G in MPa, ν from 0 to 0.5. Source: Kalker 1990, eq. 1.44.
    pub fn combine(material: &Material) -> Elasticity {
        let [lower, upper] = material.bodies();
        let [g1, g2] = [upper, lower].map(|body| body.shear().unwrap_or(f64::NAN));
        let (nu1, nu2) = (upper.poisson_ratio, lower.poisson_ratio);
        if g1 == g2 && nu1 == nu2 {
            return Elasticity {
                shear_modulus: g1,
                poisson_ratio: nu1,
                difference: 0.0,
                lower_share: 0.5,
            };
        }
        let g = 2.0 / (1.0 / g1 + 1.0 / g2);
        let nu = 0.5 * g * (nu1 / g1 + nu2 / g2);
        let lower_share = 0.5 * g * (1.0 - nu2) / (g2 * (1.0 - nu));
        let k = 0.25 * g * ((1.0 - 2.0 * nu1) / g1 - (1.0 - 2.0 * nu2) / g2);
        Elasticity {
            shear_modulus: g,
            poisson_ratio: nu.clamp(0.0, 0.5),
            difference: rounded(k, 0.0),
            lower_share: rounded(lower_share, 0.5),
        }
    }

    /// Returns the fault of bodies that differ too much for a method that does not couple pressure and traction.
    pub(crate) fn uncoupled_fault(&self, method: Method) -> Option<Fault> {
        let k = self.difference;
        let needed = method != Method::BoundaryElement && k.abs() > DIFFERENCE_UNCOUPLED;
        needed.then(|| {
            let detail = format!(
                "the two bodies give the difference parameter K = {k:.4}; at most {DIFFERENCE_UNCOUPLED} in size is allowed with this \
                 method, which does not couple pressure and traction as boundary_element does"
            );
            Fault::new("/material", detail)
        })
    }

    /// Returns the remark on bodies that differ if the method does not couple pressure and traction.
    pub(crate) fn remark(&self, method: Method) -> Option<Remark> {
        let difference_parameter = self.difference;
        let neglected = difference_parameter != 0.0 && method != Method::BoundaryElement;
        neglected.then_some(Remark::CouplingNeglected {
            difference_parameter,
        })
    }
}

/// Returns a constant of the pair, or that of equal bodies if the two differ by rounding errors only.
fn rounded(of_pair: f64, of_like_bodies: f64) -> f64 {
    match (of_pair - of_like_bodies).abs() < ROUNDING {
        true => of_like_bodies,
        false => of_pair,
    }
}

#[cfg(test)]
mod elasticity_tests {
    use super::*;
    use crate::case::words::material::Elastic;

    fn body(g: f64, nu: f64) -> Elastic {
        Elastic {
            shear_modulus_mpa: Some(g),
            young_modulus_mpa: None,
            poisson_ratio: nu,
        }
    }

    fn pair(upper: Elastic, lower: Elastic) -> Elasticity {
        Elasticity::combine(&Material::Pair { lower, upper })
    }

    // Aluminium on steel: G = 35924, ν = 0.3034, K = 0.100 (CONTACT user guide, section 5.3).
    #[test]
    fn aluminium_on_steel_is_for_the_method_that_couples() {
        let e = pair(body(23_000.0, 0.31), body(82_000.0, 0.28));
        assert!((e.difference - 0.1002).abs() < 1e-4);
        assert_eq!(e.uncoupled_fault(Method::BoundaryElement), None);
        for method in [Method::Fastsim, Method::LiuHsu, Method::Table] {
            let fault = e.uncoupled_fault(method).unwrap();
            assert_eq!(fault.pointer, "/material");
            assert!(fault.detail.contains("K = 0.100"), "{}", fault.detail);
        }
    }

    #[test]
    fn combined_constants_follow_kalker() {
        // The same pair with ν₁ raised until K is allowed.
        let (g1, nu1, g2, nu2) = (23_000.0, 0.42, 82_000.0, 0.28);
        let e = pair(body(g1, nu1), body(g2, nu2));
        assert!((e.shear_modulus - 35_923.81).abs() < 0.01);
        assert!((e.poisson_ratio / e.shear_modulus - 0.5 * (nu1 / g1 + nu2 / g2)).abs() < 1e-18);
        let k = 0.25 * ((1.0 - 2.0 * nu1) / g1 - (1.0 - 2.0 * nu2) / g2);
        assert!((e.difference / e.shear_modulus - k).abs() < 1e-18);
        let young = |g: f64, nu: f64| 2.0 * g * (1.0 + nu);
        let compliance = (1.0 - nu1 * nu1) / young(g1, nu1) + (1.0 - nu2 * nu2) / young(g2, nu2);
        assert!((e.contact_modulus() * compliance - 1.0).abs() < 1e-14);
    }

    #[test]
    fn exchanging_the_bodies_changes_only_the_sign_of_the_difference() {
        let (a, b) = (body(80_000.0, 0.30), body(82_000.0, 0.28));
        let (ab, ba) = (pair(a, b), pair(b, a));
        assert!((ab.shear_modulus - ba.shear_modulus).abs() < 1e-9);
        assert!((ab.difference + ba.difference).abs() < 1e-16 && ab.difference != 0.0);
        assert!((ab.lower_share + ba.lower_share - 1.0).abs() < 1e-15 && ab.lower_share > 0.5);
    }

    #[test]
    fn like_bodies_have_no_difference_however_they_are_written() {
        let young = Elastic {
            shear_modulus_mpa: None,
            young_modulus_mpa: Some(2.0 * 82_000.0 * 1.28),
            poisson_ratio: 0.28,
        };
        let e = pair(young, body(82_000.0, 0.28));
        assert!(!e.differs());
        assert!((e.shear_modulus - 82_000.0).abs() < 1e-9);
        assert_eq!(e.remark(Method::Fastsim), None);
    }

    #[test]
    fn two_incompressible_bodies_do_not_couple() {
        assert_eq!(pair(body(1.0, 0.5), body(500.0, 0.5)).difference, 0.0);
    }
}
