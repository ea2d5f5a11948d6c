//! Friction that decreases with the slip velocity: the law, and the traction bound of a cell as a function of its slip.

use std::f64::consts::{LN_2, PI};

use railhead_macros::{Words, keyword};

use crate::normal::hertz::Patch;
use crate::numerics::roots::{CloseEnough, Course, find};

/// Tolerance of the slip of [`Softening::resolvent`], relative to that of a cell without traction.
const ROUNDING: f64 = 1e-14;

/// Largest reduction of the slip of one cell by a unit of traction over G: `max |M_ii|` of the three-point rule. On ellipses with a/b from 0.5 to 1.2
/// and meshes from 6 × 12 to 12 × 24 it is 1.5 to 1.8 (`cargo test --test physics -- friction_as_it_is --nocapture` prints it).
pub(crate) const SLIP_OF_CELL: f64 = 1.7;
/// Largest allowed stability number, for slip and for heat. Up to 1.0 no second state was found in 360 random motions from two starts, at 1.5 one.
pub(crate) const STABILITY_MAX: f64 = 1.0;
/// Least length of a cell over the length within which slip grows by a factor of e where friction falls and a layer shears. With shorter cells, stick and
/// slip alternate from cell to cell, or the iteration fails. From six laws and layers on one ellipse with 13 to 104 cells in a strip: forces of meshes with 5.5
/// and more agree within their estimates, those with 4.4 and less do not.
const CELL_OVER_GROWTH: f64 = 6.0;

/// How a coefficient falls with the slip speed v. In the formulas, f₀ is `limit`; f₁, f₂ are the `coefficient` and v₁, v₂ the
/// `half_speed_mm_per_s` of the terms.
#[keyword(Words)]
#[schema(as = FallName)]
pub enum FallForm {
    /// f₀ + f₁ exp(−ln 2 v/v₁) + f₂ exp(−ln 2 v/v₂). Polach's μ₀((1 − A) exp(−B v) + A) is f₀ = A μ₀, f₁ = (1 − A) μ₀, v₁ = ln 2/B.
    Exponential,
    /// f₀ + f₁/(1 + v/v₁) + f₂/(1 + (v/v₂)²).
    Rational,
    /// f₀ + f₁ max(0, 1 − v/(2 v₁)) + f₂ max(0, 1 − v/(2 v₂)).
    Linear,
}

/// One term of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SofteningTerm {
    /// Contribution to the coefficient without slip, not negative.
    pub coefficient: f64,
    /// Slip velocity in mm/s at which half of it is left, positive.
    pub half_speed: f64,
}

impl SofteningTerm {
    /// A term without effect.
    pub const NONE: SofteningTerm = SofteningTerm {
        coefficient: 0.0,
        half_speed: 1.0,
    };
}

/// A coefficient of friction that decreases with the slip velocity v in mm/s, as in CONTACT (Vollebregt, user guide, section 3.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FallingLaw {
    /// The form of its terms.
    pub form: FallForm,
    /// The limit f₀ at high velocities, not negative.
    pub limit: f64,
    /// Its terms; unused ones have the coefficient 0.
    pub terms: [SofteningTerm; 2],
}

impl FallingLaw {
    /// The coefficient without slip, which is the largest one.
    pub fn at_rest(&self) -> f64 {
        self.limit + self.terms.iter().map(|term| term.coefficient).sum::<f64>()
    }

    /// The coefficient at a slip velocity in mm/s, and its derivative in s/mm, which is never positive.
    pub fn at(&self, speed: f64) -> (f64, f64) {
        let mut sum = (self.limit, 0.0);
        for (k, term) in self.terms.iter().enumerate() {
            let (f, v) = (term.coefficient, term.half_speed);
            let x = speed / v;
            let (value, slope) = match (self.form, k) {
                (FallForm::Exponential, _) => {
                    let value = f * (-LN_2 * x).exp();
                    (value, -LN_2 * value / v)
                }
                (FallForm::Rational, 0) => (f / (1.0 + x), -f / (v * (1.0 + x) * (1.0 + x))),
                (FallForm::Rational, _) => {
                    let below = 1.0 + x * x;
                    (f / below, -2.0 * f * x / (v * below * below))
                }
                (FallForm::Linear, _) if x < 2.0 => (f * (1.0 - 0.5 * x), -0.5 * f / v),
                (FallForm::Linear, _) => (0.0, 0.0),
            };
            sum = (sum.0 + value, sum.1 + slope);
        }
        sum
    }

    /// An upper bound in s/mm of the magnitude of the derivative. It is attained unless two terms are steepest at different velocities.
    pub fn steepest(&self) -> f64 {
        // The largest slope of 1/(1 + x²) is 3√3/8.
        let second = 3.0 * 3.0_f64.sqrt() / 8.0;
        let factors = match self.form {
            FallForm::Exponential => [LN_2, LN_2],
            FallForm::Rational => [1.0, second],
            FallForm::Linear => [0.5, 0.5],
        };
        let terms = self.terms.iter().zip(factors);
        terms
            .map(|(term, factor)| factor * term.coefficient / term.half_speed)
            .sum()
    }

    /// Stability number `1.7 V max|μ′| p_max/G` at a rolling speed in mm/s, with pressure and shear modulus in MPa. It compares the decrease of
    /// bounds with slip with the decrease of slips with traction. Up to 1 the contact has one state.
    pub fn stability(&self, rolling_speed: f64, pressure_max: f64, shear_modulus: f64) -> f64 {
        SLIP_OF_CELL * rolling_speed * self.steepest() * pressure_max / shear_modulus
    }

