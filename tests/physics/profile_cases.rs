//! Cases of wheels on rails, with the shapes and files of the Manchester benchmark.

use serde_json::{Value, json};

use crate::profile_reference_files::reference_file;
use crate::profile_shapes::{rail_60e1, s1002};

/// Returns a steel wheel on a steel rail with μ = 0.3, on the right side, placed as in the Manchester contact benchmark.
pub fn wheel_on_rail(rail: Value, wheel: Value, cant: f64) -> Value {
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": {
            "type": "profiles", "rail": rail, "wheel": wheel, "side": "right",
            "rolling_radius_mm": 460, "gauge_mm": 1435, "gauge_height_mm": 14, "cant_rad": cant,
            "flange_back_distance_mm": 1360, "flange_back_position_mm": -70,
        },
        "load": { "vertical_force_n": 75000 },
        "motion": { "creepage_x": 0.0, "creepage_y": 0.0, "spin_per_mm": 0.0 },
        "outputs": ["resultants"],
    })
}

/// Returns the case with its rail placed by the origin of its cross-section, in mm from the middle of the track. Shapes without a gauge face can
/// only be placed this way.
pub fn by_origin(mut case: Value, origin: f64) -> Value {
    let contact = case["contact"].as_object_mut().expect("a contact");
    contact.remove("gauge_mm");
    contact.remove("gauge_height_mm");
    contact.insert("rail_origin_mm".to_owned(), json!(origin));
    case
}

/// Returns S1002 on 60E1 inclined 1:40, generated from their definitions.
pub fn generated() -> Value {
    wheel_on_rail(
        json!({ "points_mm": rail_60e1() }),
        json!({ "points_mm": s1002() }),
        0.025,
    )
}

/// Returns the benchmark's own files, if available. The rail includes its inclination.
pub fn benchmark() -> Option<Value> {
    let file = |name: &str| Some(json!({ "format": "simpack", "text": reference_file(name)? }));
    Some(wheel_on_rail(
        file("profiles/MBench_UIC60_v3.prr")?,
        file("profiles/MBench_S1002_v3.prw")?,
        0.0,
    ))
}

/// Returns the case on planes of contact.
pub fn on_planes(case: &Value) -> Value {
    put(case, "contact", json!({ "reference_surface": "plane" }))
}

/// Returns the case with these members added to one of its objects.
pub fn put(case: &Value, object: &str, members: Value) -> Value {
    let mut case = case.clone();
    let target = case[object].as_object_mut().expect("an object");
    for (name, value) in members.as_object().expect("members") {
        target.insert(name.clone(), value.clone());
    }
    case
}
