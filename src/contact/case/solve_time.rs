//! How long a case will take, estimated before it is queued: from the patches it will have, the tractions of its motions, and the growth
//! of their time as the target falls.
//!
//! The figures are medians of random contacts. Single cases differ from them by a factor of about 2: either a mesh meets its target or
//! the next one is needed, which costs several times as much. `cargo bench --bench stress -- --only times` prints estimates beside
//! times, class by class.
//!
//! All numbers of this file were read off 2500 cases of that bench under a seed of their own, and off the random contacts of
//! `benches/calibrate` at three targets; the bench shows another seed. How far the share within a factor of 3 depends on each of them was
//! not measured.

use crate::contact::case::patch_guess::{
    MotionGuess, PatchGuess, TARGET_LEAST, TARGET_USUAL, Tractions,
};
use crate::contact::half_space::strip_operator::kind::Precision;
use crate::contact::method::Method;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::wheel_height::task::WheelTask;
use crate::contact::normal::wheel_height::wheelset_task::WheelsetMove;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::problem::profile_points;
use crate::contact::rolling::history::solve::usual_work;
use crate::contact::rolling::refinement::mesh_family::CELLS_MAX;
use crate::contact::rolling::resolution::{RelativeTo, Resolution};
use crate::contact::rolling::task::precision_of;

/// The time of a motion within a sweep relative to a single one, because tractions of the motion before are a start: where that is near, for
/// motions with and without spin, and elsewhere. Read off 60 creep curves of 20 to 3000 motions (`cargo bench --bench stress -- --only times`,
/// in view).
const NEAR_SHARES: [f64; 2] = [0.25, 0.12];
/// See [`NEAR_SHARES`].
const SWEEP_SHARE: f64 = 0.7;
/// Motions no farther apart are near (see `MotionGuess::distance`): a mesh serves the next motion as well.
const NEAR: f64 = 0.01;
/// Elsewhere, motions with spin want a mesh about their own pole, which costs the more the finer it is: times this power of how much finer
/// the target is than 0.005. Raised so that sweeps take what they did with another time of a single motion; not measured anew.
const SWEEP_SHARE_SPIN: f64 = 1.1;
/// See [`SWEEP_SHARE_SPIN`].
const SWEEP_SPIN_POWER: f64 = 0.9;
/// Where the table of creep forces tells the error, for targets from `BY_TABLE_FROM` on: time of a motion alone over that of one that is compared
/// with other meshes, and the same within a sweep. Chosen on the samples of `cargo bench --bench stress -- --only times`, in view: 62 % of the
/// creep curves are within a factor of 3 with them, 17 % without. What smaller changes do was not measured.
const BY_TABLE_TIMES: f64 = 0.5;
/// See [`BY_TABLE_TIMES`].
const BY_TABLE_SWEEP_TIMES: f64 = 0.25;
/// See [`BY_TABLE_TIMES`]. Below it the bound of the table, 0.0022 in the median, leaves little room. Chosen by judgement; how much it matters
/// was not measured.
const BY_TABLE_FROM: f64 = 0.003;
/// Least time in s of a motion within a sweep, on every patch; a third of what a creep map of 1000 motions at 0.005 takes for each. Chosen by
/// judgement; how much it matters was not measured.
const MOTION_SECONDS_MIN: f64 = 2e-5;
/// How many times longer motions take where a given pressure jumps. Where a sample may be anything beside its
/// neighbours, the number grows below `JUMP_TARGET` with this power of how much finer the target is: errors fall more slowly with the cells
/// than those of a smooth pressure. Of 63 jumping pressures of the seed 20261122 of the bench 76 % are within a factor of 3
/// without the power and 84 % with it; the powers 0.3 and 0.7 do no better.
const JUMP_TIMES: f64 = 4.0;
/// See [`JUMP_TIMES`].
const JUMP_TARGET: f64 = 0.02;
/// See [`JUMP_TIMES`].
const JUMP_POWER: f64 = 0.5;
/// The discontinuity (see `GridPressure::discontinuity`) from which on a sample may be anything; half of the jumping pressures have 1.
const JUMP_SURPRISE: f64 = 0.95;
/// Time of a product in double precision over that in single precision.
const DOUBLE_TIMES: f64 = 2.5;
/// Solves on an explicit mesh that the search for a prescribed force needs before the last one, on average.
const TRIALS: f64 = 3.0;
/// Least time of a solve, in s.
const SECONDS_MIN: f64 = 5e-5;
/// A motion by the table, with its place in the answer, in s; twice what a row of a run of a million takes on an idle machine
/// (`cargo bench --bench load -- rows`).
pub(crate) const TABLE_SECONDS: f64 = 5e-6;
/// Explicit meshes with so many cells have matrices that no cache holds.
const MESH_CELLS_SLOW: f64 = 1600.0;
/// Cells that a patch has at least.
const PATCH_CELLS_MIN: f64 = 64.0;
/// Time to gather and pack values per cell, in s.
const FIELDS_SECONDS_PER_CELL: f64 = 3e-7;

