//! Stresses below the surface, damage and heat: random cases checked against laws.

use std::fmt::Write as _;

use railhead_contact::post::subsurface::states::points;
use serde_json::{Value, json};

use crate::class::{Class, solved, tried};
use crate::random::Random;

/// A law that checks an answer to a case, given in this order. It returns a message if the law is broken.
type Law = fn(&Value, &Value) -> Result<(), String>;

const CLASSES: [(Class, Law); 3] = [
    (
        ("stresses below the surface", 300, stressed),
        stresses_are_in_balance,
    ),
    (("damage", 1500, damaged), damage_follows_its_resultants),
    (("temperature", 700, heated), heat_warms),
];

/// Half the side of the horizontal plane of stresses and its depth, in half-widths of the patch, and the number of points along a side. The fraction
/// `(depth / half side)³` of the load is outside.
const PLANE: (f64, f64, usize) = (8.0, 0.8, 49);
/// Allowed difference between sums over that plane and the load: the part outside, and the error of the trapezoidal rule.
const BALANCE: f64 = 0.01;

fn stressed(random: &mut Random, case: &mut Value) {
    contact_type(random, case);
    let (reach, depth, count) = PLANE;
    let c = half_width(case);
    let axis = json!({ "from": -reach * c, "to": reach * c, "points": count });
    case["outputs"] = json!(["subsurface"]);
    case["subsurface"] =
        json!({ "plane": { "x_mm": axis, "y_mm": axis, "depths_mm": depth * c }, "worst": true });
    if random.part() < 0.5 {
        case["subsurface"]["body"] = json!("upper");
    }
    if random.part() < 0.3 {
        case["subsurface"]["passage"] = json!({ "dang_van_slope": random.part() });
    }
}

fn damaged(random: &mut Random, case: &mut Value) {
    contact_type(random, case);
    motion_of_any_size(random, case);
    case["motion"]["speed_mm_per_s"] = json!(random.decades(10.0, 100_000.0));
    case["outputs"] = json!(["damage"]);
    case["damage"] = json!({ "across": random.part() < 0.3, "models": [
        "t_gamma", "usfd_wear", "archard_wear", "wlrm", "surface_fatigue_index", "shakedown"
    ] });
}

fn heated(random: &mut Random, case: &mut Value) {
    contact_type(random, case);
    motion_of_any_size(random, case);
    case["motion"]["speed_mm_per_s"] = json!(random.decades(100.0, 100_000.0));
    case["outputs"] = json!(["temperature"]);
    let body = |random: &mut Random| {
        json!({
            "conductivity_w_per_mk": random.decades(1.0, 400.0), "density_kg_per_m3": random.decades(1000.0, 9000.0),
            "specific_heat_j_per_kgk": random.decades(100.0, 2000.0), "bulk_c": random.between(-30.0, 80.0),
        })
    };
    case["thermal"] = if random.part() < 0.5 {
        body(random)
    } else {
        json!({ "upper": body(random), "lower": body(random) })
    };
}

fn motion_of_any_size(random: &mut Random, case: &mut Value) {
    let size = random.decades(1e-6, 0.05);
    let signed = |random: &mut Random| size * random.between(-1.0, 1.0);
    case["motion"] = json!({
        "creepage_x": signed(random), "creepage_y": signed(random), "spin_per_mm": 0.1 * signed(random)
    });
}

fn contact_type(random: &mut Random, case: &mut Value) {
    if random.part() < 0.5 {
        let radius = |random: &mut Random| random.decades(50.0, 2000.0);
        case["contact"] =
            json!({ "type": "radii", "rolling_mm": radius(random), "lateral_mm": radius(random) });
    }
}

/// Returns a length of the order of the patch in mm.
fn half_width(case: &Value) -> f64 {
    let contact = &case["contact"];
    let number = |name: &str| contact[name].as_f64();
    if let (Some(a), Some(b)) = (number("a_mm"), number("b_mm")) {
        return a.max(b);
    }
    let modulus = 82_000.0 / (1.0 - 0.28);
    let load = case["load"]["normal_force_n"].as_f64().unwrap_or(0.0);
    let radius = number("rolling_mm")
        .unwrap_or(0.0)
        .max(number("lateral_mm").unwrap_or(0.0));
    (0.75 * load * radius / modulus).cbrt()
}

fn point(answer: &Value) -> &Value {
    &answer["patches"][0]["points"][0]
}

fn held(holds: bool, what: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what()) }
}

