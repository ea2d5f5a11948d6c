//! Lines through the motions of a sweep.

use crate::contact::rolling::motion::Motion;

/// Motions lie on the line through two others if they are no farther from it than this part of their distance to the first. Numeric
/// safety, not tuned.
const STRAIGHT: f64 = 1e-6;

/// A line through motions.
#[derive(Debug, Clone, Copy)]
pub(super) struct SweepLine {
    from: [f64; 3],
    /// Of length 1.
    along: [f64; 3],
}

impl SweepLine {
    /// From one motion to another, if they differ.
    pub(super) fn through(from: &Motion, to: &Motion) -> Option<SweepLine> {
        let [from, to] = [components(from), components(to)];
        let step = [0, 1, 2].map(|k| to[k] - from[k]);
        let length = dot(step, step).sqrt();
        (length > 0.0).then(|| SweepLine {
            from,
            along: step.map(|part| part / length),
        })
    }

    /// The place of a motion on the line, if it lies there.
    pub(super) fn place(&self, motion: &Motion) -> Option<f64> {
        let to = components(motion);
        let step = [0, 1, 2].map(|k| to[k] - self.from[k]);
        let place = dot(step, self.along);
        let aside = [0, 1, 2].map(|k| step[k] - place * self.along[k]);
        (dot(aside, aside).sqrt() <= STRAIGHT * dot(step, step).sqrt()).then_some(place)
    }
}

fn components(motion: &Motion) -> [f64; 3] {
    [motion.creepage_x, motion.creepage_y, motion.spin_per_mm]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
