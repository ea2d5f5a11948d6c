//! Tests that numbers in another unit get a remark, and that no other numbers do.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use serde_json::{Value, json};

use crate::cases::{good, good_with, problem, with};
use crate::profile_cases::generated;
use crate::reference::solve;

/// Returns pointers and likely units of the numbers that a check remarks on.
fn suspects(case: &Value) -> Vec<(String, String)> {
    let remarks = problem(case).remarks;
    let asked = remarks
        .into_iter()
        .filter(|remark| remark.code == "unit-suspected");
    asked
        .map(|remark| {
            let remark = serde_json::to_value(remark).expect("a remark");
            let text = |name: &str| remark[name].as_str().expect("a text").to_owned();
            (text("pointer"), text("likely_unit"))
        })
        .collect()
}

fn assert_suspect(case: &Value, pointer: &str, unit: &str) {
    assert_eq!(
        suspects(case),
        [(pointer.to_owned(), unit.to_owned())],
        "{case}"
    );
}

#[test]
fn a_likely_unit_is_named() {
    for (pointer, value, unit) in [
        ("/load/normal_force_n", 100.0, "kN"),
        ("/material/shear_modulus_mpa", 82.0, "GPa"),
        ("/motion/creepage_x", 0.1, "per cent"),
        ("/motion/creepage_y", -0.5, "per cent"),
    ] {
        assert_suspect(&good_with(pointer, json!(value)), pointer, unit);
    }
    let wheel = generated();
    for (pointer, value, unit) in [
        ("/load/vertical_force_n", 75.0, "kN"),
        ("/contact/yaw_rad", 0.2, "degrees"),
        ("/contact/cant_rad", 0.2, "degrees"),
    ] {
        assert_suspect(&with(&wheel, pointer, Some(json!(value))), pointer, unit);
    }
    let speed = json!({ "wheelset": { "speed_mm_per_s": 20, "free_rolling_radius_mm": 460 } });
    assert_suspect(
        &with(&wheel, "/motion", Some(speed)),
        "/motion/wheelset/speed_mm_per_s",
        "m/s or km/h",
    );
    let young = json!({ "young_modulus_mpa": 210, "poisson_ratio": 0.3 });
    assert_suspect(
        &good_with("/material", young),
        "/material/young_modulus_mpa",
        "GPa",
    );
    let sweep = json!({ "sweep": { "creepage_x": { "from": 0, "to": 1, "points": 5 } } });
    assert_suspect(
        &good_with("/motion", sweep),
        "/motion/sweep/creepage_x",
        "per cent",
    );
    for (radii, unit) in [([0.46, 0.3], "m"), ([46.0, 30.0], "cm or inch")] {
        let contact = json!({ "type": "radii", "rolling_mm": radii[0], "lateral_mm": radii[1] });
        assert_suspect(&good_with("/contact", contact), "/contact/rolling_mm", unit);
    }
    let steel = json!({
        "conductivity_w_per_mk": 50, "specific_heat_j_per_kgk": 450, "density_kg_per_m3": 7850, "bulk_c": 20
    });
    for (name, value, unit) in [
        ("conductivity_w_per_mk", 0.05, "W/(mm K)"),
        ("specific_heat_j_per_kgk", 0.45, "J/(g K)"),
        ("density_kg_per_m3", 7.85, "g/cm³"),
    ] {
        let hot = with(
            &good_with("/outputs", json!(["temperature"])),
            "/motion/speed_mm_per_s",
            Some(json!(20_000)),
        );
        let same = with(&steel, &format!("/{name}"), Some(json!(value)));
        let pair = json!({ "lower": steel, "upper": same });
        for (thermal, place) in [(&same, "/thermal"), (&pair, "/thermal/upper")] {
            let case = with(&hot, "/thermal", Some(thermal.clone()));
            assert_suspect(&case, &format!("{place}/{name}"), unit);
        }
    }
    for (name, value, unit) in [
        ("density_kg_per_m3", 7.85, "g/cm³"),
        ("hardness_mpa", 260.0, "HB or HV"),
        ("shear_yield_mpa", 0.3, "GPa"),
    ] {
        let damage = json!({ "parameters": { name: value } });
        let case = with(
            &good_with("/outputs", json!(["damage"])),
            "/damage",
            Some(damage),
        );
        assert_suspect(&case, &format!("/damage/parameters/{name}"), unit);
    }
    let ellipse = json!({ "type": "ellipse", "a_mm": 0.006, "b_mm": 0.005 });
    assert_suspect(&good_with("/contact", ellipse), "/contact/a_mm", "m");
}

#[test]
fn usual_numbers_are_not_asked_about() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../api/examples");
    for entry in std::fs::read_dir(root).expect("examples") {
        let path = entry.expect("a file").path();
        let text = std::fs::read_to_string(&path).expect("a text");
        let case: Value = serde_json::from_str(&text).expect("JSON");
        if let Ok(checked) = check(&case, &Limits::default()) {
            let code = |code: &str| checked.remarks.iter().any(|remark| remark.code == code);
            assert!(!code("unit-suspected"), "{}", path.display());
            assert!(!code("pressure-above-shakedown"), "{}", path.display());
        }
    }
    // A ball, a plastic roller, a scale model of a wheel, a slow test rig.
    for (pointer, value) in [
        (
            "/contact",
            json!({ "type": "radii", "rolling_mm": 20, "lateral_mm": 20 }),
        ),
        (
            "/material",
            json!({ "shear_modulus_mpa": 500, "poisson_ratio": 0.4 }),
        ),
    ] {
        let case = with(
            &good_with(pointer, value),
            "/load/normal_force_n",
            Some(json!(50)),
        );
        assert_eq!(suspects(&case), [], "{case}");
    }
    assert_eq!(suspects(&good()), []);
}

#[test]
fn a_pressure_above_the_shakedown_limit_is_told_once() {
    let told = |force: f64| {
        let (solution, _) = solve(&good_with("/load/normal_force_n", json!(force)));
        let code = |code: &str| solution.remarks.iter().filter(|r| r.code == code).count();
        [
            code("pressure-above-shakedown"),
            code("pressure-implausible"),
        ]
    };
    // The largest pressures are 1.23 GPa, 1.9 GPa and 5.7 GPa.
    assert_eq!(told(1e5), [0, 0]);
    assert_eq!(told(4e5), [1, 0]);
    assert_eq!(told(1e7), [0, 1]);
}
