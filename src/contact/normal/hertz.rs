//! Hertz's elliptic contact in closed form.

use std::f64::consts::PI;

use crate::mesh::Chord;
use crate::numerics::ITERATIONS_MAX;

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
    /// Normal force in N, exactly as given.
    pub normal_force: f64,
}

/// The load on two bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalLoad {
    /// Normal force in N.
    Force(f64),
    /// Approach of distant points in mm.
    Approach(f64),
}

impl Ellipse {
    /// The contact of bodies with relative radii of curvature `rolling` and `lateral` in mm, and contact modulus `E* = G/(1−ν)` in MPa.
    ///
    /// With `h = A x² + B y²`, the larger and smaller semi-axis L and l, and k = l/L, the smaller of A and B is `p0 l D(k)/(E* L²)`, the larger
    /// `p0 l (K(k) − D(k))/(E* L² k²)`, the approach `p0 l K(k)/E*` and the force `⅔π L l p0`, where K and D are complete elliptic integrals of parameter 1 − k². All
    /// inputs are positive and finite; the ratio of the radii is arbitrary. The relative accuracy is about 1e-14. Source: Johnson 1985, chapter 4.
    pub fn of_radii(
        rolling: f64,
        lateral: f64,
        loading: NormalLoad,
        contact_modulus: f64,
    ) -> Ellipse {
        let shape = HertzShape::of_radii(rolling, lateral);
        let [a, b] = match loading {
            NormalLoad::Force(force) => shape.semi_axes(force, contact_modulus),
            NormalLoad::Approach(approach) => {
                let (k_integral, _) = complete_integrals(shape.ratio);
                shape.of_larger(
                    (approach * shape.d_integral / (shape.curvature * k_integral)).sqrt(),
                )
            }
        };
        Ellipse::of_semi_axes(a, b, loading, contact_modulus)
    }

    /// The contact with semi-axes `a` along and `b` across rolling in mm, and contact modulus `E*` in MPa: `p0 = 3N/(2πab)` and approach `p0 l K(k)/E*`, where l is the
    /// smaller semi-axis and k the ratio of the smaller to the larger.
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
        }
    }

    /// The coefficients of x² and y² of the gap in 1/mm, with the contact modulus `E*` in MPa; see [`Ellipse::of_radii`].
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

    /// Chords on the given strips, each `(y, dy)` with its mid-line at y. Strips that miss the patch have none.
    pub fn chords(&self, strips: &[(f64, f64)]) -> Vec<Chord> {
        let mut chords = Vec::new();
        self.add_chords(strips, &mut chords);
        chords
    }

    /// Appends chords on the given strips to a buffer.
    pub fn add_chords(&self, strips: &[(f64, f64)], chords: &mut Vec<Chord>) {
        let chord = |(strip, &line): (usize, &(f64, f64))| self.chord(strip, line);
        chords.extend(strips.iter().enumerate().filter_map(chord));
    }

    /// The chord on one strip `(y, dy)`; `None` if it misses the patch.
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

    /// Mean pressure in MPa over `x0 < x < x1` on the line of a chord, in closed form; 0 outside the ellipse. For `x0 = x1` the pressure there.
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
    pub fn largest_on(&self, chord: &Chord) -> f64 {
        self.pressure_max * self.half_chord(chord.y) / self.a
    }

    /// Pressure in MPa at the angle u on a chord, where x = −half cos u; `sine` is sin u.
    pub fn pressure(&self, chord: &Chord, sine: f64) -> f64 {
        self.pressure_max * 0.5 * (chord.right - chord.left) / self.a * sine
    }

    /// Mean pressures between neighbouring places, from −1 to 1, over the largest pressure of a line. They are equal on all lines.
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
/// With x = half cos θ the integrand is sin θ, and its integral over x that of sin² θ. Written with the width and the middle of the interval of θ, it does not
/// suffer from cancellation near the ends.
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

/// The part of [`Ellipse::of_radii`] that does not depend on the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzShape {
    /// Ratio of the semi-axes, smaller to larger.
    ratio: f64,
    d_integral: f64,
    curvature: f64,
    /// Whether the larger semi-axis lies along rolling.
    long: bool,
}

