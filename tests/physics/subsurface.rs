//! Tests of stresses below the surface: closed forms, laws, and CONTACT's stresses in the upper body.

use railhead_contact::post::subsurface::states::points;
use railhead_contact::solution::words::evolution::StressPoint;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::{assert_fault, good, with};
use crate::profile_cases::generated;
use crate::reference::{Ellipse, assert_none, read, solve};

/// Returns the stresses of a case at points, and at the worst point.
fn stresses(case: &Value) -> (Vec<StressPoint>, Option<StressPoint>) {
    let (solution, fields) = solve(case);
    let stored = fields.patches[0].points[0].subsurface.as_ref();
    let summary = solution.patches[0].points[0].subsurface.expect("asked for");
    (points(stored.expect("asked for")), summary.worst)
}

fn asking(contact: &Ellipse, subsurface: Value) -> Value {
    let mut case = contact.case(12, 16);
    case["solver"] = json!({ "target_error": 0.005 });
    case["outputs"] = json!(["resultants", "subsurface"]);
    case["subsurface"] = subsurface;
    case
}

fn components(point: &StressPoint) -> [f64; 6] {
    let s = point.stress_mpa;
    [s.xx, s.yy, s.zz, s.xy, s.xz, s.yz]
}

#[test]
fn points_under_a_wheel_are_the_same_with_and_without_other_fields() {
    let subsurface = json!({ "points_mm": [[0.0, 0.0, 1.0], [1.0, 0.5, 3.0]] });
    let mut case = with(&generated(), "/subsurface", Some(subsurface));
    let mut under = |outputs: Value| {
        case["outputs"] = outputs;
        stresses(&case).0
    };
    let alone = under(json!(["resultants", "subsurface"]));
    assert_eq!(alone.len(), 2);
    assert!(alone.iter().all(|point| point.von_mises_mpa > 0.0));
    assert_eq!(alone, under(json!(["pressure", "subsurface"])));
}

/// Below the centre of a circle without friction: σ_zz = −p0/(1 + ζ²), σ_xx = σ_yy = −p0[(1 + ν)(1 − ζ atan 1/ζ) − ½/(1 + ζ²)] (Johnson 1985, eqs.
/// 3.45).
#[test]
fn hertz_on_the_axis() {
    let contact = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(1.0, 0.28)
    };
    let depths: Vec<f64> = [0.05, 0.1, 0.3, 0.48, 0.8, 1.5, 3.0]
        .map(|d| d * contact.a_mm)
        .into();
    let line = json!({ "along_depth_at_mm": [0, 0], "depths_mm": depths });
    let (found, worst) = stresses(&asking(&contact, line));
    let p0 = contact.pressure_max();
    for point in &found {
        let zeta = point.at_mm[2] / contact.a_mm;
        let decay = 1.0 / (1.0 + zeta * zeta);
        let zz = -p0 * decay;
        let xx = -p0 * (1.28 * (1.0 - zeta * (1.0 / zeta).atan()) - 0.5 * decay);
        let expected = [xx, xx, zz, 0.0, 0.0, 0.0];
        for (found, known) in components(point).iter().zip(expected) {
            assert!(
                (found - known).abs() < 5e-3 * p0,
                "{zeta}: {point:?} {expected:?}"
            );
        }
        assert!((point.tresca_mpa - (xx - zz).abs()).abs() < 7e-3 * p0);
        assert!((point.shear_max_mpa - 0.5 * point.tresca_mpa).abs() < 1e-9);
    }
    // The largest von Mises stress of a circle, ν = 0.28: 0.629 p0 at 0.47 a.
    let worst = worst.expect("is found unless refused");
    assert!((worst.von_mises_mpa / p0 - 0.629).abs() < 8e-3, "{worst:?}");
    assert!(
        (worst.at_mm[2] / contact.a_mm - 0.47).abs() < 0.03,
        "{worst:?}"
    );
}

