//! Slip of a contact surface beyond that of a motion of the plane.

/// Slip at the points of a surface beyond that of the motion, divided by the rolling speed, interpolated between samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceSlip {
    /// First sample along x and y in mm.
    pub first: [f64; 2],
    /// Distance of the samples along x and y in mm.
    pub step: [f64; 2],
    /// Number of samples along x and y, at least 1 each.
    pub samples: [usize; 2],
    /// Slip of the upper body relative to the lower one along x and y; sample (i, j) at `j * samples[0] + i`.
    pub slip: [Vec<f64>; 2],
}

impl SurfaceSlip {
    /// Slip at a place `[x, y]` in mm; beyond the samples that of the nearest place among them.
    #[must_use]
    pub fn at(&self, place: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|k| {
            let last = (self.samples[k] - 1) as f64;
            let at = ((place[k] - self.first[k]) / self.step[k]).clamp(0.0, last);
            let from = at.floor().min((last - 1.0).max(0.0));
            (from as usize, at - from, usize::from(last > 0.0))
        });
        let value = |values: &[f64], i: usize, j: usize| values[j * self.samples[0] + i];
        [0, 1].map(|k| {
            let row = |j: usize| {
                let [low, high] = [x.0, x.0 + x.2].map(|i| value(&self.slip[k], i, j));
                low + x.1 * (high - low)
            };
            let [low, high] = [row(y.0), row(y.0 + y.2)];
            low + y.1 * (high - low)
        })
    }

    /// Mean slip between two places along x, by Simpson's rule.
    #[must_use]
    pub fn mean(&self, [from, to]: [f64; 2], y: f64) -> [f64; 2] {
        let [low, middle, high] = [from, 0.5 * (from + to), to].map(|x| self.at([x, y]));
        [0, 1].map(|k| (low[k] + 4.0 * middle[k] + high[k]) / 6.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_slip_is_reproduced_and_constant_beyond() {
        let of = |x: f64, y: f64| [0.1 * x - 0.3 * y, 0.2 + 0.05 * x];
        let mut slip = [Vec::new(), Vec::new()];
        for j in 0..4 {
            for i in 0..3 {
                let [along, across] = of(1.0 + 0.5 * f64::from(i), -2.0 + 0.25 * f64::from(j));
                slip[0].push(along);
                slip[1].push(across);
            }
        }
        let surface = SurfaceSlip {
            first: [1.0, -2.0],
            step: [0.5, 0.25],
            samples: [3, 4],
            slip,
        };
        for (x, y) in [(1.0, -2.0), (1.3, -1.6), (2.0, -1.25)] {
            let (found, expected) = (surface.at([x, y]), of(x, y));
            assert!((found[0] - expected[0]).abs() < 1e-15);
            assert!((found[1] - expected[1]).abs() < 1e-15);
        }
        let mean = surface.mean([1.2, 1.8], -1.5);
        assert!((mean[0] - of(1.5, -1.5)[0]).abs() < 1e-15);
        assert_eq!(surface.at([9.0, 3.0]), surface.at([2.0, -1.25]));
    }
}
