//! The member `friction` of a case: coefficients, layers and the reduction factor.

use railhead_macros::{Members, none_is_absent};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::case::words::object::{AllowedRange, Member, Object};
use crate::case::words::samples::AXIS_POINTS;
use crate::friction::velocity_weakening::FallForm;

/// Coulomb friction: exactly one of `coefficient`, `law` (with `limit` and `terms`), `across`, `along` and `by_temperature`. `layer` and
/// `reduction` make the contact more compliant and may be added to each of them.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Default, Serialize, ToSchema, Members)]
#[members(faults_of_friction)]
pub struct Friction {
    /// Friction coefficient: 0 (frictionless), or 1e-12 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    #[member(closed(0.0, 100.0, ""))]
    pub coefficient: Option<f64>,
    /// How the coefficient falls with slip speed; requires `speed_mm_per_s` in every motion.
    pub law: Option<FallForm>,
    /// Limit of the coefficient at high slip speed, 0 to 100; with `law`.
    #[schema(minimum = 0.0, maximum = 100.0)]
    #[member(closed(0.0, 100.0, ""))]
    pub limit: Option<f64>,
    /// One or two terms that fall with slip speed; with `law`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(min_items = 1, max_items = 2)]
    #[member(with = terms, default)]
    pub terms: Vec<FallTerm>,
    /// A coefficient that varies across the contact.
    pub across: Option<FrictionAcross>,
    /// A coefficient that varies along the track; requires a `history` that rolls over it.
    pub along: Option<FrictionAlong>,
    /// A coefficient that falls with the temperature of the contact; requires `thermal`, and `speed_mm_per_s` in every motion.
    pub by_temperature: Option<FrictionByTemperature>,
    /// A layer between the bodies, such as wet leaves, sand or oxides.
    pub layer: Option<Layer>,
    /// Kalker's reduction factor, more than 0 and at most 1: ratio of the initial slope of the creep curves to that of clean bodies.
    #[schema(maximum = 1.0)]
    #[member(positive(1.0, ""))]
    pub reduction: Option<f64>,
}

/// A part of the coefficient that falls with slip speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Members)]
pub struct FallTerm {
    /// Value at rest, 0 to 100.
    #[schema(minimum = 0.0, maximum = 100.0)]
    #[member(closed(0.0, 100.0, ""))]
    pub coefficient: f64,
    /// Slip speed in mm/s at which half of the value remains, more than 0.
    #[schema(exclusive_minimum = 0.0)]
    #[member(positive(1e9, "mm/s"))]
    pub half_speed_mm_per_s: f64,
}

/// A coefficient that varies across the contact: linear between points, constant outside; two points at the same position form a jump.
/// Exactly one of `y_mm` and `angle_rad` gives the positions of the points.
#[none_is_absent]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Members)]
#[members(faults_of_across)]
pub struct FrictionAcross {
    /// Positions in mm, in ascending order: y in the axes of the case; with `profiles`, y of the rail's profile.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(-1e6, 1e6, "mm"))]
    pub y_mm: Option<Vec<f64>>,
    /// Inclinations of the rail's surface in rad, in ascending order, positive as contact angles are; with `profiles` only.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(-1.6, 1.6, "rad"))]
    pub angle_rad: Option<Vec<f64>>,
    /// Coefficient at each point, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(1e-12, 100.0, ""))]
    pub coefficient: Vec<f64>,
}

/// A coefficient along the track that does not move with the contact: linear between points, constant outside; two points at the same
/// position form a jump.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Members)]
#[members(faults_of_along)]
pub struct FrictionAlong {
    /// Positions in mm, in ascending order: x in the axes of the case at the start of the history. After a rolled distance q, x = 0 of the
    /// contact is at q.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(-1e6, 1e6, "mm"))]
    pub x_mm: Vec<f64>,
    /// Coefficient at each point, 1e-12 to 100.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(1e-12, 100.0, ""))]
    pub coefficient: Vec<f64>,
}

/// A coefficient that depends on the temperature of both surfaces in the contact: linear between points, constant outside. Friction heats
/// the contact, and each point has the coefficient of the temperature it reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema, Members)]
#[members(faults_of_temperatures)]
pub struct FrictionByTemperature {
    /// Temperatures in °C, rising.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(-273.15, 1e5, "°C"))]
    pub temperature_c: Vec<f64>,
    /// Coefficient at each temperature, 1e-12 to 100, never rising.
    #[schema(min_items = 2, max_items = 1000)]
    #[member(with = list, closed(1e-12, 100.0, ""))]
    pub coefficient: Vec<f64>,
}

