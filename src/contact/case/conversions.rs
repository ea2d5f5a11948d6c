//! Conversions from the members of a case to the types of the numerics.

use crate::case::words::friction::Friction;
use crate::case::words::material::Thermal;
use crate::case::words::solver::MethodName;
use crate::friction::coefficient_table::CoefficientTable;
use crate::friction::law::{AcrossLaw, AcrossPlace, FrictionLaw};
use crate::friction::path_dependent::{HeatedLaw, Interface, LayerYield};
use crate::friction::velocity_weakening::{FallingLaw, SofteningTerm};
use crate::method::Method;

impl From<Method> for MethodName {
    fn from(method: Method) -> MethodName {
        match method {
            Method::BoundaryElement => MethodName::BoundaryElement,
            Method::LiuHsu => MethodName::LiuHsu,
            Method::Fastsim => MethodName::Fastsim,
            Method::Table => MethodName::Table,
        }
    }
}

impl FrictionLaw {
    /// Returns the friction law of a case. A coefficient that falls with temperature needs `thermal`.
    pub(crate) fn new(words: &Friction, thermal: Option<&Thermal>) -> FrictionLaw {
        if let Some(law) = &words.by_temperature {
            // Missing thermal constants are a fault of the case. Nothing is heated then.
            let (base, rise) = thermal.map_or((0.0, 0.0), |t| (t.without_heat(), t.rise_of(1.0)));
            let heated = HeatedLaw::new(&law.temperature_c, &law.coefficient, base, rise);
            return FrictionLaw::Heated(heated);
        }
        if let Some(across) = &words.across {
            let (place, at) = match (&across.angle_rad, &across.y_mm) {
                (Some(angles), _) => (AcrossPlace::Angle, angles),
                (None, Some(y)) => (AcrossPlace::Y, y),
                (None, None) => return FrictionLaw::Constant(0.0),
            };
            return FrictionLaw::Across(AcrossLaw::new(place, at, &across.coefficient));
        }
        if let Some(along) = &words.along {
            return FrictionLaw::Along(CoefficientTable::new(&along.x_mm, &along.coefficient));
        }
        let Some(law) = words.law else {
            return FrictionLaw::Constant(words.coefficient.unwrap_or(0.0));
        };
        let term = |k: usize| match words.terms.get(k) {
            Some(term) => SofteningTerm {
                coefficient: term.coefficient,
                half_speed: term.half_speed_mm_per_s,
            },
            None => SofteningTerm::NONE,
        };
        FrictionLaw::Falling(FallingLaw {
            form: law,
            limit: words.limit.unwrap_or(0.0),
            terms: [term(0), term(1)],
        })
    }
}

impl From<&Friction> for Interface {
    fn from(words: &Friction) -> Interface {
        let layer = words
            .layer
            .map(|layer| layer.thickness_mm / layer.shear_modulus_mpa);
        Interface {
            reduction: words.reduction.unwrap_or(1.0),
            layer: layer.unwrap_or(0.0),
            yielding: words.layer.and_then(|layer| {
                Some(LayerYield {
                    stress: layer.yield_mpa?,
                    hardening: layer.hardening_mpa_per_mm.unwrap_or(0.0),
                })
            }),
        }
    }
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Method {
        match name {
            MethodName::Auto | MethodName::BoundaryElement => Method::BoundaryElement,
            MethodName::LiuHsu => Method::LiuHsu,
            MethodName::Fastsim => Method::Fastsim,
            MethodName::Table => Method::Table,
        }
    }
}
