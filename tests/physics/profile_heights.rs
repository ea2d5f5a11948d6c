//! The height at which a wheel comes to rest, sought from nothing and from a rest with other readings of its profiles.

use std::sync::Arc;

use railhead::contact::case::limits::Limits;
use railhead::contact::check;
use railhead::contact::half_space::grid_operator::GridWorkspace;
use railhead::contact::monitor::Unmonitored;
use railhead::contact::normal::normal_task::NormalTask;
use railhead::contact::normal::wheel_height::search::HeightStart;
use railhead::contact::normal::wheel_height::task::{Accuracy, NormalPass, WheelTask};
use railhead::contact::normal::wheel_height::wheel_contact::WheelContact;
use serde_json::json;

use crate::profile_cases::{generated, put};

/// Smoothings of rail and wheel in mm: of the rest that is known, and of the one sought.
const READINGS: [[f64; 2]; 2] = [[0.0; 2], [4.0; 2]];
const TARGET: f64 = 0.02;
/// Two searches may end at heights whose forces differ by the tolerance of a force at this target, 0.005, of which the correction leaves a
/// part; relative to the load.
const APART: f64 = 3e-3;

fn wheel_at(shift: f64) -> Arc<WheelTask> {
    let case = put(
        &generated(),
        "contact",
        json!({ "lateral_shift_mm": shift }),
    );
    let checked = check(&case, &Limits::default()).expect("a valid case");
    match checked.problem.task {
        NormalTask::Wheel(contact) => contact,
        _ => unreachable!("the case gives profiles"),
    }
}

fn rest(wheel: &WheelTask, from: Option<&WheelContact>) -> WheelContact {
    let mut search = wheel.search().expect("a wheel over a rail");
    let start = from.map(|known| HeightStart::of_other_profiles(known, search.touch));
    let wanted = NormalPass {
        friction_share: 0.0,
        accuracy: Accuracy::For(TARGET),
    };
    let workspace = &mut GridWorkspace::default();
    let start = start.unwrap_or_default();
    let found = wheel.find_height(&mut search, wanted, start, workspace, &Unmonitored);
    found.expect("a rest")
}

/// One patch on the tread, two at the gauge corner.
#[test]
fn another_reading_of_the_profiles_is_a_start_that_saves_heights_and_changes_no_force() {
    for (shift, patches) in [(0.0, 1), (-5.5, 2)] {
        let wheel = wheel_at(shift);
        let [known, sought] = READINGS.map(|smoothing| wheel.smoothed(smoothing));
        let known = rest(&known, None);
        let [anew, near] = [None, Some(&known)].map(|from| rest(&sought, from));
        let forces = |wheel: &WheelContact| -> Vec<f64> {
            let gaps = wheel.patches.iter().map(|gap| gap.field.patches());
            gaps.flatten().map(|patch| patch.normal_force).collect()
        };
        let [other, anew_n, near_n] = [&known, &anew, &near].map(forces);
        assert_eq!(anew_n.len(), patches, "{shift} mm: {anew_n:?}");
        assert_eq!(near_n.len(), patches, "{shift} mm: {near_n:?}");
        let load: f64 = anew_n.iter().sum();
        for (a, b) in anew_n.iter().zip(&near_n) {
            assert!(
                (a - b).abs() < APART * load,
                "{shift} mm: {anew_n:?} {near_n:?}"
            );
        }
        assert!((near.centre - anew.centre).abs() < 1e-3 * anew.lowering);
        // It is a rest of its own, not the one that was known.
        assert_ne!(other, near_n, "{shift} mm");
        assert!(
            near.heights < anew.heights,
            "{shift} mm: {} {}",
            near.heights,
            anew.heights
        );
    }
}
