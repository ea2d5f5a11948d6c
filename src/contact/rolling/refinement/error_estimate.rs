//! The error of the resultants, estimated from two rules, two companion meshes, the level before and the cell that holds the centre of
//! the vortex.

use crate::contact::method::Method;
use crate::contact::normal::patch::Patch;
use crate::contact::rolling::answer::{LevelAnswer, LevelExit};
use crate::contact::rolling::mesh_plan::Regime;
use crate::contact::rolling::methods::{fastsim, full_slip};
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::motion_answer::RelativeErrors;
use crate::contact::rolling::refinement::caution::caution;
use crate::contact::rolling::refinement::companion_answer::CompanionAnswer;
use crate::contact::rolling::refinement::constants::{
    DATA, DECAY, DIFFERENCES, HERTZ, HERTZ_DECAY, JUMPING, LEVELS_LIKE, LEVELS_UNLIKE, LOAD,
    POLE_WEIGHT, REGION, REGION_CELLS, REGION_CELLS_FEW, REGION_POWER, SAMPLED, SAMPLED_DECAY,
    SURPRISES, WITHOUT_COMPANION,
};
use crate::contact::rolling::refinement::distances::distances;
use crate::contact::rolling::refinement::estimate_context::{CoarserLevel, EstimateContext};
use crate::contact::rolling::refinement::few_strips::few_strips;
use crate::contact::rolling::refinement::mesh_policy::CELLS_FIRST;
use crate::contact::rolling::refinement::regime::pole_error;
use crate::contact::rolling::refinement::table_check::TableCheck;
use crate::contact::rolling::refinement::without_companions::{dense_errors, mesh_errors};
use crate::contact::rolling::resolution::Resolution;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// The table is asked on a finer mesh if its own error is no more than this part of the target. Chosen by judgement; how much it matters was
/// not measured.
const TABLE_ROOM: f64 = 0.5;
/// Relative error where everything slips along the rigid slip.
const RIGID: f64 = 1e-6;

/// The quantities that the error of a solved level is estimated from, relative to μN (moment: μN√(A/π)), for every patch, then for the
/// sum. A difference of resultants counts by its largest component, since single components cross zero.
#[derive(Debug, Clone, PartialEq)]
pub enum Indicators {
    /// The error is known without companions.
    Known(RelativeErrors),
    /// The table of creep forces tells that the error meets the target.
    ByTable {
        /// What it says.
        table: TableCheck,
        /// The error by it.
        error: f64,
        /// Difference of the two rules, for a finer mesh.
        rules: Option<Vec<f64>>,
    },
    /// Differences whose root of squares, times a factor, is the estimate.
    Measured(Box<Measured>),
}

/// Differences that stand for the error of a level.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Between the two rules, or what is left of it from a coarser level; nothing if one of them did not converge.
    pub(super) rules: Option<Vec<f64>>,
    /// To the level before, weighted.
    before: Option<Vec<f64>>,
    /// To half the strips and to half the cells.
    pub(super) companions: [Option<Vec<f64>>; 2],
    /// A companion was tried and has no answer.
    pub(super) missing: bool,
    /// How far the resultants were extrapolated.
    extrapolated: Vec<f64>,
    /// From sampling the vortex of the tractions, weighted.
    pole: f64,
    /// Of the sums over cells, where everything slips.
    sums: Vec<f64>,
    /// Of region and pressure.
    normal: Vec<f64>,
    /// Of the iteration.
    tolerance: f64,
    /// The factor.
    pub(super) scale: f64,
    /// By how much what neighbours lent may be off.
    pub(super) lent: Vec<f64>,
    /// What the table says, and the error of the resultants by it.
    table: Option<(TableCheck, f64)>,
}

