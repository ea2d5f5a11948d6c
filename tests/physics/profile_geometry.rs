//! Tests that wheel and rail touch at the right places.

use railhead_contact::geometry::contact_locus::ContactLocus;
use railhead_contact::geometry::formats;
use railhead_contact::geometry::formats::Format;
use railhead_contact::geometry::profile::{Body, Profile, Reading};
use railhead_contact::geometry::reference_curve::{ContactPlane, Nearest, ReferenceCurve};
use railhead_contact::geometry::wheel_rail::{Placement, RailPlace, Side, WheelRail};

use crate::profile_reference_files::reference_file;
use crate::profile_shapes::{rail_60e1, s1002};

/// Returns the placement of the Manchester contact benchmark: right side, wheelset in the middle.
pub fn placement() -> Placement {
    Placement {
        side: Side::Right,
        rolling_radius: 460.0,
        rail: RailPlace::Gauge {
            gauge: 1435.0,
            height: 14.0,
        },
        cant: 0.025,
        flange_back_distance: 1360.0,
        flange_back_position: -70.0,
        lateral_shift: 0.0,
        yaw: 0.0,
        roll: 0.0,
    }
}

const AS_GIVEN: Reading = Reading {
    mirror_y: Some(false),
    mirror_z: Some(false),
    smoothing: 0.0,
};

pub fn generated() -> [Profile; 2] {
    [(Body::Rail, rail_60e1()), (Body::Wheel, s1002())]
        .map(|(body, points)| Profile::new(body, &points, AS_GIVEN).unwrap())
}

/// Returns the roll with which both wheels of a symmetric wheelset touch symmetric rails at the same height.
pub fn roll(profiles: &[Profile; 2], placement: Placement) -> f64 {
    let difference = |roll: f64| {
        let touch = |side| {
            let placement = Placement {
                side,
                roll,
                ..placement
            };
            let geometry =
                WheelRail::new(profiles[0].clone(), profiles[1].clone(), placement).unwrap();
            ContactLocus::new(&geometry).unwrap().touch
        };
        touch(Side::Left) - touch(Side::Right)
    };
    let (mut low, mut high) = (0.0, -1e-4);
    let (mut from, mut to) = (difference(low), difference(high));
    for _ in 0..25 {
        if to == from || to.abs() < 1e-7 {
            break;
        }
        let next = high - to * (high - low) / (to - from);
        (low, from) = (high, to);
        (high, to) = (next, difference(next));
    }
    high
}

/// CONTACT's answers for case: shift to the right in mm, yaw in mrad, track's y of the patch on the right rail from the origin of the
/// benchmark's rail, and the approximate normal approach at 10 kN.
pub const MANCHESTER: [[f64; 4]; 12] = [
    [0.0, 0.0, -8.66, 0.016],
    [0.5, 1.2, -16.03, 0.019],
    [1.0, 2.4, -18.54, 0.022],
    [2.0, 4.8, -19.62, 0.023],
    [3.0, 7.2, -20.56, 0.023],
    [4.0, 9.6, -21.79, 0.022],
    [5.0, 12.0, -33.45, 0.0275],
    [5.5, 13.2, -34.42, 0.028],
    [6.0, 14.4, -35.40, 0.0275],
    [6.5, 15.6, -42.04, 0.036],
    [8.0, 19.2, -40.70, 0.035],
    [10.0, 24.0, -39.44, 0.034],
];
/// Track's y of the origin of the benchmark's rail, whose points include its cant.
pub const RAIL_ORIGIN: f64 = 760.5326;

/// Returns the track's y of the mean overlap. The weight is the squared overlap over the area, whose length along x grows as the root of the
/// overlap. CONTACT has one such point for neighbouring patches.
fn centre_of_overlap(curve: &ReferenceCurve, centre: f64) -> f64 {
    let (mut weight, mut sum) = (0.0, 0.0);
    for nearest in curve.overlaps(centre).iter().flatten() {
        let own = nearest.wheel.gap.abs().powf(2.5);
        weight += own;
        sum += own * nearest.place.at[0];
    }
    sum / weight
}

