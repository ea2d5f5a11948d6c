//! Tests of histories that are refused with a named fault, or stopped.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Duration;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::{Monitor, Stop};
use serde_json::{Value, json};

use crate::cases::{assert_fault, with};
use crate::histories::sphere;

fn good() -> Value {
    sphere(
        0.28,
        json!({ "history": { "distance_mm": [0, 1, 2], "creepage_x": 0.001 } }),
    )
}

#[test]
fn a_history_that_cannot_be_is_refused_by_name() {
    for (name, value, at, word) in [
        (
            "distance_mm",
            json!([0, 2, 1]),
            "distance_mm/2",
            "1 given after 2",
        ),
        ("distance_mm", json!([-1, 2, 3]), "distance_mm/0", "-1"),
        ("distance_mm", json!([0, 1, 1e8]), "distance_mm", "steps"),
        (
            "creepage_x",
            json!([0, 1]),
            "creepage_x",
            "2 values given for 3",
        ),
        (
            "force_x_n",
            json!(10),
            "force_x_n",
            "together with creepage_x",
        ),
        (
            "shift_y_mm",
            json!([0, 0.1, 0]),
            "shift_y_mm/1",
            "to which the bodies roll",
        ),
        ("force_y_n", json!(20_000), "force_y_n", "18000"),
    ] {
        let path = |name: &str| format!("/motion/history/{name}");
        assert_fault(&with(&good(), &path(name), Some(value)), &path(at), &[word]);
    }
    // Steps on a patch of a micrometre are not written as 0 mm.
    let mut micro = good();
    for (at, value) in [
        ("/contact/a_mm", json!(1e-3)),
        ("/contact/b_mm", json!(1e-3)),
        ("/load/normal_force_n", json!(0.001)),
        ("/motion/history/distance_mm", json!([0, 1, 100])),
    ] {
        micro = with(&micro, at, Some(value));
    }
    assert_fault(
        &micro,
        "/motion/history/distance_mm",
        &["steps of 0.000188 mm"],
    );
    let missing = with(&good(), "/motion/history/distance_mm", None);
    assert_fault(&missing, "/motion/history/distance_mm", &["missing"]);
}

#[test]
fn what_a_history_does_not_go_with_is_refused_by_name() {
    let falling = json!({ "law": "linear", "limit": 0.2, "terms": [{ "coefficient": 0.1, "half_speed_mm_per_s": 50 }] });
    for (name, value, at, word) in [
        ("/motion/start", json!("moving"), "/motion/start", "steady"),
        (
            "/motion/history",
            json!({ "distance_mm": [1] }),
            "/motion/history",
            "no motion",
        ),
        (
            "/solver",
            json!({ "method": "fastsim" }),
            "/solver/method",
            "boundary_element",
        ),
        (
            "/friction",
            falling,
            "/motion/history/speed_mm_per_s",
            "missing",
        ),
        ("/friction/coefficient", json!(0), "/friction", "friction"),
        ("/outputs", json!(["damage"]), "/outputs", "damage"),
    ] {
        assert_fault(&with(&good(), name, Some(value)), at, &[word]);
    }
}

/// Stops the solve at the hundredth tick.
struct Impatient(Cell<u32>);

impl Monitor for Impatient {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        self.0.set(self.0.get() + 1);
        match self.0.get() {
            0..100 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(Stop::Cancelled),
        }
    }

    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}

#[test]
fn a_history_is_cancelled_in_a_step() {
    let history = json!({ "history": { "distance_mm": [0, 1000], "creepage_x": 0.001 } });
    let case = contact::check(&sphere(0.28, history), &Limits::default()).unwrap();
    let watch = Impatient(Cell::new(0));
    assert_eq!(
        contact::solve(&case, &watch).unwrap_err(),
        SolveError::Cancelled
    );
    assert_eq!(watch.0.get(), 100);
}
