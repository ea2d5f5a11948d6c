//! Tests of the contact of a wheel on the reference curve of its rail: against CONTACT with curved contact surfaces, against boundary elements, and
//! against planes where the rail is straight.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::profile_reference_files::reference_file;

const RAIL: &str = include_str!("../../src/contact/examples/60e1.txt");
const WHEEL: &str = include_str!("../../src/contact/examples/s1002.txt");

fn solve(case: &Value) -> Solution {
    let checked = check(case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (solution, _) = railhead_contact::solve(&checked, &Unmonitored).unwrap();
    solution
}

fn states() -> Vec<Value> {
    let text = include_str!("../data/conformal.json");
    let all: Value = serde_json::from_str(text).unwrap();
    all["states"].as_array().unwrap().clone()
}

/// Returns points of an arc about `(0, centre)` from one angle to another, with z down.
fn arc(centre: f64, radius: f64, [from, to]: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let at = |k: usize| from + (to - from) * k as f64 / count as f64;
    let points = (0..=count).map(|k| [radius * at(k).sin(), centre - radius * at(k).cos()]);
    points.collect()
}

/// Returns a gauge corner of radius 12.7 mm next to a crown of radius 300 mm.
fn gauge_corner() -> Vec<[f64; 2]> {
    let mut points = arc(12.7, 12.7, [-1.35, 0.0], 200);
    let [y, z] = points[0];
    let face = (1..=15).rev().map(|k| {
        let down = f64::from(k);
        [y - down * 1.35_f64.cos(), z + down * 1.35_f64.sin()]
    });
    points.splice(0..0, face);
    points.extend((1..=160).map(|k| {
        let y = 0.25 * f64::from(k);
        [y, y * y / 600.0]
    }));
    points
}

/// Returns a flange root of this radius, next to a tread that slopes away.
fn flange_root(radius: f64) -> Vec<[f64; 2]> {
    let mut points = arc(radius, radius, [-1.3, 0.0], 200);
    let [y, z] = points[0];
    let face = (1..=8).rev().map(|k| {
        let down = f64::from(k);
        [y - down * 1.3_f64.cos(), z + down * 1.3_f64.sin()]
    });
    points.splice(0..0, face);
    points.extend((1..=120).map(|k| {
        let y = 0.375 * f64::from(k);
        [
            y,
            if y < 15.0 {
                -y * y / 600.0
            } else {
                -0.05 * y + 0.375
            },
        ]
    }));
    points
}

/// Returns a groove of this radius in a flat rail.
fn groove(radius: f64) -> Vec<[f64; 2]> {
    let floor = |k: i32| {
        let y = 0.1 * f64::from(k);
        let down = radius * radius - y * y;
        [
            y,
            if down > 0.0 {
                down.sqrt() - radius
            } else {
                -radius
            },
        ]
    };
    (-206..=206).map(floor).collect()
}

/// Returns a wheel whose tread is a semicircle of radius 10 mm.
fn round_wheel() -> Vec<[f64; 2]> {
    let tread = |k: i32| {
        let y = 0.1 * f64::from(k);
        [y, (100.0 - y * y).sqrt() - 10.0]
    };
    (-99..=99).map(tread).collect()
}

/// Returns the section of a state: a generated shape, or a file next to the checkout.
fn section(file: &str) -> Option<Value> {
    let points = |points: Vec<[f64; 2]>| {
        Some(json!({ "points_mm": points, "mirror_y": false, "mirror_z": false }))
    };
    match file {
        "gc_r12.7.prr" => points(gauge_corner()),
        "fr_r13.0.prw" => points(flange_root(13.0)),
        "fr_r13.3.prw" => points(flange_root(13.3)),
        "groove_r1025.prr" => points(groove(10.25)),
        "circ_r10.prw" => points(round_wheel()),
        file => {
            let text = reference_file(&format!("extended/profiles/{file}"))?;
            Some(json!({ "format": "simpack", "text": text }))
        }
    }
}

/// Returns the case of a state on the curve of its rail, or `None` if its sections are not available.
fn case_of(state: &Value, influence: &str) -> Option<Value> {
    let mut contact = state["contact"].clone();
    contact["type"] = json!("profiles");
    contact["rail"] = section(state["rail_file"].as_str()?)?;
    contact["wheel"] = section(state["wheel_file"].as_str()?)?;
    contact["accept_rough_profiles"] = json!(true);
    contact["reference_surface"] = json!("curve");
    contact["influence"] = json!(influence);
    Some(json!({
        "material": { "shear_modulus_mpa": state["shear_modulus_mpa"], "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": contact,
        "load": { "vertical_force_n": state["vertical_force_n"] },
        "motion": { "wheelset": {
            "speed_mm_per_s": state["speed_mm_per_s"],
            "angular_velocity_rad_per_s": state["angular_velocity_rad_per_s"]
        } },
        "solver": { "target_error": 0.005 },
        "outputs": ["resultants"]
    }))
}

fn limit(solution: &Solution) -> f64 {
    0.3 * solution
        .patches
        .iter()
        .map(|p| p.normal_force_n)
        .sum::<f64>()
}

fn pressure(solution: &Solution) -> f64 {
    let pressures = solution.patches.iter().map(|p| p.pressure_max_mpa);
    pressures.fold(0.0, f64::max)
}

/// The steep state under 5 GPa is left out: there CONTACT takes the normal 0.1 mm from the place where the bodies are pressed together, which
/// changes the lateral force by 3.6 % of μN.
#[test]
fn half_spaces_on_the_curve_agree_with_conformal_contact() {
    let mut compared = 0;
    for state in states()
        .iter()
        .filter(|s| s["id"] != "mb_y7.0_75kN_yaw16.8")
    {
        let Some(case) = case_of(state, "half_space") else {
            continue;
        };
        let (id, known) = (&state["id"], &state["half_space"]);
        let solution = solve(&case);
        let (total, limit) = (&solution.total[0], limit(&solution));
        for (name, found) in [
            ("force_x_n", total.force_x_n),
            ("force_y_n", total.force_y_n),
        ] {
            let [value, unc] = ["value", "unc"].map(|part| known[name][part].as_f64().unwrap());
            let off = (found - value).abs();
            assert!(
                off < 0.01 * limit + unc,
                "{id} {name}: {found} {value}, μN {limit}"
            );
        }
        let load = state["vertical_force_n"].as_f64().unwrap();
        assert!(
            (total.force_z_n.unwrap() / -load - 1.0).abs() < 6e-4,
            "{id}: {:?}",
            total.force_z_n
        );
        let known_pressure = known["pressure_max_mpa"].as_f64().unwrap();
        assert!(
            (pressure(&solution) / known_pressure - 1.0).abs() < 0.02,
            "{id}"
        );
        // Lobes of one patch in the reference may be separate patches here.
        let forces = known["patch_forces_n"].as_array().unwrap();
        let all: f64 = forces.iter().map(|force| force.as_f64().unwrap()).sum();
        let found: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
        assert!((found - all).abs() < 0.01 * load, "{id}: {found} {all}");
        for force in forces.iter().filter(|_| forces.len() > 1) {
            let force = force.as_f64().unwrap();
            let nearest = |p: &f64| (p - force).abs();
            let patches = solution.patches.iter().map(|p| p.normal_force_n);
            let off = patches.map(|p| nearest(&p)).fold(f64::INFINITY, f64::min);
            assert!(off < 0.01 * load, "{id}: no patch with {force} N");
        }
        compared += 1;
    }
    assert!(compared >= 3, "the states on made profiles need no file");
}

#[test]
fn the_factors_for_the_turn_give_the_forces_of_boundary_elements() {
    let mut compared = 0;
    for state in states() {
        let Some(exact) = state.get("boundary_elements") else {
            continue;
        };
        let Some(case) = case_of(&state, "angle_corrected") else {
            continue;
        };
        let solution = solve(&case);
        let (total, limit) = (&solution.total[0], limit(&solution));
        let estimate = total.error_estimate.unwrap();
        for (name, found, estimate) in [
            ("force_x_n", total.force_x_n, estimate.force_x_n),
            ("force_y_n", total.force_y_n, estimate.force_y_n),
        ] {
            let off = (found - exact[name].as_f64().unwrap()).abs() / limit;
            assert!(off < 0.02, "{} {name}: {off}", state["id"]);
            let estimate = estimate / limit;
            assert!(
                off < estimate,
                "{} {name}: {off}, {estimate} estimated",
                state["id"]
            );
        }
        compared += 1;
    }
    assert!(compared >= 1, "the state on made profiles needs no file");
}

/// Tests Li's grooves (CONTACT's conformal example). The closer the wheel fits, the less half-spaces with and without factors agree.
#[test]
fn grooves_have_the_pressures_and_approaches_of_conformal_contact() {
    let state = states()
        .into_iter()
        .find(|s| s["id"] == "groove_r10.25_10kN")
        .unwrap();
    for (radius, pressures, approach) in [
        (10.25, [530.2, 520.6], 0.02237),
        (10.1, [409.3, 397.6], 0.01939),
        (10.05, [348.7, 336.1], 0.01743),
        (10.02, [296.8, 283.6], 0.01541),
    ] {
        for (influence, known) in ["half_space", "angle_corrected"].into_iter().zip(pressures) {
            let mut case = case_of(&state, influence).unwrap();
            let floor =
                json!({ "points_mm": groove(radius), "mirror_y": false, "mirror_z": false });
            case["contact"]["rail"] = floor;
            let solution = solve(&case);
            let found = pressure(&solution);
            assert!(
                (found / known - 1.0).abs() < 0.02,
                "{radius} {influence}: {found} {known}"
            );
            if influence == "half_space" {
                let found = solution.wheel_lowering_mm.unwrap();
                assert!(
                    (found / approach - 1.0).abs() < 0.01,
                    "{radius}: {found} {approach}"
                );
            }
        }
    }
}

/// Returns S1002 on 60E1 without inclination, right wheel.
fn usual(surface: &str, shift: f64, yaw: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "profiles",
            "rail": { "format": "columns", "text": RAIL },
            "wheel": { "format": "columns", "text": WHEEL },
            "side": "right",
            "rolling_radius_mm": 460,
            "cant_rad": 0.025,
            "lateral_shift_mm": shift,
            "yaw_rad": yaw,
            "reference_surface": surface
        },
        "load": { "vertical_force_n": 75e3 },
        "motion": { "wheelset": { "speed_mm_per_s": 20e3, "free_rolling_radius_mm": 460.3 } },
        "solver": { "target_error": 0.005 },
        "outputs": ["resultants"]
    })
}