/// Time in s to find region and pressure of a gap on one grid, for every cell of it.
const GAP_CELL: f64 = 0.8e-6;
/// Time in s to find region and pressure where one grid cannot resolve all patches: two patches with a grid each, where one grid would need
/// `CELLS_TWO` cells along an axis, and the power of those cells that it grows with; up to `PATCHES_FEW` patches (single cases take 0.01 to
/// 3 s); and more patches, which stay on one grid. The first four were chosen on random gaps of two seeds of the stress bench (20261122 and
/// 20261123), both in view: two unequal patches within a factor of 3 of 89.1 and 89.9 % before, of 90.8 and 95.0 % with them; what smaller changes
/// do was not measured.
const GAP_TWO: f64 = 0.02;
/// See [`GAP_TWO`].
const CELLS_TWO: f64 = 350.0;
/// See [`GAP_TWO`].
const TWO_POWER: f64 = 0.7;
/// See [`GAP_TWO`].
const GAP_FEW: f64 = 0.1;
/// See [`GAP_TWO`].
const GAP_MANY: f64 = 0.027;
const PATCHES_FEW: usize = 6;
/// The same in s for a patch that is one on a coarse grid and falls apart on finer ones.
const GAP_ROUGH: f64 = 0.3;
/// Of the asperities that the samples of a rough line show and the patches that the coarse grid shows, the patches of the answer are the
/// geometric mean with this weight of the asperities: 30 gaps have 3 to 16 patches where the grid shows 3 to 8 and the samples 6 to 24.
const SUMMITS_WEIGHT: f64 = 0.4;
/// Most cells of a grid along an axis.
const GRID_CELLS_MAX: f64 = 200.0;
/// A line is rough if it turns at least this often across the contact and its teeth, of at least this height in units of the overlap, are
/// not pressed flat.
const TURNS_ROUGH: f64 = 12.0;
const TEETH_ROUGH: f64 = 4e-3;
/// Time in s to bring a wheel to rest on its rail once, with two grids for every height.
const WHEEL: f64 = 9e-3;

/// How often both wheels are solved until their heights agree with the roll, and until the rails balance a torque besides.
const ROUNDS_ROLL: f64 = 2.0;
const ROUNDS_TORQUE: f64 = 5.0;
/// Time in s to prepare the rigid wheelset, and to place it at one shift with two readings of its profiles.
const RIGID: f64 = 0.02;
const RIGID_SHIFT: f64 = 3e-3;

/// Patches of a contact, and the time in s to find region and pressure.
fn guesses(task: &NormalTask, target: Option<f64>) -> (Vec<PatchGuess>, f64) {
    match task {
        NormalTask::Hertz(ellipse) => (vec![PatchGuess::of_ellipse(ellipse)], 0.0),
        NormalTask::Given(field) => {
            let finer = (JUMP_TARGET / target.unwrap_or(JUMP_TARGET).max(TARGET_LEAST)).max(1.0);
            let times = match field.jump() {
                Some(_) if field.discontinuity() > JUMP_SURPRISE => {
                    JUMP_TIMES * finer.powf(JUMP_POWER)
                }
                Some(_) => JUMP_TIMES,
                None => 1.0,
            };
            let patches = field.patches();
            let guess = |patch| PatchGuess {
                times,
                ..PatchGuess::of_patch(patch)
            };
            (patches.iter().map(guess).collect(), 0.0)
        }
        NormalTask::Gap(task) => gap_guesses(task, target),
        NormalTask::Wheel(task) => {
            let solves = f64::from(1 + profile_points::readings_expected(task));
            (vec![PatchGuess::of_wheel(task)], WHEEL * solves)
        }
        NormalTask::Wheelset(task) => {
            let solves = |side: &WheelTask| f64::from(1 + profile_points::readings_expected(side));
            let solves: f64 = task.sides.iter().map(solves).sum();
            let patches = task.sides.iter().map(PatchGuess::of_wheel).collect();
            (patches, WHEEL * solves)
        }
    }
}

