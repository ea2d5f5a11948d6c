//! Kalker's simplified theory (*A fast algorithm for the simplified theory of rolling contact*, 1982). The displacement of a cell depends only on its own
//! traction, so a strip is solved in one pass.
//!
//! With `u = L T` steady rolling becomes `s = w + L ∂T/∂x` on each strip separately. Tractions grow from 0 at the leading edge. Where they exceed the bound,
//! they are scaled back to it and the cell slips. The flexibilities `L1 = 8a/(3 G C11)`, `L2 = 8a/(3 G C22)` for the creepages and
//! `L3 = π a √(a/b)/(4 G C23)` for the spin give the forces of linear theory where nothing slips.

use std::f64::consts::PI;

use crate::error::SolveError;
use crate::friction::law::FrictionLaw;
use crate::friction::path_dependent::Interface;
use crate::half_space::unlike_bodies::Elasticity;
use crate::mesh::{Mesh, MeshSize, SIDE_GOOD, Segment};
use crate::method::{Method, TractionBound};
use crate::normal::footprint::Footprint;
use crate::normal::hertz::{Ellipse, NormalLoad};
use crate::numerics::simd::length;
use crate::rolling::answer::{LevelAnswer, Skip, Work};
use crate::rolling::linear_theory;
use crate::rolling::load_ellipse::LoadEllipse;
use crate::rolling::strip_mesh::{Scale, StripMesh};
use crate::rolling::task::{Motion, Resolution, RollingTask};

/// The default mesh. Finer ones change the resultants by a small fraction of the error of the theory.
pub const MESH: MeshSize = MeshSize {
    strips: 10,
    cells: 16,
};

/// Error of the resultants relative to μN (moment: μN√(A/π)) on meshes whose sides are [`SIDE_GOOD`] or more, with either bound. It covers
/// 95 % of random motions of ellipses with a/b from 0.1 to 10 and any ν. The errors of most are far smaller; the largest, about 0.25, belong to
/// motions whose slip is oblique, because the three flexibilities turn the tractions away from it.
const ERROR: f64 = 0.16;

/// Returns the stated error of the resultants relative to μN, which is larger than [`ERROR`] if a side of the mesh is below [`SIDE_GOOD`].
pub fn stated_error(mesh: MeshSize) -> f64 {
    let side = mesh.strips.min(mesh.cells).min(SIDE_GOOD);
    ERROR * (f64::from(SIDE_GOOD) / f64::from(side)).powi(2)
}

/// Tractions, slips and zones of one dimensionless motion on a mesh.
///
/// Each patch is solved separately, with the flexibilities of its equivalent ellipse (see [`LoadEllipse`]) and
/// the creepages at its load centre. Slips are those of the single flexibility `(L1|ν_x| + L2|ν_y| + L3|φ|c)/√(ν_x² + ν_y² + φ²c²)`. Tractions with the
/// parabolic bound exceed μp in the middle of a patch.
pub fn solve(task: &RollingTask, level: &StripMesh, motion: &Motion) -> LevelAnswer {
    let parabolic = task.traction_bound == TractionBound::Parabolic;
    if motion.is_still() {
        return LevelAnswer::without_traction(level, motion, Skip::NoMotion);
    }
    let cells = level.mesh.cells();
    let mut answer = LevelAnswer {
        traction: [vec![0.0; cells], vec![0.0; cells]],
        slip: [vec![0.0; cells], vec![0.0; cells]],
        slips: vec![false; cells],
        work: Work {
            iterations: 1,
            ..Work::default()
        },
        ..LevelAnswer::default()
    };
    let mut bound = level.bound.clone();
    for (p, brush) in brushes(task, level, motion).enumerate() {
        if parabolic {
            make_parabolic(level, p, &mut bound);
        }
        brush.sweep_patch(level, p, &bound, |i, traction, slip| {
            answer.traction[0][i] = traction[0];
            answer.traction[1][i] = traction[1];
            if let Some(slip) = slip {
                answer.slips[i] = true;
                answer.slip[0][i] = slip[0];
                answer.slip[1][i] = slip[1];
            }
        });
    }
    answer
}

