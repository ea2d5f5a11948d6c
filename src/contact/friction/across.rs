//! Friction that varies across the contact: a table of coefficients by y or by the inclination of the surface.

use crate::contact::friction::coefficient_table::CoefficientTable;
use crate::contact::normal::load_across::LoadAcross;

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
}