impl Indicators {
    /// Reads a solved level; `found` are the resultants of `answer` on it, not extrapolated.
    #[must_use]
    pub fn of_level(
        task: &RollingTask,
        level: &StripMesh,
        answer: &LevelAnswer,
        found: &[Resultants],
        context: EstimateContext,
    ) -> Indicators {
        let EstimateContext { motion, finer, .. } = context;
        let patches = task.footprint.patches();
        let none = vec![0.0; patches.len() + 1];
        let all = |value| Indicators::Known(vec![value; patches.len() + 1]);
        let sums = if turns_sliding(task, motion, answer) {
            sum_errors(task, patches, level, finer, motion)
        } else {
            none.clone()
        };
        match answer.exit {
            LevelExit::NoMotion | LevelExit::NoFriction => return all(Some(0.0)),
            LevelExit::RigidSlip => {
                return Indicators::Known(sums.iter().map(|e| Some(e.max(RIGID))).collect());
            }
            LevelExit::Solved => {}
        }
        if task.method == Method::Fastsim {
            // No mesh tells what the theory leaves out.
            return all(Some(fastsim::error_class(
                task.traction_bound,
                level.plan.size,
            )));
        }
        if task.method == Method::LiuHsu {
            return Indicators::Known(dense_errors(task, patches, found, context));
        }
        let rules = between_rules(task, level, answer, found, context.carried);
        let pole = if motion.spin_per_mm == 0.0 {
            0.0
        } else {
            pole_error(task, level, answer)
        };
        if matches!(task.resolution, Resolution::Mesh(_)) {
            let errors = mesh_errors(task, level, rules.as_deref(), &sums, pole, context);
            return Indicators::Known(errors);
        }
        let sticking = matches!(level.plan.regime, Regime::Sticking { .. });
        Indicators::Measured(Box::new(Measured {
            rules,
            before: context
                .before
                .map(|before| change(task, patches, level, found, before)),
            companions: [None, None],
            missing: false,
            extrapolated: none.clone(),
            lent: none,
            pole: if sticking { 0.0 } else { POLE_WEIGHT * pole },
            sums,
            normal: match finer.filter(|_| jumps(task)) {
                Some(finer) => data_errors(patches, [level, finer]),
                None => normal_errors(task, patches),
            },
            tolerance: context.tolerance,
            scale: scale(task, level, patches.len()),
            table: context.table,
        }))
    }

    /// Adds the difference of the resultants `found` to those of companion `k` (0: half the strips, 1: half the cells).
    pub fn see(
        &mut self,
        task: &RollingTask,
        k: usize,
        found: &[Resultants],
        seen: &CompanionAnswer,
    ) {
        let Indicators::Measured(measured) = self else {
            return;
        };
        match seen {
            CompanionAnswer::Untried => {}
            CompanionAnswer::Missing => measured.missing = true,
            CompanionAnswer::Found(other, reach) => {
                let patches = task.footprint.patches();
                let mut apart = distances(task, patches, found, other);
                apart.iter_mut().for_each(|d| *d *= reach);
                measured.companions[k] = Some(apart);
            }
        }
    }

    /// The difference of the two rules, measured or carried on from a coarser level.
    #[must_use]
    pub fn rules(&self) -> Option<&Vec<f64>> {
        match self {
            Indicators::Measured(measured) => measured.rules.as_ref(),
            Indicators::ByTable { rules, .. } => rules.as_ref(),
            Indicators::Known(_) => None,
        }
    }

    /// Whether a companion was tried and has no answer.
    #[must_use]
    pub fn companion_missing(&self) -> bool {
        matches!(self, Indicators::Measured(measured) if measured.missing)
    }

    /// Adds how far the resultants were extrapolated from those of the tractions: the error is taken as no less.
    pub fn apart(&mut self, task: &RollingTask, found: &[Resultants], summed: &[Resultants]) {
        if let Indicators::Measured(measured) = self {
            measured.extrapolated = distances(task, task.footprint.patches(), found, summed);
            if let Some((table, error)) = &mut measured.table {
                *error = table.error(task, found);
            }
        }
    }

    /// Does the table tell the error?
    #[must_use]
    pub(crate) fn is_by_table(&self) -> bool {
        matches!(self, Indicators::ByTable { .. })
    }

    /// What the error by the table would be on half as many cells, if it is the estimate: the resultants of the tractions are off about as 1
    /// over the number of cells.
    #[must_use]
    pub(crate) fn by_table_on_half(&self) -> Option<f64> {
        match self {
            Indicators::ByTable { table, error, .. } => {
                Some(table.with_distance_times(2.0, *error))
            }
            Indicators::Known(_) | Indicators::Measured(_) => None,
        }
    }

