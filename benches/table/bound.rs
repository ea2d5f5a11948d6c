//! Error bound of the table: how far each node is from a cubic through its neighbours, and a factor from held-out motions.

use std::ops::Range;

use railhead_contact::rolling::methods::table::evaluate::growth;
use railhead_contact::rolling::methods::table::spline::{
    DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLES, RATIOS, SIZE_STEPS, SIZES, size,
};

/// Nodes along a/b, pole, direction and size.
const NODES: [usize; 4] = [RATIOS, POLES, DIRECTIONS, SIZES.len()];

/// Parts of the sizes that have bounds of their own: partial slip, and from σ = 0.79 on, where nearly all slips and errors are smaller beside the
/// indicators. Of six divisions tried on the other half of the contacts too, which chose between them.
pub const PARTS: [Range<usize>; 2] = [0..17, 17..SIZES.len()];

/// Which of the sizes a cell between nodes begins with.
pub fn size_of(cell: usize) -> usize {
    cell % (SIZES.len() - 1)
}

/// Which of the parts a cell between nodes is in.
pub fn part_of(cell: usize) -> usize {
    let size = size_of(cell);
    PARTS
        .iter()
        .position(|part| part.contains(&size))
        .expect("a part")
}

/// Indicators of the cells between nodes, `[a/b][pole][direction][size]`: the mean over the corners of a cell of how far their values are
/// from a cubic through two neighbouring sizes on each side, largest over ν, forces and moment. Differences along the other axes were
/// tried too, alone and in sums: bounds from them are 5 to 100 % larger for the same share of motions.
pub fn indicators(values: &[f32]) -> Vec<f32> {
    let mut of_nodes = vec![0.0_f32; NODES.iter().product()];
    for (at, largest) in of_nodes.iter_mut().enumerate() {
        let node = split(at, NODES);
        let sigma = f64::from(SIZES[node[3]]) / SIZE_STEPS;
        let grown = if sigma < 1.0 {
            growth(size(sigma))[0]
        } else {
            1.0
        };
        for nu in 0..POISSON_RATIOS.len() {
            for k in 0..OUTPUTS - 1 {
                let value = |size: usize| {
                    let at = join([node[0], node[1], node[2], size], NODES);
                    f64::from(values[(at * POISSON_RATIOS.len() + nu) * OUTPUTS + k])
                };
                *largest = largest.max((grown * beside(&value, node[3])) as f32);
            }
        }
    }
    let cells = NODES.map(|n| n - 1);
    let mean = |cell: [usize; 4]| {
        let corner = |k: usize| std::array::from_fn(|axis| cell[axis] + (k >> axis & 1));
        (0..16)
            .map(|k| of_nodes[join(corner(k), NODES)])
            .sum::<f32>()
            / 16.0
    };
    (0..cells.iter().product())
        .map(|at| mean(split(at, cells)))
        .collect()
}

/// How far a value is from the cubic through its neighbours; near the ends as at the nearest node that has them all.
fn beside(value: &dyn Fn(usize) -> f64, node: usize) -> f64 {
    let middle = node.clamp(2, SIZES.len() - 3);
    let place = |k: usize| f64::from(SIZES[k]);
    let neighbours = [middle - 2, middle - 1, middle + 1, middle + 2];
    let mut sum = 0.0;
    for i in neighbours {
        let others = neighbours.iter().filter(|j| **j != i);
        let weight: f64 = others
            .map(|j| (place(middle) - place(*j)) / (place(i) - place(*j)))
            .product();
        sum += weight * value(i);
    }
    (value(middle) - sum).abs()
}

fn split(mut at: usize, counts: [usize; 4]) -> [usize; 4] {
    let mut node = [0; 4];
    for axis in (0..4).rev() {
        node[axis] = at % counts[axis];
        at /= counts[axis];
    }
    node
}

fn join(node: [usize; 4], counts: [usize; 4]) -> usize {
    (0..4).fold(0, |at, axis| at * counts[axis] + node[axis])
}
