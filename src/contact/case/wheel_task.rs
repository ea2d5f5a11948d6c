//! From the cross-sections of a case to a wheel in place over its rail, with every fault of both.

use std::sync::Arc;

use crate::case::contact_task;
use crate::case::solver::{KnownPair, PairWords, Placed};
use crate::case::words::contact::{Contact, Load};
use crate::case::words::cross_section::{CrossSection, Smoothing, SmoothingWord};
use crate::case::words::motion::{Motions, Wheelset};
use crate::error::Fault;
use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::formats;
use crate::geometry::formats::{Format, ProfileFile};
use crate::geometry::orientation::{FormatSenses, Senses, StatedSenses};
use crate::geometry::profile::{Body, LengthUnit, Profile, Reading};
use crate::geometry::wheel_rail::{NotPlaced, Placement, RailPlace, WheelRail};
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::normal::footprint::NormalTask;
use crate::normal::wheel::{ProfileTrust, ReferenceSurface, WheelLoad, WheelTask, WheelsetMove};
use crate::problem::checked_case;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::task::PrescribedForces;

/// The task of a wheel on a rail, whose profiles may be known, with its remarks; `None` without faults where the load or the contact
/// modulus in MPa is not known.
///
/// # Errors
/// Every fault of the two cross-sections; or that they cannot meet.
pub(crate) fn task(
    contact: &Contact,
    load: Option<&Load>,
    contact_modulus: Option<f64>,
    surface: ReferenceSurface,
    known: &KnownPair,
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let Contact::Profiles {
        rail,
        wheel,
        side,
        rolling_radius_mm,
        gauge_mm,
        gauge_height_mm,
        rail_origin_mm,
        cant_rad,
        flange_back_distance_mm,
        flange_back_position_mm,
        lateral_shift_mm,
        yaw_rad,
        roll_rad,
        accept_rough_profiles,
        reference_surface: _,
        influence: _,
    } = contact
    else {
        return Err(vec![Fault::new(
            "/contact/type".to_owned(),
            "no profiles".to_owned(),
        )]);
    };
    let placement = Placement {
        side: *side,
        rolling_radius: *rolling_radius_mm,
        rail: RailPlace::of(*gauge_mm, *gauge_height_mm, *rail_origin_mm),
        cant: *cant_rad,
        flange_back_distance: *flange_back_distance_mm,
        flange_back_position: 0.0,
        lateral_shift: *lateral_shift_mm,
        yaw: *yaw_rad,
        roll: *roll_rad,
    };
    let words = PairWords {
        sections: [rail, wheel],
        flange_back: *flange_back_position_mm,
        accept_rough: *accept_rough_profiles,
    };
    let pointers = ["/contact/rail", "/contact/wheel"];
    let (geometry, flange_back) = known.placed(&words, &placement, || {
        let read = (profile(Body::Rail, rail), profile(Body::Wheel, wheel));
        let profiles = both(read, pointers)?;
        in_place(
            profiles,
            &words,
            placement,
            pointers,
            "/contact/rolling_radius_mm",
        )
    })?;
    meet(&geometry)?;
    let mut remarks = remarks_of(&geometry, pointers);
    remarks.extend(flange_back);
    let loading = load.and_then(loading);
    let (Some(loading), Some(contact_modulus)) = (loading, contact_modulus) else {
        return Ok(None);
    };
    let contact = WheelTask {
        geometry,
        loading,
        contact_modulus,
        trust: trust(&words),
        surface,
    };
    Ok(Some((NormalTask::Wheel(Arc::new(contact)), remarks)))
}

/// The motion of the wheelset, if the case gives it instead of creepages; its angular and its lateral velocity are NaN where they have to be
/// found.
pub(crate) fn wheelset(motions: &Motions) -> Option<WheelsetMotion> {
    moves(motions).first().map(|first| first.motion)
}

/// The motions of a wheelset, if the case gives them instead of creepages, each with the torque that the rails are to balance.
pub(crate) fn moves(motions: &Motions) -> Vec<WheelsetMove> {
    let words = match motions {
        Motions::Wheelset { wheelset } => std::slice::from_ref(wheelset),
        Motions::Wheelsets { wheelset } => wheelset,
        _ => &[],
    };
    let of_words = |words: &Wheelset| WheelsetMove {
        motion: wheelset_motion(words),
        drive_torque: words.drive_torque_n_mm,
    };
    words.iter().map(of_words).collect()
}

