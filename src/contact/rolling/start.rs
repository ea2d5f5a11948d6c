//! Where the iteration of a level begins.

/// First iterates of both rules, dimensionless, one value per cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// For the three-point rule.
    pub three_point: [Vec<f64>; 2],
    /// For the trapezoid rule, if there is a better one than the three-point solution: it is moved by as much as that solution is from
    /// its own first iterate.
    pub trapezoid: Option<[Vec<f64>; 2]>,
}
