//! The checks of a case: each part is checked independently, and all faults are reported together.
//!
//! Combines the elastic constants of two bodies into those of the pair.

use crate::case::motions::{BesideHistory, ExpandedMotions};
use crate::case::solver::{KnownPair, Limits, resolution};
use crate::case::words::contact::{Contact, Load, SurfaceName};
use crate::case::words::friction::Friction;
use crate::case::words::material::{Material, ThermalWords};
use crate::case::words::motion::Motions;
use crate::case::words::solver::{MethodName, Output, Solver};
use crate::case::words::subsurface::{DamageModel, DamageWords, SubsurfaceWords};
use crate::case::{after_tasks, contact_task, motions, wheel_task, wheelsets};
use crate::error::Fault;
use crate::friction::law::FrictionLaw;
use crate::half_space::unlike_bodies::Elasticity;
use crate::method::Method;
use crate::normal::footprint::NormalTask;
use crate::normal::hertz::Patch;
use crate::normal::wheel::ReferenceSurface;
use crate::problem::memory::{SizeInput, length_over_width, segments, spinning};
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::history::plan::{HistoryStart, HistoryTask};
use crate::rolling::methods::table::solve as table;
use crate::rolling::task::RelativeTo;

/// Friction coefficient above which the answer carries a remark.
const FRICTION_USUAL_MAX: f64 = 1.0;

/// The parts of a case that could be read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartialCase<'a> {
    pub(crate) material: Option<&'a Material>,
    pub(crate) friction: Option<&'a Friction>,
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) load: Option<&'a Load>,
    pub(crate) motion: Option<&'a Motions>,
    pub(crate) solver: Option<&'a Solver>,
    pub(crate) outputs: &'a [Output],
    pub(crate) subsurface: Option<&'a SubsurfaceWords>,
    pub(crate) damage: Option<&'a DamageWords>,
    pub(crate) thermal: Option<&'a ThermalWords>,
    /// Cross-sections that were read for another case.
    pub(crate) known: &'a KnownPair,
}

/// The parts of a problem, checked as far as they are independent of each other.
#[derive(Debug)]
pub(crate) struct CheckedParts {
    pub(crate) elasticity: Option<Elasticity>,
    pub(crate) task: Option<(NormalTask, Vec<RemarkEntry>)>,
    pub(crate) motions: Option<ExpandedMotions>,
}

