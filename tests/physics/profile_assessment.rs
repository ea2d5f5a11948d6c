//! Tests of the assessment of profiles: defects from exports and instruments are named in the answer, or the case is refused.

use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::damaged::{Damage, blamed, linear, normal, off_normal, pressure_max, resampled, with};
use crate::profile_cases::{generated, put};
use crate::profile_shapes::{rail_60e1, s1002};
use crate::random::Random;

/// Contact of [`tread`] on the rail, with z down.
pub const CROWN: [f64; 2] = [0.0, 0.0];

pub fn tread() -> Value {
    let mut case = put(&generated(), "contact", json!({ "lateral_shift_mm": -1.0 }));
    case["motion"] =
        json!({ "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": 460 } });
    case["solver"] = json!({ "target_error": 0.02 });
    case
}

pub fn accepted(case: &Value) -> Value {
    put(case, "contact", json!({ "accept_rough_profiles": true }))
}

pub fn on_rail(rail: &[[f64; 2]]) -> Value {
    with(&tread(), rail, &s1002(), 0.0)
}

pub fn solved(case: &Value) -> Solution {
    let checked = check(case, &Limits::default()).expect("a case");
    solve(&checked, &Unmonitored)
        .unwrap_or_else(|reason| panic!("{reason}"))
        .0
}

fn refusal(case: &Value) -> (String, String) {
    let checked = check(case, &Limits::default()).expect("a case");
    match solve(&checked, &Unmonitored) {
        Err(SolveError::RoughProfile { pointer, reason }) => (pointer, reason),
        other => panic!("{other:?}"),
    }
}

fn without(points: &[[f64; 2]], from: f64, to: f64) -> Vec<[f64; 2]> {
    let outside = |at: &&[f64; 2]| !(from..=to).contains(&at[0]);
    points.iter().filter(outside).copied().collect()
}

#[test]
fn sound_profiles_carry_their_quality_and_no_blame() {
    let found = solved(&on_rail(&rail_60e1()));
    assert_eq!(blamed(&found), Vec::<String>::new());
    for patch in &found.patches {
        let quality = patch.quality.clone().expect("a quality");
        for own in [quality.rail, quality.wheel] {
            assert!(
                own.spacing_mm > 0.0 && own.spacing_over_width < 0.5,
                "{own:?}"
            );
            assert!(own.y_mm[0] < own.y_mm[1], "{own:?}");
            assert_eq!([own.smoothing_mm, own.smoothing_suggested_mm], [0.0; 2]);
            assert!(own.waviness_mpa.hypot(own.ambiguity_mpa) < 0.1 * patch.pressure_max_mpa);
        }
        let open = patch.points[0].profile_uncertainty.expect("an uncertainty");
        assert!(
            open.pressure_max_mpa < 0.05 * patch.pressure_max_mpa,
            "{open:?}"
        );
    }
    assert!(found.total[0].profile_uncertainty.is_some());
}

#[test]
fn planes_do_not_answer_for_points_that_are_refused() {
    let sound = rail_60e1();
    let touched = solved(&on_rail(&sound)).patches[0].position;
    let y = touched.expect("a place").rail_mm[0];
    let near = |at: &[f64; 2]| (at[0] - y).abs();
    let nearest = (0..sound.len()).min_by(|a, b| near(&sound[*a]).total_cmp(&near(&sound[*b])));
    let nearest = nearest.expect("points");
    let mut refused = 0;
    for height in [0.02, 0.04, 0.08] {
        for point in [nearest - 2, nearest, nearest + 2] {
            let mut rail = sound.clone();
            rail[point][1] -= height;
            let checked = check(&on_rail(&rail), &Limits::default()).expect("a case");
            match solve(&checked, &Unmonitored) {
                Ok((found, _)) => {
                    let mut details = found.remarks.iter().map(|remark| &remark.detail);
                    assert!(!details.any(|detail| detail.contains("accept_rough_profiles")));
                }
                Err(SolveError::RoughProfile { .. }) => refused += 1,
                Err(_) => {}
            }
        }
    }
    assert!(refused > 0);
}

