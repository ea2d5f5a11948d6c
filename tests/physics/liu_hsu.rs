//! Tests of the solver of Liu and Hsu: the same answers as `boundary_element` where it converges, and a named termination elsewhere.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::time::Duration;

use railhead_contact::mesh::Grading;
use railhead_contact::monitor::{Monitor, Stop, Unmonitored};
use railhead_contact::rolling::methods::boundary_element::newton::Newton;
use railhead_contact::rolling::methods::boundary_element::task::Convergence;
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::methods::liu_hsu::active_set::{InitialGuess, ZonesTermination};
use railhead_contact::rolling::methods::liu_hsu::solve::{
    ZonesOutcome, coarse_pole, solve, solve_with,
};
use railhead_contact::rolling::slip_equations::SlipScratch;
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::task::Motion;

use crate::convergence_domain::{count, motions};
use crate::regions::{self, Contact, REGIONS, Region, boundary_element, on_stage};

const CIRCLE: Region = Region::Ellipse { b: 1.0 };
const RULES: [Rule; 2] = [Rule::Upwind, Rule::Trapezoid];

fn with_guess(
    contact: &Contact,
    rule: Rule,
    state: [f64; 3],
    guess: InitialGuess,
) -> (Vec<f64>, ZonesOutcome) {
    on_stage(contact, rule, state, 1e-8, |stage, t| {
        solve_with(stage, guess, t, &Unmonitored).unwrap()
    })
}

/// Runs the complete method, as the service does.
fn everything(
    fine: &Contact,
    coarse: &Contact,
    rule: Rule,
    state: [f64; 3],
) -> (Vec<f64>, ZonesOutcome) {
    on_stage(fine, rule, state, 1e-8, |stage, t| {
        let motion = regions::motion(state);
        let on_coarse = coarse.equations(rule);
        let rigid = on_coarse.rigid(&motion);
        let first = coarse.stage(&on_coarse, &rigid, motion, 1e-8);
        solve(stage, Some(&first), t, &Unmonitored).unwrap()
    })
}

fn pole(contact: &Contact, rule: Rule, state: [f64; 3]) -> Option<[f64; 2]> {
    let equations = contact.equations(rule);
    let motion = regions::motion(state);
    let rigid = equations.rigid(&motion);
    coarse_pole(
        &contact.stage(&equations, &rigid, motion, 1e-8),
        &Unmonitored,
    )
    .unwrap()
}

fn largest_difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn both_methods_agree_on_forces_and_zones_where_liu_hsu_converges() {
    let motions: Vec<[f64; 3]> = motions().into_iter().step_by(7).collect();
    for rule in RULES {
        for (name, region) in REGIONS {
            let strips = if region == Region::TwoCircles { 4 } else { 8 };
            let fine = Contact::new(region, strips, &Grading::cosine(8));
            let coarse = Contact::new(region, strips / 2, &Grading::uniform(5));
            let mut converged = 0;
            for state in &motions {
                let (t, outcome) = everything(&fine, &coarse, rule, *state);
                if !outcome.exit().converged() {
                    continue;
                }
                converged += 1;
                let (reference, convergence) = boundary_element(&fine, rule, *state, 1e-10);
                assert!(convergence.converged, "{name} {state:?}");
                let difference = largest_difference(fine.forces(&t), fine.forces(&reference));
                assert!(
                    difference < 1e-6,
                    "{name} {rule:?} {state:?}: {difference} {outcome:?}"
                );
                let zones = zones(&fine, rule, *state, &reference);
                assert_eq!(outcome.slips, zones, "{name} {rule:?} {state:?}");
            }
            assert!(
                converged * 10 >= 9 * motions.len(),
                "{name} {rule:?}: {converged} of {}",
                motions.len()
            );
        }
    }
}

/// Returns the zones that `boundary_element` assigns to its tractions.
fn zones(contact: &Contact, rule: Rule, state: [f64; 3], t: &[f64]) -> Vec<bool> {
    let equations = contact.equations(rule);
    let rigid = equations.rigid(&regions::motion(state));
    let law = contact.law(&rigid, 1e-10);
    let newton = Newton::new(&equations);
    let mut workspace = NewtonWorkspace::default();
    let mut unused = Convergence::default();
    newton.evaluate(&law, t, &mut workspace, &mut unused);
    (0..equations.cells())
        .map(|i| newton.slips(law.bound, t, workspace.slip(), i))
        .collect()
}

