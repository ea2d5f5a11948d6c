//! The class *damaged profile*: how many wrong answers get a remark, how many right ones get one, and how often the uncertainty covers the error.

use std::fmt::Write as _;

use serde_json::{Value, json};

use crate::damaged::{Damage, held_out, tuned_on};
use crate::damaged_trials::{Counts, rows_of};

/// Number of positions on each pair.
const PLACES: usize = 12;

/// Returns the tables over held-out pairs and over those of the thresholds, without smoothing and with `auto`.
pub fn tables(seed: u64) -> String {
    let mut text = "## Damaged profiles\n\nSound pairs at random places (shift, yaw, load), their points damaged at or near the contact: coarse, holes, polygons, rounding,\n\
         white noise, outliers, steps, waves of 1 to 4 mm. *Wrong*: the largest pressure by more than 10 % or a force by more than 3 % of μN; *right*: within 3 % and\n\
         1 %. *Told*: a remark blames the profile. *Covered*: the error is within `profile_uncertainty`.\n\n"
        .to_owned();
    let populations = [
        ("held-out pairs", held_out()),
        ("pairs of the thresholds", tuned_on()),
    ];
    for (name, pairs) in populations {
        for smoothing in [json!(0.0), json!("auto")] {
            let mut rows = [Counts::default(); Damage::KINDS];
            let sound = rows_of(&pairs, seed, PLACES, None, &smoothing, &mut rows);
            let _ = writeln!(
                text,
                "{name}, smoothing {}: {} of {} sound places blamed\n\n\
                 | damage | cases | no answer | wrong: told | right: told | pressure covered | forces covered |\n|---|---|---|---|---|---|---|",
                named(&smoothing),
                sound.sound_blamed,
                sound.sound
            );
            for (kind, row) in rows.iter().enumerate() {
                let _ = writeln!(text, "{}", line(Damage::NAMES[kind], row));
            }
            let all = rows
                .iter()
                .fold(Counts::default(), super::damaged_trials::Counts::and);
            let _ = writeln!(text, "{}\n", line("all", &all));
        }
    }
    text
}

fn named(smoothing: &Value) -> String {
    smoothing
        .as_str()
        .map_or_else(|| "none".to_owned(), str::to_owned)
}

fn line(name: &str, row: &Counts) -> String {
    let answered = row.damaged - row.refused;
    format!(
        "| {name} | {} | {} | {} of {} | {} of {} | {} of {answered} | {} of {answered} |",
        row.damaged,
        row.refused,
        row.wrong_told,
        row.wrong,
        row.right_told,
        row.right,
        row.pressure_covered,
        row.force_covered
    )
}
