//! Expected solve time of a case: that of one motion at its target or on its mesh, times motions and patches, plus that of the normal problem.
//!
//! The queue is ordered by these times; nothing else depends on them. Single cases differ from them by a factor of 3 and more, which
//! `cargo bench --bench stress -- --only times` prints by kind of case. `/v1/cases/check` measures instead: it solves a case for up to 0.2 s.

use crate::geometry::profile_quality::advised_smoothing;
use crate::method::Method;
use crate::normal::footprint::NormalTask;
use crate::normal::wheel::WheelTask;
use crate::post::subsurface::states::StressPlaces;
use crate::problem::checked_case::{self, CheckedCase, PRESSURE_USUAL};
use crate::problem::memory::{segments, usual_cells};
use crate::rolling::history::solve::usual_work;
use crate::rolling::task::{Resolution, TARGET_USUAL};

/// Time in s of a motion without spin on one patch at the target [`TARGET_USUAL`]. It grows with the square of the usual number of cells.
const MOTION_SECONDS: f64 = 3e-4;
/// Factor on the time for each property that makes a case slow: for a motion spin, a prescribed force or friction that depends on slip; for a
/// wheel other smoothings of its profiles or prescribed forces; for a wheelset the search for its pose.
const HARD_TIMES: f64 = 3.0;
/// Time in s of a motion by the table: twice the measured time of a row (`cargo bench --bench load -- rows`).
pub(crate) const TABLE_SECONDS: f64 = 5e-6;
/// Time in s of the normal problem of a gap with one patch, which grows with the square of the number of patches. The rigid wheelset at one shift and the search for
/// the worst point below a patch take about as long.
const GAP_SECONDS: f64 = 2.5e-3;
/// Time in s to find the worst passage below a patch by one criterion (`cargo bench --bench stress -- --only after`). The normal problem of a motion of unlike bodies
/// takes about as long (12 contacts of `tests/physics/unlike.rs`).
const PASSAGE_SECONDS: f64 = 0.04;

/// Returns the time in s of the normal problem.
fn normal_seconds(task: &NormalTask, patches: usize) -> f64 {
    match task {
        NormalTask::Hertz(_) | NormalTask::Given(_) => 0.0,
        NormalTask::Gap(_) => GAP_SECONDS * (patches as f64).powi(2),
        NormalTask::Wheel(task) => at_rest(task),
        NormalTask::Wheelset(task) => task.sides.iter().map(at_rest).sum(),
    }
}

/// Returns the time in s of the vertical equilibrium of a wheel, including other smoothings of profiles that are smoothed or should be.
fn at_rest(task: &WheelTask) -> f64 {
    let profiles = task.geometry.profiles();
    let levels = profiles.map(checked_case::noise_level);
    let read_again = task.trust.auto.contains(&true)
        || profiles.iter().any(|profile| profile.smoothing() > 0.0)
        || advised_smoothing(levels, task.contact_modulus, PRESSURE_USUAL) != [0.0; 2];
    // The equilibrium of a wheel on its rail takes several gaps.
    GAP_SECONDS * HARD_TIMES * if read_again { HARD_TIMES } else { 1.0 }
}

impl CheckedCase {
    /// Returns the expected time of this case in s, on one core of the machine on which the constants were measured.
    pub fn solve_seconds(&self) -> f64 {
        let patches = segments(&self.problem.task).len();
        let normal = normal_seconds(&self.problem.task, patches);
        let rolling = match (self.run.method, self.run.resolution) {
            _ if self.problem.history.is_some() => self.history_seconds(),
            (Method::BoundaryElement, Resolution::Target(target)) => {
                self.to_target(patches, target)
            }
            (method, _) => self.on_one_mesh(method),
        };
        let motions = self.problem.motions.len() as f64;
        let coupled = if self.problem.is_coupled(&self.run) {
            motions * PASSAGE_SECONDS
        } else {
            0.0
        };
        let after = motions * self.after_seconds(patches);
        let once = normal + rolling + coupled + after;
        let NormalTask::Wheelset(task) = &self.problem.task else {
            return once * self.problem.pull().map_or(1.0, |_| HARD_TIMES);
        };
        let kinematics = task.kinematics.as_ref().map_or(0.0, |asked| {
            GAP_SECONDS * (1.0 + 2.0 * asked.reach / asked.step)
        });
        once * HARD_TIMES * task.moves.len() as f64 + kinematics
    }

