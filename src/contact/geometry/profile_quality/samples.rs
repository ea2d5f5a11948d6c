//! The points of a profile as heights over their arc length, and what each tells with its neighbours.

use crate::contact::lazy_field::LazyField;

/// Points of a profile with their distance along it, both in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Points<'a> {
    /// `[y, z]` in mm, z up.
    pub at: &'a [[f64; 2]],
    /// Sum of the lengths of the chords up to each point.
    pub along: &'a [f64],
    /// What was found of them before, if that is kept.
    pub known: Option<&'a KnownPoints>,
}

/// What every point of a profile tells with its neighbours, found when it is first asked for: contacts of a pair share most of it.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownPoints(Vec<KnownPoint>);

/// The same of one point.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct KnownPoint {
    /// Height in mm above the cubic of its six neighbours, if there are as many near.
    pub(crate) off: LazyField<Option<f64>>,
    /// Length of the chord over it and the next four in mm, and their normalised fourth divided difference in mm.
    pub(crate) difference: LazyField<Option<(f64, f64)>>,
    /// The angle in rad between the chords before and after it, positive to the left.
    pub(crate) turn: LazyField<f64>,
}

impl KnownPoints {
    /// Nothing yet of so many points.
    #[must_use]
    pub fn new(count: usize) -> KnownPoints {
        KnownPoints(vec![KnownPoint::default(); count])
    }
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
            known: None,
        }
    }

    /// What `choose` takes of a point, made if it is not known.
    pub(crate) fn known<T: Copy>(
        &self,
        point: usize,
        choose: impl Fn(&KnownPoint) -> &LazyField<T>,
        make: impl FnOnce() -> T,
    ) -> T {
        match self.known {
            Some(known) => *choose(&known.0[point]).get_or_make(make),
            None => make(),
        }
    }

    /// Length of the chord from a point to the next.
    pub(crate) fn chord(&self, k: usize) -> f64 {
        self.along[k + 1] - self.along[k]
    }
}
