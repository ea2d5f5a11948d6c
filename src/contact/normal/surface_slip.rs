//! Slip of a contact surface beyond that of a motion of the plane.

/// Slip at the points of a surface beyond that of the motion, divided by the rolling speed, interpolated between samples.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceSlip {
    /// Samples along x: the first one and their distance in mm, and how many, at least 1.
    pub x: (f64, f64, usize),
    /// Samples along y in mm, ascending, at least 1.
    pub y: Vec<f64>,
    /// Slip of the upper body relative to the lower one along x and y; sample (i, j) at `j * x.2 + i`.
    pub slip: [Vec<f64>; 2],
}

impl SurfaceSlip {
    /// Slip at a place `[x, y]` in mm; beyond the samples that of the nearest place among them.
    #[must_use]
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (first, step, samples) = self.x;
        let last = (samples - 1) as f64;
        let at = ((x - first) / step).clamp(0.0, last);
        let from = at.floor().min((last - 1.0).max(0.0));
        let x = (from as usize, at - from, usize::from(last > 0.0));
        let last = self.y.len() - 1;
        let from = self
            .y
            .partition_point(|sample| *sample <= y)
            .clamp(1, last.max(1))
            - 1;
        let to = (from + 1).min(last);
        let length = self.y[to] - self.y[from];
        let part = if length > 0.0 {
            ((y - self.y[from]) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let y = (from, part, to - from);
        let value = |values: &[f64], i: usize, j: usize| values[j * self.x.2 + i];
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
            x: (1.0, 0.5, 3),
            y: vec![-2.0, -1.75, -1.5, -1.25],
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
