//! Intervals that are halved again and again.

/// The `index`-th of the `2^level` equal pieces of an interval.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// How often the interval was halved.
    pub level: u32,
    /// Which piece, counted from the beginning of the interval.
    pub index: u32,
}

impl Piece {
    /// All pieces after so many halvings.
    pub fn all(level: u32) -> impl Iterator<Item = Piece> {
        (0..1 << level).map(move |index| Piece { level, index })
    }

    /// Its halves.
    #[must_use]
    pub fn halves(self) -> [Piece; 2] {
        [0, 1].map(|k| Piece {
            level: self.level + 1,
            index: 2 * self.index + k,
        })
    }

    /// A place in the piece, from 0 to 1, as one in the interval.
    #[must_use]
    pub fn share(self, inside: f64) -> f64 {
        (f64::from(self.index) + inside) * self.width()
    }

    /// Its width over that of the interval.
    #[must_use]
    pub fn width(self) -> f64 {
        1.0 / f64::from(1_u32 << self.level)
    }
}
