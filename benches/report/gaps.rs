//! Contacts found from measured gaps: the normal problem beside the tangential one.

use std::f64::consts::PI;
use std::fmt::Write as _;
use std::hint::black_box;

use railhead::contact::monitor::Unwatched;
use serde_json::json;

use crate::machine::{median, quantile, seconds_of};
use crate::questions::{number, problem, stored, timed};

const REPEATS: usize = 11;

pub fn section(lu: f64) -> String {
    let mut text = "## Contacts from gaps\n\nWheel on rail as `gap_grid` (61 to 100 samples a side) at the default target of 0.005; both problems \
                    are in the time.\n\n| case | LU | normal problem, LU | error of resultants | approach | area | largest pressure |\n\
                    |---|---|---|---|---|---|---|\n"
        .to_owned();
    let (mut whole, mut normal, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for case in stored("gap_grids") {
        let problem = problem(&json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "gap_grid", "x_mm": case["x_mm"], "y_mm": case["y_mm"], "gap_mm": case["gap_mm"] },
            "load": { "normal_force_n": case["normal_force_n"] },
            "motion": { "creepage_x": case["creepage_x"], "creepage_y": case["creepage_y"], "spin_per_mm": case["spin_per_mm"] },
            "outputs": ["resultants"],
        }));
        let (solution, seconds) = timed(&problem, REPEATS);
        let press = || {
            let _ = black_box(problem.pressed(&Unwatched));
        };
        let pressing = median((0..REPEATS).map(|_| seconds_of(press).0).collect());
        let solution = solution.expect("an answer");
        let (patches, total) = (&solution.patches, &solution.total[0]);
        let area: f64 = patches.iter().map(|p| p.area_mm2).sum();
        let peak = patches
            .iter()
            .map(|p| p.pressure_max_mpa)
            .fold(0.0, f64::max);
        let bound = 0.3 * number(&case, "normal_force_n");
        let error = [
            ("force_x_n", total.force_x_n, bound),
            ("force_y_n", total.force_y_n, bound),
            (
                "moment_z_n_mm",
                total.moment_z_n_mm,
                bound * (area / PI).sqrt(),
            ),
        ]
        .map(|(name, found, scale)| (found - number(&case[name], "value")).abs() / scale)
        .into_iter()
        .fold(0.0, f64::max);
        let off = |name: &str, found: f64| found / number(&case[name], "value") - 1.0;
        let _ = writeln!(
            text,
            "| {} | {:.2} | {:.2} | {error:.4} | {:+.5} | {:+.4} | {:+.4} |",
            case["id"].as_str().unwrap_or_default(),
            seconds / lu,
            pressing / lu,
            off("approach_mm", patches[0].approach_mm.unwrap_or(f64::NAN)),
            off("area_mm2", area),
            off("pressure_max_mpa", peak),
        );
        whole.push(seconds / lu);
        normal.push(pressing / lu);
        errors.push(error);
    }
    let _ = writeln!(
        text,
        "| median | {:.2} | {:.2} | {:.4} | | | |\n| largest | {:.2} | {:.2} | {:.4} | | | |\n",
        median(whole.clone()),
        median(normal.clone()),
        median(errors.clone()),
        quantile(whole, 1.0),
        quantile(normal, 1.0),
        quantile(errors, 1.0),
    );
    text
}
