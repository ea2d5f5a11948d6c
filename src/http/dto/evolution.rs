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

/// States of a traffic: a table, distributions that the service samples, or both.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "the contract; bodies are read by `contact`")]
pub(crate) struct Traffic {
    /// Columns named as those of a run: a number for each row, or a distribution that is sampled once for each row. Distributions are independent of
    /// each other.
    columns: BTreeMap<String, TrafficColumn>,
    /// Relative numbers of passes of the rows; 1 for each when left out.
    #[schema(required = false)]
    passes: Vec<f64>,
    /// Rows of a traffic whose columns are all distributions; 4096 when left out.
    #[schema(required = false, minimum = 1, maximum = 200_000)]
    samples: u32,
}

/// A column of a traffic.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
#[allow(dead_code, reason = "the contract; bodies are read by `contact`")]
pub(crate) enum TrafficColumn {
    /// The values of the rows.
    Numbers(Vec<f64>),
    /// A distribution.
    Distribution(TrafficDistribution),
}

/// Distribution of a column: normal between two values if it has a mean and a standard deviation, else uniform.
#[derive(Debug, Serialize, ToSchema)]
#[allow(dead_code, reason = "the contract; bodies are read by `contact`")]
pub(crate) struct TrafficDistribution {
    /// Least value.
    min: f64,
    /// Largest value.
    max: f64,
    /// Mean before the ends are cut off.
    #[schema(required = false)]
    mean: f64,
    /// Standard deviation before the ends are cut off.
    #[schema(required = false, exclusive_minimum = 0.0)]
    standard_deviation: f64,
}
