//! Tests that faulty wheels and rails are refused by the parser or fail with a reason, and that doubtful ones get remarks.

use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::cases::{assert_fault, faults, good, with};
use crate::profile_cases::{generated, put, wheel_on_rail};
use crate::profile_shapes::{rail_60e1, s1002};
use crate::reference;

const RAIL: &str = "/contact/rail/points_mm";
const WHEEL: &str = "/contact/wheel/points_mm";

fn changed(pointer: &str, value: Value) -> Value {
    with(&generated(), pointer, Some(value))
}

fn scaled(points: &[[f64; 2]], factor: f64) -> Value {
    json!(
        points
            .iter()
            .map(|p| p.map(|part| part * factor))
            .collect::<Vec<_>>()
    )
}

fn columns(points: &[[f64; 2]]) -> String {
    points.iter().map(|[y, z]| format!("{y} {z}\n")).collect()
}

fn reason(case: &Value) -> String {
    let checked = check(case, &Limits::default()).unwrap_or_else(|e| panic!("{e}"));
    match solve(&checked, &Unmonitored) {
        Err(SolveError::NormalProblem { reason }) => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_sound_wheel_on_a_rail_is_accepted_without_being_solved() {
    let case = generated();
    assert_eq!(faults(&case), []);
    let checked = check(&case, &Limits::default()).unwrap();
    assert!(checked.problem.task.known_patches().is_none() && checked.cost().seconds < 1.0);
    assert_eq!(checked.problem.motions.len(), 1);
}

#[test]
fn a_pair_that_cannot_be_placed_names_the_unit_of_a_profile_of_unusual_size() {
    // A head of 7.3 by 2.5 mm ends above the gauge height.
    let mut wheel = changed(RAIL, scaled(&rail_60e1(), 0.1));
    let mut wheelset = wheel.clone();
    let contact = wheelset["contact"].as_object_mut().unwrap();
    contact.retain(|name, _| !["side", "roll_rad"].contains(&name.as_str()));
    contact.insert("type".to_owned(), json!("wheelset"));
    wheelset["load"] = json!({ "vertical_force_n": 150_000 });
    wheelset["motion"] =
        json!({ "wheelset": { "speed_mm_per_s": 20_000, "free_rolling_radius_mm": 460 } });
    // Both profiles in cm.
    wheel["contact"]["wheel"]["points_mm"] = scaled(&s1002(), 0.1);
    for case in [wheel, wheelset] {
        let found = faults(&case);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].pointer, "/contact/rail", "{found:?}");
        for words in [
            "gauge_height_mm",
            "rail: the profile is 7.",
            "state unit: \"cm\"",
        ] {
            assert!(found[0].detail.contains(words), "{found:?}");
        }
    }
}

#[test]
fn faults_of_both_cross_sections_and_of_the_rest_come_together() {
    let mut case = generated();
    case["contact"]["rail"]["points_mm"] = scaled(&rail_60e1(), 1e-3);
    case["contact"]["wheel"] = json!({ "format": "columns", "text": "1 2\n2 2\n3 2\n4 2\n5 2\n6 2\n7 2\n8 2\nnine 2\n10 2\n" });
    let found = faults(&case);
    let pointers: Vec<&str> = found.iter().map(|fault| fault.pointer.as_str()).collect();
    assert_eq!(pointers, [RAIL, "/contact/wheel/text"], "{found:?}");
    assert!(found[0].detail.contains("state unit"), "{found:?}");
    assert!(found[1].detail.contains("line 9"), "{found:?}");
    // Profiles are checked although the load is missing.
    case.as_object_mut().unwrap().remove("load");
    let pointers: Vec<String> = faults(&case)
        .into_iter()
        .map(|fault| fault.pointer)
        .collect();
    assert_eq!(pointers, ["/load", RAIL, "/contact/wheel/text"]);
}