fn wheelset_motion(words: &Wheelset) -> WheelsetMotion {
    let Wheelset {
        speed_mm_per_s: speed,
        angular_velocity_rad_per_s,
        free_rolling_radius_mm,
        drive_torque_n_mm: _,
        force_x_n: _,
        lateral_velocity_mm_per_s,
        force_y_n: _,
        yaw_rate_rad_per_s,
        roll_rate_rad_per_s,
    } = *words;
    let free = free_rolling_radius_mm.map(|radius| speed / radius);
    WheelsetMotion {
        speed,
        angular_velocity: angular_velocity_rad_per_s.or(free).unwrap_or(f64::NAN),
        lateral_velocity: lateral_velocity_mm_per_s.unwrap_or(f64::NAN),
        yaw_rate: yaw_rate_rad_per_s,
        roll_rate: roll_rate_rad_per_s,
    }
}

/// The torque about the axle in N mm that the rails are to balance.
pub(crate) fn drive_torque(motions: &Motions) -> Option<f64> {
    moves(motions).first().and_then(|first| first.drive_torque)
}

/// The forces in N, along and across, that the rail is to carry under a wheelset's wheel.
pub(crate) fn wheelset_forces(motions: &Motions) -> PrescribedForces {
    match motions {
        Motions::Wheelset { wheelset } => [wheelset.force_x_n, wheelset.force_y_n],
        _ => [None; 2],
    }
}

fn loading(load: &Load) -> Option<WheelLoad> {
    match (load.vertical_force_n, load.normal_force_n, load.approach_mm) {
        (Some(force), _, _) => Some(WheelLoad::Vertical(force)),
        (None, Some(force), _) => Some(WheelLoad::Normal(force)),
        (None, None, Some(lowering)) => Some(WheelLoad::Lowering(lowering)),
        (None, None, None) => None,
    }
}

/// Why a pair of profiles may not fit, each reason after a semicolon: the size of a profile in another unit, a stated sense that contradicts its
/// shape. Empty for none.
fn reasons(profiles: [&Profile; 2]) -> String {
    let mut reasons = String::new();
    let mut stated = Vec::new();
    for remark in profiles.into_iter().flat_map(|profile| &profile.remarks) {
        match remark {
            Remark::ProfileSizeUnusual { .. } => {
                reasons.push_str("; ");
                reasons.push_str(&remark.clone().at_pointer("").detail);
            }
            Remark::ProfileSenseContradicted {
                profile,
                member,
                given,
            } => stated.push(format!("{member}: {given} of the {profile}")),
            _ => {}
        }
    }
    if !stated.is_empty() {
        let stated = stated.join(", ");
        reasons.push_str(&format!(
            "; {stated} contradicts the shape of the points, try the opposite or leave it out"
        ));
    }
    reasons
}

/// Faults of a pair of profiles, each with its [`reasons`].
fn with_reasons(mut faults: Vec<Fault>, reasons: &str) -> Vec<Fault> {
    for fault in &mut faults {
        fault.detail.push_str(reasons);
    }
    faults
}

/// A wheel over its rail, with the remark on the back of its flange, from whose position the placement follows; the pointers are those of rail and
/// wheel, and of the rolling radius.
pub(crate) fn in_place(
    [rail, wheel]: [Profile; 2],
    words: &PairWords,
    placement: Placement,
    pointers: [&str; 2],
    radius: &str,
) -> Result<Placed, Vec<Fault>> {
    let reasons = reasons([&rail, &wheel]);
    let explained = |faults| with_reasons(faults, &reasons);
    if !words.accept_rough {
        exchanged([&rail, &wheel], pointers).map_err(explained)?;
    }
    let (flange_back_position, remark) = contact_task::position(
        &wheel,
        pointers[1],
        words.flange_back,
        placement.flange_back_distance,
    )
    .map_err(|fault| explained(vec![fault]))?;
    let placement = Placement {
        flange_back_position,
        ..placement
    };
    let geometry = WheelRail::new(rail, wheel, placement)
        .map_err(|reason| explained(vec![unplaced(reason, [pointers[0], radius])]))?;
    Ok((geometry, remark))
}