impl CheckedParts {
    pub(crate) fn check(given: PartialCase, limits: &Limits) -> (CheckedParts, Vec<Fault>) {
        let mut faults = Vec::new();
        let elasticity = given.material.map(Elasticity::combine);
        let method: Option<Method> = given.solver.map(|solver| solver.method.into());
        // The table says it in its own words.
        let uncoupled = elasticity.zip(method.filter(|method| *method != Method::Table));
        faults.extend(uncoupled.and_then(|(pair, method)| pair.uncoupled_fault(method)));
        let motions = given.motion.map(|motion| motions::expand(motion, limits));
        let motions = motions.and_then(|motions| collect_fault(motions, &mut faults));
        let task = normal_task(given.contact, given.load, elasticity.as_ref(), limits);
        let task = match (task, given.contact) {
            (None, Some(contact)) if contact.has_profiles() => {
                let (surface, remark) = surface(&given).unwrap_or_else(|found| {
                    faults.push(found);
                    (ReferenceSurface::Planes, None)
                });
                let task = on_rails(contact, &given, elasticity, surface, limits);
                let mut task = task.unwrap_or_else(|found| {
                    faults.extend(found);
                    None
                });
                if let Some((_, remarks)) = &mut task {
                    remarks.extend(remark.map(RemarkEntry::from));
                }
                task
            }
            (task, _) => task.and_then(|task| collect_fault(task, &mut faults)),
        };
        let region = task.as_ref().map(|(task, _)| task);
        let force = normal_force(region, given.load);
        faults.extend(motion_faults(&given, motions.as_ref(), force, limits));
        if let Some(history) = motions.as_ref().and_then(|all| all.history.as_ref()) {
            faults.extend(history_faults(&given, history, region, limits));
        }
        if let Some(solver) = given.solver {
            let size = SizeInput {
                method: solver.method.into(),
                resolution: resolution(solver),
                // Unknown quantities count with their least possible values.
                segments: task
                    .as_ref()
                    .map_or_else(|| vec![1.0], |(task, _)| segments(task)),
                motions: motions.as_ref().map_or(1, |m| m.motions.len())
                    * task.as_ref().map_or(1, |(task, _)| task.positions()),
                spinning: motions.as_ref().map_or(0, |m| spinning(&m.motions))
                    * task.as_ref().map_or(1, |(task, _)| task.positions()),
                history: motions.as_ref().is_some_and(|m| m.history.is_some()),
                pressed: motions
                    .as_ref()
                    .and_then(|m| m.history.as_ref())
                    .is_some_and(|h| h.start == HistoryStart::Pressed),
                fields: given.outputs.iter().any(|output| output.is_per_cell()),
                stress_points: given.subsurface.map_or(0, after_tasks::count),
                ellipse: region.and_then(length_over_width),
                store: limits.operator_store_bytes,
            };
            faults.extend(size.faults(limits));
        }
        let of_friction = friction_fault(&given).or_else(|| {
            let patches = task.as_ref()?.0.known_patches().unwrap_or_default();
            falls_too_fast(
                given.friction?,
                given.thermal,
                elasticity?,
                &patches,
                &motions.as_ref()?.speeds,
            )
        });
        faults.extend(of_friction);
        if method == Some(Method::Table) {
            faults.extend(not_in_table(elasticity.as_ref(), region));
        }
        let parts = CheckedParts {
            elasticity,
            task,
            motions,
        };
        (parts, faults)
    }
}

/// The surface on which the contact of profiles is solved: the curve of the rail unless the case asks for planes. A case that leaves it open and that the
/// curve does not support is solved on planes, with a remark.
///
/// # Errors
/// A method that the requested curve does not support.
fn surface(given: &PartialCase) -> Result<(ReferenceSurface, Option<Remark>), Fault> {
    let (asked, influence) = given.contact.map_or((None, None), Contact::surface);
    if asked == Some(SurfaceName::Plane) {
        return Ok((ReferenceSurface::Planes, None));
    }
    let required = asked.is_some() || influence.is_some();
    let method = given.solver.map(|solver| solver.method);
    let other_method = !matches!(
        method,
        None | Some(MethodName::Auto | MethodName::BoundaryElement)
    );
    if other_method {
        let reason = "only boundary_element is solved on the curve of the rail";
        if required {
            let detail = format!("{reason}; give contact.reference_surface \"plane\" for it");
            return Err(Fault::new("/solver/method", detail));
        }
        let reason = reason.to_owned();
        return Ok((ReferenceSurface::Planes, Some(Remark::OnPlanes { reason })));
    }
    let surface = ReferenceSurface::Curve {
        influence: influence.unwrap_or_default(),
        required,
    };
    Ok((surface, None))
}

/// Faults of a history beside what it has to go with.
fn history_faults(
    given: &PartialCase,
    history: &HistoryTask,
    task: Option<&NormalTask>,
    limits: &Limits,
) -> Vec<Fault> {
    let beside = BesideHistory {
        contact: given.contact,
        solver: given.solver,
        outputs: given.outputs,
        friction: given.friction,
        patches: &task.and_then(NormalTask::known_patches).unwrap_or_default(),
    };
    let mut faults = motions::faults(history, &beside, limits);
    let of_force = |solver: &&Solver| solver.relative_to == Some(RelativeTo::Force);
    if given.solver.as_ref().is_some_and(of_force) {
        faults.push(Fault::new(
            "/solver/relative_to",
            "\"force\" given with a history, whose forces pass through 0; \"friction_limit\" is allowed",
        ));
    }
    faults
}

