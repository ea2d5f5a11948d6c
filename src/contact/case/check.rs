//! The last step of a check: a case without faults becomes a [`CheckedCase`]. Cross-sections are also checked alone.

use std::time::Duration;

use serde_json::Value;

use crate::case::checks::{CheckedParts, unusual_friction};
use crate::case::digest::digest;
use crate::case::draft::draft;
use crate::case::motions::ExpandedMotions;
use crate::case::rail_pair::KnownPair;
use crate::case::solver::{Limits, resolution};
use crate::case::wheel_task::profile_at;
use crate::case::words::cross_section::CrossSection;
use crate::case::words::material::Material;
use crate::case::words::object::{Faults, Object};
use crate::case::words::solver::Case;
use crate::case::{units, wheel_task};
use crate::error::{CaseError, Fault};
use crate::friction::law::FrictionLaw;
use crate::geometry::orientation::SureBody;
use crate::geometry::profile::Body;
use crate::geometry::profile_quality::advised_smoothing;
use crate::half_space::unlike_bodies::Elasticity;
use crate::normal::footprint::NormalTask;
use crate::problem::checked_case::{self, CheckedCase, Label, PRESSURE_USUAL};
use crate::problem::physics::{AfterTasks, MotionPart, Problem, Run};
use crate::remark::entry::{RemarkEntry, merged};
use crate::remark::list::Remark;
use crate::solution::words::answer::Asked;
use crate::solution::words::damage::{PairQuality, SectionQuality};

impl CheckedCase {
    /// Reads a case, checks its members against physics and limits and prepares its numbers. Profiles in `known` are not read again.
    ///
    /// # Errors
    /// All faults of the text and of the checks, each with its JSON pointer.
    pub(crate) fn new(
        given: &Value,
        limits: &Limits,
        known: &KnownPair,
    ) -> Result<CheckedCase, CaseError> {
        let (draft, mut faults) = draft(given);
        let (parts, found) = CheckedParts::check(&draft, known, limits);
        faults.extend(found);
        if faults.is_empty() && parts.task.is_none() {
            let detail = "missing; exactly one of normal_force_n, approach_mm is needed";
            faults.push(Fault::new("/load", detail));
        }
        let (true, Some(case), Some(elasticity), Some((task, remarks)), Some(motions)) = (
            faults.is_empty(),
            draft.complete(),
            parts.elasticity,
            parts.task,
            parts.motions,
        ) else {
            return Err(CaseError(faults));
        };
        let of_material = elasticity.remark(case.solver.method.into());
        let of_material = of_material.map(|r| r.at_pointer("/material"));
        let of_case = of_material
            .into_iter()
            .chain(unusual_friction(&case.friction));
        let ExpandedMotions {
            motions,
            forces,
            speeds,
            history,
        } = motions;
        let patches = task.known_patches().unwrap_or_default();
        let first_move = wheel_task::moves(&case.motion).into_iter().next();
        // Creepages that the solver must find are assessed in the answer.
        let known_motions = match forces.iter().all(|forces| *forces == [None; 2]) {
            true => &motions[..],
            false => &[],
        };
        let remarks = merged(
            of_case
                .chain(remarks)
                .chain(checked_case::of_case(
                    &case.contact,
                    &patches,
                    known_motions,
                ))
                .chain(units::remarks(&case, given, &patches)),
        );
        let digest = digest(&case, &elasticity, &motions, &forces, &speeds);
        let problem = Problem {
            elasticity,
            friction: FrictionLaw::new(&case.friction, case.thermal.as_ref()),
            interface: (&case.friction).into(),
            task,
            part: MotionPart {
                before: 0,
                all: motions.len(),
            },
            motions,
            forces,
            speeds,
            history,
            wheelset: first_move.map(|first| first.motion),
            drive_torque: first_move.and_then(|first| first.drive_torque),
            wheelset_forces: wheel_task::wheelset_forces(&case.motion),
        };
        let run = run(&case, limits);
        let first_order = problem.first_order(&run).map(|r| r.at_pointer("/material"));
        let remarks = merged(remarks.into_iter().chain(first_order));
        Ok(CheckedCase {
            problem,
            run,
            label: Label {
                name: case.name,
                labels: case.labels,
                digest,
                asked: Asked {
                    contact: case.contact.name().to_owned(),
                    friction_coefficient: case.friction.largest(),
                    friction_varies: case.friction.coefficient.is_none(),
                    load: case.load,
                },
            },
            remarks,
        })
    }
}

