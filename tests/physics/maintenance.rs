//! Tests of damage and temperatures of solved contacts.

use railhead_contact::solution::words::answer::PointSolution;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, with};
use crate::reference::{Converged, Ellipse, SolvedEllipse, assert_none, read, solve};

const ALL_MODELS: [&str; 6] = [
    "t_gamma",
    "usfd_wear",
    "archard_wear",
    "wlrm",
    "surface_fatigue_index",
    "shakedown",
];

fn asking(outputs: Value, damage: Value) -> Value {
    let mut case = Ellipse::steel(1.5, 0.28)
        .normalised(0.5, -0.2, 0.6)
        .case(1, 1);
    case["solver"] = json!({ "target_error": 0.005 });
    case["motion"]["speed_mm_per_s"] = json!(30_000.0);
    case["outputs"] = outputs;
    case["damage"] = damage;
    case
}

fn only_point(case: &Value) -> PointSolution {
    solve(case).0.patches[0].points[0].clone()
}

/// Tests that the power without spin and its damage do not depend on the place of y = 0 in a gap.
#[test]
fn power_without_spin_does_not_depend_on_the_origin_of_a_gap() {
    let damage = |shift: f64| {
        let y: Vec<f64> = (-40..=40).map(|k| 0.5 * f64::from(k)).collect();
        let gap: Vec<f64> = y.iter().map(|y| y * y / 600.0).collect();
        let y: Vec<f64> = y.iter().map(|y| y + shift).collect();
        let mut case = asking(json!(["damage"]), json!({ "models": ["t_gamma", "wlrm"] }));
        case["contact"] =
            json!({ "type": "gap_profile", "rolling_mm": 460.0, "y_mm": y, "gap_mm": gap });
        case["load"] = json!({ "normal_force_n": 80_000.0 });
        let spin = 2.2e-4;
        case["motion"] = json!({ "creepage_x": 0.002 + spin * shift, "creepage_y": 0.0005, "spin_per_mm": spin, "speed_mm_per_s": 30_000.0 });
        let damage = *only_point(&case).damage.expect("asked for");
        let t_gamma = damage.t_gamma.expect("asked for");
        [
            t_gamma.with_spin_n,
            t_gamma.without_spin_n,
            damage.wlrm.expect("asked for").damage_per_pass,
        ]
    };
    let centred = damage(0.0);
    for shift in [20.0, -20.0] {
        for (found, expected) in damage(shift).iter().zip(centred) {
            let relative = found.value / expected.value - 1.0;
            assert!(relative.abs() < 0.002, "{shift}: {found:?}, {expected:?}");
        }
    }
}

#[test]
fn damage_follows_from_the_resultants_and_carries_their_errors() {
    let case = asking(json!(["damage"]), json!({ "models": ALL_MODELS }));
    let (solution, fields) = solve(&case);
    assert!(fields.patches.is_empty(), "nothing is kept per cell");
    let (patch, point) = (&solution.patches[0], &solution.patches[0].points[0]);
    let damage = point.damage.as_ref().expect("asked for");
    let t_gamma = damage.t_gamma.expect("asked for");
    assert_eq!(t_gamma.with_spin_n.value, point.friction_power_n);
    assert_eq!(
        t_gamma.without_spin_n.value,
        point.friction_power_without_spin_n
    );
    let error = point.error_estimate.expect("a target").force_x_n * point.motion.creepage_x.abs();
    let half = 0.5 * (t_gamma.with_spin_n.high.unwrap() - t_gamma.with_spin_n.low.unwrap());
    assert!(
        half > error && half < 0.1 * point.friction_power_n,
        "{t_gamma:?}"
    );
    // 5.3 µg/(m mm²) per N/mm², over a mean length of area/width, for a density of 7850 kg/m³.
    let wear = damage.usfd_wear.expect("asked for");
    let x = point.friction_power_n / patch.area_mm2;
    assert!(x < 10.4, "mild");
    assert!((wear.rate_ug_per_m_mm2.value / (5.3 * x) - 1.0).abs() < 1e-12);
    let width = patch.extent_mm[3] - patch.extent_mm[2];
    let depth = 5.3 * x * patch.area_mm2 / width * 1e-3 / 7850.0 * 1e6;
    assert!((wear.depth_nm.value / depth - 1.0).abs() < 1e-12);
    let archard = damage.archard_wear.expect("asked for");
    let slip = point.friction_power_n / patch.friction_limit_n.unwrap();
    assert!((archard.sliding_speed_mm_per_s / (30_000.0 * slip) - 1.0).abs() < 1e-12);
    let volume = archard.coefficient.value * point.friction_power_n / 0.3 / 2550.0 * 1e3;
    assert!((archard.volume_mm3_per_m.value / volume - 1.0).abs() < 1e-12);
    let index = damage.surface_fatigue_index.expect("asked for");
    let used = point.force_x_n.hypot(point.force_y_n) / patch.normal_force_n;
    let [a, b] = patch.semi_axes_mm.unwrap();
    let limit = 2.0 * std::f64::consts::PI * a * b * 300.0 / (3.0 * patch.normal_force_n);
    assert!((index.index.value - (used - limit)).abs() < 1e-9);
    let place = damage.shakedown.expect("asked for");
    assert!((place.load_factor - patch.pressure_max_mpa / 300.0).abs() < 1e-12);
    // The index is positive above the limit at the surface, and negative below it.
    let at_surface = place.limit < 4.0;
    assert!(!at_surface || (index.index.value > 0.0) == place.ratchets);
    let parameters = solution.damage_parameters.expect("told");
    assert_eq!(parameters.unconfirmed.len(), 4);
    let rail = damage.wlrm.expect("asked for");
    assert!(rail.damage_per_pass.low <= Some(rail.damage_per_pass.value));
}