fn mirrored(case: &Value) -> Value {
    let mut case = case.clone();
    let contact = &mut case["contact"];
    contact["side"] = json!("left");
    for name in ["lateral_shift_mm", "yaw_rad"] {
        contact[name] = json!(-contact[name].as_f64().unwrap());
    }
    case
}

/// Returns a wheel with a lateral radius of 300 mm on a flat rail, where the curve is a plane. Only the wheel is curved, so that half of its
/// rotation and half of the loss of rolling radius across the contact count: 2e-5 of creepage, against a creepage of 1e-3.
fn flat(surface: &str, influence: Option<&str>) -> Value {
    let section = |of: fn(f64) -> f64| -> Vec<[f64; 2]> {
        let y = (-80..=80).map(|k| 0.25 * f64::from(k));
        y.map(|y| [y, of(y)]).collect()
    };
    let mut case = usual(surface, 0.0, 0.001);
    let contact = &mut case["contact"];
    for (body, points) in [
        ("rail", section(|_| 0.0)),
        ("wheel", section(|y| -y * y / 600.0)),
    ] {
        contact[body] = json!({ "points_mm": points, "mirror_y": false, "mirror_z": false });
    }
    contact["rail_origin_mm"] = json!(0.0);
    contact["cant_rad"] = json!(0.0);
    contact["flange_back_distance_mm"] = json!(0.0);
    contact["flange_back_position_mm"] = json!(0.0);
    contact["accept_rough_profiles"] = json!(true);
    if let Some(influence) = influence {
        contact["influence"] = json!(influence);
    }
    case
}

