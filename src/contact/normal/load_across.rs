//! How the load of a patch is spread across rolling: its line load by y, a chain of parabolas.

use std::f64::consts::PI;

use crate::contact::normal::pressure_field::field::PressureField;
use crate::contact::numerics::lagrange;

/// Parabolas of a pressure that is known by samples, narrower towards both ends, where its line load changes fastest. Chosen by judgement: twice as many
/// change the limit of Hertz's patch, given as a grid, under a table with a jump by less than 1e-5.
const PARABOLAS: usize = 24;

/// Line load of a patch in N/mm, up to a factor.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadAcross {
    /// Place in mm and line load of both ends and the middle of every parabola; neighbours share their ends.
    points: Vec<(f64, f64)>,
}

impl LoadAcross {
    /// That of an elliptic patch between two y: one parabola.
    #[must_use]
    pub fn of_ellipse([low, high]: [f64; 2]) -> LoadAcross {
        let points = vec![(low, 0.0), (0.5 * (low + high), 1.0), (high, 0.0)];
        LoadAcross { points }
    }

    /// That of a patch of a pressure known by samples.
    #[must_use]
    pub fn of_samples(field: &PressureField, patch: usize) -> LoadAcross {
        let [.., low, high] = field.patches()[patch].extent;
        let count = 2 * PARABOLAS;
        let place = |k: usize| {
            let part = 0.5 - 0.5 * (PI * k as f64 / count as f64).cos();
            low + (high - low) * part
        };
        let line_load = |y: f64| -> f64 {
            let chords = field.chords(patch, &[(y, 1.0)]);
            let load = |x: [f64; 2], mean: f64| (x[1] - x[0]) * mean;
            let each = chords.iter().map(|chord| {
                let [left, right] = [chord.left, chord.right];
                load([left, right], field.mean_pressure(chord, left, right))
            });
            each.sum()
        };
        let inner = (1..count).map(|k| (place(k), line_load(place(k))));
        let ends = [(low, 0.0), (high, 0.0)];
        LoadAcross {
            points: std::iter::once(ends[0])
                .chain(inner)
                .chain([ends[1]])
                .collect(),
        }
    }

    /// Mean over the load of what is linear from one point `(y, value)` to the next, points in order of y and at least one, and constant
    /// before the first and behind the last. Two points at one place are a jump.
    ///
    /// Exact for a load of parabolas: its products with straight lines are cubic, which Simpson's rule integrates.
    #[must_use]
    pub fn mean(&self, table: &[(f64, f64)]) -> f64 {
        let (first, last) = (table[0], table[table.len() - 1]);
        let (low, high) = (self.points[0].0, self.points[self.points.len() - 1].0);
        let before = [(low.min(first.0), first.1), first];
        let behind = [last, (high.max(last.0), last.1)];
        let inner = table.windows(2).map(|pair| [pair[0], pair[1]]);
        let pieces = inner.chain([before, behind]);
        let sum: f64 = pieces.map(|piece| self.integral(piece)).sum();
        let load = self.integral([(low, 1.0), (high, 1.0)]);
        sum / load
    }

    /// Integral of the line load times a straight line between two points.
    fn integral(&self, [(y0, v0), (y1, v1)]: [(f64, f64); 2]) -> f64 {
        let parabolas = self.points.windows(3).step_by(2);
        let over = |parabola: &[(f64, f64)]| {
            let (begin, end) = (y0.max(parabola[0].0), y1.min(parabola[2].0));
            if begin >= end {
                return 0.0;
            }
            let value =
                |y: f64| (v0 + (y - y0) / (y1 - y0) * (v1 - v0)) * lagrange::value(parabola, y);
            let middle = value(0.5 * (begin + end));
            (end - begin) / 6.0 * (value(begin) + 4.0 * middle + value(end))
        };
        parabolas.map(over).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: [(f64, f64); 4] = [(-1.0, 0.1), (1.0, 0.3), (1.0, 0.5), (2.0, 0.2)];

    /// The field of a pressure on a grid of equal spacings, 61 along and 81 across.
    fn field(pressure: impl Fn(f64, f64) -> f64) -> PressureField {
        let axis = |half: f64, count: u32| -> Vec<f64> {
            let step = 2.0 * half / f64::from(count - 1);
            (0..count).map(|k| f64::from(k) * step - half).collect()
        };
        let (x, y) = (axis(4.0, 61), axis(6.0, 81));
        let rows: Vec<Vec<f64>> = y
            .iter()
            .map(|y| x.iter().map(|x| pressure(*x, *y)).collect())
            .collect();
        PressureField::new(&x, &y, &rows).unwrap().0
    }

    #[test]
    fn samples_of_an_ellipse_carry_as_the_ellipse() {
        let [a, b, y] = [3.0, 2.2, 0.7];
        let lens = |x: f64, at: f64| 1.0 - (x / a).powi(2) - ((at - y) / b).powi(2);
        let field = field(|x, y| 1000.0 * lens(x, y).max(0.0).sqrt());
        let sampled = LoadAcross::of_samples(&field, 0).mean(&TABLE);
        let exact = LoadAcross::of_ellipse([y - b, y + b]).mean(&TABLE);
        assert!((sampled / exact - 1.0).abs() < 1e-4, "{sampled} {exact}");
    }

    /// A pressure that is even along and straight across, from 0 at one side to its largest at the other.
    #[test]
    fn a_wedge_carries_most_under_its_thick_side() {
        let field = field(|x, y| {
            let inside = x.abs() < 3.0 && (-2.05..=4.0).contains(&y);
            if inside { 100.0 * (y + 2.1) } else { 0.0 }
        });
        let load = LoadAcross::of_samples(&field, 0);
        let step = load.mean(&[(1.0, 0.0), (1.0, 1.0)]);
        let [.., low, high] = field.patches()[0].extent;
        let part = 1.0 - ((1.0 + 2.1) / (high + 2.1)).powi(2);
        assert!((step - part).abs() < 0.02, "{step} {part} {low} {high}");
        // The parabola between the same ends has the value of its middle.
        let parabola = LoadAcross::of_ellipse([low, high]);
        assert!(step - parabola.mean(&[(1.0, 0.0), (1.0, 1.0)]) > 0.1);
    }

    #[test]
    fn patches_beside_each_other_have_loads_of_their_own() {
        let lens = |x: f64, y: f64| (1.0 - (x / 2.0).powi(2) - (y / 1.6).powi(2)).max(0.0);
        let field = field(|x, y| 900.0 * (lens(x, y - 3.0) + 0.5 * lens(x, y + 3.0)).sqrt());
        let by_side = [(0.0, 0.1), (0.0, 0.4)];
        let means = [0, 1].map(|k| LoadAcross::of_samples(&field, k).mean(&by_side));
        assert!((means[0] - 0.1).abs() < 1e-12 && (means[1] - 0.4).abs() < 1e-12);
    }
}