#[test]
fn a_hole_of_50_mm_at_the_crown_is_no_contact() {
    let case = on_rail(&without(&rail_60e1(), -25.0, 25.0));
    let (pointer, reason) = refusal(&case);
    assert_eq!(pointer, "/contact/rail");
    assert!(reason.contains("send"), "{reason}");
    let found = solved(&accepted(&case));
    assert!(!blamed(&found).is_empty());
}

/// Tests that a straight face of the head needs no points between its ends, under any load.
#[test]
fn a_straight_face_far_from_the_wheel_is_no_hole() {
    for (field, length) in [(true, 12.7), (true, 25.0), (false, 12.7)] {
        let mut rail: Vec<[f64; 2]> = rail_60e1();
        rail.retain(|at| at[1] < 14.0);
        if !field {
            rail.reverse();
        }
        let [y, z] = rail[rail.len() - 1];
        let outward = if field { 1.0 } else { -1.0 };
        rail.extend((0..6).map(|k| {
            let further = f64::from(k);
            [
                y + outward * (0.04 + 0.02 * further),
                z + length + 0.3 * further,
            ]
        }));
        for force in [5e3, 20e3, 75e3] {
            let mut case = on_rail(&rail);
            case["load"] = json!({ "vertical_force_n": force });
            let found = solved(&case);
            assert!(!has(&found, "profile-hole"), "{:?}", found.remarks);
        }
    }
}

/// Tests that a straight face that ends the head next to the contact causes no pressure peak.
#[test]
fn a_sharp_corner_beside_the_contact_changes_no_pressure() {
    // The target is small enough for the residual error of the pressures.
    let finely = |rail: &[[f64; 2]]| {
        let mut case = on_rail(rail);
        case["solver"]["target_error"] = json!(0.002);
        solved(&case)
    };
    let sound = finely(&rail_60e1());
    let edge = sound.patches[0]
        .quality
        .clone()
        .expect("a quality")
        .rail
        .y_mm[1]
        + 12.0;
    let mut rail: Vec<[f64; 2]> = rail_60e1();
    rail.retain(|at| at[0] < edge);
    let [y, z] = rail[rail.len() - 1];
    rail.extend((1..8).map(|k| [y + 0.01 * f64::from(k), z + 3.0 * f64::from(k)]));
    let found = finely(&rail);
    let change = pressure_max(&found) / pressure_max(&sound) - 1.0;
    assert!(change.abs() < 1e-3, "{change}");
    assert!(!has(&found, "profile-waves"), "{:?}", found.remarks);
}

/// Tests one outlier among coarse points.
#[test]
fn a_point_far_off_among_coarse_points_is_named_with_its_place() {
    let points = resampled(&rail_60e1(), 1.2);
    let middle = points.partition_point(|at| at[0] < -3.0);
    for off in [0.3, -0.3] {
        let mut rail = points.clone();
        rail[middle][1] += off;
        let found = solved(&accepted(&on_rail(&rail)));
        let told = found.remarks.iter().find(|r| r.code == "profile-outlier");
        let told = told.unwrap_or_else(|| panic!("{:?}", found.remarks));
        let at = serde_json::to_value(told).expect("JSON")["at_y_mm"].as_f64();
        assert!(
            (at.expect("a place") - points[middle][0]).abs() < 1e-3,
            "{told:?}"
        );
    }
}

#[test]
fn a_hole_of_8_mm_and_every_tenth_point_are_told_or_refused() {
    let sound = pressure_max(&solved(&on_rail(&rail_60e1())));
    let thinned: Vec<_> = rail_60e1().into_iter().step_by(40).collect();
    for rail in [without(&rail_60e1(), -4.0, 4.0), thinned] {
        let case = accepted(&on_rail(&rail));
        let found = solved(&case);
        let wrong = (pressure_max(&found) / sound - 1.0).abs() > 0.05;
        assert!(!wrong || !blamed(&found).is_empty(), "{:?}", found.remarks);
    }
}

