//! A coefficient of friction by its place: across the rail, along it, or in temperature.

use std::sync::Arc;

/// Coefficients in the order of their places, at least one.
#[derive(Debug, Clone, PartialEq)]
pub struct CoefficientTable {
    points: Arc<[(f64, f64)]>,
}

impl CoefficientTable {
    /// A table of as many places, in order, as coefficients, of which there is at least one.
    #[must_use]
    pub fn new(at: &[f64], coefficient: &[f64]) -> CoefficientTable {
        let points = at.iter().copied().zip(coefficient.iter().copied());
        CoefficientTable {
            points: points.collect(),
        }
    }

    /// Places with their coefficients.
    #[must_use]
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The coefficient at a place and its slope there; on a jump those of the side of larger places.
    #[must_use]
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
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |most, (_, mu)| most.max(*mu))
    }
}
