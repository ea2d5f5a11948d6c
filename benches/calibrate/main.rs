//! Checks the error estimate: solves random contacts for three targets and compares them with much finer meshes.
//!
//! `cargo bench --bench calibrate` prints the tables for the halves of every class (the first for fitting, the second for checking; every patch of
//! wheels on rails counts). With names of classes (`ellipse smooth jump gap profiles curve roller uneven`), it prints only these. The reference
//! results are in `tests/data/finer_meshes.json`. `-- truths [classes]` computes missing ones, which takes some seconds each. `-- case gap
//! 42` prints one case as JSON. With `each`, every answer is printed, otherwise only those with a larger error than estimated.

use judge::judged;
use machine::{median, quantile, seconds_of};
use population::{Class, case, on_planes};
use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::Solution;
use serde_json::json;
use truth::{Judged, Truths};

mod finer;
mod judge;
#[path = "../machine.rs"]
mod machine;
mod patches;
mod population;
#[path = "../../tests/physics/profile_shapes.rs"]
mod profile_shapes;
#[path = "../random.rs"]
mod random;
mod truth;

const CLASSES: [Class; 8] = [
    Class::Ellipse,
    Class::Smooth,
    Class::Jump,
    Class::Gap,
    Class::Profiles,
    Class::Curve,
    Class::Roller,
    Class::Uneven,
];
const TARGETS: [f64; 3] = [0.02, 0.005, 0.001];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it prints nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let has = |name: &str| arguments.iter().any(|argument| argument == name);
    if let [_, "case", class, number, ..] | ["case", class, number, ..] =
        arguments.iter().map(String::as_str).collect::<Vec<_>>()[..]
    {
        let class = CLASSES.into_iter().find(|known| known.name() == class);
        if let (Some(class), Ok(number)) = (class, number.parse()) {
            println!("{}", case(class, number));
        }
        return;
    }
    let named = CLASSES.iter().any(|class| has(class.name()));
    let classes = CLASSES.iter().filter(|class| !named || has(class.name()));
    for class in classes {
        if has("truths") {
            find_truths(*class);
        } else {
            tables(*class, &truth::read(), has("each"));
        }
    }
}

/// Computes the reference results that the file lacks, and writes the file after every case.
fn find_truths(class: Class) {
    for number in 0..class.count() {
        let question = case(class, number);
        let mut truths = truth::read();
        let known = truths
            .get(class.name())
            .and_then(|known| known.get(&number));
        if known.is_some_and(|known| known.print == truth::print(&question)) {
            continue;
        }
        match finer::find(class, &question) {
            Ok(found) => {
                println!("{} {number}: {found:?}", class.name());
                truths = truth::read();
                truths
                    .entry(class.name().to_owned())
                    .or_default()
                    .insert(number, found);
                let text = serde_json::to_string(&truths).expect("numbers");
                std::fs::write(truth::file(), text.replace("},\"", "},\n\"")).expect("a file");
            }
            Err(reason) => println!("{} {number}: no answer: {reason}", class.name()),
        }
    }
}

/// One estimate and its true error.
struct Outcome {
    judged: Judged,
    met: bool,
    /// Processor time of the whole answer.
    seconds: f64,
}

fn tables(class: Class, truths: &Truths, each: bool) {
    let Some(known) = truths.get(class.name()) else {
        println!("{}: no truths", class.name());
        return;
    };
    println!(
        "\n| {} | target | estimates | within target | covered | 2x too small | certified | estimate/error | error median, 90 % | ms mean, median |",
        class.name()
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for target in TARGETS {
        let mut halves: [Vec<Outcome>; 2] = [Vec::new(), Vec::new()];
        for (number, truth) in known {
            let mut question = case(class, *number);
            assert_eq!(truth.print, truth::print(&question), "another population");
            question["solver"] = json!({ "method": "boundary_element", "target_error": target });
            on_planes(class, &mut question);
            let checked = contact::check(&question, &Limits::default()).expect("a sound case");
            let (seconds, solved) = seconds_of(|| contact::solve(&checked, &Unmonitored));
            let answer = match solved {
                Ok(found) => found,
                Err(error) => {
                    println!("{} {number} at {target}: {error}", class.name());
                    continue;
                }
            };
            let half = &mut halves[usize::from(2 * *number >= class.count())];
            for judged in judged(class, truth, &checked, &answer).expect("an estimate") {
                let outcome = Outcome {
                    judged,
                    met: judged.estimate <= target,
                    seconds,
                };
                if each || judged.error - judged.uncertainty > judged.estimate {
                    print_one((class, *number, target), &outcome, &answer.0);
                }
                half.push(outcome);
            }
        }
        for (name, half) in ["fit", "check"].iter().zip(&halves) {
            row(name, target, half);
        }
        let [mut both, check] = halves;
        both.extend(check);
        row("both", target, &both);
    }
}

/// Prints one outcome, with the mesh of the first patch.
fn print_one((class, number, target): (Class, usize, f64), found: &Outcome, solution: &Solution) {
    let mesh = solution.patches[0].points[0].solver.mesh.expect("a mesh");
    let Judged {
        error,
        estimate,
        uncertainty,
    } = found.judged;
    println!(
        "  {} {number} at {target}: error {error:.5} ± {uncertainty:.5}, estimate {estimate:.5}, {} x {}, {:.1} ms",
        class.name(),
        mesh.strips,
        mesh.cells,
        1e3 * found.seconds
    );
}

fn row(name: &str, target: f64, outcomes: &[Outcome]) {
    let count = |test: &dyn Fn(&Outcome) -> bool| {
        let part = outcomes.iter().filter(|o| test(o)).count();
        part as f64 / outcomes.len().max(1) as f64
    };
    let covered = |factor: f64| {
        count(&|Outcome { judged, .. }| {
            judged.error <= factor * judged.estimate + judged.uncertainty
        })
    };
    let clear = outcomes
        .iter()
        .filter(|o| o.judged.error > o.judged.uncertainty);
    let ratios = clear.map(|o| o.judged.estimate / o.judged.error).collect();
    let errors: Vec<f64> = outcomes.iter().map(|o| o.judged.error).collect();
    let times: Vec<f64> = outcomes.iter().map(|o| 1e3 * o.seconds).collect();
    println!(
        "| {name} | {target} | {} | {:.3} | {:.3} | {:.3} | {:.2} | {:.1} | {:.5}, {:.5} | {:.1}, {:.1} |",
        outcomes.len(),
        count(&|o| o.judged.error <= target + o.judged.uncertainty),
        covered(1.0),
        1.0 - covered(2.0),
        count(&|o| o.met),
        median(ratios),
        median(errors.clone()),
        quantile(errors, 0.9),
        times.iter().sum::<f64>() / times.len().max(1) as f64,
        median(times),
    );
}
