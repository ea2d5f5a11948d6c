//! A coefficient of friction as a function of one variable: the lateral or longitudinal position, or the temperature.

use std::sync::Arc;

/// At least one coefficient, in the order of the variable: linear between points, constant outside. Two points with the same value are a jump.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientTable {
    points: Arc<[(f64, f64)]>,
}

impl CoefficientTable {
    /// Makes a table from values of the variable, in order, and as many coefficients, at least one.
    pub fn new(at: &[f64], coefficient: &[f64]) -> CoefficientTable {
        let points = at.iter().copied().zip(coefficient.iter().copied());
        CoefficientTable {
            points: points.collect(),
        }
    }

    /// The values of the variable with their coefficients.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The coefficient at a value and its slope there. At a jump, those of the side of larger values are returned.
    pub fn at(&self, place: f64) -> (f64, f64) {
        let table = &self.points;
        let above = table.partition_point(|(at, _)| *at <= place);
        match (above.checked_sub(1).map(|k| table[k]), table.get(above)) {
            (Some((low, mu)), Some((high, next))) => {
                let slope = (next - mu) / (high - low);
                (mu + slope * (place - low), slope)
            }
            (Some((_, mu)), None) | (None, Some(&(_, mu))) => (mu, 0.0),
            (None, None) => (0.0, 0.0),
        }
    }

    /// The largest coefficient.
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |most, (_, mu)| most.max(*mu))
    }

    /// Returns this table in coordinates whose origin lies at `x`.
    #[must_use]
    pub fn about(&self, x: f64) -> CoefficientTable {
        let points = self.points.iter().map(|(at, mu)| (at - x, *mu));
        CoefficientTable {
            points: points.collect(),
        }
    }

    /// The mean coefficient between two values, of which the second is the larger one.
    pub fn mean_between(&self, from: f64, to: f64) -> f64 {
        let first = self.points.partition_point(|(at, _)| *at <= from);
        let inside = self.points[first..].iter().map(|(at, _)| *at);
        let ends = inside.take_while(|at| *at < to).chain([to]);
        let (mut sum, mut before) = (0.0, from);
        for end in ends {
            // The mean of a straight line is its value in the middle.
            sum += (end - before) * self.at(0.5 * (before + end)).0;
            before = end;
        }
        match sum / (to - from) {
            mean if mean.is_finite() => mean.min(self.largest()),
            _ => self.at(from).0,
        }
    }
}
