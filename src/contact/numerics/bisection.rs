//! Bisection with a fixed number of halvings, for a condition that only tells on which side of the boundary a point lies.

/// The bracket that remains of `low` to `high` (in either order) after the given number of halvings. `is_low` tells on which side of
/// the boundary a point lies: true at `low`, false at `high`. Never fails; the bracket shrinks to `2^-halvings` of its length.
pub(crate) fn bisect(
    [mut low, mut high]: [f64; 2],
    halvings: u32,
    is_low: impl Fn(f64) -> bool,
) -> [f64; 2] {
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if is_low(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_place_of_a_step_is_bracketed_from_either_side() {
        for bounds in [[0.0, 1.0], [1.0, 0.0]] {
            let rising = bounds[1] > bounds[0];
            let [low, high] = bisect(bounds, 30, |x| (x < 0.3) == rising);
            assert!((high - low).abs() <= 1e-9, "{low} {high}");
            assert!((low - 0.3).abs() <= 1e-9 && (high - 0.3).abs() <= 1e-9);
        }
    }
}
