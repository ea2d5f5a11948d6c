//! Assembles the answer from the results of the stages, with the requested outputs only.

use std::sync::{Arc, Weak};

use crate::case::words::solver::Output;
use crate::friction::law::FrictionLaw;
use crate::half_space::unlike_bodies::Elasticity;
use crate::monitor::{Monitor, Stop};
use crate::normal::footprint::NormalTask;
use crate::normal::hertz::Patch;
use crate::normal_stage::SolvedFootprint;
use crate::post::local_power::SolvedMotion;
use crate::problem::checked_case::CheckedCase;
use crate::remark::entry::{RemarkEntry, merged};
use crate::remark::list::Remark;
use crate::rolling::answer::{
    HistoryAnswer, MotionAnswer, PatchGradients, Resultants, SolvedFields,
};
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{Motion, RelativeTo};
use crate::solution::finish::{patch_cells, share_seconds, traction_max, with_tractions};
use crate::solution::maintain;
use crate::solution::words::answer::{
    CombinedMaterial, ErrorEstimate, Fields, GradientErrors, Gradients, HistoryPoint, MeshReport,
    NormalisedMotion, Origin, PatchFields, PatchSolution, PointFields, PointSolution, Solution,
    SolverReport, Total,
};

/// The description of axes and signs in an answer.
const FRAME: &str = "x along rolling (leading edge at larger x), y to the left, z up out of the lower body; forces, moments \
                     and tractions act on the lower body, slip is that of the upper body relative to the lower one";

/// The answer to a problem, built motion by motion. It keeps only what the answer contains.
#[derive(Debug)]
pub struct Assembly<'a> {
    case: &'a CheckedCase,
    solved: &'a SolvedFootprint,
    patches: Vec<Patch>,
    /// Friction limits of the patches in N.
    limits: Vec<f64>,
    /// Load centres `[x, y]` of the patches in mm.
    centres: Vec<[f64; 2]>,
    /// The results of each patch under each motion.
    points: Vec<Vec<PointSolution>>,
    total: Vec<Total>,
    remarks: Vec<RemarkEntry>,
    fields: Fields,
    /// The meshes whose cells are in `fields`.
    levels: Vec<Weak<StripMesh>>,
}

