//! Work, time and memory against the number of cells.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use railhead_contact::half_space::strip_operator::kind::Precision;
use railhead_contact::half_space::strip_operator::operator;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::normal_stage;
use railhead_contact::rolling::refinement::adapt;
use railhead_contact::rolling::refinement::interpolate::RefinementState;
use railhead_contact::rolling::refinement::on_mesh::MotionTask;
use serde_json::json;

use crate::plot::{Plot, Series};
use crate::questions::{problem, timed};

/// One mesh: cells, touched entries, seconds, bytes of the influence coefficients.
struct Size {
    cells: f64,
    work: f64,
    seconds: f64,
    bytes: f64,
}

pub fn section(lu: f64, pictures: &Path) -> String {
    let mut text = "## Growth with the number of cells\n\nCreepages and spin on a mirror-symmetric patch, explicit meshes, double precision, \
                    with the meshes of a half and a quarter of the cells that the estimate needs. *Work*: entries of the influence, and those that products \
                    touched on all meshes.\n\n| cells × strips | cells | work | LU | influence, MB |\n|---|---|---|---|---|\n"
        .to_owned();
    let mut sizes = Vec::new();
    for side in [16, 24, 32, 44, 64, 90, 100] {
        let checked = problem(&json!({
            "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
            "friction": { "coefficient": 0.3 },
            "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
            "load": { "normal_force_n": 100_000 },
            "motion": { "creepage_x": 0.001, "creepage_y": 0.0005, "spin_per_mm": 0.0004 },
            "solver": { "mesh": { "strips": side, "cells": side } },
            "outputs": ["resultants"],
        }));
        let seconds = timed(&checked, 3).1;
        let asked = MotionTask {
            index: 0,
            motion: checked.problem.motions[0],
        };
        let footprint = normal_stage::solve(&checked, &Unmonitored)
            .expect("a contact")
            .footprint;
        let task = checked.rolling_task(&footprint);
        let mut state = RefinementState::new(&task, &Arc::default());
        let point = adapt::solve(&task, &mut state, asked, &Unmonitored).expect("an answer");
        let cells = (side * side) as usize;
        let bytes = operator::bytes(cells, side as usize, true, Precision::Double) as f64;
        let size = Size {
            cells: cells as f64,
            work: bytes / 8.0 + point.work.entries as f64,
            seconds,
            bytes,
        };
        let _ = writeln!(
            text,
            "| {side} × {side} | {cells} | {:.3e} | {:.2} | {:.1} |",
            size.work,
            seconds / lu,
            bytes / 1e6
        );
        sizes.push(size);
    }
    let exponent = |value: fn(&Size) -> f64| {
        let large: Vec<&Size> = sizes.iter().filter(|s| s.cells > 1900.0).collect();
        let (first, last) = (large[0], large[large.len() - 1]);
        (value(last) / value(first)).ln() / (last.cells / first.cells).ln()
    };
    let _ = writeln!(
        text,
        "\nBetween {:.0} and {:.0} cells work grows as cells^{:.2}, time as cells^{:.2}, memory as cells^{:.2}. A case whose estimated \
         memory is beyond the limit is refused before it is queued.\n\n![growth](accuracy-and-speed/growth.svg)",
        sizes
            .iter()
            .map(|s| s.cells)
            .find(|c| *c > 1900.0)
            .unwrap_or(0.0),
        sizes[sizes.len() - 1].cells,
        exponent(|s| s.work),
        exponent(|s| s.seconds),
        exponent(|s| s.bytes)
    );
    let picture = plot(&sizes, lu).svg();
    std::fs::write(pictures.join("growth.svg"), picture).expect("a picture can be written");
    text
}

/// Returns a plot of time and memory against the number of cells.
fn plot(sizes: &[Size], lu: f64) -> Plot {
    let series = |name: &str, value: fn(&Size) -> f64, unit: f64| Series {
        name: name.to_owned(),
        points: sizes.iter().map(|s| (s.cells, value(s) / unit)).collect(),
    };
    Plot {
        title: "growth with the number of cells".to_owned(),
        x: "cells".to_owned(),
        y: "LU, MB".to_owned(),
        series: vec![
            series("time, LU", |s| s.seconds, lu),
            series("influence, MB", |s| s.bytes, 1e6),
        ],
    }
}