#[test]
fn points_without_order_loops_and_too_few_points_are_refused_in_their_place() {
    let points = rail_60e1();
    let count = points.len();
    let shuffled: Vec<[f64; 2]> = (0..count).map(|k| points[k * 97 % count]).collect();
    assert_fault(&changed(RAIL, json!(shuffled)), RAIL, &["not in order"]);
    let turn = |k: i32| 0.05 * f64::from(k);
    let wound: Vec<[f64; 2]> = (0..180)
        .map(turn)
        .map(|angle| [10.0 * angle.sin() + 0.3 * angle, -10.0 * angle.cos()])
        .collect();
    let mut looped = changed(WHEEL, json!(wound));
    looped["contact"]["wheel"]["mirror_z"] = json!(false);
    looped["contact"]["wheel"]["mirror_y"] = json!(false);
    assert_fault(&looped, WHEEL, &["loops are refused"]);
    assert_fault(
        &changed(WHEEL, json!(&s1002()[..7])),
        WHEEL,
        &["length 7", "8 to 20000"],
    );
    assert_fault(
        &changed(WHEEL, scaled(&s1002(), 25.4)),
        WHEEL,
        &["10 to 500 mm"],
    );
    let in_inches = changed(WHEEL, scaled(&s1002(), 1.0 / 25.4));
    assert_fault(&in_inches, WHEEL, &["state unit: \"inch\""]);
    let mut points = s1002();
    points[17] = [-999.0, -999.0];
    assert_fault(&changed(WHEEL, json!(points)), WHEEL, &["(-999, -999)"]);
}

#[test]
fn a_bad_point_is_named_with_its_number() {
    let point = format!("{RAIL}/17");
    assert_fault(
        &changed(&point, json!([1.0])),
        &point,
        &["length 1", "a pair"],
    );
    assert_fault(
        &changed(&point, json!("middle")),
        &point,
        &["\"middle\"", "a pair"],
    );
    let part = format!("{point}/1");
    assert_fault(
        &changed(&part, json!(null)),
        &part,
        &["null", "-1e6 to 1e6 mm"],
    );
    let bad: Vec<Value> = rail_60e1().iter().map(|_| json!(["y", "z"])).collect();
    let found = faults(&changed(RAIL, json!(bad)));
    assert_eq!(found.len(), 11, "{found:#?}");
    assert!(
        found[10].detail.contains("more points are refused"),
        "{found:#?}"
    );
}

#[test]
fn a_cross_section_is_points_or_the_text_of_a_file() {
    let rail = |value: Value| changed("/contact/rail", value);
    let text = columns(&rail_60e1());
    assert_eq!(
        faults(&rail(json!({ "format": "columns", "text": text }))),
        []
    );
    assert_fault(&rail(json!({})), RAIL, &["missing", "text"]);
    assert_fault(
        &rail(json!({ "points_mm": rail_60e1(), "format": "columns", "text": text })),
        "/contact/rail/text",
        &["together with points_mm"],
    );
    assert_fault(
        &rail(json!({ "points_mm": rail_60e1(), "format": "columns" })),
        "/contact/rail/format",
        &["text of a file"],
    );
    assert_fault(
        &rail(json!({ "text": text })),
        "/contact/rail/format",
        &["columns, simpack, miniprof"],
    );
    assert_fault(
        &rail(json!({ "format": "dxf", "text": text })),
        "/contact/rail/format",
        &["\"dxf\"", "columns, simpack, miniprof"],
    );
    let wheel_file = "header.begin\ntype = 1\nheader.end\nspline.begin\npoint.begin\n0 0\npoint.end\nspline.end\n";
    assert_fault(
        &rail(json!({ "format": "simpack", "text": wheel_file })),
        "/contact/rail/text",
        &["is of a wheel", "a file of a rail"],
    );
}

#[test]
fn members_of_the_contact_are_checked_on_both_sides_of_their_limits() {
    for (name, bad) in [
        ("side", json!("both")),
        ("rolling_radius_mm", json!(0)),
        ("gauge_mm", json!(-1435)),
        ("gauge_height_mm", json!(101)),
        ("cant_rad", json!(0.51)),
        ("flange_back_distance_mm", json!("wide")),
        ("flange_back_position_mm", json!(1001)),
        ("lateral_shift_mm", json!(-1001)),
        ("yaw_rad", json!(0.31)),
        ("roll_rad", json!(-0.31)),
        ("colour", json!("red")),
    ] {
        let pointer = format!("/contact/{name}");
        assert_fault(&changed(&pointer, bad.clone()), &pointer, &[]);
    }
    for (name, good) in [
        ("gauge_height_mm", 10.0),
        ("flange_back_distance_mm", 1360.0),
        ("yaw_rad", 0.0),
        ("roll_rad", 0.0),
    ] {
        assert_eq!(
            faults(&changed(&format!("/contact/{name}"), json!(good))),
            []
        );
    }
    for name in ["smoothing_mm", "mirror_y"] {
        let pointer = format!("/contact/rail/{name}");
        assert_fault(&changed(&pointer, json!(-1)), &pointer, &["-1 given"]);
    }
    for name in ["side", "rolling_radius_mm", "rail", "wheel"] {
        let pointer = format!("/contact/{name}");
        assert_fault(&with(&generated(), &pointer, None), &pointer, &["missing"]);
    }
}

