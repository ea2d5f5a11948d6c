//! A mesh of strips over the patches of a footprint, with pressures and friction bounds. All motions and methods share it.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::error::SolveError;
use crate::friction::path_dependent::{PathDependentFriction, PathDependentLaws};
use crate::half_space::strip_operator::kind::{Parity, Precision};
use crate::half_space::strip_operator::operator::StripOperator;
use crate::half_space::unlike_bodies::{Elasticity, pressure_slips};
use crate::mesh::{Chord, Grading, Mesh, equal_strips, strips_about};
use crate::method::Method;
use crate::monitor::{Monitor, Stop};
use crate::normal::footprint::{Footprint, SurfaceSlip};
use crate::normal::hertz::Ellipse;
use crate::rolling::load_ellipse;
use crate::rolling::load_ellipse::StripChord;
use crate::rolling::operator_store::{CaseOperators, OperatorKind, OperatorStore};
use crate::rolling::task::{MeshPlan, Motion, RollingTask};

/// With a single-precision operator, dimensionless coordinates are rounded to multiples of this, so that patches of one shape and different sizes have
/// identical meshes. 2⁻³⁴ is a thousandth of the last digit of single precision.
const COORDINATE_STEP: f64 = 1.0 / (1_u64 << 34) as f64;

/// The units of the dimensionless problem: lengths by `length`, tractions by `traction`, slips by `traction / G`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Unit of length in mm: √(A/π) with A the area of all patches.
    pub length: f64,
    /// Unit of traction in MPa: μ times the largest pressure.
    pub traction: f64,
    /// Combined shear modulus in MPa, reduced by the interface where it reduces that of tractions.
    pub shear_modulus: f64,
    /// The origin of the dimensionless coordinates in mm; on the mirror line if there is one.
    pub origin: [f64; 2],
}

impl Scale {
    /// Unit of slip: `traction / G`, or 1 without friction.
    pub fn slip(&self) -> f64 {
        if self.traction > 0.0 {
            self.traction / self.shear_modulus
        } else {
            1.0
        }
    }

    /// The path-dependent friction in these units.
    pub fn passage<'a>(&self, laws: &PathDependentLaws<'a>) -> PathDependentFriction<'a> {
        laws.on_level(self.slip(), self.length, self.traction)
    }

    /// Converts a motion about the origin of the case to a dimensionless one about [`Scale::origin`].
    pub fn motion(&self, motion: &Motion) -> Motion {
        let unit = self.shear_modulus / self.traction;
        Motion {
            creepage_x: (motion.creepage_x - motion.spin_per_mm * self.origin[1]) * unit,
            creepage_y: (motion.creepage_y + motion.spin_per_mm * self.origin[0]) * unit,
            spin_per_mm: motion.spin_per_mm * self.length * unit,
        }
    }

    /// Converts a dimensionless motion to one about the origin of the case.
    pub fn creepages(&self, motion: &Motion) -> Motion {
        let unit = self.traction / self.shear_modulus;
        let spin = motion.spin_per_mm * unit / self.length;
        Motion {
            creepage_x: motion.creepage_x * unit + spin * self.origin[1],
            creepage_y: motion.creepage_y * unit - spin * self.origin[0],
            spin_per_mm: spin,
        }
    }

    /// Converts a dimensionless displacement of the upper body to mm and rad.
    pub fn shift(&self, motion: &Motion) -> Motion {
        let creepages = self.creepages(motion).components();
        Motion::of(creepages.map(|part| part * self.length))
    }
}

/// A mesh with its pressures and bounds. It is immutable; its operator belongs to the store of the process.
#[derive(Debug)]
pub struct StripMesh {
    /// Size and grading.
    pub plan: MeshPlan,
    /// The mesh in mm.
    pub mesh: Mesh,
    /// Pressure of every cell in MPa; the cells of a patch carry its normal force exactly.
    pub pressure: Vec<f64>,
    /// Share of the load of every patch that the strips cannot place (see [`StripChord::unresolved`]); 0 for an ellipse, whose load is smooth.
    pub unresolved: Vec<f64>,
    /// Area of every cell in mm².
    pub area: Vec<f64>,
    /// Units of the dimensionless problem.
    pub scale: Scale,
    /// The dimensionless mesh.
    pub normalised: Arc<Mesh>,
    /// Friction bound of every cell, dimensionless.
    pub bound: Vec<f64>,
    /// Flexibility of an elastic layer between the bodies, dimensionless.
    pub layer: f64,
    /// Mean slip of every cell besides that of the motion, dimensionless, along x and across. It comes from the pressure of dissimilar bodies or from the
    /// curvature of the surface.
    pub surface_slip: Option<[Vec<f64>; 2]>,
    /// Additional slip per unit of lateral creepage, and per unit of spin in 1/mm, about the origin of the case, where motions share a curved surface.
    pub slip_by_motion: Option<[[Vec<f64>; 2]; 2]>,
    /// Poisson's ratio of the pair.
    pub poisson_ratio: f64,
    /// Precision of the operator.
    pub precision: Precision,
    /// Whether patches and bounds are mirror-symmetric, so that half of the operator is enough.
    pub mirrored: bool,
    operators: Arc<CaseOperators>,
}