/// The task of a wheel or a wheelset with its remarks; `None` without faults where something it depends on is not known.
fn on_rails(
    contact: &Contact,
    given: &PartialCase,
    elasticity: Option<Elasticity>,
    surface: ReferenceSurface,
    limits: &Limits,
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let modulus = elasticity.map(|elasticity| elasticity.contact_modulus());
    let unusual = contact_task::unusual(contact);
    let task = match contact {
        Contact::Wheelset { .. } => {
            wheelsets::task(contact, given.load, given.motion, modulus, surface, limits)
        }
        _ => wheel_task::task(contact, given.load, modulus, surface, given.known),
    };
    let task = task.map_err(|faults| contact_task::explained(faults, &unusual))?;
    Ok(task.map(|(task, mut remarks)| {
        remarks.extend(unusual);
        (task, remarks)
    }))
}

/// Faults of motions beside what goes with them: contact, friction and its limit under a normal force, and outputs.
fn motion_faults(
    given: &PartialCase,
    motions: Option<&ExpandedMotions>,
    force: Option<f64>,
    limits: &Limits,
) -> Vec<Fault> {
    let (Some(expanded), Some(motion)) = (motions, given.motion) else {
        return Vec::new();
    };
    let of_profiles = matches!(given.contact, Some(Contact::Profiles { .. }));
    let limit = given
        .friction
        .zip(force)
        .map(|(mu, force)| mu.largest() * force);
    let mut faults = expanded.faults(motion, limit, of_profiles);
    let lies_along = given
        .friction
        .is_some_and(|friction| friction.along.is_some());
    if lies_along && expanded.history.is_none() {
        let detail = "given without a history; rolling is steady only where nothing changes along the track: give /motion/history, or a coefficient";
        faults.push(Fault::new("/friction/along", detail));
    }
    if let Some(what) = given.friction.and_then(Friction::falls_with) {
        // Temperatures need speeds whatever they are for, see `after_faults`.
        if what == "slip" {
            faults.extend(expanded.speed_fault(motion, "friction that falls with slip"));
        }
        faults.extend(expanded.force_fault(motion, what));
        faults.extend(pull_fault(motion, what));
    }
    faults.extend(after_faults(given, motion, expanded, limits));
    faults
}

/// Finds the faults of the tasks that follow the contact, such as subsurface stresses, damage and temperatures.
fn after_faults(
    given: &PartialCase,
    motion: &Motions,
    motions: &ExpandedMotions,
    limits: &Limits,
) -> Vec<Fault> {
    let mut faults = Vec::new();
    if let Some(words) = given.subsurface {
        faults.extend(after_tasks::fault(words, motions.motions.len(), limits));
        faults.extend(after_tasks::passage_fault(words, motion));
    }
    let archard = given
        .damage
        .is_some_and(|damage| damage.models.contains(&DamageModel::ArchardWear));
    let needed = match (given.thermal, archard) {
        (Some(_), _) => Some("temperature"),
        (None, true) => Some("archard_wear"),
        (None, false) => None,
    };
    faults.extend(needed.and_then(|what| motions.speed_fault(motion, what)));
    faults
}

