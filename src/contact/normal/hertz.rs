//! Hertz's elliptic contact in closed form.

use std::f64::consts::PI;

use crate::contact::mesh::strips::Chord;
use crate::contact::normal::axis_ratio::{axis_ratio, axis_ratio_and_integral, complete_integrals};
use crate::contact::normal::patch::Patch;

/// An elliptic patch with Hertz's pressure `p0 √(1 − x²/a² − y²/b²)`, centred at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse {
    /// Semi-axis along rolling in mm.
    pub a: f64,
    /// Semi-axis across rolling in mm.
    pub b: f64,
    /// Largest pressure in MPa.
    pub pressure_max: f64,
    /// Approach in mm.
    pub approach: f64,
    /// Normal force in N: as given where it was, so that no digit of it is lost.
    pub normal_force: f64,
    /// The shape of the radii that it follows from, where radii were given.
    pub shape: Option<HertzShape>,
}

/// How two bodies are pressed together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalLoad {
    /// Normal force in N.
    Force(f64),
    /// Approach of distant points in mm.
    Approach(f64),
}

impl Ellipse {
    /// The contact of bodies with relative radii of curvature `rolling` and `lateral` in mm, and contact modulus
    /// `E* = G/(1−ν)` in MPa.
    ///
    /// With `h = A x² + B y²`, L and l the larger and smaller semi-axis and k = l/L, the smaller of A and B is
    /// `p0 l D(k)/(E* L²)`, the larger `p0 l (K(k) − D(k))/(E* L² k²)`, the approach `p0 l K(k)/E*` and the force
    /// `⅔π L l p0`; K and D are complete elliptic integrals of parameter 1 − k². All inputs are positive and
    /// finite; radii may differ by any ratio. Relative accuracy about 1e-14. Source: Johnson 1985, chapter 4.
    #[must_use]
    pub fn of_radii(
        rolling: f64,
        lateral: f64,
        loading: NormalLoad,
        contact_modulus: f64,
    ) -> Ellipse {
        // The larger semi-axis lies along the larger radius, where the gap opens more slowly.
        let (radius_large, radius_small) = (rolling.max(lateral), rolling.min(lateral));
        let ratio = axis_ratio(radius_small / radius_large);
        let (k_integral, d_integral) = complete_integrals(ratio);
        let curvature = 0.5 / radius_large;
        let large = match loading {
            NormalLoad::Force(force) => {
                (1.5 * force * d_integral / (PI * contact_modulus * curvature)).cbrt()
            }
            NormalLoad::Approach(approach) => {
                (approach * d_integral / (curvature * k_integral)).sqrt()
            }
        };
        let small = ratio * large;
        let (a, b) = if rolling >= lateral {
            (large, small)
        } else {
            (small, large)
        };
        Ellipse {
            shape: Some(HertzShape::of_radii(rolling, lateral)),
            ..Ellipse::of_semi_axes(a, b, loading, contact_modulus)
        }
    }

    /// Semi-axes in mm and their ratio a/b as rows of many contacts have them: of radii to 1e-11, by the shape. The table of creep forces takes
    /// these, so that a case and a row have the same answer to the last bit.
    #[must_use]
    pub fn axes_of_rows(&self, contact_modulus: f64) -> ([f64; 2], f64) {
        match self.shape {
            Some(shape) => (
                shape.semi_axes(self.normal_force, contact_modulus),
                shape.ratio(),
            ),
            None => ([self.a, self.b], self.a / self.b),
        }
    }

    /// The contact with semi-axes `a` along and `b` across rolling in mm, and contact modulus `E*` in MPa:
    /// `p0 = 3N/(2πab)`, approach `p0 l K(k)/E*` with l the smaller semi-axis and k the ratio of smaller to larger.
    #[must_use]
    pub fn of_semi_axes(a: f64, b: f64, loading: NormalLoad, contact_modulus: f64) -> Ellipse {
        let (small, large) = (a.min(b), a.max(b));
        let (k_integral, _) = complete_integrals(small / large);
        let depth = small * k_integral / contact_modulus;
        let (pressure_max, approach) = match loading {
            NormalLoad::Force(force) => {
                let pressure_max = 1.5 * (force / a) / (PI * b);
                (pressure_max, pressure_max * depth)
            }
            NormalLoad::Approach(approach) => (approach / depth, approach),
        };
        Ellipse {
            a,
            b,
            pressure_max,
            approach,
            normal_force: match loading {
                NormalLoad::Force(force) => force,
                NormalLoad::Approach(_) => PI * a * b * pressure_max * 2.0 / 3.0,
            },
            shape: None,
        }
    }