impl StripMesh {
    /// Meshes every patch of the footprint with the size and grading of `plan`. The operator is not kept for later meshes.
    ///
    /// # Errors
    /// [`SolveError::Unmeshable`] if no strip meets a patch.
    pub fn new(task: &RollingTask, plan: impl Into<MeshPlan>) -> Result<StripMesh, SolveError> {
        let store = Arc::new(OperatorStore::new(0));
        StripMesh::with_operators(task, plan, CaseOperators::new(&store))
    }

    /// Meshes every patch of the footprint; the operator comes from those of the case.
    ///
    /// # Errors
    /// [`SolveError::Unmeshable`] if no strip meets a patch.
    pub fn with_operators(
        task: &RollingTask,
        plan: impl Into<MeshPlan>,
        operators: Arc<CaseOperators>,
    ) -> Result<StripMesh, SolveError> {
        let plan: MeshPlan = plan.into();
        // By the simplified theory all ellipses share one mesh.
        let like_circle = task.method == Method::Fastsim;
        let fitted = fitted_chords(task.footprint, &plan, like_circle)?;
        let Elasticity {
            shear_modulus,
            poisson_ratio,
            ..
        } = *task.elasticity;
        let (footprint, patches) = (task.footprint, task.footprint.patches());
        let chords: Vec<Chord> = fitted.iter().map(|f| f.chord).collect();
        let grading = match plan.pole {
            Some([x, _]) => Grading::about(x, plan.size.cells as usize),
            None => Grading::cosine(plan.size.cells as usize),
        };
        let mut mesh = Mesh::new(&chords, &grading);
        if plan.pole.is_some() {
            // In full slip the traction of a strip follows the slip at its load centre; sticking strips follow their mid-lines.
            mesh.load_y = fitted.iter().map(|f| f.load_y).collect();
        }
        let area = mesh.areas();
        let pressure = cell_pressures(footprint, &fitted, &mesh, &grading, &area);
        let largest = patches.iter().map(|p| p.pressure_max).fold(0.0, f64::max);
        let bound = bounds(task, &fitted, &mesh, &pressure, largest);
        // Pressures enter the equations only through the bounds, so the symmetry is that of the bounds.
        let mirror = mesh
            .mirror_line()
            .filter(|_| footprint.slip().is_none() && bounds_mirror(&mesh, &bound));
        let [x, y] = middle(&patches.iter().map(|p| p.extent).collect::<Vec<_>>());
        let scale = Scale {
            length: (patches.iter().map(|p| p.area).sum::<f64>() / PI).sqrt(),
            traction: task.friction.largest() * largest,
            shear_modulus: task.interface.reduction * shear_modulus,
            origin: [x, mirror.unwrap_or(y)],
        };
        let precision = task.resolution.precision();
        let mut normalised = mesh.normalised(scale.origin, 1.0 / scale.length);
        if precision == Precision::Single {
            normalised.round(COORDINATE_STEP);
        }
        let of_surface = |slip| surface_slips(&mesh, slip, scale.slip());
        let own_slip = footprint.slip().filter(|_| scale.traction > 0.0);
        let of_motion = footprint.slip_by_motion().filter(|_| scale.traction > 0.0);
        let slip_by_motion = of_motion.map(|slips| slips.each_ref().map(of_surface));
        let own_slip = own_slip.map(of_surface);
        let of_pressure = (task.is_coupled() && scale.traction > 0.0).then(|| {
            // A reduced shear modulus applies to tractions only.
            let unit = task.interface.reduction / scale.traction;
            let relative: Vec<f64> = pressure.iter().map(|p| p * unit).collect();
            pressure_slips(&normalised, task.elasticity.difference, &relative)
        });
        Ok(StripMesh {
            plan,
            mesh,
            pressure,
            unresolved: unresolved(footprint, &fitted),
            area,
            scale,
            normalised: Arc::new(normalised),
            bound,
            layer: task.interface.layer * scale.shear_modulus / scale.length,
            surface_slip: sum(of_pressure, own_slip)
                .filter(|slip| slip.iter().flatten().any(|part| *part != 0.0)),
            slip_by_motion,
            poisson_ratio,
            precision,
            // Dense matrices need all entries.
            mirrored: mirror.is_some() && task.method != Method::LiuHsu,
            operators,
        })
    }

