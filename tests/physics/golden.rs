//! The kernels and the discrete equations against stored values of an independent prototype.

use std::f64::consts::PI;

use railhead::contact::case::Motion;
use railhead::contact::influence::coefficients::{Rectangle, rectangle};
use railhead::contact::influence::strips::{Differences, Parity, Precision};
use railhead::contact::mesh::{Chord, Grading, Mesh, equal_strips};
use railhead::contact::monitor::Unwatched;
use railhead::contact::tangential::boundary_element::newton::{FrictionLaw, Newton};
use railhead::contact::tangential::equations::Equations;
use railhead::contact::tangential::rules::Rule;
use serde::Deserialize;

use crate::reference::{assert_none, read};

/// Units of the stored solutions: E/(1−ν²) = 1 and ν = ¼, so G = (1−ν)/2.
const POISSON: f64 = 0.25;
const SHEAR_MODULUS: f64 = 0.375;

#[derive(Deserialize)]
struct Golden {
    influence: Vec<InfluenceValue>,
    solver: Vec<Solution>,
}

#[derive(Deserialize)]
struct InfluenceValue {
    x: f64,
    y: f64,
    cell: [f64; 4],
    poisson_ratio: f64,
    shear_modulus: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

#[derive(Deserialize)]
struct Solution {
    region: String,
    rule: String,
    motion: [f64; 3],
    force_x: f64,
    force_y: f64,
    moment_z: f64,
    stick_cells: Option<usize>,
    #[serde(rename = "sum_pA")]
    load: Option<f64>,
    dissipation: Option<f64>,
}

/// A region of the stored solutions on 6 strips of 5 equal cells, pressure at the centres.
struct Region {
    mesh: Mesh,
    pressure: Vec<f64>,
    area: Vec<f64>,
}

impl Region {
    fn new(name: &str) -> Region {
        let (low, high, peak) = match name {
            "circle" => (-1.0, 1.0, 1.5 / PI),
            "long_ellipse" => (-0.3, 0.3, 1.5 / (0.3 * PI)),
            "egg" => (-1.4, 0.7, 1.5 / (1.05 * PI)),
            other => panic!("no region {other}"),
        };
        let half = |y: f64| (1.0 - (y / if y > 0.0 { high } else { -low }).powi(2)).sqrt();
        let chords: Vec<Chord> = equal_strips(low, high, 6)
            .into_iter()
            .enumerate()
            .map(|(strip, (y, dy))| Chord {
                patch: 0,
                strip,
                y,
                dy,
                left: -half(y),
                right: half(y),
            })
            .collect();
        let mesh = Mesh::new(&chords, &Grading::uniform(5));
        let level = |x: f64, y: f64| half(y).powi(2) - x * x;
        let pressure = mesh
            .node
            .iter()
            .zip(mesh.rows())
            .map(|(&x, y)| peak * level(x, y).sqrt())
            .collect();
        Region {
            area: mesh.areas(),
            mesh,
            pressure,
        }
    }

    /// F_x, F_y, M_z, dissipation, sticking cells.
    fn solve(&self, rule: Rule, motion: [f64; 3], differences: &Differences) -> ([f64; 4], usize) {
        let [creepage_x, creepage_y, spin_per_mm] = motion;
        let motion = Motion {
            creepage_x,
            creepage_y,
            spin_per_mm,
        };
        let equations = Equations::new(rule, &self.mesh, differences, None);
        let padded = equations.padded();
        // Slips of the equations are in units of traction over G.
        let rigid: Vec<f64> = equations
            .rigid(&motion)
            .iter()
            .map(|w| SHEAR_MODULUS * w)
            .collect();
        let resized = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(padded, 0.0);
            values
        };
        let (bound, area) = (resized(&self.pressure), resized(&self.area));
        let mut newton = Newton::new(&equations);
        let largest = rigid.iter().fold(0.0f64, |m, w| m.max(w.abs()));
        let law = FrictionLaw {
            rigid: &rigid,
            bound: &bound,
            area: &area,
            scale: (largest * newton.compliance()).min(1.0),
            tolerance: 1e-12,
        };
        let mut t = vec![0.0; 2 * padded];
        let report = newton
            .solve(&law, &mut t, &Unwatched)
            .expect("nobody stops the solve");
        assert!(report.converged, "{rule:?} {motion:?}: {report:?}");
        let (tx, ty) = t.split_at(padded);
        let (sx, sy) = newton.slip().split_at(padded);
        let y = self.mesh.rows();
        let sum = |f: &dyn Fn(usize) -> f64| {
            (0..self.area.len())
                .map(|i| f(i) * self.area[i])
                .sum::<f64>()
        };
        let sums = [
            sum(&|i| tx[i]),
            sum(&|i| ty[i]),
            sum(&|i| self.mesh.node[i] * ty[i] - y[i] * tx[i]),
            sum(&|i| (tx[i] * sx[i] + ty[i] * sy[i]) / SHEAR_MODULUS),
        ];
        let sticks = |i: &usize| tx[*i].hypot(ty[*i]) < bound[*i] * (1.0 - 1e-7);
        (sums, (0..self.area.len()).filter(sticks).count())
    }
}