    /// The coefficients of x² and y² of its gap in 1/mm, with the contact modulus `E*` in MPa; see [`Ellipse::of_radii`].
    #[must_use]
    pub fn curvatures(&self, contact_modulus: f64) -> [f64; 2] {
        let (small, large) = (self.a.min(self.b), self.a.max(self.b));
        let ratio = small / large;
        let (k_integral, d_integral) = complete_integrals(ratio);
        let unit = self.pressure_max * small / (contact_modulus * large * large);
        let [low, high] = [
            unit * d_integral,
            unit * (k_integral - d_integral) / ratio.powi(2),
        ];
        if self.a >= self.b {
            [low, high]
        } else {
            [high, low]
        }
    }

    /// Force, area and extent.
    #[must_use]
    pub fn patch(&self) -> Patch {
        Patch {
            normal_force: self.normal_force,
            approach: Some(self.approach),
            area: PI * self.a * self.b,
            pressure_max: self.pressure_max,
            semi_axes: Some([self.a, self.b]),
            extent: [-self.a, self.a, -self.b, self.b],
        }
    }

    /// Chords on the given strips, each `(y, dy)` with its mid-line at y; strips that miss the patch have none.
    #[must_use]
    pub fn chords(&self, strips: &[(f64, f64)]) -> Vec<Chord> {
        let mut chords = Vec::new();
        self.add_chords(strips, &mut chords);
        chords
    }

    /// The same behind those in a buffer.
    pub fn add_chords(&self, strips: &[(f64, f64)], chords: &mut Vec<Chord>) {
        let chord = |(strip, &line): (usize, &(f64, f64))| self.chord(strip, line);
        chords.extend(strips.iter().enumerate().filter_map(chord));
    }

    /// The chord on one strip `(y, dy)`; nothing if it misses the patch.
    #[must_use]
    #[inline]
    pub fn chord(&self, strip: usize, (y, dy): (f64, f64)) -> Option<Chord> {
        let half = self.half_chord(y);
        (half > 0.0).then_some(Chord {
            patch: 0,
            strip,
            y,
            dy,
            left: -half,
            right: half,
        })
    }

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord, in closed form; 0 outside the ellipse.
    /// For `x0 = x1` the pressure there.
    #[must_use]
    pub fn mean_pressure(&self, chord: &Chord, x0: f64, x1: f64) -> f64 {
        let half = self.half_chord(chord.y);
        if half <= 0.0 {
            return 0.0;
        }
        if x0 == x1 {
            let root = ((half - x0) * (half + x0)).max(0.0).sqrt();
            return self.pressure_max * root / self.a;
        }
        self.largest_on(chord) * mean_height(half, x0, x1)
    }

    /// Largest pressure in MPa on the line of a chord.
    #[must_use]
    pub fn largest_on(&self, chord: &Chord) -> f64 {
        self.pressure_max * self.half_chord(chord.y) / self.a
    }

    /// Pressure in MPa at the angle u on a chord, where x = −half cos u; `sine` is sin u.
    #[must_use]
    pub fn pressure(&self, chord: &Chord, sine: f64) -> f64 {
        self.pressure_max * 0.5 * (chord.right - chord.left) / self.a * sine
    }

    /// Mean pressures over the largest one of a line, between neighbouring places on it that run from −1 to 1: they are the same on
    /// every line.
    #[must_use]
    pub fn profile(places: &[f64]) -> Vec<f64> {
        places
            .windows(2)
            .map(|x| mean_height(1.0, x[0], x[1]))
            .collect()
    }

    /// Half-length of the chord at y; 0 where the line misses the ellipse.
    #[inline]
    fn half_chord(&self, y: f64) -> f64 {
        let t = y / self.b;
        self.a * ((1.0 - t) * (1.0 + t)).max(0.0).sqrt()
    }
}

/// Mean of `√(1 − x²/half²)` over `x0 < x < x1`.
///
/// With x = half cos θ the integrand is sin θ and its integral over x that of sin² θ; written with the width and middle of the interval of θ it
/// has no cancellation near the ends.
fn mean_height(half: f64, x0: f64, x1: f64) -> f64 {
    let angle = |x: f64| {
        let x = x.clamp(-half, half);
        ((half - x) * (half + x)).sqrt().atan2(x)
    };
    let (theta0, theta1) = (angle(x0), angle(x1));
    let (width, middle) = (theta0 - theta1, 0.5 * (theta0 + theta1));
    let integral = 0.5 * ((width - width.sin()) + 2.0 * width.sin() * middle.sin().powi(2));
    half * integral / (x1 - x0)
}

/// The shape of the ellipse of two radii, for many loads: of [`Ellipse::of_radii`] what does not depend on the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzShape {
    /// Ratio of the semi-axes, smaller to larger.
    ratio: f64,
    d_integral: f64,
    curvature: f64,
    /// The larger semi-axis lies along rolling.
    long: bool,
}

impl HertzShape {
    /// The shape of bodies with relative radii of curvature `rolling` and `lateral` in mm; relative accuracy about 1e-11.
    #[must_use]
    pub fn of_radii(rolling: f64, lateral: f64) -> HertzShape {
        let (large, small) = (rolling.max(lateral), rolling.min(lateral));
        let (ratio, d_integral) = axis_ratio_and_integral(small / large);
        HertzShape {
            ratio,
            d_integral,
            curvature: 0.5 / large,
            long: rolling >= lateral,
        }
    }