    /// The operator of the dimensionless mesh, from the store or computed.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn operator(&self, monitor: &dyn Monitor) -> Result<Arc<StripOperator>, Stop> {
        let kind = OperatorKind {
            poisson_ratio: self.poisson_ratio,
            folded: self.mirrored,
            precision: self.precision,
        };
        self.operators.get(&self.normalised, kind, monitor)
    }

    /// The parity of the tractions under a dimensionless motion. `None` unless the mesh has a mirror line and the motion is symmetric or antisymmetric about it.
    pub fn parity(&self, motion: &Motion) -> Option<Parity> {
        if !self.mirrored {
            return None;
        }
        // Slips from the pressure of dissimilar bodies have the symmetry of a longitudinal creepage.
        let along = motion.creepage_x != 0.0 || self.surface_slip.is_some();
        let lateral = motion.creepage_y != 0.0 || motion.spin_per_mm != 0.0;
        match (along, lateral) {
            (_, false) => Some(Parity::Longitudinal),
            (false, true) => Some(Parity::Lateral),
            (true, true) => None,
        }
    }

    /// Cells of one patch.
    pub fn patch_cells(&self, patch: usize) -> std::ops::Range<usize> {
        let mut cells = self
            .mesh
            .segments
            .iter()
            .filter(|s| s.chord.patch == patch)
            .map(|s| s.cells.clone());
        let Some(first) = cells.next() else {
            return 0..0;
        };
        first.start..cells.next_back().map_or(first.end, |c| c.end)
    }

    /// Expands the unknowns of a parity, x then y, to the whole mesh.
    pub(crate) fn expand(&self, parity: Option<Parity>, values: &[f64]) -> [Vec<f64>; 2] {
        let (x, y) = values.split_at(values.len() / 2);
        match parity {
            None => [x, y].map(|values| values[..self.mesh.cells()].to_vec()),
            Some(Parity::Longitudinal) => [self.unfold(x, 1.0), self.unfold(y, -1.0)],
            Some(Parity::Lateral) => [self.unfold(x, -1.0), self.unfold(y, 1.0)],
        }
    }

    /// Expands the unknowns of a parity to the whole mesh for a quantity that is equal in both halves.
    pub(crate) fn whole(&self, parity: Option<Parity>, values: &[f64]) -> Vec<f64> {
        match parity {
            Some(_) => self.unfold(values, 1.0),
            None => values[..self.mesh.cells()].to_vec(),
        }
    }

    /// Continues values of the first half of the segments to the mirrored half, multiplied by `sign`.
    pub fn unfold(&self, half: &[f64], sign: f64) -> Vec<f64> {
        let cells = self.mesh.cells();
        let mut values = vec![0.0; cells];
        for segment in &self.mesh.segments[..self.mesh.segments.len() / 2] {
            let image = cells - segment.cells.end;
            for (k, i) in segment.cells.clone().enumerate() {
                values[i] = half[i];
                values[image + k] = sign * half[i];
            }
        }
        values
    }
}

/// Mean slips of the cells in units of `unit`, along x and across.
fn surface_slips(mesh: &Mesh, slip: &SurfaceSlip, unit: f64) -> [Vec<f64>; 2] {
    let y = mesh.cell_load_y();
    let of = |i: usize| slip.mean([mesh.left[i], mesh.right[i]], y[i]);
    let slips: Vec<[f64; 2]> = (0..mesh.cells()).map(of).collect();
    [0, 1].map(|k| slips.iter().map(|slip| slip[k] / unit).collect())
}

/// The sum of two slips, either of which may be absent.
fn sum(one: Option<[Vec<f64>; 2]>, other: Option<[Vec<f64>; 2]>) -> Option<[Vec<f64>; 2]> {
    match (one, other) {
        (Some(one), Some(other)) => Some([0, 1].map(|axis| {
            let cells = one[axis].iter().zip(&other[axis]);
            cells.map(|(a, b)| a + b).collect()
        })),
        (one, other) => one.or(other),
    }
}

/// Number of samples across a strip if the coefficient of friction varies across.
const FRICTION_SAMPLES: usize = 16;

/// Dimensionless friction bounds of the cells: the load-weighted mean coefficient of the strip times the pressure.
fn bounds(
    task: &RollingTask,
    fitted: &[StripChord],
    mesh: &Mesh,
    pressure: &[f64],
    largest: f64,
) -> Vec<f64> {
    let mut bound = Vec::with_capacity(pressure.len());
    for (segment, fitted) in mesh.segments.iter().zip(fitted) {
        let loads = match task.friction.across() {
            None => Vec::new(),
            Some(_) => fitted.loads(task.footprint, segment.chord.patch, FRICTION_SAMPLES),
        };
        let share = task.friction.share(loads.iter().copied());
        let cells = pressure[segment.cells.clone()].iter();
        bound.extend(cells.map(|pressure| share * pressure / largest));
    }
    bound
}

