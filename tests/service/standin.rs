//! A check and an answer that need no physics.

use std::time::Duration;

use railhead::contact::case::{Method, Motion, Output};
use railhead::contact::error::{CaseError, Fault};
use railhead::contact::normal::Region;
use railhead::contact::normal::hertz::Ellipse;
use railhead::contact::problem::{Elasticity, Limits, Problem, Resolution};
use railhead::contact::solution::{
    CombinedMaterial, Fields, Origin, PatchFields, PointFields, Solution,
};
use railhead::contact::zones::Zone;
use serde_json::Value;

pub fn check(case: &Value, _limits: &Limits) -> Result<Problem, CaseError> {
    if case.get("material").is_none() {
        return Err(CaseError(vec![Fault {
            pointer: "/material".to_owned(),
            detail: "missing".to_owned(),
        }]));
    }
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    Ok(Problem {
        name: case.get("name").map(text),
        labels: case["labels"]
            .as_object()
            .into_iter()
            .flatten()
            .map(|(key, value)| (key.clone(), text(value)))
            .collect(),
        elasticity: Elasticity {
            shear_modulus: 82_000.0,
            poisson_ratio: 0.28,
            difference: 0.0,
        },
        friction: 0.3,
        region: Region::Ellipse(Ellipse {
            a: 6.0,
            b: 4.0,
            pressure_max: 1000.0,
            approach: 0.1,
        }),
        motions: vec![Motion {
            creepage_x: 0.001,
            creepage_y: 0.0,
            spin_per_mm: 0.0,
        }],
        method: Method::Auto,
        resolution: Resolution::Target(0.005),
        time_limit: case["solver"]["time_limit_s"]
            .as_f64()
            .map(Duration::from_secs_f64),
        outputs: vec![Output::Resultants],
        warnings: Vec::new(),
        digest: "00".to_owned(),
    })
}

pub fn answer() -> (Solution, Fields) {
    let solution = Solution {
        patches: Vec::new(),
        total: Vec::new(),
        warnings: vec!["a remark".to_owned()],
        origin: Origin {
            x_mm: 0.0,
            y_mm: 0.0,
            meaning: "contact centre".to_owned(),
        },
        frame: "x along rolling".to_owned(),
        material: CombinedMaterial {
            shear_modulus_mpa: 82_000.0,
            poisson_ratio: 0.28,
            difference_parameter: 0.0,
        },
        solver_version: "0".to_owned(),
        case_digest: "00".to_owned(),
    };
    let point = PointFields {
        zone: Some(vec![Zone::Slip, Zone::Stick]),
        traction_x_mpa: Some(vec![1.0, 0.1 + 0.2]),
        ..PointFields::default()
    };
    let patch = PatchFields {
        x_mm: vec![-1.0, 1.0],
        y_mm: vec![0.0, 0.0],
        dx_mm: vec![2.0, 2.0],
        dy_mm: vec![1.0, 1.0],
        strip: vec![0, 0],
        pressure_mpa: None,
        points: vec![point],
    };
    (
        solution,
        Fields {
            patches: vec![patch],
        },
    )
}