    /// a/b, the semi-axis along rolling by that across; the same under every load.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        if self.long {
            1.0 / self.ratio
        } else {
            self.ratio
        }
    }

    /// Semi-axes along and across rolling in mm under a normal force in N, with the contact modulus `E*` in MPa.
    #[must_use]
    pub fn semi_axes(&self, force: f64, contact_modulus: f64) -> [f64; 2] {
        let cube = 1.5 * force * self.d_integral / (PI * contact_modulus * self.curvature);
        let large = cube.cbrt();
        let small = self.ratio * large;
        if self.long {
            [large, small]
        } else {
            [small, large]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shape_of_radii_has_the_semi_axes_of_the_ellipse() {
        for exponent in -90..=90 {
            let lateral = 300.0 * 10.0_f64.powf(f64::from(exponent) / 15.0);
            let [a, b] = HertzShape::of_radii(300.0, lateral).semi_axes(9e4, 1.1e5);
            let ellipse = Ellipse::of_radii(300.0, lateral, NormalLoad::Force(9e4), 1.1e5);
            for (found, known) in [(a, ellipse.a), (b, ellipse.b)] {
                let error = (found / known - 1.0).abs();
                assert!(error < 1e-10, "{lateral}: {found} {known}");
            }
        }
    }

    #[test]
    fn cells_of_a_chord_add_up_to_its_load() {
        let ellipse = Ellipse::of_semi_axes(3.0, 2.0, NormalLoad::Force(1000.0), 1e5);
        let chord = ellipse.chords(&[(1.2, 0.1)])[0];
        let half = 3.0 * (1.0_f64 - 0.36).sqrt();
        assert!((chord.right - half).abs() < 1e-15 && (chord.left + half).abs() < 1e-15);
        let exact = ellipse.pressure_max / ellipse.a * PI * half * half / 2.0;
        for cells in [1, 7, 1000] {
            let edge = |k: i32| -half * (PI * f64::from(k) / f64::from(cells)).cos();
            let sum: f64 = (0..cells)
                .map(|k| {
                    ellipse.mean_pressure(&chord, edge(k), edge(k + 1)) * (edge(k + 1) - edge(k))
                })
                .sum();
            assert!(
                (sum / exact - 1.0).abs() < 1e-12,
                "{cells} cells: {sum} for {exact}"
            );
        }
    }

    #[test]
    fn small_cells_at_the_edge_keep_their_digits() {
        let ellipse = Ellipse::of_semi_axes(1.0, 1.0, NormalLoad::Force(1.0), 1.0);
        let chord = ellipse.chords(&[(0.0, 0.1)])[0];
        // Over the last ε of the chord √(1−x²) has the mean ⅔√(2ε)(1 − 3ε/20 + …).
        for epsilon in [1e-3_f64, 1e-6, 1e-9] {
            let mean = ellipse.mean_pressure(&chord, 1.0 - epsilon, 1.0) / ellipse.pressure_max;
            let series = 2.0 / 3.0 * (2.0 * epsilon).sqrt() * (1.0 - 0.15 * epsilon);
            let rounding_of_x = f64::EPSILON / epsilon;
            assert!(
                (mean / series - 1.0).abs() < epsilon * epsilon + 10.0 * rounding_of_x.max(1e-10),
                "{epsilon}"
            );
        }
    }

    #[test]
    fn pressure_is_zero_outside_and_pointwise_for_an_empty_interval() {
        let ellipse = Ellipse::of_semi_axes(2.0, 1.0, NormalLoad::Force(10.0), 1.0);
        let chord = ellipse.chords(&[(0.6, 0.1)])[0];
        assert!(
            (ellipse.mean_pressure(&chord, 0.0, 0.0) / ellipse.pressure_max - 0.8).abs() < 1e-14
        );
        assert_eq!(ellipse.mean_pressure(&chord, 1.7, 1.7), 0.0);
        assert_eq!(ellipse.mean_pressure(&chord, 1.61, 5.0), 0.0);
        let inside = ellipse.mean_pressure(&chord, 1.0, chord.right) * (chord.right - 1.0);
        let beyond = ellipse.mean_pressure(&chord, 1.0, 3.0) * 2.0;
        assert!((inside / beyond - 1.0).abs() < 1e-13);
    }

    #[test]
    fn strips_beside_the_ellipse_have_no_chord() {
        let ellipse = Ellipse::of_semi_axes(2.0, 1.0, NormalLoad::Force(10.0), 1.0);
        let chords = ellipse.chords(&[
            (-1.5, 0.1),
            (-1.0, 0.1),
            (-0.5, 0.1),
            (0.99, 0.1),
            (1.0, 0.1),
        ]);
        let strips: Vec<usize> = chords.iter().map(|chord| chord.strip).collect();
        assert_eq!(strips, [2, 3]);
    }
}
