//! Runs of lines that overlap, and which of them share a gap.

/// Overlaps nearer to each other than this along the rail, in mm, share one gap, because they influence each other. CONTACT, too,
/// separates patches that are 8 mm or 30° apart.
pub(crate) const SHARED_GAP_DISTANCE: f64 = 8.0;

/// Lines that overlap: the first and the last one, and what lies beyond either end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overlap {
    pub(crate) ends: [usize; 2],
    /// The overlap goes on beyond this end, in another gap.
    pub(crate) cut: [bool; 2],
    /// Another gap lies on this side, next to this one or farther away.
    pub(crate) near: [bool; 2],
}

/// Which lines share a gap, as it was decided at one height of the wheel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grouping {
    /// First and last line of every gap, from smaller to larger y.
    pub(crate) groups: Vec<[usize; 2]>,
}

impl Grouping {
    /// The group with which an overlap has most lines in common.
    pub(crate) fn of(&self, [first, last]: [usize; 2]) -> Option<usize> {
        let common = |k: &usize| {
            let [low, high] = self.groups[*k];
            (high.min(last) + 1).saturating_sub(low.max(first))
        };
        let most = (0..self.groups.len()).max_by_key(common)?;
        (common(&most) > 0).then_some(most)
    }
}