/// The fault of a force under a wheelset's wheel, where friction falls and two velocities may give it.
fn pull_fault(motion: &Motions, what: &str) -> Option<Fault> {
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

/// Faults of a case that the table does not cover, as far as that is known before patches are found.
fn not_in_table(elasticity: Option<&Elasticity>, task: Option<&NormalTask>) -> Vec<Fault> {
    let unlike = elasticity.and_then(table::unlike);
    let ratio = task.and_then(length_over_width);
    let outside = ratio.and_then(table::outside);
    let faults = [("/material", unlike), ("/contact", outside)].into_iter();
    faults
        .filter_map(|(pointer, detail)| Some(Fault::new(pointer, detail?)))
        .collect()
}

/// The fault of friction that falls too fast on patches that are known.
fn falls_too_fast(
    friction: &Friction,
    thermal: Option<&ThermalWords>,
    elasticity: Elasticity,
    patches: &[Patch],
    speeds: &[Option<f64>],
) -> Option<Fault> {
    let modulus = elasticity.shear_modulus * friction.reduction.unwrap_or(1.0);
    let law = FrictionLaw::new(friction, thermal);
    let detail = law.too_fast(patches, modulus, speeds)?;
    Some(Fault::new("/friction", detail))
}

/// The fault of friction that the method or the contact does not go with.
fn friction_fault(given: &PartialCase) -> Option<Fault> {
    let friction = given.friction?;
    let angles = friction
        .across
        .as_ref()
        .is_some_and(|across| across.angle_rad.is_some());
    if angles && given.contact.is_some_and(|contact| !contact.has_profiles()) {
        let detail = "given for another contact than \"type\": \"profiles\" or \"wheelset\"; give y_mm instead";
        return Some(Fault::new("/friction/across/angle_rad", detail));
    }
    let method = given.solver?.method;
    let covered = matches!(method, MethodName::Auto | MethodName::BoundaryElement);
    if covered || friction.constant().is_some() {
        return None;
    }
    let detail = "only a coefficient is covered by this method; boundary_element covers laws, layers and reductions";
    Some(Fault::new("/friction", detail))
}

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

fn collect_fault<T>(result: Result<T, Fault>, faults: &mut Vec<Fault>) -> Option<T> {
    result.map_err(|fault| faults.push(fault)).ok()
}

/// The normal task and its remarks, if all that it depends on is known; profiles are left to [`wheel_task::task`].
pub(crate) fn normal_task(
    contact: Option<&Contact>,
    load: Option<&Load>,
    elasticity: Option<&Elasticity>,
    limits: &Limits,
) -> Option<Result<(NormalTask, Vec<RemarkEntry>), Fault>> {
    let contact = contact.filter(|contact| !contact.has_profiles())?;
    if let Contact::PressureGrid {
        x_mm,
        y_mm,
        pressure_mpa,
    } = contact
    {
        return Some(contact_task::given(
            x_mm,
            y_mm,
            pressure_mpa,
            limits.samples_max,
        ));
    }
    let Some(load) = load else {
        return Some(Err(missing_load()));
    };
    let modulus = elasticity?.contact_modulus();
    if let Contact::GapProfile { .. } | Contact::GapGrid { .. } = contact {
        let task = contact_task::gap(contact, load, modulus, limits.samples_max);
        return Some(task.map(|task| (task, Vec::new())));
    }
    let task = contact_task::hertz(contact, load, modulus);
    Some(task.map(|task| (task, Vec::new())))
}

/// The normal force of all patches in N, where it is known before the patches are.
fn normal_force(task: Option<&NormalTask>, load: Option<&Load>) -> Option<f64> {
    let given = load.and_then(|load| load.normal_force_n);
    given.or_else(|| {
        let patches = task?.known_patches()?;
        Some(patches.iter().map(|patch| patch.normal_force).sum())
    })
}

pub(crate) fn missing_load() -> Fault {
    Fault::new(
        "/load",
        "missing; exactly one of normal_force_n, approach_mm is needed".to_owned(),
    )
}

/// Largest |K| that methods which solve pressure and traction one after the other take.
const DIFFERENCE_UNCOUPLED: f64 = 0.05;
/// Differences below this are rounding of equal materials written in two ways.
const DIFFERENCE_NOISE: f64 = 1e-12;

impl Elasticity {
    /// Elastic constants of the pair: `1/G = ½(1/G₁ + 1/G₂)`, `ν/G = ½(ν₁/G₁ + ν₂/G₂)`,
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

    /// The fault of bodies that differ too much for a method that does not couple pressure and traction.
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

    /// The remark an answer carries if the bodies differ and the method does not couple pressure and traction.
    pub(crate) fn remark(&self, method: Method) -> Option<Remark> {
        let difference_parameter = self.difference;
        let neglected = difference_parameter != 0.0 && method != Method::BoundaryElement;
        neglected.then_some(Remark::CouplingNeglected {
            difference_parameter,
        })
    }
}

/// A constant of two bodies; that of equal bodies if the two differ by rounding only.
fn rounded(of_pair: f64, of_like_bodies: f64) -> f64 {
    match (of_pair - of_like_bodies).abs() < DIFFERENCE_NOISE {
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