#[test]
fn influence_coefficients_agree_to_twelve_decimals() {
    let golden: Golden = read("kernels.json");
    assert_eq!(golden.influence.len(), 11);
    for value in &golden.influence {
        let [x0, x1, y0, y1] = value.cell;
        let ours = rectangle(
            value.x,
            value.y,
            Rectangle { x0, x1, y0, y1 },
            value.poisson_ratio,
        );
        for (ours, stored) in [
            (ours.xx, value.xx),
            (ours.xy, value.xy),
            (ours.yy, value.yy),
        ] {
            // The stored values are those of one body, ours those of the pair and times G.
            let one_body = ours / (2.0 * value.shear_modulus);
            assert!(
                (one_body - stored).abs() < 1e-12,
                "({}, {}): {one_body} {stored}",
                value.x,
                value.y
            );
        }
    }
}

#[test]
fn discrete_solutions_agree_to_nine_digits() {
    let golden: Golden = read("kernels.json");
    assert_eq!(golden.solver.len(), 45);
    let mut failures = Vec::new();
    for name in ["circle", "long_ellipse", "egg"] {
        let region = Region::new(name);
        let differences =
            Differences::new(&region.mesh, POISSON, false, Precision::Double, &Unwatched)
                .expect("nobody stops the assembly");
        let load: f64 = region
            .pressure
            .iter()
            .zip(&region.area)
            .map(|(p, a)| p * a)
            .sum();
        for stored in golden.solver.iter().filter(|s| s.region == name) {
            let rule = match stored.rule.as_str() {
                "half" => Rule::Upwind,
                "trapezoid" => Rule::Trapezoid,
                other => panic!("no rule {other}"),
            };
            let (sums, stick) = region.solve(rule, stored.motion, &differences);
            let forces = [stored.force_x, stored.force_y, stored.moment_z];
            let largest = forces.iter().fold(0.0f64, |m, f| m.max(f.abs()));
            let worst = (0..3)
                .map(|k| (sums[k] - forces[k]).abs() / largest)
                .fold(0.0, f64::max);
            let stick_agrees = stored.stick_cells.is_none_or(|count| count == stick);
            let power_agrees = stored
                .dissipation
                .is_none_or(|power| (sums[3] - power).abs() < 2e-9 * power.max(1e-3));
            assert!(
                stored
                    .load
                    .is_none_or(|stored| (load - stored).abs() < 1e-9)
            );
            if worst > 1e-9 || !stick_agrees || !power_agrees {
                failures.push(format!(
                    "{name} {} {:?}: {sums:?} stick {stick}, stored {forces:?} {:?} {:?}",
                    stored.rule, stored.motion, stored.dissipation, stored.stick_cells
                ));
            }
        }
    }
    assert_none("discrete solutions differ from the stored ones", &failures);
}

#[test]
fn folding_a_symmetric_mesh_does_not_move_the_discrete_solution() {
    let region = Region::new("circle");
    let full = Differences::new(&region.mesh, POISSON, false, Precision::Double, &Unwatched)
        .expect("nobody stops the assembly");
    let folded = Differences::new(&region.mesh, POISSON, true, Precision::Double, &Unwatched)
        .expect("nobody stops the assembly");
    for (motion, parity) in [
        ([0.3, 0.0, 0.0], Parity::Longitudinal),
        ([0.0, 0.2, 0.7], Parity::Lateral),
    ] {
        let motion = Motion {
            creepage_x: motion[0],
            creepage_y: motion[1],
            spin_per_mm: motion[2],
        };
        let half = Equations::new(Rule::Trapezoid, &region.mesh, &folded, Some(parity));
        let whole = Equations::new(Rule::Trapezoid, &region.mesh, &full, None);
        // Any traction with the symmetry of the motion must give the same slip either way.
        let (n, cells) = (region.mesh.cells(), half.cells());
        assert_eq!(2 * cells, n);
        let sign = if parity == Parity::Longitudinal {
            1.0
        } else {
            -1.0
        };
        let mut t = vec![0.0; 2 * whole.padded()];
        let mut t_half = vec![0.0; 2 * half.padded()];
        for i in 0..cells {
            let (tx, ty) = ((i as f64).sin(), (1.7 * i as f64).cos());
            let image = (5 - i / 5) * 5 + i % 5;
            (t[i], t[image]) = (tx, sign * tx);
            (t[whole.padded() + i], t[whole.padded() + image]) = (ty, -sign * ty);
            (t_half[i], t_half[half.padded() + i]) = (tx, ty);
        }
        let slip_of = |equations: &Equations, t: &[f64]| {
            let mut slip = vec![0.0; t.len()];
            equations.elastic(t, &mut slip, &mut vec![0.0; 2 * equations.row_count()]);
            let rigid = equations.rigid(&motion);
            slip.iter()
                .zip(rigid)
                .map(|(s, q)| s + q)
                .collect::<Vec<f64>>()
        };
        let (slip, slip_half) = (slip_of(&whole, &t), slip_of(&half, &t_half));
        for i in 0..cells {
            let x = (slip[i] - slip_half[i]).abs();
            let y = (slip[whole.padded() + i] - slip_half[half.padded() + i]).abs();
            assert!(
                x < 1e-12 && y < 1e-12,
                "{parity:?} cell {i}: {x:.1e} {y:.1e}"
            );
        }
    }
}
