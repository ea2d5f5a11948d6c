//! Tests that frames and creepages of wheel and rail agree with CONTACT's. Needs the reference files next to the checkout.

use railhead_contact::geometry::contact_locus::ContactLocus;
use railhead_contact::geometry::formats;
use railhead_contact::geometry::formats::Format;
use railhead_contact::geometry::profile::{Body, Profile, Reading};
use railhead_contact::geometry::reference_curve::{CurvePlace, ReferenceCurve, RigidMotion};
use railhead_contact::geometry::wheel_rail::{Placement, WheelRail};
use railhead_contact::geometry::wheelset_pose::WheelsetMotion;
use serde_json::Value;

use crate::profile_geometry::placement;
use crate::profile_reference_files::reference_file;

fn profile(name: &str, body: Body) -> Option<Profile> {
    let contents = formats::read(Format::Simpack, &reference_file(name)?).unwrap();
    let reading = Reading {
        mirror_y: contents.mirror_y,
        mirror_z: contents.mirror_z,
        smoothing: 0.0,
    };
    Some(Profile::new(body, &contents.points, reading).unwrap())
}

fn list(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

/// In the records, body 1 is the rail and z points down. The rotation by half a turn about x changes the signs of y, yaw and lateral creepage or
/// keeps them, as below. The roll is not stored. It follows from the place of the contact in the track and on the wheel.
#[test]
fn frames_and_creepages_agree_with_contact() {
    let (Some(rail), Some(wheel), Some(text)) = (
        profile("profiles/MBench_UIC60_v3.prr", Body::Rail),
        profile("profiles/MBench_S1002_v3.prw", Body::Wheel),
        reference_file("profile_module1.json"),
    ) else {
        return;
    };
    let records: Vec<Value> = serde_json::from_str(&text).unwrap();
    let mut compared = 0;
    for record in &records {
        let (input, patch) = (&record["input"], &record["patches"][0]);
        let number = |name: &str| input[name].as_f64();
        let (Some(yaw), Some(pitch), Some(shift)) = (
            number("yaw_rad"),
            number("vpitch_rad_per_s"),
            number("y_ws_mm"),
        ) else {
            continue;
        };
        let on_track = list(&patch["contact_ref_track_xyz_delta_and_rail_yz"]);
        let on_wheel = list(&patch["contact_ref_wheel"]);
        let converged = |name: &str| patch["converged"][name]["value"].as_f64().unwrap();
        let along = (750.0 + on_wheel[1]) * yaw.cos() + on_wheel[0] * yaw.sin();
        let roll = -(on_track[1] - shift - along) / (460.0 + on_wheel[2]);
        let geometry = WheelRail::new(
            rail.clone(),
            wheel.clone(),
            Placement {
                cant: 0.0,
                lateral_shift: -shift,
                yaw: -yaw,
                roll,
                ..placement()
            },
        )
        .unwrap();
        let touch = ContactLocus::new(&geometry).unwrap().touch;
        let centre = touch - converged("approach_mm") / on_track[3].cos();
        let motion = WheelsetMotion {
            speed: 2000.0,
            angular_velocity: -pitch,
            lateral_velocity: 0.0,
            yaw_rate: 0.0,
            roll_rate: 0.0,
        };
        let curve = ReferenceCurve::new(&geometry);
        let overlaps = curve.overlaps(centre);
        assert_eq!(overlaps.len(), 1, "{}", record["id"]);
        let weighted = overlaps[0].iter().fold([0.0; 3], |sum, near| {
            let cos = near.place.angle.cos();
            let own = (near.wheel.gap.abs() / cos).powf(2.5) * cos;
            [
                sum[0] + own,
                sum[1] + own * near.place.s,
                sum[2] + own * near.place.angle,
            ]
        });
        let place = CurvePlace {
            angle: weighted[2] / weighted[0],
            ..curve.at(weighted[1] / weighted[0])
        };
        let (x, wheel) = curve.nearest(&place, centre).expect("the wheel");
        let rigid = RigidMotion::of_wheelset(&geometry, centre, &motion);
        let [along, across] = rigid.slip(place.point(x, wheel.gap), &place);
        let spin = rigid.spin(&place);
        // CONTACT takes the radius at the deepest overlap. The radius here is that at the mean overlap, up to 0.5 mm away.
        assert!((-place.at[0] - on_track[1]).abs() < 0.5, "{}", record["id"]);
        assert!((place.angle - on_track[3]).abs() < 5e-3);
        let steep = 3e-4 * on_track[3].abs();
        assert!(
            (along + converged("xi")).abs() < 4e-5 + steep,
            "{}",
            record["id"]
        );
        assert!((across - converged("eta")).abs() < 1e-6);
        assert!((spin - converged("phi")).abs() < 6e-6);
        compared += 1;
    }
    assert_eq!(compared, 6);
}
