//! The error estimate on contacts that no constant was fitted to: the second half of the random populations of
//! `benches/calibrate`, against meshes much finer.

use railhead::contact;
use railhead::contact::case::limits::Limits;
use railhead::contact::monitor::Unmonitored;
use serde_json::json;

use crate::population::{Class, case};
use crate::reference::median;
use crate::truth::{self, judged};

/// Fewer errors that are clear of the uncertainty of the truth have no median to speak of.
const CLEAR_MIN: usize = 8;

/// What was found for one class and one target.
#[derive(Default)]
struct Tally {
    ratios: Vec<f64>,
    errors: Vec<String>,
    cases: usize,
    covered: usize,
    far: usize,
    marked: usize,
}

fn tally(class: Class, target: f64) -> Tally {
    let truths = truth::read();
    let known = &truths[class.name()];
    let mut tally = Tally::default();
    let held_out = known
        .iter()
        .filter(|(number, _)| 2 * **number >= class.count());
    for (number, truth) in held_out {
        let mut question = case(class, *number);
        assert_eq!(
            truth.print,
            truth::print(&question),
            "another population than the file's"
        );
        question["solver"] = json!({ "target_error": target });
        let problem = contact::check(&question, &Limits::default()).expect("a sound case");
        let (solution, _) = contact::solve(&problem, &Unmonitored).expect("an answer");
        let [error, estimate] = judged(class, truth, &solution).expect("an estimate");
        tally.cases += 1;
        if error > truth.uncertainty {
            tally.ratios.push(estimate / error);
        }
        tally.far += usize::from(error > 2.0 * estimate + truth.uncertainty);
        let covered = error <= estimate + truth.uncertainty;
        tally.covered += usize::from(covered);
        let marked = solution
            .remarks
            .iter()
            .any(|remark| remark.code == "pressure-jumps");
        tally.marked += usize::from(!covered && marked);
        if !covered {
            tally.errors.push(format!(
                "{number}: error {error:.5}, estimate {estimate:.5}"
            ));
        }
    }
    tally
}

/// Covered in so many of a hundred, more than 2 times too small in at most `far`, and in the median at most `sharp` times the error.
fn assert_covers(class: Class, covered: usize, far: usize, sharp: f64) {
    for target in [0.02, 0.005, 0.001] {
        let found = tally(class, target);
        let clear = found.ratios.len() >= CLEAR_MIN;
        let ratio = if clear { median(&found.ratios) } else { 1.0 };
        println!(
            "{} at {target}: {} of {} covered, {} of the others marked, {} far, estimate/error {ratio:.1}",
            class.name(),
            found.covered,
            found.cases,
            found.marked,
            found.far
        );
        assert!(found.cases >= 12, "{} cases", found.cases);
        let told = found.covered + found.marked;
        assert!(
            100 * told >= covered * found.cases,
            "{target}: {:?}",
            found.errors
        );
        assert!(
            100 * found.far <= far * found.cases,
            "{target}: {:?}",
            found.errors
        );
        assert!(
            ratio <= sharp,
            "{target}: estimates are {ratio} times the errors"
        );
    }
}

#[test]
fn estimates_cover_the_error_of_random_ellipses() {
    assert_covers(Class::Ellipse, 95, 1, 4.2);
}

#[test]
fn estimates_cover_the_error_of_random_smooth_pressures() {
    assert_covers(Class::Smooth, 95, 3, 4.3);
}

#[test]
fn estimates_cover_the_error_of_pressures_that_jump_or_a_remark_says_so() {
    assert_covers(Class::Jump, 95, 5, 4.0);
}

#[test]
fn estimates_cover_the_error_of_random_gaps() {
    assert_covers(Class::Gap, 95, 1, 4.2);
}

#[test]
fn estimates_cover_the_error_of_wheels_on_rails() {
    assert_covers(Class::Profiles, 90, 1, 5.5);
}
