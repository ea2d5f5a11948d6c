//! What is saved by skipping what a case does not need.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::questions::{problem, timed};

const REPEATS: usize = 21;

pub fn section(lu: f64) -> String {
    let resultants = json!(["resultants"]);
    let everything = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    let long = json!({ "creepage_x": 0.002 });
    let both = json!({ "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0004 });
    let curve = json!({ "sweep": { "creepage_x": { "from": 0, "to": 0.005, "points": 51 } } });
    let alone: Vec<Value> = (0..51)
        .map(|k| json!({ "creepage_x": 0.0001 * f64::from(k) }))
        .collect();
    let mut text = "## What skipping saves\n\nWheel on rail (radii 460 and 300 mm, 100 kN, μ 0.3), target 0.005.\n\n\
                    | case | LU | products |\n|---|---|---|\n"
        .to_owned();
    for (name, motion, outputs, friction) in [
        (
            "longitudinal creepage, resultants only",
            &long,
            &resultants,
            0.3,
        ),
        ("the same, all outputs", &long, &everything, 0.3),
        (
            "creepages and spin, resultants only (no symmetry)",
            &both,
            &resultants,
            0.3,
        ),
        ("the same, all outputs", &both, &everything, 0.3),
        ("no friction, all outputs", &both, &everything, 0.0),
        (
            "no creepage, all outputs",
            &json!({ "creepage_x": 0.0 }),
            &everything,
            0.3,
        ),
        (
            "everything slips (creepage 1000)",
            &json!({ "creepage_x": 1000.0 }),
            &resultants,
            0.3,
        ),
        (
            "creep curve of 51 points in one job",
            &curve,
            &resultants,
            0.3,
        ),
    ] {
        let (seconds, products) = cost(motion, outputs, friction);
        let _ = writeln!(text, "| {name} | {:.3} | {products} |", seconds / lu);
    }
    let costs: Vec<(f64, u32)> = alone.iter().map(|m| cost(m, &resultants, 0.3)).collect();
    let _ = writeln!(
        text,
        "| the 51 points one by one | {:.3} | {} |\n",
        costs.iter().map(|c| c.0).sum::<f64>() / lu,
        costs.iter().map(|c| c.1).sum::<u32>()
    );
    text
}

/// Seconds and products of a case.
fn cost(motion: &Value, outputs: &Value, friction: f64) -> (f64, u32) {
    let problem = problem(&json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": friction },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": { "target_error": 0.005 },
        "outputs": outputs,
    }));
    let (solution, seconds) = timed(&problem, REPEATS);
    let points = &solution.expect("an answer").patches[0].points;
    (seconds, points.iter().map(|p| p.solver.products).sum())
}
