//! Measures the cost of outputs for maintenance relative to the solve at a target of 0.005, on ellipses of many shapes.

use std::fmt::Write as _;
use std::time::Instant;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use serde_json::{Value, json};

use crate::machine::median;

const SHAPES: [f64; 6] = [0.3, 0.6, 1.0, 1.5, 2.5, 4.0];
const MOTIONS: [[f64; 3]; 3] = [[8e-4, 0.0, 0.0], [1e-3, 5e-4, 2e-4], [2e-4, 0.0, 1.2e-3]];
const REPEATED: usize = 3;

/// Returns the names of the outputs, and their members of the case.
fn options() -> [(&'static str, Value); 9] {
    let axis = |reach: f64, points: u32| json!({ "from": -reach, "to": reach, "points": points });
    let depths = json!({ "from": 0.2, "to": 8, "points": 25 });
    let plane = |along| json!({ "x_mm": axis(8.0, along), "y_mm": 0.3, "depths_mm": depths });
    let stresses = |along| json!({ "outputs": ["subsurface"], "subsurface": { "plane": plane(along), "worst": false } });
    let thermal = json!({
        "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20
    });
    let models = json!([
        "t_gamma",
        "usfd_wear",
        "archard_wear",
        "wlrm",
        "surface_fatigue_index",
        "shakedown"
    ]);
    [
        ("nothing more", json!({})),
        ("1000 stresses", stresses(40)),
        ("20 000 stresses", stresses(800)),
        ("worst point", json!({ "outputs": ["subsurface"] })),
        (
            "passage",
            json!({ "outputs": ["subsurface"], "subsurface": { "passage": { "dang_van_slope": 0.3 } } }),
        ),
        (
            "damage",
            json!({ "outputs": ["damage"], "damage": { "models": models } }),
        ),
        (
            "damage across",
            json!({ "outputs": ["damage"], "damage": { "models": models, "across": true } }),
        ),
        ("slip", json!({ "outputs": ["slip"] })),
        (
            "temperature",
            json!({ "outputs": ["temperature"], "thermal": thermal }),
        ),
    ]
}

/// Returns the table with medians over all contacts.
pub fn table() -> String {
    let mut seconds = vec![Vec::new(); options().len()];
    for ratio in SHAPES {
        for [x, y, spin] in MOTIONS {
            for (k, (_, more)) in options().into_iter().enumerate() {
                let mut case = json!({
                    "material": { "shear_modulus_mpa": 82_000, "poisson_ratio": 0.28 },
                    "friction": { "coefficient": 0.3 },
                    "contact": { "type": "ellipse", "a_mm": 5.0 * f64::sqrt(ratio), "b_mm": 5.0 / f64::sqrt(ratio) },
                    "load": { "normal_force_n": 80_000 },
                    "motion": { "creepage_x": x, "creepage_y": y, "spin_per_mm": spin, "speed_mm_per_s": 30_000 },
                    "outputs": ["resultants"],
                });
                for (name, value) in more.as_object().into_iter().flatten() {
                    case[name] = value.clone();
                }
                seconds[k].push(least(&case));
            }
        }
    }
    let mut text = String::from(
        "## Outputs for maintenance\n\nMilliseconds beside a solve for 0.005 alone, medians over 18 ellipses.\n\n| asked for | solve and output | output alone | over the solve |\n|---|---|---|---|\n",
    );
    let bare = seconds[0].clone();
    for ((name, _), all) in options().iter().zip(seconds) {
        let more: Vec<f64> = all
            .iter()
            .zip(&bare)
            .map(|(all, bare)| all - bare)
            .collect();
        let over: Vec<f64> = more
            .iter()
            .zip(&bare)
            .map(|(more, bare)| more / bare)
            .collect();
        let [all, more, over] = [all, more, over].map(median);
        let _ = writeln!(
            text,
            "| {name} | {:.3} | {:.3} | {over:.2} |",
            1e3 * all,
            1e3 * more
        );
    }
    text
}

/// Returns the least of several times of a solve, in s.
fn least(case: &Value) -> f64 {
    let checked = contact::check(case, &Limits::default()).expect("a valid case");
    let once = |_| {
        let began = Instant::now();
        contact::solve(&checked, &Unmonitored).expect("an answer");
        began.elapsed().as_secs_f64()
    };
    (0..REPEATED).map(once).fold(f64::INFINITY, f64::min)
}
