//! Combines the elastic constants of two bodies into those of the pair.

use crate::contact::case::words::material::{Elastic, Material};
use crate::contact::error::Fault;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::method::Method;
use crate::contact::remark::list::Remark;

/// Largest |K| that methods which solve pressure and traction one after the other take.
const DIFFERENCE_UNCOUPLED: f64 = 0.05;
/// Differences below this are rounding of equal materials written in two ways.
const DIFFERENCE_NOISE: f64 = 1e-12;

impl Elasticity {
    /// Elastic constants of the pair: `1/G = ½(1/G₁ + 1/G₂)`, `ν/G = ½(ν₁/G₁ + ν₂/G₂)`,
    /// `K/G = ¼((1−2ν₁)/G₁ − (1−2ν₂)/G₂)` with 1 the upper and 2 the lower body; `G = E/(2(1+ν))` where Young's
    /// modulus is given. G in MPa, ν from 0 to 0.5. Source: Kalker 1990, eq. 1.44.
    #[must_use]
    pub fn combine(material: &Material) -> Elasticity {
        let (lower, upper) = match material {
            Material::Same(both) => (both, both),
            Material::Pair { lower, upper } => (lower, upper),
        };
        let (g1, g2) = (shear_modulus(upper), shear_modulus(lower));
        let (nu1, nu2) = (upper.poisson_ratio, lower.poisson_ratio);
        if g1 == g2 && nu1 == nu2 {
            return Elasticity {
                shear_modulus: g1,
                poisson_ratio: nu1,
                difference: 0.0,
                lower_share: 0.5,
            };
        }
        let g = 2.0 / (1.0 / g1 + 1.0 / g2);
        let nu = 0.5 * g * (nu1 / g1 + nu2 / g2);
        let lower_share = 0.5 * g * (1.0 - nu2) / (g2 * (1.0 - nu));
        let k = 0.25 * g * ((1.0 - 2.0 * nu1) / g1 - (1.0 - 2.0 * nu2) / g2);
        Elasticity {
            shear_modulus: g,
            poisson_ratio: nu.clamp(0.0, 0.5),
            difference: rounded(k, 0.0),
            lower_share: rounded(lower_share, 0.5),
        }
    }

    /// The fault of bodies that differ too much for a method that does not couple pressure and traction.
    pub(crate) fn uncoupled_fault(&self, method: Method) -> Option<Fault> {
        let k = self.difference;
        let needed = method != Method::BoundaryElement && k.abs() > DIFFERENCE_UNCOUPLED;
        needed.then(|| {
            let detail = format!(
                "the two bodies give the difference parameter K = {k:.4}; at most {DIFFERENCE_UNCOUPLED} in size is allowed with this \
                 method, which does not couple pressure and traction as boundary_element does"
            );
            Fault::new("/material", detail)
        })
    }

    /// The remark an answer carries if the bodies differ and the method does not couple pressure and traction.
    pub(crate) fn remark(&self, method: Method) -> Option<Remark> {
        let difference_parameter = self.difference;
        let neglected = difference_parameter != 0.0 && method != Method::BoundaryElement;
        neglected.then_some(Remark::CouplingNeglected {
            difference_parameter,
        })
    }
}

/// A constant of two bodies; that of equal bodies if the two differ by rounding only.
fn rounded(of_pair: f64, of_like_bodies: f64) -> f64 {
    match (of_pair - of_like_bodies).abs() < DIFFERENCE_NOISE {
        true => of_like_bodies,
        false => of_pair,
    }
}

fn shear_modulus(body: &Elastic) -> f64 {
    let from_young = || {
        body.young_modulus_mpa
            .map(|e| e / (2.0 * (1.0 + body.poisson_ratio)))
    };
    body.shear_modulus_mpa
        .or_else(from_young)
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(g: f64, nu: f64) -> Elastic {
        Elastic {
            shear_modulus_mpa: Some(g),
            young_modulus_mpa: None,
            poisson_ratio: nu,
        }
    }

    fn pair(upper: Elastic, lower: Elastic) -> Elasticity {
        Elasticity::combine(&Material::Pair { lower, upper })
    }

    // Aluminium on steel: G = 35924, ν = 0.3034, K = 0.100 (CONTACT user guide, section 5.3).
    #[test]
    fn aluminium_on_steel_is_for_the_method_that_couples() {
        let e = pair(body(23_000.0, 0.31), body(82_000.0, 0.28));
        assert!((e.difference - 0.1002).abs() < 1e-4);
        assert_eq!(e.uncoupled_fault(Method::BoundaryElement), None);
        for method in [Method::Fastsim, Method::LiuHsu, Method::Table] {
            let fault = e.uncoupled_fault(method).unwrap();
            assert_eq!(fault.pointer, "/material");
            assert!(fault.detail.contains("K = 0.100"), "{}", fault.detail);
        }
    }

    #[test]
    fn combined_constants_follow_kalker() {
        // The same pair with ν₁ raised until K is allowed.
        let (g1, nu1, g2, nu2) = (23_000.0, 0.42, 82_000.0, 0.28);
        let e = pair(body(g1, nu1), body(g2, nu2));
        assert!((e.shear_modulus - 35_923.81).abs() < 0.01);
        assert!((e.poisson_ratio / e.shear_modulus - 0.5 * (nu1 / g1 + nu2 / g2)).abs() < 1e-18);
        let k = 0.25 * ((1.0 - 2.0 * nu1) / g1 - (1.0 - 2.0 * nu2) / g2);
        assert!((e.difference / e.shear_modulus - k).abs() < 1e-18);
        let young = |g: f64, nu: f64| 2.0 * g * (1.0 + nu);
        let compliance = (1.0 - nu1 * nu1) / young(g1, nu1) + (1.0 - nu2 * nu2) / young(g2, nu2);
        assert!((e.contact_modulus() * compliance - 1.0).abs() < 1e-14);
    }

    #[test]
    fn exchanging_the_bodies_changes_only_the_sign_of_the_difference() {
        let (a, b) = (body(80_000.0, 0.30), body(82_000.0, 0.28));
        let (ab, ba) = (pair(a, b), pair(b, a));
        assert!((ab.shear_modulus - ba.shear_modulus).abs() < 1e-9);
        assert!((ab.difference + ba.difference).abs() < 1e-16 && ab.difference != 0.0);
        assert!((ab.lower_share + ba.lower_share - 1.0).abs() < 1e-15 && ab.lower_share > 0.5);
    }

    #[test]
    fn like_bodies_have_no_difference_however_they_are_written() {
        let young = Elastic {
            shear_modulus_mpa: None,
            young_modulus_mpa: Some(2.0 * 82_000.0 * 1.28),
            poisson_ratio: 0.28,
        };
        let e = pair(young, body(82_000.0, 0.28));
        assert!(!e.differs());
        assert!((e.shear_modulus - 82_000.0).abs() < 1e-9);
        assert_eq!(e.remark(Method::Fastsim), None);
    }

    #[test]
    fn two_incompressible_bodies_do_not_couple() {
        assert_eq!(pair(body(1.0, 0.5), body(500.0, 0.5)).difference, 0.0);
    }
}
