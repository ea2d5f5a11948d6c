//! Solutions of the tangential problem: tractions, slips and zones on one mesh, resultants of a motion, and the work done for them.

use crate::method::Method;
use crate::monitor::Stop;
use crate::numerics::simd::length;
use crate::remark::list::Remark;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// The solution for one motion on one mesh, dimensionless, with one value per cell.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LevelAnswer {
    /// Tractions along x and across, from which forces follow.
    pub traction: [Vec<f64>; 2],
    /// The tractions of the three-point rule, if it was solved for smooth slips or for bounds that depend on the slip.
    pub second: Option<[Vec<f64>; 2]>,
    /// Slips along x and across.
    pub slip: [Vec<f64>; 2],
    /// Whether each cell slips.
    pub slips: Vec<bool>,
    /// Work done.
    pub work: Work,
    /// Work that was not needed.
    pub skip: Option<Skip>,
    /// Remarks for the client.
    pub remarks: Vec<Remark>,
}

impl LevelAnswer {
    /// The solution without tractions for a motion about the origin of the case, where the slips are those of the motion.
    pub(crate) fn without_traction(level: &StripMesh, motion: &Motion, skip: Skip) -> LevelAnswer {
        let (cells, mesh) = (level.mesh.cells(), &level.mesh);
        let along = |y: f64| motion.creepage_x - motion.spin_per_mm * y;
        let across = |x: &f64| motion.creepage_y + motion.spin_per_mm * x;
        LevelAnswer {
            traction: [vec![0.0; cells], vec![0.0; cells]],
            slip: [
                mesh.cell_load_y().into_iter().map(along).collect(),
                mesh.node.iter().map(across).collect(),
            ],
            slips: vec![!motion.is_still(); cells],
            skip: Some(skip),
            ..LevelAnswer::default()
        }
    }

    /// Whether there are no tractions because there is no motion or no friction.
    pub fn is_without_traction(&self) -> bool {
        matches!(self.skip, Some(Skip::NoMotion | Skip::NoFriction))
    }
}

/// Counted work of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// Newton iterations.
    pub iterations: u32,
    /// Products of the operator with a vector.
    pub products: u32,
    /// Entries of the operator that these products touched.
    pub entries: u64,
    /// Residual of the friction law after the last iteration, relative to the traction scale.
    pub residual: f64,
}

impl Work {
    /// Adds the counts of a later solve and takes over its residual.
    pub fn add(&mut self, later: Work) {
        self.iterations += later.iterations;
        self.products += later.products;
        self.entries += later.entries;
        self.residual = later.residual;
    }

    /// Adds the counts of work that did not change the solution, and keeps the residual.
    pub fn add_lost(&mut self, lost: Work) {
        let residual = self.residual;
        self.add(lost);
        self.residual = residual;
    }

    /// The counts since an earlier state.
    #[must_use]
    pub fn since(&self, earlier: Work) -> Work {
        Work {
            iterations: self.iterations - earlier.iterations,
            products: self.products - earlier.products,
            entries: self.entries - earlier.entries,
            residual: self.residual,
        }
    }
}

/// The reason why there is no solution of the tangential problem.
#[derive(Debug, Clone, PartialEq)]
pub enum LevelFailure {
    /// The monitor stopped the work.
    Stopped(Stop),
    /// The iteration did not converge.
    NotConverged {
        /// Work done, with the residual of the best iterate.
        work: Work,
        /// Residual to reach.
        tolerance: f64,
        /// Advice for the client.
        advice: String,
    },
}

impl From<Stop> for LevelFailure {
    fn from(stop: Stop) -> Self {
        LevelFailure::Stopped(stop)
    }
}

/// Projects the tractions onto their friction circles, which they may exceed by the tolerance of the solver. Returns the slips: 0 in cells that stick, and
/// the component of the given slip along the traction in cells that slip.
pub(crate) fn project_on_bound(
    bound: &[f64],
    slips: &[bool],
    traction: &mut [Vec<f64>; 2],
    given: &[Vec<f64>; 2],
) -> [Vec<f64>; 2] {
    let mut slip = [vec![0.0; bound.len()], vec![0.0; bound.len()]];
    for i in 0..bound.len() {
        let length = length(traction[0][i], traction[1][i]);
        if length == 0.0 {
            // Without traction, hence without pressure, the slip is free.
            if slips[i] {
                slip[0][i] = given[0][i];
                slip[1][i] = given[1][i];
            }
            continue;
        }
        let (dx, dy) = (traction[0][i] / length, traction[1][i] / length);
        if slips[i] || length > bound[i] {
            traction[0][i] = bound[i] * dx;
            traction[1][i] = bound[i] * dy;
        }
        if slips[i] {
            let along = (given[0][i] * dx + given[1][i] * dy).max(0.0);
            slip[0][i] = along * dx;
            slip[1][i] = along * dy;
        }
    }
    slip
}

