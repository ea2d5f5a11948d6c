//! Expected solve time of a case, before it is queued: the time of one motion at its target or on its mesh, times motions and patches, plus
//! that of the normal problem.
//!
//! The queue is ordered by these times. `/v1/cases/check` measures instead: it solves a case for up to 0.2 s, which most cases need less than.
//! Single cases differ from the figures here by a factor of about 2 either way:
//! `cargo bench --bench stress -- --only times` prints the share within a factor of 3, kind by kind. The figures were read off that
//! bench under the seed 777, and are judged under others.

use crate::contact::half_space::strip_operator::kind::Precision;
use crate::contact::method::Method;
use crate::contact::normal::footprint::NormalTask;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::{Ellipse, NormalLoad};
use crate::contact::normal::wheel::{WheelTask, WheelsetMove};
use crate::contact::post::subsurface::states::StressPlaces;
use crate::contact::problem::checked_case;
use crate::contact::problem::checked_case::CheckedCase;
use crate::contact::rolling::history::solve::usual_work;
use crate::contact::rolling::task::{RelativeTo, Resolution, precision_of};

/// Time in s of a motion without spin on one patch at the target [`TARGET_USUAL`].
const MOTION_SECONDS: f64 = 3.5e-4;
const TARGET_USUAL: f64 = 0.005;
/// Power with which the time grows as the target falls.
const TARGET_POWER: f64 = 1.2;
/// Smaller targets cost no more: they end on the largest mesh.
const TARGET_LEAST: f64 = 1e-4;
/// Time with spin over that without.
const SPIN_TIMES: f64 = 3.0;
/// Length over width beyond which the time grows in proportion to it.
const LONG: f64 = 4.0;
/// Time of a motion after the first, which starts from the motion before, over that of the first.
const FOLLOWING_TIMES: f64 = 0.7;
/// Solves of a motion of which a force is prescribed.
const PRESCRIBED_TIMES: f64 = 2.0;
/// Time where a given pressure jumps over that of a smooth one.
const JUMP_TIMES: f64 = 4.0;
/// Time of a product in double precision over that in single precision.
const DOUBLE_TIMES: f64 = 2.5;
/// A motion by the table, with its place in the answer, in s; twice what a row of a run of a million takes on an idle machine
/// (`cargo bench --bench load -- rows`).
pub(crate) const TABLE_SECONDS: f64 = 5e-6;
/// Targets from here on are usually met by the bound of the creep table, 0.0023 in the median.
const TABLE_BOUND: f64 = 0.003;
/// Time in s to gather and pack the values of a cell.
const FIELDS_SECONDS_PER_CELL: f64 = 3e-7;
/// Time in s to find region and pressure of a gap with one patch; it grows with the square of their number.
const GAP_SECONDS: f64 = 1.5e-3;
/// Time in s to bring a wheel to rest on its rail.
const WHEEL_SECONDS: f64 = 9e-3;
/// A relative radius of curvature across a rail in mm, for the length over width of a patch that is not known yet.
const RAIL_RADIUS: f64 = 300.0;
/// Solves of a wheelset until the heights of both wheels agree with the roll, and until the rails balance a torque besides.
const ROUNDS_ROLL: f64 = 2.0;
const ROUNDS_TORQUE: f64 = 5.0;
/// Time in s to prepare the rigid wheelset, and to place it at one shift with two readings of its profiles.
const RIGID: f64 = 0.02;
const RIGID_SHIFT: f64 = 3e-3;
/// Solves of a wheel whose rail is to carry prescribed forces.
const ROUNDS_PULL: f64 = 8.0;
/// Time in s that pressure and opening of a gap take for each motion of unlike bodies, and the time of their tractions over that of like
/// bodies (12 contacts of `tests/physics/unlike.rs`).
const UNLIKE_SECONDS: f64 = 0.045;
const UNLIKE_TIMES: f64 = 4.0;
/// Time of a motion with friction that falls with slip over that with a coefficient (2.1 to 5.3 for the ten creep curves of
/// `tests/physics/friction_laws.rs` at the target 0.005), and with a layer between the bodies (0.5 to 4 for its five contacts).
const FALLING_TIMES: f64 = 3.0;
const LAYER_TIMES: f64 = 2.0;
/// Time in s of a step of a history, and for every square of its cells: 33 to 97 points of `tests/data/transient.json` on 72 to 1152 cells.
const STEP_SECONDS: f64 = 5e-5;
const STEP_CELLS_SECONDS: f64 = 5e-9;

/// The expected time of a case in s, on one core of the machine the figures were taken on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveTime {
    /// To find region and pressure.
    pub normal: f64,
    /// For everything.
    pub whole: f64,
}

/// Expected shapes of the patches, before the normal problem is solved.
#[derive(Debug, Clone)]
struct ExpectedPatches {
    /// Half-length and half-width in mm, patch by patch.
    half: Vec<[f64; 2]>,
    /// Time of a motion over that on ellipses.
    times: f64,
    /// Time in s to find region and pressure.
    normal: f64,
}

