//! What will the contact of a gap be like? A look at the samples, before anything is solved.

use crate::contact::normal::gap::preview::GapPreview;
use crate::contact::normal::gap::search_box::{SearchBox, reach};
use crate::contact::normal::gap::task::GapTask;

/// Valleys less deep than this part of the approach are pressed flat.
const DEPTH: f64 = 0.05;
/// More patches than this are not told apart by any grid.
const SUMMITS_MAX: usize = 48;
/// Half-length of the contact over that of the box it is looked for in, which is made for 1.3 times the approach: Hertz's edge
/// lies where the gap is half the approach.
const CONTACT_OVER_BOX: f64 = 0.62;

impl GapTask {
    /// What the contact will be like: its size, and how many asperities touch, with valleys between them that are not pressed flat.
    #[must_use]
    pub fn preview(&self) -> GapPreview {
        *self.seen.preview.get_or_make(|| self.look())
    }

    /// The box in which contact can be.
    pub(crate) fn reach(&self) -> SearchBox {
        let found = || reach(&self.gap, self.loading, self.contact_modulus);
        *self.seen.reach.get_or_make(found)
    }

    fn look(&self) -> GapPreview {
        let reach = self.reach();
        let depth = reach.level - reach.least;
        let samples = self.gap.samples();
        let within = |k: usize| -> Vec<f64> {
            let [low, high] = reach.window[k];
            let inside = samples[k].iter().filter(|at| (low..=high).contains(*at));
            inside.copied().collect()
        };
        let middle = |k: usize| [0.5 * (reach.window[k][0] + reach.window[k][1])];
        // Along the middle line of either axis.
        let (x, y) = (within(0), within(1));
        let lines = [self.gap.on(&x, &middle(1)), self.gap.on(&middle(0), &y)];
        let asperities = lines
            .iter()
            .map(|line| valleys(line, reach.level, DEPTH * depth))
            .max();
        GapPreview {
            half: reach
                .window
                .map(|[low, high]| 0.5 * CONTACT_OVER_BOX * (high - low)),
            depth,
            asperities: asperities.unwrap_or(1).clamp(1, SUMMITS_MAX),
        }
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
