//! Redraws figures 3, 4 and 5 of Liu and Hsu's paper on a patch that is not symmetric about the rolling direction, from the examples
//! `api/examples/paper-figure-*.case.json` on a fine mesh.
//!
//! `cargo bench --bench figures` writes `docs/paper-figures/*.svg` and prints the values of the figures.

use std::path::Path;

use drawing::{Curve, Frame, Picture};
use examples::example;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::task::Motion;
use railhead_contact::solution::words::answer::{Fields, Solution};
use railhead_contact::{self, check, solve};
use serde_json::json;
use shape::sheet::Sheet;

#[path = "../drawing.rs"]
#[allow(dead_code, reason = "other pictures use the rest")]
mod drawing;
#[path = "../examples.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod examples;
#[path = "../../src/http/render/shape/mod.rs"]
#[allow(
    dead_code,
    unused_imports,
    reason = "the service uses and tests the rest"
)]
mod shape;

/// Mesh size that gives visually smooth borders.
const STRIPS: u32 = 44;
const CELLS: u32 = 56;

fn main() {
    // `cargo test --benches` also runs this program, and then it draws nothing.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/paper-figures");
    std::fs::create_dir_all(&folder).expect("a folder for the pictures");
    let write = |figure: u32, picture: Picture| {
        let path = folder.join(format!("figure-{figure}.svg"));
        std::fs::write(&path, picture.svg()).expect("a picture can be written");
        println!("{}\n", path.display());
    };
    write(3, borders(&Figure::new(3)));
    write(4, zones(&Figure::new(4)));
    write(5, forces(&Figure::new(5)));
}

/// An example solved on the fine mesh, with the paper's units.
struct Figure {
    solution: Solution,
    fields: Fields,
    /// Half length of the longest strip in mm.
    half_length: f64,
    /// μN in N.
    bound: f64,
    /// Creepage whose normalised value `E a² ν / (μN(1−σ²))` is 1.
    creepage: f64,
}

impl Figure {
    fn new(number: u32) -> Figure {
        let mut case = example(&format!("paper-figure-{number}"));
        case["solver"] = json!({ "mesh": { "strips": STRIPS, "cells": CELLS } });
        // The border between stick and slip is computed from the margin to the bound.
        case["outputs"] = json!(["resultants", "zones", "pressure", "tractions"]);
        let limits = Limits {
            memory_bytes: 8 << 30,
            ..Limits::default()
        };
        let checked = check(&case, &limits).expect("a valid case");
        let (solution, fields) = solve(&checked, &Unmonitored).expect("an answer");
        let lengths = solution.patches.iter().map(|patch| patch.extent_mm);
        let half_length = lengths.map(|e| 0.5 * (e[1] - e[0])).fold(0.0, f64::max);
        let forces = solution.patches.iter().map(|patch| patch.normal_force_n);
        let bound = checked.problem.friction.largest() * forces.sum::<f64>();
        // E/(1 − σ²) = 2 G/(1 − σ)
        let stiffness = 2.0 * checked.problem.elasticity.shear_modulus
            / (1.0 - checked.problem.elasticity.poisson_ratio);
        Figure {
            creepage: bound / (stiffness * half_length.powi(2)),
            solution,
            fields,
            half_length,
            bound,
        }
    }

    fn motions(&self) -> Vec<Motion> {
        let points = self.solution.patches[0].points.iter();
        points.map(|point| point.motion).collect()
    }

    /// Returns the paper's Φ of a motion.
    fn spin(&self, motion: &Motion) -> f64 {
        motion.spin_per_mm * self.half_length / self.creepage
    }

    fn patch(&self) -> Vec<Vec<[f64; 2]>> {
        let patches = self.fields.patches.iter();
        let sheets = patches.filter_map(|patch| Sheet::new(patch.cells(0)));
        sheets.map(|sheet| sheet.border()).collect()
    }

    /// Returns the borders of the stick zone.
    fn stick(&self, point: usize) -> Vec<Vec<[f64; 2]>> {
        let patches = self.fields.patches.iter();
        let borders = patches.filter_map(|patch| {
            let cells = patch.cells(point);
            Sheet::new(cells)?.stick(cells, &patch.points[point])
        });
        borders.flatten().collect()
    }

    fn frame(&self, [left, top]: [f64; 2], width: f64) -> Frame {
        let boxes = self.solution.patches.iter().map(|patch| patch.extent_mm);
        let of = |end: usize, pick: fn(f64, f64) -> f64, start: f64| {
            boxes.clone().map(|extent| extent[end]).fold(start, pick)
        };
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        let x = [of(0, f64::min, low), of(1, f64::max, high)];
        let y = [of(2, f64::min, low), of(3, f64::max, high)];
        let height = width * (y[1] - y[0]) / (x[1] - x[0]);
        Frame {
            x,
            y,
            logarithmic: false,
            left,
            right: left + width,
            bottom: top + height,
            top,
        }
    }

