//! Starting what is under test: the jobs room in this process, or the real program beside it.

use std::path::Path;
use std::sync::Arc;

use railhead::contact::error::SolveError;
use railhead::contact::monitor::Monitor;
use railhead::contact::problem::Problem;
use railhead::contact::solution::{Fields, Solution};
use railhead::jobs::recipe::Recipe;
use railhead::jobs::{Jobs, Options};
use serde_json::{Value, json};

use crate::standin;

/// A case of the handbook: a new wheel on the crown of a rail.
pub fn case(name: &str) -> Value {
    json!({
        "name": name,
        "labels": { "line": "A12" },
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": { "creepage_x": 0.001, "creepage_y": 0.0, "spin_per_mm": 0.0004 },
        "solver": { "method": "boundary_element", "mesh": { "strips": 6, "cells": 6 } },
        "outputs": ["resultants", "zones", "tractions"]
    })
}

/// Jobs on a data folder, solved by the given function.
pub async fn jobs_with<F>(data_dir: &Path, solve: F) -> Jobs
where
    F: Fn(&Problem, &dyn Monitor) -> Result<(Solution, Fields), SolveError> + Send + Sync + 'static,
{
    open(Options::new(data_dir), solve).await
}

/// Jobs with options of one's own, solved by the given function.
pub async fn open<F>(options: Options, solve: F) -> Jobs
where
    F: Fn(&Problem, &dyn Monitor) -> Result<(Solution, Fields), SolveError> + Send + Sync + 'static,
{
    let recipe = Recipe {
        check: Arc::new(standin::check),
        solve: Arc::new(solve),
    };
    Jobs::open_with(options, recipe).await.unwrap()
}

/// A solve that succeeds at once.
pub fn answer_at_once(_: &Problem, _: &dyn Monitor) -> Result<(Solution, Fields), SolveError> {
    Ok(standin::answer())
}
