//! Does the real process stay within its memory? Resident sizes are read from Linux' process table; elsewhere these tests have
//! nothing to read and are not compiled.

use std::process::Stdio;
use std::time::Duration;

use serde_json::{Value, json};

use crate::support::railhead;

/// Creepages whose spin pole lies on a grid inside the patch, at fixed spin: every motion would like a mesh of its own.
fn creep_map(side: u32) -> Value {
    let spin = 0.003;
    let ranges =
        |low: f64, high: f64| json!({ "from": low * spin, "to": high * spin, "points": side });
    json!({
        "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
        "friction": { "coefficient": 0.3 },
        "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
        "load": { "normal_force_n": 100_000 },
        "motion": { "sweep": { "creepage_x": ranges(-4.0, 4.0), "creepage_y": ranges(-5.5, 5.5),
                               "spin_per_mm": { "from": spin, "to": spin, "points": 1 }, "combine": "grid" } },
        "solver": { "target_error": 0.001 },
        "outputs": ["resultants"],
    })
}

/// The largest resident size of a process so far, in bytes.
fn peak(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kibibytes << 10)
}

/// Solves a case with the real program; the largest resident size that was seen.
fn peak_of(case: &Value) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("case.json");
    std::fs::write(&file, case.to_string()).unwrap();
    let mut child = railhead()
        .args(["solve", "--operator-store-mb", "16"])
        .arg(&file)
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let mut most = 0;
    while child.try_wait().unwrap().is_none() {
        most = most.max(peak(child.id()).unwrap_or(0));
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(child.wait().unwrap().success());
    most
}

#[test]
fn a_creep_map_needs_hardly_more_memory_than_four_motions() {
    let (four, map) = (peak_of(&creep_map(2)), peak_of(&creep_map(11)));
    assert!(four > 1 << 20, "{four} bytes were seen");
    // Operators of the 121 motions would be about 600 MB.
    let more = map.saturating_sub(four);
    assert!(
        more < 160 << 20,
        "{} MiB more than for four motions",
        more >> 20
    );
}
