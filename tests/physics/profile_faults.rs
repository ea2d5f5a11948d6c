//! Tests that faulty profiles are refused, and that doubtful ones get remarks.

use railhead_contact::geometry::contact_locus::ContactLocus;
use railhead_contact::geometry::profile::{Body, Profile, Reading};
use railhead_contact::geometry::wheel_rail::WheelRail;
use railhead_contact::remark::list::Remark;
use serde_json::Value;

use crate::profile_geometry::placement;
use crate::profile_shapes::{rail_60e1, s1002};

const AS_GIVEN: Reading = Reading {
    mirror_y: Some(false),
    mirror_z: Some(false),
    smoothing: 0.0,
};

fn rail(points: &[[f64; 2]]) -> Result<Profile, String> {
    Profile::new(Body::Rail, points, AS_GIVEN)
}

fn scaled(factor: f64) -> Vec<[f64; 2]> {
    rail_60e1()
        .iter()
        .map(|point| point.map(|part| part * factor))
        .collect()
}

fn length(points: &[[f64; 2]]) -> f64 {
    points
        .windows(2)
        .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
        .sum()
}

#[test]
fn another_unit_is_told_by_the_arc_length_on_both_sides() {
    for factor in [1e-3, 10.0] {
        let fault = rail(&scaled(factor)).unwrap_err();
        assert!(fault.contains("unit"), "{fault}");
    }
    let whole = length(&rail_60e1());
    for (length, allowed) in [(9.99, false), (10.01, true), (499.0, true), (501.0, false)] {
        assert_eq!(rail(&scaled(length / whole)).is_ok(), allowed, "{length}");
    }
}

#[test]
fn too_few_points_and_no_numbers_are_refused() {
    let points = rail_60e1();
    assert!(
        rail(&points[..7])
            .unwrap_err()
            .starts_with("7 points given")
    );
    for number in [f64::NAN, f64::INFINITY] {
        let mut points = points.clone();
        points[17][1] = number;
        assert_eq!(rail(&points).unwrap_err(), "point 17 is not finite");
    }
    let same: Vec<[f64; 2]> = [[0.0, 0.0], [10.0, 0.0]].repeat(20);
    assert!(rail(&same).is_err());
}

#[test]
fn loops_are_refused() {
    let circle = |k: usize| {
        let angle = k as f64 * 0.05;
        [
            10.0 * angle.sin() + 0.3 * k as f64 * 0.05,
            -10.0 * angle.cos(),
        ]
    };
    let points: Vec<[f64; 2]> = (0..180).map(circle).collect();
    let fault = rail(&points).unwrap_err();
    assert!(fault.contains("loops are refused"), "{fault}");
}

#[test]
fn points_that_are_given_twice_are_refused() {
    // The chord from the last point back to the first crosses no other chord.
    let text = include_str!("../../api/examples/wheel-rail.case.json");
    let case: Value = serde_json::from_str(text).unwrap();
    let given: Vec<[f64; 2]> =
        serde_json::from_value(case["contact"]["rail"]["points_mm"].clone()).unwrap();
    for times in [2, 3] {
        let fault = rail(&given.repeat(times)).unwrap_err();
        assert!(fault.contains("given twice"), "{fault}");
    }
}

#[test]
fn single_points_that_run_back_are_dropped_with_a_remark() {
    let mut points = rail_60e1();
    let clean = rail(&points).unwrap();
    assert_eq!(clean.remarks, Vec::new());
    points.swap(100, 101);
    points.insert(200, points[198]);
    let found = rail(&points).unwrap();
    assert!(
        matches!(
            found.remarks[..],
            [
                Remark::ProfilePointsDropped {
                    profile: "rail",
                    count: 2
                },
                // The points that ran back left a duplicate point.
                Remark::ProfilePointsMerged { count: 1, .. }
            ]
        ),
        "{:?}",
        found.remarks
    );
    let [first, last] = clean.range();
    for k in 0..100 {
        let [y, z] = clean.at(first + (last - first) * f64::from(k) / 99.0).at;
        let near = found.parameters(0.05).into_iter().map(|s| found.at(s).at);
        let away = near
            .map(|at| (at[0] - y).hypot(at[1] - z))
            .fold(f64::INFINITY, f64::min);
        assert!(away < 0.04, "{away} at {y}");
    }
}