#[test]
fn linear_resampling_is_named_and_the_smoothing_named_heals_it() {
    // A loose target has a grid too coarse to resolve the peaks at the corners between chords.
    let on_rail =
        |rail: &[[f64; 2]]| put(&on_rail(rail), "solver", json!({ "target_error": 0.005 }));
    let sound = pressure_max(&solved(&on_rail(&rail_60e1())));
    let rail = linear(&resampled(&rail_60e1(), 1.5), 5000);
    let found = solved(&on_rail(&rail));
    let peak = pressure_max(&found);
    assert!(peak > 1.1 * sound, "{peak} {sound}");
    let remark = found
        .remarks
        .iter()
        .find(|remark| remark.code == "profile-polygon");
    let remark = remark.unwrap_or_else(|| panic!("{:?}", found.remarks));
    assert_eq!(remark.pointer.as_deref(), Some("/contact/rail"));
    assert!(remark.detail.contains("smoothing_mm"), "{}", remark.detail);
    let advised = found.patches[0].quality.clone().expect("a quality").rail;
    let mut smoothed = on_rail(&rail);
    smoothed["contact"]["rail"]["smoothing_mm"] = json!(advised.smoothing_suggested_mm);
    let healed = solved(&smoothed);
    let error = (pressure_max(&healed) / sound - 1.0).abs();
    assert!(
        error < 0.06,
        "{error} with {}",
        advised.smoothing_suggested_mm
    );
}

#[test]
fn coordinates_rounded_to_a_micrometre_are_noise() {
    let mut random = Random(3);
    let rail = Damage::Rounded(0.001).done_to(&rail_60e1(), CROWN, &mut random);
    let wheel = Damage::Rounded(0.001).done_to(&s1002(), CROWN, &mut random);
    let mut told = 0;
    for shift in [0.0, 3.0, 5.0, 5.4] {
        let at = |case: Value| put(&case, "contact", json!({ "lateral_shift_mm": shift }));
        let sound = pressure_max(&solved(&at(on_rail(&rail_60e1()))));
        let found = solved(&at(with(&tread(), &rail, &wheel, 0.0)));
        let remark = found
            .remarks
            .iter()
            .find(|remark| remark.code == "profile-noise");
        let wrong = (pressure_max(&found) / sound - 1.0).abs();
        assert!(wrong < 0.1 || remark.is_some(), "{shift}: {wrong}");
        if let Some(remark) = remark {
            told += 1;
            assert!(
                remark.detail.contains("rounded to 0.001 mm"),
                "{}",
                remark.detail
            );
            assert!(
                remark.detail.contains("smoothing_mm: 2"),
                "{}",
                remark.detail
            );
        }
    }
    assert!(told > 0);
}

#[test]
fn outliers_and_steps_are_told_with_their_place() {
    let points = resampled(&rail_60e1(), 0.25);
    let middle = points.len() / 2;
    let mut outlier = points.clone();
    outlier[middle][1] -= 0.2;
    let mut step = points.clone();
    step.iter_mut().skip(middle).for_each(|at| at[1] -= 0.05);
    for (rail, code) in [(outlier, "profile-outlier"), (step, "profile-step")] {
        let found = solved(&accepted(&on_rail(&rail)));
        let told = found.remarks.iter().find(|remark| remark.code == code);
        let told = told.unwrap_or_else(|| panic!("{code}: {:?}", found.remarks));
        let at = serde_json::to_value(told).expect("JSON")["at_y_mm"].as_f64();
        let at = at.expect("a place");
        assert!((at - points[middle][0]).abs() < 0.3, "{code} at {at}");
    }
}

#[test]
fn spikes_do_not_hide_the_shape_of_dense_points() {
    let mut random = Random(5);
    let [rail, wheel] = [rail_60e1(), s1002()].map(|points| {
        let mut points = resampled(&points, 0.04);
        for _ in 0..20 {
            let k = random.below(points.len());
            points[k][1] += random.sign() * random.between(0.05, 2.0);
        }
        points
    });
    let found = solved(&accepted(&with(&tread(), &rail, &wheel, 0.0)));
    let codes: Vec<&str> = found.remarks.iter().map(|r| r.code.as_str()).collect();
    assert!(codes.contains(&"profile-points-dropped"), "{codes:?}");
    assert_eq!(found.patches.len(), 1);
}

