//! The question as checked numbers: materials combined, region and pressure known, limits enforced.
//!
//! A [`Problem`] cannot exist unchecked: [`Problem::new`] is the only way to make one.

use crate::contact::case::cost;
use crate::contact::case::motions;
use crate::contact::case::plausibility;
use crate::contact::case::profiles;
use std::collections::BTreeMap;
use std::ops::Range;
use std::time::Duration;

use crate::contact::case::cost::Size;
use crate::contact::case::motions::Prescribed;
use crate::contact::case::words::{
    Case, Contact, Load, Material, MeshSize, Method, Motion, Motions, Output, Solver, TractionBound,
};
use crate::contact::error::{CaseError, Fault};
use crate::contact::geometry::wheelset::WheelsetMotion;
use crate::contact::normal::region::Region;
use crate::contact::remark::entry::{RemarkEntry, merged};
use crate::contact::remark::list::Remark;
use crate::contact::rolling::methods::fastsim;
use crate::contact::solution::words::NormalReport;

use crate::contact::case::digest::digest;
use crate::contact::case::motions::Expanded;

/// Allowed error of the resultants when nothing else is asked for, relative to μN.
pub(crate) const TARGET_ERROR_DEFAULT: f64 = 0.005;
/// A larger friction coefficient is solved, with a remark.
const FRICTION_USUAL_MAX: f64 = 1.0;

/// What one solve may use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Estimated memory of one case in bytes.
    pub memory_bytes: u64,
    /// Motions in one case.
    pub motions_max: usize,
    /// Samples of a grid (one axis times the other).
    pub samples_max: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            memory_bytes: 2 << 30,
            motions_max: 10_000,
            samples_max: 1_000_000,
        }
    }
}

/// Elastic constants of the pair of bodies, combined as in quasi-identical contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// Combined shear modulus G in MPa.
    pub shear_modulus: f64,
    /// Combined Poisson's ratio, 0 to 0.5.
    pub poisson_ratio: f64,
    /// Difference parameter K (Kalker 1990, eq. 1.44); 0 for like bodies.
    pub difference: f64,
}

/// Mesh chosen by the solver for a target, or given by the client.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Allowed error of the resultants relative to μN.
    Target(f64),
    /// An explicit mesh.
    Mesh(MeshSize),
}

/// Which motions of a case a problem asks about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MotionPart {
    /// Motions of the case before the first of these.
    pub before: usize,
    /// Motions of the whole case.
    pub all: usize,
}

/// A checked case, ready to solve.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Free text of the client.
    pub name: Option<String>,
    /// Labels of the client.
    pub labels: BTreeMap<String, String>,
    /// Combined elastic constants.
    pub elasticity: Elasticity,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Contact region and pressure.
    pub region: Region,
    /// The motions, in the order of the case; never empty.
    pub motions: Vec<Motion>,
    /// Which motions of the case these are: all of them, unless this is a slice.
    pub part: MotionPart,
    /// The motion of the wheelset that stands in place of the one motion above, which is then 0: the creepages of the patches
    /// follow from it.
    pub wheelset: Option<WheelsetMotion>,
    /// Forces prescribed instead of creepages, motion by motion.
    pub forces: Vec<Prescribed>,
    /// The method asked for.
    pub method: Method,
    /// Where `fastsim` lets tractions slip.
    pub traction_bound: TractionBound,
    /// Target or mesh.
    pub resolution: Resolution,
    /// Time allowed for the whole case.
    pub time_limit: Option<Duration>,
    /// What to compute, sorted, without repetition.
    pub outputs: Vec<Output>,
    /// Remarks that go into the answer.
    pub remarks: Vec<RemarkEntry>,
    /// How region and pressure were found, where they were not known beforehand.
    pub normal: Option<NormalReport>,
    /// By how much, relatively, the load of region and pressure may differ from the one wanted.
    pub load_error: f64,
    /// Memory the solve may use, in bytes.
    pub memory_bytes: u64,
    /// Hexadecimal digest of everything that determines the answer, the solver version included.
    pub digest: String,
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}

impl Problem {
    /// Checks a case against the limits and prepares its numbers.
    ///
    /// # Errors
    /// Every fault found, each with its JSON pointer.
    pub fn new(case: &Case, limits: &Limits) -> Result<Problem, CaseError> {
        let given = Given {
            material: Some(&case.material),
            friction: Some(case.friction.coefficient),
            contact: Some(&case.contact),
            load: case.load.as_ref(),
            motion: Some(&case.motion),
            solver: Some(&case.solver),
            outputs: &case.outputs,
        };
        let (parts, mut faults) = Parts::check(given, limits);
        if faults.is_empty() && parts.region.is_none() {
            faults.push(missing_load());
        }
        let (true, Some(elasticity), Some((region, remarks)), Some(motions)) = (
            faults.is_empty(),
            parts.elasticity,
            parts.region,
            parts.motions,
        ) else {
            return Err(CaseError(faults));
        };
        let of_material = elasticity.remark().map(|r| r.at_pointer("/material"));
        let of_friction = unusual_friction(case.friction.coefficient);
        let of_case = of_material.into_iter().chain(of_friction);
        let Expanded { motions, forces } = motions;
        // Creepages that are searched are looked at when they are found.
        let given: &[Motion] = match forces.iter().all(|forces| *forces == [None; 2]) {
            true => &motions,
            false => &[],
        };
        let implausible = plausibility::of_case(&case.contact, &region.patches(), given);
        let remarks = merged(of_case.chain(remarks).chain(implausible));
        let digest = digest(case, &elasticity, &motions, &forces);
        Ok(Problem {
            name: case.name.clone(),
            labels: case.labels.clone(),
            elasticity,
            friction: case.friction.coefficient,
            region,
            part: MotionPart {
                before: 0,
                all: motions.len(),
            },
            motions,
            forces,
            wheelset: profiles::wheelset(&case.motion),
            method: case.solver.method,
            traction_bound: case.solver.traction_bound.unwrap_or_default(),
            resolution: resolution(&case.solver),
            time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
            outputs: case.outputs.clone(),
            remarks,
            normal: None,
            load_error: 0.0,
            memory_bytes: limits.memory_bytes,
            digest,
        })
    }