    fn tell(&self, point: usize) {
        let total = self.solution.total[point];
        let motion = &self.motions()[point];
        let stick: f64 = self.solution.patches.iter().fold(0.0, |sum, patch| {
            sum + patch.points[point].stick_area_mm2.unwrap_or(f64::NAN)
        });
        let area: f64 = self
            .solution
            .patches
            .iter()
            .map(|patch| patch.area_mm2)
            .sum();
        println!(
            "nu_x {:.3}, spin {:.3}: F_x {:+.4}, F_y {:+.4}, M_z {:+.4}, sticks {:.3}",
            motion.creepage_x / self.creepage,
            self.spin(motion),
            total.force_x_n / self.bound,
            total.force_y_n / self.bound,
            total.moment_z_n_mm / (self.bound * self.half_length),
            stick / area,
        );
    }
}

/// Draws figure 3: borders of the stick zone under one creepage and several spins.
fn borders(figure: &Figure) -> Picture {
    let motions = figure.motions();
    let mut picture = Picture::new(
        660.0,
        400.0,
        &format!(
            "Slip–stick borders at ν = {:.1}, by spin Φ",
            motions[0].creepage_x / figure.creepage
        ),
    );
    let frame = figure.frame([50.0, 50.0], 460.0);
    picture.axes(&frame, "x in mm, rolling to the right", "y in mm");
    for (k, motion) in motions.iter().enumerate() {
        figure.tell(k);
        let name = format!("Φ = {:.1}", figure.spin(motion));
        picture.loops(&frame, &figure.stick(k), Curve::Line(k));
        picture.key(540.0, 70.0 + 22.0 * k as f64, Curve::Line(k), &name);
    }
    picture.loops(&frame, &figure.patch(), Curve::Border);
    picture
}

/// Draws figure 4: both zones under pure spin.
fn zones(figure: &Figure) -> Picture {
    const ACROSS: usize = 4;
    let motions = figure.motions();
    let rows = motions.len().div_ceil(ACROSS) as f64;
    let mut picture = Picture::new(
        760.0,
        30.0 + 160.0 * rows,
        "Pure spin: stick (dark) and slip, by spin Φ",
    );
    for (k, motion) in motions.iter().enumerate() {
        figure.tell(k);
        let place = [
            20.0 + 185.0 * (k % ACROSS) as f64,
            64.0 + 160.0 * (k / ACROSS) as f64,
        ];
        let frame = figure.frame(place, 165.0);
        picture.loops(&frame, &figure.patch(), Curve::Slip);
        picture.loops(&frame, &figure.stick(k), Curve::Stick);
        picture.loops(&frame, &figure.patch(), Curve::Border);
        picture.text(
            [place[0] + 82.0, place[1] - 8.0],
            &format!("Φ = {:.2}", figure.spin(motion)),
        );
    }
    picture
}

/// Draws figure 5: force and moment against longitudinal creepage.
fn forces(figure: &Figure) -> Picture {
    let motions = figure.motions();
    let x: Vec<f64> = motions
        .iter()
        .map(|motion| motion.creepage_x / figure.creepage)
        .collect();
    let totals = &figure.solution.total;
    let force: Vec<f64> = totals.iter().map(|t| t.force_x_n / figure.bound).collect();
    let unit = figure.bound * figure.half_length;
    let moment: Vec<f64> = totals.iter().map(|t| t.moment_z_n_mm / unit).collect();
    for k in 0..x.len() {
        println!(
            "nu_x {:.3}: F_x {:.4}, M_z {:+.4}",
            x[k], force[k], moment[k]
        );
    }
    let mut picture = Picture::new(660.0, 400.0, "Force and moment under longitudinal creepage");
    let largest = moment.iter().fold(0.0_f64, |m, value| m.max(value.abs()));
    // The moment is small and has its own scale, on the right.
    let scale = 10.0_f64.powf(largest.log10().floor());
    let top = (largest / scale).ceil() * scale;
    let frame = |high: f64| Frame {
        x: [0.0, x[x.len() - 1]],
        y: [0.0, high],
        logarithmic: false,
        left: 60.0,
        right: 560.0,
        bottom: 340.0,
        top: 50.0,
    };
    picture.axes(&frame(1.0), "E a² ν_x / (μN (1 − σ²))", "F_x / μN");
    picture.right_axis(&frame(top), "M_z / (μN a)");
    let line = |y: &[f64]| -> Vec<[f64; 2]> { x.iter().zip(y).map(|(x, y)| [*x, *y]).collect() };
    picture.line(&frame(1.0), &line(&force), Curve::Line(0));
    picture.line(&frame(top), &line(&moment), Curve::Line(1));
    picture.key(400.0, 250.0, Curve::Line(0), "F_x, left");
    picture.key(400.0, 272.0, Curve::Line(1), "M_z, right");
    picture
}