/// The ridge under the point is nearly two hundred times as long as wide.
#[test]
fn a_ridge_under_an_outlier_is_refused_or_remarked_on_with_its_place() {
    let mut rail = resampled(&rail_60e1(), 0.25);
    let middle = rail.len() / 2;
    rail[middle][1] -= 0.3;
    let mut case = on_rail(&rail);
    case["motion"] = json!({ "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0003 });
    for accept in [false, true] {
        for method in ["auto", "boundary_element"] {
            let mut case = put(&case, "contact", json!({ "accept_rough_profiles": accept }));
            case["solver"]["method"] = json!(method);
            let checked = check(&case, &Limits::default()).expect("a case");
            let told = match solve(&checked, &Unmonitored) {
                Ok((found, _)) => {
                    let told = found.remarks.iter().find(|r| r.code == "profile-outlier");
                    told.expect("a remark").detail.clone()
                }
                Err(SolveError::RoughProfile { reason, .. }) if !accept => {
                    assert!(reason.contains("accept_rough_profiles"), "{reason}");
                    reason
                }
                Err(other) => panic!("{other}"),
            };
            assert!(told.contains("300 µm off"), "{told}");
        }
    }
}

#[test]
fn noise_that_a_smoothing_leaves_is_told_and_auto_chooses_more() {
    let mut random = Random(11);
    let rail = Damage::Noise(0.02).done_to(&rail_60e1(), CROWN, &mut random);
    let wheel = Damage::Noise(0.02).done_to(&s1002(), CROWN, &mut random);
    let found = solved(&with(&tread(), &rail, &wheel, 3.0));
    assert!(!blamed(&found).is_empty(), "{:?}", found.remarks);
    let found = solved(&with(&tread(), &rail, &wheel, "auto"));
    let chosen: Vec<_> = found
        .remarks
        .iter()
        .filter(|r| r.code == "smoothing-chosen")
        .collect();
    assert_eq!(chosen.len(), 2, "{:?}", found.remarks);
    let used = found.patches[0]
        .quality
        .clone()
        .expect("a quality")
        .rail
        .smoothing_mm;
    assert!((5.0..=8.0).contains(&used), "{used}");
}

#[test]
fn auto_leaves_sound_profiles_as_they_are() {
    let plain = solved(&on_rail(&rail_60e1()));
    let auto = solved(&with(&tread(), &rail_60e1(), &s1002(), "auto"));
    assert_eq!(plain.total[0].force_x_n, auto.total[0].force_x_n);
    assert_eq!(pressure_max(&plain), pressure_max(&auto));
}

#[test]
fn exchanged_profiles_are_refused_and_a_single_one_is_told() {
    let exchanged = with(&tread(), &s1002(), &rail_60e1(), 0.0);
    let error = check(&exchanged, &Limits::default()).expect_err("exchanged");
    let pointers: Vec<&str> = error.0.iter().map(|fault| fault.pointer.as_str()).collect();
    assert_eq!(pointers, ["/contact/rail", "/contact/wheel"]);
    assert!(error.0[0].detail.contains("looks like a wheel"), "{error}");
    let twice = with(&tread(), &s1002(), &s1002(), 0.0);
    let checked = check(&twice, &Limits::default()).expect("a case");
    let told = checked
        .remarks
        .iter()
        .find(|r| r.code == "profile-of-other-body");
    assert_eq!(
        told.and_then(|r| r.pointer.as_deref()),
        Some("/contact/rail")
    );
    let twice = with(&tread(), &rail_60e1(), &rail_60e1(), 0.0);
    let told = match check(&twice, &Limits::default()) {
        Ok(checked) => checked
            .remarks
            .iter()
            .find(|r| r.code == "profile-of-other-body")
            .and_then(|r| r.pointer.clone()),
        Err(faults) => faults.0.first().map(|fault| fault.pointer.clone()),
    };
    assert_eq!(told.as_deref(), Some("/contact/wheel"));
}

#[test]
fn a_contact_on_the_tip_of_the_flange_is_told() {
    let case = put(
        &on_rail(&rail_60e1()),
        "contact",
        json!({ "lateral_shift_mm": -40.0 }),
    );
    let found = solved(&accepted(&case));
    let told = found
        .remarks
        .iter()
        .any(|remark| remark.code == "contact-on-flange-tip");
    assert!(told, "{:?}", found.remarks);
}

#[test]
fn a_contact_near_the_end_of_a_profile_is_told_with_what_is_left() {
    let whole = solved(&on_rail(&rail_60e1()));
    let under = whole.patches[0].quality.clone().expect("a quality").rail;
    let end = under.y_mm[1] + 3.0;
    let short: Vec<_> = rail_60e1().into_iter().filter(|at| at[0] <= end).collect();
    let found = solved(&on_rail(&short));
    let told = found
        .remarks
        .iter()
        .find(|r| r.code == "contact-at-profile-end");
    let told = told.unwrap_or_else(|| panic!("{:?}", found.remarks));
    assert_eq!(told.pointer.as_deref(), Some("/contact/rail"));
    let left = serde_json::to_value(told).expect("JSON")["left_mm"].as_f64();
    assert!((2.5..3.3).contains(&left.expect("a figure")), "{left:?}");
    assert!(
        whole
            .remarks
            .iter()
            .all(|r| r.code != "contact-at-profile-end")
    );
    // A contact that is itself cut off has no answer.
    let cut: Vec<_> = rail_60e1()
        .into_iter()
        .filter(|at| at[0] <= under.y_mm[1] - 1.0)
        .collect();
    let checked = check(&on_rail(&cut), &Limits::default()).expect("a case");
    let error = solve(&checked, &Unmonitored)
        .map(|_| ())
        .expect_err("cut off")
        .to_string();
    assert!(error.contains("end of a profile"), "{error}");
}

#[test]
fn what_is_known_before_the_solve_is_in_the_check() {
    let mut random = Random(5);
    let rail = Damage::Noise(0.005).done_to(&rail_60e1(), CROWN, &mut random);
    let rail = without(&rail, 10.0, 22.0);
    let checked = check(&on_rail(&rail), &Limits::default()).expect("a case");
    let quality = checked.quality().expect("a quality");
    let noise = quality.rail.noise_um.expect("noise");
    assert!((4.0..6.0).contains(&noise), "{noise}");
    assert!((12.0..14.0).contains(&quality.rail.hole_mm), "{quality:?}");
    assert!(
        (3.0..8.0).contains(&quality.rail.smoothing_suggested_mm),
        "{quality:?}"
    );
    assert!(quality.wheel.noise_um.expect("noise") < 0.1, "{quality:?}");
    let plain = check(&on_rail(&rail_60e1()), &Limits::default()).expect("a case");
    assert!(checked.cost().seconds > plain.cost().seconds);
}

/// Returns a pair with points this far apart in mm and white noise of this standard deviation in mm.
fn noisy(spacing: f64, noise: f64, seed: u64) -> Value {
    let mut random = Random(seed);
    let [rail, wheel] = [rail_60e1(), s1002()].map(|points| {
        let points = resampled(&points, spacing);
        off_normal(&points, |_, _| noise * normal(&mut random))
    });
    with(&tread(), &rail, &wheel, "auto")
}

fn smoothings(found: &Solution) -> [f64; 2] {
    let quality = found.patches[0].quality.clone().expect("a quality");
    [quality.rail.smoothing_mm, quality.wheel.smoothing_mm]
}

pub fn has(found: &Solution, code: &str) -> bool {
    found.remarks.iter().any(|remark| remark.code == code)
}

#[test]
fn auto_smooths_the_noise_of_coarse_points_and_what_that_leaves_open_is_known() {
    let sound = solved(&on_rail(&rail_60e1()));
    let limit = 0.3 * sound.patches.iter().map(|p| p.normal_force_n).sum::<f64>();
    for seed in 1..=4 {
        let found = solved(&noisy(1.7, 0.005, seed));
        let used = smoothings(&found);
        assert!(used.iter().all(|length| *length > 4.0), "{seed}: {used:?}");
        let open = found.total[0].profile_uncertainty.expect("an uncertainty");
        let pressure = (pressure_max(&found) - pressure_max(&sound)).abs();
        assert!(
            pressure < open.pressure_max_mpa,
            "{seed}: {pressure} {open:?}"
        );
        let force = (found.total[0].force_x_n - sound.total[0].force_x_n).abs();
        assert!(
            force < open.force_x_n.min(0.06 * limit),
            "{seed}: {force} {open:?}"
        );
    }
    // Exact points with the same spacing are not smoothed and cause no remark.
    let clean = solved(&noisy(1.7, 0.0, 1));
    assert_eq!(smoothings(&clean), [0.0; 2]);
    assert!(!has(&clean, "smoothing-undecided"), "{:?}", clean.remarks);
}

/// Short chords of noisy points turn by more than the 30° of a corner.
#[test]
fn auto_smooths_the_noise_of_dense_points() {
    let sound = solved(&on_rail(&rail_60e1()));
    for (spacing, noise) in [(0.1, 0.02), (0.05, 0.01)] {
        for seed in 1..=2 {
            let found = solved(&noisy(spacing, noise, seed));
            assert_eq!(found.patches.len(), sound.patches.len(), "{spacing} {seed}");
            let ratio = pressure_max(&found) / pressure_max(&sound);
            assert!((0.75..1.3).contains(&ratio), "{spacing} {seed}: {ratio}");
        }
    }
}

#[test]
fn auto_says_so_where_points_are_too_far_apart_to_tell_noise_from_shape() {
    let auto = accepted(&noisy(5.0, 0.005, 1));
    let mut plain = auto.clone();
    for body in ["rail", "wheel"] {
        plain["contact"][body]["smoothing_mm"] = json!(0.0);
    }
    let (auto, plain) = (solved(&auto), solved(&plain));
    let undecided = auto
        .remarks
        .iter()
        .filter(|r| r.code == "smoothing-undecided");
    assert_eq!(undecided.count(), 2, "{:?}", auto.remarks);
    assert!(!has(&auto, "smoothing-chosen") && !has(&plain, "smoothing-undecided"));
    let open = |found: &Solution| {
        let open = found.total[0].profile_uncertainty.expect("an uncertainty");
        open.pressure_max_mpa / pressure_max(found)
    };
    assert!(
        open(&auto) >= open(&plain),
        "{} {}",
        open(&auto),
        open(&plain)
    );
    assert!(open(&auto) > 0.05, "{}", open(&auto));
}

#[test]
fn a_hole_is_blamed_where_the_curve_over_it_is_open_or_it_may_hide_an_arc() {
    let points = resampled(&rail_60e1(), 0.25);
    let at = |shift: f64, force: f64, rail: &[[f64; 2]]| {
        let mut case = put(
            &accepted(&on_rail(rail)),
            "contact",
            json!({ "lateral_shift_mm": shift }),
        );
        case["load"] = json!({ "vertical_force_n": force });
        solved(&case)
    };
    // On the arc of 300 mm the curve across a hole is known. At the end of that arc toward the arc of 80 mm it is not.
    for (shift, force, length, told) in [
        (1.0, 1e3, 6.0, false),
        (1.0, 1e3, 14.0, true),
        (-1.0, 4e3, 4.0, true),
    ] {
        let sound = at(shift, force, &points);
        let middle = sound.patches[0].position.expect("a place").rail_mm[0];
        let rail = without(&points, middle - 0.5 * length, middle + 0.5 * length);
        let found = at(shift, force, &rail);
        let quality = found.patches[0].quality.clone().expect("a quality").rail;
        assert!(quality.spacing_over_width > 1.2, "{quality:?}");
        assert_eq!(
            !blamed(&found).is_empty(),
            told,
            "{length}: {:?}",
            found.remarks
        );
        let error = (pressure_max(&found) / pressure_max(&sound) - 1.0).abs();
        assert!(told || error < 0.01, "{error}");
        assert!(force < 2e3 || error > 0.1, "{error}");
    }
}