/// Checks that the stress on a plane below carries the load, and that no point of the plane is worse than the worst point.
fn stresses_are_in_balance(answer: &Value, case: &Value) -> Result<(), String> {
    let load = case["load"]["normal_force_n"].as_f64().unwrap_or(f64::NAN);
    let places = answer["stresses"].as_array().ok_or("no stresses")?;
    let all = |pointer: &str| -> Result<Vec<f64>, String> {
        let value = |place: &Value| place.pointer(pointer).and_then(Value::as_f64);
        places
            .iter()
            .map(|place| value(place).ok_or_else(|| format!("no {pointer}")))
            .collect()
    };
    let (reach, _, count) = PLANE;
    let cell = (2.0 * reach * half_width(case) / (count - 1) as f64).powi(2);
    let carried = -cell * all("/stress_mpa/zz")?.iter().sum::<f64>();
    held((carried - load).abs() <= BALANCE * load, || {
        format!("the plane carries {carried} N of {load} N")
    })?;
    let worst = point(answer)["subsurface"]["worst"]["von_mises_mpa"]
        .as_f64()
        .ok_or("no worst point")?;
    let most = all("/von_mises_mpa")?.into_iter().fold(0.0, f64::max);
    held(most <= 1.001 * worst, || {
        format!("{most} MPa in the plane, {worst} MPa at the worst point")
    })?;
    residual_stresses_help(&point(answer)["subsurface"]["passage"])
}

/// Checks that shakedown does not need a higher yield stress in shear than elastic behaviour, within the accuracy of the worst points.
fn residual_stresses_help(passage: &Value) -> Result<(), String> {
    if passage.is_null() {
        return Ok(());
    }
    let needed = ["yield_with_residual", "yield_without_residual"]
        .map(|name| passage[name]["stress_mpa"].as_f64().unwrap_or(f64::NAN));
    held(needed[0] > 0.0 && needed[0] <= 1.02 * needed[1], || {
        format!("yield in shear with and without residual stresses: {needed:?} MPa")
    })
}

/// Checks that every figure lies in its interval, that wear is not negative, and that Tγ is the power of the resultants.
fn damage_follows_its_resultants(answer: &Value, _: &Value) -> Result<(), String> {
    let point = point(answer);
    let damage = &point["damage"];
    let power = point["friction_power_n"].as_f64().unwrap_or(f64::NAN);
    let with_spin = damage["t_gamma"]["with_spin_n"]["value"]
        .as_f64()
        .unwrap_or(f64::NAN);
    held((with_spin - power).abs() <= 1e-9 * power.abs(), || {
        format!("Tγ of {with_spin} N for a power of {power} N")
    })?;
    for (model, figures) in damage.as_object().into_iter().flatten() {
        for (name, figure) in figures.as_object().into_iter().flatten() {
            let [value, low, high] = ["value", "low", "high"].map(|key| figure[key].as_f64());
            let (Some(value), Some(low), Some(high)) = (value, low, high) else {
                continue;
            };
            held(low <= value && value <= high, || {
                format!("{model} {name}: {value} is not between {low} and {high}")
            })?;
            let wear = model.ends_with("_wear");
            held(!wear || value >= 0.0, || format!("{model} {name}: {value}"))?;
        }
    }
    Ok(())
}

/// Checks that friction heats, and that the heat is divided between the two bodies.
fn heat_warms(answer: &Value, _: &Value) -> Result<(), String> {
    let temperature = &point(answer)["temperature"];
    let number = |name: &str| {
        temperature[name]
            .as_f64()
            .ok_or_else(|| format!("no {name}"))
    };
    let (most, without) = (number("max_c")?, number("without_friction_c")?);
    held(most >= without - 1e-9 * without.abs().max(1.0), || {
        format!("{most} °C with friction, {without} °C without")
    })?;
    let share = number("heat_share_lower")?;
    held((0.0..=1.0).contains(&share), || {
        format!("a share of heat of {share}")
    })
}

/// Returns the table. Cases that failed or broke a law are listed below it.
pub fn table(seed: u64) -> String {
    let mut text = String::from(
        "## Stresses below the surface, damage, heat\n\n*Laws*: a plane below carries the load within 1 %, and no point of it is worse than the worst point; damage \
         lies in its interval, wear is not negative, Tγ is the power of the resultants; friction warms, the shares of its heat are between 0 and 1.\n\n\
         | cases | tried | refused | solved | target met | failed |\n|---|---|---|---|---|---|\n",
    );
    let mut troubles = String::new();
    for (class, law) in CLASSES {
        let (cells, failed) = tried(class, 0.005, seed, &mut troubles, |case| one(case, law));
        let _ = writeln!(text, "{cells} {failed} |");
    }
    text + "\n" + &troubles
}

/// Returns whether the target was met, or `None` if the case was refused.
fn one(case: &Value, law: Law) -> Result<Option<bool>, String> {
    let Some((solution, fields)) = solved(case)? else {
        return Ok(None);
    };
    let mut answer = serde_json::to_value(&solution).map_err(|error| error.to_string())?;
    let stored = fields
        .patches
        .first()
        .and_then(|patch| patch.points.first());
    if let Some(stored) = stored.and_then(|point| point.subsurface.as_ref()) {
        answer["stresses"] = json!(points(stored));
    }
    law(&answer, case)?;
    Ok(Some(point(&answer)["target_met"] == json!(true)))
}
