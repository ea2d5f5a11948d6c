//! Flash temperature: how hot the surfaces get in the contact.
//!
//! Heat flows only into the depth and the contact passes quickly (large Péclet number), so that every line along rolling is a half-space
//! heated from its leading edge on: `θ(x) = 1/(B√(πV)) ∫_x^lead q(x′)/√(x′ − x) dx′` with the heat q per area and time and
//! `B = β₁ + β₂`, `β = √(λρc)` of each body. Both surfaces have one temperature in the contact; without heat that is the mean of the
//! bulk temperatures weighted with β, which is also how q is shared (Jaeger 1942; Carslaw and Jaeger 1959, §2.4 and 10.7).

/// What a body does with heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalBody {
    /// Heat conductivity λ in W/(m K).
    pub conductivity: f64,
    /// Density ρ in kg/m³.
    pub density: f64,
    /// Specific heat c in J/(kg K).
    pub specific_heat: f64,
    /// Temperature before the contact, in °C.
    pub bulk: f64,
}

impl ThermalBody {
    /// Thermal penetration coefficient β in J/(m² √s K).
    #[must_use]
    pub fn penetration(&self) -> f64 {
        (self.conductivity * self.density * self.specific_heat).sqrt()
    }

    /// Péclet number `V L/(2 κ)` of a contact of half-length L in mm, rolled over at V in mm/s.
    #[must_use]
    pub fn peclet(&self, speed: f64, half_length: f64) -> f64 {
        let diffusivity = self.conductivity / (self.density * self.specific_heat);
        speed * METRES * half_length * METRES / (2.0 * diffusivity)
    }
}

/// What is asked of the heat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalTask {
    /// The lower body.
    pub lower: ThermalBody,
    /// The upper body.
    pub upper: ThermalBody,
}

impl ThermalTask {
    /// Share of the friction heat that flows into the lower body while it is in contact.
    #[must_use]
    pub fn share_of_lower(&self) -> f64 {
        let [lower, upper] = [self.lower, self.upper].map(|body| body.penetration());
        lower / (lower + upper)
    }

    /// Temperature of both surfaces in the contact without friction heat, in °C.
    #[must_use]
    pub fn without_heat(&self) -> f64 {
        let share = self.share_of_lower();
        share * self.lower.bulk + (1.0 - share) * self.upper.bulk
    }

    /// Temperature rise in K per unit of [`heating`], at a speed in mm/s: lengths in mm and heat in MPa mm/s give `1000 √0.001`.
    #[must_use]
    pub fn rise_of(&self, speed: f64) -> f64 {
        let both = self.lower.penetration() + self.upper.penetration();
        // MPa mm/s are 1000 W/m².
        1e3 * METRES.sqrt() / (both * (std::f64::consts::PI * speed * METRES).sqrt())
    }
}

/// `∫ q(x′)/√(x′ − x) dx′` ahead of every point x, for heat that is linear in every cell of a line.
///
/// `edges` has one value more than `heat`, from the trailing to the leading end; `heat` are means of the cells. Slopes are those of the
/// neighbours, 0 at extrema and at most twice the one-sided ones, so that no cell gets a negative heat.
#[must_use]
pub fn heating(edges: &[f64], heat: &[f64], points: &[f64]) -> Vec<f64> {
    let slopes = slopes(edges, heat);
    let at = |x: f64| {
        let mut sum = 0.0;
        for k in 0..heat.len() {
            let (near, far) = (
                (edges[k] - x).max(0.0).sqrt(),
                (edges[k + 1] - x).max(0.0).sqrt(),
            );
            if far == 0.0 {
                continue;
            }
            let middle = 0.5 * (edges[k] + edges[k + 1]);
            let cubes = 2.0 / 3.0 * (far.powi(3) - near.powi(3));
            let linear = cubes + 2.0 * (x - middle) * (far - near);
            sum += 2.0 * heat[k] * (far - near) + slopes[k] * linear;
        }
        sum
    };
    points.iter().map(|x| at(*x)).collect()
}