/// The patches of a gap, and the time to find them: from a solution on a coarse grid, or from the samples where these are rougher than
/// that grid can show.
fn gap_guesses(task: &GapTask, target: Option<f64>) -> (Vec<PatchGuess>, f64) {
    let preview = task.preview();
    let by_samples = |count: usize| vec![PatchGuess::of_gap(task, &preview, count); count];
    let growth = task.growth(target);
    let Some(coarse_solution) = task.coarse_solution() else {
        return (by_samples(preview.asperities), GAP_ROUGH * growth);
    };
    let rough = preview.turns > TURNS_ROUGH && preview.teeth > TEETH_ROUGH;
    let needed = coarse_solution
        .cells_needed
        .map(|cells| cells as f64 * growth.sqrt());
    let cells = needed.map(|cells| cells.min(GRID_CELLS_MAX));
    let seconds = match coarse_solution.patches.len() {
        1 if rough => GAP_ROUGH,
        1 | 2 if needed == cells => GAP_CELL * cells[0] * cells[1],
        1 | 2 => GAP_TWO * (needed[0].max(needed[1]) / CELLS_TWO).powf(TWO_POWER),
        count if count <= PATCHES_FEW => GAP_FEW,
        _ => GAP_MANY,
    };
    let patches = if rough && preview.asperities > coarse_solution.patches.len() {
        let [seen, asperities] =
            [coarse_solution.patches.len(), preview.asperities].map(|count| count as f64);
        by_samples((seen * (asperities / seen).powf(SUMMITS_WEIGHT)).round() as usize)
    } else {
        coarse_solution
            .patches
            .iter()
            .map(PatchGuess::of_pilot)
            .collect()
    };
    (patches, seconds)
}

/// Rounds of pressure and tractions of unlike bodies, and the time of one in s, most of it for pressure and opening of the gap (12
/// contacts of `tests/physics/unlike.rs`: 0.03 to 0.1 s in all).
const UNLIKE_ROUNDS: f64 = 3.0;
/// See [`UNLIKE_ROUNDS`].
const GAP_ROUND: f64 = 0.015;
/// Times longer of a round that seeks the creepages of a force: of four such motions of two of these contacts single ones took 0.02 to 1 s, the
/// longest without creepage and force at K = 0.25.
const UNLIKE_SOUGHT: f64 = 3.0;
/// Time of a motion whose surfaces slip by their pressure too over that of like bodies: rounds, and a displacement from the pressure of
/// every cell at the edges of all others (same contacts).
const UNLIKE_TIMES: f64 = 4.0;
/// Time of a motion with friction that falls with slip over that with a coefficient: 2.1 to 5.3 for the ten creep curves of
/// `tests/physics/friction_laws.rs` at the target 0.005, 3 in the median.
const FALLING_TIMES: f64 = 3.0;
/// The same with a layer between the bodies: 0.5 to 4 for its five contacts, where the mesh is finer for the factor on the estimate.
const LAYER_TIMES: f64 = 2.0;

/// Time in s of a step of a history, and for every square of its cells: 33 to 97 points of `tests/data/transient.json` on 72 to 1152 cells.
const STEP_SECONDS: f64 = 5e-5;
/// See [`STEP_SECONDS`].
const STEP_CELLS_SECONDS: f64 = 5e-9;
/// Times longer where the creepage of a step is sought.
const STEP_TRIALS: f64 = 2.0;

/// Solves of a wheel whose rail is to carry a longitudinal force: a coarse look, three to five trials and the answer.
/// Chosen by judgement; how much it matters was not measured.
const ROUNDS_PULL: f64 = 6.0;
/// The same for a lateral force, with coarse looks at both ends.
/// Chosen by judgement; how much it matters was not measured.
const ROUNDS_PULL_ACROSS: f64 = 8.0;
/// The same for both forces.
const ROUNDS_PULL_BOTH: f64 = 12.0;

/// The estimated time of a case, in s on one core of the machine the figures were taken on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveTime {
    /// To find region and pressure.
    pub normal: f64,
    /// For everything.
    pub whole: f64,
}