#[test]
fn a_flat_rail_has_the_forces_of_a_plane() {
    let plane = solve(&flat("plane", None));
    let limit = limit(&plane);
    for (influence, allowed) in [("half_space", 0.006), ("angle_corrected", 0.008)] {
        let curve = solve(&flat("curve", Some(influence)));
        let (found, known) = (&curve.total[0], &plane.total[0]);
        for (found, known) in [
            (found.force_x_n, known.force_x_n),
            (found.force_y_n, known.force_y_n),
            (found.force_z_n.unwrap(), known.force_z_n.unwrap()),
        ] {
            assert!(
                (found - known).abs() < allowed * limit,
                "{influence}: {found} {known}, μN {limit}"
            );
        }
        let places = [&curve, &plane].map(|s| s.patches[0].position.unwrap().contact_angle_rad);
        assert!((places[0] - places[1]).abs() < 1e-6, "{places:?}");
        assert!((pressure(&curve) / pressure(&plane) - 1.0).abs() < 0.005);
        let lowering = [&curve, &plane].map(|s| s.wheel_lowering_mm.unwrap());
        assert!(
            (lowering[0] / lowering[1] - 1.0).abs() < 0.003,
            "{lowering:?}"
        );
    }
}

/// Returns the case with a wheel of this shear modulus and Poisson's ratio on a steel rail. The load gives about the patch of steel bodies under 75
/// kN.
fn soft(case: &Value, [modulus, poisson_ratio]: [f64; 2]) -> Value {
    let mut case = case.clone();
    let steel = [82_000.0, 0.28];
    let body = |[modulus, poisson_ratio]: [f64; 2]| json!({ "shear_modulus_mpa": modulus, "poisson_ratio": poisson_ratio });
    case["material"] = json!({ "upper": body([modulus, poisson_ratio]), "lower": body(steel) });
    let compliance = (1.0 - poisson_ratio) / modulus + (1.0 - steel[1]) / steel[0];
    let load = 75e3 * 2.0 * (1.0 - steel[1]) / steel[0] / compliance;
    case["load"] = json!({ "vertical_force_n": load });
    case
}