/// Limited slopes of cell means; beyond both ends there is no heat.
fn slopes(edges: &[f64], heat: &[f64]) -> Vec<f64> {
    let n = heat.len();
    let middle = |k: usize| 0.5 * (edges[k] + edges[k + 1]);
    (0..n)
        .map(|k| {
            let before = match k.checked_sub(1) {
                Some(j) => (heat[k] - heat[j]) / (middle(k) - middle(j)),
                None => heat[k] / (middle(k) - edges[0]),
            };
            let after = if k + 1 < n {
                (heat[k + 1] - heat[k]) / (middle(k + 1) - middle(k))
            } else {
                -heat[k] / (edges[n] - middle(k))
            };
            if before * after <= 0.0 {
                return 0.0;
            }
            let central = 0.5 * (before + after);
            let limit = 2.0 * before.abs().min(after.abs());
            central.signum() * central.abs().min(limit)
        })
        .collect()
}

/// m in a mm.
pub(crate) const METRES: f64 = 1e-3;
/// nm in a mm.
pub(crate) const NANOMETRES: f64 = 1e6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::mesh::Grading;

    /// Golden values of constant heat per cell: the slopes are 0 where neighbours do not change.
    #[test]
    fn a_uniform_source_heats_as_a_root() {
        let edges = [-1.0, -0.4, 0.1, 1.0];
        for x in [-1.0, -0.7, 0.0, 0.5, 0.99] {
            // One cell more on each side keeps the slopes of the inner ones 0.
            let found = heating(&edges, &[3.0, 3.0, 3.0], &[x])[0];
            // The outer cells have the slope 0 too: an extremum.
            let known = 2.0 * 3.0 * (1.0 - x).sqrt();
            assert!((found - known).abs() < 1e-12, "{x}: {found} {known}");
        }
    }

    /// Heat of Hertz's pressure under uniform slip, `√(1 − s²)`: the largest is 2.18831 at −0.6522, and 4√2/3 at the trailing end.
    #[test]
    fn a_semi_elliptic_source_has_its_known_peak() {
        let edges = Grading::cosine(40).edges;
        let area = |x: f64| 0.5 * (x * (1.0 - x * x).max(0.0).sqrt() + x.asin());
        let heat: Vec<f64> = edges
            .windows(2)
            .map(|e| (area(e[1]) - area(e[0])) / (e[1] - e[0]))
            .collect();
        let found = heating(&edges, &heat, &[-0.6522, -1.0]);
        assert!((found[0] - 2.18831).abs() < 2e-3, "{found:?}");
        assert!(
            (found[1] - 4.0 * 2.0_f64.sqrt() / 3.0).abs() < 3e-3,
            "{found:?}"
        );
    }

    /// Far behind a short source everything comes from one point: `q h/√distance`.
    #[test]
    fn a_short_source_acts_as_a_point() {
        let found = heating(&[0.0, 1e-3], &[5.0], &[-4.0])[0];
        assert!((found / (5.0 * 1e-3 / 2.0) - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn bodies_without_slip_meet_in_the_middle() {
        let steel = |bulk| ThermalBody {
            conductivity: 50.0,
            density: 7850.0,
            specific_heat: 450.0,
            bulk,
        };
        let task = ThermalTask {
            lower: steel(120.0),
            upper: steel(20.0),
        };
        assert!((task.without_heat() - 70.0).abs() < 1e-12);
        assert!((steel(0.0).penetration() - 13290.0).abs() < 1.0);
        // 0.3 · 770.5 MPa · 1 m/s of slip over 2a = 11.7578 mm at 30 m/s: 150.3 K.
        let heat = 0.3 * 770.5 * 1000.0;
        let rise = task.rise_of(30_000.0) * heat * 2.18831 * 5.8789_f64.sqrt();
        assert!((rise - 150.3).abs() < 0.2, "{rise}");
    }
}
