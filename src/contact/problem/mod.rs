//! The question as checked numbers: materials combined, region and pressure known, limits enforced.
//!
//! A [`Problem`] cannot exist unchecked: [`Problem::new`] is the only way to make one.

use std::time::Duration;

use crate::contact::case::{Case, MeshSize, Method, Motion, Output};
use crate::contact::error::CaseError;

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
    pub labels: std::collections::BTreeMap<String, String>,
    /// Combined elastic constants.
    pub elasticity: Elasticity,
    /// Coulomb's friction coefficient μ.
    pub friction: f64,
    /// Contact region and pressure.
    pub region: crate::contact::normal::Region,
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
    pub fn new(_case: &Case, _limits: &Limits) -> Result<Problem, CaseError> {
        todo!("the checks")
    }

    /// Is this output asked for?
    #[must_use]
    pub fn wants(&self, output: Output) -> bool {
        self.outputs.contains(&output)
    }

    /// Estimated cost of solving this.
    #[must_use]
    pub fn cost(&self) -> Cost {
        todo!("the estimate")
    }
}