/// A thin elastic layer between the bodies. Each of its points shears independently: it adds a displacement of thickness/modulus times the
/// traction. With `yield_mpa` it transmits at most that stress, which grows with its plastic displacement.
#[none_is_absent]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema, Members)]
#[members(faults_of_layer)]
pub struct Layer {
    /// Shear modulus in MPa, more than 0.
    #[member(positive(1e12, "MPa"))]
    pub shear_modulus_mpa: f64,
    /// Thickness in mm, more than 0.
    #[member(positive(1e3, "mm"))]
    pub thickness_mm: f64,
    /// Shear stress in MPa at which the layer yields, more than 0; default: it never yields.
    #[member(positive(1e9, "MPa"))]
    pub yield_mpa: Option<f64>,
    /// Growth of the yield stress in MPa per mm of plastic displacement, 0 or more; default 0.
    #[schema(minimum = 0.0)]
    #[member(closed(0.0, 1e9, "MPa/mm"))]
    pub hardening_mpa_per_mm: Option<f64>,
}

impl Friction {
    /// Returns the largest coefficient.
    pub fn largest(&self) -> f64 {
        let at_rest = |limit: f64| limit + self.terms.iter().map(|t| t.coefficient).sum::<f64>();
        let single = self.coefficient.or_else(|| self.limit.map(at_rest));
        let tables = [
            self.across.as_ref().map(|law| &law.coefficient),
            self.along.as_ref().map(|law| &law.coefficient),
            self.by_temperature.as_ref().map(|law| &law.coefficient),
        ];
        let listed = tables.into_iter().flatten().flatten();
        listed.fold(single.unwrap_or(0.0), |most, value| most.max(*value))
    }

    /// Returns the quantity with which the coefficient falls: `slip`, `temperature` or none.
    pub fn falls_with(&self) -> Option<&'static str> {
        match (self.law, &self.by_temperature) {
            (Some(_), _) => Some("slip"),
            (None, Some(_)) => Some("temperature"),
            (None, None) => None,
        }
    }

    /// Returns the coefficient if it is constant and the case has neither a layer nor a reduction factor.
    pub fn constant(&self) -> Option<f64> {
        let softer = self.layer.is_some() || self.reduction.is_some();
        self.coefficient.filter(|_| !softer)
    }
}

/// Smallest friction coefficient other than 0. With a smaller one, dimensionless motions would overflow.
pub(crate) const COEFFICIENT_LEAST: f64 = 1e-12;
/// The members that give a coefficient.
const LAWS: [&str; 5] = ["coefficient", "law", "across", "along", "by_temperature"];
/// The description of `terms` in faults.
const TERMS: &str = "an array of one or two objects with coefficient and half_speed_mm_per_s";

/// Refuses a coefficient that is given in no way or in several ways, and members that do not belong to the way in which it is given.
pub(crate) fn faults_of_friction(block: &mut Object, read: Option<&Friction>) -> Option<()> {
    let coefficient = AllowedRange::closed(0.0, 100.0, "");
    let falls = block.has("law");
    let law = block.exactly_one(&LAWS, |block| {
        block.required_number("coefficient", coefficient);
    });
    let mut sound = law.and_then(|law| match law {
        "law" if !block.has("limit") => block.required_number("limit", coefficient).map(|_| ()),
        "law" => block.required("terms", TERMS).map(|_| ()),
        _ => Some(()),
    });
    if !falls {
        for name in block.given(&["limit", "terms"]) {
            sound = block.refuse(name, "given without law, to which it belongs");
        }
    }
    sound?;
    let read = read?;
    let largest = read.largest();
    match read.coefficient {
        Some(given) if given > 0.0 && given < COEFFICIENT_LEAST => {
            let detail = format!("{given:e} given; 0 or at least {COEFFICIENT_LEAST:e} is needed");
            return block.refuse("coefficient", detail);
        }
        None if falls && !(COEFFICIENT_LEAST..=100.0).contains(&largest) => {
            return block.refuse_object(format!(
                "limit and terms add up to {largest}; the coefficient at rest must be a number from {COEFFICIENT_LEAST:e} to 100"
            ));
        }
        _ => {}
    }
    if falls && read.layer.is_some_and(|layer| layer.yield_mpa.is_some()) {
        let detail = "given with a layer that yields; friction that falls with slip goes with a layer that does not";
        return block.refuse("law", detail);
    }
    Some(())
}

