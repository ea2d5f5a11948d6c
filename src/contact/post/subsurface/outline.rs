//! The true outline of neighbouring strips: its chords on lines across them.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use crate::contact::mesh::chord::Chord;
use crate::contact::normal::footprint::Footprint;

/// Lines that are kept, at 80 bytes each; only memory depends on it.
const LINES_MAX: usize = 200_000;

/// Lines across the runs of one mesh that were looked up, by the run and the place in it. Hertz's ellipse is asked again each time.
#[derive(Debug, Default)]
pub struct KnownLines(HashMap<(usize, u64), Option<Chord>, BuildHasherDefault<LineHasher>>);

/// Hashes the number of a run and a place in it. Nobody chooses these to collide, and they are looked up for every part.
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

/// Chords of the region on lines across a run of strips.
#[derive(Debug, Clone, Copy)]
pub struct RunOutline<'a> {
    /// The region.
    pub footprint: &'a Footprint,
    /// Which of its patches.
    pub patch: usize,
    /// Which run of the mesh.
    pub number: usize,
    /// Smaller y of the run, and its width, in mm.
    pub low: f64,
    /// See `low`.
    pub width: f64,
}

impl RunOutline<'_> {
    /// y in mm of a place in the run, from 0 to 1.
    #[must_use]
    pub fn y(&self, share: f64) -> f64 {
        self.low + self.width * share
    }

    /// The chord on the line at a place from 0 to 1, if there is exactly one.
    pub fn chord(&self, share: f64, known: &mut KnownLines) -> Option<Chord> {
        let look = || {
            let line = (self.y(share), self.width);
            self.footprint.single_chord(self.patch, line)
        };
        if self.footprint.is_closed_form() {
            return look();
        }
        let KnownLines(known) = known;
        if known.len() > LINES_MAX {
            known.clear();
        }
        *known
            .entry((self.number, share.to_bits()))
            .or_insert_with(look)
    }
}
