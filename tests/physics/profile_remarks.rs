//! Tests of the remarks on profiles by their codes: each kind of damage gets its own remark, at the damaged profile.

use railhead_contact::remark::entry::RemarkEntry;
use railhead_contact::remark::kind::Figure;
use serde_json::json;

use crate::damaged::{Damage, with};
use crate::profile_assessment::{CROWN, accepted, has, on_rail, solved, tread};
use crate::profile_shapes::{rail_60e1, s1002};
use crate::random::Random;

#[test]
fn points_far_apart_and_waves_are_named_with_their_profile() {
    let mut random = Random(7);
    let whole = solved(&on_rail(&rail_60e1()));
    let under = whole.patches[0].quality.clone().expect("a quality").rail;
    let middle = 0.5 * (under.y_mm[0] + under.y_mm[1]);
    let away = |at: &[f64; 2]| (at[0] - middle).abs();
    let points = rail_60e1();
    let nearest = points.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    let place = *nearest.expect("points");
    let mut done = |damage: Damage| damage.done_to(&points, place, &mut random);
    // Short waves with few points each cannot be distinguished from noise.
    for (rail, codes) in [
        (done(Damage::Hole(20.0)), ["profile-spacing"; 2]),
        (done(Damage::Coarse(8.0)), ["profile-spacing"; 2]),
        (
            done(Damage::Waves(0.01, 3.0)),
            ["profile-waves", "profile-noise"],
        ),
    ] {
        let found = solved(&accepted(&on_rail(&rail)));
        let named = |remark: &&RemarkEntry| codes.contains(&remark.code.as_str());
        let told = found.remarks.iter().find(named);
        let told = told.unwrap_or_else(|| panic!("{codes:?}: {:?}", found.remarks));
        assert_eq!(told.pointer.as_deref(), Some("/contact/rail"), "{codes:?}");
        assert!(told.figures.contains_key("y_mm"), "{told:?}");
    }
}

#[test]
fn a_target_that_the_measurement_does_not_support_is_told() {
    let mut random = Random(5);
    let rail = Damage::Noise(0.01).done_to(&rail_60e1(), CROWN, &mut random);
    let mut case = with(&tread(), &rail, &s1002(), "auto");
    case["solver"] = json!({ "target_error": 0.001 });
    let found = solved(&accepted(&case));
    assert!(
        has(&found, "target-below-profile-uncertainty"),
        "{:?}",
        found.remarks
    );
}

/// Tests a hole next to the patch. The curve through the remaining points lies so near the wheel that it might touch.
#[test]
fn a_hole_beside_the_patch_is_told_with_its_place_and_length() {
    let points = rail_60e1();
    let whole = solved(&on_rail(&points));
    let under = whole.patches[0].quality.clone().expect("a quality").rail;
    for (from, to) in [
        (under.y_mm[1] + 0.3, under.y_mm[1] + 20.3),
        (under.y_mm[0] - 20.3, under.y_mm[0] - 0.3),
    ] {
        let kept = |p: &&[f64; 2]| p[0] < from || p[0] > to || p[1] > 20.0;
        let rail: Vec<[f64; 2]> = points.iter().filter(kept).copied().collect();
        let found = solved(&accepted(&on_rail(&rail)));
        let told = found.remarks.iter().find(|r| r.code == "profile-hole");
        let told = told.unwrap_or_else(|| panic!("{from} {to}: {:?}", found.remarks));
        assert_eq!(told.pointer.as_deref(), Some("/contact/rail"));
        let Figure::Number(length) = told.figures["hole_mm"] else {
            panic!("{told:?}")
        };
        // The length is measured along the curve, from the last point before the hole to the first after it.
        assert!((20.0..23.0).contains(&length), "{length}");
        let quality = found.patches[0].quality.clone().expect("a quality").rail;
        assert_eq!(quality.hole_mm, Some(length));
    }
}