/// Reads the terms of a coefficient that falls with slip speed.
pub(crate) fn terms(block: &mut Object, name: &str) -> Option<Vec<FallTerm>> {
    block.each(name, 1..=2, TERMS, FallTerm::read)
}

/// Refuses positions that are given in no way, in two ways or out of order.
pub(crate) fn faults_of_across(block: &mut Object, read: Option<&FrictionAcross>) -> Option<()> {
    let name = block.exactly_one(&["y_mm", "angle_rad"], |block| {
        block.required("y_mm", "an array of places in mm");
    })?;
    let read = read?;
    let places = read.y_mm.as_ref().or(read.angle_rad.as_ref())?;
    require_order(block, name, places, &read.coefficient)
}

/// Refuses positions that are out of order.
pub(crate) fn faults_of_along(block: &mut Object, read: Option<&FrictionAlong>) -> Option<()> {
    let read = read?;
    require_order(block, "x_mm", &read.x_mm, &read.coefficient)
}

/// Refuses decreasing positions, three equal positions, and a number of coefficients other than one per position.
fn require_order(
    block: &mut Object,
    name: &str,
    places: &[f64],
    coefficient: &[f64],
) -> Option<()> {
    require_equal_lengths(block, name, places.len(), coefficient.len())?;
    let falls = |k: usize| places[k] < places[k - 1];
    let is_third = |k: usize| k > 1 && places[k] == places[k - 2];
    let Some(k) = (1..places.len()).find(|k| falls(*k) || is_third(*k)) else {
        return Some(());
    };
    let (given, before) = (places[k], places[k - 1]);
    let detail = match falls(k) {
        true => format!(
            "{given} given after {before}; positions must increase; two equal positions form a jump of the coefficient"
        ),
        false => format!(
            "{given} given three times; two equal positions form a jump of the coefficient; three are not allowed"
        ),
    };
    block.refuse_element(name, k, detail)
}

/// Refuses a number of coefficients other than one per value of the member `name`.
fn require_equal_lengths(
    block: &mut Object,
    name: &str,
    places: usize,
    coefficients: usize,
) -> Option<()> {
    if places == coefficients {
        return Some(());
    }
    let detail = format!(
        "{coefficients} values given; one coefficient per {name} is needed, which are {places}"
    );
    block.refuse("coefficient", detail)
}

/// Refuses temperatures that do not rise and coefficients that rise.
pub(crate) fn faults_of_temperatures(
    block: &mut Object,
    read: Option<&FrictionByTemperature>,
) -> Option<()> {
    let FrictionByTemperature {
        temperature_c: temperature,
        coefficient,
    } = read?;
    require_equal_lengths(block, "temperature_c", temperature.len(), coefficient.len())?;
    if let Some(k) = temperature.windows(2).position(|pair| pair[1] <= pair[0]) {
        let [before, given] = [temperature[k], temperature[k + 1]];
        let detail = format!("{given} given after {before}; temperatures must rise");
        return block.refuse_element("temperature_c", k + 1, detail);
    }
    if let Some(k) = coefficient.windows(2).position(|pair| pair[1] > pair[0]) {
        let [before, given] = [coefficient[k], coefficient[k + 1]];
        let detail = format!(
            "{given} given after {before}; a coefficient that rises with temperature is not covered, because heat and friction may then drive each other"
        );
        return block.refuse_element("coefficient", k + 1, detail);
    }
    Some(())
}

/// Reads the numbers of a table.
pub(crate) fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Vec<f64>> {
    let (least, most) = (AXIS_POINTS.start(), AXIS_POINTS.end());
    let what = format!("an array of {least} to {most} numbers");
    block.number_array(name, AXIS_POINTS, &what, allowed)
}

/// Refuses hardening of a layer that does not yield.
pub(crate) fn faults_of_layer(block: &mut Object, _: Option<&Layer>) -> Option<()> {
    if block.has("hardening_mpa_per_mm") && !block.has("yield_mpa") {
        let detail = "given without yield_mpa, to which it belongs";
        return block.refuse("hardening_mpa_per_mm", detail);
    }
    Some(())
}