/// A part of the usual work that is not needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Skip {
    /// The error bound of the creep table meets the target, so that resultants need no mesh.
    Mesh,
    /// The tractions of a motion without creepage and spin are 0.
    NoMotion,
    /// Without friction there are no tractions.
    NoFriction,
    /// Patch and motion are mirror-symmetric, so that half the cells are unknowns.
    HalfTheCells,
    /// The patch alone is mirror-symmetric, so that half the operator is enough.
    HalfTheOperator,
}

impl Skip {
    /// The sentence a client reads.
    pub fn text(self) -> &'static str {
        match self {
            Skip::Mesh => "the bound of the creep table meets the target: no mesh",
            Skip::NoMotion => "no creepage and no spin: nothing to solve",
            Skip::NoFriction => "no friction: no tractions",
            Skip::HalfTheCells => "mirror symmetry of patch and motion: half the cells",
            Skip::HalfTheOperator => {
                "mirror symmetry of the patch: half of the influence matrix was computed"
            }
        }
    }
}

/// Relative errors of every patch, then of the sum over the patches; `None` where unknown.
pub type RelativeErrors = Vec<Option<f64>>;

/// The solution for one motion.
#[derive(Debug, Clone, Default)]
pub struct MotionAnswer {
    /// The motion.
    pub motion: Motion,
    /// Whether a prescribed force could not be reached.
    pub saturated: bool,
    /// Resultants of every patch about the origin of the case, extrapolated where the mesh is the solver's.
    pub resultants: Vec<Resultants>,
    /// Estimated errors of the resultants relative to μN: one per patch, then that of the sum.
    pub errors: RelativeErrors,
    /// Tractions, slips and zones; `None` from a method that gives resultants only ([`Method::has_fields`]).
    pub fields: Option<SolvedFields>,
    /// Share of the area of every patch that sticks, from methods without fields that give it.
    pub stick: Option<Vec<f64>>,
    /// Derivatives of the resultants of every patch, if they were requested or come with the method.
    pub gradients: Option<Vec<PatchGradients>>,
    /// Results of a transient motion; `None` in steady rolling.
    pub history: Option<HistoryAnswer>,
    /// Work that was not needed.
    pub skips: Vec<Skip>,
    /// Remarks for the client.
    pub remarks: Vec<Remark>,
    /// Work over all meshes.
    pub work: Work,
    /// The method that the resultants are from.
    pub method: Method,
    /// Wall time in s.
    pub seconds: f64,
}

/// Results at a point of a transient motion besides its forces.
#[derive(Debug, Clone, PartialEq)]
pub struct HistoryAnswer {
    /// Distance rolled since the start in mm.
    pub distance: f64,
    /// Displacement in mm and rad of the upper body relative to the lower one since the point before, if the bodies did not roll.
    pub shift: Option<Motion>,
    /// Power of friction over the rolling speed in N, for every patch; 0 in a shift.
    pub power: Vec<f64>,
    /// Energy dissipated by friction since the start in N·mm, for every patch.
    pub dissipated: Vec<f64>,
    /// Estimated errors of the creepages found for prescribed forces.
    pub creepage_errors: [Option<f64>; 2],
    /// Estimated errors in mm of the shifts found for prescribed forces.
    pub shift_errors: [Option<f64>; 2],
}

/// Derivatives of F_x, F_y and M_z about the origin of the case by ν_x, ν_y and φ (per mm), as `[resultant][creepage]` in N and mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PatchGradients {
    /// The derivatives.
    pub values: [[f64; 3]; 3],
    /// Estimated absolute errors; `None` where unknown.
    pub errors: Option<[[f64; 3]; 3]>,
}

/// The fields of a motion on its finest mesh.
#[derive(Debug, Clone)]
pub struct SolvedFields {
    /// Number of the mesh.
    pub level: usize,
    /// Tractions, slips and zones.
    pub tangential: LevelAnswer,
}

