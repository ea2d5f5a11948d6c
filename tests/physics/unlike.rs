//! Bodies that differ: references, laws and faults.

use railhead::contact;
use railhead::contact::case::limits::Limits;
use railhead::contact::normal::hertz::{Ellipse, NormalLoad};
use railhead::contact::solution::words::answer::Solution;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::cases::assert_fault;
use crate::reference::{Converged, assert_none, read, solve};

/// A contact solved elsewhere; forces over the friction limit, moment over that and `arm_mm`.
#[derive(Debug, Deserialize)]
struct Reference {
    id: String,
    material: Value,
    difference: f64,
    radii_mm: [f64; 2],
    normal_force_n: f64,
    friction: f64,
    motion: [f64; 3],
    forces: [Converged; 3],
    arm_mm: f64,
    approach_mm: Converged,
    area_mm2: Converged,
    pressure_max_mpa: Converged,
}

impl Reference {
    fn case(&self, motion: Value) -> Value {
        json!({
            "material": self.material,
            "friction": { "coefficient": self.friction },
            "contact": { "type": "radii", "rolling_mm": self.radii_mm[0], "lateral_mm": self.radii_mm[1] },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": motion,
        })
    }

    fn one(&self) -> Value {
        let [x, y, spin] = self.motion;
        json!({ "creepage_x": x, "creepage_y": y, "spin_per_mm": spin })
    }

    /// Largest error of the resultants, beyond that of the reference.
    fn error(&self, solution: &Solution) -> f64 {
        let point = &solution.patches[0].points[0];
        let limit = self.friction * self.normal_force_n;
        let found = [
            point.force_x_n,
            point.force_y_n,
            point.moment_z_n_mm / self.arm_mm,
        ];
        let off = |k: usize| {
            ((found[k] / limit - self.forces[k].value).abs() - self.forces[k].unc).max(0.0)
        };
        [0, 1, 2].map(off).into_iter().fold(0.0, f64::max)
    }
}

#[test]
fn unlike_bodies_agree_with_contact_within_one_percent_and_the_estimate() {
    let all: Vec<Reference> = read("unlike.json");
    let (mut failures, mut covered) = (Vec::new(), 0);
    // The mirrored case of another one has a test of its own.
    for reference in all
        .iter()
        .filter(|reference| !reference.id.ends_with("mxi"))
    {
        let began = std::time::Instant::now();
        let (solution, _) = solve(&reference.case(reference.one()));
        let seconds = began.elapsed().as_secs_f64();
        let patch = &solution.patches[0];
        let estimate = patch.points[0].error_estimate.expect("a target").force_x_n
            / (reference.friction * reference.normal_force_n);
        let error = reference.error(&solution);
        covered += usize::from(error <= estimate);
        let relative = |found: f64, known: Converged| {
            ((found - known.value).abs() - known.unc).max(0.0) / known.value
        };
        let approach = relative(patch.approach_mm.expect("found"), reference.approach_mm);
        let area = relative(patch.area_mm2, reference.area_mm2);
        let pressure = relative(patch.pressure_max_mpa, reference.pressure_max_mpa);
        println!(
            "{}: K {:.3}, forces off by {error:.4} ({estimate:.4} estimated), approach {approach:.5}, area {area:.4}, pressure {pressure:.4}, {seconds:.3} s {:?}",
            reference.id,
            reference.difference,
            solution
                .remarks
                .iter()
                .map(|r| r.code.clone())
                .collect::<Vec<_>>()
        );
        if error > 0.01 || approach > 0.005 || area > 0.01 || pressure > 0.025 {
            failures.push(reference.id.clone());
        }
    }
    assert_none("too far from CONTACT", &failures);
    assert_eq!(covered, all.len() - 1, "estimates that hold");
}

fn soft_on_rigid(id: &str) -> Reference {
    let all: Vec<Reference> = read("unlike.json");
    all.into_iter()
        .find(|reference| reference.id == id)
        .expect("a reference")
}

#[test]
fn bodies_that_hardly_differ_give_the_forces_of_like_bodies() {
    let mut reference = soft_on_rigid("dis_poly_steel_ab1_mu0.6_mix");
    let forces = |reference: &Reference| {
        let (solution, _) = solve(&reference.case(reference.one()));
        let point = &solution.patches[0].points[0];
        [point.force_x_n, point.force_y_n, point.moment_z_n_mm]
    };
    let body = |nu: f64| json!({ "shear_modulus_mpa": 800.0, "poisson_ratio": nu });
    reference.material = body(0.4);
    let like = forces(&reference);
    let differences = [1e-3, 1e-5].map(|by| {
        reference.material = json!({ "upper": body(0.4 - by), "lower": body(0.4 + by) });
        let found = forces(&reference);
        (found[0] - like[0]).hypot(found[1] - like[1])
            / (reference.friction * reference.normal_force_n)
    });
    assert!(
        differences[0] < 2e-3 && differences[1] < 2e-5 && differences[1] > 0.0,
        "{differences:?}"
    );
}