#[test]
fn wear_across_adds_up_to_the_power_and_the_mild_wear_of_the_patch() {
    let case = asking(
        json!(["damage"]),
        json!({ "models": ALL_MODELS, "across": true }),
    );
    let point = only_point(&case);
    let damage = point.damage.expect("asked for");
    let across = damage.across.expect("asked for");
    let sum = |values: &[f64]| {
        values
            .iter()
            .zip(&across.dy_mm)
            .map(|(v, dy)| v * dy)
            .sum::<f64>()
    };
    let power = sum(&across.t_gamma_n_per_mm);
    assert!(
        (power / point.friction_power_n - 1.0).abs() < 1e-9,
        "{power}"
    );
    // Mild wear is proportional to the power, so that cells and patch agree except for cells that leave this regime.
    let usfd = sum(across.usfd_depth_nm.as_ref().expect("asked for"));
    let width: f64 = across.dy_mm.iter().sum();
    let whole = damage.usfd_wear.unwrap().depth_nm.value * width;
    assert!(
        usfd <= whole * (1.0 + 1e-9) && usfd > 0.5 * whole,
        "{usfd} {whole}"
    );
    assert!(
        across
            .archard_depth_nm
            .expect("asked for")
            .iter()
            .all(|depth| *depth >= 0.0)
    );
}

#[test]
fn figures_of_the_client_count_and_only_confirmed_models_run_unasked() {
    let plain = only_point(&asking(json!(["damage"]), json!({})));
    let damage = plain.damage.expect("asked for");
    assert!(damage.t_gamma.is_some() && damage.usfd_wear.is_some());
    assert!(damage.wlrm.is_none() && damage.archard_wear.is_none() && damage.shakedown.is_none());
    let t_gamma = damage.t_gamma.unwrap().without_spin_n.value;
    let own = json!({ "models": ["wlrm"], "parameters": {
        "wlrm": { "threshold_n": 0.25 * t_gamma, "peak_at_n": 2.25 * t_gamma, "zero_at_n": 1e4 * t_gamma, "peak": 8e-6 }
    } });
    let (solution, _) = solve(&asking(json!(["damage"]), own));
    let rail = solution.patches[0].points[0]
        .damage
        .as_ref()
        .unwrap()
        .wlrm
        .unwrap();
    assert!(
        (rail.damage_per_pass.value / 3e-6 - 1.0).abs() < 1e-3,
        "{rail:?}"
    );
    assert!(solution.damage_parameters.unwrap().unconfirmed.is_empty());
}

