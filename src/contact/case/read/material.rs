//! Reads `material`: one set of elastic constants, or one for each body.

use crate::contact::case::read::faults::AllowedRange;
use crate::contact::case::read::object::Object;
use crate::contact::case::words::material::{Elastic, Material};

const MODULUS: AllowedRange = AllowedRange::positive(1e12, "MPa");
const POISSON_RATIO: AllowedRange = AllowedRange::closed(0.0, 0.5, "");

/// Reads the required member `material` of a case.
pub(crate) fn read(case: &mut Object) -> Option<Material> {
    let mut block = case.child("material")?;
    if !block.has("lower") && !block.has("upper") {
        return elastic(&mut block).map(Material::Same);
    }
    block.only(&["lower", "upper"]);
    let lower = block.child("lower").and_then(|mut body| elastic(&mut body));
    let upper = block.child("upper").and_then(|mut body| elastic(&mut body));
    Some(Material::Pair {
        lower: lower?,
        upper: upper?,
    })
}

fn elastic(block: &mut Object) -> Option<Elastic> {
    block.only(&["shear_modulus_mpa", "young_modulus_mpa", "poisson_ratio"]);
    let shear_modulus_mpa = block.number("shear_modulus_mpa", MODULUS);
    let young_modulus_mpa = block.number("young_modulus_mpa", MODULUS);
    let poisson_ratio = block.required_number("poisson_ratio", POISSON_RATIO);
    match (
        block.has("shear_modulus_mpa"),
        block.has("young_modulus_mpa"),
    ) {
        (false, false) => {
            block.fault(
                "shear_modulus_mpa",
                format!("missing; {MODULUS} is needed, or young_modulus_mpa instead"),
            );
            return None;
        }
        (true, true) => {
            block.exclude("shear_modulus_mpa", "young_modulus_mpa");
            return None;
        }
        _ => {}
    }
    shear_modulus_mpa.or(young_modulus_mpa)?;
    Some(Elastic {
        shear_modulus_mpa,
        young_modulus_mpa,
        poisson_ratio: poisson_ratio?,
    })
}
