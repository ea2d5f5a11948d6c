//! Tests that a wheel reaches equilibrium in any position on its rail, or that the reason is given.

use railhead_contact::case::solver::Limits;
use railhead_contact::error::SolveError;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::remark::kind::Figure;
use railhead_contact::{check, solve};
use serde_json::json;

use crate::profile_cases::{generated, put};
use crate::random::Random;

const COUNT: usize = 60;

#[test]
fn random_wheelsets_are_balanced_or_refused_with_a_reason() {
    let mut random = Random(76_543);
    let mut balanced = 0;
    for k in 0..COUNT {
        let side = if k % 2 == 0 { "left" } else { "right" };
        let members = json!({
            "side": side,
            "lateral_shift_mm": random.between(-9.0, 9.0),
            "yaw_rad": random.between(-0.03, 0.03),
            "roll_rad": random.between(-1e-3, 1e-3),
            "cant_rad": 0.025 * f64::from(u32::try_from(k % 3).expect("small")),
        });
        let mut case = put(&generated(), "contact", members);
        let force = random.decades(1e2, 1.5e5);
        case["load"] = json!({ "vertical_force_n": force });
        case["friction"] = json!({ "coefficient": random.between(0.0, 0.6) });
        case["motion"] =
            json!({ "wheelset": { "speed_mm_per_s": 20000, "free_rolling_radius_mm": 460 } });
        let checked = check(&case, &Limits::default()).unwrap_or_else(|e| panic!("{k}: {e}"));
        let solution = match solve(&checked, &Unmonitored) {
            Ok((solution, _)) => solution,
            Err(SolveError::NormalProblem { reason }) => {
                let known = ["end of a profile", "come to balance"];
                assert!(
                    known.iter().any(|part| reason.contains(part)),
                    "{k}: {reason}"
                );
                continue;
            }
            Err(other) => panic!("{k}: {other}"),
        };
        let total = solution.total[0];
        let vertical = -total.force_z_n.expect("a vertical force");
        // A wheel that is wedged with a hundred times its load may reach the iteration limit. The remark then states the remaining error.
        let rounds = solution
            .remarks
            .iter()
            .find(|remark| remark.code == "iteration-inexact")
            .map(|remark| &remark.figures["residual"]);
        let told = match rounds {
            Some(Figure::Number(residual)) => 1.1 * residual,
            _ => 0.0,
        };
        assert!(
            (vertical / force - 1.0).abs() < told.max(1e-3),
            "{k}: {vertical} for {force}"
        );
        for patch in &solution.patches {
            assert!(patch.normal_force_n > 0.0 && patch.area_mm2 > 0.0, "{k}");
            assert!(
                patch.approach_mm.is_some_and(|approach| approach > 0.0),
                "{k}"
            );
            let position = patch.position.expect("a position");
            let sign = if side == "left" { 1.0 } else { -1.0 };
            assert!(
                (700.0..800.0).contains(&(sign * position.track_mm[1])),
                "{k}: {position:?}"
            );
            // The distance of the two surfaces is the overlap of the bodies.
            let on_wheel = position.rolling_radius_mm - 460.0 - position.wheel_mm[1];
            assert!(on_wheel.abs() < 1e-9, "{k}: {position:?}");
        }
        let normal = solution.normal.expect("a report");
        assert!(normal.residual <= 1e-2, "{k}: {normal:?}");
        balanced += 1;
    }
    assert!(10 * balanced >= 9 * COUNT, "{balanced} of {COUNT}");
}