#[test]
fn what_damage_and_heat_need_is_named() {
    let mut case = good();
    case["outputs"] = json!(["damage"]);
    case["damage"] = json!({ "models": ["archard_wear"] });
    assert_fault(&case, "/motion/speed_mm_per_s", &["archard_wear", "mm/s"]);
    case["damage"] = json!({ "models": ["archard"] });
    assert_fault(&case, "/damage/models/0", &["archard_wear"]);
    case["damage"] = json!({ "parameters": "steel" });
    assert_fault(&case, "/damage/parameters", &["900a-r8t-1"]);
    let mut case = good();
    case["outputs"] = json!(["temperature"]);
    assert_fault(&case, "/thermal", &["missing"]);
    assert_fault(
        &with(&good(), "/damage", Some(json!({}))),
        "/damage",
        &["outputs"],
    );
}

#[test]
fn what_is_not_asked_for_costs_nothing() {
    let plain = only_point(&asking(
        json!(["resultants", "damage"]),
        json!({ "models": ALL_MODELS }),
    ));
    let mut bare = asking(json!(["resultants"]), json!({}));
    bare.as_object_mut().unwrap().remove("damage");
    let bare = only_point(&bare);
    assert_eq!(plain.solver.products, bare.solver.products);
    assert_eq!(plain.force_x_n.to_bits(), bare.force_x_n.to_bits());
    assert!(bare.damage.is_none() && bare.temperature.is_none() && bare.subsurface.is_none());
}

/// A contact with a reference temperature.
#[derive(Debug, Deserialize)]
struct HeatReference {
    #[serde(flatten)]
    contact: SolvedEllipse,
    motion: [f64; 3],
    speed_mm_per_s: f64,
    conductivity_w_per_mk: f64,
    density_kg_per_m3: f64,
    specific_heat_j_per_kgk: f64,
    bulk_upper_c: f64,
    bulk_lower_c: f64,
    max_c: Converged,
}

impl HeatReference {
    fn case(&self) -> Value {
        let [x, y, spin] = self.motion;
        let body = |bulk: f64| {
            json!({
                "conductivity_w_per_mk": self.conductivity_w_per_mk, "density_kg_per_m3": self.density_kg_per_m3,
                "specific_heat_j_per_kgk": self.specific_heat_j_per_kgk, "bulk_c": bulk
            })
        };
        let motion = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin, "speed_mm_per_s": self.speed_mm_per_s });
        let mut case = self.contact.case(&motion);
        case["outputs"] = json!(["temperature"]);
        case["thermal"] =
            json!({ "lower": body(self.bulk_lower_c), "upper": body(self.bulk_upper_c) });
        case
    }
}

#[test]
fn the_highest_temperature_is_that_of_contact() {
    let mut failures = Vec::new();
    for case in read::<Vec<HeatReference>>("temperature.json") {
        let (solution, fields) = solve(&case.case());
        let found = solution.patches[0].points[0]
            .temperature
            .expect("asked for");
        let error = (found.max_c - case.max_c.value).abs() - case.max_c.unc;
        println!(
            "{}: {} of {}",
            case.contact.id, found.max_c, case.max_c.value
        );
        if error > 0.02 * case.max_c.value {
            failures.push(format!(
                "{}: {found:?} of {}",
                case.contact.id, case.max_c.value
            ));
        }
        let cells = fields.patches[0].points[0]
            .temperature_c
            .as_ref()
            .expect("kept");
        let least = cells.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least >= found.without_friction_c - 1e-9 && found.peclet > 10.0);
        assert!((found.heat_share_lower - 0.5).abs() < 1e-12);
    }
    assert_none("temperatures differ", &failures);
}

#[test]
fn a_contact_too_slow_for_its_temperatures_is_told() {
    let told = |speed: f64| {
        let reference = &read::<Vec<HeatReference>>("temperature.json")[0];
        let mut case = reference.case();
        case["motion"]["speed_mm_per_s"] = json!(speed);
        let (solution, _) = solve(&case);
        let peclet = solution.patches[0].points[0]
            .temperature
            .expect("asked for")
            .peclet;
        let remarks = &solution.remarks;
        (
            peclet,
            remarks.iter().any(|remark| remark.code == "heat-spreads"),
        )
    };
    let (fast, said) = told(30_000.0);
    assert!(fast > 10.0 && !said);
    let (slow, said) = told(1.0);
    assert!(slow < 10.0 && said);
}
