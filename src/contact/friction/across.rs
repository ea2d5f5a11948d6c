//! Friction that varies across the contact: a table of coefficients by y or by the inclination of the surface.

use std::sync::Arc;

use crate::contact::normal::patch::Patch;

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
    table: Arc<[(f64, f64)]>,
}

impl AcrossLaw {
    /// A law from as many places, in order, as coefficients, of which there is at least one.
    #[must_use]
    pub fn new(place: AcrossPlace, at: Vec<f64>, coefficient: Vec<f64>) -> AcrossLaw {
        AcrossLaw {
            place,
            table: at.into_iter().zip(coefficient).collect(),
        }
    }

    /// The coefficient at a place; on a jump that of the side of larger places.
    #[must_use]
    pub fn at(&self, place: f64) -> f64 {
        let table = &self.table;
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
        self.table.iter().fold(0.0, |most, (_, mu)| most.max(*mu))
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

    /// Friction limit of a patch in N, its load spread across as an ellipse has it: a parabola, so that Simpson's rule is exact for every
    /// linear piece of the table.
    #[must_use]
    pub fn limit(&self, patch: &Patch) -> f64 {
        let [low, high] = [patch.extent[2], patch.extent[3]];
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        let load = |y: f64| 0.75 / half * (1.0 - ((y - middle) / half).powi(2));
        let (first, last) = (self.table[0], self.table[self.table.len() - 1]);
        let inner = self.table.windows(2).map(|pair| [pair[0], pair[1]]);
        let outer = [
            [(low.min(first.0), first.1), first],
            [last, (high.max(last.0), last.1)],
        ];
        let pieces = inner.chain(outer).map(|[(y0, mu0), (y1, mu1)]| {
            let (begin, end) = (y0.max(low), y1.min(high));
            if begin >= end {
                return 0.0;
            }
            let traction = |y: f64| (mu0 + (y - y0) / (y1 - y0) * (mu1 - mu0)) * load(y);
            let inside = traction(0.5 * (begin + end));
            (end - begin) / 6.0 * (traction(begin) + 4.0 * inside + traction(end))
        });
        pieces.sum::<f64>() * patch.normal_force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> AcrossLaw {
        let at = vec![-1.0, 1.0, 1.0, 2.0];
        AcrossLaw::new(AcrossPlace::Y, at, vec![0.1, 0.3, 0.5, 0.2])
    }

    #[test]
    fn the_limit_of_a_patch_is_the_integral_of_its_load() {
        let law = law();
        let count = 400_000_u32;
        for extent in [[-0.5, 2.5], [-3.0, -1.5], [0.9, 1.1], [1.5, 9.0]] {
            let patch = Patch {
                normal_force: 1000.0,
                approach: None,
                area: 1.0,
                pressure_max: 1.0,
                semi_axes: None,
                extent: [-1.0, 1.0, extent[0], extent[1]],
            };
            let samples = (0..count).map(|k| {
                let eta = f64::from(2 * k + 1) / f64::from(count) - 1.0;
                let y = 0.5 * (extent[0] + extent[1]) + 0.5 * (extent[1] - extent[0]) * eta;
                (y, 1.0 - eta * eta)
            });
            let sum = 1000.0 * law.mean(samples);
            assert!((law.limit(&patch) / sum - 1.0).abs() < 1e-5, "{extent:?}");
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
        let patch = Patch {
            normal_force: 100.0,
            approach: None,
            area: 1.0,
            pressure_max: 1.0,
            semi_axes: None,
            extent: [-1.0, 1.0, -2.0, 3.0],
        };
        let even = AcrossLaw::new(AcrossPlace::Y, vec![0.0, 1.0], vec![0.3, 0.3]);
        assert!((even.limit(&patch) - 30.0).abs() < 1e-12);
        // A straight line has the value of its middle.
        let slope = AcrossLaw::new(AcrossPlace::Y, vec![-10.0, 10.0], vec![0.0, 0.4]);
        assert!((slope.limit(&patch) - 21.0).abs() < 1e-12);
        assert_eq!(slope.mean([(0.0, 0.0), (5.0, 0.0)].into_iter()), 0.25);
    }
}
