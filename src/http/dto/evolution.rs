//! An evolution as the client submits it.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use crate::contact::case::words::evolution::EvolutionWords;

/// Profiles that wear under a traffic.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "the contract; bodies are read by `contact`")]
pub(crate) struct EvolutionRequest {
    /// A case of one motion whose contact is of the type `profiles`. Members that a column holds may be left out; `outputs` is not needed, and
    /// `solver` has a target of 0.02 when left out.
    #[schema(value_type = Object)]
    template: Value,
    /// The states of the traffic.
    traffic: Traffic,
    #[serde(flatten)]
    plan: EvolutionWords,
}

/// A table of states.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "the contract; bodies are read by `contact`")]
pub(crate) struct Traffic {
    /// Columns of numbers, all of the same length, named as those of a run.
    columns: BTreeMap<String, Vec<f64>>,
    /// Relative numbers of passes of the states; 1 for each when left out.
    #[schema(required = false)]
    passes: Vec<f64>,
}