#[test]
fn what_is_left_out_is_the_standard_track() {
    let mut short = generated();
    let contact = short["contact"].as_object_mut().unwrap();
    for name in ["gauge_mm", "gauge_height_mm", "flange_back_distance_mm"] {
        contact.remove(name);
    }
    let limits = Limits::default();
    let [full, short] = [generated(), short].map(|case| check(&case, &limits).unwrap());
    assert_eq!(full.label.digest, short.label.digest);
}

/// Tests half of a measured rail, which has no gauge face: it is not placed by the end of its points, but by its origin where that is given.
#[test]
fn a_rail_without_a_gauge_face_is_refused_or_placed_by_its_origin() {
    let head = |from: f64| -> Value {
        let points = rail_60e1().into_iter().filter(|[y, _]| *y > from);
        json!({ "points_mm": points.collect::<Vec<_>>(), "mirror_y": false, "mirror_z": false })
    };
    let place = |rail: Value, members: Value| {
        let mut case = wheel_on_rail(rail, json!({ "points_mm": s1002() }), 0.0);
        let contact = case["contact"].as_object_mut().unwrap();
        contact.remove("gauge_mm");
        contact.remove("gauge_height_mm");
        put(&case, "contact", members)
    };
    assert_fault(
        &place(head(-20.0), json!({})),
        "/contact/rail",
        &["14 mm below the top", "rail_origin_mm", "1.0"],
    );
    // A gauge height within the points needs no further points.
    assert_eq!(
        faults(&place(head(-20.0), json!({ "gauge_height_mm": 1 }))),
        []
    );
    for name in ["gauge_mm", "gauge_height_mm"] {
        let both = place(head(-20.0), json!({ "rail_origin_mm": 750, (name): 10 }));
        assert_fault(&both, "/contact/rail_origin_mm", &[name]);
    }
    assert_fault(
        &place(head(-20.0), json!({ "rail_origin_mm": -1 })),
        "/contact/rail_origin_mm",
        &["-1 given", "from 0"],
    );
    let found = |case: &Value| {
        let (solution, _) = reference::solve(case);
        let patch = &solution.patches[0];
        let position = patch.position.as_ref().expect("a position");
        [patch.pressure_max_mpa, position.rail_mm[0]]
    };
    // Position of the gauge face, 14 mm below the top.
    let points = rail_60e1();
    let face = points
        .windows(2)
        .find(|pair| pair[0][1] >= 14.0 && pair[1][1] < 14.0);
    let [from, to] = face.map(|pair| [pair[0], pair[1]]).expect("a gauge face");
    let face = from[0] + (14.0 - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
    let origin = json!({ "rail_origin_mm": 717.5 - face });
    let [pressure, y] = found(&place(head(-50.0), json!({})));
    for cut in [-50.0, -20.0] {
        let by_origin = found(&place(head(cut), origin.clone()));
        assert!(
            (by_origin[0] / pressure - 1.0).abs() < 1e-3,
            "{by_origin:?}"
        );
        assert!((by_origin[1] - y).abs() < 0.02, "{by_origin:?} {y}");
    }
}

/// Tests that both distances may be 0, as for a wheel on a roller rig. The origins of both cross-sections then coincide laterally.
#[test]
fn origins_may_lie_on_the_middle_line() {
    let mut case = wheel_on_rail(
        json!({ "points_mm": rail_60e1() }),
        json!({ "points_mm": s1002() }),
        0.0,
    );
    let contact = case["contact"].as_object_mut().unwrap();
    contact.remove("gauge_mm");
    contact.remove("gauge_height_mm");
    let at = |origin: f64, back: f64, position: f64| {
        let place = json!({
            "rail_origin_mm": origin, "flange_back_distance_mm": back, "flange_back_position_mm": position,
        });
        let (solution, _) = reference::solve(&put(&case, "contact", place));
        solution.patches[0].pressure_max_mpa
    };
    let near = at(0.0, 0.0, 3.0);
    let apart = at(750.0, 1500.0, 3.0);
    assert!((near / apart - 1.0).abs() < 1e-3, "{near} {apart}");
}

#[test]
fn a_wheel_beside_its_rail_and_a_wheel_without_radius_cannot_touch() {
    assert_fault(
        &changed("/contact/lateral_shift_mm", json!(200)),
        "/contact",
        &["no part of the wheel lies above the rail", "lateral shift"],
    );
    assert_fault(
        &changed("/contact/rolling_radius_mm", json!(2)),
        "/contact/rolling_radius_mm",
        &["toward the axle"],
    );
}

#[test]
fn a_contact_at_the_end_of_a_profile_is_no_contact() {
    let cut: Vec<[f64; 2]> = s1002().into_iter().filter(|p| p[0] > -4.0).collect();
    let mut case = changed(WHEEL, json!(cut));
    case["contact"]["wheel"]["mirror_z"] = json!(false);
    case["contact"]["wheel"]["mirror_y"] = json!(false);
    case["contact"]["lateral_shift_mm"] = json!(-2);
    let reason = reason(&case);
    assert!(
        reason.contains("end of a profile") && reason.contains("longer profiles"),
        "{reason}"
    );
}

#[test]
fn loads_and_motions_of_profiles_belong_to_profiles() {
    let load = |value: Value| changed("/load", value);
    assert_fault(
        &load(json!({})),
        "/load",
        &["vertical_force_n, normal_force_n, approach_mm"],
    );
    assert_fault(
        &load(json!({ "vertical_force_n": 1, "normal_force_n": 1 })),
        "/load/normal_force_n",
        &["together with vertical_force_n"],
    );
    assert_fault(
        &load(json!({ "vertical_force_n": 0 })),
        "/load/vertical_force_n",
        &["more than 0"],
    );
    assert_fault(
        &load(json!({ "approach_mm": 0 })),
        "/load/approach_mm",
        &["more than 0"],
    );
    assert_fault(
        &with(&good(), "/load", Some(json!({ "vertical_force_n": 1e5 }))),
        "/load/vertical_force_n",
        &["another contact than"],
    );
    let wheelset = json!({ "wheelset": { "speed_mm_per_s": 2e4, "free_rolling_radius_mm": 460 } });
    assert_eq!(faults(&changed("/motion", wheelset.clone())), []);
    assert_fault(
        &with(&good(), "/motion", Some(wheelset)),
        "/motion/wheelset",
        &["another contact than"],
    );
    let motion = |members: Value| changed("/motion", json!({ "wheelset": members }));
    let pointer = "/motion/wheelset/angular_velocity_rad_per_s";
    assert_fault(
        &motion(json!({ "speed_mm_per_s": 2e4 })),
        pointer,
        &["missing", "free_rolling_radius_mm"],
    );
    assert_fault(
        &motion(
            json!({ "speed_mm_per_s": 2e4, "angular_velocity_rad_per_s": 4, "free_rolling_radius_mm": 460 }),
        ),
        "/motion/wheelset/free_rolling_radius_mm",
        &["exactly one"],
    );
    assert_fault(
        &motion(json!({ "speed_mm_per_s": -2e4, "angular_velocity_rad_per_s": 4 })),
        "/motion/wheelset/speed_mm_per_s",
        &["more than 0"],
    );
}

#[test]
fn remarks_on_profiles_are_in_the_answer() {
    let mut points = rail_60e1();
    points.swap(100, 101);
    let case = changed(RAIL, json!(points));
    let checked = check(&case, &Limits::default()).unwrap();
    let (solution, _) = solve(&checked, &Unmonitored).unwrap();
    assert!(
        solution
            .remarks
            .iter()
            .any(|remark| remark.code == "profile-points-dropped"
                && remark.pointer.as_deref() == Some("/contact/rail")),
        "{:?}",
        solution.remarks
    );
}

#[test]
fn the_digest_knows_the_motion_of_the_wheelset() {
    let digest = |free: f64| {
        let mut case = generated();
        case["motion"] =
            json!({ "wheelset": { "speed_mm_per_s": 2e4, "free_rolling_radius_mm": free } });
        check(&case, &Limits::default()).unwrap().label.digest
    };
    assert_ne!(digest(460.0), digest(461.0));
    assert_eq!(digest(460.0), digest(460.0));
    assert_ne!(
        digest(460.0),
        check(&generated(), &Limits::default())
            .unwrap()
            .label
            .digest
    );
}
