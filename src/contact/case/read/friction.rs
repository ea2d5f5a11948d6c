//! Reads `friction`: a coefficient, a law that falls with slip or temperature or a coefficient across or along, and what lies between the bodies.

use crate::contact::case::read::object::{AllowedRange, Object, join};
use crate::contact::case::words::contact::{
    AcrossWords, AlongWords, ByTemperatureWords, FallName, FallTermWords, Friction, LayerWords,
};

const COEFFICIENT: AllowedRange = AllowedRange::closed(0.0, 100.0, "");
/// A smaller friction coefficient is refused unless it is 0: dimensionless motions would overflow.
pub(crate) const COEFFICIENT_LEAST: f64 = 1e-12;
const ACROSS: AllowedRange = AllowedRange::closed(COEFFICIENT_LEAST, 100.0, "");
const SPEED: AllowedRange = AllowedRange::positive(1e9, "mm/s");
const PLACE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const ANGLE: AllowedRange = AllowedRange::closed(-1.6, 1.6, "rad");
const MODULUS: AllowedRange = AllowedRange::positive(1e12, "MPa");
const THICKNESS: AllowedRange = AllowedRange::positive(1e3, "mm");
const REDUCTION: AllowedRange = AllowedRange::positive(1.0, "");
const TEMPERATURE: AllowedRange = AllowedRange::closed(-273.15, 1e5, "°C");
const YIELD: AllowedRange = AllowedRange::positive(1e9, "MPa");
const HARDENING: AllowedRange = AllowedRange::closed(0.0, 1e9, "MPa/mm");
/// Points of a coefficient across, along or by temperature.
const POINTS: std::ops::RangeInclusive<usize> = 2..=1000;
/// The ways to give a coefficient.
const WAYS: [&str; 5] = ["coefficient", "law", "across", "along", "by_temperature"];

/// Reads the required member `friction` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Friction> {
    let mut block = case.child("friction")?;
    let names = [&WAYS[..], &["limit", "terms", "layer", "reduction"]].concat();
    block.only(&names);
    let mut friction = match block.given(&WAYS)[..] {
        ["law"] => law(&mut block),
        ["across"] => across(&mut block).map(|across| Friction {
            across: Some(across),
            ..Friction::default()
        }),
        ["along"] => along(&mut block).map(|along| Friction {
            along: Some(along),
            ..Friction::default()
        }),
        ["by_temperature"] => by_temperature(&mut block).map(|law| Friction {
            by_temperature: Some(law),
            ..Friction::default()
        }),
        [] | [_] => constant(&mut block),
        [first, second, ..] => {
            block.exclude(first, second);
            None
        }
    };
    if !block.has("law") {
        for name in ["limit", "terms"] {
            if block.has(name) {
                block.fault(name, "given without law, to which it belongs");
                friction = None;
            }
        }
    }
    let layer = block.optional("layer", layer);
    let reduction = block.optional_number("reduction", REDUCTION);
    let yields = layer
        .flatten()
        .is_some_and(|layer| layer.yield_mpa.is_some());
    if yields && block.has("law") {
        let detail = "given with a layer that yields; friction that falls with slip goes with a layer that does not";
        block.fault("law", detail);
        return None;
    }
    Some(Friction {
        layer: layer?,
        reduction: reduction?,
        ..friction?
    })
}

fn constant(block: &mut Object) -> Option<Friction> {
    let coefficient = block.required_number("coefficient", COEFFICIENT)?;
    enough(block, "coefficient", coefficient)?;
    Some(Friction {
        coefficient: Some(coefficient),
        ..Friction::default()
    })
}

/// A coefficient is 0 or not too small.
fn enough(block: &mut Object, name: &str, coefficient: f64) -> Option<()> {
    if coefficient > 0.0 && coefficient < COEFFICIENT_LEAST {
        let detail =
            format!("{coefficient:e} given; 0 or at least {COEFFICIENT_LEAST:e} is needed");
        block.fault(name, detail);
        return None;
    }
    Some(())
}

fn law(block: &mut Object) -> Option<Friction> {
    let law = block.word("law", FallName::WORDS);
    let limit = block.required_number("limit", COEFFICIENT);
    let what = "an array of one or two objects with coefficient and half_speed_mm_per_s";
    block.required("terms", what)?;
    let elements = block.array("terms", 1..=2, what)?;
    let pointer = block.pointer_to("terms");
    let mut terms = Vec::new();
    for (k, element) in elements.iter().enumerate() {
        let term = Object::open(element, join(&pointer, k), block.faults());
        terms.push(term.and_then(|mut term| fall_term(&mut term)));
    }
    let friction = Friction {
        law: Some(law?),
        limit: Some(limit?),
        terms: terms.into_iter().collect::<Option<_>>()?,
        ..Friction::default()
    };
    let largest = friction.largest();
    if !(COEFFICIENT_LEAST..=100.0).contains(&largest) {
        block.fault_here(format!(
            "limit and terms add up to {largest}; the coefficient at rest has to be a number from {COEFFICIENT_LEAST:e} to 100"
        ));
        return None;
    }
    Some(friction)
}