/// The fitted chords of all patches.
///
/// # Errors
/// [`SolveError::Unmeshable`] if no strip meets a patch.
fn fitted_chords(
    footprint: &Footprint,
    plan: &MeshPlan,
    like_circle: bool,
) -> Result<Vec<StripChord>, SolveError> {
    let strips = plan.size.strips;
    let mut fitted = Vec::new();
    for (k, patch) in footprint.patches().iter().enumerate() {
        let [low, high] = [patch.extent[2], patch.extent[3]];
        let edges = match plan.pole {
            Some([_, y]) => strips_about(y, low, high, strips as usize),
            None => equal_strips(low, high, strips as usize),
        };
        let chords = load_ellipse::chords(footprint, k, &edges, like_circle);
        if chords.is_empty() {
            return Err(SolveError::Unmeshable { patch: k, strips });
        }
        fitted.extend(chords);
    }
    Ok(fitted)
}

/// Mean pressures of the cells. They are scaled to the load of their strip unless the patch is Hertz's ellipse, whose line loads are smooth enough, and
/// finally to the normal force of the patch.
fn cell_pressures(
    footprint: &Footprint,
    fitted: &[StripChord],
    mesh: &Mesh,
    grading: &Grading,
    area: &[f64],
) -> Vec<f64> {
    // All lines are divided alike, so the shares of a semi-ellipse are computed once.
    let known = footprint.ellipse();
    let known = known.map(|ellipse| (ellipse, Ellipse::profile(&grading.edges)));
    let patches = footprint.patches();
    let mut load = vec![0.0; patches.len()];
    let mut pressure = vec![0.0; mesh.cells()];
    for (segment, fitted) in mesh.segments.iter().zip(fitted) {
        let mut carried = 0.0;
        for (k, i) in segment.cells.clone().enumerate() {
            pressure[i] = match &known {
                Some((ellipse, profile)) => {
                    fitted.stretch() * ellipse.largest_on(&fitted.line) * profile[k]
                }
                None => fitted.mean_pressure(footprint, mesh.left[i], mesh.right[i]),
            };
            carried += pressure[i] * area[i];
        }
        if let Some(strip) = fitted.load
            && !footprint.is_closed_form()
            && carried > 0.0
        {
            let strip = strip * segment.chord.dy;
            scale(&mut pressure[segment.cells.clone()], strip / carried);
            carried = strip;
        }
        load[segment.chord.patch] += carried;
    }
    for segment in &mesh.segments {
        let patch = segment.chord.patch;
        if load[patch] > 0.0 {
            let factor = patches[patch].normal_force / load[patch];
            scale(&mut pressure[segment.cells.clone()], factor);
        }
    }
    pressure
}

/// The share of the load of every patch that its strips cannot place.
fn unresolved(footprint: &Footprint, fitted: &[StripChord]) -> Vec<f64> {
    let patches = footprint.patches().len();
    if footprint.is_closed_form() {
        return vec![0.0; patches];
    }
    let share = |patch: usize| {
        let own = fitted.iter().filter(|strip| strip.line.patch == patch);
        let (mut load, mut unresolved) = (0.0, 0.0);
        for strip in own {
            load += strip.load.unwrap_or(0.0) * strip.line.dy;
            unresolved += strip.unresolved * strip.line.dy;
        }
        if load > 0.0 { unresolved / load } else { 0.0 }
    };
    (0..patches).map(share).collect()
}

fn scale(values: &mut [f64], factor: f64) {
    values.iter_mut().for_each(|value| *value *= factor);
}

/// Whether the bounds of mirrored cells agree within 1e-9 of the largest bound.
fn bounds_mirror(mesh: &Mesh, bound: &[f64]) -> bool {
    let tolerance = 1e-9 * bound.iter().copied().fold(0.0, f64::max);
    let m = mesh.segments.len();
    mesh.segments[..m / 2]
        .iter()
        .zip(mesh.segments.iter().rev())
        .all(|(here, there)| {
            let pairs = bound[here.cells.clone()]
                .iter()
                .zip(&bound[there.cells.clone()]);
            pairs.into_iter().all(|(a, b)| (a - b).abs() <= tolerance)
        })
}

/// Middle of the box around all patches.
fn middle(extents: &[[f64; 4]]) -> [f64; 2] {
    let low = |k: usize| extents.iter().map(|e| e[k]).fold(f64::INFINITY, f64::min);
    let high = |k: usize| {
        extents
            .iter()
            .map(|e| e[k])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    [0.5 * (low(0) + high(1)), 0.5 * (low(2) + high(3))]
}