impl CheckedCase {
    /// Estimated time of this case.
    #[must_use]
    pub fn solve_time(&self) -> SolveTime {
        let (patches, normal) = guesses(&self.problem.task, self.run.resolution.target());
        let tangential = match (self.run.method, self.run.resolution) {
            _ if self.problem.history.is_some() => self.history_seconds(&patches),
            (Method::BoundaryElement, Resolution::Target(target)) => {
                self.to_target(&patches, target)
            }
            (method, _) => self.on_one_mesh(method, patches.len()),
        };
        let tangential = self.friction_times() * tangential;
        let (normal, tangential) = self.unlike_seconds([normal, tangential], patches.len());
        let motions = self.problem.motions.len() as f64;
        let after = motions * self.after_seconds(patches.len());
        let whole = normal + tangential + after;
        SolveTime {
            normal,
            whole: self.wheelset_seconds(self.pull_times() * whole),
        }
    }

    /// Solves of a wheel whose rail is to carry forces.
    fn pull_times(&self) -> f64 {
        match self.problem.pull() {
            Some([Some(_), Some(_)]) => ROUNDS_PULL_BOTH,
            Some([None, _]) => ROUNDS_PULL_ACROSS,
            Some(_) => ROUNDS_PULL,
            None => 1.0,
        }
    }

    /// The time of a whole wheelset in all its positions, from that of both wheels once.
    fn wheelset_seconds(&self, once: f64) -> f64 {
        let NormalTask::Wheelset(task) = &self.problem.task else {
            return once;
        };
        let rounds_of = |moving: &WheelsetMove| match moving.drive_torque {
            Some(_) => ROUNDS_TORQUE,
            None => ROUNDS_ROLL,
        };
        let rounds: f64 = task.moves.iter().map(rounds_of).sum();
        let kinematics = task.kinematics.as_ref().map_or(0.0, |asked| {
            RIGID + RIGID_SHIFT * (2.0 * asked.reach / asked.step)
        });
        once * rounds + kinematics
    }

    /// Times of the normal and the tangential problem where bodies differ: rounds belong to the motions, since each has a region of its own.
    fn unlike_seconds(&self, [normal, tangential]: [f64; 2], patches: usize) -> (f64, f64) {
        let coupled = self.run.method == Method::BoundaryElement;
        if self.problem.is_coupled(&self.run) {
            let sought = |k: usize| {
                if self.is_prescribed(k) {
                    UNLIKE_SOUGHT
                } else {
                    1.0
                }
            };
            let motions: f64 = (0..self.problem.motions.len()).map(sought).sum();
            let round = match self.problem.task {
                // Most of it is the search for the height, and rounds keep the load.
                NormalTask::Wheel(_) | NormalTask::Wheelset(_) => GAP_ROUND * patches as f64,
                _ => normal.max(GAP_ROUND),
            };
            let rounds = motions * UNLIKE_ROUNDS * round;
            (normal, rounds + UNLIKE_TIMES * tangential)
        } else if coupled && self.problem.elasticity.difference != 0.0 {
            (normal, UNLIKE_TIMES * tangential)
        } else {
            (normal, tangential)
        }
    }

    /// Time with the friction of the case over that with a coefficient.
    fn friction_times(&self) -> f64 {
        let interface = self.problem.interface;
        let falling = self.problem.friction.depends_on_slip() || interface.yielding.is_some();
        let layer = interface.layer > 0.0;
        let factor = |is_there, times| if is_there { times } else { 1.0 };
        factor(falling, FALLING_TIMES) * factor(layer, LAYER_TIMES)
    }

    fn is_prescribed(&self, k: usize) -> bool {
        let forces = self.problem.forces.get(k);
        self.problem.pull().is_none() && forces.is_some_and(|forces| *forces != [None; 2])
    }

    /// Time of a history: its steps on the level that a target usually leads to, or on the mesh given, with the coarser one before it.
    fn history_seconds(&self, patches: &[PatchGuess]) -> f64 {
        let Some(history) = &self.problem.history else {
            return 0.0;
        };
        let extent = |patch: &PatchGuess| {
            let [a, b] = patch.half;
            [-a, a, -b, b]
        };
        let extents: Vec<[f64; 4]> = patches.iter().map(extent).collect();
        let (steps, usual) = usual_work(history, &extents);
        let cells = match self.run.resolution {
            Resolution::Target(_) => usual,
            Resolution::Mesh(_) => self.size_input().cells(),
        };
        let trials = if self.is_prescribed(0) {
            STEP_TRIALS
        } else {
            1.0
        };
        SECONDS_MIN + steps * trials * (STEP_SECONDS + STEP_CELLS_SECONDS * cells * cells)
    }

