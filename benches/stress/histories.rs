//! Transient rolling: random histories checked against laws.

use std::fmt::Write as _;

use railhead_contact::solution::words::answer::{PatchSolution, PointSolution, Solution};
use serde_json::{Value, json};

use crate::class::{Class, solved, tried};
use crate::examples::example;
use crate::random::Random;

const CLASSES: [Class; 7] = [
    ("creepages that change", 40, creepages),
    ("forces that change", 10, forces),
    ("shifts, then rolling", 20, shifts),
    ("friction varies along", 40, along),
    ("friction falls with slip", 40, falling),
    ("bodies differ, pressed together", 2, pressed),
    ("a wheel on a rail", 40, wheel),
];

/// Contact lengths of constant rolling after which rolling is steady. On a patch two and a half times as wide as long, the force differed from the
/// steady one by 0.003 of the limit after 4 lengths, on meshes from 12 × 16 to 40 × 54 alike, and by a twentieth of that after 6.
const LENGTHS_STEADY: f64 = 6.0;
/// Contact lengths where friction falls with slip: bounds lag by up to two contact lengths. Chosen conservatively by judgement.
const LENGTHS_FALLING: f64 = 38.0;
/// A length in mm that exceeds every patch of the wheels below. The distances are scaled to it. Chosen by judgement.
const WHEEL_PATCH: f64 = 25.0;
/// Allowed decrease of the frictional work from point to point, over friction limit times half-length and over the work so far. The work is the
/// difference of two terms that have the accuracy of forces.
const DISSIPATION: [f64; 2] = [2e-4, 0.01];
/// Allowed excess of forces over the friction limit, and allowed error of a prescribed force, relative to the limit.
const FORCES: [f64; 2] = [0.02, TARGET];

/// Target of the histories. A finer one takes seconds each.
const TARGET: f64 = 0.02;

/// Result of a history.
struct Shown {
    target_met: bool,
    /// Distance of the last point from steady rolling over the sum of their estimates, if the history ends in steady rolling.
    from_steady: Option<f64>,
}

/// Returns half the length of the patch of `class::base` in mm.
fn half_length(case: &Value) -> f64 {
    case["contact"]["a_mm"].as_f64().unwrap_or(1.0)
}

/// Returns distances in mm: some random points, then a distant one where rolling is steady.
fn distances(random: &mut Random, a: f64, first: f64) -> Vec<f64> {
    let mut all = vec![first * a];
    for _ in 0..3 + random.below(8) {
        all.push(all[all.len() - 1] + a * random.decades(0.05, 3.0));
    }
    all.push(all[all.len() - 1] + 2.0 * LENGTHS_STEADY * a);
    all
}

/// Returns random values, of which the last two are equal.
fn values(random: &mut Random, count: usize, size: f64) -> Vec<f64> {
    let mut all: Vec<f64> = (0..count).map(|_| random.between(-size, size)).collect();
    all[count - 1] = all[count - 2];
    all
}

/// Returns a creepage that causes partial slip, up to three times the creepage of saturation.
fn size(random: &mut Random) -> f64 {
    random.decades(1e-4, 0.02)
}

fn start(random: &mut Random) -> Value {
    json!(["rest", "steady"][random.below(2)])
}

fn creepages(random: &mut Random, case: &mut Value) {
    let distance = distances(random, half_length(case), 0.3);
    let count = distance.len();
    let size = size(random);
    case["motion"] = json!({
        "history": {
            "distance_mm": distance, "creepage_x": values(random, count, size),
            "creepage_y": values(random, count, size), "spin_per_mm": values(random, count, 0.1 * size),
        },
        "start": start(random),
    });
}

fn forces(random: &mut Random, case: &mut Value) {
    let distance = distances(random, half_length(case), 0.3);
    let count = distance.len();
    let limit = 0.3 * case["load"]["normal_force_n"].as_f64().unwrap_or(0.0);
    let size = limit * random.between(0.1, 0.65);
    case["motion"] = json!({
        "history": { "distance_mm": distance, "force_x_n": values(random, count, size), "force_y_n": values(random, count, size) },
        "start": "rest",
    });
}

/// Shifts back and forth without rolling, as in fretting, then rolling.
fn shifts(random: &mut Random, case: &mut Value) {
    let a = half_length(case);
    let mut distance = vec![0.0; 2 + random.below(3)];
    let still = distance.len();
    distance.extend(distances(random, a, 0.3));
    let count = distance.len();
    let slip = a * size(random);
    let of_shift = |random: &mut Random| -> Vec<f64> {
        (0..count)
            .map(|k| {
                if k < still {
                    random.between(-slip, slip)
                } else {
                    0.0
                }
            })
            .collect()
    };
    let creepage = size(random);
    case["motion"] = json!({
        "history": {
            "distance_mm": distance, "shift_x_mm": of_shift(random), "shift_y_mm": of_shift(random),
            "creepage_x": values(random, count, creepage),
        },
        "start": "rest",
    });
}

