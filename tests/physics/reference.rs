//! Stored reference results, the cases that reproduce them, and functions that solve a case for its forces.

use std::path::Path;

use railhead_contact as contact;
use railhead_contact::case::solver::Limits;
use railhead_contact::monitor::Unmonitored;
use railhead_contact::solution::words::answer::{Fields, PointSolution, Solution};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// The five classes of partial slip on an ellipse, with 62 cases.
pub const HERTZ_CLASSES: [&str; 5] = [
    "hertz_long",
    "hertz_lat",
    "hertz_spin",
    "hertz_longspin",
    "hertz_xyspin",
];

/// A limit for vanishing element size and its uncertainty, relative to μN (moment: μN√(ab)).
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Converged {
    pub value: f64,
    pub unc: f64,
}

/// A reference rolling contact, with fields and signs as in `tests/data/README.md`.
#[derive(Debug, Clone, Deserialize)]
pub struct ReferenceCase {
    pub id: String,
    pub a_mm: f64,
    pub b_mm: Option<f64>,
    pub normal_force_n: f64,
    pub friction: f64,
    pub shear_modulus_mpa: f64,
    pub poisson_ratio: f64,
    pub creepage_x: f64,
    pub creepage_y: f64,
    pub spin_per_mm: f64,
    pub force_x: Converged,
    pub force_y: Converged,
    pub moment_z: Converged,
    pub kalker: Option<serde_json::Map<String, Value>>,
    pub pressure_max_mpa: Option<f64>,
    pub carter_force_x: Option<f64>,
}

impl ReferenceCase {
    /// Returns the semi-axis across rolling of an elliptic patch.
    pub fn b(&self) -> f64 {
        self.b_mm.expect("an elliptic patch has two semi-axes")
    }

    /// Returns the ratio of the semi-axis along rolling to that across.
    pub fn a_over_b(&self) -> f64 {
        self.a_mm / self.b()
    }

    /// Returns the converged F_x, F_y and M_z.
    pub fn converged(&self) -> [Converged; 3] {
        [self.force_x, self.force_y, self.moment_z]
    }

    /// Returns the same contact as an ellipse that can be solved.
    pub fn ellipse(&self) -> Ellipse {
        Ellipse {
            a_mm: self.a_mm,
            b_mm: self.b(),
            normal_force_n: self.normal_force_n,
            friction: self.friction,
            shear_modulus_mpa: self.shear_modulus_mpa,
            poisson_ratio: self.poisson_ratio,
            motion: [self.creepage_x, self.creepage_y, self.spin_per_mm],
        }
    }
}

/// A reference ellipse: the common part of records that each add a question and its results.
#[derive(Debug, Clone, Deserialize)]
pub struct SolvedEllipse {
    pub id: String,
    semi_axes_mm: [f64; 2],
    normal_force_n: f64,
    friction: f64,
    shear_modulus_mpa: f64,
    poisson_ratio: f64,
}

impl SolvedEllipse {
    /// Returns μN in N.
    pub fn limit(&self) -> f64 {
        self.friction * self.normal_force_n
    }

    /// Returns the contact as a client would give it with a motion, at default settings.
    pub fn case(&self, motion: &Value) -> Value {
        let [a, b] = self.semi_axes_mm;
        json!({
            "material": { "shear_modulus_mpa": self.shear_modulus_mpa, "poisson_ratio": self.poisson_ratio },
            "friction": { "coefficient": self.friction },
            "contact": { "type": "ellipse", "a_mm": a, "b_mm": b },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": motion,
        })
    }

    /// Returns the resultants of a point relative to μN and μN√(ab).
    pub fn relative(&self, point: &PointSolution) -> [f64; 3] {
        let [a, b] = self.semi_axes_mm;
        let forces = [
            point.force_x_n,
            point.force_y_n,
            point.moment_z_n_mm / (a * b).sqrt(),
        ];
        forces.map(|force| force / self.limit())
    }
}