/// Below a patch two hundred times as wide as long: σ_xx and σ_zz of a cylinder (Johnson 1985, eqs. 4.46), with the largest shear 0.3 p0 at 0.786 a.
#[test]
fn line_contact_on_the_axis() {
    let contact = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(0.005, 0.28)
    };
    let (a, p0) = (contact.a_mm, contact.pressure_max());
    let depths: Vec<f64> = [0.1, 0.4, 0.786, 1.5].map(|d| d * a).into();
    let line = json!({ "along_depth_at_mm": [0, 0], "depths_mm": depths, "worst": false });
    let (found, worst) = stresses(&asking(&contact, line));
    assert!(worst.is_none());
    for point in &found {
        let zeta = point.at_mm[2] / a;
        let root = (1.0 + zeta * zeta).sqrt();
        let xx = -p0 * ((1.0 + 2.0 * zeta * zeta) / root - 2.0 * zeta);
        let zz = -p0 / root;
        let s = point.stress_mpa;
        assert!(
            (s.xx - xx).abs() < 1e-2 * p0 && (s.zz - zz).abs() < 1e-2 * p0,
            "{zeta}: {s:?} {xx} {zz}"
        );
    }
    assert!((found[2].shear_max_mpa / p0 - 0.300).abs() < 8e-3);
}

/// Tests that the field is in equilibrium, and that a plane below carries the forces on the surface.
#[test]
fn the_field_is_in_equilibrium() {
    let contact = Ellipse::steel(1.5, 0.3).normalised(0.5, 0.3, 0.8);
    // The quadrature points of a cell depend on the place, so that finite differences need a large step.
    let step = 0.25;
    let centre = [0.6, -1.1, 0.9];
    let mut places = Vec::new();
    for axis in 0..3 {
        for by in [-step, step] {
            let mut at = centre;
            at[axis] += by;
            places.push(at);
        }
    }
    // The quadrature points are midpoints over a square.
    let (reach, count, depth) = (48.0, 40, 4.0);
    let width = 2.0 * reach / f64::from(count);
    let at = |k: u32| -reach + width * (f64::from(k) + 0.5);
    for j in 0..count {
        places.extend((0..count).map(|i| [at(i), at(j), depth]));
    }
    for body in ["lower", "upper"] {
        let question = asking(
            &contact,
            json!({ "points_mm": places, "worst": false, "body": body }),
        );
        let (solution, fields) = solve(&question);
        let stored = fields.patches[0].points[0].subsurface.as_ref().unwrap();
        let found = points(stored);
        let change = |axis: usize| {
            let [low, high] = [0, 1].map(|k| components(&found[2 * axis + k]));
            [0, 1, 2, 3, 4, 5].map(|k| (high[k] - low[k]) / (2.0 * step))
        };
        // z points up. Depth increases downward in the lower body and upward in the upper one.
        let sign = if body == "lower" { -1.0 } else { 1.0 };
        let ([x, y], z) = ([0, 1].map(change), change(2).map(|v| sign * v));
        let size = contact.pressure_max() / contact.b_mm;
        for sum in [x[0] + y[3] + z[4], x[3] + y[1] + z[5], x[4] + y[5] + z[2]] {
            assert!(sum.abs() < 0.05 * size, "{body}: {sum} of {size}");
        }
        let mut carried = [0.0; 3];
        for point in &found[6..] {
            let s = point.stress_mpa;
            for (sum, stress) in carried.iter_mut().zip([s.xz, s.yz, s.zz]) {
                *sum += stress * width * width;
            }
        }
        // Both bodies have the same stress vector on planes of constant z: traction on the lower body along x, pressure along −z.
        let patch = &solution.patches[0];
        let point = &patch.points[0];
        let known = [point.force_x_n, point.force_y_n, -patch.normal_force_n];
        // Correction for the force outside the square: τ_xz of a tangential force F is 3F x² z/(2π r⁵), and 1.3505 F z/reach of it lies outside.
        let inside = 1.0 - 1.3505 * depth / reach;
        let found = [carried[0] / inside, carried[1] / inside, carried[2]];
        for (found, known) in found.iter().zip(known) {
            assert!(
                (found - known).abs() < 0.003 * patch.normal_force_n,
                "{body}: {carried:?} {known}"
            );
        }
    }
}