impl ExpectedPatches {
    fn of(task: &NormalTask) -> ExpectedPatches {
        let (half, times, normal) = match task {
            NormalTask::Hertz(ellipse) => (vec![[ellipse.a, ellipse.b]], 1.0, 0.0),
            NormalTask::Given(field) => {
                let half = |[x_min, x_max, y_min, y_max]: [f64; 4]| {
                    [0.5 * (x_max - x_min), 0.5 * (y_max - y_min)]
                };
                let patches = field.patches();
                let times = field.jump().map_or(1.0, |_| JUMP_TIMES);
                (
                    patches.iter().map(|patch| half(patch.extent)).collect(),
                    times,
                    0.0,
                )
            }
            NormalTask::Gap(task) => ExpectedPatches::of_gap(task),
            NormalTask::Wheel(task) => (vec![half_under(task)], 1.0, at_rest(task)),
            NormalTask::Wheelset(task) => {
                let normal = task.sides.iter().map(at_rest).sum();
                (task.sides.iter().map(half_under).collect(), 1.0, normal)
            }
        };
        ExpectedPatches {
            half,
            times,
            normal,
        }
    }

    fn of_gap(task: &GapTask) -> (Vec<[f64; 2]>, f64, f64) {
        let preview = task.preview();
        let count = preview.asperities;
        let half = preview.half.map(|half| half / (count as f64).sqrt());
        (vec![half; count], 1.0, GAP_SECONDS * (count as f64).powi(2))
    }
}

/// Half-length and half-width in mm of the patch under a wheel, on a rail of a usual radius.
fn half_under(task: &WheelTask) -> [f64; 2] {
    let radius = task.geometry.placement.rolling_radius;
    // Length over width does not depend on the load.
    let load = NormalLoad::Force(1e5);
    let ellipse = Ellipse::of_radii(radius, RAIL_RADIUS, load, task.contact_modulus);
    [ellipse.a, ellipse.b]
}

/// Time in s to bring a wheel to rest on its rail, with all the readings of its profiles.
fn at_rest(task: &WheelTask) -> f64 {
    WHEEL_SECONDS * f64::from(1 + checked_case::readings_expected(task))
}

