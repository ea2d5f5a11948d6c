//! The question as checked numbers: materials combined, region and pressure known, limits enforced.
//!
//! A [`Problem`] cannot exist unchecked: [`Problem::new`] is the only way to make one.

mod cost;
mod elasticity;
mod motions;

use std::collections::BTreeMap;
use std::time::Duration;

use serde::Serialize;

use crate::contact::case::{
    Case, Contact, Load, Material, MeshSize, Method, Motion, Motions, Output,
};
use crate::contact::error::{CaseError, Fault};
use crate::contact::normal::Region;

/// Allowed error of the resultants when nothing else is asked for, relative to μN.
pub(super) const TARGET_ERROR_DEFAULT: f64 = 0.005;
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
    /// The method asked for.
    pub method: Method,
    /// Target or mesh.
    pub resolution: Resolution,
    /// Time allowed for the whole case.
    pub time_limit: Option<Duration>,
    /// What to compute, sorted, without repetition.
    pub outputs: Vec<Output>,
    /// Remarks that go into the answer.
    pub warnings: Vec<String>,
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
        let mut warnings = Vec::new();
        let parts = Parts::new(
            Some(&case.material),
            Some(&case.contact),
            case.load.as_ref(),
            Some(&case.motion),
            limits,
        );
        let Parts {
            elasticity: Some(elasticity),
            region: Some((region, region_warnings)),
            motions: Some(motions),
            ..
        } = parts
        else {
            return Err(CaseError(parts.faults));
        };
        warnings.extend(elasticity.warning());
        if case.friction.coefficient > FRICTION_USUAL_MAX {
            warnings.push(format!(
                "the friction coefficient {} is more than {FRICTION_USUAL_MAX}",
                case.friction.coefficient
            ));
        }
        warnings.extend(region_warnings);
        let resolution = match (case.solver.mesh, case.solver.target_error) {
            (Some(size), _) => Resolution::Mesh(size),
            (None, target) => Resolution::Target(target.unwrap_or(TARGET_ERROR_DEFAULT)),
        };
        let digest = digest(case, &elasticity, &motions, resolution);
        let problem = Problem {
            name: case.name.clone(),
            labels: case.labels.clone(),
            elasticity,
            friction: case.friction.coefficient,
            region,
            motions,
            method: case.solver.method,
            resolution,
            time_limit: case.solver.time_limit_s.map(Duration::from_secs_f64),
            outputs: case.outputs.clone(),
            warnings,
            digest,
        };
        let faults = problem.too_large(limits);
        if faults.is_empty() {
            Ok(problem)
        } else {
            Err(CaseError(faults))
        }
    }

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }
}

/// The faults of those parts of a case that can be checked although others are faulty; `None` is not checked.
pub(super) fn faults_of_parts(
    material: Option<&Material>,
    contact: Option<&Contact>,
    load: Option<&Load>,
    motion: Option<&Motions>,
    limits: &Limits,
) -> Vec<Fault> {
    // Without its load a region cannot be told; its absence is a fault of its own.
    let needs_load = matches!(
        contact,
        Some(Contact::Radii { .. } | Contact::Ellipse { .. })
    );
    let contact = contact.filter(|_| !needs_load || load.is_some());
    Parts::new(material, contact, load, motion, limits).faults
}

/// The parts of a problem, checked as far as they are independent of each other.
struct Parts {
    elasticity: Option<Elasticity>,
    region: Option<(Region, Vec<String>)>,
    motions: Option<Vec<Motion>>,
    faults: Vec<Fault>,
}

impl Parts {
    fn new(
        material: Option<&Material>,
        contact: Option<&Contact>,
        load: Option<&Load>,
        motion: Option<&Motions>,
        limits: &Limits,
    ) -> Parts {
        let mut faults = Vec::new();
        let elasticity = material.and_then(|material| match Elasticity::combine(material) {
            Ok(elasticity) => Some(elasticity),
            Err(fault) => {
                faults.push(fault);
                None
            }
        });
        let region = match (contact, load, &elasticity) {
            (
                Some(Contact::PressureGrid {
                    x_mm,
                    y_mm,
                    pressure_mpa,
                }),
                _,
                _,
            ) => Some(Region::prescribed(
                x_mm,
                y_mm,
                pressure_mpa,
                limits.samples_max,
            )),
            (Some(contact), Some(load), Some(elasticity)) => {
                let modulus = elasticity.contact_modulus();
                Some(Region::hertz(contact, load, modulus).map(|region| (region, Vec::new())))
            }
            (Some(_), None, _) => Some(Err(Fault {
                pointer: "/load".to_owned(),
                detail: "missing; exactly one of normal_force_n, approach_mm is needed".to_owned(),
            })),
            _ => None,
        };
        let region = region.and_then(|region| region.map_err(|fault| faults.push(fault)).ok());
        let motions = motion.and_then(|motion| match motions::expand(motion, limits) {
            Ok(list) => Some(list),
            Err(fault) => {
                faults.push(fault);
                None
            }
        });
        Parts {
            elasticity,
            region,
            motions,
            faults,
        }
    }
}

/// Everything that determines the answer, in a fixed order; name and labels do not.
#[derive(Serialize)]
struct Canonical<'a> {
    solver_version: &'static str,
    elasticity: [f64; 3],
    friction: f64,
    contact: &'a Contact,
    load: Option<&'a Load>,
    motions: &'a [Motion],
    method: Method,
    target_error: Option<f64>,
    mesh: Option<MeshSize>,
    time_limit_s: Option<f64>,
    outputs: &'a [Output],
}

/// Hexadecimal BLAKE3 digest of the canonical case.
fn digest(
    case: &Case,
    elasticity: &Elasticity,
    motions: &[Motion],
    resolution: Resolution,
) -> String {
    let canonical = Canonical {
        solver_version: env!("CARGO_PKG_VERSION"),
        elasticity: [
            elasticity.shear_modulus,
            elasticity.poisson_ratio,
            elasticity.difference,
        ],
        friction: case.friction.coefficient,
        contact: &case.contact,
        load: case.load.as_ref(),
        motions,
        method: case.solver.method,
        target_error: match resolution {
            Resolution::Target(target) => Some(target),
            Resolution::Mesh(_) => None,
        },
        mesh: case.solver.mesh,
        time_limit_s: case.solver.time_limit_s,
        outputs: &case.outputs,
    };
    let mut hasher = blake3::Hasher::new();
    // Writing into a hasher cannot fail, and the structure has no map with keys that are not texts.
    let written = serde_json::to_writer(&mut hasher, &canonical);
    debug_assert!(written.is_ok());
    hasher.finalize().to_hex().to_string()
}
