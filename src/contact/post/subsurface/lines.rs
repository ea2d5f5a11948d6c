//! The true outline of a strip: its chords on lines at dyadic places across it, looked up once each.

use std::cell::OnceCell;

use crate::contact::mesh::strips::Chord;
use crate::contact::normal::footprint::Footprint;

/// A strip is halved at most so many times: of 16 strips a part is then a twentieth of the least depth that is answered.
pub const HALVINGS_MAX: u32 = 8;

/// A part of a strip: the `index`-th of its `2^level` equal parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StripPart {
    /// How often the strip was halved.
    pub level: u32,
    /// Which part, counted from smaller y.
    pub index: usize,
}

impl StripPart {
    /// The whole strip.
    pub const WHOLE: StripPart = StripPart { level: 0, index: 0 };

    /// Its halves.
    #[must_use]
    pub fn halves(self) -> [StripPart; 2] {
        [0, 1].map(|k| StripPart {
            level: self.level + 1,
            index: 2 * self.index + k,
        })
    }
}

/// Chords of the region on lines across one strip.
#[derive(Debug)]
pub struct StripLines<'a> {
    footprint: &'a Footprint,
    patch: usize,
    /// Smaller y of the strip, and its width.
    low: f64,
    width: f64,
    /// At `k / 2^(HALVINGS_MAX + 1)` of the width; nothing where the line does not have exactly one chord.
    known: Vec<OnceCell<Option<Chord>>>,
}

impl<'a> StripLines<'a> {
    /// Of the strip about a chord.
    #[must_use]
    pub fn new(footprint: &'a Footprint, chord: &Chord) -> StripLines<'a> {
        StripLines {
            footprint,
            patch: chord.patch,
            low: chord.y - 0.5 * chord.dy,
            width: chord.dy,
            known: vec![OnceCell::new(); (1 << (HALVINGS_MAX + 1)) + 1],
        }
    }

    /// Both sides of a part in y, in mm.
    #[must_use]
    pub fn sides(&self, part: StripPart) -> [f64; 2] {
        let each = self.width / f64::from(1 << part.level);
        let low = self.low + each * part.index as f64;
        [low, low + each]
    }

    /// The chord on the mid-line of a part, if there is exactly one.
    #[must_use]
    pub fn middle(&self, part: StripPart) -> Option<Chord> {
        self.at((2 * part.index + 1) << (HALVINGS_MAX - part.level))
    }

    /// Load of the true outline between the angles `u`, over the width of the strip, in N/mm: the mean over four lines. Mid-lines alone
    /// carry too much where the pressure bends. Nothing if a line does not have exactly one chord.
    #[must_use]
    pub fn load(&self, u: [f64; 2]) -> Option<f64> {
        let parts = (0..4).map(|index| StripPart { level: 2, index });
        let load = |part| {
            let chord = self.middle(part)?;
            let centre = 0.5 * (chord.left + chord.right);
            let half = 0.5 * (chord.right - chord.left);
            let [x0, x1] = u.map(|u| centre - half * u.cos());
            Some((x1 - x0) * self.footprint.mean_pressure(&chord, x0, x1))
        };
        let sum: Option<f64> = parts.map(load).sum();
        sum.map(|sum| 0.25 * sum)
    }

    /// How far the places at angles `u` of the outline move along x between the two sides of a part. Where the region ends inside the
    /// part, its end stands for the missing chord.
    #[must_use]
    pub fn skew(&self, part: StripPart, u: [f64; 2]) -> f64 {
        let Some(middle) = self.middle(part) else {
            return 0.0;
        };
        let centre = 0.5 * (middle.left + middle.right);
        let ends = [0, 1].map(|side| {
            let line = self.at((2 * (part.index + side)) << (HALVINGS_MAX - part.level));
            line.map_or([centre, 0.0], |line| {
                [
                    0.5 * (line.left + line.right),
                    0.5 * (line.right - line.left),
                ]
            })
        });
        let shift = |u: f64| {
            let [low, high] = ends.map(|[centre, half]| centre - half * u.cos());
            (high - low).abs()
        };
        shift(u[0]).max(shift(u[1]))
    }

    fn at(&self, place: usize) -> Option<Chord> {
        *self.known[place].get_or_init(|| {
            let share = place as f64 / f64::from(1 << (HALVINGS_MAX + 1));
            let y = self.low + self.width * share;
            let chords = self.footprint.chords(self.patch, &[(y, self.width)]);
            match chords[..] {
                [chord] => Some(chord),
                _ => None,
            }
        })
    }
}
