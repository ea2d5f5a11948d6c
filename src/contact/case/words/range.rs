//! Equally spaced values.

use serde::Serialize;
use utoipa::ToSchema;

/// Equally spaced values, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
pub struct Range {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values, at least 1.
    #[schema(minimum = 1)]
    pub points: u32,
}

impl Range {
    /// The values; the ends are exact.
    #[must_use]
    pub fn values(&self) -> Vec<f64> {
        let last = self.points.saturating_sub(1);
        (0..self.points)
            .map(|n| {
                if n == 0 {
                    self.from
                } else if n == last {
                    self.to
                } else {
                    let t = f64::from(n) / f64::from(last);
                    self.from * (1.0 - t) + self.to * t
                }
            })
            .collect()
    }
}