/// Returns the deepest of all overlaps.
fn deepest(curve: &ReferenceCurve, centre: f64) -> Nearest {
    let all = curve.overlaps(centre).into_iter().flatten();
    let deepest = all.min_by(|a, b| a.wheel.gap.total_cmp(&b.wheel.gap));
    deepest.expect("an overlap")
}

fn manchester(profiles: &[Profile; 2], cant: f64) -> Vec<(f64, f64, f64)> {
    let mut found = Vec::new();
    for [shift, yaw, place, approach] in MANCHESTER {
        let unrolled = Placement {
            lateral_shift: -shift,
            yaw: -yaw * 1e-3,
            cant,
            ..placement()
        };
        let placement = Placement {
            roll: roll(profiles, unrolled),
            ..unrolled
        };
        let geometry = WheelRail::new(profiles[0].clone(), profiles[1].clone(), placement).unwrap();
        let touch = ContactLocus::new(&geometry).unwrap().touch;
        let curve = ReferenceCurve::new(&geometry);
        let touching = deepest(&curve, touch - 1e-3).place;
        let lowering = approach / touching.angle.cos();
        let centre = centre_of_overlap(&curve, touch - lowering);
        found.push((shift, place, -centre - RAIL_ORIGIN));
    }
    found
}

#[test]
fn patches_of_the_manchester_benchmark_lie_where_they_should() {
    let mut sets = vec![(generated(), 0.025)];
    let file = |name: &str, body| {
        let contents = formats::read(Format::Simpack, &reference_file(name)?).unwrap();
        Some(Profile::new(body, &contents.points, AS_GIVEN).unwrap())
    };
    if let (Some(rail), Some(wheel)) = (
        file("profiles/MBench_UIC60_v3.prr", Body::Rail),
        file("profiles/MBench_S1002_v3.prw", Body::Wheel),
    ) {
        sets.push(([rail, wheel], 0.0));
    }
    for (profiles, cant) in sets {
        for (shift, place, found) in manchester(&profiles, cant) {
            assert!(
                (found - place).abs() < 0.3,
                "shift {shift}: {found} against {place}"
            );
        }
    }
}

#[test]
fn left_and_right_are_mirror_images() {
    let profiles = generated();
    let right = Placement {
        lateral_shift: -3.0,
        yaw: -0.007,
        roll: -2e-4,
        ..placement()
    };
    let left = Placement {
        side: Side::Left,
        lateral_shift: 3.0,
        yaw: 0.007,
        roll: 2e-4,
        ..placement()
    };
    let [left, right] = [left, right].map(|placement| {
        WheelRail::new(profiles[0].clone(), profiles[1].clone(), placement).unwrap()
    });
    let overlaps = |geometry: &WheelRail| {
        let touch = ContactLocus::new(geometry).unwrap().touch;
        ReferenceCurve::new(geometry).overlaps(touch - 0.03)
    };
    let [left, right] = [&left, &right].map(overlaps);
    assert_eq!((left.len(), right.len()), (1, 1));
    assert_eq!(left[0].len(), right[0].len());
    for (left, right) in left[0].iter().zip(right[0].iter().rev()) {
        assert!((left.place.s + right.place.s).abs() < 1e-9);
        assert!((left.place.at[0] + right.place.at[0]).abs() < 1e-9);
        assert!((left.place.angle + right.place.angle).abs() < 1e-9);
        assert!((left.x - right.x).abs() < 1e-9);
        assert!((left.wheel.gap - right.wheel.gap).abs() < 1e-9);
    }
}

/// Returns a cone on a cylinder: rail of radius 300 mm, wheel coned 1:20.
fn cone_on_arc() -> [Profile; 2] {
    let arc = (-30..=30)
        .map(f64::from)
        .map(|y| [y, 300.0 - (9e4 - y * y).sqrt()]);
    let cone = (-60..=60).map(f64::from).map(|y| [y, -0.05 * y]);
    let rail = Profile::new(Body::Rail, &arc.collect::<Vec<_>>(), AS_GIVEN).unwrap();
    [
        rail,
        Profile::new(Body::Wheel, &cone.collect::<Vec<_>>(), AS_GIVEN).unwrap(),
    ]
}

