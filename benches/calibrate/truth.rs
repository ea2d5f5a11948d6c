//! Converged resultants of cases, stored in a file, and the distance of other resultants from them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use railhead_contact::rolling::answer::Resultants;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The converged resultants of a case.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Truth {
    /// Fingerprint of the case.
    pub print: u64,
    /// The resultants. For several patches of a wheel on a rail, their sums, with moments about the load centre of each patch.
    #[serde(flatten)]
    pub whole: TrueResultants,
    /// The separate patches of a wheel on a rail, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub patches: Vec<TrueResultants>,
}

/// Resultants relative to μN, about a centre in mm.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct TrueResultants {
    /// F_x, F_y over μN and M_z over μN times `length`.
    pub value: [f64; 3],
    /// Uncertainty of the values.
    pub uncertainty: f64,
    /// Reference point of moments. It is zero for a wheel on a rail, where the answer gives the load centre.
    pub centre: [f64; 2],
    /// √(A/π) in mm.
    pub length: f64,
    /// μN in N.
    pub limit: f64,
}

impl TrueResultants {
    /// Returns the distance of the resultants `found` with their estimate in N.
    pub fn judged(&self, found: Resultants, estimate: f64) -> Judged {
        let frame = Frame {
            centre: self.centre,
            length: self.length,
            limit: self.limit,
        };
        Judged {
            error: distance(frame.relative(found), self.value),
            estimate: estimate / self.limit,
            uncertainty: self.uncertainty,
        }
    }
}

/// All reference results: by class, then by number.
pub type Truths = BTreeMap<String, BTreeMap<usize, Truth>>;

/// Returns the path of the file of reference results.
pub fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/finer_meshes.json")
}

/// Returns the reference results of the file, or none if there is no file.
pub fn read() -> Truths {
    std::fs::read_to_string(file())
        .ok()
        .map(|text| serde_json::from_str(&text).expect("a table of truths"))
        .unwrap_or_default()
}

/// Returns a fingerprint of the case (FNV-1a, without the bits that JSON parsers may round).
///
/// Numbers are rounded to ten digits because the last bits of a random case depend on the optimisation of its arithmetic.
pub fn print(case: &Value) -> u64 {
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
    let text = rounded(case).to_string();
    text.bytes().fold(0xcbf2_9ce4_8422_2325, step) >> 12
}

fn rounded(value: &Value) -> Value {
    match value {
        Value::Number(number) => Value::String(format!("{:.9e}", number.as_f64().expect("finite"))),
        Value::Array(values) => values.iter().map(rounded).collect(),
        Value::Object(members) => {
            let members = members
                .iter()
                .map(|(name, value)| (name.clone(), rounded(value)));
            Value::Object(members.collect())
        }
        other => other.clone(),
    }
}

/// Returns the largest difference of components.
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

/// Units and centre of a problem's resultants.
pub struct Frame {
    /// Reference point of moments in mm.
    pub centre: [f64; 2],
    /// √(A/π) in mm.
    pub length: f64,
    /// μN in N.
    pub limit: f64,
}

impl Frame {
    /// Returns F_x, F_y over μN and M_z over μN times the length.
    pub fn relative(&self, sum: Resultants) -> [f64; 3] {
        let about = sum.about(self.centre);
        [
            about.force_x / self.limit,
            about.force_y / self.limit,
            about.moment_z / (self.limit * self.length),
        ]
    }
}

/// One error estimate of an answer and the true error, relative to μN.
#[derive(Debug, Clone, Copy)]
pub struct Judged {
    /// Largest difference of the resultants from the reference result.
    pub error: f64,
    /// Error estimate of the answer.
    pub estimate: f64,
    /// Uncertainty of the reference result.
    pub uncertainty: f64,
}