impl<'a> Assembly<'a> {
    /// Creates an answer without motions.
    pub fn new(case: &'a CheckedCase, solved: &'a SolvedFootprint) -> Assembly<'a> {
        let patches = solved.footprint.patches().to_vec();
        let limit = |k| case.problem.friction.limit(&solved.footprint, k);
        let remarks = case.remarks.iter().chain(&solved.remarks);
        let field = solved.footprint.field();
        let centre = |k| field.map_or([0.0; 2], |field| field.load_centre(Some(k)));
        Assembly {
            case,
            solved,
            points: vec![Vec::new(); patches.len()],
            limits: (0..patches.len()).map(limit).collect(),
            centres: (0..patches.len()).map(centre).collect(),
            patches,
            total: Vec::new(),
            remarks: remarks.cloned().collect(),
            fields: Fields::default(),
            levels: Vec::new(),
        }
    }

    /// Adds the next motion, with the mesh of its fields.
    ///
    /// # Errors
    /// The monitor stopped the work.
    pub fn add(
        &mut self,
        level: Option<&Arc<StripMesh>>,
        point: &MotionAnswer,
        monitor: &dyn Monitor,
    ) -> Result<(), Stop> {
        let case = self.case;
        let fields = point.fields.as_ref();
        let on_level = level.map(Arc::as_ref).zip(fields);
        let index = self.total.len();
        let limit = self.limits.iter().sum();
        let allowed = case.run.allowed_error(point, limit);
        let target_met = allowed.map(|allowed| point.error().is_some_and(|error| error <= allowed));
        self.remarks.extend(remarks(case, index, point, limit));
        let patches = self.patches.iter().zip(&self.limits).enumerate();
        let mut points: Vec<PointSolution> = patches
            .map(|(k, (patch, limit))| PointSolution {
                target_met,
                ..point_solution(case, on_level, (patch, *limit, self.centres[k]), k, point)
            })
            .collect();
        let speed = case.problem.speeds[index];
        maintain::add_damage(case, &self.patches, &self.limits, speed, &mut points);
        if let Some((level, fields)) = level.zip(fields) {
            let solved = SolvedMotion {
                footprint: &self.solved.footprint,
                level,
                answer: &fields.tangential,
                motion: &point.motion,
                method: point.method,
                speed,
            };
            let is_of_history = point.history.is_some();
            let (kept, remarks) =
                maintain::add_rest(case, solved, is_of_history, &mut points, monitor)?;
            let number = case.problem.part.before + index;
            self.remarks
                .extend(remarks.into_iter().map(|r| r.at_point(number)));
            if wants_fields(case) {
                self.add_fields(level, fields, kept);
            }
        }
        self.total.push(total(&self.patches, &self.limits, point));
        for (all, point) in self.points.iter_mut().zip(points) {
            all.push(point);
        }
        Ok(())
    }

    /// Adds the values per cell of the next motion. Motions that were solved on one level share its cells.
    fn add_fields(&mut self, level: &Arc<StripMesh>, found: &SolvedFields, kept: Vec<PointFields>) {
        let case = self.case;
        let count = self.patches.len();
        self.fields.patches.resize_with(count, PatchFields::default);
        // Most motions share the mesh of the previous one.
        let own = Arc::downgrade(level);
        let known = self.levels.iter().rposition(|known| known.ptr_eq(&own));
        let mesh = known.unwrap_or(self.levels.len());
        if known.is_none() {
            self.levels.push(own);
        }
        let patches = self.fields.patches.iter_mut().zip(kept).enumerate();
        for (index, (fields, kept)) in patches {
            if known.is_none() {
                fields.meshes.push(patch_cells(case, level, index));
            }
            let kept = PointFields { mesh, ..kept };
            let cells = level.patch_cells(index);
            let values = with_tractions(case, level, cells, &found.tangential, kept);
            fields.points.push(values);
        }
    }

    /// Returns the answer. Its patches share the wall times of the motions.
    pub fn finish(self) -> (Solution, Fields) {
        let case = self.case;
        let patches = self.patches.iter().zip(self.limits).zip(self.points);
        let mut solution = Solution {
            patches: patches
                .map(|((patch, limit), points)| patch_solution(patch, limit, points))
                .collect(),
            total: self.total,
            remarks: merged(self.remarks),
            normal: self.solved.report,
            origin: Origin {
                x_mm: 0.0,
                y_mm: 0.0,
                meaning: if self.solved.footprint.is_closed_form() {
                    "centre of the contact ellipse"
                } else {
                    "origin of the given coordinates, for all patches"
                }
                .to_owned(),
            },
            frame: FRAME.to_owned(),
            material: CombinedMaterial {
                shear_modulus_mpa: case.problem.elasticity.shear_modulus,
                poisson_ratio: case.problem.elasticity.poisson_ratio,
                difference_parameter: case.problem.elasticity.difference,
            },
            solver_version: env!("CARGO_PKG_VERSION").to_owned(),
            case_digest: case.label.digest.clone(),
            asked: Some(case.label.asked.clone()),
            damage_parameters: case
                .run
                .after
                .damage
                .as_ref()
                .map(|task| Box::new(task.figures.clone())),
            ..Solution::default()
        };
        share_seconds(&mut solution);
        (solution, self.fields)
    }
}

/// Whether an output is requested that the [`Fields`] contain.
fn wants_fields(case: &CheckedCase) -> bool {
    let kept = |output: &Output| output.is_per_cell() || *output == Output::Subsurface;
    case.run.outputs.iter().any(kept)
}

fn patch_solution(patch: &Patch, limit: f64, points: Vec<PointSolution>) -> PatchSolution {
    PatchSolution {
        normal_force_n: patch.normal_force,
        friction_limit_n: Some(limit),
        approach_mm: patch.approach,
        area_mm2: patch.area,
        pressure_max_mpa: patch.pressure_max,
        semi_axes_mm: patch.semi_axes,
        extent_mm: patch.extent,
        points,
        ..PatchSolution::default()
    }
}