#[test]
fn the_gap_of_a_cone_on_an_arc_has_the_closed_form() {
    let profiles = cone_on_arc();
    let geometry = WheelRail::new(
        profiles[0].clone(),
        profiles[1].clone(),
        Placement {
            rail: RailPlace::Origin(747.5),
            cant: 0.0,
            ..placement()
        },
    )
    .unwrap();
    let lowering = 0.05;
    let centre = ContactLocus::new(&geometry).unwrap().touch - lowering;
    let curve = ReferenceCurve::new(&geometry);
    let angle = 0.05_f64.atan();
    let origin = deepest(&curve, centre).place;
    // The rail's surface has the inclination of the cone there.
    let origin = curve.at(origin.s + 300.0 * (origin.angle + angle));
    assert!((origin.angle + angle).abs() < 1e-5, "{}", origin.angle);
    let [y, _] = geometry.on_rail(origin.rail);
    assert!((y + 300.0 * angle.sin()).abs() < 0.02, "{y}");
    let plane = ContactPlane {
        origin,
        angle: origin.angle,
        range: [f64::NEG_INFINITY, f64::INFINITY],
    };
    let plane = curve.on_planes(vec![plane]);
    assert!(plane.is_flat());
    let (_, over) = plane.nearest(&origin, centre).expect("the wheel");
    let [along, _] = geometry.on_wheel(over.wheel);
    // Radius of curvature of a cone at right angles to its generator.
    let rolling = (460.0 - 0.05 * along) / angle.cos();
    for v in [-5.0, -1.7, 0.0, 0.9, 4.2] {
        let place = plane.at(origin.s + v);
        assert!((place.angle - origin.angle).abs() < 1e-12);
        let (_, start) = plane.nearest(&place, centre).expect("the wheel");
        for x in [-6.0, -2.5, 0.0, 1.0, 5.0] {
            let found = plane.over(&place, x, centre, &start).expect("the wheel");
            let expected = 0.5 * x * x / rolling + 0.5 * v * v / 300.0 - lowering * angle.cos();
            let gap = found.gap;
            assert!(
                (gap - expected).abs() < 2e-4,
                "{x} {v}: {gap} against {expected}"
            );
        }
    }
}

#[test]
fn a_larger_clearance_of_the_wheel_makes_the_overlap_smaller_by_as_much() {
    let profiles = generated();
    let geometry = WheelRail::new(
        profiles[0].clone(),
        profiles[1].clone(),
        Placement {
            lateral_shift: -6.0,
            ..placement()
        },
    )
    .unwrap();
    let touch = ContactLocus::new(&geometry).unwrap().touch;
    let curve = ReferenceCurve::new(&geometry);
    let place = deepest(&curve, touch - 0.02).place;
    let [low, high] = [0.02, 0.03].map(|lowering| {
        let (_, over) = curve.nearest(&place, touch - lowering).expect("the wheel");
        over
    });
    for expected in [low.lift, place.angle.cos()] {
        let found = (low.gap - high.gap) / 0.01;
        assert!((found - expected).abs() < 1e-2, "{found} {expected}");
    }
}

/// Tests that smoothing the profiles and moving the wheelset give the same contact in either order.
#[test]
fn a_smoothed_pair_has_the_same_contact_wherever_it_was_smoothed() {
    let [rail, wheel] = generated();
    let pair = WheelRail::new(rail, wheel, placement()).unwrap();
    for [shift, yaw, roll] in [[0.0; 3], [1.5, 4e-3, 1e-4], [3.0, 8e-3, 2e-4]] {
        for smoothing in [0.0, 2.0, 5.0] {
            let smoothing = [smoothing, 0.5 * smoothing];
            let found = pair.posed(shift, yaw, roll).smoothed(smoothing);
            let other = pair.smoothed(smoothing).posed(shift, yaw, roll);
            assert_eq!(found, other);
            let touch = |pair: &WheelRail| ContactLocus::new(pair).unwrap().touch;
            assert_eq!(touch(&found), touch(&other));
        }
    }
}
