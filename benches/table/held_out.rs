//! Motions that were not used to make the table.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use railhead_contact::rolling::linear_theory::coefficients;
use railhead_contact::rolling::methods::table::evaluate::CreepTable;
use railhead_contact::rolling::methods::table::spline::{Shape, size, spin_factor};
use railhead_contact::rolling::operator_store::OperatorStore;
use serde_json::{Value, json};

use crate::random::Random;
use crate::solver::{Contact, largest_error, print_errors, read, solve, solve_parts, write};

/// Number of contacts. `MOTIONS` is the number of motions of each.
pub const CONTACTS: usize = 400;
pub const MOTIONS: usize = 15;
pub const TARGET: f64 = 0.002;

/// Returns a contact and its motions. ln a/b and ν are uniform, directions are uniform on the sphere of (u_x, u_y, u_s) with x, z of any sign, and σ
/// is uniform from 0.02 to 0.97.
pub fn contact(number: usize) -> (Contact, Vec<[f64; 3]>) {
    let random = &mut Random(0x7AB1_E000 + number as u64);
    let contact = Contact {
        ratio: random.decades(0.1, 10.0),
        poisson: random.between(0.0, 0.5),
    };
    let [c11, c22, _] = coefficients(contact.ratio, contact.poisson);
    let h = spin_factor(contact.ratio.sqrt(), [c11, c22]);
    let mut motions: Vec<[f64; 3]> = (0..MOTIONS)
        .map(|_| {
            let (height, turn) = (
                random.between(-1.0, 1.0),
                random.between(0.0, 4.0 * FRAC_PI_2),
            );
            let flat = (1.0 - height * height).sqrt();
            let r = size(random.between(0.02, 0.97));
            [
                r * flat * turn.cos() / c11,
                r * flat * turn.sin() / c22,
                r * height / h,
            ]
        })
        .collect();
    // Neighbours in size follow each other only to save time.
    motions.sort_by(|a, b| {
        let size = |m: &[f64; 3]| Shape::new(contact.ratio.sqrt(), [c11, c22]).size(*m, [c11, c22]);
        size(a).total_cmp(&size(b))
    });
    (contact, motions)
}

/// Returns the name of the file of a contact.
pub fn name(number: usize) -> String {
    format!("motions-{number:04}.bin")
}

/// Solves the missing contacts.
pub fn solve_all() {
    let missing: Vec<usize> = (0..CONTACTS)
        .filter(|k| read(&name(*k)).is_none())
        .collect();
    solve_parts(&missing, |number| {
        let (contact, motions) = contact(*number);
        // The motions of a contact share one operator store.
        let operators = Arc::new(OperatorStore::new(600 << 20));
        let answers = solve(&operators, contact, &motions, TARGET);
        let name = name(*number);
        write(&name, answers.as_flattened());
        name
    });
}

/// Returns a small part of the held-out motions, not used for bounds, for the tests.
pub fn sample() -> String {
    let contacts = (0..24).map(|k| 16 * k + 1).filter_map(|number| {
        let (contact, motions) = contact(number);
        let answers = read(&name(number))?;
        let short = |value: &f64| format!("{value:.7e}").parse::<f64>().expect("a number");
        let pair = |(motion, answer): (&[f64; 3], &[f64])| {
            json!([motion, answer.iter().map(short).collect::<Vec<f64>>()])
        };
        let motions: Vec<Value> = motions.iter().zip(answers.chunks_exact(5)).map(pair).collect();
        let line = json!({ "a_over_b": contact.ratio, "poisson_ratio": contact.poisson, "motions": motions });
        Some(line.to_string())
    });
    format!("[\n{}\n]\n", contacts.collect::<Vec<String>>().join(",\n"))
}

/// Solves random motions again and prints their distance from the table.
pub fn recompute(count: usize, table: &CreepTable) {
    let mut errors = Vec::new();
    for number in 0..count.div_ceil(MOTIONS) {
        // Contacts outside all other sets.
        let (contact, motions) = contact(CONTACTS + number);
        let operators = Arc::new(OperatorStore::default());
        let ellipse = table.ellipse(contact.ratio, contact.poisson);
        for (motion, answer) in motions
            .iter()
            .zip(solve(&operators, contact, &motions, TARGET))
        {
            let found = ellipse.creep(*motion);
            errors.push(largest_error(found.force, answer));
        }
    }
    print_errors("motions", errors);
}