/// Returns how a case is solved.
fn run(case: &Case, limits: &Limits) -> Run {
    Run {
        method: case.solver.method.into(),
        method_asked: case.solver.method,
        traction_bound: case.solver.traction_bound.unwrap_or_default(),
        resolution: resolution(&case.solver),
        relative_to: case.solver.relative_to.unwrap_or_default(),
        time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
        memory_bytes: limits.memory_bytes,
        operator_store_bytes: limits.operator_store_bytes,
        steps_max: limits.motions_max,
        outputs: case.outputs.clone(),
        after: AfterTasks::new(case),
    }
}

/// The result of checking a cross-section alone.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionReport {
    /// `rail` or `wheel`: the body that the file states or that the points show.
    pub body: &'static str,
    /// Quality of its points, with the smoothing that suits two steel bodies with such points.
    pub quality: SectionQuality,
    /// Remarks on reading its points or its file.
    pub remarks: Vec<RemarkEntry>,
}

/// Reads and checks a cross-section in the form of `rail` or `wheel` of a case.
///
/// # Errors
/// All faults, with pointers into the cross-section.
pub fn check_section(value: &Value) -> Result<SectionReport, CaseError> {
    let mut faults = Faults::default();
    let read = Object::open(value, String::new(), &mut faults)
        .and_then(|mut block| CrossSection::members(&mut block));
    let listed = faults.into_list();
    let Some(section) = read.filter(|_| listed.is_empty()) else {
        return Err(CaseError(listed));
    };
    let read = [Body::Rail, Body::Wheel].map(|body| (body, profile_at("", body, &section)));
    // In another unit the shape may look like the other body, so the sizes of both are assessed.
    let is_size = |remark: &&Remark| matches!(remark, Remark::ProfileSizeUnusual { .. });
    let profiles = read.iter().filter_map(|(_, profile)| profile.as_ref().ok());
    let sizes = profiles.flat_map(|profile| profile.remarks.iter().filter(is_size));
    let sizes: Vec<Remark> = sizes.cloned().collect();
    let (body, profile) = match read {
        [(_, Ok(rail)), (_, Ok(wheel))] => match rail.sure_body() {
            Some(SureBody::Wheel) => (Body::Wheel, wheel),
            _ => (Body::Rail, rail),
        },
        [(body, Ok(only)), _] | [_, (body, Ok(only))] => (body, only),
        [(_, Err(fault)), (_, Err(_))] => return Err(fault.into()),
    };
    let noise_level = checked_case::noise_level(&profile);
    let steel = Elasticity::combine(&Material::steel()).contact_modulus();
    let advised = advised_smoothing([noise_level; 2], steel, PRESSURE_USUAL);
    Ok(SectionReport {
        body: body.name(),
        quality: checked_case::section(&profile, advised[0]),
        remarks: profile
            .remarks
            .iter()
            .filter(|remark| !is_size(remark))
            .chain(&sizes)
            .map(|remark| remark.clone().at_pointer(""))
            .collect(),
    })
}

impl CheckedCase {
    /// Returns the quality of the profiles as far as it is known before the contact; only for a wheel on a rail.
    pub fn quality(&self) -> Option<PairQuality> {
        let NormalTask::Wheel(contact) = &self.problem.task else {
            return None;
        };
        Some(checked_case::quality(
            &contact.geometry,
            contact.contact_modulus,
        ))
    }
}