fn along(random: &mut Random, case: &mut Value) {
    creepages(random, case);
    let a = half_length(case);
    let mut x: Vec<f64> = (0..4).map(|_| a * random.between(-1.0, 8.0)).collect();
    x.sort_by(f64::total_cmp);
    x[2] = x[1];
    let mu: Vec<f64> = (0..4).map(|_| random.decades(0.02, 0.6)).collect();
    case["friction"] = json!({ "along": { "x_mm": x, "coefficient": mu } });
}

/// Creepages with a falling friction coefficient, with stability numbers from a tenth of the allowed one. Bounds lag by up to two contact lengths,
/// so that rolling becomes steady later than elsewhere.
fn falling(random: &mut Random, case: &mut Value) {
    creepages(random, case);
    let a = half_length(case);
    let b = case["contact"]["b_mm"].as_f64().unwrap_or(1.0);
    let load = case["load"]["normal_force_n"].as_f64().unwrap_or(0.0);
    let pressure = 1.5 * load / (std::f64::consts::PI * a * b);
    let (part, half_speed) = (random.between(0.05, 0.25), random.decades(30.0, 1000.0));
    // 1.7 V max|μ′| p_max/G of an exponential law.
    let of_speed = 1.7 * std::f64::consts::LN_2 * part / half_speed * pressure / 82_000.0;
    let speed = random.between(0.1, 0.95) / of_speed;
    case["friction"] = json!({
        "law": "exponential", "limit": 0.3 - part, "terms": [{ "coefficient": part, "half_speed_mm_per_s": half_speed }]
    });
    let history = &mut case["motion"]["history"];
    history["speed_mm_per_s"] = json!(speed);
    let distances = history["distance_mm"].as_array_mut().expect("distances");
    let last = distances.last().and_then(Value::as_f64).unwrap_or(0.0);
    distances.pop();
    distances.push(json!(last + 2.0 * (LENGTHS_FALLING - LENGTHS_STEADY) * a));
}

fn pressed(random: &mut Random, case: &mut Value) {
    let body = |random: &mut Random| json!({ "shear_modulus_mpa": random.decades(2e4, 2e5), "poisson_ratio": random.between(0.2, 0.4) });
    case["material"] = json!({ "upper": body(random), "lower": body(random) });
    case["motion"] = json!({ "history": { "distance_mm": 0 }, "start": "pressed" });
}

/// Creepages under one wheel in a random position, from the flange to the field side.
fn wheel(random: &mut Random, case: &mut Value) {
    creepages(random, case);
    let mut motion = case["motion"].take();
    let scale = WHEEL_PATCH / (2.0 * half_length(case));
    for distance in motion["history"]["distance_mm"]
        .as_array_mut()
        .into_iter()
        .flatten()
    {
        *distance = json!(scale * distance.as_f64().unwrap_or(0.0));
    }
    *case = example("wheel-rail-flange");
    case["contact"]["lateral_shift_mm"] = json!(random.between(-6.6, 6.0));
    case["contact"]["yaw_rad"] = json!(random.between(-0.02, 0.02));
    case["load"] = json!({ "normal_force_n": random.decades(1e4, 1.5e5) });
    case["solver"] = json!({ "target_error": TARGET });
    case["motion"] = motion;
}

/// Returns the table. Cases that failed or broke a law are listed below it.
pub fn table(seed: u64) -> String {
    let mut text = String::from(
        "## Rolling that changes\n\n*Laws*: forces are finite, and within the largest coefficient times the load; friction takes no work back; forces that are prescribed \
         are met within the target; rolling that no longer changes has the forces of the steady solver within both estimates (*steady in the end*).\n\n\
         | histories | tried | refused | solved | target met | steady in the end, of | failed |\n|---|---|---|---|---|---|---|\n",
    );
    let mut troubles = String::new();
    for class in CLASSES {
        let (mut steady, mut unsteady) = (0, Vec::new());
        let (cells, failed) = tried(class, TARGET, seed, &mut troubles, |case| {
            let Some(shown) = one(case)? else {
                return Ok(None);
            };
            match shown.from_steady {
                Some(distance) if distance > 1.0 => unsteady.push(format!(
                    "- {distance:.2} estimates from steady rolling: `{case}`\n"
                )),
                Some(_) => steady += 1,
                None => {}
            }
            Ok(Some(shown.target_met))
        });
        let ended = steady + unsteady.len();
        let _ = writeln!(text, "{cells} {steady} of {ended} | {failed} |");
        troubles.extend(unsteady);
    }
    text + "\n" + &troubles
}

