//! From the cross-sections of a case to a wheel placed over its rail, with the faults of both.

use std::sync::Arc;

use crate::case::contact_task;
use crate::case::rail_pair::{KnownPair, Placed};
use crate::case::words::contact::{Load, OnRails};
use crate::case::words::cross_section::{CrossSection, Smoothing, SmoothingWord};
use crate::case::words::motion::{Motions, Wheelset};
use crate::error::Fault;
use crate::geometry::contact_locus::ContactLocus;
use crate::geometry::formats;
use crate::geometry::formats::{Format, ProfileFile};
use crate::geometry::orientation::{FormatSenses, Senses, StatedSenses};
use crate::geometry::profile::{Body, LengthUnit, Profile, Reading};
use crate::geometry::wheel_rail::{NotPlaced, Placement, WheelRail};
use crate::geometry::wheelset_pose::WheelsetMotion;
use crate::normal::footprint::NormalTask;
use crate::normal::wheel::{ReferenceSurface, WheelLoad, WheelTask, WheelsetMove};
use crate::problem::checked_case;
use crate::remark::entry::RemarkEntry;
use crate::remark::list::Remark;
use crate::rolling::task::PrescribedForces;

/// Returns the normal problem of a wheel on a rail with its remarks; `None` without faults if the load or the contact modulus in MPa is
/// unknown.
///
/// # Errors
/// All faults of the two cross-sections, or the reason why they cannot meet.
pub(crate) fn task(
    rails: &OnRails,
    load: Option<&Load>,
    contact_modulus: Option<f64>,
    surface: ReferenceSurface,
    known: &KnownPair,
) -> Result<Option<(NormalTask, Vec<RemarkEntry>)>, Vec<Fault>> {
    let (geometry, remarks) = placed(rails, known)?;
    let loading = load.and_then(loading);
    let (Some(loading), Some(contact_modulus)) = (loading, contact_modulus) else {
        return Ok(None);
    };
    let wheel = WheelTask {
        geometry,
        loading,
        contact_modulus,
        trust: rails.trust(),
        surface,
    };
    Ok(Some((NormalTask::Wheel(Arc::new(wheel)), remarks)))
}

/// Places a wheel over its rail and returns it with its remarks. Profiles in `known` are not read again.
///
/// # Errors
/// All faults of the two cross-sections, or the reason why they cannot be placed or meet.
pub(crate) fn placed(
    words: &OnRails,
    known: &KnownPair,
) -> Result<(WheelRail, Vec<RemarkEntry>), Vec<Fault>> {
    let (geometry, of_wheel) = known.placed(words, || place(words))?;
    if let Err(detail) = ContactLocus::new(&geometry) {
        let faults = vec![Fault::new("/contact", detail)];
        return Err(with_reasons(faults, &reasons(geometry.profiles())));
    }
    let mut remarks = remarks_of(&geometry, words.pointers);
    let of_wheel = of_wheel.into_iter();
    remarks.extend(of_wheel.map(|remark| remark.at_pointer(words.pointers[1])));
    Ok((geometry, remarks))
}

/// Returns the motions of a wheelset, each with the torque that the rails balance; none if the case gives creepages.
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

/// Returns the motion of a wheelset. Its angular and its lateral velocity are NaN if they must be found.
fn wheelset_motion(words: &Wheelset) -> WheelsetMotion {
    let speed = words.speed_mm_per_s;
    let free = words.free_rolling_radius_mm.map(|radius| speed / radius);
    WheelsetMotion {
        speed,
        angular_velocity: words
            .angular_velocity_rad_per_s
            .or(free)
            .unwrap_or(f64::NAN),
        lateral_velocity: words.lateral_velocity_mm_per_s.unwrap_or(f64::NAN),
        yaw_rate: words.yaw_rate_rad_per_s,
        roll_rate: words.roll_rate_rad_per_s,
    }
}

/// Returns the longitudinal and the lateral force in N that the rail carries under the wheel of a wheelset.
pub(crate) fn wheelset_forces(motions: &Motions) -> PrescribedForces {
    match motions {
        Motions::Wheelset { wheelset } => [wheelset.force_x_n, wheelset.force_y_n],
        _ => [None; 2],
    }
}

fn loading(load: &Load) -> Option<WheelLoad> {
    let vertical = load.vertical_force_n.map(WheelLoad::Vertical);
    let normal = load.normal_force_n.map(WheelLoad::Normal);
    let lowering = load.approach_mm.map(WheelLoad::Lowering);
    vertical.or(normal).or(lowering)
}

