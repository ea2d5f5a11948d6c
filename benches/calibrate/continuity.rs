//! Prints how much the estimate changes between neighbours of a sweep.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use serde_json::{Value, json};

const POINTS: u32 = 81;
const SPINS: [f64; 3] = [2e-4, 5e-4, 1.5e-3];

fn case(motion: &Value, target: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": { "method": "boundary_element", "target_error": target },
        "outputs": ["resultants"],
    })
}

/// Returns the estimates of all motions of a case, and the numbers of cells of their meshes.
fn estimates(case: &Value) -> Vec<(f64, u32)> {
    let problem = contact::check(case, &Limits::default()).expect("a sound case");
    let (solution, _) = contact::solve(&problem, &Unmonitored).expect("an answer");
    let points = solution.patches[0].points.iter();
    let of = |point: &contact::solution::words::answer::PointSolution| {
        let mesh = point.solver.mesh.expect("a mesh");
        (
            point.error_estimate.expect("an estimate").force_x_n,
            mesh.strips * mesh.cells,
        )
    };
    points.map(of).collect()
}

/// Prints the changes of the logarithm of the estimate between neighbours of a sweep of the longitudinal creepage at fixed spin.
pub fn table() {
    println!(
        "| sweep | target | spin 1/mm | change of ln(estimate): median | 90 % | largest | meshes changed |"
    );
    println!("|---|---|---|---|---|---|---|");
    for target in [0.02, 0.005, 0.001] {
        for spin in SPINS {
            let motions: Vec<Value> = (0..POINTS)
                .map(|k| json!({ "creepage_x": 5e-5 * f64::from(k), "spin_per_mm": spin }))
                .collect();
            let together = estimates(&case(&json!(motions), target));
            let alone = motions
                .iter()
                .flat_map(|motion| estimates(&case(motion, target)));
            row("one sweep", target, spin, &together);
            row("each alone", target, spin, &alone.collect::<Vec<_>>());
        }
    }
}

fn row(name: &str, target: f64, spin: f64, found: &[(f64, u32)]) {
    let mut changes: Vec<f64> = found
        .windows(2)
        .map(|pair| (pair[1].0 / pair[0].0).ln().abs())
        .collect();
    changes.sort_by(f64::total_cmp);
    let at = |part: f64| changes[(part * (changes.len() - 1) as f64).round() as usize];
    let meshes = found
        .windows(2)
        .filter(|pair| pair[0].1 != pair[1].1)
        .count();
    println!(
        "| {name} | {target} | {spin} | {:.3} | {:.3} | {:.2} | {meshes} |",
        at(0.5),
        at(0.9),
        at(1.0)
    );
}