#[test]
fn slips_and_residual_of_the_outcome_belong_to_its_tractions() {
    let contact = Contact::new(CIRCLE, 8, &Grading::cosine(8));
    let equations = contact.equations(Rule::Trapezoid);
    let state = [0.4, 0.3, 0.5];
    let (t, outcome) = everything(&contact, &contact, Rule::Trapezoid, state);
    assert!(
        outcome.exit().converged() && outcome.residual <= 1e-8,
        "{outcome:?}"
    );
    let mut slip = vec![0.0; t.len()];
    let mut scratch = SlipScratch::default();
    equations.elastic(&t, &mut slip, &mut scratch);
    let (rigid, padded) = (equations.rigid(&regions::motion(state)), equations.padded());
    for i in 0..equations.cells() {
        let (sx, sy) = (slip[i] + rigid[i], slip[padded + i] + rigid[padded + i]);
        assert!((sx - outcome.slip[i]).abs() < 1e-12);
        assert!((sy - outcome.slip[padded + i]).abs() < 1e-12);
        let traction = t[i].hypot(t[padded + i]);
        if outcome.slips[i] {
            assert!((traction - contact.bound[i]).abs() < 1e-9);
            assert!((sx * t[padded + i] - sy * t[i]).abs() < 1e-9);
            assert!(sx * t[i] + sy * t[padded + i] >= 0.0);
        } else {
            assert!(traction < contact.bound[i] && sx.hypot(sy) < 1e-9);
        }
    }
}

#[test]
fn pure_creepage_always_converges_and_with_the_upwind_rule_by_guess_1_alone() {
    let pure: Vec<[f64; 3]> = motions().into_iter().filter(|m| m[2] == 0.0).collect();
    assert_eq!(pure.len(), 18);
    for rule in RULES {
        for (name, region) in REGIONS {
            for n in [5, 10] {
                let strips = if region == Region::TwoCircles {
                    n / 2
                } else {
                    n
                };
                let contact = Contact::new(region, strips, &Grading::uniform(n));
                for state in &pure {
                    let (_, outcome) = everything(&contact, &contact, rule, *state);
                    let attempts = &outcome.attempts;
                    assert!(
                        outcome.exit().converged(),
                        "{name} {n} {state:?} {attempts:?}"
                    );
                    if rule == Rule::Upwind {
                        assert_eq!(attempts.len(), 1, "{name} {n} {state:?} {attempts:?}");
                    }
                }
            }
        }
    }
}

/// Tests the domain of convergence, which is part of the method: a change of these counts is a change of the method. The bench `convergence_domain`
/// prints the whole table.
#[test]
fn the_pole_of_a_coarse_solution_and_the_third_run_extend_the_domain_of_convergence() {
    let motions: Vec<[f64; 3]> = motions().into_iter().step_by(2).collect();
    for rule in RULES {
        for (name, region) in REGIONS {
            let counts = count(region, rule, (5, &Grading::uniform(5)), &motions);
            println!("{} {name}: {}", rule.name(), counts.row());
            assert!(counts.guess_1 >= 55 && counts.guess_2 >= 75, "{counts:?}");
            assert!(counts.paper > counts.guess_1, "{name} {counts:?}");
            assert!(counts.shipped >= counts.paper, "{name} {counts:?}");
            assert!(counts.shipped >= 104, "{name} {counts:?}");
        }
    }
    let spinning: Vec<[f64; 3]> = motions
        .into_iter()
        .filter(|m| m[2] >= 1.0)
        .step_by(4)
        .collect();
    let counts = count(CIRCLE, Rule::Upwind, (10, &Grading::uniform(10)), &spinning);
    assert!(counts.guess_2 > counts.guess_1 + 3, "{counts:?}");
}

