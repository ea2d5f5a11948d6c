//! The checks of a case: each part is checked independently, and all faults are reported together.

use crate::contact::case::after_tasks::AfterWords;
use crate::contact::case::history::BesideHistory;
use crate::contact::case::known_pair::KnownPair;
use crate::contact::case::limits::Limits;
use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::resolution::resolution;
use crate::contact::case::words::contact::{Contact, InfluenceName, Load, SurfaceName};
use crate::contact::case::words::friction::Friction;
use crate::contact::case::words::material::Material;
use crate::contact::case::words::material::ThermalWords;
use crate::contact::case::words::motion::Motions;
use crate::contact::case::words::solver::{MethodName, Output, RelativeToName, Solver};
use crate::contact::case::{contact_task, history, length_units, motions, wheel_task, wheelsets};
use crate::contact::error::Fault;
use crate::contact::friction::law::FrictionLaw;
use crate::contact::half_space::bent_surface::Influence;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::method::Method;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::wheel::task::ReferenceSurface;
use crate::contact::problem::memory::{SizeInput, length_over_width, segments, spinning};
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::history::task::HistoryTask;
use crate::contact::rolling::methods::table::solve as table;

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
    pub(crate) after: AfterWords<'a>,
    /// Cross-sections that were read for another case.
    pub(crate) known: &'a KnownPair,
}

/// Faults of the parts of a case that can be checked although others are faulty.
pub(crate) fn faults_of(given: PartialCase, limits: &Limits) -> Vec<Fault> {
    // Without a load, which is a fault already, no patch can be found; profiles are checked nevertheless.
    let without_load = matches!(
        given.contact,
        Some(Contact::PressureGrid { .. } | Contact::Profiles { .. } | Contact::Wheelset { .. })
    );
    let contact = given
        .contact
        .filter(|_| without_load || given.load.is_some());
    CheckedParts::check(PartialCase { contact, ..given }, limits).1
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
                pressed: motions.as_ref().is_some_and(ExpandedMotions::begin_pressed),
                fields: given.outputs.iter().any(|output| output.is_per_cell()),
                stress_points: given.after.stress_points(),
                ellipse: region.and_then(length_over_width),
                // Friction may not be known.
                by_table: region.and_then(length_over_width).is_some(),
                store: limits.operator_store_bytes,
            };
            faults.extend(size.faults(limits));
        }
        let of_friction = friction_fault(&given).or_else(|| {
            let patches = task.as_ref()?.0.known_patches().unwrap_or_default();
            falls_too_fast(
                given.friction?,
                given.after.thermal,
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
    let influence = match influence.unwrap_or_default() {
        InfluenceName::AngleCorrected => Influence::AngleCorrected,
        InfluenceName::HalfSpace => Influence::HalfSpace,
    };
    let surface = ReferenceSurface::Curve {
        influence,
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
    let mut faults = history::faults(history, &beside, limits);
    let of_force = |solver: &&Solver| solver.relative_to == Some(RelativeToName::Force);
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
    let unusual = length_units::unusual(contact);
    let task = match contact {
        Contact::Wheelset { .. } => {
            wheelsets::task(contact, given.load, given.motion, modulus, surface, limits)
        }
        _ => wheel_task::task(contact, given.load, modulus, surface, given.known),
    };
    let task = task.map_err(|faults| length_units::explained(faults, &unusual))?;
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
        // Temperatures need speeds whatever they are for, see `AfterWords::faults`.
        if what == "slip" {
            faults.extend(expanded.speed_fault(motion, "friction that falls with slip"));
        }
        faults.extend(expanded.force_fault(motion, what));
        faults.extend(pull_fault(motion, what));
    }
    faults.extend(given.after.faults(motion, expanded, limits));
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
