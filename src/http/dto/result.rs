//! The result of a job as the client sees it.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::Output;
use crate::contact::solution::Solution;

/// The result of a job: the solution without its fields, and where to get those.
#[derive(Debug, Serialize, ToSchema)]
pub struct JobResult {
    #[serde(flatten)]
    solution: Solution,
    /// The result was computed for an identical case before; `seconds` are those of that solve.
    cached: bool,
    /// The job, and every part of the result that the case asked for.
    links: BTreeMap<String, String>,
}

impl JobResult {
    /// The solution of a job whose case asked for these outputs.
    #[must_use]
    pub fn new(id: Uuid, solution: Solution, cached: bool, outputs: &[Output]) -> JobResult {
        let outputs: Vec<&str> = outputs.iter().copied().map(name_of).collect();
        JobResult {
            solution,
            cached,
            links: JobResult::links(id, &outputs),
        }
    }

    /// The links of the result of a job whose case asked for these outputs.
    #[must_use]
    pub fn links(id: Uuid, outputs: &[impl AsRef<str>]) -> BTreeMap<String, String> {
        let own = format!("/v1/jobs/{id}");
        let mut links = BTreeMap::from([("resultants".to_owned(), format!("{own}/resultants"))]);
        for name in outputs.iter().map(AsRef::as_ref) {
            links.insert(name.to_owned(), format!("{own}/{name}"));
        }
        links.insert("job".to_owned(), own);
        links
    }
}

/// The word of an output, in `outputs` and as the last part of its path.
#[must_use]
pub fn name_of(output: Output) -> &'static str {
    match output {
        Output::Resultants => "resultants",
        Output::Zones => "zones",
        Output::Tractions => "tractions",
        Output::Pressure => "pressure",
        Output::Slip => "slip",
    }
}
