//! Long sweeps: memory of creep maps at fixed spin, where every motion would prefer its own mesh, and sweeps with zones.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Instant;

use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::problem::checked_case::CheckedCase;
use railhead_contact::rolling::operator_store::OperatorStore;
use railhead_contact::{check, solve, solve_with};
use serde_json::{Value, json};

/// Numbers of motions along a side of the maps: 900 and 10 000 in all.
const SIDES: [u32; 2] = [30, 100];
const SPIN: f64 = 0.003;

fn case(motion: Value, target: f64, outputs: &Value) -> CheckedCase {
    let case = json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": motion,
        "solver": { "target_error": target },
        "outputs": outputs,
    });
    check(&case, &Limits::default()).expect("a valid case")
}

fn creep_map(side: u32) -> CheckedCase {
    let range = |reach: f64| json!({ "from": -reach * SPIN, "to": reach * SPIN, "points": side });
    let sweep = json!({
        "creepage_x": range(4.0),
        "creepage_y": range(5.5),
        "spin_per_mm": { "from": SPIN, "to": SPIN, "points": 1 },
        "combine": "grid",
    });
    case(json!({ "sweep": sweep }), 0.001, &json!(["resultants"]))
}

/// Returns a line of this process' status in MiB, or `None` where there is no such file.
fn status(name: &str) -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    let kibibytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes / 1024.0)
}

/// Resets the peak resident size.
fn forget_peak() {
    // This has no effect on systems other than Linux.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// Returns a table of memory, time and met targets of creep maps.
pub fn creep_maps() -> String {
    let mut text = "## Creep maps\n\nRadii 460 and 300 mm, 100 kN, μ 0.3, spin 0.003/mm, creepages whose pole lies inside the patch, target 0.001, resultants only. *Peak*:\n\
         resident memory above that of the idle process, the operator store of 128 MiB included.\n\n\
         | motions | target met | s | estimated s | peak MiB | afterwards | store MiB | estimated MiB, store of it |\n|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for side in SIDES {
        let idle = status("VmRSS:").unwrap_or(f64::NAN);
        forget_peak();
        let store = Arc::new(OperatorStore::default());
        let checked = creep_map(side);
        let began = Instant::now();
        let (solution, _) = solve_with(&store, &checked, &Unmonitored).expect("an answer");
        let seconds = began.elapsed().as_secs_f64();
        let peak = status("VmHWM:").unwrap_or(f64::NAN) - idle;
        let points = &solution.patches[0].points;
        let met = points.iter().filter(|p| p.target_met == Some(true)).count();
        let motions = points.len();
        drop(solution);
        let after = status("VmRSS:").unwrap_or(f64::NAN) - idle;
        let cost = checked.cost();
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let _ = writeln!(
            text,
            "| {motions} | {met} | {seconds:.1} | {:.1} | {peak:.0} | {after:.0} | {:.0} | {:.0}, {:.0} |",
            cost.seconds,
            mebibytes(store.bytes()),
            mebibytes(cost.bytes),
            mebibytes(cost.operator_store_bytes)
        );
    }
    text.push('\n');
    text
}

/// Checks that a request for values per cell changes only the stored fields.
pub fn with_zones() -> String {
    let mut text = "## Sweeps with zones\n\nThe same contact, seven longitudinal creepages to 0.006 at the same spin. *Apart*: largest distance of the sum of the tractions from the force, relative\n\
         to the estimated error.\n\n| target | met, resultants only | met, all outputs | forces differ | apart | meshes |\n|---|---|---|---|---|---|\n"
        .to_owned();
    let motions: Vec<Value> = (0..7)
        .map(|k| json!({ "creepage_x": 0.001 * f64::from(k), "spin_per_mm": SPIN }))
        .collect();
    for target in [0.02, 0.005, 0.002, 0.001] {
        let ask = |outputs: Value| {
            let checked = case(json!(motions), target, &outputs);
            solve(&checked, &Unmonitored).expect("an answer")
        };
        let (plain, _) = ask(json!(["resultants"]));
        let (full, fields) = ask(json!([
            "resultants",
            "zones",
            "tractions",
            "pressure",
            "slip"
        ]));
        let met = |solution: &railhead_contact::solution::words::answer::Solution| {
            let points = solution.patches[0].points.iter();
            points.filter(|p| p.target_met == Some(true)).count()
        };
        let differ = plain
            .total
            .iter()
            .zip(&full.total)
            .filter(|(a, b)| a != b)
            .count();
        let patch = &fields.patches[0];
        let apart = full.patches[0].points.iter().enumerate().map(|(k, point)| {
            let (cells, values) = (patch.cells(k), &patch.points[k]);
            let traction = values.traction_x_mpa.as_ref().expect("tractions");
            let areas = cells.dx_mm.iter().zip(&cells.dy_mm);
            let sum: f64 = traction
                .iter()
                .zip(areas)
                .map(|(t, (dx, dy))| t * dx * dy)
                .sum();
            let estimate = point.error_estimate.expect("an estimate").force_x_n;
            (sum - point.force_x_n).abs() / estimate
        });
        let apart = apart.fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "| {target} | {} | {} | {differ} | {apart:.2} | {} |",
            met(&plain),
            met(&full),
            patch.meshes.len()
        );
    }
    text.push('\n');
    text
}
