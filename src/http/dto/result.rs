//! The result of a job as the client sees it.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use crate::contact::case::words::solver::Output;
use crate::contact::solution::words::answer::Solution;
use crate::http::problem::error::ApiError;

/// The result of a job: the solution without its fields, and where to get those.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct JobResult {
    #[serde(flatten)]
    solution: Solution,
    /// The result was computed for an identical case before; `seconds` are those of that solve.
    cached: bool,
    /// The job, and every part of the result that the case asked for.
    links: BTreeMap<String, String>,
}

impl JobResult {
    /// What follows the stored solution, whose closing brace makes way for it.
    ///
    /// # Errors
    /// It cannot be written as JSON.
    pub(crate) fn tail(id: Uuid, cached: bool, outputs: &[Output]) -> Result<String, ApiError> {
        let outputs: Vec<&str> = outputs.iter().copied().map(name_of).collect();
        let links = serde_json::to_string(&JobResult::links(id, &outputs));
        let links = links.map_err(|error| ApiError::internal(&error))?;
        Ok(format!(",\"cached\":{cached},\"links\":{links}}}"))
    }

    /// The links of the result of a job whose case asked for these outputs.
    #[must_use]
    pub(crate) fn links(id: Uuid, outputs: &[impl AsRef<str>]) -> BTreeMap<String, String> {
        let own = format!("/v1/jobs/{id}");
        let mut links = BTreeMap::from([("resultants".to_owned(), format!("{own}/resultants"))]);
        // Derivatives stand beside the resultants.
        let own_parts = outputs.iter().map(AsRef::as_ref);
        for name in own_parts.filter(|name| *name != name_of(Output::Gradients)) {
            links.insert(name.to_owned(), format!("{own}/{name}"));
            let small = [Output::Resultants, Output::Subsurface, Output::Damage].map(name_of);
            if !small.contains(&name) {
                links.insert("fields".to_owned(), format!("{own}/fields"));
            }
        }
        links.insert("job".to_owned(), own);
        links
    }
}

/// The word of an output, in `outputs` and as the last part of its path.
#[must_use]
pub(crate) fn name_of(output: Output) -> &'static str {
    match output {
        Output::Resultants => "resultants",
        Output::Zones => "zones",
        Output::Tractions => "tractions",
        Output::Pressure => "pressure",
        Output::Slip => "slip",
        Output::Subsurface => "subsurface",
        Output::Damage => "damage",
        Output::Temperature => "temperature",
        Output::Gradients => "gradients",
    }
}
