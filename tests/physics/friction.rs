//! Tests of Coulomb's law in every cell: the bound, complementarity, and slip along the traction.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::mesh::MeshSize;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal_stage;
use railhead_contact::rolling::methods::boundary_element::newton::Newton;
use railhead_contact::rolling::methods::boundary_element::task::NewtonTask;
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::slip_equations::SlipEquations;
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::strip_mesh::StripMesh;
use railhead_contact::rolling::task::{Motion, TOLERANCE_LEAST};

use crate::laws::{MOTIONS, shapes};
use crate::reference::{Ellipse, assert_none, solve};

/// Allowed residual of one cell when the root mean square of all residuals is at the solver's tolerance.
const CELL: f64 = 10.0 * TOLERANCE_LEAST;

struct Cells {
    traction: [Vec<f64>; 2],
    slip: [Vec<f64>; 2],
    bound: Vec<f64>,
    slips: Vec<bool>,
    /// Units of slips and tractions.
    largest: [f64; 2],
}

/// Returns the largest violations: |T| above the bound, slip in a sticking cell, |s|(g − |T|), |s||T| − s·T.
fn violations(cells: &Cells) -> [f64; 4] {
    let [rigid, bound] = cells.largest;
    let mut worst = [0.0f64; 4];
    for i in 0..cells.bound.len() {
        let [tx, ty] = [0, 1].map(|k| cells.traction[k][i] / bound);
        let [sx, sy] = [0, 1].map(|k| cells.slip[k][i] / rigid);
        let (traction, slip, g) = (tx.hypot(ty), sx.hypot(sy), cells.bound[i] / bound);
        worst[0] = worst[0].max(traction - g);
        if !cells.slips[i] {
            worst[1] = worst[1].max(slip);
        }
        worst[2] = worst[2].max(slip * (g - traction));
        worst[3] = worst[3].max(slip * traction - (sx * tx + sy * ty));
    }
    worst
}

/// Returns the dimensionless tractions and slips of one rule.
fn one_rule(contact: &Ellipse, rule: Rule) -> Cells {
    let checked = contact::check(&contact.case(12, 12), &Limits::default()).expect("a valid case");
    let size = MeshSize {
        strips: 12,
        cells: 12,
    };
    let footprint = normal_stage::solve(&checked, &Unmonitored)
        .expect("a contact")
        .footprint;
    let level = StripMesh::new(&checked.rolling_task(&footprint), size).expect("a mesh");
    let motion: Motion = level.scale.motion(&checked.problem.motions[0]);
    let operator = level.operator(&Unmonitored).expect("never stopped");
    let equations = SlipEquations::new(rule, &level.normalised, &operator, None);
    let padded = equations.padded();
    let resized = |values: &[f64]| {
        let mut values = values.to_vec();
        values.resize(padded, 0.0);
        values
    };
    let (bound, area) = (resized(&level.bound), resized(&level.area));
    let rigid = equations.rigid(&motion);
    let newton = Newton::new(&equations);
    let mut workspace = NewtonWorkspace::default();
    let law = NewtonTask {
        rigid: &rigid,
        bound: &bound,
        fall: None,
        area: &area,
        scale: 1.0,
        // The trapezoidal rule passes the residual of a cell on to its neighbours.
        tolerance: 0.01 * TOLERANCE_LEAST,
        accepts_start: true,
    };
    let mut t = vec![0.0; 2 * padded];
    let report = newton.solve(&law, &mut t, &mut workspace, &Unmonitored);
    assert!(report.expect("never stopped").converged);
    let n = level.mesh.cells();
    let halves = |v: &[f64]| [v[..n].to_vec(), v[padded..padded + n].to_vec()];
    let reach = contact.a_mm.max(contact.b_mm) / contact.c();
    Cells {
        slips: (0..n)
            .map(|i| newton.slips(&bound, &t, workspace.slip(), i))
            .collect(),
        slip: halves(workspace.slip()),
        traction: halves(&t),
        largest: [
            motion.creepage_x.hypot(motion.creepage_y) + motion.spin_per_mm.abs() * reach,
            1.0,
        ],
        bound: level.bound,
    }
}

/// Returns the cells of an answer as a client gets it.
fn answered(contact: &Ellipse, n: u32) -> Cells {
    let (_, fields) = solve(&contact.case(n, n));
    let patch = &fields.patches[0];
    let point = &patch.points[0];
    let [vx, vy, phi] = contact.motion;
    let take = |values: &Option<Vec<f64>>| values.clone().expect("was asked for");
    let mut slip = [take(&point.slip_x), take(&point.slip_y)];
    let zones = point.zone.as_ref().expect("was asked for");
    for (i, zone) in zones.iter().enumerate() {
        // The last cell of a strip may stick on average and slip at its trailing end.
        let last = i % n as usize == 0;
        if last && *zone == contact::solution::words::answer::Zone::Stick {
            slip.iter_mut().for_each(|slip| slip[i] = 0.0);
        }
    }
    Cells {
        traction: [take(&point.traction_x_mpa), take(&point.traction_y_mpa)],
        slip,
        bound: take(&patch.cells(0).pressure_mpa)
            .iter()
            .map(|p| contact.friction * p)
            .collect(),
        slips: point
            .zone
            .as_ref()
            .expect("was asked for")
            .iter()
            .map(|z| *z == contact::solution::words::answer::Zone::Slip)
            .collect(),
        largest: [
            vx.hypot(vy) + phi.abs() * contact.a_mm.max(contact.b_mm),
            contact.friction * contact.pressure_max(),
        ],
    }
}

fn contacts() -> impl Iterator<Item = (String, Ellipse)> {
    shapes().flat_map(|steel| {
        MOTIONS.map(|[x, y, spin]| {
            let name = format!(
                "a/b {:.2} ν {} motion {:?}",
                steel.a_mm / steel.b_mm,
                steel.poisson_ratio,
                [x, y, spin]
            );
            (name, steel.normalised(x, y, spin))
        })
    })
}

/// Returns a message for each violated law.
fn broken(name: &str, cells: &Cells) -> Vec<String> {
    let laws = [
        "|T| above μp",
        "slip in a stick cell",
        "|s|(μp − |T|)",
        "|s||T| − s·T",
    ];
    let too_large = laws
        .into_iter()
        .zip(violations(cells))
        .filter(|(_, value)| *value > CELL);
    too_large
        .map(|(law, value)| format!("{law}: {value:.2e} for {name}"))
        .collect()
}

#[test]
fn every_cell_of_a_solved_rule_obeys_coulomb() {
    let failures: Vec<String> = contacts()
        .flat_map(|(name, contact)| {
            let mut all = broken(&name, &one_rule(&contact, Rule::ThreePoint));
            // The slips of the trapezoidal rule oscillate, but they too obey the law.
            all.extend(broken(&name, &one_rule(&contact, Rule::Trapezoid)));
            all
        })
        .collect();
    assert_none("laws of friction broken", &failures);
}

#[test]
fn every_answered_cell_obeys_coulomb() {
    let failures: Vec<String> = contacts()
        .flat_map(|(name, contact)| broken(&name, &answered(&contact, 12)))
        .collect();
    assert_none("laws of friction broken", &failures);
}