    /// Largest number of cells in a strip of a patch at a rolling speed in mm/s, with a layer of a flexibility in mm/MPa.
    ///
    /// The layer's shear is its flexibility times the traction, so that the slip s of a point obeys `ℓ s′ = s − s₀` with `ℓ = flexibility · V |μ′| p`. It
    /// grows along rolling, and a steady state exists only for cells longer than ℓ.
    pub fn cells_along_max(&self, rolling_speed: f64, patch: &Patch, layer: f64) -> f64 {
        let growth = layer * rolling_speed * self.steepest() * patch.pressure_max;
        // The longest cell of a strip with n cells is π/(2n) of its length.
        let longest = 0.5 * PI * (patch.extent[1] - patch.extent[0]);
        longest / (CELL_OVER_GROWTH * growth)
    }

    /// The bounds of cells at a rolling speed in mm/s, for slips in units of `slip_unit`.
    pub fn bound_fall(&self, rolling_speed: f64, slip_unit: f64) -> Softening {
        Softening {
            law: *self,
            speed: rolling_speed * slip_unit,
        }
    }
}

/// The bound of a cell over its bound without slip, as a function of its dimensionless slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    law: FallingLaw,
    /// Slip velocity in mm/s per unit of slip.
    speed: f64,
}

impl Softening {
    /// The relative bound at a slip, and its derivative.
    pub fn at(&self, slip: f64) -> (f64, f64) {
        let rest = self.law.at_rest();
        let (value, slope) = self.law.at(self.speed * slip);
        (value / rest, self.speed * slope / rest)
    }

    /// An upper bound of the magnitude of the derivative.
    pub fn steepest(&self) -> f64 {
        self.speed * self.law.steepest() / self.law.at_rest()
    }

    /// Solves `g(σ) + r σ = length` for the slip σ. `g` is the bound of a cell whose bound without slip is `rest`, and `length` is larger than that.
    /// The solution is unique if r exceeds the largest `|g′|`.
    pub fn resolvent(&self, rest: f64, r: f64, length: f64) -> Slipping {
        let ends = [(length - rest) / r, length / r];
        let close = CloseEnough {
            value: 0.0,
            place: ROUNDING * ends[1],
        };
        let slip = find(ends, ends[0], Course::Rising, close, |slip| {
            let (share, slope) = self.at(slip);
            [rest * share + r * slip - length, r + rest * slope]
        });
        let (share, slope) = self.at(slip);
        Slipping {
            slip,
            bound: rest * share,
            slope: rest * slope,
        }
    }
}

/// The state of a slipping cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slipping {
    /// Magnitude of the slip.
    pub slip: f64,
    /// The bound at this slip.
    pub bound: f64,
    /// Its derivative, never positive.
    pub slope: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(form: FallForm) -> FallingLaw {
        let term = |coefficient, half_speed| SofteningTerm {
            coefficient,
            half_speed,
        };
        FallingLaw {
            form,
            limit: 0.1,
            terms: [term(0.15, 150.0), term(0.1, 2500.0)],
        }
    }

    const FORMS: [FallForm; 3] = [FallForm::Exponential, FallForm::Rational, FallForm::Linear];

    #[test]
    fn every_term_has_half_of_its_coefficient_at_its_speed() {
        for form in FORMS {
            for k in [0, 1] {
                let mut one = law(form);
                one.terms[1 - k].coefficient = 0.0;
                let (value, _) = one.at(one.terms[k].half_speed);
                assert!((value - 0.1 - 0.5 * one.terms[k].coefficient).abs() < 1e-15);
                assert!((one.at(0.0).0 - one.at_rest()).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn the_derivative_is_that_of_the_law_and_nowhere_steeper_than_said() {
        for form in FORMS {
            let law = law(form);
            for k in 1..200 {
                let speed = 31.7 * f64::from(k);
                let (_, slope) = law.at(speed);
                let found = (law.at(speed + 1e-3).0 - law.at(speed - 1e-3).0) / 2e-3;
                assert!((found - slope).abs() < 1e-9, "{form:?} {speed}");
                assert!(slope <= 0.0 && -slope <= law.steepest());
            }
        }
    }

    #[test]
    fn the_resolvent_solves_its_equation() {
        // An independently computed value for g(σ) = 0.5 (0.6 + 0.4 exp(−σ/0.5)), r = 1.2 and length 1.1.
        let law = FallingLaw {
            form: FallForm::Exponential,
            limit: 0.6,
            terms: [
                SofteningTerm {
                    coefficient: 0.4,
                    half_speed: 0.5 * LN_2,
                },
                SofteningTerm {
                    coefficient: 0.0,
                    half_speed: 1.0,
                },
            ],
        };
        let found = law.bound_fall(1.0, 1.0).resolvent(0.5, 1.2, 1.1);
        assert!((found.slip - 0.618268667424).abs() < 1e-12, "{found:?}");
        assert!((found.bound - 0.358077599091).abs() < 1e-12, "{found:?}");
        for form in FORMS {
            let fall = law_fall(form);
            let (rest, r) = (0.8, 2.0 * 0.8 * fall.steepest());
            for length in [0.81, 1.0, 3.0, 50.0] {
                let found = fall.resolvent(rest, r, length);
                assert!((found.bound + r * found.slip - length).abs() < 1e-12 * length);
                let (share, slope) = fall.at(found.slip);
                assert_eq!(
                    (rest * share, rest * slope),
                    (found.bound, found.slope),
                    "{form:?}"
                );
            }
        }
    }

    fn law_fall(form: FallForm) -> Softening {
        law(form).bound_fall(20_000.0, 0.005)
    }
}