/// Moduli and Poisson's ratios of aluminium, rubber and a wheel without lateral contraction: K = 0.10, 0.10 and 0.25.
const SOFT: [[f64; 2]; 3] = [[23_000.0, 0.31], [800.0, 0.4], [800.0, 0.25]];

/// Tests that dissimilar bodies change the forces of a wheel as they change those of its patch given by radii.
#[test]
fn differing_bodies_change_forces_as_they_do_by_radii() {
    let like = |case: &Value| {
        let mut case = case.clone();
        let body = json!({ "shear_modulus_mpa": 1585.0, "poisson_ratio": 0.25 });
        case["material"] = body;
        case
    };
    for (influence, creepages) in [
        ("angle_corrected", [0.0, 0.0]),
        ("angle_corrected", [0.001, 0.0]),
        ("half_space", [0.0, 0.001]),
    ] {
        let mut case = soft(&flat("curve", Some(influence)), SOFT[2]);
        let load = case["load"]["vertical_force_n"].clone();
        case["motion"] =
            json!({ "creepage_x": creepages[0], "creepage_y": creepages[1], "spin_per_mm": 0.0 });
        let radii = json!({
            "material": case["material"], "friction": case["friction"], "motion": case["motion"],
            "contact": { "type": "radii", "rolling_mm": 460.0, "lateral_mm": 300.0 },
            "load": { "normal_force_n": load },
            "solver": { "target_error": 0.005 },
        });
        let change = |case: &Value| {
            let [one, other] = [case.clone(), like(case)].map(|case| solve(&case));
            let limit = limit(&one);
            let [one, other] = [one, other].map(|solution| {
                let point = &solution.patches[0].points[0];
                [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
            });
            [0, 1, 2].map(|k| (one[k] - other[k]) / limit)
        };
        let (found, known) = (change(&case), change(&radii));
        assert!(known.iter().any(|change| change.abs() > 0.02), "{known:?}");
        for k in [0, 1] {
            assert!((found[k] - known[k]).abs() < 0.006, "{found:?} {known:?}");
        }
        assert!(
            (found[2] - known[2]).abs() < 0.05 + 0.05 * known[2].abs(),
            "{found:?} {known:?}"
        );
    }
}

/// Tests a gauge corner with dissimilar wheel and rail: the other side has mirrored forces, and the coupling iteration converges.
#[test]
fn rounds_of_differing_bodies_end_at_a_gauge_corner() {
    for body in SOFT {
        for (shift, influence) in [
            (-6.0, "angle_corrected"),
            (-6.2, "half_space"),
            (-5.0, "angle_corrected"),
        ] {
            let mut right = soft(&usual("curve", shift, 0.003), body);
            right["contact"]["influence"] = json!(influence);
            let (right, left) = (solve(&right), solve(&mirrored(&right)));
            let limit = limit(&right);
            let [r, l] = [&right, &left].map(|s| s.total[0]);
            assert!((r.force_x_n - l.force_x_n).abs() < 5e-4 * limit);
            assert!((r.force_y_n + l.force_y_n).abs() < 5e-4 * limit);
            assert!(
                right
                    .remarks
                    .iter()
                    .all(|remark| remark.code != "iteration-inexact")
            );
        }
    }
}

/// Tests that two bodies of one material are treated as like bodies, however they are given.
#[test]
fn two_bodies_of_one_material_are_like_bodies() {
    let alike = usual("curve", -6.0, 0.003);
    let mut pair = alike.clone();
    let steel = alike["material"].clone();
    pair["material"] = json!({ "upper": steel, "lower": steel });
    assert_eq!(solve(&alike).total, solve(&pair).total);
}

#[test]
fn the_left_wheel_is_the_mirror_image_of_the_right_one() {
    let right = usual("curve", -6.0, 0.003);
    let (right, left) = (solve(&right), solve(&mirrored(&right)));
    let limit = limit(&right);
    let [r, l] = [&right, &left].map(|s| s.total[0]);
    assert!((r.force_x_n - l.force_x_n).abs() < 2e-4 * limit);
    assert!((r.force_y_n + l.force_y_n).abs() < 2e-4 * limit);
    assert_eq!(right.patches.len(), left.patches.len());
}

/// Tests equivalent loads, and creepages in place of the wheelset's motion.
#[test]
fn loads_and_motions_may_be_given_in_every_way() {
    let vertical = usual("curve", -6.0, 0.003);
    let known = solve(&vertical);
    let limit = limit(&known);
    let forces = |solution: &Solution| {
        let total = &solution.total[0];
        [total.force_x_n, total.force_y_n, total.force_z_n.unwrap()]
    };
    let normal: f64 = known.patches.iter().map(|p| p.normal_force_n).sum();
    for load in [
        json!({ "normal_force_n": normal }),
        json!({ "approach_mm": known.wheel_lowering_mm }),
    ] {
        let mut case = vertical.clone();
        case["load"] = load;
        let found = solve(&case);
        for (found, known) in forces(&found).into_iter().zip(forces(&known)) {
            assert!((found - known).abs() < 3e-3 * limit, "{found} {known}");
        }
    }
    // The wheel rotates about more axes than the normal, which creepages at one place do not describe.
    let mut case = vertical.clone();
    case["motion"] = serde_json::to_value(known.patches[0].points[0].motion).unwrap();
    let found = solve(&case);
    for (found, known) in forces(&found).into_iter().zip(forces(&known)) {
        assert!((found - known).abs() < 0.02 * limit, "{found} {known}");
    }
}

/// Tests that the forces of neighbouring shifts deviate from a line by no more than their errors, on the tread and where the load passes from tread
/// to gauge corner.
#[test]
fn forces_do_not_jump_from_one_shift_to_the_next() {
    for (first, count) in [(-3.0, 8), (-4.9, 12)] {
        let forces: Vec<[f64; 2]> = (0..count)
            .map(|k| {
                let solution = solve(&usual("curve", first - 0.05 * f64::from(k), 0.003));
                let limit = limit(&solution);
                let total = &solution.total[0];
                [total.force_x_n / limit, total.force_y_n / limit]
            })
            .collect();
        for three in forces.windows(3) {
            for k in [0, 1] {
                let bend = three[0][k] - 2.0 * three[1][k] + three[2][k];
                assert!(bend.abs() < 0.004, "{forces:?}");
            }
        }
    }
}

#[test]
fn fields_lie_about_the_load_centres_and_carry_the_forces() {
    let mut case = usual("curve", -6.0, 0.003);
    case["outputs"] = json!(["resultants", "zones", "tractions", "pressure", "slip"]);
    let checked = check(&case, &Limits::default()).unwrap();
    let (solution, fields) = railhead_contact::solve(&checked, &Unmonitored).unwrap();
    for (patch, fields) in solution.patches.iter().zip(&fields.patches) {
        let (cells, point) = (fields.cells(0), &fields.points[0]);
        let pressure = cells.pressure_mpa.as_ref().unwrap();
        let (x, y) = (
            point.traction_x_mpa.as_ref().unwrap(),
            point.traction_y_mpa.as_ref().unwrap(),
        );
        assert!(point.slip_x.is_some() && point.zone.is_some());
        let (mut load, mut moment) = (0.0, [0.0; 2]);
        for i in 0..pressure.len() {
            let part = pressure[i] * cells.dx_mm[i] * cells.dy_mm[i];
            load += part;
            moment = [
                moment[0] + part * cells.x_mm[i],
                moment[1] + part * cells.y_mm[i],
            ];
            assert!(x[i].hypot(y[i]) <= 0.3 * pressure[i] * 1.000_001);
        }
        assert!((load / patch.normal_force_n - 1.0).abs() < 1e-6);
        assert!(
            moment[0].abs() < 0.05 * load && moment[1].abs() < 0.05 * load,
            "{moment:?}"
        );
    }
    assert!(solution.patches[0].points[0].slip_area_mm2.unwrap() > 0.0);
}

#[test]
fn what_is_not_solved_on_the_curve_is_refused() {
    let case = usual("curve", 0.0, 0.0);
    let with = |pointer: &str, value: Value| crate::cases::with(&case, pointer, Some(value));
    assert_fault(
        &with("/solver", json!({ "method": "table" })),
        "/solver/method",
        &["boundary_element"],
    );
    let plane = usual("plane", 0.0, 0.0);
    let influence = crate::cases::with(&plane, "/contact/influence", Some(json!("half_space")));
    assert_fault(&influence, "/contact/influence", &["curve"]);
}

/// Returns a history of creepages and shifts, with steps without rolling at rest and during rolling.
fn history(creepages: [f64; 3]) -> Value {
    let [x, y, spin] = creepages;
    json!({ "history": {
        "distance_mm": [0.0, 2.0, 2.0, 5.0, 30.0, 90.0],
        "shift_x_mm": [0.002, 0.0, 0.0, 0.0, 0.0, 0.0],
        "shift_y_mm": [0.0, 0.0, 1.5 * y, 0.0, 0.0, 0.0],
        "turn_rad": [0.0, 0.0, 2.0 * spin, 0.0, 0.0, 0.0],
        "creepage_x": x, "creepage_y": y, "spin_per_mm": spin
    } })
}

/// Returns the longitudinal, lateral and vertical forces at every point of a history.
fn forces_of(solution: &Solution) -> Vec<[f64; 3]> {
    let totals = solution.total.iter();
    totals
        .map(|total| [total.force_x_n, total.force_y_n, total.force_z_n.unwrap()])
        .collect()
}

#[test]
fn a_history_on_a_flat_rail_has_the_forces_of_a_plane() {
    let motion = history([0.0008, 0.0005, 2e-4]);
    let on = |surface: &str, influence: Option<&str>, body: Option<[f64; 2]>| {
        let mut case = flat(surface, influence);
        if let Some(body) = body {
            case = soft(&case, body);
        }
        case["motion"] = motion.clone();
        solve(&case)
    };
    for body in [None, Some(SOFT[1])] {
        let plane = on("plane", None, body);
        let limit = limit(&plane);
        // On planes, the tractions of dissimilar bodies do not change the pressures.
        let allowed = if body.is_some() { 0.01 } else { 0.005 };
        for influence in ["half_space", "angle_corrected"] {
            let curve = on("curve", Some(influence), body);
            let told = |code: &str| curve.remarks.iter().any(|remark| remark.code == code);
            // The pressures belong to the tractions of the last point.
            assert!(!told("coupling-first-order"));
            for (found, known) in forces_of(&curve).iter().zip(&forces_of(&plane)) {
                for k in 0..3 {
                    let off = (found[k] - known[k]).abs() / limit;
                    assert!(off < allowed, "{influence} {k}: {found:?} {known:?} {off}");
                }
            }
        }
    }
}

#[test]
fn the_history_of_the_left_wheel_is_the_mirror_image_of_the_right_one() {
    let corner = usual("curve", -6.0, 0.003);
    // A light patch on the tread next to a heavy one at the gauge corner.
    let mut unequal = usual("curve", -4.5, 0.0);
    unequal["load"] = json!({ "approach_mm": 0.12 });
    for (mut right, patches) in [(corner, 1), (unequal, 2)] {
        right["motion"] = history([0.0008, 0.001, 2e-4]);
        let mut left = mirrored(&right);
        left["motion"] = history([0.0008, -0.001, -2e-4]);
        let (right, left) = (solve(&right), solve(&left));
        assert_eq!(right.patches.len(), patches);
        let limit = limit(&right);
        for (r, l) in forces_of(&right).iter().zip(&forces_of(&left)) {
            assert!((r[0] - l[0]).abs() < 2e-4 * limit, "{r:?} {l:?}");
            assert!((r[1] + l[1]).abs() < 2e-4 * limit, "{r:?} {l:?}");
            assert!((r[2] - l[2]).abs() < 2e-4 * limit, "{r:?} {l:?}");
        }
    }
}

/// Tests that a history of one motion at a gauge corner has the steady forces of the curve, from the start or in the end. A plane gives other
/// forces. With factors for the curvature, the tractions change the pressures, which the estimate of the history includes.
#[test]
fn a_history_at_a_gauge_corner_has_the_steady_forces_of_the_curve() {
    let [x, y, spin] = [0.0006, 0.001, 4e-4];
    let steadily = json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin });
    let mut from_steady = history([x, y, spin]);
    from_steady["history"]["distance_mm"] = json!([0.0, 5.0]);
    for name in ["shift_x_mm", "shift_y_mm", "turn_rad"] {
        from_steady["history"][name] = json!(0.0);
    }
    from_steady["start"] = json!("steady");
    let with = |influence: &str, motion: &Value| {
        let mut case = usual("curve", -6.2, 0.003);
        case["load"] = json!({ "normal_force_n": 75e3 });
        case["motion"] = motion.clone();
        case["contact"]["influence"] = json!(influence);
        solve(&case)
    };
    for influence in ["half_space", "angle_corrected"] {
        let known = with(influence, &steadily);
        let steady = forces_of(&known)[0];
        let limit = limit(&known);
        let off = |from: &[f64; 3], k: usize| (from[k] - steady[k]).abs() / limit;
        let ended = with(influence, &history([x, y, spin]));
        let begun = with(influence, &from_steady);
        for (solution, first) in [(ended, 5), (begun, 0)] {
            let forces = forces_of(&solution);
            for (forces, total) in forces.iter().zip(&solution.total).skip(first) {
                let errors = [total, &known.total[0]].map(|t| t.error_estimate.unwrap());
                let allowed = errors.iter().fold([0.0; 2], |sum, e| {
                    [sum[0] + e.force_x_n / limit, sum[1] + e.force_y_n / limit]
                });
                for (k, allowed) in allowed.into_iter().enumerate() {
                    assert!(
                        off(forces, k) < allowed,
                        "{influence} {k}: {forces:?} {steady:?}"
                    );
                }
            }
        }
    }
}