/// Reads a file of `tests/data`.
pub fn read<T: DeserializeOwned>(name: &str) -> T {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
        .join("tests/data")
        .join(name);
    let text = std::fs::read_to_string(&path)
        .unwrap_or_else(|e| panic!("cannot read {}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Returns all cases of one class.
pub fn cases(class: &str) -> Vec<ReferenceCase> {
    read(&format!("{class}.json"))
}

/// An elliptic contact for the tests.
#[derive(Debug, Clone, Copy)]
pub struct Ellipse {
    pub a_mm: f64,
    pub b_mm: f64,
    pub normal_force_n: f64,
    pub friction: f64,
    pub shear_modulus_mpa: f64,
    pub poisson_ratio: f64,
    /// Creepages and spin in 1/mm.
    pub motion: [f64; 3],
}

impl Ellipse {
    /// Returns a steel patch with 60 kN, μ = 0.3 and √(ab) = 5 mm.
    pub fn steel(a_over_b: f64, poisson_ratio: f64) -> Ellipse {
        Ellipse {
            a_mm: 5.0 * a_over_b.sqrt(),
            b_mm: 5.0 / a_over_b.sqrt(),
            normal_force_n: 60_000.0,
            friction: 0.3,
            shear_modulus_mpa: 82_000.0,
            poisson_ratio,
            motion: [0.0; 3],
        }
    }

    /// Returns the same contact with another motion.
    pub fn moving(self, creepage_x: f64, creepage_y: f64, spin_per_mm: f64) -> Ellipse {
        Ellipse {
            motion: [creepage_x, creepage_y, spin_per_mm],
            ..self
        }
    }

    /// Returns the same contact with creepages and spin in the dimensionless form E c² ν/(μN(1−ν²)) and E c³ φ/(μN(1−ν²)), c = √(ab).
    pub fn normalised(self, x: f64, y: f64, spin: f64) -> Ellipse {
        let unit = self.limit() * (1.0 - self.poisson_ratio)
            / (2.0 * self.shear_modulus_mpa * self.c().powi(2));
        self.moving(x * unit, y * unit, spin * unit / self.c())
    }

    /// Returns √(ab) in mm.
    pub fn c(&self) -> f64 {
        (self.a_mm * self.b_mm).sqrt()
    }

    /// Returns μN in N.
    pub fn limit(&self) -> f64 {
        self.friction * self.normal_force_n
    }

    /// Returns Hertz's largest pressure in MPa.
    pub fn pressure_max(&self) -> f64 {
        1.5 * self.normal_force_n / (std::f64::consts::PI * self.a_mm * self.b_mm)
    }

    /// Returns the case as a client would write it, with all outputs.
    pub fn case(&self, strips: u32, cells: u32) -> Value {
        json!({
            "material": { "shear_modulus_mpa": self.shear_modulus_mpa, "poisson_ratio": self.poisson_ratio },
            "friction": { "coefficient": self.friction },
            "contact": { "type": "ellipse", "a_mm": self.a_mm, "b_mm": self.b_mm },
            "load": { "normal_force_n": self.normal_force_n },
            "motion": {
                "creepage_x": self.motion[0], "creepage_y": self.motion[1], "spin_per_mm": self.motion[2]
            },
            "solver": { "method": "boundary_element", "mesh": { "strips": strips, "cells": cells } },
            "outputs": ["resultants", "zones", "tractions", "pressure", "slip"],
        })
    }

    /// Returns F_x/μN, F_y/μN and M_z/(μN√(ab)).
    pub fn forces(&self, strips: u32, cells: u32) -> [f64; 3] {
        self.relative(&solve(&self.case(strips, cells)).0.patches[0].points[0])
    }

    /// Returns the resultants of a point relative to μN and μN√(ab).
    pub fn relative(&self, point: &PointSolution) -> [f64; 3] {
        let limit = self.limit();
        [
            point.force_x_n / limit,
            point.force_y_n / limit,
            point.moment_z_n_mm / (limit * self.c()),
        ]
    }
}

/// Checks and solves a case that has an answer.
pub fn solve(case: &Value) -> (Solution, Fields) {
    let checked =
        contact::check(case, &Limits::default()).unwrap_or_else(|e| panic!("{e}\n{case}"));
    contact::solve(&checked, &Unmonitored).unwrap_or_else(|e| panic!("{e}\n{case}"))
}

/// Solves a case with the boundary-element method.
pub fn solve_on_meshes(case: &Value) -> (Solution, Fields) {
    let mut case = case.clone();
    case["solver"]["method"] = "boundary_element".into();
    solve(&case)
}

/// Returns the median, or the lower of the two middle values.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(sorted.len() - 1) / 2]
}

/// Fails with one line per entry, unless the list is empty.
pub fn assert_none(what: &str, failures: &[String]) {
    assert!(
        failures.is_empty(),
        "{what}: {} of them\n{}",
        failures.len(),
        failures.join("\n")
    );
}

/// Returns the forces in N that the cells of the first patch carry in motion `k`: the sums of tractions times areas, along x and along y.
pub fn force_of_cells(fields: &Fields, k: usize) -> [f64; 2] {
    let patch = &fields.patches[0];
    let (cells, values) = (patch.cells(k), &patch.points[k]);
    [&values.traction_x_mpa, &values.traction_y_mpa].map(|traction| {
        let areas = cells.dx_mm.iter().zip(&cells.dy_mm);
        let pairs = traction.as_ref().expect("tractions").iter().zip(areas);
        pairs.map(|(t, (dx, dy))| t * dx * dy).sum()
    })
}
