//! Savings by skipping work that a case does not need.

use std::fmt::Write as _;
use std::hint::black_box;
use std::sync::Arc;

use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::{solve, solve_with};
use serde_json::{Value, json};

use crate::allocations::during;
use crate::machine::{lu_seconds, median, seconds_of};
use crate::questions::{hertz, hertz_cases, problem, timed};

const REPEATS: usize = 21;
/// Repeats of each reference solve in the comparison with the creep curve. `TURNS` is the number of alternations between both.
const REPEATS_EACH: usize = 3;
const TURNS: usize = 9;
const HEAD: &str = "## What skipping saves\n\nWheel on rail (radii 460 and 300 mm, 100 kN, μ 0.3), target 0.005. Times are those of solves on their own, \
allocations those of a worker of the service that has solved the case before.\n\n\
| case | LU | products | allocations |\n|---|---|---|---|\n";
const CASES_OF_A_SHAPE: u32 = 500;

pub fn section() -> String {
    let resultants = json!(["resultants"]);
    let everything = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    let long = json!({ "creepage_x": 0.002 });
    let both = json!({ "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0004 });
    let curve = json!({ "sweep": { "creepage_x": { "from": 0, "to": 0.005, "points": 51 } } });
    let spinning = json!({ "sweep": {
        "creepage_x": { "from": 0, "to": 0.006, "points": 7 },
        "spin_per_mm": { "from": 0.003, "to": 0.003, "points": 1 },
        "combine": "grid",
    } });
    let still = json!({ "creepage_x": 0.0 });
    let sliding = json!({ "creepage_x": 1000.0 });
    let mut text = HEAD.to_owned();
    let mut row = |name: &str, motion: &Value, outputs: &Value, friction: f64| {
        let lu = lu_seconds();
        let cost = cost(motion, outputs, friction);
        let (time, products, allocations) = (cost.seconds / lu, cost.products, cost.allocations);
        let _ = writeln!(text, "| {name} | {time:.3} | {products} | {allocations} |");
    };
    let [some, all] = [&resultants, &everything];
    row("longitudinal creepage, resultants only", &long, some, 0.3);
    row("the same, all outputs", &long, all, 0.3);
    let name = "creepages and spin, resultants only (no symmetry)";
    row(name, &both, some, 0.3);
    row("the same, all outputs", &both, all, 0.3);
    row("no friction, all outputs", &both, all, 0.0);
    row("no creepage, all outputs", &still, all, 0.3);
    row("everything slips (creepage 1000)", &sliding, some, 0.3);
    row("creep curve of 51 points in one job", &curve, some, 0.3);
    let name = "sweep of 7 creepages under spin 0.003/mm, resultants only";
    row(name, &spinning, some, 0.3);
    row("the same, all outputs", &spinning, all, 0.3);
    text.push_str(&one_by_one());
    text.push_str(&beside_the_median(&curve));
    text.push_str(&creep_map());
    text.push_str(&one_shape());
    text
}

/// Solves the points of the creep curve as separate cases.
fn one_by_one() -> String {
    let lu = lu_seconds();
    let resultants = json!(["resultants"]);
    let costs: Vec<Cost> = (0..51)
        .map(|k| json!({ "creepage_x": 0.0001 * f64::from(k) }))
        .map(|motion| cost(&motion, &resultants, 0.3))
        .collect();
    format!(
        "| the 51 points one by one | {:.3} | {} | {} |\n\n",
        costs.iter().map(|c| c.seconds).sum::<f64>() / lu,
        costs.iter().map(|c| c.products).sum::<u32>(),
        costs.iter().map(|c| c.allocations).sum::<u64>()
    )
}

/// Compares the creep curve with solves of the reference cases, measured alternately.
fn beside_the_median(curve: &Value) -> String {
    let outputs = json!(["resultants"]);
    let curve = problem(&question(curve, &outputs, 0.3, 100_000.0));
    let solver = json!({ "target_error": 0.005 });
    let cases: Vec<CheckedCase> = hertz_cases()
        .iter()
        .map(|case| hertz(case, &solver, &outputs))
        .collect();
    let ratios = (0..TURNS).map(|_| {
        let (_, whole) = timed(&curve, REPEATS);
        let each = cases.iter().map(|case| timed(case, REPEATS_EACH).1);
        whole / median(each.collect())
    });
    format!(
        "The creep curve takes {:.1} times as long as the median Hertz reference at the same target; curve and references were solved alternately.\n\n",
        median(ratios.collect())
    )
}

/// Solves both creepages over a grid, at one spin, in one job.
fn creep_map() -> String {
    let lu = lu_seconds();
    let [along, across] = [40_u32, 25];
    let motion = json!({ "sweep": {
        "creepage_x": { "from": -0.004, "to": 0.004, "points": along },
        "creepage_y": { "from": 0, "to": 0.004, "points": across },
        "spin_per_mm": { "from": 0.0004, "to": 0.0004, "points": 1 },
        "combine": "grid",
    } });
    let cost = cost(&motion, &json!(["resultants"]), 0.3);
    let motions = f64::from(along * across);
    format!(
        "A creep map of {along} × {across} creepages at a spin of 0.0004/mm takes {:.3} LU and {:.1} products a motion.\n\n",
        cost.seconds / lu / motions,
        f64::from(cost.products) / motions
    )
}

/// Solves cases of one shape under many loads and motions, each separately and with the stored influence coefficients.
fn one_shape() -> String {
    let lu = lu_seconds();
    let problems: Vec<CheckedCase> = (0..CASES_OF_A_SHAPE)
        .map(|k| {
            let part = f64::from(k) / f64::from(CASES_OF_A_SHAPE);
            let motion =
                json!({ "creepage_x": 0.003 * part, "spin_per_mm": 0.0004 * (1.0 - part) });
            let load = 60_000.0 + 80_000.0 * (7.0 * part).fract();
            problem(&question(&motion, &json!(["resultants"]), 0.3, load))
        })
        .collect();
    let store = Arc::new(OperatorStore::default());
    let (alone, ()) = seconds_of(|| {
        for checked in &problems {
            let _ = black_box(solve(checked, &Unmonitored));
        }
    });
    let (kept, ()) = seconds_of(|| {
        for checked in &problems {
            let _ = black_box(solve_with(&store, checked, &Unmonitored));
        }
    });
    let each = |seconds: f64| seconds / lu / f64::from(CASES_OF_A_SHAPE);
    format!(
        "{CASES_OF_A_SHAPE} cases of this shape under other loads and motions take {:.3} LU each on their own, {:.3} LU each with the \
         influence of earlier ones kept ({:.1} MB of matrices), as a worker of the service does.\n\n",
        each(alone),
        each(kept),
        store.bytes() as f64 / 1e6
    )
}

/// The cost of one solve.
struct Cost {
    seconds: f64,
    products: u32,
    allocations: u64,
}

fn cost(motion: &Value, outputs: &Value, friction: f64) -> Cost {
    let checked = problem(&question(motion, outputs, friction, 100_000.0));
    let (solution, seconds) = timed(&checked, REPEATS);
    let store = Arc::new(OperatorStore::default());
    let _ = solve_with(&store, &checked, &Unmonitored);
    let points = &solution.expect("an answer").patches[0].points;
    Cost {
        seconds,
        products: points.iter().map(|p| p.solver.products).sum(),
        allocations: during(|| solve_with(&store, &checked, &Unmonitored)),
    }
}

fn question(motion: &Value, outputs: &Value, friction: f64, load: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": friction },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": load },
        "motion": motion,
        "solver": { "target_error": 0.005 },
        "outputs": outputs,
    })
}
