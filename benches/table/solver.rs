//! Solves dimensionless creepages with the boundary-element method.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use cpu_time::ProcessTime;
use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::linear_theory::coefficients;
use railhead_contact::rolling::methods::table::spline::Shape;
use railhead_contact::rolling::operator_store::OperatorStore;
use serde_json::json;

use crate::machine::{quantile, seconds_of};

/// c = √(ab) in mm, G in MPa, and μN/(G c²), which is small so that the largest creepages remain allowed.
const LENGTH: f64 = 5.0;
const MODULUS: f64 = 80_000.0;
const CREEPAGE: f64 = 1e-6;
const FRICTION: f64 = 0.001;

/// An ellipse and its material.
#[derive(Clone, Copy)]
pub struct Contact {
    pub ratio: f64,
    pub poisson: f64,
}

impl Contact {
    /// Returns C11 and C22, and the shape of the directions, which is that of ν = 1/4.
    pub fn scales(&self) -> ([f64; 2], Shape) {
        let pair = |poisson: f64| {
            let [c11, c22, _] = coefficients(self.ratio, poisson);
            [c11, c22]
        };
        (
            pair(self.poisson),
            Shape::new(self.ratio.sqrt(), pair(0.25)),
        )
    }
}

/// F_x/(μN), F_y/(μN), M_z/(μNc), the stick share of the patch, the estimated error.
pub type Answer = [f64; 5];

/// Number of threads that solve.
const THREADS: usize = 2;

/// Solves all parts on several threads, which write their files. Prints a line for each part, with its name.
pub fn solve_parts<P: Sync>(parts: &[P], solve: impl Fn(&P) -> String + Sync) {
    let (next, began) = (AtomicUsize::new(0), Instant::now());
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Some(part) = parts.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let (seconds, name) = seconds_of(|| solve(part));
                    println!(
                        "{name}, one of {}: {seconds:.1} s; {:.0} s in all, {:.0} s on the clock",
                        parts.len(),
                        ProcessTime::now().as_duration().as_secs_f64(),
                        began.elapsed().as_secs_f64()
                    );
                }
            });
        }
    });
}

/// Solves creepages (x, y, z) as one sweep.
pub fn solve(
    operators: &Arc<OperatorStore>,
    contact: Contact,
    creepages: &[[f64; 3]],
    target: f64,
) -> Vec<Answer> {
    let root = contact.ratio.sqrt();
    let limit = CREEPAGE * MODULUS * LENGTH * LENGTH;
    let motion = |[x, y, z]: &[f64; 3]| json!({ "creepage_x": CREEPAGE * x, "creepage_y": CREEPAGE * y, "spin_per_mm": CREEPAGE * z / LENGTH });
    let motions: Vec<_> = creepages.iter().map(motion).collect();
    let case = json!({
        "material": { "shear_modulus_mpa": MODULUS, "poisson_ratio": contact.poisson },
        "friction": { "coefficient": FRICTION },
        "contact": { "type": "ellipse", "a_mm": LENGTH * root, "b_mm": LENGTH / root },
        "load": { "normal_force_n": limit / FRICTION },
        "motion": motions,
        "solver": { "method": "boundary_element", "target_error": target },
    });
    let checked = contact::check(&case, &Limits::default()).expect("a sound case");
    let solution = match contact::solve_with(operators, &checked, &Unmonitored) {
        Ok((solution, _)) => solution,
        Err(error) if creepages.len() == 1 && target > 0.02 => {
            println!("no answer: {case}: {error}");
            return vec![[f64::NAN; 5]];
        }
        // A motion without an answer stops its sweep. Each motion is then solved separately, and a failing one with a larger target.
        Err(_) => {
            let coarser = if creepages.len() == 1 {
                2.0 * target
            } else {
                target
            };
            let each = creepages.iter();
            return each
                .flat_map(|one| solve(operators, contact, &[*one], coarser))
                .collect();
        }
    };
    let patch = &solution.patches[0];
    let answers = patch.points.iter().map(|point| {
        [
            point.force_x_n / limit,
            point.force_y_n / limit,
            point.moment_z_n_mm / (limit * LENGTH),
            point.stick_area_mm2.expect("zones") / patch.area_mm2,
            point
                .error_estimate
                .map_or(f64::INFINITY, |e| e.force_x_n / limit),
        ]
    });
    answers.collect()
}

/// Returns the folder of stored results.
pub fn folder() -> PathBuf {
    // A bench runs in the folder of its own crate.
    let folder = std::env::var_os("RAILHEAD_TABLE_FOLDER").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/table"),
        PathBuf::from,
    );
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Returns the numbers in a file, or `None` if the file cannot be read.
pub fn read(name: &str) -> Option<Vec<f64>> {
    let bytes = std::fs::read(folder().join(name)).ok()?;
    let numbers = bytes.chunks_exact(8);
    Some(
        numbers
            .map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")))
            .collect(),
    )
}

/// Writes numbers to a file atomically.
pub fn write(name: &str, numbers: &[f64]) {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    let half = folder().join(format!("{name}.part"));
    std::fs::write(&half, bytes).expect("a file");
    std::fs::rename(half, folder().join(name)).expect("a file");
}

/// Returns the largest of the errors of F_x/(μN), F_y/(μN) and M_z/(μNc).
pub fn largest_error(found: [f64; 3], answer: Answer) -> f64 {
    let errors = (0..3).map(|k| (found[k] - answer[k]).abs());
    errors.fold(0.0, f64::max)
}

/// Prints the distance of the table from the new solutions.
pub fn print_errors(what: &str, errors: Vec<f64>) {
    let at = |share: f64| quantile(errors.clone(), share);
    println!(
        "{} {what} solved anew: {:.4} in the median, {:.4} at 99 %, {:.4} at most",
        errors.len(),
        at(0.5),
        at(0.99),
        at(1.0)
    );
}
