//! Do the motions of a sweep help each other, and give what each gives alone?

use serde_json::{Value, json};

use crate::reference::solve;

fn case(motion: &Value, target: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": { "target_error": target },
        "outputs": ["resultants"],
    })
}

/// A path of 25 motions along a line, in three directions.
fn lines() -> [Vec<Value>; 3] {
    let line = |at: fn(f64) -> Value| (0..25).map(|k| at(f64::from(k) / 24.0)).collect();
    [
        line(|s| json!({ "creepage_x": 0.004 * s })),
        line(|s| json!({ "spin_per_mm": 0.0015 * s })),
        line(
            |s| json!({ "creepage_x": 0.006 * s - 0.003, "creepage_y": 0.001, "spin_per_mm": 0.0003 }),
        ),
    ]
}

#[test]
fn every_motion_of_a_sweep_is_within_its_estimate_of_a_finer_solve_alone() {
    for motions in lines() {
        let (sweep, _) = solve(&case(&json!(motions), 0.01));
        for (k, motion) in motions.iter().enumerate().step_by(3) {
            let (alone, _) = solve(&case(motion, 0.001));
            let (here, there) = (&sweep.total[k], &alone.total[0]);
            let estimate = here.error_estimate.expect("an estimate").force_x_n;
            let truth = there.error_estimate.expect("an estimate").force_x_n;
            assert!(estimate <= 0.01 * 30_000.0, "{motion}: {estimate}");
            for (name, a, b) in [
                ("force_x", here.force_x_n, there.force_x_n),
                ("force_y", here.force_y_n, there.force_y_n),
            ] {
                assert!(
                    (a - b).abs() <= estimate + truth,
                    "{motion} {name}: {a} in the sweep, {b} alone, estimate {estimate}"
                );
            }
        }
    }
}

#[test]
fn a_sweep_takes_fewer_products_than_its_motions_alone() {
    for motions in lines() {
        let products = |question: &Value| -> u32 {
            let (solution, _) = solve(question);
            let points = &solution.patches[0].points;
            points.iter().map(|point| point.solver.products).sum()
        };
        let together = products(&case(&json!(motions), 0.005));
        let alone: u32 = motions
            .iter()
            .map(|motion| products(&case(motion, 0.005)))
            .sum();
        assert!(
            3 * together < 2 * alone,
            "{together} together, {alone} alone"
        );
    }
}

#[test]
fn the_order_of_motions_does_not_change_their_answers_beyond_the_estimate() {
    let mut motions: Vec<Value> = lines().concat();
    let (forward, _) = solve(&case(&json!(motions), 0.01));
    motions.reverse();
    let (backward, _) = solve(&case(&json!(motions), 0.01));
    for (there, back) in forward.total.iter().zip(backward.total.iter().rev()) {
        let estimates = [there, back].map(|t| t.error_estimate.expect("an estimate").force_x_n);
        let allowed = estimates[0] + estimates[1];
        assert!((there.force_x_n - back.force_x_n).abs() <= allowed);
        assert!((there.force_y_n - back.force_y_n).abs() <= allowed);
    }
}