/// Turning the track round exchanges nothing but the sign of x; exchanging the bodies changes the sign of K.
#[test]
fn bodies_exchanged_and_rolled_backwards_give_the_mirrored_forces() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_mxi");
    let exchanged = soft_on_rigid("dis_rigid_soft_ab1_mu0.3_xi");
    let [a, b] = [&reference, &exchanged]
        .map(|reference| solve(&reference.case(reference.one())).0.patches[0].points[0].force_x_n);
    assert!((a + b).abs() < 2e-3 * a.abs(), "{a} {b}");
}

#[test]
fn several_motions_of_unlike_bodies_are_of_first_order_and_say_so() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_eta");
    let alone = solve(&reference.case(reference.one())).0;
    let many = solve(&reference.case(json!([reference.one(), reference.one()]))).0;
    let codes: Vec<&str> = many
        .remarks
        .iter()
        .map(|remark| remark.code.as_str())
        .collect();
    assert!(codes.contains(&"coupling-first-order"), "{codes:?}");
    assert!(
        alone
            .remarks
            .iter()
            .all(|remark| remark.code != "coupling-first-order")
    );
    let limit = reference.friction * reference.normal_force_n;
    let estimate = many.patches[0].points[0]
        .error_estimate
        .expect("a target")
        .force_x_n
        / limit;
    let error = reference.error(&many);
    assert!(
        error < estimate && error > reference.error(&alone),
        "{error} {estimate}"
    );
}

/// The work that falls short of the friction power comes from the moment against rolling: friction takes power though nothing creeps.
#[test]
fn free_rolling_of_unlike_bodies_takes_power_and_its_cells_add_up_to_it() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_free0");
    let mut case = reference.case(reference.one());
    case["outputs"] = json!(["resultants", "tractions", "slip"]);
    let (solution, fields) = solve(&case);
    let point = &solution.patches[0].points[0];
    let cells = fields.patches[0].cells(0);
    let values = &fields.patches[0].points[0];
    let take = |values: &Option<Vec<f64>>| values.clone().expect("asked for");
    let (tx, ty) = (take(&values.traction_x_mpa), take(&values.traction_y_mpa));
    let (sx, sy) = (take(&values.slip_x), take(&values.slip_y));
    let of_cell = |i: usize| cells.dx_mm[i] * cells.dy_mm[i] * (tx[i] * sx[i] + ty[i] * sy[i]);
    let sum: f64 = (0..tx.len()).map(of_cell).sum();
    assert!(
        point.friction_power_n > 0.0 && (sum / point.friction_power_n - 1.0).abs() < 1e-9,
        "{sum} {}",
        point.friction_power_n
    );
    // Free rolling proper: the creepage at which nothing pulls.
    let free = solve(&reference.case(json!({ "force_x_n": 0.0 }))).0;
    let point = &free.patches[0].points[0];
    assert!(point.force_x_n.abs() < 1e-3 * reference.friction * reference.normal_force_n);
    assert!(
        point.motion.creepage_x < 0.0,
        "the softer body upward rolls ahead: {:?}",
        point.motion
    );
}

#[test]
fn methods_that_do_not_couple_refuse_bodies_that_differ_much() {
    let reference = soft_on_rigid("dis_soft_rigid_ab1_mu0.3_xi");
    let mut case = reference.case(reference.one());
    assert!(contact::check(&case, &Limits::default()).is_ok());
    case["solver"] = json!({ "method": "fastsim" });
    assert_fault(&case, "/material", &["K = 0.2500", "boundary_element"]);
}

#[test]
fn an_ellipse_has_the_curvatures_of_its_radii() {
    for (rolling, lateral) in [
        (460.0, 300.0),
        (300.0, 460.0),
        (300.0, 300.0),
        (50.0, 4000.0),
    ] {
        let ellipse = Ellipse::of_radii(rolling, lateral, NormalLoad::Force(8e4), 1.1e5);
        let [a, b] = ellipse.curvatures(1.1e5);
        assert!(
            (2.0 * rolling * a - 1.0).abs() < 1e-12,
            "{rolling} {lateral}: {a}"
        );
        assert!(
            (2.0 * lateral * b - 1.0).abs() < 1e-12,
            "{rolling} {lateral}: {b}"
        );
    }
}