/// The tractions of [`solve`] with the elliptic bound.
pub fn tractions(task: &RollingTask, level: &StripMesh, motion: &Motion) -> [Vec<f64>; 2] {
    let cells = level.mesh.cells();
    let mut found = [vec![0.0; cells], vec![0.0; cells]];
    for (p, brush) in brushes(task, level, motion).enumerate() {
        brush.sweep_patch(level, p, &level.bound, |i, traction, _| {
            found[0][i] = traction[0];
            found[1][i] = traction[1];
        });
    }
    found
}

/// The coefficients of every patch.
fn brushes<'a>(
    task: &'a RollingTask,
    level: &'a StripMesh,
    motion: &'a Motion,
) -> impl Iterator<Item = SimplifiedTheory> + 'a {
    let Scale { origin, length, .. } = level.scale;
    (0..task.footprint.patches().len()).map(move |patch| {
        let ellipse = LoadEllipse::rough(task.footprint, patch);
        let centre = [0, 1].map(|k| (ellipse.centre[k] - origin[k]) / length);
        let semi_axes = ellipse.semi_axes.map(|axis| axis / length);
        SimplifiedTheory::new(centre, semi_axes, task.elasticity.poisson_ratio, motion)
    })
}

/// A mesh for many ellipses and motions: that of the circle, of which all ellipses are images.
#[derive(Debug)]
pub struct EllipseMesh {
    level: StripMesh,
    bound: Vec<f64>,
}

/// Ratio of the dimensionless creepages and forces of a mesh to those relative to μN. The largest pressure of an ellipse is 3N/(2πab).
const PER_LIMIT: f64 = 2.0 * PI / 3.0;

impl EllipseMesh {
    /// A mesh of a given size.
    ///
    /// # Errors
    /// The size is 0.
    pub fn new(size: MeshSize, bound: TractionBound) -> Result<EllipseMesh, SolveError> {
        let circle = Ellipse::of_semi_axes(1.0, 1.0, NormalLoad::Force(1.0), 1.0);
        let footprint = Footprint::hertz(circle);
        let task = RollingTask {
            footprint: &footprint,
            elasticity: &Elasticity {
                shear_modulus: 1.0,
                poisson_ratio: 0.0,
                difference: 0.0,
                lower_share: 0.5,
            },
            friction: &FrictionLaw::Constant(1.0),
            interface: Interface::default(),
            motions: &[],
            forces: &[],
            speeds: &[],
            first_motion: 0,
            method: Method::Fastsim,
            traction_bound: bound,
            resolution: Resolution::Mesh(size),
            wants_slips: false,
            wants_gradients: false,
            is_differenced: false,
        };
        let level = StripMesh::new(&task, size)?;
        let mut bounds = level.bound.clone();
        if bound == TractionBound::Parabolic {
            make_parabolic(&level, 0, &mut bounds);
        }
        Ok(EllipseMesh {
            level,
            bound: bounds,
        })
    }

    /// `[F_x/(μN), F_y/(μN), M_z/(μN√(ab))]` and the share of the area that sticks, for the dimensionless creepages `G c²/(μN) (ν_x, ν_y, c φ)`.
    pub fn creep(&self, a_over_b: f64, poisson_ratio: f64, creepage: [f64; 3]) -> ([f64; 3], f64) {
        if creepage == [0.0; 3] {
            return ([0.0; 3], 1.0);
        }
        let motion = Motion::of(creepage.map(|part| PER_LIMIT * part));
        let (a, b) = (a_over_b.sqrt(), 1.0 / a_over_b.sqrt());
        let brush = SimplifiedTheory::new([0.0; 2], [a, b], poisson_ratio, &motion);
        let mesh = &self.level.normalised;
        let (mut force, mut stick, mut whole) = ([0.0; 3], 0.0, 0.0);
        for (segment, load_y) in mesh.segments.iter().zip(&mesh.load_y) {
            let arm = 0.5 * b * (segment.chord.y + load_y);
            brush.sweep_strip(mesh, segment, [a, b], &self.bound, |i, traction, slip| {
                let area = self.level.area[i];
                whole += area;
                if slip.is_none() {
                    stick += area;
                }
                let [x, y] = traction.map(|t| area * t);
                let middle = 0.5 * a * (mesh.left[i] + mesh.right[i]);
                force[0] += x;
                force[1] += y;
                force[2] += middle * y - arm * x;
            });
        }
        (force.map(|part| part / PER_LIMIT), stick / whole)
    }
}