fn fall_term(term: &mut Object) -> Option<FallTermWords> {
    term.only(&["coefficient", "half_speed_mm_per_s"]);
    let coefficient = term.required_number("coefficient", COEFFICIENT);
    let half_speed = term.required_number("half_speed_mm_per_s", SPEED);
    Some(FallTermWords {
        coefficient: coefficient?,
        half_speed_mm_per_s: half_speed?,
    })
}

fn across(block: &mut Object) -> Option<AcrossWords> {
    let mut across = block.child("across")?;
    across.only(&["y_mm", "angle_rad", "coefficient"]);
    let angles = across.has("angle_rad");
    if angles && across.has("y_mm") {
        across.exclude("y_mm", "angle_rad");
        return None;
    }
    let (name, allowed) = match angles {
        true => ("angle_rad", ANGLE),
        false => ("y_mm", PLACE),
    };
    let (places, coefficient) = places(&mut across, name, allowed)?;
    let places = Some(places);
    let (y_mm, angle_rad) = if angles {
        (None, places)
    } else {
        (places, None)
    };
    Some(AcrossWords {
        y_mm,
        angle_rad,
        coefficient,
    })
}

fn along(block: &mut Object) -> Option<AlongWords> {
    let mut along = block.child("along")?;
    along.only(&["x_mm", "coefficient"]);
    let (x_mm, coefficient) = places(&mut along, "x_mm", PLACE)?;
    Some(AlongWords { x_mm, coefficient })
}

/// Places in order, and as many coefficients.
fn places(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<(Vec<f64>, Vec<f64>)> {
    let places = list(block, name, allowed);
    let coefficient = list(block, "coefficient", ACROSS);
    let (places, coefficient) = (places?, coefficient?);
    as_many(block, name, places.len(), coefficient.len())?;
    let falls = |k: usize| places[k] < places[k - 1];
    let is_third = |k: usize| k > 1 && places[k] == places[k - 2];
    if let Some(k) = (1..places.len()).find(|k| falls(*k) || is_third(*k)) {
        let (given, before) = (places[k], places[k - 1]);
        let detail = match falls(k) {
            true => format!(
                "{given} given after {before}; places must increase, or be equal twice where the coefficient jumps"
            ),
            false => format!(
                "{given} given three times; two equal places are a jump of the coefficient, and no more may be equal"
            ),
        };
        let pointer = join(&block.pointer_to(name), k);
        block.faults().add(pointer, detail);
        return None;
    }
    Some((places, coefficient))
}

/// There is one coefficient for every place of a table.
fn as_many(block: &mut Object, name: &str, places: usize, coefficients: usize) -> Option<()> {
    if places == coefficients {
        return Some(());
    }
    let detail = format!(
        "{coefficients} values given; one coefficient per {name} is needed, which are {places}"
    );
    block.fault("coefficient", detail);
    None
}

fn by_temperature(block: &mut Object) -> Option<ByTemperatureWords> {
    let mut law = block.child("by_temperature")?;
    law.only(&["temperature_c", "coefficient"]);
    let temperature = list(&mut law, "temperature_c", TEMPERATURE);
    let coefficient = list(&mut law, "coefficient", ACROSS);
    let (temperature, coefficient) = (temperature?, coefficient?);
    as_many(
        &mut law,
        "temperature_c",
        temperature.len(),
        coefficient.len(),
    )?;
    if let Some(k) = temperature.windows(2).position(|pair| pair[1] <= pair[0]) {
        let pointer = join(&law.pointer_to("temperature_c"), k + 1);
        let [before, given] = [temperature[k], temperature[k + 1]];
        let detail = format!("{given} given after {before}; the temperatures have to rise");
        law.faults().add(pointer, detail);
        return None;
    }
    if let Some(k) = coefficient.windows(2).position(|pair| pair[1] > pair[0]) {
        let pointer = join(&law.pointer_to("coefficient"), k + 1);
        let [before, given] = [coefficient[k], coefficient[k + 1]];
        let detail = format!(
            "{given} given after {before}; a coefficient that rises with temperature is not covered, because heat and friction may then drive each other"
        );
        law.faults().add(pointer, detail);
        return None;
    }
    Some(ByTemperatureWords {
        temperature_c: temperature,
        coefficient,
    })
}

fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Vec<f64>> {
    let what = format!("an array of {} to {} numbers", POINTS.start(), POINTS.end());
    block.required(name, &what)?;
    let elements = block.array(name, POINTS, &what)?;
    block.numbers(name, elements, allowed)
}

fn layer(block: &mut Object, name: &str) -> Option<LayerWords> {
    let mut layer = block.child(name)?;
    let names = [
        "shear_modulus_mpa",
        "thickness_mm",
        "yield_mpa",
        "hardening_mpa_per_mm",
    ];
    layer.only(&names);
    let modulus = layer.required_number(names[0], MODULUS);
    let thickness = layer.required_number(names[1], THICKNESS);
    let stress = layer.optional_number(names[2], YIELD);
    let hardening = layer.optional_number(names[3], HARDENING);
    if layer.has(names[3]) && !layer.has(names[2]) {
        layer.fault(names[3], "given without yield_mpa, to which it belongs");
        return None;
    }
    Some(LayerWords {
        shear_modulus_mpa: modulus?,
        thickness_mm: thickness?,
        yield_mpa: stress?,
        hardening_mpa_per_mm: hardening?,
    })
}
