//! Tests that sections are read with the right orientation. A section has one answer, whatever the signs, order, spacing and format of its points.
//! Where its shape does not determine the orientation, the case is refused and names the members to state.

use railhead_contact::case::solver::Limits;
use railhead_contact::check;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::remark::kind::Figure;
use serde_json::{Value, json};

use crate::profile_cases::{generated, put};
use crate::profile_shapes::{rail_60e1, s1002};
use crate::profile_variants::{Encoding, Form, Points, Variant, rails, wheels};
use crate::reference::solve;

/// Returns S1002 on 60E1 with other sections. The position of the flange's back is left out.
fn pair(rail: Value, wheel: Value) -> Value {
    let mut case = put(
        &generated(),
        "contact",
        json!({ "rail": rail, "wheel": wheel, "lateral_shift_mm": -1.0 }),
    );
    let contact = case["contact"].as_object_mut().expect("a contact");
    contact.remove("flange_back_position_mm");
    case
}

fn checked(case: &Value) -> Result<CheckedCase, String> {
    check(case, &Limits::default()).map_err(|error| error.to_string())
}

/// Returns the place `[y, z]` of first contact on the rail, and the vertical displacement from there to equilibrium.
fn touch(checked: &CheckedCase) -> [f64; 3] {
    let understood = checked.understood().expect("a touch");
    let placed = understood.placement.expect("profiles");
    let [y, z] = placed.first_touch.rail_mm;
    [y, z, placed.lowering_estimate_mm]
}

fn near(found: [f64; 3], expected: [f64; 3], what: &str) {
    let [y, z, lowering] = [0, 1, 2].map(|k| (found[k] - expected[k]).abs());
    assert!(
        y < 0.3 && z < 0.02 && lowering < 0.02 * expected[2],
        "{what}: {found:?} against {expected:?}"
    );
}

/// Returns the case with these points in place of the base's, with the orientation given by the shape or stated.
fn wheel_case(variant: &Variant, encoding: Encoding, stated: bool) -> Value {
    let section = if stated {
        encoding.stated(&variant.points)
    } else {
        encoding.section(&variant.points)
    };
    let mut case = pair(json!({ "points_mm": rail_60e1() }), section);
    if variant.back.is_none() {
        case["contact"]["flange_back_position_mm"] = json!(encoding.origin[0] - 70.0);
    }
    case["contact"]["rolling_radius_mm"] = json!(460.0 - encoding.origin[1]);
    case
}

fn encodings() -> Vec<Encoding> {
    let mut all = Vec::new();
    for senses in Encoding::senses() {
        for (reversed, origin, every, form) in [
            (false, [0.0; 2], 1, Form::Points),
            (true, [0.0; 2], 1, Form::Points),
            (false, [70.0, 12.0], 1, Form::Points),
            (true, [-33.0, -40.0], 2, Form::Columns),
            (false, [70.0, 0.0], 1, Form::Miniprof),
            (true, [0.0, 3.0], 3, Form::Miniprof),
            (false, [70.0, 0.0], 1, Form::Simpack),
        ] {
            all.push(Encoding {
                reversed,
                origin,
                every,
                form,
                ..senses
            });
        }
    }
    all
}

#[test]
fn a_wheel_has_one_contact_however_its_points_are_given_or_is_refused_with_the_member_to_state() {
    for variant in wheels() {
        let expected =
            touch(&checked(&wheel_case(&variant, Encoding::PLAIN, true)).expect("a case"));
        for encoding in encodings() {
            let what = format!("{}, {encoding:?}", variant.name);
            let stated = checked(&wheel_case(&variant, encoding, true));
            near(touch(&stated.expect(&what)), expected, &what);
            // A Simpack file specifies its orientation.
            let shown = variant.clear || encoding.form == Form::Simpack;
            match checked(&wheel_case(&variant, encoding, false)) {
                Ok(found) => near(touch(&found), expected, &what),
                Err(refused) => {
                    assert!(!shown, "{what}: {refused}");
                    assert!(refused.contains("state mirror_y"), "{what}: {refused}");
                    assert!(refused.contains("mirror_z"), "{what}: {refused}");
                }
            }
        }
    }
}