#[test]
fn all_guesses_that_converge_reach_the_same_tractions() {
    let fine = Contact::new(Region::Egg, 8, &Grading::uniform(8));
    let coarse = Contact::new(Region::Egg, 5, &Grading::uniform(5));
    let mut compared = 0;
    for rule in RULES {
        for state in motions().into_iter().step_by(9) {
            let Some(pole) = pole(&coarse, rule, state) else {
                assert_eq!(state[2], 0.0);
                continue;
            };
            let guesses = [InitialGuess::RigidSlip, InitialGuess::SpinPole(pole)];
            let [one, two] = guesses.map(|guess| with_guess(&fine, rule, state, guess));
            let runs = [one, two, everything(&fine, &coarse, rule, state)];
            let mut found = runs
                .iter()
                .filter(|(_, outcome)| outcome.exit().converged());
            let Some((first, _)) = found.next() else {
                continue;
            };
            for (other, outcome) in found {
                compared += 1;
                let difference = first.iter().zip(other).map(|(a, b)| (a - b).abs());
                let largest = difference.fold(0.0, f64::max);
                assert!(largest < 1e-7, "{rule:?} {state:?} {largest} {outcome:?}");
            }
        }
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn reversed_motion_reverses_the_answer_with_either_guess() {
    let fine = Contact::new(Region::Egg, 8, &Grading::uniform(8));
    for state in [[0.3, 0.2, 2.0], [0.0, -0.6, 5.0], [0.6, 0.0, 1.0]] {
        let reversed = state.map(|m: f64| -m);
        let pole_there = pole(&fine, Rule::Trapezoid, state);
        let pole_back = pole(&fine, Rule::Trapezoid, reversed);
        let (there, back) = (pole_there.unwrap(), pole_back.unwrap());
        assert!((there[0] - back[0]).abs() + (there[1] - back[1]).abs() < 1e-9);
        for (guess, opposite) in [
            (InitialGuess::RigidSlip, InitialGuess::RigidSlip),
            (InitialGuess::SpinPole(there), InitialGuess::SpinPole(back)),
        ] {
            let (t, outcome) = with_guess(&fine, Rule::Trapezoid, state, guess);
            let (r, mirrored) = with_guess(&fine, Rule::Trapezoid, reversed, opposite);
            assert_eq!(
                outcome.last().exit,
                mirrored.last().exit,
                "{state:?} {guess:?}"
            );
            if outcome.exit().converged() {
                let forces = fine.forces(&r).map(|f| -f);
                assert!(largest_difference(fine.forces(&t), forces) < 1e-9);
            }
        }
    }
}

#[test]
fn the_spin_pole_lies_between_the_rigid_pole_and_the_trailing_edge() {
    let coarse = Contact::new(CIRCLE, 6, &Grading::uniform(5));
    let mut before = -1.0;
    for spin in [3.0, 5.0, 10.0, 20.0] {
        let [x, y] = pole(&coarse, Rule::Trapezoid, [0.0, 0.0, spin]).unwrap();
        assert!(y.abs() < 1e-9, "{y}");
        assert!(before < x && x < 0.0, "spin {spin}: {x} after {before}");
        before = x;
    }
    let sideways = pole(&coarse, Rule::Trapezoid, [3.0, 0.0, 10.0]).unwrap();
    assert!((sideways[1] - 0.3).abs() < 0.1, "{sideways:?}");
}

#[test]
fn tiny_motion_sticks_everywhere_without_a_newton_step() {
    let contact = Contact::new(CIRCLE, 6, &Grading::uniform(5));
    for state in [[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.0, 1e-9, 1e-9]] {
        let (t, outcome) = with_guess(&contact, Rule::Trapezoid, state, InitialGuess::RigidSlip);
        assert!(outcome.exit().converged(), "{outcome:?}");
        assert_eq!(
            (outcome.outer_iterations(), outcome.newton_iterations()),
            (1, 0)
        );
        assert!(outcome.slips.iter().all(|slips| !slips));
        let still = contact.forces(&t).into_iter().all(|f| f == 0.0);
        assert_eq!(still, state == [0.0; 3]);
    }
}

#[test]
fn large_motion_slips_everywhere_and_carries_friction_times_load() {
    let contact = Contact::new(CIRCLE, 6, &Grading::uniform(5));
    for rule in RULES {
        let (t, outcome) = with_guess(&contact, rule, [60.0, 80.0, 0.0], InitialGuess::RigidSlip);
        assert!(outcome.exit().converged(), "{outcome:?}");
        assert!(outcome.slips.iter().all(|slips| *slips));
        let [x, y, _] = contact.forces(&t);
        assert!((x / contact.load() - 0.6).abs() < 1e-2 && (y / contact.load() - 0.8).abs() < 1e-2);
        assert!((x.hypot(y) / contact.load() - 1.0).abs() < 1e-4);
    }
}

#[test]
fn a_cell_without_pressure_carries_nothing_and_slips() {
    let mut contact = Contact::new(CIRCLE, 6, &Grading::uniform(5));
    for cell in [0, 7, 29] {
        contact.bound[cell] = 0.0;
    }
    for state in [[0.3, 0.1, 0.0], [0.2, 0.0, 1.0], [50.0, 0.0, 0.0]] {
        let (t, outcome) = everything(&contact, &contact, Rule::Upwind, state);
        assert!(outcome.exit().converged(), "{state:?} {outcome:?}");
        let padded = t.len() / 2;
        for cell in [0, 7, 29] {
            assert_eq!(
                (t[cell], t[padded + cell], outcome.slips[cell]),
                (0.0, 0.0, true)
            );
        }
        let (reference, _) = boundary_element(&contact, Rule::Upwind, state, 1e-10);
        let difference = largest_difference(contact.forces(&t), contact.forces(&reference));
        assert!(difference < 1e-6, "{state:?} {difference}");
    }
}

#[test]
fn a_run_without_answer_names_its_end_and_its_residual() {
    let contact = Contact::new(CIRCLE, 10, &Grading::uniform(10));
    let mut ends = Vec::new();
    for state in motions().into_iter().filter(|m| m[2] == 2.0) {
        let (t, outcome) = with_guess(&contact, Rule::Upwind, state, InitialGuess::RigidSlip);
        ends.push(outcome.last().exit);
        if !outcome.exit().converged() {
            assert_ne!(outcome.last().exit, ZonesTermination::Converged);
            assert!(outcome.residual > 1e-8 && outcome.residual.is_finite());
            assert!(t.iter().all(|value| value.is_finite()));
            let advice = outcome.advice();
            assert!(advice.contains(outcome.last().exit.reason()), "{advice}");
            assert!(advice.contains("boundary_element"), "{advice}");
        }
    }
    assert!(ends.contains(&ZonesTermination::ZonesRepeat), "{ends:?}");
}

/// Stops the solve at the given tick.
struct StopAt {
    looks: Cell<u32>,
    at: u32,
}

impl Monitor for StopAt {
    fn tick(&self, _progress: f64) -> ControlFlow<Stop> {
        self.looks.set(self.looks.get() + 1);
        if self.looks.get() >= self.at {
            ControlFlow::Break(Stop::OutOfTime)
        } else {
            ControlFlow::Continue(())
        }
    }

    fn elapsed(&self) -> Duration {
        Duration::ZERO
    }
}

#[test]
fn the_monitor_stops_a_solve_at_any_look() {
    let contact = Contact::new(CIRCLE, 6, &Grading::uniform(5));
    let looks = |at: u32| {
        let equations = contact.equations(Rule::Trapezoid);
        let motion: Motion = regions::motion([0.3, 0.0, 0.5]);
        let rigid = equations.rigid(&motion);
        let stage = contact.stage(&equations, &rigid, motion, 1e-8);
        let monitor = StopAt {
            looks: Cell::new(0),
            at,
        };
        let mut t = vec![0.0; 2 * equations.padded()];
        let ended = solve(&stage, Some(&stage), &mut t, &monitor);
        (ended, monitor.looks.get())
    };
    let (finished, all) = looks(u32::MAX);
    let outcome = finished.unwrap();
    assert!(all > outcome.newton_iterations() + outcome.outer_iterations());
    for at in 1..=all {
        assert_eq!(looks(at), (Err(Stop::OutOfTime), at));
    }
}
