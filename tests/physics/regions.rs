//! Dimensionless contacts given by formula, meshed on strips. The half length of the longest strip is 1, the load μN is 1 and `E/(1 − ν²)` is 1, so
//! that creepage and spin are the normalised ones of Liu and Hsu.

use std::f64::consts::PI;

use railhead_contact::half_space::strip_operator::kind::Precision;
use railhead_contact::half_space::strip_operator::operator::StripOperator;
use railhead_contact::mesh::{Chord, Grading, Mesh, equal_strips};
use railhead_contact::monitor::Unmonitored;
use railhead_contact::rolling::methods::boundary_element::newton::Newton;
use railhead_contact::rolling::methods::boundary_element::task::{Convergence, NewtonTask};
use railhead_contact::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use railhead_contact::rolling::methods::liu_hsu::solve::ZonesOutcome;
use railhead_contact::rolling::methods::liu_hsu::stick_block::DenseTask;
use railhead_contact::rolling::slip_equations::SlipEquations;
use railhead_contact::rolling::slip_rules::Rule;
use railhead_contact::rolling::task::Motion;

/// Poisson's ratio of all these contacts.
pub const NU: f64 = 0.25;
/// `G/(E/(1 − ν²)) = (1 − ν)/2`.
pub const SHEAR_MODULUS: f64 = 0.5 * (1.0 - NU);

/// A region with its friction bound μp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Region {
    /// Hertz's ellipse with semi-axes 1 along rolling and `b` across.
    Ellipse { b: f64 },
    /// Half chord `√(1 − (y/b)²)`, b = 0.7 for y > 0 and 1.4 for y < 0. The curvature of its outline jumps.
    Egg,
    /// Two of Hertz's circles of radii 1 and 0.6, side by side. Each carries the load that belongs to its radius.
    TwoCircles,
}

/// The regions with the names used in the data and in reports.
pub const REGIONS: [(&str, Region); 5] = [
    ("circle", Region::Ellipse { b: 1.0 }),
    ("long_ellipse", Region::Ellipse { b: 0.3 }),
    ("wide_ellipse", Region::Ellipse { b: 1.0 / 0.3 }),
    ("egg", Region::Egg),
    ("two_circles", Region::TwoCircles),
];

/// Load of the second circle relative to the first: Hertz's for equal radii of curvature.
const SECOND_LOAD: f64 = 0.6 * 0.6 * 0.6;
/// y of the centre of the second circle. The first is at the origin.
const SECOND_Y: f64 = 1.8;

impl Region {
    /// Returns the chords of the strips of one patch or of both.
    fn chords(self, strips: usize) -> Vec<Chord> {
        let extents: &[(f64, f64)] = match self {
            Region::Ellipse { b } => &[(-b, b)],
            Region::Egg => &[(-1.4, 0.7)],
            Region::TwoCircles => &[(-1.0, 1.0), (SECOND_Y - 0.6, SECOND_Y + 0.6)],
        };
        let mut chords = Vec::new();
        for (patch, (low, high)) in extents.iter().enumerate() {
            for (strip, (y, dy)) in equal_strips(*low, *high, strips).into_iter().enumerate() {
                let half = self.half_chord(y);
                chords.push(Chord {
                    patch,
                    strip,
                    y,
                    dy,
                    left: -half,
                    right: half,
                });
            }
        }
        chords
    }

    fn half_chord(self, y: f64) -> f64 {
        match self {
            Region::Ellipse { b } => (1.0 - (y / b).powi(2)).sqrt(),
            Region::Egg => {
                let b = if y > 0.0 { 0.7 } else { 1.4 };
                (1.0 - (y / b).powi(2)).sqrt()
            }
            Region::TwoCircles if y < 1.0 => (1.0 - y * y).sqrt(),
            Region::TwoCircles => (0.36 - (y - SECOND_Y).powi(2)).sqrt(),
        }
    }

    /// Returns μp at a point of the region.
    fn bound(self, x: f64, y: f64) -> f64 {
        let depth = (self.half_chord(y).powi(2) - x * x).max(0.0).sqrt();
        match self {
            Region::Ellipse { b } => 1.5 / (PI * b) * depth,
            Region::Egg => depth / (2.0 * PI / 3.0 * 1.05),
            Region::TwoCircles => 1.5 / PI / (1.0 + SECOND_LOAD) * depth,
        }
    }
}

