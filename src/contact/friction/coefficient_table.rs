//! Coefficients of friction by a place: linear between points, constant outside; two points at one place are a jump.

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

    /// The coefficient at a place; on a jump that of the side of larger places.
    #[must_use]
    pub fn at(&self, place: f64) -> f64 {
        let table = &self.points;
        let above = table.partition_point(|(at, _)| *at <= place);
        match (above.checked_sub(1).map(|k| table[k]), table.get(above)) {
            (Some((low, mu)), Some((high, next))) => {
                mu + (place - low) / (high - low) * (next - mu)
            }
            (Some((_, mu)), None) | (None, Some(&(_, mu))) => mu,
            (None, None) => 0.0,
        }
    }

    /// The largest coefficient.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.points.iter().fold(0.0, |most, (_, mu)| most.max(*mu))
    }
}
