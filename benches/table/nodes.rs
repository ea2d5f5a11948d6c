//! The nodes of the table, solved column by column: all poles and sizes of one direction, a/b and ν.

use std::sync::Arc;

use railhead_contact::rolling::methods::table::evaluate::CreepTable;
use railhead_contact::rolling::methods::table::spline::{
    DIRECTIONS, POISSON_RATIOS, POLES, RATIOS, SIZE_STEPS, SIZES, direction, pole, ratio, size,
};
use railhead_contact::rolling::operator_store::OperatorStore;

use crate::random::Random;
use crate::solver::{
    Answer, Contact, largest_error, print_errors, read, solve, solve_parts, write,
};

/// The size that represents infinity.
const MOST: f64 = 1e5;

/// Returns the target of the nodes of an a/b. Long ellipses cost most: those of a/b 10 at ν = 1/2 a hundred times as much as a circle.
pub fn target(ratio: usize) -> f64 {
    match ratio {
        9 => 0.006,
        8 => 0.004,
        _ => 0.002,
    }
}

/// Returns the size r of a node.
fn size_of(node: usize) -> f64 {
    match SIZES[node] {
        last if f64::from(last) == SIZE_STEPS => MOST,
        step => size(f64::from(step) / SIZE_STEPS),
    }
}

/// Solves one column: answers `[pole][size]` of a direction. Nodes of size 0 belong to linear theory and are not solved.
fn column(node: [usize; 2], chi: usize, target: f64) -> Vec<Answer> {
    let contact = Contact {
        ratio: ratio(node[0]),
        poisson: POISSON_RATIOS[node[1]],
    };
    let (c, shape) = contact.scales();
    let operators = Arc::new(OperatorStore::new(600 << 20));
    let mut answers = vec![[f64::NAN; 5]; POLES * SIZES.len()];
    // Pure spin has no direction, and without spin ±χ are mirror images. Those nodes are solved once.
    let first = usize::from(chi < DIRECTIONS / 2);
    let last = POLES - usize::from(chi != DIRECTIONS / 2);
    for k in 1..SIZES.len() {
        let poles = first..last;
        let creepages: Vec<[f64; 3]> = poles
            .clone()
            .map(|p| shape.creepage_of_size(size_of(k), pole(p), direction(chi), c))
            .map(|[x, y, z]| {
                if chi == 0 || chi == DIRECTIONS - 1 {
                    [0.0, y, z]
                } else {
                    [x, y, z]
                }
            })
            .collect();
        let target = if k == SIZES.len() - 1 {
            0.5 * target.min(0.004)
        } else {
            target
        };
        let solved = solve(&operators, contact, &creepages, target);
        for (p, answer) in poles.zip(solved) {
            answers[p * SIZES.len() + k] = answer;
        }
    }
    answers
}

fn name([ratio, poisson]: [usize; 2], chi: usize) -> String {
    format!("nodes-{ratio}-{poisson}-{chi:02}.bin")
}

/// Returns a solved column.
pub fn column_of(node: [usize; 2], chi: usize) -> Option<Vec<Answer>> {
    let numbers = read(&name(node, chi))?;
    Some(numbers.as_chunks::<5>().0.to_vec())
}

/// Solves the missing columns: first those of every other direction, and round ellipses before long ones.
pub fn solve_all() {
    let mut missing = Vec::new();
    for odd in [false, true] {
        for ratio in [5, 4, 6, 3, 7, 2, 8, 1, 9, 0] {
            for poisson in [1, 0, 2] {
                for chi in (0..DIRECTIONS).filter(|chi| (chi % 2 == 1) == odd) {
                    if read(&name([ratio, poisson], chi)).is_none() {
                        missing.push(([ratio, poisson], chi));
                    }
                }
            }
        }
    }
    solve_parts(&missing, |(node, chi)| {
        let answers = column(*node, *chi, target(node[0]));
        let name = name(*node, *chi);
        write(&name, answers.as_flattened());
        name
    });
}

/// Solves random nodes again, each separately, and prints their distance from the table.
pub fn recompute(count: usize, table: &CreepTable) {
    let random = &mut Random(0x7AB1_E001);
    let mut errors = Vec::new();
    for _ in 0..count {
        let node = [random.below(RATIOS), random.below(POISSON_RATIOS.len())];
        let (chi, p, k) = (
            random.below(DIRECTIONS),
            random.below(POLES),
            1 + random.below(SIZES.len() - 2),
        );
        let contact = Contact {
            ratio: ratio(node[0]),
            poisson: POISSON_RATIOS[node[1]],
        };
        let (c, shape) = contact.scales();
        let creepage = shape.creepage_of_size(size_of(k), pole(p), direction(chi), c);
        let operators = Arc::new(OperatorStore::default());
        let answer = solve(&operators, contact, &[creepage], target(node[0]))[0];
        let found = table
            .ellipse(contact.ratio, contact.poisson)
            .creep(creepage);
        errors.push(largest_error(found.force, answer));
    }
    print_errors("nodes", errors);
}