    /// How many times the target the error by the table is, if it exceeds it and could be told on a finer mesh.
    #[must_use]
    pub(crate) fn excess_by_table(&self, target: f64) -> Option<f64> {
        let Indicators::Measured(measured) = self else {
            return None;
        };
        let (table, error) = measured.table?;
        let room = table.with_distance_times(0.0, error) <= TABLE_ROOM * target;
        (room && error > target).then_some(error / target)
    }

    /// The estimates, see `error`.
    #[must_use]
    pub fn errors(&self) -> RelativeErrors {
        match self {
            Indicators::Known(errors) => errors.clone(),
            Indicators::ByTable { error, .. } => vec![Some(*error); 2],
            Indicators::Measured(measured) => (0..measured.sums.len())
                .map(|k| measured.error(k))
                .collect(),
        }
    }
}

impl Measured {
    /// The estimate for patch `k`, or for the sum. Once the companions are solved, the error by the table counts if it is smaller.
    fn error(&self, k: usize) -> Option<f64> {
        let by_table = self.table.map(|(_, error)| error.max(self.extrapolated[k]));
        let by_meshes = self.error_by_meshes(k);
        let compared = self.companions.iter().all(Option::is_some);
        match by_table.filter(|_| compared || self.missing) {
            Some(by_table) => Some(by_meshes.map_or(by_table, |error| error.min(by_table))),
            None => by_meshes,
        }
    }

    /// The root of the sum of the squares of all indicators, with one factor for all regimes, shapes and motions. Without companions it is
    /// a lower bound, by which a mesh can be refused.
    fn error_by_meshes(&self, k: usize) -> Option<f64> {
        let rules = DIFFERENCES * self.rules.as_ref()?[k];
        let rules = if self.missing {
            WITHOUT_COMPANION * rules
        } else {
            rules
        };
        let of = |values: &Option<Vec<f64>>| values.as_ref().map_or(0.0, |values| values[k]);
        let [across, along] = [0, 1].map(|c| DIFFERENCES * of(&self.companions[c]));
        let parts = [
            rules,
            of(&self.before),
            across,
            along,
            self.pole,
            self.sums[k],
            self.normal[k],
            self.tolerance,
        ];
        let squares: f64 = parts.iter().map(|part| part * part).sum();
        let whole = (self.scale * squares.sqrt()).hypot(self.lent[k]);
        Some(whole.max(self.extrapolated[k]))
    }
}

/// The factor on the root of the squares.
fn scale(task: &RollingTask, level: &StripMesh, patches: usize) -> f64 {
    let cells = level.mesh.cells() as f64 / patches.max(1) as f64;
    let finer = (CELLS_FIRST / cells).min(1.0);
    let (samples, decay) = match task.footprint.surprise() {
        Some(surprise) => {
            let [smooth, jumping] = SURPRISES;
            let between = ((surprise - smooth) / (jumping - smooth)).clamp(0.0, 1.0);
            let mixed = |smooth: f64, jumping: f64| smooth + between * (jumping - smooth);
            (mixed(SAMPLED, JUMPING), mixed(SAMPLED_DECAY, DECAY))
        }
        None if task.single_motion && task.footprint.is_closed_form() => (HERTZ, HERTZ_DECAY),
        None => (1.0, DECAY),
    };
    caution(task) * samples * finer.powf(decay) * few_strips(level).sqrt()
}

/// Is the pressure one that was given with jumps?
#[must_use]
pub fn jumps(task: &RollingTask) -> bool {
    task.footprint.jumps()
}

/// Errors of region and pressure that were found from a gap, and of the load they carry. The first falls as a power of the cells of the
/// normal problem across a patch.
fn normal_errors(task: &RollingTask, patches: &[Patch]) -> Vec<f64> {
    let Some(uncertainty) = task.footprint.uncertainty() else {
        return vec![0.0; patches.len() + 1];
    };
    let of = |cells: &f64| {
        let cells = cells.max(1.0);
        let region = REGION * (REGION_CELLS / cells).powf(REGION_POWER);
        let region = region * (1.0 + (REGION_CELLS_FEW / cells).powi(2));
        region.hypot(LOAD * uncertainty.load)
    };
    weighted(patches, uncertainty.cells_across.iter().map(of).collect())
}

