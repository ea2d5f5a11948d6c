//! A cross-section by itself: is it sound, whose is it, and how good are its points?

use serde_json::Value;

use crate::contact::case::read::faults::Faults;
use crate::contact::case::read::object::Object;
use crate::contact::case::read::wheel_rail::section_of;
use crate::contact::case::wheel_task::profile;
use crate::contact::error::{CaseError, Fault};
use crate::contact::geometry::orientation::SureBody;
use crate::contact::geometry::profile::Body;
use crate::contact::geometry::profile_quality::points::advised_smoothing;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::profile_points;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::solution::words::profile_quality::{PairQuality, SectionQuality};

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
        .and_then(|mut block| section_of(&mut block));
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
    let grain = profile_points::grain(&profile);
    let advised = advised_smoothing([grain; 2], STEEL_MPA, profile_points::PRESSURE_USUAL);
    Ok(SectionReport {
        body: body.name(),
        quality: profile_points::section(&profile, advised[0]),
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
    #[must_use]
    pub fn quality(&self) -> Option<PairQuality> {
        let NormalTask::Wheel(contact) = &self.problem.task else {
            return None;
        };
        Some(profile_points::quality(
            &contact.geometry,
            contact.contact_modulus,
        ))
    }
}