/// The fault of a wheel that is not above its rail.
pub(crate) fn meet(geometry: &WheelRail) -> Result<(), Vec<Fault>> {
    let found = ContactLocus::new(geometry).map(|_| ());
    found.map_err(|detail| {
        let faults = vec![Fault::new("/contact", detail)];
        with_reasons(faults, &reasons(geometry.profiles()))
    })
}

/// Both profiles, or the faults of both. If one is not read, the other is named as well where it is that of the other body.
pub(crate) fn both(
    read: (Result<Profile, Fault>, Result<Profile, Fault>),
    pointers: [&str; 2],
) -> Result<[Profile; 2], Vec<Fault>> {
    let load_mismatch = |profile: &Profile, body: Body, pointer: &str| {
        let remark = checked_case::load_mismatch(profile, body)?;
        Some(Fault::new(pointer.to_owned(), remark.detail))
    };
    let faults = match read {
        (Ok(rail), Ok(wheel)) => return Ok([rail, wheel]),
        (Err(rail), Err(wheel)) => vec![rail, wheel],
        (Ok(rail), Err(own)) => {
            let other = load_mismatch(&rail, Body::Rail, pointers[0]);
            other.into_iter().chain([own]).collect()
        }
        (Err(own), Ok(wheel)) => {
            let other = load_mismatch(&wheel, Body::Wheel, pointers[1]);
            [own].into_iter().chain(other).collect()
        }
    };
    Err(faults)
}

/// The fault of a pair that cannot be placed, at the pointer of the rail or of the rolling radius.
fn unplaced(reason: NotPlaced, [rail, radius]: [&str; 2]) -> Fault {
    let pointer = match reason {
        NotPlaced::NoGaugeFace { .. } => rail,
        NotPlaced::ReachesAxle { .. } => radius,
    };
    Fault::new(pointer.to_owned(), reason.to_string())
}

/// Faults of two profiles that both look like the other body's, at the pointers of both; one of them alone may be an unusual shape.
fn exchanged([rail, wheel]: [&Profile; 2], pointers: [&str; 2]) -> Result<(), Vec<Fault>> {
    let both = checked_case::load_mismatch(rail, Body::Rail)
        .zip(checked_case::load_mismatch(wheel, Body::Wheel));
    let Some((rail, wheel)) = both else {
        return Ok(());
    };
    let refused = |remark: RemarkEntry| {
        format!(
            "{}; to solve it anyway, give accept_rough_profiles: true",
            remark.detail
        )
    };
    Err(vec![
        Fault::new(pointers[0].to_owned(), refused(rail)),
        Fault::new(pointers[1].to_owned(), refused(wheel)),
    ])
}

/// How far the points of a pair of cross-sections are trusted.
pub(crate) fn trust(words: &PairWords) -> ProfileTrust {
    let auto = |section: &CrossSection| matches!(section.smoothing_mm, Smoothing::ByNoise(_));
    ProfileTrust {
        auto: words.sections.map(auto),
        accept_rough: words.accept_rough,
    }
}

/// Remarks on two profiles, at their pointers.
pub(crate) fn remarks_of(geometry: &WheelRail, pointers: [&str; 2]) -> Vec<RemarkEntry> {
    let bodies = [Body::Rail, Body::Wheel];
    let profiles = geometry.profiles().into_iter().zip(bodies).zip(pointers);
    profiles
        .flat_map(|((profile, body), pointer)| {
            let own = profile.remarks.iter().cloned();
            let own = own.map(|remark| remark.at_pointer(pointer));
            let load_mismatch = checked_case::load_mismatch(profile, body);
            let load_mismatch = load_mismatch.map(|remark| RemarkEntry {
                pointer: Some(pointer.to_owned()),
                ..remark
            });
            own.chain(load_mismatch).collect::<Vec<_>>()
        })
        .collect()
}

/// The profile of a cross-section as that of a body.
///
/// # Errors
/// Why it is none.
pub(crate) fn profile(body: Body, section: &CrossSection) -> Result<Profile, Fault> {
    profile_at(&format!("/contact/{}", body.name()), body, section)
}

