//! Tests that the assessment of a profile names its defect. Each profile has one kind of defect, of varying size and place, and is sound otherwise.

use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::damaged::{Points, normal, off_normal, resampled, with};
use crate::profile_assessment::tread;
use crate::profile_shapes::{rail_60e1, s1002};
use crate::random::Random;

/// The seed that the assessment was developed with, and another one.
const SEEDS: [u64; 2] = [1, 70_001];
/// Number of defects of each kind and seed.
const EACH: usize = 2;

/// A kind of defect: its name, the damaged rail, and the remarks that an answer may have.
struct Kind {
    name: &'static str,
    damage: fn(&mut Random) -> Points,
    named: &'static [&'static str],
}

const KINDS: [Kind; 7] = [
    Kind {
        name: "outlier",
        damage: |random| jittered(random, 1),
        named: &["the rail's point at"],
    },
    Kind {
        name: "jitter",
        damage: |random| {
            let count = 2 + random.below(4);
            jittered(random, count)
        },
        named: &["the rail's points jump"],
    },
    Kind {
        name: "step",
        damage: stepped,
        named: &["the rail's points jump by"],
    },
    Kind {
        name: "linear resampling",
        damage: on_chords,
        named: &["lie on straight chords"],
    },
    Kind {
        name: "rounding",
        damage: rounded,
        named: &["(heights rounded to"],
    },
    Kind {
        name: "noise",
        damage: noisy,
        named: &["noise of"],
    },
    Kind {
        name: "nothing",
        damage: |random| resampled(&rail_60e1(), random.between(0.15, 0.7)),
        named: &[],
    },
];

/// Returns the index of a point near the contact of [`tread`], which lies within some mm of y = 0 on the rail.
fn near_contact(points: &[[f64; 2]], random: &mut Random) -> usize {
    let place = random.between(-4.0, 4.0);
    points.partition_point(|at| at[0] < place)
}

/// Returns a rail with neighbouring points displaced to alternate sides, sometimes with noise of 1 µm everywhere.
fn jittered(random: &mut Random, count: usize) -> Points {
    let points = resampled(&rail_60e1(), random.between(0.2, 0.5));
    let first = near_contact(&points, random);
    let (height, noise) = (random.decades(0.02, 0.3), 1e-3 * random.below(2) as f64);
    let sign = random.sign();
    let points = off_normal(&points, |_, _| noise * normal(random));
    off_normal(&points, |k, _| match k.checked_sub(first) {
        Some(j) if j < count => sign * height * if j % 2 == 0 { 1.0 } else { -1.0 },
        _ => 0.0,
    })
}

fn stepped(random: &mut Random) -> Points {
    let points = resampled(&rail_60e1(), random.between(0.2, 0.5));
    let first = near_contact(&points, random);
    let height = random.sign() * random.decades(0.01, 0.1);
    off_normal(&points, |k, _| if k > first { height } else { 0.0 })
}

/// Returns evenly spaced points on chords, written with five decimals. The corners of the chords are points only by chance.
fn on_chords(random: &mut Random) -> Points {
    let corners = resampled(&rail_60e1(), random.decades(0.8, 5.0));
    let spacing = random.between(0.15, 0.25);
    let mut along = vec![0.0];
    for pair in corners.windows(2) {
        let chord = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        along.push(along[along.len() - 1] + chord);
    }
    let count = (along[along.len() - 1] / spacing) as usize;
    let start = random.between(0.0, spacing);
    let at = |k: usize| {
        let s = start + spacing * k as f64;
        let i = along
            .partition_point(|knot| *knot <= s)
            .clamp(1, corners.len() - 1);
        let t = (s - along[i - 1]) / (along[i] - along[i - 1]);
        [0, 1].map(|part| {
            let value = corners[i - 1][part] * (1.0 - t) + corners[i][part] * t;
            (value * 1e5).round() * 1e-5
        })
    };
    (0..count).map(at).collect()
}

fn rounded(random: &mut Random) -> Points {
    let step = [0.001, 0.01][random.below(2)];
    let points = resampled(&rail_60e1(), random.between(0.2, 0.6));
    let round = |part: f64| (part / step).round() * step;
    points.iter().map(|at| at.map(round)).collect()
}

fn noisy(random: &mut Random) -> Points {
    let points = resampled(&rail_60e1(), random.between(0.2, 0.6));
    let deviation = random.decades(3e-4, 2e-2);
    off_normal(&points, |_, _| deviation * normal(random))
}

/// Returns the remarks of the answer, or of the refusal, on the rail.
fn verdicts(case: &Value) -> Vec<String> {
    let checked = check(case, &Limits::default()).expect("a case");
    match solve(&checked, &Unmonitored) {
        Ok((solution, _)) => {
            let remarks = solution.remarks.iter();
            let of_rail = remarks.filter(|remark| {
                remark.code.starts_with("profile-")
                    && remark.pointer.as_deref() == Some("/contact/rail")
            });
            of_rail.map(|remark| remark.detail.clone()).collect()
        }
        Err(SolveError::RoughProfile { reason, .. }) => vec![reason],
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn every_defect_is_named_for_what_it_is() {
    let mut wrong = Vec::new();
    for kind in &KINDS {
        let mut named = 0;
        for seed in SEEDS {
            let mut random = Random(seed);
            for k in 0..EACH {
                let rail = (kind.damage)(&mut random);
                let mut case = with(&tread(), &rail, &s1002(), 0.0);
                case["motion"] = json!({ "creepage_x": 0.001 });
                for text in verdicts(&case) {
                    let right = kind.named.iter().any(|start| text.contains(start));
                    named += usize::from(right);
                    if !right {
                        wrong.push(format!("{} {seed} {k}: {text}", kind.name));
                    }
                }
            }
        }
        assert!(
            named > 0 || kind.named.is_empty(),
            "{} is never named",
            kind.name
        );
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Tests that automatic smoothing applies any helpful smoothing, so that no remark recommends one.
#[test]
fn auto_never_ends_in_the_advice_to_smooth() {
    let mut random = Random(5);
    for kind in &KINDS {
        let rail = (kind.damage)(&mut random);
        let mut case = with(&tread(), &rail, &s1002(), 0.0);
        case["contact"]["rail"]["smoothing_mm"] = json!("auto");
        case["motion"] = json!({ "creepage_x": 0.001 });
        for text in verdicts(&case) {
            assert!(!text.contains("give smoothing_mm"), "{}: {text}", kind.name);
        }
    }
}
