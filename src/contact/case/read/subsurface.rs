//! Reads `subsurface`: where stresses are asked for.

use serde_json::Value;

use crate::contact::case::read::object::{AllowedRange, Object, join, number, shown};
use crate::contact::case::words::solver::Output;
use crate::contact::case::words::subsurface::{
    BodyName, DepthLineAt, FoundPlace, GridAxis, PassageWords, StressGrid, SubsurfaceWords,
};

const COORDINATE: AllowedRange = AllowedRange::closed(-1e6, 1e6, "mm");
const DEPTH: AllowedRange = AllowedRange::closed(0.0, 1e6, "mm");
/// Steels have a few tenths.
const DANG_VAN_SLOPE: AllowedRange = AllowedRange::closed(0.0, 10.0, "");
/// Most points of one list or axis, before the limit of the service.
const COUNT_MAX: u32 = 1_000_000;
const PLACES: [&str; 3] = ["points_mm", "along_depth_at_mm", "plane"];

/// Reads the member `subsurface` of a case, which belongs to the output of that name; left out, it asks for the worst point.
///
/// The outer `None` says that a fault was found.
pub(crate) fn read(
    case: &mut Object,
    outputs: Option<&[Output]>,
) -> Option<Option<SubsurfaceWords>> {
    let wanted = outputs.is_none_or(|outputs| outputs.contains(&Output::Subsurface));
    if !case.has("subsurface") {
        return Some(wanted.then_some(SubsurfaceWords {
            points_mm: None,
            along_depth_at_mm: None,
            depths_mm: None,
            plane: None,
            body: BodyName::Lower,
            worst: true,
            passage: None,
        }));
    }
    if !wanted {
        let detail =
            "given without \"subsurface\" among the outputs; add it there or leave this out";
        case.fault("subsurface", detail);
        return None;
    }
    words(&mut case.child("subsurface")?).map(Some)
}

fn words(block: &mut Object) -> Option<SubsurfaceWords> {
    let names = [
        "points_mm",
        "along_depth_at_mm",
        "depths_mm",
        "plane",
        "body",
        "worst",
        "passage",
    ];
    block.only(&names);
    if let [first, second, ..] = block.given(&PLACES)[..] {
        let detail = format!("given together with {first}; at most one of the two is allowed");
        block.fault(second, detail);
        return None;
    }
    let points_mm = block.optional("points_mm", points);
    let along_depth_at_mm = block.optional("along_depth_at_mm", line_at);
    let depths_mm = block.optional("depths_mm", |block, name| list(block, name, DEPTH));
    let plane = block.optional("plane", |block, name| grid(&mut block.child(name)?));
    let body = block.optional_word("body", BodyName::WORDS);
    let worst = block.optional("worst", Object::flag);
    let passage = block.optional("passage", passage);
    match (block.has("along_depth_at_mm"), block.has("depths_mm")) {
        (true, false) => {
            block.required("depths_mm", "an array of depths in mm")?;
        }
        (false, true) => {
            let detail = "given without along_depth_at_mm; the depths belong to its line";
            block.fault("depths_mm", detail);
            return None;
        }
        _ => {}
    }
    Some(SubsurfaceWords {
        points_mm: points_mm?,
        along_depth_at_mm: along_depth_at_mm?,
        depths_mm: depths_mm?,
        plane: plane?,
        body: body?.unwrap_or_default(),
        worst: worst?.unwrap_or(true),
        passage: passage?,
    })
}

fn passage(block: &mut Object, name: &str) -> Option<PassageWords> {
    let mut block = block.child(name)?;
    block.only(&["dang_van_slope"]);
    let dang_van_slope = block.optional_number("dang_van_slope", DANG_VAN_SLOPE)?;
    Some(PassageWords { dang_van_slope })
}

fn grid(block: &mut Object) -> Option<StressGrid> {
    block.only(&["x_mm", "y_mm", "depths_mm"]);
    let x_mm = axis(block, "x_mm", COORDINATE);
    let y_mm = axis(block, "y_mm", COORDINATE);
    let depths_mm = axis(block, "depths_mm", DEPTH);
    Some(StressGrid {
        x_mm: x_mm?,
        y_mm: y_mm?,
        depths_mm: depths_mm?,
    })
}

fn points(block: &mut Object, name: &str) -> Option<Vec<[f64; 3]>> {
    let what = "an array of points [x, y, depth] in mm";
    let elements = block.array(name, 1..=usize::MAX, what)?;
    let pointer = block.pointer_to(name);
    let faults = block.faults();
    let mut read = Vec::with_capacity(elements.len());
    for (k, element) in elements.iter().enumerate() {
        let pointer = join(&pointer, k);
        let Some([x, y, depth]) = element.as_array().map(Vec::as_slice) else {
            faults.add(
                pointer,
                format!(
                    "{} given; three numbers [x, y, depth] in mm are needed",
                    shown(element)
                ),
            );
            continue;
        };
        let x = number(x, &join(&pointer, 0), COORDINATE, faults);
        let y = number(y, &join(&pointer, 1), COORDINATE, faults);
        let depth = number(depth, &join(&pointer, 2), DEPTH, faults);
        if let (Some(x), Some(y), Some(depth)) = (x, y, depth) {
            read.push([x, y, depth]);
        }
    }
    (read.len() == elements.len()).then_some(read)
}

fn line_at(block: &mut Object, name: &str) -> Option<DepthLineAt> {
    let value = block.value(name)?;
    if value.as_str() == Some("worst") {
        return Some(DepthLineAt::Found(FoundPlace::Worst));
    }
    let pointer = block.pointer_to(name);
    if let Some([x, y]) = value.as_array().map(Vec::as_slice) {
        let faults = block.faults();
        let x = number(x, &join(&pointer, 0), COORDINATE, faults);
        let y = number(y, &join(&pointer, 1), COORDINATE, faults);
        return Some(DepthLineAt::Place([x?, y?]));
    }
    block.mistaken(name, "[x, y] in mm or \"worst\"");
    None
}

fn list(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<Vec<f64>> {
    let elements = block.array(name, 1..=usize::MAX, "an array of numbers in mm")?;
    let pointer = block.pointer_to(name);
    let faults = block.faults();
    let one = |(k, value)| number(value, &join(&pointer, k), allowed, faults);
    let read: Vec<Option<f64>> = elements.iter().enumerate().map(one).collect();
    read.into_iter().collect()
}

fn axis(block: &mut Object, name: &str, allowed: AllowedRange) -> Option<GridAxis> {
    let what = "a number, an array of numbers or {\"from\", \"to\", \"points\"}";
    match block.required(name, what)? {
        Value::Array(_) => list(block, name, allowed).map(GridAxis::List),
        Value::Object(_) => {
            let (from, to, points) = block.child(name)?.range(allowed, 2, COUNT_MAX)?;
            Some(GridAxis::Spaced { from, to, points })
        }
        _ => block.number(name, allowed).map(GridAxis::One),
    }
}
