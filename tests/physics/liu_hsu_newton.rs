//! Tests of the algebra inside `liu_hsu`: the elimination of the stick tractions, and the Newton–Raphson step.

use railhead_contact::mesh::Grading;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::methods::liu_hsu::active_set::newton_step;
use railhead_contact::rolling::methods::liu_hsu::stick_block::{
    DenseProblem, DenseTask, SlipSystem, both_components,
};
use railhead_contact::rolling::slip_equations::SlipScratch;
use railhead_contact::rolling::slip_rules::Rule;

use crate::regions::{self, Contact, Region};

/// Checks problems in which a few, about half, or all cells slip, with tractions that are not on their friction circles.
fn half_slipping(check: impl Fn(&DenseProblem, &SlipSystem, &DenseTask, &[f64])) {
    let contact = Contact::new(Region::Egg, 5, &Grading::cosine(4));
    for rule in [Rule::Upwind, Rule::Trapezoid] {
        let equations = contact.equations(rule);
        let motion = regions::motion([0.3, -0.2, 1.5]);
        let rigid = equations.rigid(&motion);
        let stage = contact.stage(&equations, &rigid, motion, 1e-8);
        let problem = DenseProblem::new(&stage, &Unmonitored).unwrap();
        for share in [1, 2, 20] {
            let slips: Vec<bool> = (0..problem.cells)
                .map(|i| (7 * i) % 20 < share * 7)
                .collect();
            let system = SlipSystem::new(&problem, &slips, &Unmonitored).unwrap();
            let n = system.slip_cells.len();
            let t: Vec<f64> = (0..2 * n)
                .map(|k| 0.4 * (1.0 + 2.3 * k as f64).sin() + 0.1)
                .collect();
            check(&problem, &system, &stage, &t);
        }
    }
}

#[test]
fn with_the_eliminated_tractions_stick_cells_do_not_slip_and_slip_cells_slip_as_eq_13_says() {
    half_slipping(|problem, system, stage, t_slip| {
        let (n, padded) = (problem.cells, stage.equations.padded());
        let mut t = vec![0.0; 2 * padded];
        let place = |k: usize| if k < n { k } else { padded + k - n };
        let slip_places = both_components(&system.slip_cells, n);
        let stick_places = both_components(&system.stick_cells, n);
        for (k, value) in slip_places.iter().zip(t_slip) {
            t[place(*k)] = *value;
        }
        for (k, value) in stick_places.iter().zip(system.stick_tractions(t_slip)) {
            t[place(*k)] = value;
        }
        let mut slip = vec![0.0; 2 * padded];
        let mut scratch = SlipScratch::default();
        stage.equations.elastic(&t, &mut slip, &mut scratch);
        for k in stick_places {
            assert!((slip[place(k)] + stage.law.rigid[place(k)]).abs() < 1e-10);
        }
        for (k, value) in slip_places.iter().zip(system.slip(t_slip)) {
            assert!((slip[place(*k)] + stage.law.rigid[place(*k)] - value).abs() < 1e-10);
        }
    });
}

#[test]
fn a_newton_step_solves_the_equations_linearised_by_differences() {
    half_slipping(|problem, system, _, t| {
        let n = system.slip_cells.len();
        let bound: Vec<f64> = system
            .slip_cells
            .iter()
            .map(|i| problem.bound[*i])
            .collect();
        let equations = |t: &[f64]| -> Vec<f64> {
            let slip = system.slip(t);
            let circle = (0..n).map(|i| t[i].powi(2) + t[n + i].powi(2) - bound[i].powi(2));
            let collinear = (0..n).map(|i| slip[i] * t[n + i] - slip[n + i] * t[i]);
            circle.chain(collinear).collect()
        };
        let step = newton_step(system, &bound, t, &Unmonitored).unwrap();
        let mut linear = equations(t);
        let largest = linear.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        for column in 0..2 * n {
            // The equations are quadratic, so central differences are exact for any width.
            let shifted = |by: f64| {
                let mut moved = t.to_vec();
                moved[column] += by;
                equations(&moved)
            };
            for ((sum, up), down) in linear.iter_mut().zip(shifted(0.5)).zip(shifted(-0.5)) {
                *sum += (up - down) * step[column];
            }
        }
        let left = linear.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let size = step.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        assert!(
            left < 1e-9 * largest * size,
            "{left} of {largest}, step {size}"
        );
    });
}
