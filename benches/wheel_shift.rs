//! Draws the forces of a wheel on its rail over the lateral shift of the wheelset, and prints how smooth they are.

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::drawing::{Curve, Frame, Picture};
use crate::machine::{median, quantile};

/// Largest shift in mm toward the rail. `STEP` is the step between shifts.
const SHIFT_MAX: f64 = 8.0;
const STEP: f64 = 0.05;
const FRICTION: f64 = 0.3;
/// Number of second differences that are printed.
const NAMED: usize = 24;

/// A pair with its wheel load in N and the yaw in rad.
pub(crate) struct Shifted {
    pub(crate) name: &'static str,
    pub(crate) pair: Value,
    pub(crate) load: f64,
    pub(crate) yaw: f64,
}

impl Shifted {
    /// Returns the shift in mm with F_x and F_y in kN, for the shifts that have an answer on the curve.
    fn forces(&self) -> Vec<[f64; 3]> {
        let count = (SHIFT_MAX / STEP).round() as u32;
        let at = |k: u32| {
            let shift = STEP * f64::from(k);
            let mut case = self.pair.clone();
            case["contact"]["lateral_shift_mm"] = json!(-shift);
            case["contact"]["yaw_rad"] = json!(self.yaw);
            case["contact"]["reference_surface"] = json!("curve");
            case["load"] = json!({ "vertical_force_n": self.load });
            case["friction"] = json!({ "coefficient": FRICTION });
            case["outputs"] = json!(["resultants"]);
            let checked = check(&case, &Limits::default()).expect("a valid case");
            match solve(&checked, &Unmonitored) {
                Ok((solution, _)) => {
                    let total = &solution.total[0];
                    Some([shift, 1e-3 * total.force_x_n, 1e-3 * total.force_y_n])
                }
                Err(error) => {
                    println!("{}: {shift:.2} mm: {error}", self.name);
                    None
                }
            }
        };
        (0..=count).filter_map(at).collect()
    }
}

/// Draws all pairs side by side and prints the second differences of the forces.
pub(crate) fn draw(pairs: &[Shifted]) -> Picture {
    println!("| pair | bend of F_x, F_y in % of μN: median | 90 % | largest |\n|---|---|---|---|");
    let mut picture = Picture::new(
        460.0 * pairs.len() as f64,
        340.0,
        "Forces on the rail over the shift of the wheelset",
    );
    for (k, pair) in pairs.iter().enumerate() {
        let forces = pair.forces();
        let limit = 1e-3 * FRICTION * pair.load;
        let bend = |w: &[[f64; 3]]| {
            let [x, y] = [1, 2].map(|c| (w[0][c] - 2.0 * w[1][c] + w[2][c]).abs());
            [x.max(y) / limit, w[1][0]]
        };
        let bends: Vec<[f64; 2]> = forces.windows(3).map(bend).collect();
        let sizes: Vec<f64> = bends.iter().map(|[size, _]| 100.0 * size).collect();
        println!(
            "| {} | {:.2} | {:.2} | {} |",
            pair.name,
            median(sizes.clone()),
            quantile(sizes, 0.9),
            largest(bends)
        );
        let all = forces.iter().flat_map(|[_, x, y]| [*x, *y]);
        let (low, high) = all.fold((0.0_f64, 0.0_f64), |(low, high), force| {
            (low.min(force), high.max(force))
        });
        let left = 460.0 * k as f64 + 70.0;
        let frame = Frame {
            x: [0.0, SHIFT_MAX],
            y: [low, high],
            logarithmic: false,
            left,
            right: left + 360.0,
            bottom: 280.0,
            top: 60.0,
        };
        picture.text([left + 180.0, 48.0], pair.name);
        picture.axes(&frame, "shift toward the rail, mm", "");
        for (line, name) in ["F_x, kN", "F_y, kN"].into_iter().enumerate() {
            let points: Vec<[f64; 2]> = forces.iter().map(|row| [row[0], row[1 + line]]).collect();
            picture.line(&frame, &points, Curve::Line(line));
            let y = 150.0 + 16.0 * line as f64;
            picture.key(left + 12.0, y, Curve::Line(line), name);
        }
    }
    picture
}

/// Returns a text with the largest second differences in % and their shifts in mm.
fn largest(mut bends: Vec<[f64; 2]>) -> String {
    bends.sort_by(|a, b| b[0].total_cmp(&a[0]));
    let text = |[size, shift]: &[f64; 2]| format!("{:.2} at {shift:.2} mm", 100.0 * size);
    let named: Vec<String> = bends.iter().take(NAMED).map(text).collect();
    named.join(", ")
}
