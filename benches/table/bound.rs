//! Error bound of the table: the deviation of each node from a cubic through its neighbours, and a factor from held-out motions.

use std::ops::Range;

use railhead_contact::rolling::methods::table::evaluate::growth;
use railhead_contact::rolling::methods::table::spline::{
    DIRECTIONS, OUTPUTS, POISSON_RATIOS, POLES, RATIOS, SIZE_STEPS, SIZES, size,
};

/// Numbers of nodes along a/b, pole, direction and size.
const NODES: [usize; 4] = [RATIOS, POLES, DIRECTIONS, SIZES.len()];

/// Ranges of the sizes with separate bounds: partial slip, and σ ≥ 0.79, where nearly all cells slip and errors are smaller relative to the
/// indicators. They were chosen among six divisions, with the other half of the contacts too.
pub const PARTS: [Range<usize>; 2] = [0..17, 17..SIZES.len()];

/// Returns the index of the size at the start of a cell between nodes.
pub fn size_of(cell: usize) -> usize {
    cell % (SIZES.len() - 1)
}

/// Returns the index of the part that contains a cell between nodes.
pub fn part_of(cell: usize) -> usize {
    let size = size_of(cell);
    PARTS
        .iter()
        .position(|part| part.contains(&size))
        .expect("a part")
}

/// Returns the indicators of the cells between nodes, `[a/b][pole][direction][size]`. An indicator is the mean over the corners of a cell of the
/// deviation from a cubic through two neighbouring sizes on each side, largest over ν, forces and moment. Differences along the other axes, alone
/// and in sums, give bounds that are 5 to 100 % larger for the same share of motions.
pub fn indicators(values: &[f32]) -> Vec<f32> {
    let mut of_nodes = vec![0.0_f32; NODES.iter().product()];
    for (at, largest) in of_nodes.iter_mut().enumerate() {
        let node = split(at, NODES);
        let sigma = f64::from(SIZES[node[3]]) / SIZE_STEPS;
        let grown = if sigma < 1.0 {
            growth(size(sigma))
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

/// Returns the deviation of a value from the cubic through its neighbours. Near the ends, returns that of the nearest node with all neighbours.
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