#[test]
fn a_rail_has_one_contact_however_its_points_are_given() {
    let wheel = json!({ "points_mm": s1002() });
    for variant in rails() {
        let stated = Encoding::PLAIN.stated(&variant.points);
        let expected = touch(&checked(&pair(stated, wheel.clone())).expect("a case"));
        for encoding in encodings() {
            let what = format!("{}, {encoding:?}", variant.name);
            let mut section = encoding.section(&variant.points);
            // The sign of a rail's y is that of its format, since heads are nearly symmetric.
            let usual = encoding.form == Form::Miniprof;
            if encoding.form != Form::Simpack && encoding.mirror_y != usual {
                section["mirror_y"] = json!(encoding.mirror_y);
            }
            match checked(&pair(section, wheel.clone())) {
                Ok(found) => near(touch(&found), shifted(expected, encoding), &what),
                Err(refused) => {
                    assert!(!variant.clear, "{what}: {refused}");
                    assert!(refused.contains("state mirror_z"), "{what}: {refused}");
                }
            }
        }
    }
}

/// Returns the place of first contact on the rail in the axes of an encoded section.
fn shifted([y, z, lowering]: [f64; 3], encoding: Encoding) -> [f64; 3] {
    [y + encoding.origin[0], z + encoding.origin[1], lowering]
}

#[test]
fn more_or_less_of_a_wheel_changes_no_pressure() {
    let pressure = |case: &Value| solve(case).0.patches[0].pressure_max_mpa;
    let base = pressure(&pair(
        json!({ "points_mm": rail_60e1() }),
        json!({ "points_mm": s1002() }),
    ));
    for variant in wheels().into_iter().filter(|variant| variant.clear) {
        let found = pressure(&wheel_case(&variant, Encoding::PLAIN, false));
        assert!(
            (found / base - 1.0).abs() < 0.02,
            "{}: {found} against {base}",
            variant.name
        );
    }
}

fn remark<'a>(checked: &'a CheckedCase, code: &str) -> Option<&'a RemarkEntry> {
    checked.remarks.iter().find(|remark| remark.code == code)
}

fn codes(checked: &CheckedCase) -> Vec<&str> {
    checked
        .remarks
        .iter()
        .map(|remark| remark.code.as_str())
        .collect()
}

#[test]
fn changed_senses_are_told_and_usual_ones_are_not() {
    let rail = json!({ "points_mm": rail_60e1() });
    let told = |encoding: Encoding| {
        let found = checked(&pair(rail.clone(), encoding.section(&s1002()))).expect("a case");
        ["profile-y-mirrored", "profile-z-mirrored"].map(|code| remark(&found, code).is_some())
    };
    for encoding in Encoding::senses() {
        let Encoding {
            mirror_y, mirror_z, ..
        } = encoding;
        assert_eq!(told(encoding), [mirror_y, mirror_z], "{encoding:?}");
        let simpack = Encoding {
            form: Form::Simpack,
            ..encoding
        };
        assert_eq!(told(simpack), [false; 2], "{encoding:?}");
        // X of MiniProf files usually grows toward the track centre.
        let miniprof = Encoding {
            form: Form::Miniprof,
            ..encoding
        };
        assert_eq!(told(miniprof), [!mirror_y, mirror_z], "{encoding:?}");
    }
    let plain = checked(&pair(rail, json!({ "points_mm": s1002() }))).expect("a case");
    assert_eq!(codes(&plain), Vec::<&str>::new());
}

#[test]
fn a_stated_sense_that_contradicts_the_shape_is_a_warning_and_is_named_where_nothing_touches() {
    let rail = json!({ "points_mm": rail_60e1() });
    let code = "profile-sense-contradicted";
    for member in ["mirror_y", "mirror_z"] {
        let mut wheel = json!({ "points_mm": s1002() });
        wheel[member] = json!(true);
        match checked(&pair(rail.clone(), wheel)) {
            Ok(found) => {
                let told =
                    remark(&found, code).unwrap_or_else(|| panic!("{member}: {:?}", codes(&found)));
                assert_eq!(told.pointer.as_deref(), Some("/contact/wheel"));
                assert!(told.detail.contains(member), "{}", told.detail);
            }
            Err(refused) => assert!(refused.contains(&format!("{member}: true")), "{refused}"),
        }
    }
    // X is measured from the back of the flange, as in MiniProf files, with the opposite sign stated.
    let shifted = Encoding {
        origin: [70.0, 0.0],
        ..Encoding::PLAIN
    };
    let mut wheel = shifted.section(&s1002());
    wheel["mirror_y"] = json!(true);
    let mut case = pair(rail, wheel);
    case["contact"]["flange_back_position_mm"] = json!(0);
    let refused = checked(&case).expect_err("nothing touches");
    assert!(
        refused.contains("no part of the wheel lies above the rail"),
        "{refused}"
    );
    assert!(refused.contains("mirror_y: true"), "{refused}");
}

