//! The points of a profile with their distance along it.

/// Points of a profile with their distance along it, both in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Points<'a> {
    /// `[y, z]` in mm, z up.
    pub at: &'a [[f64; 2]],
    /// Sum of the lengths of the chords up to each point.
    pub along: &'a [f64],
}

impl<'a> Points<'a> {
    /// Indices of the points in a range of the length: the first, and one past the last.
    #[must_use]
    pub fn numbers(&self, range: [f64; 2]) -> [usize; 2] {
        let first = self.along.partition_point(|s| *s < range[0]);
        let last = self.along.partition_point(|s| *s <= range[1]);
        [first, last.max(first)]
    }

    /// The points in a range of the length and one beyond on either side; at least four if there are that many.
    #[must_use]
    pub fn within(&self, range: [f64; 2]) -> Points<'a> {
        let [first, last] = self.numbers(range);
        let (first, last) = (first.saturating_sub(2), (last + 2).min(self.at.len()));
        Points {
            at: &self.at[first..last],
            along: &self.along[first..last],
        }
    }

    /// Length of the chord from a point to the next.
    pub(crate) fn chord(&self, k: usize) -> f64 {
        self.along[k + 1] - self.along[k]
    }
}