/// For the gap of two radii, CONTACT's window of 139 columns of 12/135 mm ends inside the patch, which would reach to 7.21 mm. Its contact ends
/// there. The contact of the test ends there too, because the bodies are 2 mm apart beyond it.
const WINDOW: f64 = 139.0 * 6.0 / 135.0;

/// A contact with reference stresses.
#[derive(Debug, Deserialize)]
struct StressReference {
    id: String,
    semi_axes_mm: Option<[f64; 2]>,
    gap: Option<ReferenceGap>,
    normal_force_n: f64,
    friction: f64,
    shear_modulus_mpa: f64,
    poisson_ratio: f64,
    motion: [f64; 3],
    pressure_max_mpa: f64,
    /// x, y, z, σ_xx, σ_yy, σ_zz, σ_xy, σ_xz, σ_yz, von Mises, uncertainty.
    points: Vec<[f64; 11]>,
}

#[derive(Debug, Deserialize)]
struct ReferenceGap {
    rolling_mm: f64,
    segments: Vec<[f64; 3]>,
}

impl StressReference {
    fn contact(&self) -> Value {
        if let Some([a, b]) = self.semi_axes_mm {
            return json!({ "type": "ellipse", "a_mm": a, "b_mm": b });
        }
        let gap = self.gap.as_ref().expect("an ellipse or a gap");
        // Two arcs that meet at 2 mm, the first through the origin.
        let [[_, meet, first], [_, _, second]] = gap.segments[..] else {
            panic!("two arcs")
        };
        let across = |y: f64| {
            if y <= meet {
                0.5 * y * y / first
            } else {
                let d = y - meet;
                0.5 * meet * meet / first + d * meet / first + 0.5 * d * d / second
            }
        };
        let x: Vec<f64> = (-60..=60).map(|k| f64::from(k) * WINDOW / 46.0).collect();
        let y: Vec<f64> = (0..=90).map(|k| -3.5 + 0.08 * f64::from(k)).collect();
        let height = |x: f64, y: f64| {
            let beyond = if x.abs() > 1.001 * WINDOW { 2.0 } else { 0.0 };
            across(y) + 0.5 * x * x / gap.rolling_mm + beyond
        };
        let row = |y: &f64| x.iter().map(|x| height(*x, *y)).collect::<Vec<f64>>();
        let rows: Vec<Vec<f64>> = y.iter().map(row).collect();
        json!({ "type": "gap_grid", "x_mm": x, "y_mm": y, "gap_mm": rows })
    }

    /// Returns the largest pressure inside the patch. The largest pressure of the reference's gap is the peak at the end of the window. Its middle
    /// grid, with a slightly wider window, has 1730.6 MPa.
    fn largest(&self) -> f64 {
        self.gap.as_ref().map_or(self.pressure_max_mpa, |_| 1730.6)
    }

    fn case(&self) -> Value {
        let places: Vec<[f64; 3]> = self.points.iter().map(|p| [p[0], p[1], p[2]]).collect();
        let [x, y, spin] = self.motion;
        json!({
            "material": { "shear_modulus_mpa": self.shear_modulus_mpa, "poisson_ratio": self.poisson_ratio },
            "friction": { "coefficient": self.friction },
            "contact": self.contact(),
            "load": { "normal_force_n": self.normal_force_n },
            "motion": { "creepage_x": x, "creepage_y": y, "spin_per_mm": spin },
            "outputs": ["subsurface"],
            "subsurface": { "points_mm": places, "body": "upper", "worst": false },
        })
    }
}