/// A meshed region with its influence coefficients.
pub struct Contact {
    pub mesh: Mesh,
    pub differences: StripOperator,
    pub bound: Vec<f64>,
    pub area: Vec<f64>,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

impl Contact {
    /// Meshes a region with `strips` strips per patch; the bound is taken at the node of each cell.
    pub fn new(region: Region, strips: usize, grading: &Grading) -> Contact {
        let mesh = Mesh::new(&region.chords(strips), grading);
        let differences =
            StripOperator::new(&mesh, NU, false, Precision::Double, &Unmonitored).unwrap();
        let (x, y) = (mesh.node.clone(), mesh.cell_load_y());
        let mut bound: Vec<f64> = x
            .iter()
            .zip(&y)
            .map(|(x, y)| region.bound(*x, *y))
            .collect();
        let mut area = mesh.areas();
        bound.resize(differences.padded(None), 0.0);
        area.resize(differences.padded(None), 0.0);
        Contact {
            mesh,
            differences,
            bound,
            area,
            x,
            y,
        }
    }

    pub fn equations(&self, rule: Rule) -> SlipEquations<'_> {
        SlipEquations::new(rule, &self.mesh, &self.differences, None)
    }

    /// Returns Σ μp·A.
    pub fn load(&self) -> f64 {
        self.bound.iter().zip(&self.area).map(|(g, a)| g * a).sum()
    }

    pub fn law<'a>(&'a self, rigid: &'a [f64], tolerance: f64) -> NewtonTask<'a> {
        NewtonTask {
            rigid,
            bound: &self.bound,
            fall: None,
            area: &self.area,
            scale: self.scale(rigid),
            tolerance,
            accepts_start: true,
        }
    }

    /// Returns the mean bound, or less where the motion is too small to reach it.
    fn scale(&self, rigid: &[f64]) -> f64 {
        let largest = rigid.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        let mean = self.load() / self.area.iter().sum::<f64>();
        if largest > 0.0 {
            mean.min(largest)
        } else {
            mean
        }
    }

    pub fn stage<'a>(
        &'a self,
        equations: &'a SlipEquations<'a>,
        rigid: &'a [f64],
        motion: Motion,
        tolerance: f64,
    ) -> DenseTask<'a> {
        DenseTask {
            equations,
            law: self.law(rigid, tolerance),
            nodes: (&self.x, &self.y),
            motion,
        }
    }

    /// Returns Fx, Fy and Mz about the origin.
    pub fn forces(&self, t: &[f64]) -> [f64; 3] {
        let padded = t.len() / 2;
        let mut forces = [0.0; 3];
        for i in 0..self.x.len() {
            let (fx, fy) = (t[i] * self.area[i], t[padded + i] * self.area[i]);
            forces[0] += fx;
            forces[1] += fy;
            forces[2] += self.x[i] * fy - self.y[i] * fx;
        }
        forces
    }

    /// Returns the number of cells with `|T| < μp (1 − 1e-7)`.
    pub fn stick_cells(&self, t: &[f64]) -> usize {
        let padded = t.len() / 2;
        (0..self.x.len())
            .filter(|i| t[*i].hypot(t[padded + i]) < self.bound[*i] * (1.0 - 1e-7))
            .count()
    }
}

/// Returns the normalised motion in units of slip `P/G`.
pub fn motion([x, y, spin]: [f64; 3]) -> Motion {
    Motion {
        creepage_x: SHEAR_MODULUS * x,
        creepage_y: SHEAR_MODULUS * y,
        spin_per_mm: SHEAR_MODULUS * spin,
    }
}

/// Solves with the semismooth Newton method from zero traction. If it fails, solves the upwind rule first.
pub fn boundary_element(
    contact: &Contact,
    rule: Rule,
    state: [f64; 3],
    tolerance: f64,
) -> (Vec<f64>, Convergence) {
    let solve = |rule: Rule, t: &mut [f64]| {
        let equations = contact.equations(rule);
        let rigid = equations.rigid(&motion(state));
        Newton::new(&equations)
            .solve(
                &contact.law(&rigid, tolerance),
                t,
                &mut NewtonWorkspace::default(),
                &Unmonitored,
            )
            .unwrap()
    };
    let mut t = vec![0.0; 2 * contact.bound.len()];
    if rule != Rule::Upwind {
        solve(Rule::Upwind, &mut t);
    }
    let convergence = solve(rule, &mut t);
    (t, convergence)
}

/// Runs `solve` on the stage of a rule and motion.
pub fn on_stage(
    contact: &Contact,
    rule: Rule,
    state: [f64; 3],
    tolerance: f64,
    solve: impl FnOnce(&DenseTask, &mut [f64]) -> ZonesOutcome,
) -> (Vec<f64>, ZonesOutcome) {
    let equations = contact.equations(rule);
    let motion = motion(state);
    let rigid = equations.rigid(&motion);
    let stage = contact.stage(&equations, &rigid, motion, tolerance);
    let mut t = vec![0.0; 2 * equations.padded()];
    let outcome = solve(&stage, &mut t);
    (t, outcome)
}