impl HertzShape {
    /// The shape of bodies with relative radii of curvature `rolling` and `lateral` in mm. The larger semi-axis lies along the larger radius, where the gap opens more
    /// slowly.
    pub fn of_radii(rolling: f64, lateral: f64) -> HertzShape {
        let (large, small) = (rolling.max(lateral), rolling.min(lateral));
        let (ratio, d_integral) = axis_ratio(small / large);
        HertzShape {
            ratio,
            d_integral,
            curvature: 0.5 / large,
            long: rolling >= lateral,
        }
    }

    /// Semi-axes along and across rolling in mm under a normal force in N, with the contact modulus `E*` in MPa.
    pub fn semi_axes(&self, force: f64, contact_modulus: f64) -> [f64; 2] {
        let cube = 1.5 * force * self.d_integral / (PI * contact_modulus * self.curvature);
        self.of_larger(cube.cbrt())
    }

    /// Both semi-axes, for the larger one.
    fn of_larger(&self, large: f64) -> [f64; 2] {
        let small = self.ratio * large;
        if self.long {
            [large, small]
        } else {
            [small, large]
        }
    }
}

/// A connected contact area as the normal problem describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Normal force in N.
    pub normal_force: f64,
    /// Approach in mm; `None` if unknown.
    pub approach: Option<f64>,
    /// Area in mm².
    pub area: f64,
    /// Largest pressure in MPa.
    pub pressure_max: f64,
    /// Semi-axes along and across rolling in mm; `None` unless it is an ellipse.
    pub semi_axes: Option<[f64; 2]>,
    /// `[x_min, x_max, y_min, y_max]` in mm.
    pub extent: [f64; 4],
}

/// The ratio k of the semi-axes, smaller to larger, and the integral D there, for the ratio A/B of the curvatures from 0 to 1.
///
/// Solves `k² D(k)/(K(k) − D(k)) = A/B` by Newton's method for ln k. The start is the solution to first order near the circle. The derivatives follow from the integrals:
/// `dK/dk = −(K − D)/k` and `dD/dk = −k (r⁻¹ − 1) D/m` with `r = k² D/(K − D)` and `m = 1 − k²`.
pub(crate) fn axis_ratio(curvature_ratio: f64) -> (f64, f64) {
    let mut k = curvature_ratio.cbrt().powi(2);
    let mut d = 0.0;
    for _ in 0..ITERATIONS_MAX {
        let (k_integral, found) = complete_integrals(k);
        let rest = k_integral - found;
        let m = (1.0 - k) * (1.0 + k);
        let r = k * k * found / rest;
        // (1 − r)/m, which is 3/4 at the circle.
        let share = if m > 1e-8 { (1.0 - r) / m } else { 0.75 };
        let off = curvature_ratio / r - 1.0;
        let ln_off = 2.0 * off / (2.0 + off);
        let step = ln_off / (3.0 - share * (1.0 + rest / found));
        k = (k * (1.0 + step + 0.5 * step * step)).min(1.0);
        d = found - rest * share * step;
        // The remaining error is of second order.
        if step.abs() < 1e-8 {
            break;
        }
    }
    (k, d)
}

