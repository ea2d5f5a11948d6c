//! Remarks on contacts outside the range for which the theory is intended, for all types of contact; nothing is refused here.

use crate::contact::case::words::contact::Contact;
use crate::contact::normal::hertz::Patch;
use crate::contact::remark::entry::RemarkEntry;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::task::Motion;

/// Beyond this pressure, in MPa, wheel and rail steels yield whatever their hardness (about 3 times a yield stress of 1.6 GPa).
const PRESSURE_USUAL_MAX: f64 = 5000.0;
/// Largest pressure in MPa to which rail steel shakes down in pure rolling: 4.7 times the shear yield stress (Johnson, Contact Mechanics, 1985,
/// section 9.2), 550 MPa over √3 for R260 (EN 13674-1).
const SHAKEDOWN_LIMIT: f64 = 1500.0;
/// Load in N above which a mistake of unit is likely: about 60 times that of a heavy wheel.
const LOAD_USUAL_MAX: f64 = 1e7;
/// Creepage above which sliding is no longer small compared with the rolling speed.
const CREEPAGE_USUAL_MAX: f64 = 0.2;
/// Half width relative to the radius above which half-spaces are a poor approximation of the bodies.
const HALF_WIDTH_USUAL_MAX: f64 = 0.3;
/// Approach relative to the smaller half width above which strains are too large for linear elasticity.
const APPROACH_USUAL_MAX: f64 = 0.15;

/// The remarks on patches that are known from the case alone.
pub(crate) fn of_case(
    contact: &Contact,
    patches: &[Patch],
    motions: &[Motion],
) -> Vec<RemarkEntry> {
    let radii = match *contact {
        Contact::Radii {
            rolling_mm,
            lateral_mm,
        } => Some([rolling_mm, lateral_mm]),
        _ => None,
    };
    let alone = patches.len() == 1;
    let of_patches = patches.iter().enumerate().flat_map(|(k, patch)| {
        let size = [1, 3].map(|end| 0.5 * (patch.extent[end] - patch.extent[end - 1]));
        let large = radii.map(|radii| large(size, radii));
        let strained = patch.approach.and_then(|depth| strained(depth, size));
        let all = large.into_iter().flatten().chain(strained);
        let all: Vec<Remark> = all.chain(pressure(patch.pressure_max)).collect();
        all.into_iter().map(move |remark| placed(remark, k, alone))
    });
    let load = load(patches.iter().map(|patch| patch.normal_force).sum());
    let length = patches.first().filter(|_| alone).map(|patch| patch.area);
    let length = length.map(|area| (area / std::f64::consts::PI).sqrt());
    let of_motions = motions.iter().enumerate().filter_map(|(k, motion)| {
        let remark = creepage(motion, length)?;
        Some(RemarkEntry {
            point: Some(k),
            ..placed(remark, 0, true)
        })
    });
    let load = load.map(RemarkEntry::from);
    of_patches.chain(load).chain(of_motions).collect()
}

/// A remark on a patch; the only one needs no number.
fn placed(remark: Remark, patch: usize, alone: bool) -> RemarkEntry {
    if alone {
        remark.into()
    } else {
        remark.at_patch(patch)
    }
}

fn large(half_widths: [f64; 2], radii: [f64; 2]) -> Vec<Remark> {
    let directions = ["rolling", "lateral"].into_iter();
    let all = directions.zip(half_widths).zip(radii);
    all.filter(|((_, half), radius)| *half > HALF_WIDTH_USUAL_MAX * radius)
        .map(
            |((direction, half_width_mm), radius_mm)| Remark::PatchLarge {
                direction,
                half_width_mm,
                radius_mm,
            },
        )
        .collect()
}

fn strained(overlap_mm: f64, half_widths: [f64; 2]) -> Option<Remark> {
    let half_width_mm = half_widths[0].min(half_widths[1]);
    (overlap_mm > APPROACH_USUAL_MAX * half_width_mm).then_some(Remark::StrainsTooLarge {
        overlap_mm,
        half_width_mm,
    })
}

/// The remark on a largest pressure in MPa, if it is unusual.
pub(crate) fn pressure(pressure_max_mpa: f64) -> Option<Remark> {
    if pressure_max_mpa > PRESSURE_USUAL_MAX {
        return Some(Remark::PressureImplausible {
            pressure_max_mpa,
            usual_max_mpa: PRESSURE_USUAL_MAX,
        });
    }
    (pressure_max_mpa > SHAKEDOWN_LIMIT).then_some(Remark::PressureAboveShakedown {
        pressure_max_mpa,
        shakedown_limit_mpa: SHAKEDOWN_LIMIT,
    })
}

/// The remark on the normal force of all patches in N, if it is unusual.
pub(crate) fn load(normal_force_n: f64) -> Option<Remark> {
    (normal_force_n > LOAD_USUAL_MAX).then_some(Remark::LoadImplausible {
        normal_force_n,
        usual_max_n: LOAD_USUAL_MAX,
    })
}

/// The remark on an unusual motion; `length` is √(area/π) of the patch in mm, if it is known.
pub(crate) fn creepage(motion: &Motion, length: Option<f64>) -> Option<Remark> {
    let Motion {
        creepage_x,
        creepage_y,
        spin_per_mm,
    } = *motion;
    let spin_times_length = length.map(|length| spin_per_mm * length);
    let sizes = [creepage_x, creepage_y, spin_times_length.unwrap_or(0.0)];
    let largest = sizes
        .iter()
        .fold(0.0_f64, |most, size| most.max(size.abs()));
    (largest > CREEPAGE_USUAL_MAX).then_some(Remark::CreepageLarge {
        creepage_x,
        creepage_y,
        spin_times_length,
        usual_max: CREEPAGE_USUAL_MAX,
    })
}
