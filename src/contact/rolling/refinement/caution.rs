//! Factors on the estimates where friction is not a coefficient alone, or the bodies differ.

use crate::contact::rolling::task::RollingTask;

/// Factor on estimates where friction falls with slip: the bounds come from the three-point rule, and so do the changes that tell its
/// error (100 creepages of 10 laws, of which 94 are covered without it, all with it: `cargo test --test physics -- friction_as_it_is`).
const FALLING: f64 = 1.5;
/// Factor on estimates with a layer between the bodies, for which both rules leave the same error at the leading edge (5 contacts of the
/// same test, errors up to 2.2 times the estimate without it).
const LAYER: f64 = 2.5;
/// Factor on estimates where bodies differ, less 1, over |K|: the slips from the pressure are as coarse as the cells in both rules (12
/// contacts with |K| up to 0.25, errors up to 1.4 times the estimate without it, 2.3 times where rolling is free, which the error of the
/// pressure adds to: `cargo test --test physics -- unlike_bodies`).
const UNLIKE: f64 = 3.0;

/// The factor of a problem; 1 for a coefficient and like bodies.
pub(crate) fn caution(task: &RollingTask) -> f64 {
    let falling = if task.friction.depends_on_slip() {
        FALLING
    } else {
        1.0
    };
    let layer = if task.interface.layer > 0.0 {
        LAYER
    } else {
        1.0
    };
    let difference = if task.is_coupled() {
        task.elasticity.difference.abs()
    } else {
        0.0
    };
    falling * layer * (1.0 + UNLIKE * difference)
}