fn point_solution(
    case: &CheckedCase,
    on_level: Option<(&StripMesh, &SolvedFields)>,
    (patch, limit, [x, y]): (&Patch, f64, [f64; 2]),
    index: usize,
    point: &MotionAnswer,
) -> PointSolution {
    let motion = &point.motion;
    let found = point.resultants[index];
    let zones = on_level
        .filter(|_| case.run.wants(Output::Zones))
        .map(|(level, fields)| {
            let cells = level.patch_cells(index);
            zones(level, patch, cells, &fields.tangential.slips)
        });
    let areas = zones.map(|(_, areas)| areas).or_else(|| {
        let stick = point.stick.as_ref()?[index];
        Some([stick, 1.0 - stick].map(|share| share * patch.area))
    });
    let history = point.history.as_ref();
    let power_x = motion.creepage_x * found.force_x;
    let power_y = motion.creepage_y * found.force_y;
    // Spin about the origin moves the load centre of a distant patch.
    let spin = motion.spin_per_mm;
    let [centre_x, centre_y] = [-spin * y * found.force_x, spin * x * found.force_y];
    let of_pressure = |(level, fields)| pressure_power(level, fields, index);
    let steady_power = || {
        let of_motion = power_x + power_y + motion.spin_per_mm * found.moment_z;
        of_motion + on_level.map_or(0.0, of_pressure)
    };
    PointSolution {
        motion: *motion,
        normalised: normalised(&case.problem.elasticity, patch.area, limit, motion),
        force_x_n: found.force_x,
        force_y_n: found.force_y,
        moment_z_n_mm: found.moment_z,
        error_estimate: point.errors[index]
            .map(|e| absolute(std::slice::from_ref(patch), limit, e)),
        stick_area_mm2: areas.map(|[stick, _]| stick),
        slip_area_mm2: areas.map(|[_, slip]| slip),
        gradients: point
            .gradients
            .as_ref()
            .filter(|_| case.run.wants(Output::Gradients))
            .map(|gradients| {
                Box::new(gradient_words(
                    case,
                    patch,
                    limit,
                    point,
                    index,
                    gradients[index],
                ))
            }),
        stick_cells: zones.map(|([stick, _], _)| stick),
        slip_cells: zones.map(|([_, slip], _)| slip),
        traction_max_mpa: on_level.map(|(level, fields)| traction_max(level, fields, index)),
        friction_power_n: history.map_or_else(steady_power, |history| history.power[index]),
        friction_power_without_spin_n: (power_x + centre_x).abs() + (power_y + centre_y).abs(),
        solver: SolverReport {
            method: point.method.into(),
            mesh: on_level.map(|(level, _)| MeshReport {
                strips: level.plan.size.strips,
                cells: level.plan.size.cells,
            }),
            iterations: point.work.iterations,
            products: point.work.products,
            residual: point.work.residual,
            skipped: point
                .skips
                .iter()
                .map(|skip| skip.text().to_owned())
                .collect(),
            seconds: point.seconds,
        },
        saturated: point.saturated,
        history: history.map(|history| HistoryPoint::of(history, index)),
        ..PointSolution::default()
    }
}

