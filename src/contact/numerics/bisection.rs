//! Halving a bracket as often as asked: for functions of which nothing but a side is known.

/// The bracket from `low` to `high` (in either order) after so many halvings, where `is_low` says on which side of the place sought
/// a point lies: true at `low`, false at `high`. It never fails; the bracket is `2^-halvings` of its length.
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
