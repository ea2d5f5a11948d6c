//! About how many patches will a rough gap fall apart into? A look at the samples, before anything is solved.

use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::{Ellipse, Pressing};

/// Valleys less deep than this part of the approach are pressed flat.
const DEPTH: f64 = 0.05;
/// More patches than this are not told apart by any grid.
const SUMMITS_MAX: usize = 48;

impl GapTask {
    /// Summits of the bodies that are likely to touch: least values of the gap within the approach of a smooth contact of the same
    /// extent, with deeper valleys between them. At least 1.
    #[must_use]
    pub fn summits(&self) -> usize {
        let [x, y] = self.gap.samples();
        let lowest = self.gap.extremes()[0];
        let Some(approach) = self.smooth_approach() else {
            return 1;
        };
        // Along the middle line of either axis.
        let middle = |axis: &[f64]| axis.get(axis.len() / 2).copied().unwrap_or(0.0);
        let lines = [self.gap.on(&[middle(x)], y), self.gap.on(x, &[middle(y)])];
        let valleys = |line: &Vec<f64>| valleys(line, lowest + approach, DEPTH * approach);
        let most = lines.iter().map(valleys).max().unwrap_or(1);
        most.clamp(1, SUMMITS_MAX)
    }

    /// Approach of a smooth contact with the curvatures of the whole gap.
    fn smooth_approach(&self) -> Option<f64> {
        if let Pressing::Approach(approach) = self.pressing {
            return Some(approach);
        }
        let [low, high] = self.gap.extremes();
        let [_, y] = self.gap.samples();
        let half = 0.5 * (y.last()? - y.first()?);
        let radius = 0.5 * half * half / (high - low);
        let usable = radius.is_finite() && radius > 0.0;
        let ellipse =
            |radius| Ellipse::of_radii(radius, radius, self.pressing, self.contact_modulus);
        usable.then(|| ellipse(radius).approach)
    }
}

/// Valleys of a line whose bottom is below a level, with ridges between them that are higher than both by a depth.
fn valleys(line: &[f64], level: f64, depth: f64) -> usize {
    let (mut bottom, mut ridge) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut rising = false;
    let mut count = 0;
    for value in line {
        if rising {
            ridge = ridge.max(*value);
            if ridge - value > depth {
                (rising, bottom) = (false, *value);
            }
        } else {
            bottom = bottom.min(*value);
            if value - bottom > depth {
                count += usize::from(bottom < level);
                (rising, ridge) = (true, *value);
            }
        }
    }
    count + usize::from(!rising && bottom < level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valleys_count_where_ridges_part_them() {
        assert_eq!(valleys(&[], 1.0, 0.1), 0);
        assert_eq!(valleys(&[1.0, 0.0, 1.0], 0.5, 0.1), 1);
        assert_eq!(valleys(&[0.0, 0.05, 0.0], 0.5, 0.1), 1);
        assert_eq!(valleys(&[0.0, 0.2, 0.0, 0.2, 0.0], 0.5, 0.1), 3);
        // The middle one is too high to touch.
        assert_eq!(valleys(&[0.0, 1.0, 0.7, 1.0, 0.0, 1.0], 0.5, 0.1), 2);
    }
}
