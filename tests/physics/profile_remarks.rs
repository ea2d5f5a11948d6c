//! Remarks on profiles by their codes: each kind of damage gets its own, at the profile that has it.

use serde_json::json;

use crate::damaged::{Damage, with};
use crate::profile_shapes::{rail_60e1, s1002};
use crate::profile_trust::{CROWN, accepted, has, on_rail, solved, tread};
use crate::random::Random;

#[test]
fn holes_coarse_points_and_waves_are_named_with_their_place() {
    let mut random = Random(7);
    for (damage, code) in [
        (Damage::Hole(8.0), "profile-hole"),
        (Damage::Coarse(8.0), "profile-spacing"),
        (Damage::Waves(0.01, 6.0), "profile-waves"),
    ] {
        let rail = damage.done_to(&rail_60e1(), CROWN, &mut random);
        let found = solved(&accepted(&on_rail(&rail)));
        let told = found.remarks.iter().find(|remark| remark.code == code);
        let told = told.unwrap_or_else(|| panic!("{code}: {:?}", found.remarks));
        assert_eq!(told.pointer.as_deref(), Some("/contact/rail"), "{code}");
        assert!(told.detail.contains("mm"), "{code}: {}", told.detail);
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
