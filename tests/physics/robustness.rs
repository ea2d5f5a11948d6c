//! Tests that the solver ends with an answer for every motion and shape.

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use serde_json::json;

use crate::random::Random;
use crate::reference::{Ellipse, assert_none};

/// Newton iterations allowed for one rule on one mesh. An explicit mesh is solved with two rules.
const ITERATIONS_PER_RULE: u32 = 25;

/// Returns contacts with a creepage of 1e-6 to 1e2 of saturation in any direction, a normalised spin of 0 to 100 with either sign, a/b 0.05 to 20, ν
/// 0 to 0.5. One motion in four has no spin, and one in four no creepage.
fn contacts(count: usize) -> Vec<Ellipse> {
    let mut random = Random(20_240_229);
    (0..count)
        .map(|k| {
            let poisson = if k % 10 == 0 {
                0.5 * f64::from(k % 20 == 0)
            } else {
                random.between(0.0, 0.5)
            };
            let steel = Ellipse::steel(random.decades(0.05, 20.0), poisson);
            // Far below the limit F ≈ G c² C ν with C between 3 and 5: a normalised creepage of 1 is near saturation.
            let creepage = if k % 4 == 1 {
                0.0
            } else {
                random.decades(1e-6, 1e2)
            };
            let angle = random.between(0.0, std::f64::consts::TAU);
            let size = if random.part() < 0.5 {
                random.between(0.0, 100.0)
            } else {
                random.decades(1e-6, 1e2)
            };
            let sign = if random.part() < 0.5 { -1.0 } else { 1.0 };
            let spin = if k % 4 == 0 { 0.0 } else { sign * size };
            steel.normalised(creepage * angle.cos(), creepage * angle.sin(), spin)
        })
        .collect()
}

fn describe(contact: &Ellipse) -> String {
    let unit = contact.normalised(1.0, 1.0, 1.0).motion;
    let normalised: Vec<String> = (0..3)
        .map(|k| format!("{:.3e}", contact.motion[k] / unit[k]))
        .collect();
    format!(
        "a/b {:.3} ν {:.3} motion [{}]",
        contact.a_mm / contact.b_mm,
        contact.poisson_ratio,
        normalised.join(", ")
    )
}

#[test]
fn five_hundred_random_motions_are_solved_in_few_iterations() {
    let contacts = contacts(500);
    let (mut failures, mut iterations, mut fallbacks) = (Vec::new(), Vec::new(), 0);
    for (k, contact) in contacts.iter().enumerate() {
        let (strips, cells) = [(8, 16), (12, 12), (6, 12)][k % 3];
        let checked =
            contact::check(&contact.case(strips, cells), &Limits::default()).expect("a valid case");
        let (solution, fields) = match contact::solve(&checked, &Unmonitored) {
            Ok(answer) => answer,
            Err(error) => {
                failures.push(format!("{}: {error}", describe(contact)));
                continue;
            }
        };
        let point = &solution.patches[0].points[0];
        let forces = contact.relative(point);
        let largest_arm = contact.a_mm.max(contact.b_mm) / contact.c();
        fallbacks += usize::from(!solution.remarks.is_empty());
        iterations.push(point.solver.iterations);
        if !forces.iter().all(|f| f.is_finite())
            || forces[0].hypot(forces[1]) > 1.0 + 1e-6
            || forces[2].abs() > largest_arm
        {
            failures.push(format!(
                "{}: impossible forces {forces:?}",
                describe(contact)
            ));
        }
        if point.friction_power_n
            < -1e-9 * contact.limit() * contact.motion[0].hypot(contact.motion[1])
        {
            failures.push(format!(
                "{}: friction gains power, {}",
                describe(contact),
                point.friction_power_n
            ));
        }
        if point.solver.iterations > 2 * ITERATIONS_PER_RULE && solution.remarks.is_empty() {
            failures.push(format!(
                "{}: {} iterations",
                describe(contact),
                point.solver.iterations
            ));
        }
        let traction = fields.patches[0].points[0].traction_x_mpa.as_ref().unwrap();
        if !traction.iter().all(|t| t.is_finite()) {
            failures.push(format!("{}: a traction is not a number", describe(contact)));
        }
    }
    let most = iterations.iter().max().copied().unwrap_or(0);
    let mean = f64::from(iterations.iter().sum::<u32>()) / iterations.len().max(1) as f64;
    println!(
        "{} solved, {mean:.1} iterations on average, {most} at most, {fallbacks} with a remark",
        iterations.len()
    );
    assert_none("of 500 random motions", &failures);
}

#[test]
fn liu_hsu_solves_or_says_what_to_use_instead() {
    let (mut solved, mut refused) = (0, 0);
    for contact in contacts(500) {
        let mut case = contact.case(8, 8);
        case["solver"]["method"] = json!("liu_hsu");
        let checked = contact::check(&case, &Limits::default()).expect("a valid case");
        match contact::solve(&checked, &Unmonitored) {
            Ok((solution, _)) => {
                solved += 1;
                let forces = contact.relative(&solution.patches[0].points[0]);
                assert!(
                    forces[0].hypot(forces[1]) < 1.0 + 1e-6,
                    "{}: {forces:?}",
                    describe(&contact)
                );
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().contains("boundary_element"), "{error}");
            }
        }
    }
    println!("liu_hsu: {solved} of 500 random motions solved, {refused} refused");
    assert!(solved > 0);
}