/// Compares every component and the von Mises stress at default settings, beyond the reference's uncertainty: within 0.3 % of the largest pressure
/// from a depth of 0.1 semi-axes, and within 0.8 % above.
#[test]
fn stresses_are_those_of_contact() {
    let mut failures = Vec::new();
    for case in read::<Vec<StressReference>>("subsurface.json") {
        let (found, _) = stresses(&case.case());
        let shallow = case.semi_axes_mm.map_or(0.4, |[a, b]| 0.1 * a.min(b));
        let mut worst = [0.0_f64; 2];
        for (point, known) in found.iter().zip(&case.points) {
            let mut errors: Vec<f64> = components(point)
                .iter()
                .zip(&known[3..9])
                .map(|(found, known)| (found - known).abs())
                .collect();
            errors.push((point.von_mises_mpa - known[9]).abs());
            let error = errors.iter().copied().fold(0.0, f64::max) - known[10];
            let deep = usize::from(known[2] > 0.99 * shallow);
            worst[deep] = worst[deep].max(error / case.largest());
        }
        println!(
            "{}: {:.4} above, {:.4} below, {} points",
            case.id,
            worst[0],
            worst[1],
            found.len()
        );
        if worst[0] > 0.008 || worst[1] > 0.003 {
            failures.push(format!("{}: {worst:.4?}", case.id));
        }
    }
    assert_none("stresses differ", &failures);
}

#[test]
fn places_are_answered_in_their_order_and_a_plane_is_a_product() {
    let contact = Ellipse::steel(1.0, 0.28).normalised(0.4, 0.0, 0.0);
    let plane = json!({ "plane": {
        "x_mm": { "from": -6, "to": 6, "points": 5 }, "y_mm": 0.5, "depths_mm": [1, 2.5]
    } });
    let (found, worst) = stresses(&asking(&contact, plane));
    let places: Vec<[f64; 3]> = found.iter().map(|point| point.at_mm).collect();
    assert_eq!(places.len(), 10);
    assert_eq!(
        (places[0], places[4], places[9]),
        ([-6.0, 0.5, 1.0], [6.0, 0.5, 1.0], [6.0, 0.5, 2.5])
    );
    let worst = worst.expect("the default");
    assert!(
        found
            .iter()
            .all(|point| point.von_mises_mpa <= worst.von_mises_mpa)
    );
    let below = json!({ "along_depth_at_mm": "worst", "depths_mm": [1, worst.at_mm[2]] });
    let (found, again) = stresses(&asking(&contact, below));
    assert_eq!(again, Some(worst));
    assert!((found[1].von_mises_mpa / worst.von_mises_mpa - 1.0).abs() < 1e-9);
}

/// Tests that no point of a dense scan has a larger von Mises stress than the worst point, for stick and slip.
#[test]
fn the_worst_point_is_worse_than_all_of_a_scan() {
    for ratio in [0.2, 0.5, 1.0, 2.0, 6.0] {
        for [x, y, spin] in [[0.0, 0.0, 0.0], [0.4, 0.2, 0.7], [3.0, 0.0, 0.0]] {
            let contact = Ellipse::steel(ratio, 0.28).normalised(x, y, spin);
            let (a, b) = (contact.a_mm, contact.b_mm);
            let axis =
                |reach: f64, points: u32| json!({ "from": -reach, "to": reach, "points": points });
            let depth = |k: u32| 0.012 * a.min(b) * 100_f64.powf(0.05 * f64::from(k));
            let depths: Vec<f64> = (0..21).map(depth).collect();
            let plane = json!({ "x_mm": axis(1.02 * a, 21), "y_mm": axis(0.95 * b, 17), "depths_mm": depths });
            let (scan, worst) = stresses(&asking(&contact, json!({ "plane": plane })));
            let most = scan
                .iter()
                .map(|point| point.von_mises_mpa)
                .fold(0.0, f64::max);
            let over = worst.expect("asked for").von_mises_mpa / most;
            println!(
                "a/b {ratio}, motion {x} {y} {spin}: {over:.5} of the largest of {}",
                scan.len()
            );
            assert!(
                over > 0.9999 && over < 1.02,
                "{ratio} {x} {y} {spin}: {over}"
            );
        }
    }
}