    /// The same question about some of its motions.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> Problem {
        Problem {
            part: MotionPart {
                before: self.part.before + range.start,
                ..self.part
            },
            motions: self.motions[range.clone()].to_vec(),
            forces: self.forces[range].to_vec(),
            ..self.clone()
        }
    }

    /// Estimated time to find region and pressure, in s.
    #[must_use]
    pub fn normal_seconds(&self) -> f64 {
        cost::normal_seconds(&self.region)
    }

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}

/// Those parts of a case that could be read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Given<'a> {
    pub(crate) material: Option<&'a Material>,
    pub(crate) friction: Option<f64>,
    pub(crate) contact: Option<&'a Contact>,
    pub(crate) load: Option<&'a Load>,
    pub(crate) motion: Option<&'a Motions>,
    pub(crate) solver: Option<&'a Solver>,
    pub(crate) outputs: &'a [Output],
}

/// Faults of the parts of a case that can be checked although others are faulty.
pub(crate) fn faults_of(given: Given, limits: &Limits) -> Vec<Fault> {
    // Without its load a region cannot be told; that is a fault already. Profiles are looked at all the same.
    let without_load = matches!(
        given.contact,
        Some(Contact::PressureGrid { .. } | Contact::Profiles { .. })
    );
    let contact = given
        .contact
        .filter(|_| without_load || given.load.is_some());
    Parts::check(Given { contact, ..given }, limits).1
}

/// The parts of a problem, checked as far as they are independent of each other.
#[derive(Debug)]
struct Parts {
    elasticity: Option<Elasticity>,
    region: Option<(Region, Vec<RemarkEntry>)>,
    motions: Option<Expanded>,
}

impl Parts {
    fn check(given: Given, limits: &Limits) -> (Parts, Vec<Fault>) {
        let mut faults = Vec::new();
        let elasticity = given.material.map(Elasticity::combine);
        let elasticity = elasticity.and_then(|elasticity| keep(elasticity, &mut faults));
        let region = region(given.contact, given.load, elasticity.as_ref(), limits);
        let region = match (region, given.contact) {
            (None, Some(contact @ Contact::Profiles { .. })) => {
                let modulus = elasticity.map(|elasticity| elasticity.contact_modulus());
                profiles::region(contact, given.load, modulus).unwrap_or_else(|found| {
                    faults.extend(found);
                    None
                })
            }
            (region, _) => region.and_then(|region| keep(region, &mut faults)),
        };
        let motions = given.motion.map(|motion| motions::expand(motion, limits));
        let motions = motions.and_then(|motions| keep(motions, &mut faults));
        if let (Some(expanded), Some(motion)) = (&motions, given.motion) {
            let of_profiles = matches!(given.contact, Some(Contact::Profiles { .. }));
            let force = normal_force(region.as_ref().map(|(region, _)| region), given.load);
            let limit = given.friction.zip(force).map(|(mu, force)| mu * force);
            faults.extend(expanded.faults(motion, limit, of_profiles));
        }
        if let Some(solver) = given.solver {
            let size = Size {
                method: solver.method,
                resolution: resolution(solver),
                // What is not known counts as the least it can be.
                segments: region
                    .as_ref()
                    .map_or_else(|| vec![1.0], |(region, _)| cost::segments(region)),
                motions: motions.as_ref().map_or(1, |m| m.motions.len()),
                forces: motions.as_ref().map_or_else(Vec::new, |m| m.forces.clone()),
                fields: given
                    .outputs
                    .iter()
                    .any(|output| *output != Output::Resultants),
                ellipse: region
                    .as_ref()
                    .and_then(|(region, _)| cost::length_over_width(region)),
                normal_seconds: region
                    .as_ref()
                    .map_or(0.0, |(region, _)| cost::normal_seconds(region)),
            };
            faults.extend(size.faults(limits));
        }
        let parts = Parts {
            elasticity,
            region,
            motions,
        };
        (parts, faults)
    }
}

fn unusual_friction(coefficient: f64) -> Option<RemarkEntry> {
    let remark = Remark::FrictionUnusual {
        coefficient,
        usual_max: FRICTION_USUAL_MAX,
    };
    (coefficient > FRICTION_USUAL_MAX).then(|| remark.at_pointer("/friction/coefficient"))
}

fn keep<T>(result: Result<T, Fault>, faults: &mut Vec<Fault>) -> Option<T> {
    result.map_err(|fault| faults.push(fault)).ok()
}

/// The region and its remarks, if all that it depends on is known; profiles are left to [`profiles::region`].
fn region(
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

fn missing_load() -> Fault {
    Fault {
        pointer: "/load".to_owned(),
        detail: "missing; exactly one of normal_force_n, approach_mm is needed".to_owned(),
    }
}

pub(crate) fn resolution(solver: &Solver) -> Resolution {
    match (solver.mesh, solver.target_error) {
        (Some(size), _) => Resolution::Mesh(size),
        // As it would solve for any target.
        (None, None) if solver.method == Method::Fastsim => Resolution::Mesh(fastsim::MESH),
        (None, target) => Resolution::Target(target.unwrap_or(TARGET_ERROR_DEFAULT)),
    }
}