/// Complete elliptic integrals K and `D = (K − E)/m` of parameter m = 1 − k², for 0 < k ≤ 1.
///
/// Arithmetic–geometric mean: `K = π/(2 agm(1, k))` and `D = K Σ 2^{n−1} c_n²/m`. The recurrence is written for the quotients `c_n²/m`, so there is no 0/0 at the circle. The
/// relative accuracy is a few units in the last place. Source: Gauss; Abramowitz and Stegun 1964, 17.6.
pub(crate) fn complete_integrals(k: f64) -> (f64, f64) {
    let (mut a, mut g) = (0.5 * (1.0 + k), k.sqrt());
    let mut c = 0.5 * (1.0 - k);
    let mut quotient = 0.25 * (1.0 - k) / (1.0 + k);
    let mut weight = 1.0;
    let mut sum = 0.5 + quotient;
    while c > f64::EPSILON * a {
        let a_next = 0.5 * (a + g);
        quotient *= (c / (4.0 * a_next)).powi(2);
        c = c * c / (4.0 * a_next);
        g = (a * g).sqrt();
        a = a_next;
        weight *= 2.0;
        sum += weight * quotient;
    }
    let k_integral = PI / (a + g);
    (k_integral, k_integral * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

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

#[cfg(test)]
mod axis_ratio_tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    /// b/a, A/B, A a²E*/(p0 b), B a²E*/(p0 b), K, E; own computation with 20 digits after Johnson 1985, chapter 4.
    const TABLE: [[f64; 6]; 12] = [
        [1.0, 1.0, FRAC_PI_4, FRAC_PI_4, FRAC_PI_2, FRAC_PI_2],
        [0.9, 0.853799, 0.849087, 0.994481, 1.654617, 1.493290],
        [0.8, 0.715418, 0.924084, 1.291671, 1.750754, 1.418083],
        [0.7, 0.585250, 1.013821, 1.732286, 1.862641, 1.345592],
        [0.6, 0.463807, 1.123364, 2.422053, 1.995303, 1.276350],
        [0.5, 0.351772, 1.260613, 3.583611, 2.156516, 1.211056],
        [0.4, 0.250109, 1.438819, 5.752779, 2.359264, 1.150656],
        [0.3, 0.160256, 1.682743, 10.500341, 2.627773, 1.096478],
        [0.2, 0.084555, 2.047511, 24.215045, 3.016112, 1.050502],
        [0.1, 0.027370, 2.706711, 98.892644, 3.695637, 1.015994],
        [0.05, 0.008500, 3.387756, 398.554806, 4.384143, 1.004856],
        [0.01, 0.000499, 4.991814, 9997.754010, 5.991589, 1.000275],
    ];

    #[test]
    fn integrals_agree_with_the_table() {
        for [k, curvature_ratio, a, b, k_expected, e_expected] in TABLE {
            let (k_integral, d) = complete_integrals(k);
            let e = k_integral - (1.0 - k * k) * d;
            assert!(
                (k_integral - k_expected).abs() < 6e-7,
                "K({k}) = {k_integral}"
            );
            assert!((e - e_expected).abs() < 6e-7, "E({k}) = {e}");
            assert!((d - a).abs() < 6e-7, "D({k}) = {d}");
            assert!(((k_integral - d) / (k * k) - b).abs() < 6e-7 * b.max(1.0));
            assert!((d * k * k / (k_integral - d) - curvature_ratio).abs() < 6e-7);
        }
    }

    #[test]
    fn integrals_satisfy_legendres_relation() {
        // K E' + E K' − K K' = π/2 ties k to its complement (Abramowitz and Stegun 1964, 17.3.13).
        for k in [1e-6_f64, 1e-3, 0.1, 0.5, 0.7, 0.999, 1.0 - 1e-9] {
            let complement = ((1.0 - k) * (1.0 + k)).sqrt();
            let ((k1, d1), (k2, d2)) = (complete_integrals(k), complete_integrals(complement));
            let (e1, e2) = (k1 - complement.powi(2) * d1, k2 - k * k * d2);
            assert!(
                (k1 * e2 + e1 * k2 - k1 * k2 - PI / 2.0).abs() < 1e-13 * k1 * k2,
                "{k}"
            );
        }
    }

    #[test]
    fn the_axis_ratio_inverts_the_curvature_ratio() {
        for exponent in -160..=0 {
            let ratio = 10.0_f64.powf(f64::from(exponent) / 10.0);
            let (k, own) = axis_ratio(ratio);
            let (k_integral, d) = complete_integrals(k);
            assert!((own / d - 1.0).abs() < 1e-13, "A/B = {ratio}: {own} {d}");
            let back = k * k * d / (k_integral - d);
            assert!(
                (back / ratio - 1.0).abs() < 1e-13,
                "A/B = {ratio}: k = {k}, back {back}"
            );
        }
        for distance in [0.0_f64, 1e-15, 1e-12, 1e-8, 1e-4] {
            // Near the circle A/B = k^{3/2} to first order.
            let (k, _) = axis_ratio(1.0 - distance);
            assert!(
                (1.0 - k - distance * 2.0 / 3.0).abs() < 1e-15 + distance * distance,
                "{distance}: {k}"
            );
        }
    }
}
