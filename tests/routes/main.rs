//! Tests that a case has the same answer on every route.

mod features;
mod matrix;
#[path = "../physics/profile_shapes.rs"]
mod profile_shapes;

use features::selection;
use matrix::matrix;

/// With `RAILHEAD_ROUTES=wheelset`, tests only the features whose names contain this word.
#[test]
fn every_feature_is_answered_on_every_route_as_the_case_alone() {
    let mut features = selection(false);
    if let Ok(word) = std::env::var("RAILHEAD_ROUTES") {
        features.retain(|feature| feature.name.contains(&word));
    }
    let shown = matrix(&features);
    println!("{}", shown.table());
    assert!(shown.wrong.is_empty(), "{:#?}", shown.wrong);
}