/// Returns possible reasons why a pair of profiles does not fit, each after a semicolon: the size of a profile in another unit, and a stated
/// direction of an axis that contradicts its shape.
fn reasons(profiles: [&Profile; 2]) -> String {
    let mut reasons = String::new();
    let mut stated = Vec::new();
    for remark in profiles.into_iter().flat_map(|profile| &profile.remarks) {
        match remark {
            Remark::ProfileSizeUnusual { .. } => {
                reasons.push_str("; ");
                reasons.push_str(&remark.detail());
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

/// Appends the [`reasons`] to faults of a pair of profiles.
fn with_reasons(mut faults: Vec<Fault>, reasons: &str) -> Vec<Fault> {
    for fault in &mut faults {
        fault.detail.push_str(reasons);
    }
    faults
}

/// Reads both profiles and places the wheel over the rail. Returns it with remarks on the position of the wheel's points.
fn place(words: &OnRails) -> Result<Placed, Vec<Fault>> {
    let [rail, wheel] = read_both(words)?;
    let reasons = reasons([&rail, &wheel]);
    let explained = |faults| with_reasons(faults, &reasons);
    if !words.accept_rough {
        exchanged([&rail, &wheel], words.pointers).map_err(explained)?;
    }
    let distance = words.placement.flange_back_distance;
    let (flange_back_position, flange_back) =
        contact_task::position(&wheel, words.flange_back, distance)
            .map_err(|fault| explained(vec![fault]))?;
    let height = contact_task::unusual_height(&wheel, flange_back_position);
    let placement = Placement {
        flange_back_position,
        ..words.placement
    };
    let geometry = WheelRail::new(rail, wheel, placement).map_err(|reason| {
        let pointer = match reason {
            NotPlaced::NoGaugeFace { .. } => words.pointers[0],
            NotPlaced::ReachesAxle { .. } => words.radius_pointer,
        };
        explained(vec![Fault::new(pointer, reason.to_string())])
    })?;
    Ok((geometry, flange_back.into_iter().chain(height).collect()))
}

/// Reads both profiles. If only one can be read and it looks like the other body, the faults include that.
fn read_both(words: &OnRails) -> Result<[Profile; 2], Vec<Fault>> {
    let [rail, wheel] = words.pointers;
    let read = (
        profile_at(rail, Body::Rail, words.sections[0]),
        profile_at(wheel, Body::Wheel, words.sections[1]),
    );
    let other_body = |profile: &Profile, body: Body, pointer: &str| {
        let remark = checked_case::other_body(profile, body)?;
        Some(Fault::new(pointer, remark.detail()))
    };
    let faults = match read {
        (Ok(rail), Ok(wheel)) => return Ok([rail, wheel]),
        (Err(of_rail), Err(of_wheel)) => [Some(of_rail), Some(of_wheel)],
        (Ok(read), Err(of_wheel)) => [other_body(&read, Body::Rail, rail), Some(of_wheel)],
        (Err(of_rail), Ok(read)) => [Some(of_rail), other_body(&read, Body::Wheel, wheel)],
    };
    Err(faults.into_iter().flatten().collect())
}

/// Refuses two profiles that both look like the other body. One of them alone may be an unusual shape.
fn exchanged([rail, wheel]: [&Profile; 2], pointers: [&str; 2]) -> Result<(), Vec<Fault>> {
    let both = checked_case::other_body(rail, Body::Rail)
        .zip(checked_case::other_body(wheel, Body::Wheel));
    let Some((rail, wheel)) = both else {
        return Ok(());
    };
    let refused = |(remark, pointer): (Remark, &str)| {
        let detail = remark.detail();
        let detail = format!("{detail}; to solve it anyway, give accept_rough_profiles: true");
        Fault::new(pointer, detail)
    };
    Err([rail, wheel]
        .into_iter()
        .zip(pointers)
        .map(refused)
        .collect())
}

/// Returns the remarks on two profiles at their pointers.
fn remarks_of(geometry: &WheelRail, pointers: [&str; 2]) -> Vec<RemarkEntry> {
    let bodies = [Body::Rail, Body::Wheel];
    let profiles = geometry.profiles().into_iter().zip(bodies).zip(pointers);
    let remarks = profiles.flat_map(|((profile, body), pointer)| {
        let own = profile.remarks.iter().cloned();
        let all = own.chain(checked_case::other_body(profile, body));
        all.map(move |remark| remark.at_pointer(pointer))
    });
    remarks.collect()
}

/// Reads a cross-section as the profile of a body. Faults have pointers below `pointer`.
///
/// # Errors
/// The reason why it is no such profile.
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

/// Reads a cross-section without its guard rail.
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

/// Returns the directions of y and z that the format of a file specifies.
fn senses_of(body: Body, format: Format, contents: &ProfileFile) -> FormatSenses {
    // MiniProf instruments differ in the direction of a wheel's X.
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
