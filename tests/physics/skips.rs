//! Tests that work that a case does not need is skipped, and that the answer does not change.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::half_space::strip_operator::kind::Precision;
use railhead_contact::half_space::strip_operator::operator::StripOperator;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal_stage;
use railhead_contact::rolling::methods::boundary_element::newton::Newton;
use railhead_contact::rolling::methods::boundary_element::solve as boundary_element;
use railhead_contact::rolling::methods::boundary_element::task::{LevelTask, NewtonTask};
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::methods::fastsim;
use railhead_contact::rolling::slip_equations::SlipEquations;
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::strip_mesh::StripMesh;
use railhead_contact::rolling::task::RollingTask;
use railhead_contact::solution::words::answer::PointSolution;

use crate::reference::{Ellipse, solve};

const STRIPS: u32 = 10;
const CELLS: u32 = 12;

fn answered(contact: &Ellipse) -> PointSolution {
    solve(&contact.case(STRIPS, CELLS)).0.patches[0].points[0].clone()
}

/// Returns the largest difference between the solver's tractions and those of a plain Newton solve of the trapezoidal rule, relative to the friction
/// bound. The plain solve uses the whole mesh in double precision.
fn distance_to_plain_newton(contact: &Ellipse) -> f64 {
    on_level(contact, |_, asked| {
        distance_on(contact.poisson_ratio, asked)
    })
}

/// Returns the result of `work` for a contact on the mesh of the tests.
fn on_level<T>(contact: &Ellipse, work: impl FnOnce(&RollingTask, LevelTask) -> T) -> T {
    let case = contact.case(STRIPS, CELLS);
    let checked = contact::check(&case, &Limits::default()).expect("a valid case");
    let size = contact::mesh::MeshSize {
        strips: STRIPS,
        cells: CELLS,
    };
    let footprint = normal_stage::solve(&checked, &Unmonitored)
        .expect("a contact")
        .footprint;
    let task = checked.rolling_task(&footprint);
    let level = StripMesh::new(&task, size).expect("a mesh");
    let motion = level.scale.motion(&checked.problem.motions[0]);
    let asked = LevelTask {
        level: &level,
        motion: &motion,
        fall: None,
        passage: None,
        tolerance: 1e-9,
    };
    work(&task, asked)
}

fn distance_on(nu: f64, asked: LevelTask) -> f64 {
    let LevelTask { level, motion, .. } = asked;
    let mut workspace = NewtonWorkspace::default();
    let shortened = boundary_element::solve(asked, None, &mut workspace, &Unmonitored);
    let shortened = shortened.expect("a solution");

    let whole = StripOperator::new(
        &level.normalised,
        nu,
        false,
        Precision::Double,
        &Unmonitored,
    )
    .expect("never stopped");
    let mut t = vec![0.0; 2 * whole.padded(None)];
    for rule in [Rule::ThreePoint, Rule::Trapezoid] {
        let equations = SlipEquations::new(rule, &level.normalised, &whole, None);
        let resized = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(equations.padded(), 0.0);
            values
        };
        let (rigid, bound, area) = (
            equations.rigid(motion),
            resized(&level.bound),
            resized(&level.area),
        );
        let law = NewtonTask {
            rigid: &rigid,
            bound: &bound,
            fall: None,
            area: &area,
            scale: 1.0,
            tolerance: 1e-9,
            accepts_start: true,
        };
        let report = Newton::new(&equations)
            .solve(&law, &mut t, &mut workspace, &Unmonitored)
            .expect("never stopped");
        assert!(report.converged, "{rule:?}: {report:?}");
    }
    let padded = t.len() / 2;
    (0..level.mesh.cells())
        .map(|i| (shortened.traction[0][i] - t[i]).hypot(shortened.traction[1][i] - t[padded + i]))
        .fold(0.0, f64::max)
}