/// Errors of sampling a pressure that jumps: the change of its moments to a level of twice as many strips and cells.
fn data_errors(patches: &[Patch], levels: [&StripMesh; 2]) -> Vec<f64> {
    let moments = |level: &StripMesh, k: usize| {
        let [x0, x1, y0, y1] = patches[k].extent;
        let (a, b) = (0.5 * (x1 - x0), 0.5 * (y1 - y0));
        let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
        let load_y = level.mesh.cell_load_y();
        let mut sums = [0.0; 2];
        for i in level.patch_cells(k) {
            let load = level.pressure[i] * level.area[i] / patches[k].normal_force;
            let centre = 0.5 * (level.mesh.left[i] + level.mesh.right[i]);
            sums[0] += load * (centre - x).abs() / a;
            sums[1] += load * ((load_y[i] - y) / b).powi(2);
        }
        sums
    };
    let errors = (0..patches.len()).map(|k| {
        let [here, finer] = levels.map(|level| moments(level, k));
        DATA * (here[0] - finer[0]).abs().max((here[1] - finer[1]).abs())
    });
    weighted(patches, errors.collect())
}

/// Errors of the patches, and of their sum by their loads.
fn weighted(patches: &[Patch], mut errors: Vec<f64>) -> Vec<f64> {
    let load: f64 = patches.iter().map(|patch| patch.normal_force).sum();
    let pairs = errors.iter().zip(patches);
    let sum: f64 = pairs
        .map(|(error, patch)| error * patch.normal_force / load)
        .sum();
    errors.push(sum);
    errors
}

/// The difference of the two rules, or what was `carried` on to a level of one rule.
pub(crate) fn between_rules(
    task: &RollingTask,
    level: &StripMesh,
    answer: &LevelAnswer,
    found: &[Resultants],
    carried: Option<&[f64]>,
) -> Option<Vec<f64>> {
    let Some(second) = &answer.second else {
        let carried = carried.filter(|_| answer.is_of_one_rule());
        return carried.map(<[f64]>::to_vec);
    };
    let patches = task.footprint.patches();
    let second: Vec<Resultants> = (0..patches.len())
        .map(|p| Resultants::of_patch(level, second, p))
        .collect();
    Some(distances(task, patches, found, &second))
}

/// The weighted change from the level before.
fn change(
    task: &RollingTask,
    patches: &[Patch],
    level: &StripMesh,
    found: &[Resultants],
    before: CoarserLevel,
) -> Vec<f64> {
    let factor = match (before.regime, level.plan.regime) {
        (Regime::Sticking { .. }, Regime::Sticking { .. })
        | (Regime::Spinning(_), Regime::Spinning(_)) => LEVELS_LIKE,
        (_, Regime::Sticking { .. }) => LEVELS_UNLIKE,
        _ => 0.0,
    };
    let mut change = distances(task, patches, found, before.summed);
    change.iter_mut().for_each(|d| *d *= factor * before.share);
    change
}

/// Does everything slip under spin? In full slip without spin all tractions point the same way, and cells of any size add up to the load.
pub(crate) fn turns_sliding(task: &RollingTask, motion: &Motion, answer: &LevelAnswer) -> bool {
    let turns = motion.spin_per_mm != 0.0 && !task.friction.is_frictionless();
    turns && answer.slips.iter().all(|slips| *slips)
}

/// Errors of the sums over cells, which both rules share: where everything slips along the rigid slip there is no other error. They are
/// estimated by the change to a level of four times as many cells if there is one, otherwise by integrals of the pressures.
fn sum_errors(
    task: &RollingTask,
    patches: &[Patch],
    level: &StripMesh,
    finer: Option<&StripMesh>,
    motion: &Motion,
) -> Vec<f64> {
    let on = |level: &StripMesh| -> Vec<Resultants> {
        let traction = full_slip::along_rigid_slip(level, &level.scale.motion(motion));
        (0..patches.len())
            .map(|p| Resultants::of_patch(level, &traction, p))
            .collect()
    };
    let cells = level.mesh.cells() / patches.len();
    let integral = |p: usize| {
        let coefficient = task.friction.largest();
        full_slip::sum_along_rigid_slip(task.footprint, p, motion, coefficient, cells)
    };
    let (exact, left) = match finer {
        Some(finer) => (on(finer), 4.0 / 3.0),
        None => ((0..patches.len()).map(integral).collect(), 1.0),
    };
    let mut errors = distances(task, patches, &on(level), &exact);
    errors.iter_mut().for_each(|e| *e *= left);
    errors
}
