//! The length of a vector in the plane.

/// `√(x² + y²)` of numbers whose squares are numbers too, as those of everything dimensionless are. `f64::hypot` takes any numbers, and a creep
/// map of 1000 motions took 6 % longer with it.
#[must_use]
pub fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}
