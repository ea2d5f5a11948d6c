//! Convolution along one axis of a grid whose lines along the other one are transformed: each wave is summed by itself.

use std::ops::Range;

use pulp::NullaryFnOnce;
use rustfft::num_complex::Complex;

use crate::contact::half_space::transforms::FftFloat;

/// Waves that are summed side by side, and lines at a time: their real and imaginary parts fill the registers of a machine with eight lanes.
const WAVES: usize = 8;
const LINES: usize = 4;

/// Spectra of real lines: for each group of [`WAVES`] waves, and there for each line, the real parts and then the imaginary ones.
#[derive(Debug, Clone)]
pub(crate) struct Spectra<T> {
    /// Lines, up to a multiple of [`LINES`].
    padded: usize,
    /// Waves of a line.
    waves: usize,
    parts: Vec<[[T; WAVES]; 2]>,
}

/// Factors with which lines act on each other, by their distance and wave by wave.
#[derive(Debug, Clone)]
pub(crate) struct LineSums<T> {
    /// Lines, and their waves.
    count: usize,
    waves: usize,
    /// For each group of waves, and there for each distance of an acting line from one acted on, from `1 − count` on, the factors.
    factors: Vec<[T; WAVES]>,
}

impl<T> Default for Spectra<T> {
    fn default() -> Spectra<T> {
        Spectra {
            padded: 0,
            waves: 0,
            parts: Vec::new(),
        }
    }
}

impl<T: FftFloat> Spectra<T> {
    /// Room for so many lines of so many waves.
    pub(crate) fn fit(&mut self, lines: usize, waves: usize) {
        self.padded = lines.next_multiple_of(LINES);
        self.waves = waves;
        let size = self.padded * waves.div_ceil(WAVES);
        self.parts.resize(size, [[T::zero(); WAVES]; 2]);
    }

    /// Takes twice the spectra of a line and the one after it from the transform of both as real and imaginary part.
    #[inline(always)]
    fn take(&mut self, line: usize, pair: &[Complex<T>]) {
        for (group, lines) in self.parts.chunks_exact_mut(self.padded).enumerate() {
            let [one, other] = &mut lines[line..line + 2] else {
                unreachable!("lines are padded to an even number")
            };
            // Waves beyond those of a line are images of others; their factors are 0.
            let (here, there) = with_images(pair, group * WAVES);
            for k in 0..WAVES {
                // The even part belongs to the real line, the odd one to the imaginary line.
                let (here, there) = (here[k], there[k]);
                (one[0][k], one[1][k]) = (here.re + there.re, here.im - there.im);
                (other[0][k], other[1][k]) = (here.im + there.im, there.re - here.re);
            }
        }
    }

    /// The reverse of [`Spectra::take`], without the factor of two.
    #[inline(always)]
    fn give(&self, line: usize, pair: &mut [Complex<T>]) {
        let width = pair.len();
        for (group, lines) in self.parts.chunks_exact(self.padded).enumerate() {
            let [one, other] = &lines[line..line + 2] else {
                unreachable!("lines are padded to an even number")
            };
            let first = group * WAVES;
            let here = |k: usize| Complex::new(one[0][k] - other[1][k], one[1][k] + other[0][k]);
            let there = |k: usize| Complex::new(one[0][k] + other[1][k], other[0][k] - one[1][k]);
            if first > 0 && first + WAVES <= self.waves {
                let own: &mut [Complex<T>] = &mut pair[first..first + WAVES];
                (0..WAVES).for_each(|k| own[k] = here(k));
                let images = &mut pair[width - first - (WAVES - 1)..=width - first];
                (0..WAVES).for_each(|k| images[WAVES - 1 - k] = there(k));
                continue;
            }
            for k in 0..WAVES.min(self.waves - first) {
                pair[first + k] = here(k);
                if first + k > 0 {
                    pair[width - first - k] = there(k);
                }
            }
        }
    }
}

