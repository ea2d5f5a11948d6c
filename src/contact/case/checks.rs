//! The checks of a case: every part by itself, all faults at once.

use crate::contact::case::cost::SizeInput;
use crate::contact::case::limits::Limits;
use crate::contact::case::motions::ExpandedMotions;
use crate::contact::case::resolution::resolution;
use crate::contact::case::words::{Contact, Load, Material, Motions, Output, Solver};
use crate::contact::case::{cost, motions, profiles};
use crate::contact::error::Fault;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::normal::region::Region;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;

/// A larger friction coefficient is solved, with a remark.
const FRICTION_USUAL_MAX: f64 = 1.0;

/// Those parts of a case that could be read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PartialCase<'a> {
    pub(crate) material: Option<&'a Material>,
    pub(crate) friction: Option<f64>,
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) load: Option<&'a Load>,
    pub(crate) motion: Option<&'a Motions>,
    pub(crate) solver: Option<&'a Solver>,
    pub(crate) outputs: &'a [Output],
}

/// Faults of the parts of a case that can be checked although others are faulty.
pub(crate) fn faults_of(given: PartialCase, limits: &Limits) -> Vec<Fault> {
    // Without its load a region cannot be told; that is a fault already. Profiles are looked at all the same.
    let without_load = matches!(
        given.contact,
        Some(Contact::PressureGrid { .. } | Contact::Profiles { .. })
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
    pub(crate) region: Option<(Region, Vec<RemarkEntry>)>,
    pub(crate) motions: Option<ExpandedMotions>,
}

impl CheckedParts {
    pub(crate) fn check(given: PartialCase, limits: &Limits) -> (CheckedParts, Vec<Fault>) {
        let mut faults = Vec::new();
        let elasticity = given.material.map(Elasticity::combine);
        let elasticity = elasticity.and_then(|elasticity| collect_fault(elasticity, &mut faults));
        let region = region(given.contact, given.load, elasticity.as_ref(), limits);
        let region = match (region, given.contact) {
            (None, Some(contact @ Contact::Profiles { .. })) => {
                let modulus = elasticity.map(|elasticity| elasticity.contact_modulus());
                profiles::region(contact, given.load, modulus).unwrap_or_else(|found| {
                    faults.extend(found);
                    None
                })
            }
            (region, _) => region.and_then(|region| collect_fault(region, &mut faults)),
        };
        let motions = given.motion.map(|motion| motions::expand(motion, limits));
        let motions = motions.and_then(|motions| collect_fault(motions, &mut faults));
        if let (Some(expanded), Some(motion)) = (&motions, given.motion) {
            let of_profiles = matches!(given.contact, Some(Contact::Profiles { .. }));
            let force = normal_force(region.as_ref().map(|(region, _)| region), given.load);
            let limit = given.friction.zip(force).map(|(mu, force)| mu * force);
            faults.extend(expanded.faults(motion, limit, of_profiles));
        }
        if let Some(solver) = given.solver {
            let size = SizeInput {
                method: solver.method.into(),
                resolution: resolution(solver),
                // What is not known counts as the least it can be.
                segments: region
                    .as_ref()
                    .map_or_else(|| vec![1.0], |(region, _)| cost::segments(region)),
                motions: motions.as_ref().map_or(1, |m| m.motions.len()),
                fields: given
                    .outputs
                    .iter()
                    .any(|output| *output != Output::Resultants),
                ellipse: region
                    .as_ref()
                    .and_then(|(region, _)| cost::length_over_width(region)),
            };
            faults.extend(size.faults(limits));
        }
        let parts = CheckedParts {
            elasticity,
            region,
            motions,
        };
        (parts, faults)
    }
}

pub(crate) fn unusual_friction(coefficient: f64) -> Option<RemarkEntry> {
    let remark = Remark::FrictionUnusual {
        coefficient,
        usual_max: FRICTION_USUAL_MAX,
    };
    (coefficient > FRICTION_USUAL_MAX).then(|| remark.at_pointer("/friction/coefficient"))
}

fn collect_fault<T>(result: Result<T, Fault>, faults: &mut Vec<Fault>) -> Option<T> {
    result.map_err(|fault| faults.push(fault)).ok()
}

/// The region and its remarks, if all that it depends on is known; profiles are left to [`profiles::region`].
pub(crate) fn region(
    contact: Option<&Contact>,
    load: Option<&Load>,
    elasticity: Option<&Elasticity>,
    limits: &Limits,
) -> Option<Result<(Region, Vec<RemarkEntry>), Fault>> {
    let contact = contact.filter(|contact| !matches!(contact, Contact::Profiles { .. }))?;
    if let Contact::PressureGrid {
        x_mm,
        y_mm,
        pressure_mpa,
    } = contact
    {
        return Some(Region::prescribed(
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
        let region = Region::gap(contact, load, modulus, limits.samples_max);
        return Some(region.map(|region| (region, Vec::new())));
    }
    let region = Region::hertz(contact, load, modulus);
    Some(region.map(|region| (region, Vec::new())))
}

/// The normal force of all patches in N, where it is known before the patches are.
fn normal_force(region: Option<&Region>, load: Option<&Load>) -> Option<f64> {
    let given = load.and_then(|load| load.normal_force_n);
    let patches = region.map(Region::patches).unwrap_or_default();
    let sum = || patches.iter().map(|patch| patch.normal_force).sum();
    given.or_else(|| (!patches.is_empty()).then(sum))
}

pub(crate) fn missing_load() -> Fault {
    Fault {
        pointer: "/load".to_owned(),
        detail: "missing; exactly one of normal_force_n, approach_mm is needed".to_owned(),
    }
}
