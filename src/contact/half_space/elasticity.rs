//! Elastic constants of the pair of bodies.

/// Elastic constants of the pair of bodies, combined as in quasi-identical contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// Combined shear modulus G in MPa.
    pub shear_modulus: f64,
    /// Combined Poisson's ratio, 0 to 0.5.
    pub poisson_ratio: f64,
    /// Difference parameter K (Kalker 1990, eq. 1.44); 0 for like bodies.
    pub difference: f64,
    /// Part of the normal displacement of both bodies that is the lower one's; ½ for like bodies.
    pub lower_share: f64,
}

impl Elasticity {
    /// Have the bodies different elastic constants?
    #[must_use]
    pub fn differs(&self) -> bool {
        self.difference != 0.0 || self.lower_share != 0.5
    }

    /// Contact modulus `E* = G/(1−ν)` in MPa, that is `1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂`.
    #[must_use]
    pub fn contact_modulus(&self) -> f64 {
        self.shear_modulus / (1.0 - self.poisson_ratio)
    }
}
