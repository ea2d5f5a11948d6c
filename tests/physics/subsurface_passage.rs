//! Tests of stress histories of points in the bodies: shakedown and Dang Van's criterion against closed forms, laws, and faults of the request.

use railhead_contact::half_space::kernels::Stress;
use railhead_contact::post::subsurface::worst_passage::{PassageMeasure, judge};
use railhead_contact::solution::words::evolution::{PassageSummary, SubsurfaceSummary};
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, with};
use crate::reference::{Ellipse, solve};

fn summary(contact: &Ellipse, subsurface: Value) -> SubsurfaceSummary {
    let mut case = contact.case(12, 16);
    case["solver"] = json!({ "target_error": 0.005 });
    case["outputs"] = json!(["subsurface"]);
    case["subsurface"] = subsurface;
    let (solution, _) = solve(&case);
    solution.patches[0].points[0].subsurface.expect("asked for")
}

fn passage(contact: &Ellipse, subsurface: Value) -> PassageSummary {
    summary(contact, subsurface).passage.expect("asked for")
}

/// Without friction, the largest shear on planes along the surface below a circle is 0.214 p0 at 0.35 a. Residual stresses do not change it, so that
/// shakedown holds up to 4.7 times the yield stress in shear (Johnson 1985, section 9.2). Nothing yields up to von Mises' 0.629 p0 over √3.
#[test]
fn a_circle_shakes_down_where_it_should() {
    let contact = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(1.0, 0.28)
    };
    let found = passage(&contact, json!({ "passage": {}, "worst": false }));
    let p0 = contact.pressure_max();
    let with = found.yield_with_residual;
    assert!((with.stress_mpa / p0 - 0.214).abs() < 2e-3, "{found:?}");
    assert!(
        (with.at_mm[1] / contact.a_mm - 0.35).abs() < 0.05,
        "{found:?}"
    );
    let without = found.yield_without_residual.stress_mpa / p0;
    assert!((without - 0.629 / 3_f64.sqrt()).abs() < 5e-3, "{found:?}");
    assert!(found.dang_van.is_none(), "{found:?}");
}

/// Returns the stresses below a rolling cylinder over p0 (M'Ewen; Johnson 1985, eqs. 4.49), with lengths over the half-width.
fn cylinder(x: f64, z: f64, nu: f64) -> Stress {
    let sum = 1.0 - x * x + z * z;
    let root = (sum * sum + 4.0 * x * x * z * z).sqrt();
    let m = (0.5 * (root + sum)).sqrt();
    let n = (0.5 * (root - sum)).max(0.0).sqrt() * x.signum();
    let part = (z * z + n * n) / (m * m + n * n);
    let xx = -(m * (1.0 + part) - 2.0 * z);
    let zz = -m * (1.0 - part);
    [
        xx,
        nu * (xx + zz),
        zz,
        0.0,
        -n * (m * m - z * z) / (m * m + n * n),
        0.0,
    ]
}

/// Shakedown needs a yield stress in shear of p0/4, at a depth of half a half-width (Johnson 1985, section 9.2), where the shear σ_xz is largest.
#[test]
fn a_rolling_cylinder_shakes_down_at_four_times_the_yield_in_shear() {
    let needed = |z: f64| {
        let x = (-800..=800).map(|k| 0.01 * f64::from(k));
        let states: Vec<Stress> = x.map(|x| cylinder(x, z, 0.3)).collect();
        judge(PassageMeasure::Shakedown, &states).stress
    };
    assert!((needed(0.5) - 0.25).abs() < 1e-4, "{}", needed(0.5));
    let depths = (2..40).map(|k| needed(0.05 * f64::from(k)));
    assert!(depths.fold(0.0, f64::max) < 0.2501);
}