/// Tests that several motions have the forces of separate cases, although the tractions change the pressures of each.
#[test]
fn several_motions_have_the_forces_of_as_many_cases() {
    let motions = [
        json!({ "creepage_x": 0.001, "creepage_y": 0.002, "spin_per_mm": 4e-4, "speed_mm_per_s": 2e4 }),
        json!({ "creepage_x": -0.0005, "creepage_y": -0.002, "spin_per_mm": 1e-4, "speed_mm_per_s": 3e4 }),
    ];
    let mut case = usual("curve", -6.0, 0.003);
    case["outputs"] = json!(["resultants", "tractions", "damage"]);
    let alone = motions.clone().map(|motion| {
        let mut case = case.clone();
        case["motion"] = motion;
        solve(&case)
    });
    case["motion"] = json!(motions);
    let both = solve(&case);
    for (k, alone) in alone.iter().enumerate() {
        let (found, known) = (&both.total[k], &alone.total[0]);
        assert_eq!(found.force_x_n, known.force_x_n);
        assert_eq!(found.force_y_n, known.force_y_n);
        for (patch, known) in both.patches.iter().zip(&alone.patches) {
            let (found, known_point) = (&patch.points[k], &known.points[0]);
            assert_eq!(found.damage, known_point.damage);
            let region = found.region.as_ref().unwrap();
            assert_eq!(region.normal_force_n, known.normal_force_n);
        }
    }
}

