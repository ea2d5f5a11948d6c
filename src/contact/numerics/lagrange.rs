//! Polynomials through given points, after Lagrange.

/// Weights of the values at the nodes in the value at `at` of the polynomial through them. No two nodes are equal.
pub(crate) fn weights<const N: usize>(nodes: &[f64; N], at: f64) -> [f64; N] {
    std::array::from_fn(|i| {
        let others = || (0..N).filter(|j| *j != i);
        let above: f64 = others().map(|j| at - nodes[j]).product();
        let below: f64 = others().map(|j| nodes[i] - nodes[j]).product();
        above / below
    })
}

/// Value at `at` of the polynomial of least degree through points `(place, value)`, of which there is at least one.
pub(crate) fn value(points: &[(f64, f64)], at: f64) -> f64 {
    let mut sum = 0.0;
    for (i, (node, value)) in points.iter().enumerate() {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others.map(|(_, (x, _))| (at - x) / (node - x)).product();
        sum += weight * value;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_of_as_many_terms_as_points_is_met_everywhere() {
        let cubic = |x: f64| 1.0 + x * (2.0 - x * (0.5 + 3.0 * x));
        let nodes = [-1.0, 0.2, 0.7, 2.0];
        let points = nodes.map(|x| (x, cubic(x)));
        for at in [-2.0, -1.0, 0.0, 0.65, 3.0] {
            let weighted = weights(&nodes, at).into_iter().zip(points);
            let by_weights: f64 = weighted.map(|(weight, (_, value))| weight * value).sum();
            assert!((by_weights - cubic(at)).abs() < 1e-12 * cubic(at).abs().max(1.0));
            assert!((value(&points, at) - by_weights).abs() < 1e-12 * cubic(at).abs().max(1.0));
        }
        assert_eq!(value(&points[..1], 7.0), points[0].1);
    }
}