#[test]
fn points_without_order_are_refused() {
    let given = rail_60e1();
    let shuffled: Vec<[f64; 2]> = (0..given.len())
        .map(|k| given[k * 97 % given.len()])
        .collect();
    assert!(!given.len().is_multiple_of(97));
    assert!(rail(&shuffled).is_err());
}

#[test]
fn order_and_senses_are_found_or_taken_from_the_statement() {
    let expected = Profile::new(Body::Wheel, &s1002(), AS_GIVEN).unwrap();
    for (y, z) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        for reversed in [false, true] {
            let mut points: Vec<[f64; 2]> = s1002()
                .iter()
                .map(|point| [y * point[0], z * point[1]])
                .collect();
            if reversed {
                points.reverse();
            }
            let found = Profile::new(Body::Wheel, &points, Reading::default()).unwrap();
            let stated = Reading {
                mirror_y: Some(y < 0.0),
                mirror_z: Some(z < 0.0),
                smoothing: 0.0,
            };
            let stated = Profile::new(Body::Wheel, &points, stated).unwrap();
            assert_eq!(found.remarks.is_empty(), y > 0.0 && z > 0.0);
            for s in [0.0, 20.0, 60.0, 100.0] {
                for part in 0..2 {
                    let value = expected.at(s).at[part];
                    assert!((found.at(s).at[part] - value).abs() < 1e-9);
                    assert!((stated.at(s).at[part] - value).abs() < 1e-9);
                }
            }
        }
    }
    let flat: Vec<[f64; 2]> = (0..20).map(|k| [f64::from(k), 0.0]).collect();
    let fault = Profile::new(Body::Rail, &flat, Reading::default()).unwrap_err();
    assert!(fault.contains("mirror_z"), "{fault}");
}

#[test]
fn smoothing_takes_roughness_away_and_keeps_the_shape() {
    let noise = |k: usize| 0.005 * (((k * 7919) % 101) as f64 / 50.0 - 1.0);
    let rough: Vec<[f64; 2]> = rail_60e1()
        .iter()
        .enumerate()
        .map(|(k, [y, z])| [*y, z + noise(k)])
        .collect();
    let curvature = |smoothing: f64| {
        let profile = Profile::new(
            Body::Rail,
            &rough,
            Reading {
                smoothing,
                ..AS_GIVEN
            },
        )
        .unwrap();
        let [first, last] = profile.range();
        let middle = 0.5 * (first + last);
        (-50..=50)
            .map(|k| (profile.at(middle + 0.1 * f64::from(k)).curvature() + 1.0 / 300.0).abs())
            .fold(0.0, f64::max)
    };
    assert!(curvature(0.0) > 0.05);
    assert!(curvature(8.0) < 0.005, "{}", curvature(8.0));
}

#[test]
fn a_wheel_beside_the_rail_has_no_contact() {
    let bodies = [(Body::Rail, rail_60e1()), (Body::Wheel, s1002())]
        .map(|(body, points)| Profile::new(body, &points, AS_GIVEN).unwrap());
    let [rail, wheel] = bodies;
    let mut apart = placement();
    apart.lateral_shift = 500.0;
    let geometry = WheelRail::new(rail.clone(), wheel.clone(), apart).unwrap();
    assert!(
        ContactLocus::new(&geometry)
            .unwrap_err()
            .contains("no part of the wheel lies above the rail")
    );
    let mut tiny = placement();
    tiny.rolling_radius = 2.0;
    assert!(
        WheelRail::new(rail, wheel, tiny)
            .unwrap_err()
            .to_string()
            .contains("axle")
    );
}