#[test]
fn nothing_is_solved_without_creepage() {
    let point = answered(&Ellipse::steel(1.5, 0.28).normalised(0.0, 0.0, 0.0));
    assert_eq!(
        (point.force_x_n, point.force_y_n, point.moment_z_n_mm),
        (0.0, 0.0, 0.0)
    );
    assert_eq!((point.solver.iterations, point.solver.products), (0, 0));
    assert!(
        point.solver.skipped[0].contains("nothing to solve"),
        "{:?}",
        point.solver.skipped
    );
    assert_eq!(point.slip_area_mm2, Some(0.0));
    // A creepage of 1e-12 of saturation is solved, with negligible forces.
    let near = answered(&Ellipse::steel(1.5, 0.28).normalised(1e-12, 0.0, 0.0));
    assert!(
        near.solver.products > 0 && near.force_x_n > 0.0 && near.force_x_n < 1e-6,
        "{near:?}"
    );
}

#[test]
fn mirror_symmetry_halves_the_work_and_does_not_move_the_answer() {
    for (motion, words) in [
        ([0.3, 0.0, 0.0], "half the cells"),
        ([0.0, 0.4, 0.8], "half the cells"),
        ([0.3, 0.2, 0.8], "half of the influence matrix"),
    ] {
        let contact = Ellipse::steel(0.7, 0.28).normalised(motion[0], motion[1], motion[2]);
        let skipped = answered(&contact).solver.skipped;
        assert!(skipped.iter().any(|s| s.contains(words)), "{skipped:?}");
        let distance = distance_to_plain_newton(&contact);
        assert!(distance < 1e-6, "{motion:?}: {distance:e}");
    }
}

#[test]
fn in_full_slip_nothing_sticks_and_the_answer_is_that_of_a_plain_newton_solve() {
    for (a_over_b, nu, motion) in [
        (1.4, 0.28, [60.0, 0.0, 0.0]),
        (1.4, 0.28, [80.0, -40.0, 3.0]),
        (0.05, 0.5, [3e7, 2e7, 0.0]),
        (1.0, 0.28, [3e8, 2e8, 0.0]),
        (20.0, 0.0, [3e7, 2e7, 1e5]),
    ] {
        let contact = Ellipse::steel(a_over_b, nu).normalised(motion[0], motion[1], motion[2]);
        let point = answered(&contact);
        assert_eq!(point.stick_area_mm2, Some(0.0));
        let distance = distance_to_plain_newton(&contact);
        assert!(distance < 1e-6, "{a_over_b} {motion:?}: {distance:e}");
    }
}

#[test]
fn a_start_from_the_simplified_theory_saves_products_and_does_not_move_the_answer() {
    let (mut from_zero, mut from_simplified) = (0, 0);
    for ratio in [0.2, 0.7, 1.5, 5.0] {
        for [x, y, spin] in [
            [0.1, 0.0, 0.0],
            [0.5, 0.0, 0.0],
            [0.0, 0.9, 0.0],
            [0.0, 0.0, 1.0],
            [0.3, 0.2, 0.8],
            [0.9, -0.7, -2.0],
        ] {
            let contact = Ellipse::steel(ratio, 0.28).normalised(x, y, spin);
            on_level(&contact, |task, asked| {
                let simplified = fastsim::tractions(task, asked.level, asked.motion);
                let mut workspace = NewtonWorkspace::default();
                let mut of = |start| {
                    boundary_element::solve(asked, start, &mut workspace, &Unmonitored)
                        .expect("a solution")
                };
                let [zero, near] = [of(None), of(Some(&simplified))];
                from_zero += zero.work.products;
                from_simplified += near.work.products;
                let pairs = zero
                    .traction
                    .iter()
                    .flatten()
                    .zip(near.traction.iter().flatten());
                let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-6, "{ratio} {x} {y} {spin}: {apart:e}");
            });
        }
    }
    assert!(
        10 * from_simplified < 9 * from_zero,
        "{from_simplified} products, {from_zero} from zero tractions"
    );
}

#[test]
fn without_friction_slip_is_rigid_and_nothing_pulls() {
    let contact = Ellipse {
        friction: 0.0,
        ..Ellipse::steel(1.0, 0.28).moving(0.001, 0.002, 0.0)
    };
    let (solution, fields) = solve(&contact.case(STRIPS, CELLS));
    let point = &solution.patches[0].points[0];
    assert_eq!(
        (point.force_x_n, point.force_y_n, point.friction_power_n),
        (0.0, 0.0, 0.0)
    );
    let slip = fields.patches[0].points[0]
        .slip_x
        .as_ref()
        .expect("was asked for");
    assert!(slip.iter().all(|s| (s - 0.001).abs() < 1e-15));
}
