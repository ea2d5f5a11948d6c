//! Reads `damage`: models, figures, and whether wear is wanted strip by strip.
//!
//! Reads `thermal`: what the bodies do with heat.

use serde_json::Value;

use crate::contact::case::read::object::{AllowedRange, Object, join, names, number, word};
use crate::contact::case::words::contact::{Friction, ThermalBodyWords, ThermalWords};
use crate::contact::case::words::solver::Output;
use crate::contact::case::words::subsurface::{
    ArchardFigures, DamageModel, DamageParameterWords, DamageSetName, DamageWords,
    OwnDamageFigures, UsfdFigures, WlrmFigures,
};

/// Evaluated where none is named: those whose figures are confirmed.
const DEFAULT_MODELS: [DamageModel; 2] = [DamageModel::TGamma, DamageModel::UsfdWear];
const DENSITY: AllowedRange = AllowedRange::positive(1e5, "kg/m³");
const STRESS: AllowedRange = AllowedRange::positive(1e6, "MPa");
const FIGURE: AllowedRange = AllowedRange::positive(1e12, "");

/// Reads the member `damage` of a case, which belongs to the output of that name; left out, it has the default models.
///
/// The outer `None` says that a fault was found. A method without fields gives no wear across.
pub(crate) fn read(
    case: &mut Object,
    outputs: Option<&[Output]>,
    without_fields: bool,
) -> Option<Option<DamageWords>> {
    let wanted = outputs.is_none_or(|outputs| outputs.contains(&Output::Damage));
    if !case.has("damage") {
        return Some(wanted.then(|| DamageWords {
            models: DEFAULT_MODELS.to_vec(),
            parameters: None,
            across: false,
        }));
    }
    if !wanted {
        let detail = "given without \"damage\" among the outputs; add it there or leave this out";
        case.fault("damage", detail);
        return None;
    }
    let mut block = case.child("damage")?;
    block.only(&["models", "parameters", "across"]);
    let models = block.optional("models", models);
    let parameters = block.optional("parameters", parameters);
    let across = block.optional("across", Object::flag);
    if without_fields && across == Some(Some(true)) {
        let detail =
            "true given; the method has no values per cell that wear across the patch is made from";
        block.fault("across", detail);
        return None;
    }
    Some(Some(DamageWords {
        models: models?.unwrap_or_else(|| DEFAULT_MODELS.to_vec()),
        parameters: parameters?,
        across: across?.unwrap_or(false),
    }))
}

fn models(block: &mut Object, name: &str) -> Option<Vec<DamageModel>> {
    let what = format!(
        "an array with at least one of {}",
        names(DamageModel::WORDS)
    );
    let elements = block.array(name, 1..=usize::MAX, &what)?;
    let pointer = block.pointer_to(name);
    let faults = block.faults();
    let one = |(k, element)| word(element, &join(&pointer, k), DamageModel::WORDS, faults);
    let read: Vec<Option<DamageModel>> = elements.iter().enumerate().map(one).collect();
    let mut models: Vec<DamageModel> = read.into_iter().collect::<Option<_>>()?;
    models.sort_unstable();
    models.dedup();
    Some(models)
}

fn parameters(block: &mut Object, name: &str) -> Option<DamageParameterWords> {
    if matches!(block.value(name)?, Value::Object(_)) {
        return own(&mut block.child(name)?).map(|own| DamageParameterWords::Own(Box::new(own)));
    }
    block
        .word(name, DamageSetName::WORDS)
        .map(DamageParameterWords::Named)
}

fn own(block: &mut Object) -> Option<OwnDamageFigures> {
    let names = [
        "density_kg_per_m3",
        "shear_yield_mpa",
        "hardness_mpa",
        "usfd",
        "archard",
        "wlrm",
    ];
    block.only(&names);
    let density = block.optional_number("density_kg_per_m3", DENSITY);
    let shear_yield = block.optional_number("shear_yield_mpa", STRESS);
    let hardness = block.optional_number("hardness_mpa", STRESS);
    let usfd = block.optional("usfd", |block, name| usfd(&mut block.child(name)?));
    let archard = block.optional("archard", |block, name| archard(&mut block.child(name)?));
    let wlrm = block.optional("wlrm", |block, name| wlrm(&mut block.child(name)?));
    Some(OwnDamageFigures {
        density_kg_per_m3: density?,
        shear_yield_mpa: shear_yield?,
        hardness_mpa: hardness?,
        usfd: usfd?,
        archard: archard?,
        wlrm: wlrm?,
    })
}