impl CheckedCase {
    /// Expected time of this case.
    #[must_use]
    pub fn solve_time(&self) -> SolveTime {
        let patches = ExpectedPatches::of(&self.problem.task);
        let tangential = match (self.run.method, self.run.resolution) {
            _ if self.problem.history.is_some() => self.history_seconds(&patches),
            (Method::BoundaryElement, Resolution::Target(target)) => {
                self.to_target(&patches, target)
            }
            (method, _) => self.on_one_mesh(method),
        };
        let motions = self.problem.motions.len() as f64;
        let mut rolling = self.friction_times() * tangential;
        if self.run.method == Method::BoundaryElement && self.problem.elasticity.difference != 0.0 {
            rolling *= UNLIKE_TIMES;
        }
        if self.problem.is_coupled(&self.run) {
            rolling += motions * UNLIKE_SECONDS;
        }
        let after = motions * self.after_seconds(patches.half.len());
        let pull = self.problem.pull().map_or(1.0, |_| ROUNDS_PULL);
        SolveTime {
            normal: patches.normal,
            whole: self.wheelset_seconds(pull * (patches.normal + rolling + after)),
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

    /// Time with the friction of the case over that with a coefficient.
    fn friction_times(&self) -> f64 {
        let interface = self.problem.interface;
        let falling = self.problem.friction.depends_on_slip() || interface.yielding.is_some();
        let factor = |is_there, times| if is_there { times } else { 1.0 };
        factor(falling, FALLING_TIMES) * factor(interface.layer > 0.0, LAYER_TIMES)
    }

    /// Solves of motion `k`.
    fn solves(&self, k: usize) -> f64 {
        let forces = self.problem.forces.get(k);
        let prescribed = forces.is_some_and(|forces| *forces != [None; 2]);
        if prescribed && self.problem.pull().is_none() {
            PRESCRIBED_TIMES
        } else {
            1.0
        }
    }

    /// Time of a history: its steps on the level that a target usually leads to, or on the mesh given, with the coarser one before it.
    fn history_seconds(&self, patches: &ExpectedPatches) -> f64 {
        let Some(history) = &self.problem.history else {
            return 0.0;
        };
        let extents: Vec<_> = (patches.half.iter().map(|[a, b]| [-a, *a, -b, *b])).collect();
        let along = match self.run.resolution {
            Resolution::Target(_) => None,
            Resolution::Mesh(size) => Some(f64::from(size.cells)),
        };
        let (steps, usual) = usual_work(history, &extents, along);
        let cells = along.map_or(usual, |_| self.size_input().cells());
        let step = STEP_SECONDS + STEP_CELLS_SECONDS * cells * cells;
        steps * self.solves(0) * step
    }

    fn to_target(&self, patches: &ExpectedPatches, target: f64) -> f64 {
        let problem = &self.problem;
        let fields = FIELDS_SECONDS_PER_CELL * self.size_input().field_cells();
        let precise = match precision_of(self.run.resolution) {
            Precision::Single => 1.0,
            Precision::Double => DOUBLE_TIMES,
        };
        // Small forces are solved again at a smaller target.
        let again = match self.run.relative_to {
            RelativeTo::Force => 2.0,
            RelativeTo::FrictionLimit => 1.0,
        };
        let by_table = target >= TABLE_BOUND && !self.run.needs_cells();
        let finer = (TARGET_USUAL / target.max(TARGET_LEAST)).powf(TARGET_POWER);
        let usual = MOTION_SECONDS * finer * precise * again * patches.times;
        let long = |[a, b]: &[f64; 2]| (a / b / LONG).clamp(1.0, 1e4);
        let shapes: f64 = patches.half.iter().map(long).sum();
        let motions = problem.motions.iter().enumerate().map(|(k, motion)| {
            if by_table && self.may_take_table(k) {
                return TABLE_SECONDS;
            }
            let spin = if motion.spin_per_mm == 0.0 {
                1.0
            } else {
                SPIN_TIMES
            };
            let following = if k == 0 || problem.is_coupled(&self.run) {
                1.0
            } else {
                FOLLOWING_TIMES
            };
            self.solves(k) * spin * following * usual * shapes + fields
        });
        motions.sum::<f64>()
    }

    fn on_one_mesh(&self, method: Method) -> f64 {
        let cells = self.size_input().cells();
        let fields = FIELDS_SECONDS_PER_CELL * self.size_input().field_cells();
        let (first, each) = match method {
            Method::BoundaryElement => (1e-8 * cells * cells, 3e-8 * cells * cells),
            Method::LiuHsu => (4e-8 * cells * cells, 1.5e-9 * (2.0 * cells).powi(3)),
            Method::Fastsim => (1e-7 * cells, 1e-5 + 5e-9 * cells),
            Method::Table => (0.0, TABLE_SECONDS),
        };
        let motions = self.problem.motions.len();
        let meshes = if self.problem.is_coupled(&self.run) {
            motions
        } else {
            1
        };
        let solves: f64 = (0..motions).map(|k| self.solves(k)).sum();
        first * meshes as f64 + each * solves + fields * motions as f64
    }
}

/// Time in s for each stress below the surface, and for the worst point of a patch (`cargo bench --bench stress -- --only after`, medians over 18
/// ellipses); a fine mesh takes several times as long. Other outputs of a solved motion take less than 0.1 ms.
const STRESS_SECONDS: f64 = 4e-7;
const WORST_SECONDS: f64 = 0.0025;
/// For the passages below a patch, for each thing that is judged of them: the same bench.
const PASSAGE_SECONDS: f64 = 0.03;

impl CheckedCase {
    /// Estimated time in s of the outputs computed from one solved motion (damage, subsurface stresses, temperature) for a number of patches.
    pub(crate) fn after_seconds(&self, patches: usize) -> f64 {
        let after = &self.run.after;
        let patches = patches as f64;
        let mut seconds = 0.0;
        if let Some(task) = &after.subsurface {
            let (count, below_worst) = match &task.places {
                StressPlaces::Points(points) => (points.len() as f64, false),
                StressPlaces::BelowWorst(depths) => (patches * depths.len() as f64, true),
            };
            let searched = if task.worst || below_worst {
                patches
            } else {
                0.0
            };
            seconds += STRESS_SECONDS * count + WORST_SECONDS * searched;
            if let Some(passage) = task.passage {
                let judged = 1 + u8::from(passage.dang_van_slope.is_some());
                seconds += PASSAGE_SECONDS * f64::from(judged) * patches;
                if searched == 0.0 {
                    seconds += WORST_SECONDS * patches;
                }
            }
        }
        seconds
    }
}

impl CheckedCase {
    /// Estimated time and memory of this solve: operators of the meshes, matrices of the dense method, and the answer. The time is rough.
    #[must_use]
    pub fn cost(&self) -> Cost {
        let size = self.size_input();
        Cost {
            bytes: size.bytes() as u64,
            operator_store_bytes: size.stored() as u64,
            seconds: self.solve_time().whole,
        }
    }
}

/// What a case will cost, estimated before it is queued.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Peak memory in bytes.
    pub bytes: u64,
    /// Of these, what its operators take of the store of the process.
    pub operator_store_bytes: u64,
    /// Solve time in s on one core of the machine the figures were taken on; rough.
    pub seconds: f64,
}

impl Cost {
    /// Memory in bytes that nobody shares.
    #[must_use]
    pub fn own_bytes(&self) -> u64 {
        self.bytes.saturating_sub(self.operator_store_bytes)
    }
}