/// Some waves of a transform, and their images on the other side.
#[inline(always)]
fn with_images<T: FftFloat>(
    pair: &[Complex<T>],
    first: usize,
) -> ([Complex<T>; WAVES], [Complex<T>; WAVES]) {
    let width = pair.len();
    if first > 0 && first + WAVES <= width {
        let own = &pair[first..first + WAVES];
        let images = &pair[width - first - (WAVES - 1)..=width - first];
        return (
            std::array::from_fn(|k| own[k]),
            std::array::from_fn(|k| images[WAVES - 1 - k]),
        );
    }
    let place = |k: usize| if first + k < width { first + k } else { 0 };
    let image = |place: usize| if place == 0 { 0 } else { width - place };
    (
        std::array::from_fn(|k| pair[place(k)]),
        std::array::from_fn(|k| pair[image(place(k))]),
    )
}

impl<T: FftFloat> LineSums<T> {
    /// For so many lines of so many waves, with factors of 0.
    pub(crate) fn new(count: usize, waves: usize) -> LineSums<T> {
        let distances = LineSums::<T>::distances(count);
        LineSums {
            count,
            waves,
            factors: vec![[T::zero(); WAVES]; distances * waves.div_ceil(WAVES)],
        }
    }

    /// Distances of lines: a few more than there are, so that lines can be summed several at a time.
    fn distances(count: usize) -> usize {
        2 * count - 1 + LINES
    }

    /// Sets the factors of lines at a distance on either side; values beyond the waves are left out.
    pub(crate) fn set(&mut self, distance: usize, factors: impl Iterator<Item = T>) {
        let distances = LineSums::<T>::distances(self.count);
        for (wave, factor) in factors.take(self.waves).enumerate() {
            let group = &mut self.factors[wave / WAVES * distances..][..distances];
            for place in [self.count - 1 - distance, self.count - 1 + distance] {
                group[place][wave % WAVES] = factor;
            }
        }
    }

    /// Transforms of all lines, two and two, from half of those of the acting ones, two and two as well: `acting` are their pairs.
    pub(crate) fn of_pairs<'a>(
        &'a self,
        pairs: &'a mut [Complex<T>],
        acting: Range<usize>,
        [from, to]: &'a mut [Spectra<T>; 2],
    ) -> impl NullaryFnOnce<Output = ()> + 'a {
        PairSums {
            sums: self,
            pairs,
            acting,
            from,
            to,
        }
    }

    /// The sums of all lines' spectra over a range of acting lines.
    #[inline(always)]
    fn sum(&self, from: &Spectra<T>, acting: Range<usize>, to: &mut Spectra<T>) {
        let (count, padded) = (self.count, from.padded);
        let distances = LineSums::<T>::distances(count);
        let factors = self.factors.chunks_exact(distances);
        let from = from.parts.chunks_exact(padded);
        let to = to.parts.chunks_exact_mut(padded);
        for ((factors, from), to) in factors.zip(from).zip(to) {
            for (number, lines) in to.chunks_exact_mut(LINES).enumerate() {
                let mut sums = [[[T::zero(); WAVES]; 2]; LINES];
                for (line, [re, im]) in acting.clone().zip(&from[acting.clone()]) {
                    let first = LINES * number + count - 1 - line;
                    let near = &factors[first..first + LINES];
                    for (sum, factors) in sums.iter_mut().zip(near) {
                        for k in 0..WAVES {
                            sum[0][k] = sum[0][k] + factors[k] * re[k];
                            sum[1][k] = sum[1][k] + factors[k] * im[k];
                        }
                    }
                }
                lines.copy_from_slice(&sums);
            }
        }
    }
}

/// See [`LineSums::of_pairs`]; compiled for the instruction set of this machine.
struct PairSums<'a, T> {
    sums: &'a LineSums<T>,
    pairs: &'a mut [Complex<T>],
    acting: Range<usize>,
    from: &'a mut Spectra<T>,
    to: &'a mut Spectra<T>,
}

impl<T: FftFloat> NullaryFnOnce for PairSums<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let width = self.pairs.len() / self.sums.count.div_ceil(2);
        let acting = self.acting.clone();
        let pairs = self.pairs.chunks_exact(width).enumerate();
        for (k, pair) in pairs.skip(acting.start).take(acting.len()) {
            self.from.take(2 * k, pair);
        }
        let lines = 2 * acting.start..(2 * acting.end).min(self.sums.count);
        self.sums.sum(self.from, lines, self.to);
        for (k, pair) in self.pairs.chunks_exact_mut(width).enumerate() {
            self.to.give(2 * k, pair);
        }
    }
}