fn usfd(block: &mut Object) -> Option<UsfdFigures> {
    let names = [
        "mild_slope",
        "mild_until",
        "severe_until",
        "catastrophic_slope",
    ];
    block.only(&names);
    let [slope, mild, severe, steep] = names.map(|name| block.required_number(name, FIGURE));
    let figures = UsfdFigures {
        mild_slope: slope?,
        mild_until: mild?,
        severe_until: severe?,
        catastrophic_slope: steep?,
    };
    in_order(
        block,
        "severe_until",
        [figures.mild_until, figures.severe_until],
    )?;
    Some(figures)
}

fn archard(block: &mut Object) -> Option<ArchardFigures> {
    let names = [
        "mild",
        "severe",
        "seizure",
        "speeds_mm_per_s",
        "seizure_pressure",
    ];
    block.only(&names);
    let pairs = [0, 1, 2, 3].map(|k| pair(block, names[k]));
    let seizure_pressure = block.required_number(names[4], FIGURE);
    let [mild, severe, seizure, speeds_mm_per_s] = pairs;
    Some(ArchardFigures {
        mild: mild?,
        severe: severe?,
        seizure: seizure?,
        speeds_mm_per_s: speeds_mm_per_s?,
        seizure_pressure: seizure_pressure?,
    })
}

fn wlrm(block: &mut Object) -> Option<WlrmFigures> {
    let names = ["threshold_n", "peak_at_n", "zero_at_n", "peak"];
    block.only(&names);
    let [threshold, peak_at, zero_at, peak] = names.map(|name| block.required_number(name, FIGURE));
    let figures = WlrmFigures {
        threshold_n: threshold?,
        peak_at_n: peak_at?,
        zero_at_n: zero_at?,
        peak: peak?,
    };
    in_order(block, "peak_at_n", [figures.threshold_n, figures.peak_at_n])?;
    in_order(block, "zero_at_n", [figures.peak_at_n, figures.zero_at_n])?;
    Some(figures)
}

/// `[low, high]`, both more than 0, in order.
fn pair(block: &mut Object, name: &str) -> Option<[f64; 2]> {
    let value = block.required(name, "[low, high]")?;
    let pointer = block.pointer_to(name);
    let Some([low, high]) = value.as_array().map(Vec::as_slice) else {
        block.mistaken(name, "[low, high]");
        return None;
    };
    let faults = block.faults();
    let low = number(low, &join(&pointer, 0), FIGURE, faults);
    let high = number(high, &join(&pointer, 1), FIGURE, faults);
    let (low, high) = (low?, high?);
    if low > high {
        block.fault(
            name,
            format!("[{low}, {high}] given; the first may not be larger"),
        );
        return None;
    }
    Some([low, high])
}

fn in_order(block: &mut Object, name: &str, [before, after]: [f64; 2]) -> Option<()> {
    if before < after {
        return Some(());
    }
    block.fault(name, format!("{after} given; more than {before} is needed"));
    None
}

const CONDUCTIVITY: AllowedRange = AllowedRange::positive(1e6, "W/(m K)");
const MASS_DENSITY: AllowedRange = AllowedRange::positive(1e6, "kg/m³");
const SPECIFIC_HEAT: AllowedRange = AllowedRange::positive(1e6, "J/(kg K)");
const BULK: AllowedRange = AllowedRange::closed(-273.15, 1e5, "°C");

/// Reads the member `thermal` of a case, which belongs to the output `temperature` and to friction that falls with temperature.
///
/// The outer `None` says that a fault was found.
pub(crate) fn read_thermal(
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
    let density = block.required_number(names[1], MASS_DENSITY);
    let specific_heat = block.required_number(names[2], SPECIFIC_HEAT);
    let bulk = block.required_number(names[3], BULK);
    Some(ThermalBodyWords {
        conductivity_w_per_mk: conductivity?,
        density_kg_per_m3: density?,
        specific_heat_j_per_kgk: specific_heat?,
        bulk_c: bulk?,
    })
}