/// Returns the derivatives of a patch. Those by the normal force follow from similarity: for a Hertz contact F = μN f(ξ, η, ψ) and
/// M = μN c m(ξ, η, ψ), where c ∝ N^⅓, ξ and η ∝ ν/N^⅓, and ψ does not depend on N.
fn gradient_words(
    case: &CheckedCase,
    patch: &Patch,
    limit: f64,
    point: &MotionAnswer,
    index: usize,
    found: PatchGradients,
) -> Gradients {
    let problem = &case.problem;
    let is_similar = matches!(problem.task, NormalTask::Hertz(_))
        && matches!(problem.friction, FrictionLaw::Constant(_))
        && problem.interface.layer == 0.0
        && problem.interface.yielding.is_none()
        && problem.elasticity.difference == 0.0;
    let creepages = [point.motion.creepage_x, point.motion.creepage_y];
    let by_normal_force = |of: [f64; 3], by_creepage: &[[f64; 3]; 3], creepages: [f64; 2]| {
        let powers = [1.0, 1.0, 4.0 / 3.0];
        is_similar.then(|| {
            [0, 1, 2].map(|row| {
                let slopes = by_creepage[row];
                let moved = creepages[0] * slopes[0] + creepages[1] * slopes[1];
                (powers[row] * of[row] - moved / 3.0) / patch.normal_force
            })
        })
    };
    let own = point.resultants[index];
    let own = [own.force_x, own.force_y, own.moment_z];
    let [force_x_n, force_y_n, moment_z_n_mm] = found.values;
    let error_estimate = found.errors.map(|errors| {
        let own = point.errors[index]
            .map(|error| absolute(std::slice::from_ref(patch), limit, error))
            .unwrap_or_default();
        let own = [own.force_x_n, own.force_y_n, own.moment_z_n_mm];
        let [force_x_n, force_y_n, moment_z_n_mm] = errors;
        GradientErrors {
            force_x_n,
            force_y_n,
            moment_z_n_mm,
            // Errors add up.
            by_normal_force: by_normal_force(own, &errors, creepages.map(|part| -part.abs())),
        }
    });
    let by_normal_force = by_normal_force(own, &found.values, creepages);
    Gradients {
        force_x_n,
        force_y_n,
        moment_z_n_mm,
        by_normal_force,
        error_estimate,
    }
}

/// Counts the cells that stick and those that slip, and computes the areas of both zones in mm², scaled so that they add up to the area of the
/// patch.
fn zones(
    level: &StripMesh,
    patch: &Patch,
    cells: std::ops::Range<usize>,
    slips: &[bool],
) -> ([u32; 2], [f64; 2]) {
    let (mut counts, mut areas) = ([0; 2], [0.0; 2]);
    for i in cells {
        counts[usize::from(slips[i])] += 1;
        areas[usize::from(slips[i])] += level.area[i];
    }
    let factor = patch.area / (areas[0] + areas[1]);
    (counts, areas.map(|area| area * factor))
}

/// Returns the power of a patch in N from the slip that the pressure of unlike bodies causes. The moment that resists rolling supplies it.
fn pressure_power(level: &StripMesh, fields: &SolvedFields, patch: usize) -> f64 {
    let Some([x, y]) = &level.surface_slip else {
        return 0.0;
    };
    let [tx, ty] = &fields.tangential.traction;
    let of_cell = |i: usize| level.area[i] * (tx[i] * x[i] + ty[i] * y[i]);
    let sum: f64 = level.patch_cells(patch).map(of_cell).sum();
    sum * level.scale.traction * level.scale.slip()
}

/// Makes creepages dimensionless with E = 2G(1+ν) and c = √(A/π) (Kalker 1990).
pub(crate) fn normalised(
    elasticity: &Elasticity,
    area: f64,
    limit: f64,
    motion: &Motion,
) -> NormalisedMotion {
    let c = (area / std::f64::consts::PI).sqrt();
    let unit = 2.0 * elasticity.contact_modulus() * c * c / limit;
    let scaled = |value: f64| (limit > 0.0).then_some(value * unit);
    NormalisedMotion {
        creepage_x: scaled(motion.creepage_x),
        creepage_y: scaled(motion.creepage_y),
        spin: scaled(motion.spin_per_mm * c),
        length_mm: c,
    }
}

/// Converts an error relative to a friction limit to absolute errors. The error of the moment grows with the distance of the patches from the
/// origin.
fn absolute(patches: &[Patch], limit: f64, relative: f64) -> ErrorEstimate {
    let (mut area, mut reach) = (0.0, 0.0_f64);
    for patch in patches {
        area += patch.area;
        let middle = (0.5 * (patch.extent[0] + patch.extent[1]))
            .hypot(0.5 * (patch.extent[2] + patch.extent[3]));
        reach = reach.max(middle);
    }
    let length = (area / std::f64::consts::PI).sqrt();
    ErrorEstimate {
        force_x_n: relative * limit,
        force_y_n: relative * limit,
        moment_z_n_mm: relative * limit * (length + reach),
    }
}