/// Replaces the bound of a patch by its square, scaled to the same load, which makes a paraboloid of Hertz's ellipsoid.
fn make_parabolic(level: &StripMesh, patch: usize, bound: &mut [f64]) {
    let (mut load, mut square) = (0.0, 0.0);
    for i in level.patch_cells(patch) {
        load += level.area[i] * bound[i];
        square += level.area[i] * bound[i] * bound[i];
    }
    if square > 0.0 {
        for i in level.patch_cells(patch) {
            bound[i] *= bound[i] * load / square;
        }
    }
}

/// Rigid slip over flexibility, `(ν_x/L1 − φy/L3, ν_y/L2 + φx/L3)`, which is the growth of sticking tractions along a strip.
#[derive(Debug, Clone, Copy)]
struct SimplifiedTheory {
    growth: [f64; 2],
    turning: f64,
    centre: [f64; 2],
    /// The single flexibility for slips.
    flexibility: f64,
}

impl SimplifiedTheory {
    /// The theory for an ellipse with this centre and these semi-axes, dimensionless.
    fn new(
        centre: [f64; 2],
        [a, b]: [f64; 2],
        poisson_ratio: f64,
        motion: &Motion,
    ) -> SimplifiedTheory {
        let [c11, c22, c23] = linear_theory::coefficients(a / b, poisson_ratio);
        let [l1, l2] = [c11, c22].map(|c| 8.0 * a / (3.0 * c));
        let l3 = PI * a * (a / b).sqrt() / (4.0 * c23);
        let spin = motion.spin_per_mm;
        let x = motion.creepage_x - spin * centre[1];
        let y = motion.creepage_y + spin * centre[0];
        let turn = spin * (a * b).sqrt();
        let length = x.hypot(y).hypot(turn);
        SimplifiedTheory {
            growth: [x / l1, y / l2],
            turning: spin / l3,
            centre,
            flexibility: if length > 0.0 {
                (l1 * x.abs() + l2 * y.abs() + l3 * turn.abs()) / length
            } else {
                0.0
            },
        }
    }

    /// Sweeps each segment of a patch. `take` receives each cell, its traction, and its slip if it slips.
    fn sweep_patch(
        &self,
        level: &StripMesh,
        patch: usize,
        bound: &[f64],
        mut take: impl FnMut(usize, [f64; 2], Option<[f64; 2]>),
    ) {
        let mesh = &level.normalised;
        for segment in mesh.segments.iter().filter(|s| s.chord.patch == patch) {
            self.sweep_strip(mesh, segment, [1.0; 2], bound, &mut take);
        }
    }

    /// Sweeps a segment of a mesh, stretched by factors along x and across, from its leading to its trailing edge. See [`Self::sweep_patch`] for `take`.
    fn sweep_strip(
        &self,
        mesh: &Mesh,
        segment: &Segment,
        [along, across]: [f64; 2],
        bound: &[f64],
        mut take: impl FnMut(usize, [f64; 2], Option<[f64; 2]>),
    ) {
        let growth_x = self.growth[0] - self.turning * (across * segment.chord.y - self.centre[1]);
        let mut ahead = along * segment.chord.right;
        let mut traction = [0.0; 2];
        for i in segment.cells.clone().rev() {
            let here = along * mesh.node[i];
            let step = ahead - here;
            // The rigid slip is linear along the strip: its value halfway makes the step exact.
            let halfway = 0.5 * (ahead + here) - self.centre[0];
            let trial = [
                traction[0] + step * growth_x,
                traction[1] + step * (self.growth[1] + self.turning * halfway),
            ];
            let size = length(trial[0], trial[1]);
            traction = trial;
            let mut slip = None;
            if size > bound[i] {
                let share = bound[i] / size;
                traction = trial.map(|t| share * t);
                let back = self.flexibility * (1.0 - share) / step;
                slip = Some(trial.map(|t| back * t));
            }
            take(i, traction, slip);
            ahead = here;
        }
    }
}
