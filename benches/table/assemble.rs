//! Computes the values at the nodes of the table from the solved columns.

use railhead_contact::rolling::linear_theory::coefficients_with_spin;
use railhead_contact::rolling::methods::table::evaluate::{growth, linear, linear_part};
use railhead_contact::rolling::methods::table::spline::{
    DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLES, RATIOS, SIZE_STEPS, SIZES, Shape, direction, pole,
    ratio, size,
};

use crate::fit::VALUES;
use crate::nodes::column_of;
use crate::solver::Answer;

/// Returns the columns of a pair of a/b and ν: `[direction][pole][size]`, with all nodes by symmetry.
fn columns(node: [usize; 2]) -> Option<Vec<Vec<Answer>>> {
    let mut columns: Vec<Vec<Answer>> = (0..DIRECTIONS)
        .map(|chi| column_of(node, chi))
        .collect::<Option<_>>()?;
    let sizes = SIZES.len();
    for chi in 0..DIRECTIONS {
        for k in 0..sizes {
            if chi < DIRECTIONS / 2 {
                let [x, y, moment, stick, error] = columns[DIRECTIONS - 1 - chi][k];
                columns[chi][k] = [x, -y, -moment, stick, error];
            }
            let spin_alone = (POLES - 1) * sizes + k;
            let [_, y, moment, stick, error] = columns[DIRECTIONS / 2][spin_alone];
            columns[chi][spin_alone] = [0.0, y, moment, stick, error];
        }
        if chi == 0 || chi == DIRECTIONS - 1 {
            columns[chi].iter_mut().for_each(|answer| answer[0] = 0.0);
        }
        // Without spin, longitudinal creepage gives neither lateral force nor moment.
        if chi == DIRECTIONS / 2 {
            columns[chi][..sizes]
                .iter_mut()
                .for_each(|answer| [answer[1], answer[2]] = [0.0; 2]);
        }
    }
    Some(columns)
}

/// Returns the values at the nodes, as [`table`](crate::fit::table) takes them.
pub fn values() -> Vec<f32> {
    let mut values = vec![f32::NAN; VALUES];
    for node_ratio in 0..RATIOS {
        for (node_nu, nu) in POISSON_RATIOS.into_iter().enumerate() {
            let Some(columns) = columns([node_ratio, node_nu]) else {
                println!("a/b {} at nu {nu} is missing", ratio(node_ratio));
                continue;
            };
            let (ratio, root) = (ratio(node_ratio), ratio(node_ratio).sqrt());
            let [q11, q22, ..] = coefficients_with_spin(ratio, 0.25);
            let shape = Shape::new(root, [q11, q22]);
            let kalker = coefficients_with_spin(ratio, nu);
            let [c11, c22, ..] = kalker;
            for (chi, column) in columns.iter().enumerate() {
                for p in 0..POLES {
                    for (k, step) in SIZES.into_iter().enumerate() {
                        let answer = column[p * SIZES.len() + k];
                        let direction =
                            shape.creepage_of_size(1.0, pole(p), direction(chi), [c11, c22]);
                        let at = (((node_ratio * POLES + p) * DIRECTIONS + chi) * SIZES.len() + k)
                            * POISSON_RATIOS.len()
                            + node_nu;
                        let to = &mut values[at * OUTPUTS..(at + 1) * OUTPUTS];
                        to.copy_from_slice(&stored(step, answer, kalker, direction));
                    }
                }
            }
        }
    }
    values
}

/// Returns the stored values of an answer: forces over their growth without the part of linear theory, and the stick share.
fn stored(step: u8, answer: Answer, kalker: [f64; 4], direction: [f64; 3]) -> [f32; OUTPUTS] {
    let sigma = f64::from(step) / SIZE_STEPS;
    let stick = answer[3] as f32;
    if step == 0 {
        return [0.0, 0.0, 0.0, 1.0];
    }
    let growth = if sigma < 1.0 {
        growth(size(sigma))
    } else {
        1.0
    };
    let linear = linear(kalker, direction);
    let part = |k: usize| (answer[k] / growth - linear_part(sigma) * linear[k]) as f32;
    [part(0), part(1), part(2), stick]
}
