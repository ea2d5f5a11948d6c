//! The true outline of a strip: its chords on lines across it, looked up once each.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::contact::mesh::chord::Chord;
use crate::contact::normal::footprint::Footprint;

/// A strip is halved at most so many times: of 16 strips a part is then a twentieth of the least depth that is answered.
pub const HALVINGS_MAX: u32 = 8;

/// Lines that are kept, at 80 bytes each; only memory depends on it.
const LINES_MAX: usize = 200_000;

/// A part of a strip: the `index`-th of its `2^level` equal parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StripPart {
    /// How often the strip was halved.
    pub level: u32,
    /// Which part, counted from smaller y.
    pub index: u32,
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

    /// A place in the part, from 0 to 1, as one in the strip.
    #[must_use]
    pub fn share(self, inside: f64) -> f64 {
        (f64::from(self.index) + inside) / f64::from(1_u32 << self.level)
    }

    /// Its width over that of the strip.
    #[must_use]
    pub fn width(self) -> f64 {
        1.0 / f64::from(1_u32 << self.level)
    }
}

/// Lines across the strips of one mesh that were looked up, by the strip and the place in it.
#[derive(Debug, Default)]
pub struct KnownLines(HashMap<(usize, u64), Option<Chord>, BuildHasherDefault<LineHasher>>);

/// Hashes the number of a strip and a place in it. Nobody chooses these to collide, and they are looked up for every part of a cell.
#[derive(Debug, Default)]
pub struct LineHasher(u64);

impl LineHasher {
    /// Digits of the golden ratio, whose multiples are spread evenly (Knuth 1998, §6.4).
    const SPREAD: u64 = 0x9e37_79b9_7f4a_7c15;
}

impl Hasher for LineHasher {
    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u64(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(LineHasher::SPREAD);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u64(word as u64);
    }
}

/// Chords of the region on lines across one strip.
#[derive(Debug, Clone, Copy)]
pub struct StripLines<'a> {
    footprint: &'a Footprint,
    patch: usize,
    /// Which of the segments of the mesh.
    number: usize,
    /// Smaller y of the strip, and its width.
    low: f64,
    width: f64,
}

impl<'a> StripLines<'a> {
    /// Of the strip about a chord, with its number in the mesh.
    #[must_use]
    pub fn new(footprint: &'a Footprint, chord: &Chord, number: usize) -> StripLines<'a> {
        StripLines {
            footprint,
            patch: chord.patch,
            number,
            low: chord.y - 0.5 * chord.dy,
            width: chord.dy,
        }
    }

    /// y in mm of a place in the strip, from 0 to 1.
    #[must_use]
    pub fn y(&self, share: f64) -> f64 {
        self.low + self.width * share
    }

    /// Load of the true outline between the angles `u`, over the width of the strip, in N/mm: the mean over four lines. Mid-lines alone
    /// carry too much where the pressure bends. Nothing if a line does not have exactly one chord.
    #[must_use]
    pub fn load(&self, u: [f64; 2], known: &mut KnownLines) -> Option<f64> {
        let mut chords = [None; 4];
        for (k, chord) in (0..4).zip(&mut chords) {
            *chord = self.chord(0.25 * (f64::from(k) + 0.5), known);
        }
        let [Some(a), Some(b), Some(c), Some(d)] = chords else {
            return None;
        };
        Some(self.footprint.mean_load(&[a, b, c, d], u))
    }

    /// From where to where in x the outline's places at angles `u` move between the two sides of a part and its middle, and by how much at
    /// most. Where the region ends inside the part, its end stands for the missing chord.
    #[must_use]
    pub fn reach(
        &self,
        piece: StripPart,
        u: [f64; 2],
        known: &mut KnownLines,
    ) -> Option<PartReach> {
        let middle = self.chord(piece.share(0.5), known)?;
        let centre = 0.5 * (middle.left + middle.right);
        let cosines = u.map(f64::cos);
        let ends = [0.0, 1.0].map(|side| {
            let line = self.chord(piece.share(side), known);
            cosines.map(|cosine| line.map_or(centre, |line| line.along(cosine)))
        });
        let own = cosines.map(|cosine| middle.along(cosine));
        let [low, high] = ends;
        Some(PartReach {
            from: own[0].min(low[0]).min(high[0]),
            to: own[1].max(low[1]).max(high[1]),
            length: own[1] - own[0],
            skew: (low[0] - high[0]).abs().max((low[1] - high[1]).abs()),
        })
    }

    /// The chord on the line at a place from 0 to 1, if there is exactly one.
    pub fn chord(&self, share: f64, known: &mut KnownLines) -> Option<Chord> {
        let KnownLines(known) = known;
        if known.len() > LINES_MAX {
            known.clear();
        }
        *known
            .entry((self.number, share.to_bits()))
            .or_insert_with(|| {
                let chords = self
                    .footprint
                    .chords(self.patch, &[(self.y(share), self.width)]);
                match chords[..] {
                    [chord] => Some(chord),
                    _ => None,
                }
            })
    }
}

/// How far a part reaches along x, in mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartReach {
    /// Smallest and largest x.
    pub from: f64,
    /// See `from`.
    pub to: f64,
    /// Length in its middle.
    pub length: f64,
    /// By how much its ends move along x between its sides.
    pub skew: f64,
}