    /// Returns the time of motion `k` relative to that of an easy one.
    fn hardness(&self, k: usize) -> f64 {
        let problem = &self.problem;
        let forces = problem.forces.get(k);
        let is_hard = [
            problem.motions[k].spin_per_mm != 0.0,
            forces.is_some_and(|forces| *forces != [None; 2]) && problem.pull().is_none(),
            problem.friction.depends_on_slip() || problem.interface.yielding.is_some(),
        ];
        let factors = is_hard.map(|hard| if hard { HARD_TIMES } else { 1.0 });
        factors.iter().product()
    }

    /// Returns the time of a history: its steps on the usual mesh for a target, or on the given mesh and the coarser one before it.
    fn history_seconds(&self) -> f64 {
        let Some(history) = &self.problem.history else {
            return 0.0;
        };
        // Patches of unknown size are about 10 mm long.
        let extents = match self.problem.task.known_patches() {
            Some(patches) => patches.iter().map(|patch| patch.extent).collect(),
            None => vec![[-5.0, 5.0, -5.0, 5.0]],
        };
        let along = match self.run.resolution {
            Resolution::Target(_) => None,
            Resolution::Mesh(size) => Some(f64::from(size.cells)),
        };
        let (steps, usual) = usual_work(history, &extents, along);
        let cells = along.map_or(usual, |_| self.size_input().cells());
        // Fitted to 33 to 97 points of `tests/data/transient.json` on 72 to 1152 cells.
        steps * (5e-5 + 5e-9 * cells * cells)
    }

    fn to_target(&self, patches: usize, target: f64) -> f64 {
        // From this target on, the error bound of the table usually meets it.
        let by_table = target >= TARGET_USUAL && !self.run.needs_cells();
        let finer = (usual_cells(target) / usual_cells(TARGET_USUAL)).powi(2);
        let motions = 0..self.problem.motions.len();
        let seconds = motions.map(|k| match by_table && self.may_take_table(k) {
            true => TABLE_SECONDS,
            false => self.hardness(k) * MOTION_SECONDS * finer * patches as f64,
        });
        seconds.sum()
    }

    fn on_one_mesh(&self, method: Method) -> f64 {
        let cells = self.size_input().cells();
        let each = match method {
            Method::BoundaryElement => 3e-8 * cells * cells,
            Method::LiuHsu => 1.5e-9 * (2.0 * cells).powi(3),
            Method::Fastsim => 1e-5 + 5e-9 * cells,
            Method::Table => TABLE_SECONDS,
        };
        let motions = 0..self.problem.motions.len();
        motions.map(|k| each * self.hardness(k)).sum()
    }

    /// Returns the time in s of the stresses below the patches for one motion. Other outputs take less than 0.1 ms.
    fn after_seconds(&self, patches: usize) -> f64 {
        let Some(task) = &self.run.after.subsurface else {
            return 0.0;
        };
        let patches = patches as f64;
        let (count, below_worst) = match &task.places {
            StressPlaces::Points(points) => (points.len() as f64, false),
            StressPlaces::BelowWorst(depths) => (patches * depths.len() as f64, true),
        };
        let mut seconds = 4e-7 * count;
        if task.worst || below_worst || task.passage.is_some() {
            seconds += GAP_SECONDS * patches;
        }
        if let Some(passage) = task.passage {
            let criteria = 1 + u8::from(passage.dang_van_slope.is_some());
            seconds += PASSAGE_SECONDS * f64::from(criteria) * patches;
        }
        seconds
    }

    /// Returns the estimated memory and time of this solve.
    pub fn cost(&self) -> Cost {
        let size = self.size_input();
        Cost {
            bytes: size.bytes() as u64,
            operator_store_bytes: size.stored() as u64,
            seconds: self.solve_seconds(),
        }
    }
}

/// The estimated cost of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// The part of `bytes` in the operator store of the process.
    pub operator_store_bytes: u64,
    /// Rough solve time in s on one core of the machine on which the constants were measured.
    pub seconds: f64,
}

impl Cost {
    /// Returns the memory in bytes outside the operator store, which other cases do not share.
    pub fn own_bytes(&self) -> u64 {
        self.bytes.saturating_sub(self.operator_store_bytes)
    }
}
