//! The last step of a check: words without faults become a [`CheckedCase`].
//!
//! A cross-section by itself: is it sound, whose is it, and how good are its points?

use std::time::Duration;

use serde_json::Value;

use crate::case::checks::{CheckedParts, missing_load, unusual_friction};
use crate::case::digest::digest;
use crate::case::draft::CaseDraft;
use crate::case::motions::ExpandedMotions;
use crate::case::solver::{KnownPair, Limits, resolution};
use crate::case::wheel_task::profile;
use crate::case::words::cross_section::CrossSection;
use crate::case::words::object::{Faults, Object};
use crate::case::words::solver::Case;
use crate::case::{units, wheel_task};
use crate::error::{CaseError, Fault};
use crate::friction::law::FrictionLaw;
use crate::geometry::orientation::SureBody;
use crate::geometry::profile::Body;
use crate::geometry::profile_quality::advised_smoothing;
use crate::normal::footprint::NormalTask;
use crate::problem::checked_case;
use crate::problem::checked_case::{CheckedCase, Label};
use crate::problem::physics::{AfterTasks, Checked, MotionPart, Problem, Run};
use crate::remark::entry::{RemarkEntry, merged};
use crate::remark::list::Remark;
use crate::solution::words::answer::Asked;
use crate::solution::words::damage::{PairQuality, SectionQuality};

impl CheckedCase {
    /// Checks what was read of a case against physics and limits, and prepares its numbers; profiles that are known are not read again.
    ///
    /// # Errors
    /// The faults of the text, and every fault found, each with its JSON pointer.
    pub(crate) fn new(
        draft: CaseDraft,
        mut faults: Vec<Fault>,
        limits: &Limits,
        known: &KnownPair,
    ) -> Result<CheckedCase, CaseError> {
        let (parts, found) = CheckedParts::check(draft.given(known), limits);
        faults.extend(found);
        if faults.is_empty() && parts.task.is_none() {
            faults.push(missing_load());
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
        // Creepages that are searched are assessed once they are found.
        let given = match forces.iter().all(|forces| *forces == [None; 2]) {
            true => &motions[..],
            false => &[],
        };
        let remarks = merged(
            of_case
                .chain(remarks)
                .chain(checked_case::of_case(&case.contact, &patches, given))
                .chain(units::remarks(&case, &patches)),
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
            wheelset: wheel_task::wheelset(&case.motion),
            drive_torque: wheel_task::drive_torque(&case.motion),
            wheelset_forces: wheel_task::wheelset_forces(&case.motion),
            checked: Checked::without_faults(),
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

/// How a case is to be solved, by its words.
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

/// Contact modulus G/(1 − ν) of steel on steel in MPa, for the smoothing that is suggested.
const STEEL_MPA: f64 = 82_000.0 / (1.0 - 0.28);

/// What a cross-section was taken for.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionReport {
    /// `rail` or `wheel`: the body that the file states, or that the points show.
    pub body: &'static str,
    /// Its points, and the smoothing that suits them on steel beside another profile of this kind.
    pub quality: SectionQuality,
    /// How its points or its file were read.
    pub remarks: Vec<RemarkEntry>,
}

/// Reads and checks a cross-section as `rail` or `wheel` of a case has it.
///
/// # Errors
/// Every fault, with pointers into the cross-section.
pub fn check_section(value: &Value) -> Result<SectionReport, CaseError> {
    let mut faults = Faults::default();
    let read = Object::open(value, String::new(), &mut faults)
        .and_then(|mut block| CrossSection::members(&mut block));
    let listed = faults.into_list();
    let Some(section) = read.filter(|_| listed.is_empty()) else {
        return Err(CaseError(listed));
    };
    let read = [Body::Rail, Body::Wheel].map(|body| (body, profile(body, &section)));
    // A shape in another unit may show the other body, so that the sizes of both are judged.
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
        [(_, Err(fault)), (_, Err(_))] => {
            let own = fault.pointer.strip_prefix("/contact/rail");
            let pointer = own.unwrap_or_default().to_owned();
            return Err(CaseError(vec![Fault { pointer, ..fault }]));
        }
    };
    let noise_level = checked_case::noise_level(&profile);
    let advised = advised_smoothing([noise_level; 2], STEEL_MPA, checked_case::PRESSURE_USUAL);
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
    /// How far the points of the profiles can be trusted, as far as that is known without the contact; only of a wheel on a rail.
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