/// A patch two hundred times as wide as long needs p0/4 for shakedown and has Dang Van's stress of the closed form.
#[test]
fn a_cylinder_shakes_down_where_it_should() {
    let contact = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(0.005, 0.28)
    };
    let slope = 0.3;
    let asked = json!({ "passage": { "dang_van_slope": slope }, "worst": false });
    let found = passage(&contact, asked);
    let p0 = contact.pressure_max();
    let with = found.yield_with_residual.stress_mpa / p0;
    assert!((with - 0.25).abs() < 3e-3, "{found:?}");
    let known = (1..60).map(|k| {
        let depth = 0.03 * f64::from(k);
        let x = (-300..=300).map(|k| 0.02 * f64::from(k));
        let states: Vec<Stress> = x.map(|x| cylinder(x, depth, 0.28)).collect();
        judge(PassageMeasure::DangVan(slope), &states).stress
    });
    let known = known.fold(f64::NEG_INFINITY, f64::max);
    let dang_van = found.dang_van.expect("asked for").stress_mpa / p0;
    assert!((dang_van - known).abs() < 6e-3, "{dang_van} {known}");
}

/// Tests that residual stresses help, that the mirrored contact has the same measures, that the weight of the mean stress has no effect without
/// friction because the mean stress is compressive everywhere, and that outputs that were not requested are absent.
#[test]
fn passages_obey_laws() {
    let contact = Ellipse::steel(1.5, 0.3).normalised(0.5, 0.3, 0.0);
    let asked = |slope: f64| json!({ "passage": { "dang_van_slope": slope } });
    let found = passage(&contact, asked(0.0));
    let without = found.yield_without_residual.stress_mpa;
    assert!(found.yield_with_residual.stress_mpa < without, "{found:?}");
    let shear = found.dang_van.expect("asked for").stress_mpa;
    let mirrored = Ellipse::steel(1.5, 0.3).normalised(0.5, -0.3, 0.0);
    let mirrored = passage(&mirrored, asked(0.0));
    let other = mirrored.dang_van.expect("asked for").stress_mpa;
    assert!((other / shear - 1.0).abs() < 5e-3, "{shear} {other}");
    let smooth = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(1.5, 0.3)
    };
    let [bare, pressed] = [0.0, 0.3].map(|slope| {
        let found = passage(&smooth, asked(slope)).dang_van;
        found.expect("asked for").stress_mpa
    });
    assert!(pressed <= 1.005 * bare, "{bare} {pressed}");
    assert!(summary(&contact, json!({})).passage.is_none());
}

#[test]
fn wrong_passages_are_refused() {
    let mut case = good();
    case["outputs"] = json!(["subsurface"]);
    let put = |value: Value| with(&case, "/subsurface", Some(value));
    let steep = json!({ "passage": { "dang_van_slope": 11 } });
    assert_fault(
        &put(steep),
        "/subsurface/passage/dang_van_slope",
        &["11", "10"],
    );
    for (wrong, at, words) in [
        (
            json!({ "dang_van_slope": -0.1 }),
            "/dang_van_slope",
            ["-0.1", "0"],
        ),
        (
            json!({ "dang_van_slope": "steep" }),
            "/dang_van_slope",
            ["steep", "number"],
        ),
        (
            json!({ "dang_van_slope": null }),
            "/dang_van_slope",
            ["null", "number"],
        ),
        (
            json!({ "dang_van_slope": [0.3] }),
            "/dang_van_slope",
            ["array", "number"],
        ),
        (json!(true), "", ["true", "object"]),
        (json!(0.3), "", ["0.3", "object"]),
        (json!("all"), "", ["all", "object"]),
        (json!(null), "", ["null", "object"]),
        (json!([]), "", ["array", "object"]),
    ] {
        let at = format!("/subsurface/passage{at}");
        assert_fault(&put(json!({ "passage": wrong })), &at, &words);
    }
    let unknown = json!({ "passage": { "slope": 0.3 } });
    assert_fault(
        &put(unknown),
        "/subsurface/passage/slope",
        &["dang_van_slope"],
    );
    let mut moving = put(json!({ "passage": {} }));
    moving["motion"] =
        json!({ "history": { "distance_mm": [0, 1], "creepage_x": 0.001 }, "start": "rest" });
    assert_fault(&moving, "/subsurface/passage", &["history"]);
}