/// Returns the points shifted so that the back of the flange is at another y.
fn shifted_wheel(by: f64) -> Points {
    s1002().iter().map(|[y, z]| [y + by, *z]).collect()
}

#[test]
fn the_back_of_the_flange_is_found_where_it_is_left_out() {
    let rail = json!({ "points_mm": rail_60e1() });
    let expected =
        touch(&checked(&pair(rail.clone(), json!({ "points_mm": s1002() }))).expect("a case"));
    for by in [-40.0, 3.0, 70.0, 200.0] {
        let case = pair(rail.clone(), json!({ "points_mm": shifted_wheel(by) }));
        let found = checked(&case).expect("a case");
        near(touch(&found), expected, "left out");
        let told = remark(&found, "flange-back-found").expect("a remark");
        let Figure::Number(position) = told.figures["position_mm"] else {
            panic!("{told:?}")
        };
        assert!((position - (by - 70.0)).abs() < 0.1, "{position} for {by}");
    }
    // The points end on the face of the flange and do not show its back.
    let short: Points = shifted_wheel(70.0)
        .into_iter()
        .filter(|at| at[0] > 26.0)
        .collect();
    let refused = checked(&pair(rail, json!({ "points_mm": short }))).expect_err("no back");
    assert!(
        refused.contains("/contact/flange_back_position_mm"),
        "{refused}"
    );
    assert!(refused.contains("from y = 26.1"), "{refused}");
}

#[test]
fn a_stated_back_outside_the_points_is_refused_and_one_elsewhere_in_them_is_told() {
    let case = |position: f64| {
        let mut case = pair(
            json!({ "points_mm": rail_60e1() }),
            json!({ "points_mm": shifted_wheel(70.0) }),
        );
        case["contact"]["flange_back_position_mm"] = json!(position);
        checked(&case)
    };
    for outside in [-70.0, -6.0, 131.0] {
        let refused = case(outside).expect_err("outside");
        assert!(
            refused.contains("/contact/flange_back_position_mm"),
            "{refused}"
        );
        assert!(
            refused.contains("reach from y = 0.10 to 129.85"),
            "{refused}"
        );
    }
    let told = |position: f64| {
        codes(&case(position).expect("a case")).contains(&"flange-back-contradicted")
    };
    assert!(!told(0.0) && !told(-3.0) && !told(4.0));
    assert!(told(9.0));
}

/// Returns the nose of a crossing, and one with a wing rail next to it: y to the field side, z down.
fn crossings() -> [Points; 2] {
    let nose = |y: f64| match y {
        _ if y < 8.0 => [
            y,
            1.0 + 0.02 * (8.0 - y).powi(2) + 14.0 * ((2.0 - y) / 6.0).max(0.0).powi(2),
        ],
        _ => [y, 1.0 + 0.012 * (y - 8.0).powi(2)],
    };
    let alone: Points = (-8..=116).map(|k| nose(0.5 * f64::from(k))).collect();
    let mut both: Points = vec![[0.0, 40.0]];
    for [y, z] in [
        [8.5, 6.0],
        [10.0, 3.5],
        [13.0, 2.2],
        [32.0, 2.2],
        [35.0, 3.5],
        [36.5, 6.0],
        [44.5, 40.0],
        [50.0, 48.0],
        [59.0, 51.0],
    ] {
        both.extend(line_to(both[both.len() - 1], [y, z]));
    }
    for [y, z] in [
        [69.0, 48.0],
        [74.0, 38.0],
        [76.0, 2.0],
        [78.0, -1.5],
        [81.0, -2.5],
        [136.0, -2.5],
    ] {
        both.extend(line_to(both[both.len() - 1], [y, z]));
    }
    [alone, both]
}

