//! Tests of the kernels and the discrete equations against stored numbers (`tests/data/kernels.json`, described in `tests/data/README.md`).

use railhead_contact::half_space::kernels::{Rectangle, rectangle};
use railhead_contact::mesh::Grading;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::methods::liu_hsu::active_set::InitialGuess;
use railhead_contact::rolling::methods::liu_hsu::solve::solve_with;
use railhead_contact::rolling::slip_equations::SlipScratch;
use railhead_contact::rolling::slip_rules::Rule;
use serde::Deserialize;

use crate::regions::{self, Contact, REGIONS, SHEAR_MODULUS, boundary_element, on_stage};

#[derive(Deserialize)]
struct Kernels {
    influence: Vec<InfluenceValue>,
    solver: Vec<SolverValue>,
}

/// Stored displacements of one body.
#[derive(Deserialize)]
struct InfluenceValue {
    x: f64,
    y: f64,
    /// The x limits and y limits of the loaded rectangle.
    cell: [f64; 4],
    poisson_ratio: f64,
    shear_modulus: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// Stored forces on 6 strips of 5 equal cells, with the bound taken at the centre of each cell.
#[derive(Deserialize)]
struct SolverValue {
    region: String,
    rule: String,
    motion: [f64; 3],
    force_x: f64,
    force_y: f64,
    moment_z: f64,
    /// Number of sticking cells, given for the upwind rule.
    stick_cells: Option<usize>,
    #[serde(rename = "sum_pA")]
    sum_pa: Option<f64>,
    dissipation: Option<f64>,
}

impl SolverValue {
    fn forces(&self) -> [f64; 3] {
        [self.force_x, self.force_y, self.moment_z]
    }

    fn rule(&self) -> Rule {
        match self.rule.as_str() {
            "half" => Rule::Upwind,
            "trapezoid" => Rule::Trapezoid,
            other => panic!("no rule is called {other} here"),
        }
    }

    /// Returns half a unit in the tenth digit of the largest force, plus the solver's residual.
    fn tolerance(&self) -> f64 {
        let largest = self
            .forces()
            .into_iter()
            .fold(0.0, |a: f64, f| a.max(f.abs()));
        1e-9 * largest.min(1.0)
    }

    fn name(&self) -> String {
        format!("{} {} {:?}", self.region, self.rule, self.motion)
    }
}

fn kernels() -> Kernels {
    serde_json::from_str(include_str!("../data/kernels.json")).unwrap()
}

fn contact(name: &str) -> Contact {
    // In the data, `long_ellipse` is b/a = 0.3.
    let (_, region) = REGIONS.into_iter().find(|(n, _)| *n == name).unwrap();
    Contact::new(region, 6, &Grading::uniform(5))
}

#[test]
fn influence_coefficients_have_their_known_twelve_digits() {
    let values = kernels().influence;
    assert_eq!(values.len(), 11);
    for value in values {
        let [x0, x1, y0, y1] = value.cell;
        let found = rectangle(
            value.x,
            value.y,
            Rectangle { x0, x1, y0, y1 },
            value.poisson_ratio,
        );
        // The found influence is for two bodies and multiplied by G.
        let factor = 0.5 / value.shear_modulus;
        for (ours, known) in [
            (found.xx, value.xx),
            (found.xy, value.xy),
            (found.yy, value.yy),
        ] {
            assert!(
                (factor * ours - known).abs() < 1e-12,
                "({}, {}): {} {known}",
                value.x,
                value.y,
                factor * ours
            );
        }
    }
}

#[test]
fn forces_stick_cells_and_power_have_their_known_digits() {
    let values = kernels().solver;
    assert_eq!(values.len(), 45);
    for value in values {
        let contact = contact(&value.region);
        if let Some(sum) = value.sum_pa {
            assert!((contact.load() - sum).abs() < 1e-9);
        }
        let (t, convergence) = boundary_element(&contact, value.rule(), value.motion, 1e-12);
        assert!(convergence.converged, "{}: {convergence:?}", value.name());
        let forces = contact.forces(&t);
        for (ours, known) in forces.into_iter().zip(value.forces()) {
            assert!(
                (ours - known).abs() < value.tolerance(),
                "{}: {ours} {known}",
                value.name()
            );
        }
        if let Some(stick_cells) = value.stick_cells {
            assert_eq!(contact.stick_cells(&t), stick_cells, "{}", value.name());
        }
        if let Some(dissipation) = value.dissipation {
            let power = power(&contact, value.rule(), value.motion, &t);
            assert!(
                (power - dissipation).abs() < 1e-8 * dissipation.max(1.0),
                "{}: {power} {dissipation}",
                value.name()
            );
        }
    }
}

/// Returns `Σ s·T A`, with slips in the normalisation of the motion.
fn power(contact: &Contact, rule: Rule, state: [f64; 3], t: &[f64]) -> f64 {
    let equations = contact.equations(rule);
    let mut slip = vec![0.0; t.len()];
    let mut scratch = SlipScratch::default();
    equations.elastic(t, &mut slip, &mut scratch);
    let rigid = equations.rigid(&regions::motion(state));
    let padded = equations.padded();
    let sum: f64 = (0..t.len())
        .map(|k| (slip[k] + rigid[k]) * t[k] * contact.area[k % padded])
        .sum();
    sum / SHEAR_MODULUS
}

#[test]
fn liu_hsu_has_the_same_digits_where_guess_1_converges() {
    let values = kernels().solver;
    let mut converged = 0;
    for value in &values {
        let contact = contact(&value.region);
        let (t, outcome) = on_stage(&contact, value.rule(), value.motion, 1e-10, |stage, t| {
            solve_with(stage, InitialGuess::RigidSlip, t, &Unmonitored).unwrap()
        });
        if !outcome.exit().converged() {
            continue;
        }
        converged += 1;
        for (ours, known) in contact.forces(&t).into_iter().zip(value.forces()) {
            assert!(
                (ours - known).abs() < value.tolerance(),
                "{}: {ours} {known}",
                value.name()
            );
        }
    }
    assert!(converged >= 30, "{converged} of {}", values.len());
}
