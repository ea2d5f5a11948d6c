//! Friction that varies along the track: a table of coefficients that lie still while the contact passes over them.

use crate::contact::friction::coefficient_table::CoefficientTable;

/// A coefficient of friction by its place along the track: linear between points, constant outside; two points at one place are a jump.
#[derive(Debug, Clone, PartialEq)]
pub struct AlongLaw {
    table: CoefficientTable,
}

impl AlongLaw {
    /// A law from as many places in mm, in order, as coefficients, of which there is at least one.
    #[must_use]
    pub fn new(at: &[f64], coefficient: &[f64]) -> AlongLaw {
        AlongLaw {
            table: CoefficientTable::new(at, coefficient),
        }
    }

    /// The same table in axes whose origin lies at x in mm of these.
    #[must_use]
    pub fn about(&self, x: f64) -> AlongLaw {
        let (at, coefficient): (Vec<f64>, Vec<f64>) = self
            .table
            .points()
            .iter()
            .map(|(at, mu)| (at - x, *mu))
            .unzip();
        AlongLaw::new(&at, &coefficient)
    }

    /// The largest coefficient.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.table.largest()
    }

    /// The mean coefficient between two places in mm, of which the second lies beyond the first.
    #[must_use]
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        let points = self.table.points();
        let first = points.partition_point(|(at, _)| *at <= from);
        let inside = points[first..].iter().map(|(at, _)| *at);
        let ends = inside.take_while(|at| *at < to).chain([to]);
        let (mut sum, mut before) = (0.0, from);
        for end in ends {
            // Of a straight line, the mean is the value in the middle.
            sum += (end - before) * self.table.at(0.5 * (before + end));
            before = end;
        }
        match sum / (to - from) {
            mean if mean.is_finite() => mean.min(self.largest()),
            _ => self.table.at(from),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_integrals_over_their_length() {
        let law = AlongLaw::new(&[-1.0, 1.0, 1.0, 2.0], &[0.1, 0.3, 0.5, 0.2]);
        let known = [
            (-5.0, -2.0, 0.1),
            (-1.0, 1.0, 0.2),
            (0.0, 2.0, 0.5 * (0.25 + 0.35)),
            (1.0, 2.0, 0.35),
            (1.5, 2.5, 0.5 * (0.275 + 0.2)),
            (3.0, 9.0, 0.2),
        ];
        for (from, to, mean) in known {
            assert!((law.mean(from, to) - mean).abs() < 1e-15, "{from} to {to}");
        }
        assert_eq!(law.mean(0.5, 0.5), law.table.at(0.5));
        assert_eq!(law.largest(), 0.5);
    }

    #[test]
    fn an_even_table_has_its_coefficient_everywhere() {
        let law = AlongLaw::new(&[0.0, 1.0], &[0.3, 0.3]);
        for from in [-1e6, -0.3, 0.4, 0.99, 7.0] {
            assert!((law.mean(from, from + 0.7) - 0.3).abs() < 1e-15);
        }
    }
}
