//! Reads `thermal`: what the bodies do with heat.

use crate::contact::case::read::faults::AllowedRange;
use crate::contact::case::read::object::Object;
use crate::contact::case::words::contact::{ThermalBodyWords, ThermalWords};
use crate::contact::case::words::friction::Friction;
use crate::contact::case::words::solver::Output;

const CONDUCTIVITY: AllowedRange = AllowedRange::positive(1e6, "W/(m K)");
const DENSITY: AllowedRange = AllowedRange::positive(1e6, "kg/m³");
const SPECIFIC_HEAT: AllowedRange = AllowedRange::positive(1e6, "J/(kg K)");
const BULK: AllowedRange = AllowedRange::closed(-273.15, 1e5, "°C");

/// Reads the member `thermal` of a case, which belongs to the output `temperature` and to friction that falls with temperature.
///
/// The outer `None` says that a fault was found.
pub(crate) fn read(
    case: &mut Object,
    outputs: Option<&[Output]>,
    friction: Option<&Friction>,
) -> Option<Option<ThermalWords>> {
    let heated = friction.is_some_and(|friction| friction.by_temperature.is_some());
    let wanted = heated || outputs.is_some_and(|outputs| outputs.contains(&Output::Temperature));
    if !case.has("thermal") {
        if wanted {
            case.required(
                "thermal",
                "an object with the thermal constants of the bodies",
            )?;
        }
        return Some(None);
    }
    if outputs.is_some() && friction.is_some() && !wanted {
        let detail =
            "given without \"temperature\" among the outputs; add it there or leave this out";
        case.fault("thermal", detail);
        return None;
    }
    let mut block = case.child("thermal")?;
    if !block.has("lower") && !block.has("upper") {
        return body(&mut block).map(|body| Some(ThermalWords::Same(body)));
    }
    block.only(&["lower", "upper"]);
    let lower = block.child("lower").and_then(|mut block| body(&mut block));
    let upper = block.child("upper").and_then(|mut block| body(&mut block));
    Some(Some(ThermalWords::Pair {
        lower: lower?,
        upper: upper?,
    }))
}

fn body(block: &mut Object) -> Option<ThermalBodyWords> {
    let names = [
        "conductivity_w_per_mk",
        "density_kg_per_m3",
        "specific_heat_j_per_kgk",
        "bulk_c",
    ];
    block.only(&names);
    let conductivity = block.required_number(names[0], CONDUCTIVITY);
    let density = block.required_number(names[1], DENSITY);
    let specific_heat = block.required_number(names[2], SPECIFIC_HEAT);
    let bulk = block.required_number(names[3], BULK);
    Some(ThermalBodyWords {
        conductivity_w_per_mk: conductivity?,
        density_kg_per_m3: density?,
        specific_heat_j_per_kgk: specific_heat?,
        bulk_c: bulk?,
    })
}