/// Tests that the worst point is found where friction near the surface and pressure below it are nearly as severe as each other.
#[test]
fn no_point_under_a_flange_is_worse_than_the_worst_one() {
    let example = include_str!("../../api/examples/wheel-rail.case.json");
    let mut case: Value = serde_json::from_str(example).expect("a case");
    case["contact"]["lateral_shift_mm"] = json!(-6.2);
    case["load"] = json!({ "vertical_force_n": 100_000 });
    case["solver"] = json!({ "target_error": 0.005 });
    case["outputs"] = json!(["resultants", "subsurface"]);
    case["subsurface"] = json!({ "plane": {
        "x_mm": { "from": -4, "to": 4, "points": 33 },
        "y_mm": { "from": -1.4, "to": 0.2, "points": 33 },
        "depths_mm": [0.021, 0.05, 0.1, 0.3, 0.6, 0.9, 1.3],
    } });
    let (scan, worst) = stresses(&case);
    let listed = scan.iter().map(|point| point.von_mises_mpa);
    let most = listed.fold(0.0, f64::max);
    let worst = worst.expect("asked for").von_mises_mpa;
    assert!(worst > 0.995 * most, "{worst} of {most}");
}

/// Tests that the stress at a point does not depend on the other points, to the last bit, although points are evaluated together.
#[test]
fn a_stress_does_not_depend_on_what_is_asked_beside_it() {
    let contact = Ellipse::steel(2.0, 0.28).normalised(0.4, 0.2, 0.7);
    let places: Vec<[f64; 3]> = (0..90)
        .map(|k| {
            let k = f64::from(k);
            [
                4.0 * (1.3 * k).sin(),
                3.0 * (2.1 * k).cos(),
                0.04 * 1.06_f64.powf(k),
            ]
        })
        .collect();
    let at = |places: &[[f64; 3]]| {
        stresses(&asking(
            &contact,
            json!({ "points_mm": places, "worst": false }),
        ))
        .0
    };
    let all = at(&places);
    for (k, place) in places.iter().enumerate().step_by(17) {
        assert_eq!(
            components(&at(&[*place])[0]),
            components(&all[k]),
            "{place:?}"
        );
    }
    let backward: Vec<[f64; 3]> = places.iter().rev().copied().collect();
    for (one, other) in all.iter().zip(at(&backward).iter().rev()) {
        assert_eq!(components(one), components(other));
    }
}

#[test]
fn faulty_places_are_named() {
    let mut case = good();
    case["outputs"] = json!(["subsurface"]);
    let put = |value: Value| with(&case, "/subsurface", Some(value));
    assert_fault(
        &put(json!({ "points_mm": [[0, 0, 1], [0, 0, -1]] })),
        "/subsurface/points_mm/1/2",
        &["-1"],
    );
    assert_fault(
        &put(json!({ "points_mm": [[0, 0]] })),
        "/subsurface/points_mm/0",
        &["depth"],
    );
    assert_fault(
        &put(json!({ "along_depth_at_mm": "worst" })),
        "/subsurface/depths_mm",
        &["missing"],
    );
    assert_fault(
        &put(json!({ "along_depth_at_mm": "best", "depths_mm": [1] })),
        "/subsurface/along_depth_at_mm",
        &["worst"],
    );
    let axis = json!({ "from": 0, "to": 1, "points": 1000 });
    let grid = json!({ "plane": { "x_mm": axis, "y_mm": axis, "depths_mm": [1, 2] } });
    assert_fault(&put(grid), "/subsurface", &["2000000", "1000000"]);
    let unwanted = with(&good(), "/subsurface", Some(json!({})));
    assert_fault(&unwanted, "/subsurface", &["outputs"]);
}
