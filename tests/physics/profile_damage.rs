//! Tests of damaged profiles, in short: wrong answers get remarks, right ones and sound profiles do not, and the uncertainty due to noise is stated.
//!
//! The full tests are the class *damaged profile* of `cargo bench --bench stress`.

use serde_json::json;

use crate::damaged::{Damage, Pair, held_out, tuned_on};
use crate::damaged_trials::{Counts, rows_of};

/// Returns the counts over all kinds of damage without smoothing, or over one kind with automatic smoothing.
fn trials(pairs: &[Pair], seed: u64, places: usize, kind: Option<usize>) -> Counts {
    let smoothing = if kind.is_some() {
        json!("auto")
    } else {
        json!(0.0)
    };
    let mut rows = [Counts::default(); Damage::KINDS];
    let sound = rows_of(pairs, seed, places, kind, &smoothing, &mut rows);
    rows.iter().fold(sound, Counts::and)
}

#[test]
fn wrong_answers_on_damaged_profiles_are_told_and_right_ones_are_not() {
    let counts: Counts = trials(&[held_out(), tuned_on()].concat(), 77, 2, None);
    assert!(counts.sound > 3 && counts.sound_blamed == 0, "{counts:?}");
    assert!(counts.wrong > 20, "{counts:?}");
    assert!(100 * counts.wrong_told >= 85 * counts.wrong, "{counts:?}");
    assert!(
        100 * counts.right_told <= 12 * counts.right.max(9),
        "{counts:?}"
    );
}

#[test]
fn what_noise_leaves_open_with_the_advised_smoothing_is_known() {
    let noise = Damage::NAMES.iter().position(|name| *name == "noise");
    let counts = trials(&held_out(), 78, 4, noise);
    let answered = counts.damaged - counts.refused;
    assert!(answered >= 8, "{counts:?}");
    assert!(10 * counts.pressure_covered >= 9 * answered, "{counts:?}");
    assert!(10 * counts.force_covered >= 9 * answered, "{counts:?}");
}
