//! The cost of a target, whether it is met, and whether the estimate covers the error.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::machine::{lu_seconds, median, quantile};
use crate::questions::{hertz, hertz_error, number, timed};

const REPEATS: usize = 7;

/// The result of one solve of one case.
struct Outcome {
    error: f64,
    uncertainty: f64,
    estimate: f64,
    seconds: f64,
    products: u32,
    cells: u32,
}

pub fn section(cases: &[Value]) -> String {
    let mut text = format!(
        "## Targets\n\n`target_error` on {} Hertz cases (a/b 0.2 to 5, creepages and spin), resultants only; `auto` takes the creep table where its bound \
         meets the target. *Met*: error ≤ target, \
         *covered*: error ≤ estimate, both beyond the reference's uncertainty; *certified*: estimate ≤ target.\n\n\
         | target | method | met | covered | certified | estimate/error, median | error: median | 90 % | largest | LU: median | 90 % | largest | products | cells |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
        cases.len()
    );
    let targets = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001, 0.0005];
    let rows = targets.map(|target| ["auto", "boundary_element"].map(|method| (target, method)));
    for (target, method) in rows.into_iter().flatten() {
        let lu = lu_seconds();
        let outcomes = cases.iter().map(|case| outcome(case, target, method));
        let outcomes: Vec<Outcome> = outcomes.collect();
        let count =
            |holds: fn(&Outcome, f64) -> bool| outcomes.iter().filter(|o| holds(o, target)).count();
        let all = |value: fn(&Outcome) -> f64| -> Vec<f64> { outcomes.iter().map(value).collect() };
        let (errors, seconds) = (all(|o| o.error), all(|o| o.seconds));
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let _ = writeln!(
            text,
            "| {target} | `{method}` | {} | {} | {} | {:.1} | {:.4} | {:.4} | {:.4} | {:.3} | {:.3} | {:.3} | {:.0} | {:.0} |",
            count(|o, target| o.error <= target + o.uncertainty),
            count(|o, _| o.error <= o.estimate + o.uncertainty),
            count(|o, target| o.estimate <= target),
            median(all(|o| o.estimate / o.error.max(1e-9))),
            median(errors.clone()),
            quantile(errors.clone(), 0.9),
            quantile(errors, 1.0),
            median(seconds.clone()) / lu,
            quantile(seconds.clone(), 0.9) / lu,
            quantile(seconds, 1.0) / lu,
            mean(all(|o| f64::from(o.products))),
            mean(all(|o| f64::from(o.cells))),
        );
    }
    text.push_str(
        "\nProducts (influence times vector, all levels) and cells (last level) are means.\n\n",
    );
    text
}

fn outcome(case: &Value, target: f64, method: &str) -> Outcome {
    let checked = hertz(
        case,
        &json!({ "method": method, "target_error": target }),
        &json!(["resultants"]),
    );
    let (solution, seconds) = timed(&checked, REPEATS);
    let solution = solution.expect("an answer");
    let (error, uncertainty) = hertz_error(&solution.total[0], case);
    let bound = number(case, "friction") * number(case, "normal_force_n");
    let report = &solution.patches[0].points[0].solver;
    Outcome {
        error,
        uncertainty,
        estimate: solution.total[0]
            .error_estimate
            .expect("an estimate")
            .force_x_n
            / bound,
        seconds,
        products: report.products,
        cells: report.mesh.map_or(0, |mesh| mesh.cells * mesh.strips),
    }
}