fn total(patches: &[Patch], limits: &[f64], point: &MotionAnswer) -> Total {
    let sum: Resultants = point.resultants.iter().sum();
    Total {
        force_x_n: sum.force_x,
        force_y_n: sum.force_y,
        force_z_n: None,
        moment_z_n_mm: sum.moment_z,
        profile_uncertainty: None,
        error_estimate: point
            .error()
            .map(|e| absolute(patches, limits.iter().sum(), e)),
    }
}

/// Returns the remarks on motion `index` of the problem, with its number in the case.
fn remarks(
    case: &CheckedCase,
    index: usize,
    point: &MotionAnswer,
    limit: f64,
) -> impl Iterator<Item = RemarkEntry> {
    let own = point.remarks.iter().cloned();
    let missed = target_missed(case, point, limit);
    let large = error_large(case, point, limit);
    // The motions of all slices of a sweep are numbered consecutively.
    let number = case.problem.part.before + index;
    own.chain(unreachable(case, index, point))
        .chain(missed)
        .chain(large)
        .map(move |remark| remark.at_point(number))
}

fn unreachable(case: &CheckedCase, index: usize, point: &MotionAnswer) -> Option<Remark> {
    let [wanted_x_n, wanted_y_n] = case.problem.forces[index];
    let found: Resultants = point.resultants.iter().sum();
    point.saturated.then_some(Remark::ForceUnreachable {
        wanted_x_n,
        wanted_y_n,
        found_x_n: found.force_x,
        found_y_n: found.force_y,
    })
}

fn target_missed(case: &CheckedCase, point: &MotionAnswer, limit: f64) -> Option<Remark> {
    let target = case.run.resolution.target()?;
    let allowed = case.run.allowed_error(point, limit)?;
    let error = point.error();
    let (relative_to, estimate) = match case.run.relative_to {
        RelativeTo::FrictionLimit => ("μN", error),
        RelativeTo::Force => ("the force", error_of_force(point, limit)),
    };
    error
        .is_none_or(|error| error > allowed)
        .then_some(Remark::TargetMissed {
            relative_to,
            estimate,
            target,
        })
}

/// Returns the estimated error of the sum over the patches relative to its force; `None` if it is unknown or the force is 0.
fn error_of_force(point: &MotionAnswer, limit: f64) -> Option<f64> {
    let share = point.force_share(limit);
    point
        .error()
        .map(|error| error / share)
        .filter(|relative| relative.is_finite())
}

/// Largest error relative to the force without a remark.
const LARGE_FOR_FORCE: f64 = 0.1;

/// Returns the remark on an error that meets a target relative to μN but is large relative to the force.
fn error_large(case: &CheckedCase, point: &MotionAnswer, limit: f64) -> Option<Remark> {
    let target = case.run.resolution.target()?;
    let met = point.error().is_some_and(|error| error <= target);
    let of_limit = case.run.relative_to == RelativeTo::FrictionLimit;
    let error_over_force = error_of_force(point, limit)
        .filter(|relative| of_limit && met && *relative > LARGE_FOR_FORCE)?;
    Some(Remark::ErrorLargeForForce {
        error_over_force,
        force_over_limit: point.force_share(limit),
        usual_max: LARGE_FOR_FORCE,
    })
}

impl HistoryPoint {
    /// Returns the values of a patch at a point of a history.
    pub(crate) fn of(history: &HistoryAnswer, patch: usize) -> HistoryPoint {
        let [creepage_x_error, creepage_y_error] = history.creepage_errors;
        let [shift_x_error_mm, shift_y_error_mm] = history.shift_errors;
        let rolled = |error: Option<f64>| error.filter(|_| history.shift.is_none());
        let shifted = |error: Option<f64>| error.filter(|_| history.shift.is_some());
        HistoryPoint {
            distance_mm: history.distance,
            shift_x_mm: history.shift.map(|shift| shift.creepage_x),
            shift_y_mm: history.shift.map(|shift| shift.creepage_y),
            turn_rad: history.shift.map(|shift| shift.spin_per_mm),
            creepage_x_error: rolled(creepage_x_error),
            creepage_y_error: rolled(creepage_y_error),
            shift_x_error_mm: shifted(shift_x_error_mm),
            shift_y_error_mm: shifted(shift_y_error_mm),
            dissipated_n_mm: history.dissipated[patch],
        }
    }
}