/// Solves a history and checks it against the laws. Returns `None` if it was refused.
fn one(case: &Value) -> Result<Option<Shown>, String> {
    let Some((Solution { patches, .. }, _)) = solved(case)? else {
        return Ok(None);
    };
    let steady = steady(case, &patches)?;
    let mut shown = Shown {
        target_met: true,
        from_steady: None,
    };
    for (k, patch) in patches.iter().enumerate() {
        let limit = patch.normal_force_n * largest_coefficient(&case["friction"]);
        held(case, patch, limit)?;
        let met = |point: &PointSolution| point.target_met == Some(true);
        shown.target_met &= patch.points.iter().all(met);
        if let Some(known) = &steady {
            let distance = apart(
                &patch.points[patch.points.len() - 1],
                &known[k].points[0],
                limit,
            );
            shown.from_steady = Some(shown.from_steady.unwrap_or(0.0).max(distance));
        }
    }
    Ok(Some(shown))
}

/// Checks the laws of one patch with its friction limit in N.
fn held(case: &Value, patch: &PatchSolution, limit: f64) -> Result<(), String> {
    let history = &case["motion"]["history"];
    let half_length = 0.5 * (patch.extent_mm[1] - patch.extent_mm[0]);
    let mut taken = 0.0;
    for (k, point) in patch.points.iter().enumerate() {
        let force = point.force_x_n.hypot(point.force_y_n);
        if !force.is_finite() || force > (1.0 + FORCES[0]) * limit {
            return Err(format!(
                "point {k}: a force of {force} N of at most {limit} N"
            ));
        }
        let work = point
            .history
            .as_ref()
            .map_or(f64::NAN, |h| h.dissipated_n_mm);
        let allowed = DISSIPATION[0] * limit * half_length;
        if work.is_nan() || work < taken - allowed.max(DISSIPATION[1] * taken) {
            return Err(format!(
                "point {k}: friction took {work} N mm after {taken} N mm"
            ));
        }
        taken = work;
        for (name, found) in [
            ("force_x_n", point.force_x_n),
            ("force_y_n", point.force_y_n),
        ] {
            let asked = history[name][k].as_f64();
            let off = asked.map_or(0.0, |asked| (found - asked).abs());
            if off > FORCES[1] * limit {
                return Err(format!("point {k}: {name} is off by {off} N"));
            }
        }
    }
    Ok(())
}

/// Solves steady rolling with the last motion of a history, if it ends in rolling.
fn steady(case: &Value, rolled: &[PatchSolution]) -> Result<Option<Vec<PatchSolution>>, String> {
    if case["motion"]["start"] == json!("pressed") {
        return Ok(None);
    }
    let Some(last) = rolled.first().and_then(|patch| patch.points.last()) else {
        return Ok(None);
    };
    let mut steady = case.clone();
    if let Some(table) = case["friction"]["along"]["coefficient"].as_array() {
        steady["friction"] = json!({ "coefficient": table[table.len() - 1] });
    }
    steady["motion"] = json!({
        "creepage_x": last.motion.creepage_x, "creepage_y": last.motion.creepage_y, "spin_per_mm": last.motion.spin_per_mm
    });
    if let Some(speed) = case["motion"]["history"].get("speed_mm_per_s") {
        steady["motion"]["speed_mm_per_s"] = speed.clone();
    }
    Ok(solved(&steady)?.map(|(solution, _)| solution.patches))
}

/// Returns the distance between two points over the sum of both estimates.
fn apart(one: &PointSolution, other: &PointSolution, limit: f64) -> f64 {
    let estimate = |point: &PointSolution| point.error_estimate.map_or(0.0, |e| e.force_x_n);
    let off = (one.force_x_n - other.force_x_n)
        .abs()
        .max((one.force_y_n - other.force_y_n).abs());
    off / (estimate(one) + estimate(other)).max(1e-6 * limit)
}

/// Returns the largest coefficient of a table along the track, the coefficient of a law at rest, or the single coefficient.
fn largest_coefficient(friction: &Value) -> f64 {
    let terms = friction["terms"].as_array().into_iter().flatten();
    let falls: f64 = terms.filter_map(|term| term["coefficient"].as_f64()).sum();
    if let Some(limit) = friction["limit"].as_f64() {
        return limit + falls;
    }
    let table = friction["along"]["coefficient"].as_array();
    let of_table = table.map(|values| values.iter().filter_map(Value::as_f64).fold(0.0, f64::max));
    of_table
        .or(friction["coefficient"].as_f64())
        .unwrap_or(f64::NAN)
}
