//! Tests case of the Manchester contact benchmark, given as cases: 10 kN, with profiles generated from their definitions.

use railhead_contact::solution::words::answer::{PatchSolution, Position};
use serde_json::json;

use crate::profile_cases::{generated, put};
use crate::profile_geometry::{self, MANCHESTER, RAIL_ORIGIN, placement, roll};
use crate::reference::{assert_none, solve};
use railhead_contact::geometry::wheel_rail::Placement;

/// Returns the allowed distance of the load centre from the benchmark's point, which is the mean overlap. The two differ on the flat top of the rail
/// and where tread and corner touch together.
fn allowed(shift: f64) -> f64 {
    match shift {
        0.0 => 0.6,
        5.0 => 1.2,
        _ => 0.3,
    }
}

#[test]
fn patches_jump_from_tread_to_gauge_corner_to_flange_where_the_benchmark_says() {
    let profiles = profile_geometry::generated();
    let mut failures = Vec::new();
    for [shift, yaw, place, _] in MANCHESTER {
        let unrolled = Placement {
            lateral_shift: -shift,
            yaw: -yaw * 1e-3,
            cant: 0.025,
            ..placement()
        };
        let members = json!({
            "lateral_shift_mm": -shift, "yaw_rad": -yaw * 1e-3, "roll_rad": roll(&profiles, unrolled),
        });
        let mut case = put(&generated(), "contact", members);
        case["load"] = json!({ "vertical_force_n": 10_000 });
        let (solution, _) = solve(&case);
        let heaviest = solution
            .patches
            .iter()
            .max_by(|a, b| a.normal_force_n.total_cmp(&b.normal_force_n));
        let heaviest = heaviest.expect("a patch");
        let position = |patch: &PatchSolution| -> Position { patch.position.expect("a position") };
        let force: f64 = solution.patches.iter().map(|p| p.normal_force_n).sum();
        let weighted = |p: &PatchSolution| p.normal_force_n * position(p).track_mm[1];
        let found = -solution.patches.iter().map(weighted).sum::<f64>() / force - RAIL_ORIGIN;
        if (found - place).abs() > allowed(shift) {
            failures.push(format!("shift {shift}: {found} against {place}"));
        }
        let angle = position(heaviest).contact_angle_rad;
        let (region, expected) = match shift {
            ..4.5 => ("tread", -0.2..0.0),
            4.5..6.25 => ("gauge corner", -0.5..-0.25),
            _ => ("flange", -1.2..-0.6),
        };
        if !expected.contains(&angle) {
            failures.push(format!("shift {shift}: {angle} rad is not the {region}"));
        }
    }
    assert_none("load_mismatch", &failures);
}
