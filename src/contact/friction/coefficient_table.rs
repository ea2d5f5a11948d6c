//! Coefficients of friction by a place, across and along: linear between points, constant outside; two points at one place are a jump.

use std::sync::Arc;

use crate::contact::normal::footprint::LoadAcross;

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

/// What the places of a table are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AcrossPlace {
    /// y in mm: of the axes of the footprint, or of the rail's profile until the frame of a patch is known.
    Y,
    /// Inclination of the rail's surface in rad; a patch has to bring it to its own y first.
    Angle,
}

/// A coefficient of friction by its place across: linear between points, constant outside; two points at one place are a jump.
#[derive(Debug, Clone, PartialEq)]
pub struct AcrossLaw {
    /// What the places are.
    pub place: AcrossPlace,
    table: CoefficientTable,
}

impl AcrossLaw {
    /// A law from as many places, in order, as coefficients, of which there is at least one.
    #[must_use]
    pub fn new(place: AcrossPlace, at: &[f64], coefficient: &[f64]) -> AcrossLaw {
        AcrossLaw {
            place,
            table: CoefficientTable::new(at, coefficient),
        }
    }

    /// The coefficient at a place; on a jump that of the side of larger places.
    #[must_use]
    pub fn at(&self, place: f64) -> f64 {
        self.table.at(place)
    }

    /// The largest coefficient.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.table.largest()
    }

    /// The mean coefficient of loads at places; the plain mean where nothing is carried.
    #[must_use]
    pub fn mean(&self, loads: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
        let weighted = |weight: fn(f64) -> f64| {
            let sums = loads.clone().map(|(y, load)| (weight(load), self.at(y)));
            sums.fold((0.0, 0.0), |sum, (load, mu)| {
                (sum.0 + load, sum.1 + load * mu)
            })
        };
        match weighted(|load| load) {
            (load, sum) if load > 0.0 => sum / load,
            _ => {
                let (count, sum) = weighted(|_| 1.0);
                if count > 0.0 { sum / count } else { 0.0 }
            }
        }
    }

    /// The mean coefficient over a load.
    #[must_use]
    pub fn mean_over(&self, load: &LoadAcross) -> f64 {
        load.mean(self.table.points())
    }
}

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

    /// This table with its origin moved to `x` in mm.
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

    fn law() -> AcrossLaw {
        AcrossLaw::new(
            AcrossPlace::Y,
            &[-1.0, 1.0, 1.0, 2.0],
            &[0.1, 0.3, 0.5, 0.2],
        )
    }

    #[test]
    fn the_mean_over_an_ellipse_is_the_integral_of_its_load() {
        let law = law();
        let count = 400_000_u32;
        for extent in [[-0.5, 2.5], [-3.0, -1.5], [0.9, 1.1], [1.5, 9.0]] {
            let samples = (0..count).map(|k| {
                let eta = f64::from(2 * k + 1) / f64::from(count) - 1.0;
                let y = 0.5 * (extent[0] + extent[1]) + 0.5 * (extent[1] - extent[0]) * eta;
                (y, 1.0 - eta * eta)
            });
            let mean = law.mean_over(&LoadAcross::of_ellipse(extent));
            assert!((mean / law.mean(samples) - 1.0).abs() < 1e-5, "{extent:?}");
        }
    }

    #[test]
    fn coefficients_are_linear_between_points_jump_at_pairs_and_end_constant() {
        let known = [
            (-9.0, 0.1),
            (-1.0, 0.1),
            (0.0, 0.2),
            (1.0, 0.5),
            (1.5, 0.35),
            (2.0, 0.2),
            (7.0, 0.2),
        ];
        for (y, mu) in known {
            assert!((law().at(y) - mu).abs() < 1e-15, "{y}");
        }
        assert!((law().at(1.0 - 1e-12) - 0.3).abs() < 1e-12);
        assert_eq!(law().largest(), 0.5);
    }

    #[test]
    fn an_even_table_carries_its_coefficient_times_the_load() {
        let load = LoadAcross::of_ellipse([-2.0, 3.0]);
        let even = AcrossLaw::new(AcrossPlace::Y, &[0.0, 1.0], &[0.3, 0.3]);
        assert!((even.mean_over(&load) - 0.3).abs() < 1e-14);
        // A straight line has the value of its middle.
        let slope = AcrossLaw::new(AcrossPlace::Y, &[-10.0, 10.0], &[0.0, 0.4]);
        assert!((slope.mean_over(&load) - 0.21).abs() < 1e-14);
        assert_eq!(slope.mean([(0.0, 0.0), (5.0, 0.0)].into_iter()), 0.25);
    }

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