    fn to_target(&self, patches: &[PatchGuess], target: f64) -> f64 {
        let precise = match precision_of(self.run.resolution) {
            Precision::Single => 1.0,
            Precision::Double => DOUBLE_TIMES,
        };
        let problem = &self.problem;
        let friction = problem.friction.largest();
        let crowd = crowd_seconds(patches.len());
        let finer = (TARGET_USUAL / target.max(TARGET_LEAST)).max(1.0);
        let spin_share = SWEEP_SHARE_SPIN * finer.powf(SWEEP_SPIN_POWER);
        let fields = FIELDS_SECONDS_PER_CELL * self.field_cells();
        let alone = problem.is_coupled(&self.run);
        let by_table = target >= BY_TABLE_FROM && problem.is_in_table();
        let mut before: Option<Vec<MotionGuess>> = None;
        let motions = problem.motions.iter().enumerate().map(|(k, motion)| {
            let prescribed = self.is_prescribed(k);
            let guess = |patch: &PatchGuess| {
                let to = |target| {
                    patch.seconds(target, &problem.elasticity, friction, motion, prescribed)
                };
                let mut first = to(target);
                let share = self.force_share(k, &first, friction * patch.force);
                // A motion with a small force is solved again.
                if self.run.relative_to == RelativeTo::Force && share < 1.0 {
                    first.seconds += to(share * target).seconds;
                }
                first
            };
            let guesses: Vec<MotionGuess> = patches.iter().map(guess).collect();
            let of_patch = |(at, guess): (usize, &MotionGuess)| {
                let told = by_table && !prescribed;
                let Some(before) = &before else {
                    let times = if told { BY_TABLE_TIMES } else { 1.0 };
                    return precise * times * guess.seconds;
                };
                let times = if told { BY_TABLE_SWEEP_TIMES } else { 1.0 };
                let spins = guess.tractions == Tractions::Spin;
                let share = if !prescribed && guess.distance(&before[at]) < NEAR {
                    NEAR_SHARES[usize::from(spins)]
                } else if spins {
                    spin_share
                } else {
                    SWEEP_SHARE
                };
                precise * (times * share * guess.seconds).max(MOTION_SECONDS_MIN)
            };
            let seconds: f64 = guesses.iter().enumerate().map(of_patch).sum();
            // Where each motion has a region of its own, none starts from another.
            before = (!alone).then_some(guesses);
            seconds.max(crowd) + fields
        });
        SECONDS_MIN + motions.sum::<f64>()
    }

    /// About the force of motion `k` over the friction limit of a patch in N: that prescribed, or that of the linear theory for a circle.
    fn force_share(&self, k: usize, guess: &MotionGuess, limit: f64) -> f64 {
        let [x, y] = self.problem.forces[k];
        if x.or(y).is_some() {
            return x.unwrap_or(0.0).hypot(y.unwrap_or(0.0)) / limit;
        }
        guess.linear_share()
    }

    /// Cells whose values are kept of a motion.
    fn field_cells(&self) -> f64 {
        self.size_input().field_cells()
    }

    fn on_one_mesh(&self, method: Method, patches: usize) -> f64 {
        let cells = self.size_input().cells();
        let fields = FIELDS_SECONDS_PER_CELL * self.field_cells();
        let (first, each) = match method {
            Method::BoundaryElement => {
                // Large matrices come from slower memory.
                let cache_misses = (cells / MESH_CELLS_SLOW).min(1.0);
                let each = 1e-9 * cells * cells * (15.0 + 60.0 * cache_misses);
                (1e-8 * cells * cells, each)
            }
            Method::LiuHsu => (4e-8 * cells * cells, 1.5e-9 * (2.0 * cells).powi(3)),
            Method::Fastsim => (1e-7 * cells, 1e-5 + 5e-9 * cells),
            Method::Table => (0.0, TABLE_SECONDS),
        };
        let motions = self.problem.motions.len();
        let first = match self.problem.is_coupled(&self.run) {
            true => first * motions as f64,
            false => first,
        };
        let prescribed = (0..motions).filter(|k| self.is_prescribed(*k)).count();
        let solves = motions as f64 + TRIALS * prescribed as f64;
        SECONDS_MIN * patches as f64 + first + each * solves + fields * motions as f64
    }
}

/// Time in s of a motion on many patches, which together need more cells than any target asks for, and more steps.
fn crowd_seconds(patches: usize) -> f64 {
    let cells = patches as f64 * PATCH_CELLS_MIN;
    if cells > f64::from(CELLS_MAX) / 4.0 {
        3e-7 * cells.powi(2)
    } else {
        0.0
    }
}