/// Tests that stresses and temperatures are given about the load centre of each patch.
#[test]
fn what_follows_from_a_patch_is_given_about_its_load_centre() {
    let text = include_str!("../../api/examples/wheel-rail-flange.case.json");
    let mut case: Value = serde_json::from_str(text).unwrap();
    case["contact"]["reference_surface"] = json!("curve");
    case["outputs"] = json!([
        "resultants",
        "subsurface",
        "damage",
        "temperature",
        "gradients"
    ]);
    case["subsurface"] = json!({ "points_mm": [[0.0, 0.0, 1.0]], "worst": true });
    case["damage"] = json!({ "across": true });
    case["thermal"] = json!({ "conductivity_w_per_mk": 50, "density_kg_per_m3": 7850, "specific_heat_j_per_kgk": 450, "bulk_c": 20 });
    let checked = check(&case, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (solution, fields) = railhead_contact::solve(&checked, &Unmonitored).unwrap();
    assert!(solution.patches.len() > 1);
    for (patch, fields) in solution.patches.iter().zip(&fields.patches) {
        let point = &patch.points[0];
        let [x_min, x_max, y_min, y_max] = patch.extent_mm;
        let inside = |[x, y]: [f64; 2]| {
            let inside = (x_min..=x_max).contains(&x) && (y_min..=y_max).contains(&y);
            assert!(inside, "{x} {y} {:?}", patch.extent_mm);
        };
        inside([0.0, 0.0]);
        inside(point.temperature.unwrap().at_mm);
        let worst = point.subsurface.unwrap().worst.unwrap();
        inside([worst.at_mm[0], worst.at_mm[1]]);
        // Under the load centre the vertical stress in the rail is of the order of the pressure: a fraction of the largest pressure on a patch of
        // any size.
        let stored = fields.points[0].subsurface.as_ref().unwrap();
        assert_eq!(stored[..3], [0.0, 0.0, 1.0]);
        let down = -stored[5];
        assert!(down > 0.1 * patch.pressure_max_mpa && down < patch.pressure_max_mpa);
        let across = point.damage.as_ref().unwrap().across.as_ref().unwrap();
        assert!(across.y_mm.iter().all(|y| (y_min..=y_max).contains(y)));
        let spread: f64 = across
            .t_gamma_n_per_mm
            .iter()
            .zip(&across.dy_mm)
            .map(|(t, dy)| t * dy)
            .sum();
        assert!((spread / point.friction_power_n - 1.0).abs() < 1e-6);
        assert!(point.gradients.is_some());
    }
}

/// Tests that a wheelset on the curves of both rails in the middle of the track is symmetric, carries its load and balances a torque.
#[test]
fn a_wheelset_rests_on_the_curves_of_both_rails() {
    let wheel = usual("curve", 0.0, 0.0);
    let of = |name: &str| wheel["contact"][name].clone();
    let mut case = wheel.clone();
    case["contact"] = json!({
        "type": "wheelset", "rail": of("rail"), "wheel": of("wheel"), "rolling_radius_mm": 460,
        "cant_rad": 0.025, "lateral_shift_mm": { "values": [0.0, -5.5] }, "yaw_rad": { "values": [0.0, 0.003] }, "reference_surface": "curve"
    });
    case["load"] = json!({ "vertical_force_n": 150e3 });
    case["motion"] = json!({ "wheelset": { "speed_mm_per_s": 20e3, "drive_torque_n_mm": 1e6 } });
    let solution = solve(&case);
    let wheelset = solution.wheelset.as_ref().unwrap();
    let middle = &wheelset.positions[0];
    assert!((middle.left.force_y_n + middle.right.force_y_n).abs() < 30.0);
    assert!(middle.roll_rad.abs() < 1e-6);
    for (position, total) in wheelset.positions.iter().zip(&solution.total) {
        assert!((total.force_z_n.unwrap() / -150e3 - 1.0).abs() < 1e-3);
        assert!((position.drive_torque_n_mm / 1e6 - 1.0).abs() < 0.03);
    }
}