/// The same at a pointer.
///
/// # Errors
/// Why it is none.
pub(crate) fn profile_at(
    pointer: &str,
    body: Body,
    section: &CrossSection,
) -> Result<Profile, Fault> {
    let profile = own_profile(pointer, body, section)?;
    let Some(points) = &section.guard_rail_points_mm else {
        return Ok(profile);
    };
    let fault = |detail| Fault::new(format!("{pointer}/guard_rail_points_mm"), detail);
    if body == Body::Wheel {
        return Err(fault(
            "given for a wheel; only a rail has a guard rail beside it".to_owned(),
        ));
    }
    let unit_mm = section.unit.map_or(1.0, LengthUnit::mm);
    profile
        .with_guard_rail(&scaled(points, unit_mm))
        .map_err(fault)
}

/// Reads a section without its guard rail.
fn own_profile(pointer: &str, body: Body, section: &CrossSection) -> Result<Profile, Fault> {
    let name = body.name();
    let reading = Reading {
        mirror_y: section.mirror_y,
        mirror_z: section.mirror_z,
        smoothing: match section.smoothing_mm {
            Smoothing::Length(length) => length,
            Smoothing::ByNoise(SmoothingWord::Auto) => 0.0,
        },
    };
    let stated_mm = section.unit.map(LengthUnit::mm);
    let (Some(format), Some(text)) = (section.format, &section.text) else {
        let points = section.points_mm.as_deref().unwrap_or_default();
        let profile = match stated_mm {
            None | Some(1.0) => Profile::new(body, points, reading),
            Some(mm) => Profile::new(body, &scaled(points, mm), reading),
        };
        return profile.map_err(|detail| Fault::new(format!("{pointer}/points_mm"), detail));
    };
    let refuse = |detail| Fault::new(format!("{pointer}/text"), detail);
    let mut contents = formats::read(format, text).map_err(refuse)?;
    let is_wheel = body == Body::Wheel;
    if contents.wheel.is_some_and(|wheel| wheel != is_wheel) {
        let other = if is_wheel { "rail" } else { "wheel" };
        return Err(refuse(format!(
            "the file states that it is of a {other}; a file of a {name} is needed"
        )));
    }
    let senses = senses_of(body, format, &contents);
    let file_mm = contents.unit_mm.unwrap_or(1.0);
    if let Some(mm) = stated_mm.filter(|mm| *mm != file_mm) {
        contents.points = scaled(&contents.points, mm / file_mm);
    }
    let mut profile =
        Profile::in_format(body, &contents.points, reading, senses).map_err(refuse)?;
    let differs = stated_mm.zip(contents.unit_mm);
    if let Some((stated_mm, file_mm)) = differs.filter(|(stated, file)| stated != file) {
        profile.remarks.push(Remark::ProfileUnitDiffers {
            profile: name,
            stated_mm,
            file_mm,
        });
    }
    if let Some(stated) = contents.wrong_count {
        profile.remarks.push(Remark::ProfileCountDiffers {
            profile: name,
            stated,
            found: contents.points.len(),
        });
    }
    if let Some((count, line)) = contents.header_rows {
        profile.remarks.push(Remark::ProfileHeaderRows {
            profile: name,
            count,
            line,
        });
    }
    Ok(profile)
}

fn scaled(points: &[[f64; 2]], scale: f64) -> Vec<[f64; 2]> {
    let scaled = points.iter().map(|point| point.map(|part| part * scale));
    scaled.collect()
}

/// What the format of a file specifies about the senses of its points.
fn senses_of(body: Body, format: Format, contents: &ProfileFile) -> FormatSenses {
    // MiniProf instruments differ in the sense of a wheel's X.
    let varies = body == Body::Wheel && format == Format::Miniprof;
    FormatSenses {
        usual: Senses {
            mirror_y: contents.mirror_y.unwrap_or(false),
            mirror_z: contents.mirror_z.unwrap_or(false),
        },
        fixed: StatedSenses {
            mirror_y: contents.mirror_y.filter(|_| !varies),
            mirror_z: contents.mirror_z,
        },
    }
}