impl MotionAnswer {
    /// Replaces the resultants and their errors by those of another method, and keeps the values per cell.
    pub(crate) fn take_resultants(&mut self, of: &MotionAnswer) {
        self.resultants.clone_from(&of.resultants);
        self.errors.clone_from(&of.errors);
        self.stick.clone_from(&of.stick);
        self.gradients.clone_from(&of.gradients);
        self.method = of.method;
    }

    /// Total tangential force over the friction limit, a given `limit` in N; 0 without friction.
    pub fn force_share(&self, limit: f64) -> f64 {
        let sum: Resultants = self.resultants.iter().sum();
        let force = sum.force_x.hypot(sum.force_y);
        if limit > 0.0 { force / limit } else { 0.0 }
    }

    /// Estimated error of the sum over the patches.
    pub fn error(&self) -> Option<f64> {
        self.errors.last().copied().flatten()
    }
}

/// Forces in N and moment about z in N·mm, on the lower body.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Resultants {
    /// Longitudinal force.
    pub force_x: f64,
    /// Lateral force.
    pub force_y: f64,
    /// Moment about a point that the context defines.
    pub moment_z: f64,
}

impl<'a> std::iter::Sum<&'a Resultants> for Resultants {
    fn sum<I: Iterator<Item = &'a Resultants>>(all: I) -> Resultants {
        all.fold(Resultants::default(), |sum, own| sum.plus(*own))
    }
}

impl Resultants {
    /// `F_x = Σ T_x A`, `F_y = Σ T_y A`, `M_z = Σ (x T_y − y T_x) A` over the cells of one patch, about the origin of the case. `traction` is dimensionless.
    ///
    /// x is taken in the middle of the cell, where the moment of a constant traction is exact; with the node the error of M_z is about twice as large. y is the
    /// mean of the mid-line and the load centre of the strip: the mid-line gives a moment of a vortex that is too large, and the load centre one that is too
    /// small, because the mean of `y²` over a strip exceeds the square of the mean.
    pub fn of_patch(level: &StripMesh, traction: &[Vec<f64>; 2], patch: usize) -> Resultants {
        let mut sum = Resultants::default();
        let mesh = &level.mesh;
        let segments = mesh.segments.iter().zip(&mesh.load_y);
        for (segment, load_y) in segments.filter(|(s, _)| s.chord.patch == patch) {
            let arm = 0.5 * (segment.chord.y + load_y);
            for i in segment.cells.clone() {
                let weight = level.area[i] * level.scale.traction;
                let (x, y) = (weight * traction[0][i], weight * traction[1][i]);
                sum.force_x += x;
                sum.force_y += y;
                let centre = 0.5 * (mesh.left[i] + mesh.right[i]);
                sum.moment_z += centre * y - arm * x;
            }
        }
        sum
    }

    /// The sum with other resultants about the same point.
    #[must_use]
    pub fn plus(self, other: Resultants) -> Resultants {
        Resultants {
            force_x: self.force_x + other.force_x,
            force_y: self.force_y + other.force_y,
            moment_z: self.moment_z + other.moment_z,
        }
    }

    /// These resultants times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Resultants {
        Resultants {
            force_x: factor * self.force_x,
            force_y: factor * self.force_y,
            moment_z: factor * self.moment_z,
        }
    }

    /// Richardson extrapolation of an error that falls as 1/N: these resultants plus `share` of their change from a coarser mesh, with a force of at most `bound`.
    #[must_use]
    pub fn beyond(self, coarser: Resultants, share: f64, bound: f64) -> Resultants {
        let past = |here: f64, before: f64| here + share * (here - before);
        let [x, y] = [
            past(self.force_x, coarser.force_x),
            past(self.force_y, coarser.force_y),
        ];
        let force = x.hypot(y);
        let factor = if force > bound { bound / force } else { 1.0 };
        Resultants {
            force_x: factor * x,
            force_y: factor * y,
            moment_z: past(self.moment_z, coarser.moment_z),
        }
    }

    /// These resultants with the moment about `point` instead of the origin.
    #[must_use]
    pub fn about(self, point: [f64; 2]) -> Resultants {
        Resultants {
            moment_z: self.moment_z - point[0] * self.force_y + point[1] * self.force_x,
            ..self
        }
    }

    /// Largest component of the difference to `other`: forces relative to `force`, moments to `force × length`; the
    /// moments should be about a point in the patch.
    pub fn distance(&self, other: &Resultants, force: f64, length: f64) -> f64 {
        let x = (self.force_x - other.force_x).abs();
        let y = (self.force_y - other.force_y).abs();
        let z = (self.moment_z - other.moment_z).abs() / length;
        x.max(y).max(z) / force
    }
}
