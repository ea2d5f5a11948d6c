//! Tests that a solve polls its monitor regularly, also on the largest inputs.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::{Monitor, Stop};
use railhead_contact::{check, solve};
use serde_json::{Value, json};

use crate::damaged::{resampled, with};
use crate::profile_cases::{generated, put};
use crate::profile_shapes::{rail_60e1, s1002};

/// The longest measured interval on the inputs below is 0.04 s. The limit detects a stage without ticks. It is not a time limit.
const SILENCE_MAX: Duration = Duration::from_secs(1);

/// Counts ticks and the longest interval between two, and stops at one of them.
struct Counting {
    began: Instant,
    last: Cell<Instant>,
    silence: Cell<Duration>,
    ticks: Cell<u32>,
    stop_at: Option<u32>,
}

impl Counting {
    fn new(stop_at: Option<u32>) -> Counting {
        let now = Instant::now();
        Counting {
            began: now,
            last: Cell::new(now),
            silence: Cell::new(Duration::ZERO),
            ticks: Cell::new(0),
            stop_at,
        }
    }
}

impl Monitor for Counting {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        let now = Instant::now();
        let silence = now - self.last.replace(now);
        self.silence.set(self.silence.get().max(silence));
        self.ticks.set(self.ticks.get() + 1);
        match self.stop_at {
            Some(stop) if self.ticks.get() >= stop => ControlFlow::Break(Stop::Cancelled),
            _ => ControlFlow::Continue(()),
        }
    }

    fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }
}

/// Returns profiles with nearly the maximum number of points, in contact at gauge corner and flange.
fn long_profiles() -> Value {
    let case = put(&generated(), "contact", json!({ "lateral_shift_mm": -5.0 }));
    let fine = |points: Vec<[f64; 2]>| resampled(&points, 0.009);
    let mut case = with(&case, &fine(rail_60e1()), &fine(s1002()), 3.0);
    case["solver"] = json!({ "target_error": 0.02 });
    case
}

/// Returns a rough gap of 600 by 600 samples.
fn large_gap() -> Value {
    let count = 600;
    let axis: Vec<f64> = (0..count)
        .map(|k| 24.0 * (f64::from(k) / f64::from(count - 1) - 0.5))
        .collect();
    let row = |y: &f64| -> Vec<f64> {
        let height =
            |x: &f64| x * x / 800.0 + y * y / 600.0 + 0.003 * (5.0 * x).sin() * (7.0 * y).cos();
        axis.iter().map(height).collect()
    };
    let gap: Vec<Vec<f64>> = axis.iter().map(row).collect();
    let mut case = put(&generated(), "material", json!({}));
    case["contact"] = json!({ "type": "gap_grid", "x_mm": axis, "y_mm": axis, "gap_mm": gap });
    case["load"] = json!({ "normal_force_n": 80e3 });
    case["motion"] = json!({ "creepage_x": 0.001 });
    case["solver"] = json!({ "target_error": 0.02 });
    case
}

#[test]
fn no_stage_leaves_the_caller_unasked_on_the_largest_inputs() {
    for (name, case) in [("profiles", long_profiles()), ("gap", large_gap())] {
        let checked = check(&case, &Limits::default()).expect("a case");
        let monitor = Counting::new(None);
        solve(&checked, &monitor).expect("an answer");
        assert!(monitor.tick(1.0).is_continue());
        let silence = monitor.silence.get();
        assert!(silence < SILENCE_MAX, "{name}: {silence:?}");
        // A stop is obeyed at every tick, at once.
        let ticks = monitor.ticks.get();
        assert!(ticks > 50, "{name}: {ticks} ticks");
        for part in 1..8 {
            let stop_at = 1 + part * ticks / 9;
            let monitor = Counting::new(Some(stop_at));
            let found = solve(&checked, &monitor).map(|_| ());
            assert_eq!(found, Err(SolveError::Cancelled), "{name} at {stop_at}");
            assert_eq!(monitor.ticks.get(), stop_at, "{name}");
        }
    }
}

/// Returns a case with the back of a flange next to the face of a guard rail, 41 mm from the gauge face and 20 mm higher than the running rail.
fn beside_guard_rail() -> Value {
    let text = include_str!("../../api/examples/wheel-rail.case.json");
    let mut case: Value = serde_json::from_str(text).unwrap();
    let face = -77.5;
    let top = [-40.0, -32.0, -26.0, -20.0, -14.0].map(|y| [face + y, -20.0]);
    let corner = (0..=20).map(|k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 40.0).sin_cos();
        [face - 8.0 + 8.0 * sin, -12.0 - 8.0 * cos]
    });
    let side = (1..=18).map(|k| [face, -12.0 + 2.0 * f64::from(k)]);
    let groove = (0..=10).map(|k| [face + 1.0 + 3.9 * f64::from(k), 45.0]);
    let mut points = vec![[face - 40.0, 30.0]];
    points.extend(top);
    points.extend(corner.chain(side));
    points.push([face, 25.0]);
    points.extend(groove);
    points.push([-36.7, 28.0]);
    let contact = case["contact"].as_object_mut().unwrap();
    let rail = contact["rail"]["points_mm"].as_array().unwrap();
    let points = points.into_iter().map(|point| json!(point));
    contact["rail"]["points_mm"] = points.chain(rail.iter().cloned()).collect();
    let mut wheel = contact["wheel"]["text"]
        .as_str()
        .unwrap()
        .trim_end()
        .to_owned();
    for k in 0..24 {
        let k = f64::from(k);
        wheel.push_str(&format!("\n{:.3} {:.3}", -69.6 - 0.02 * k, 13.2 - k));
    }
    contact["wheel"]["text"] = json!(wheel);
    contact.remove("gauge_mm");
    contact.insert("rail_origin_mm".to_owned(), json!(753.5));
    contact.insert("lateral_shift_mm".to_owned(), json!(4.4));
    case
}

#[test]
fn a_contact_that_outgrows_its_grids_is_given_up_on_the_first_of_them() {
    let checked = check(&beside_guard_rail(), &Limits::default()).unwrap();
    let monitor = Counting::new(None);
    let answer = solve(&checked, &monitor);
    assert!(
        matches!(&answer, Err(SolveError::NormalProblem { reason }) if reason.contains("nearly vertical")),
        "{answer:?}"
    );
    assert!(monitor.ticks.get() < 1000, "{}", monitor.ticks.get());
}