fn line_to(from: [f64; 2], to: [f64; 2]) -> Points {
    let count = ((to[0] - from[0]).hypot(to[1] - from[1]) / 0.5).ceil();
    let at = |k: usize| [0, 1].map(|i| from[i] + (to[i] - from[i]) * k as f64 / count);
    (1..=count as usize).map(at).collect()
}

#[test]
fn unusual_sections_are_not_taken_for_the_other_body() {
    let wheel = json!({ "points_mm": s1002() });
    for points in crossings() {
        for mirror_z in [false, true] {
            let encoding = Encoding {
                mirror_z,
                ..Encoding::PLAIN
            };
            let found = checked(&pair(encoding.section(&points), wheel.clone())).expect("a case");
            assert!(
                remark(&found, "profile-of-other-body").is_none(),
                "{:?}",
                codes(&found)
            );
            assert_eq!(remark(&found, "profile-z-mirrored").is_some(), mirror_z);
        }
    }
    let rail = json!({ "points_mm": rail_60e1() });
    for variant in wheels() {
        let found =
            checked(&pair(rail.clone(), Encoding::PLAIN.stated(&variant.points))).expect("a case");
        assert!(
            remark(&found, "profile-of-other-body").is_none(),
            "{}",
            variant.name
        );
    }
    for variant in rails() {
        let found = checked(&pair(
            Encoding::PLAIN.stated(&variant.points),
            wheel.clone(),
        ))
        .expect("a case");
        assert!(
            remark(&found, "profile-of-other-body").is_none(),
            "{}",
            variant.name
        );
    }
}

#[test]
fn a_tread_far_from_the_height_of_its_radius_is_reported() {
    let told = |by: f64| {
        let wheel: Points = s1002().iter().map(|[y, z]| [*y, z + by]).collect();
        let case = pair(
            json!({ "points_mm": rail_60e1() }),
            json!({ "points_mm": wheel }),
        );
        codes(&checked(&case).expect("a case")).contains(&"wheel-height-unusual")
    };
    assert!(!told(0.0) && !told(8.0) && !told(-8.0));
    assert!(told(30.0) && told(-30.0));
}

#[test]
fn a_stray_point_at_either_end_changes_nothing_and_parts_in_the_wrong_order_are_refused() {
    let contact = |rail: &[[f64; 2]], wheel: &[[f64; 2]]| {
        checked(&pair(
            json!({ "points_mm": rail }),
            json!({ "points_mm": wheel }),
        ))
    };
    let (rail, wheel) = (rail_60e1(), s1002());
    let expected = touch(&contact(&rail, &wheel).expect("a case"));
    let with = |points: &[[f64; 2]], first: bool, stray: [f64; 2]| {
        let mut points = points.to_vec();
        points.insert(if first { 0 } else { points.len() }, stray);
        points
    };
    // A closed outline, and the line of a file that counts its points.
    let far = [83.0, 1.0];
    for first in [true, false] {
        for (rail, wheel) in [
            (with(&rail, first, far), wheel.clone()),
            (rail.clone(), with(&wheel, first, [far[0] + 20.0, far[1]])),
            (rail.clone(), with(&wheel, false, wheel[0])),
            (with(&rail, true, rail[rail.len() - 1]), wheel.clone()),
        ] {
            let found = contact(&rail, &wheel).expect("a case");
            assert!(codes(&found).contains(&"profile-end-dropped"));
            near(touch(&found), expected, "a stray point");
        }
    }
    let halves = |points: &[[f64; 2]]| {
        let mut points = points.to_vec();
        let middle = points.len() / 2;
        points.rotate_left(middle);
        points
    };
    for (rail, wheel) in [
        (halves(&rail), wheel.clone()),
        (rail.clone(), halves(&wheel)),
    ] {
        let refused = contact(&rail, &wheel).expect_err("parts in the wrong order");
        assert!(
            refused.contains("jumps over most of its points"),
            "{refused}"
        );
    }
}
