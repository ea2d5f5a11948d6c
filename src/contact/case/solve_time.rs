//! How long a case will take, estimated before it is queued: what its patches will look like, what tractions its motions will have,
//! and how such motions grow with the target.
//!
//! The figures are medians of random contacts. A single case spreads about them by a factor of 2, because a mesh has either met its
//! target or not, and the next one costs several times as much; `cargo bench --bench stress -- --only times` prints estimates beside
//! times, class by class.
//!
//! All numbers of this file were read off 2500 cases of that bench under a seed of their own, and off the random contacts of
//! `benches/calibrate` at three targets; the bench shows another seed. How far the share within a factor of 3 depends on each of them was
//! not measured.

use crate::contact::case::problem::CheckedCase;
use crate::contact::case::profile_points;
use crate::contact::half_space::elasticity::Elasticity;
use crate::contact::half_space::strip_operator::kind::Precision;
use crate::contact::normal::gap::summits::GapOutlook;
use crate::contact::normal::gap::task::GapTask;
use crate::contact::normal::hertz::{Ellipse, Pressing};
use crate::contact::normal::normal_task::NormalTask;
use crate::contact::normal::patch::Patch;
use crate::contact::normal::wheel_height::task::{WheelLoad, WheelTask};
use crate::contact::rolling::methods::method::Method;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::mesh_policy::CELLS_MAX;
use crate::contact::rolling::refinement::resolution::Resolution;
use crate::contact::rolling::task::precision_of;

/// Time in s of a motion at a target of 0.005, and the powers with which it grows as the target falls, above and below 0.005:
/// everything sticks; everything slips; creepages alone; spin. Medians of 900 ellipses with a/b from 1/50 to 50, within 20 % for
/// all targets from 0.05 to 0.002; at 0.001 spin takes 13 ms alone, but 30 ms and more within a creep map.
const STICK: MotionTime = MotionTime::new(2.5e-4, [0.0, 0.1]);
const SLIDE: MotionTime = MotionTime::new(1.6e-4, [0.1, 0.8]);
const CREEP: MotionTime = MotionTime::new(4.0e-4, [0.4, 1.3]);
const SPIN: MotionTime = MotionTime::new(1.2e-3, [0.8, 1.8]);
const TARGET_USUAL: f64 = 0.005;
/// Below this target the largest mesh is the end.
const TARGET_LEAST: f64 = 4e-4;
/// Normalised motions below which everything sticks, and parts of the creepage below which spin does not matter.
const MOTION_SMALL: f64 = 0.03;
const SPIN_SMALL: f64 = 0.03;
/// Normalised creepage beyond which little sticks, without spin and with spin of 1, and how many times the spin it then is.
const CREEP_LARGE_ALONE: f64 = 1.0;
const CREEP_LARGE: f64 = 20.0;
const CREEP_OVER_SPIN: f64 = 3.0;
/// Powers with which the time grows with the length over the width of a patch beyond this ratio, and with the inverse ratio.
const SLENDER: f64 = 5.0;
const RATIO_MAX: f64 = 1e4;
const LONG_POWER: f64 = 0.7;
const WIDE_POWER: f64 = 0.25;
/// The time of a motion within a sweep relative to a single one: a start from the motion before saves work, but not where every
/// motion with spin wants a mesh about its own pole. A mean over motions exceeds their median by half.
const SWEEP_SHARE: f64 = 0.7;
const SWEEP_SHARE_SPIN: f64 = 1.5;
/// How many times longer motions take where a given pressure jumps.
const JUMP_TIMES: f64 = 4.0;
/// How much longer products in double precision take.
const DOUBLE_TIMES: f64 = 2.5;
/// Solves that the search for a prescribed force takes beside the last, on average.
const TRIALS: f64 = 3.0;
/// What every solve takes at least, in s.
const SECONDS_MIN: f64 = 5e-5;
/// Explicit meshes with so many cells have matrices that no cache holds.
const MESH_CELLS_SLOW: f64 = 1600.0;
/// Cells that a patch has at least.
const PATCH_CELLS_MIN: f64 = 64.0;
/// Time to gather and pack values per cell, in s.
const FIELDS_SECONDS_PER_CELL: f64 = 3e-7;

/// Time in s to find region and pressure of a smooth gap on one grid; of one with two summits alike; of two that need a grid each;
/// and of a rough one, whose patches get grids of their own until the roughness is resolved (0.02 to 1 s were seen).
const GAP_SMOOTH: f64 = 1.7e-3;
const GAP_TWO: f64 = 5e-3;
const GAP_UNEQUAL: f64 = 0.022;
const GAP_ROUGH: f64 = 0.08;
/// From so many turns across the contact on two summits differ much, and a line whose teeth are not pressed flat is rough.
const TURNS_ROUGH: f64 = 12.0;
const TEETH_ROUGH: f64 = 4e-3;
/// Time in s to bring a wheel to rest on its rail once, with two grids for every height.
const WHEEL: f64 = 9e-3;
/// A relative radius of curvature across a rail, in mm.
const RAIL_RADIUS: f64 = 300.0;

/// Time of one motion by target.
#[derive(Debug, Clone, Copy)]
struct MotionTime {
    usual: f64,
    powers: [f64; 2],
}

impl MotionTime {
    const fn new(usual: f64, powers: [f64; 2]) -> MotionTime {
        MotionTime { usual, powers }
    }

    fn at(self, target: f64) -> f64 {
        let finer = TARGET_USUAL / target.max(TARGET_LEAST);
        let [above, below] = self.powers;
        self.usual * finer.powf(if finer < 1.0 { above } else { below })
    }
}

/// What the tractions of a motion will look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tractions {
    Stick,
    Slide,
    Creep,
    Spin,
}

impl Tractions {
    /// From the creepage and the spin, normalised as in an answer.
    fn of(creepage: f64, spin: f64) -> Tractions {
        let alone = spin < SPIN_SMALL * creepage.max(0.3);
        if creepage.max(spin) < MOTION_SMALL {
            Tractions::Stick
        } else if alone && creepage > CREEP_LARGE_ALONE
            || creepage > CREEP_LARGE * spin.sqrt().max(1.0) && creepage > CREEP_OVER_SPIN * spin
        {
            Tractions::Slide
        } else if alone {
            Tractions::Creep
        } else {
            Tractions::Spin
        }
    }

    fn time(self) -> MotionTime {
        match self {
            Tractions::Stick => STICK,
            Tractions::Slide => SLIDE,
            Tractions::Creep => CREEP,
            Tractions::Spin => SPIN,
        }
    }
}

/// A patch as far as it is known before region and pressure are found.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PatchGuess {
    /// Half-length along rolling and half-width in mm.
    half: [f64; 2],
    /// Load in N.
    force: f64,
    /// How many times longer its motions take than those of an ellipse.
    times: f64,
}

impl PatchGuess {
    fn of_patch(patch: &Patch) -> PatchGuess {
        let [x_min, x_max, y_min, y_max] = patch.extent;
        PatchGuess {
            half: [0.5 * (x_max - x_min), 0.5 * (y_max - y_min)],
            force: patch.normal_force,
            times: 1.0,
        }
    }

    fn of_ellipse(ellipse: &Ellipse) -> PatchGuess {
        PatchGuess {
            half: [ellipse.a, ellipse.b],
            force: ellipse.normal_force,
            times: 1.0,
        }
    }

    fn of_gap(task: &GapTask, outlook: &GapOutlook) -> PatchGuess {
        let area = std::f64::consts::PI * outlook.half[0] * outlook.half[1];
        let force = match task.pressing {
            Pressing::Force(force) => force,
            // A paraboloid's, see `search_box`.
            Pressing::Approach(_) => {
                let radius = (area / std::f64::consts::PI).sqrt();
                4.0 / 3.0 * task.contact_modulus * radius * outlook.depth
            }
        };
        let count = outlook.summits as f64;
        PatchGuess {
            half: outlook.half.map(|half| half / count.sqrt()),
            force: force / count,
            times: 1.0,
        }
    }

    fn of_wheel(task: &WheelTask) -> PatchGuess {
        let pressing = match task.loading {
            WheelLoad::Vertical(force) | WheelLoad::Normal(force) => Pressing::Force(force),
            WheelLoad::Lowering(lowering) => Pressing::Approach(lowering),
        };
        let radius = task.geometry.placement.rolling_radius;
        let ellipse = Ellipse::of_radii(radius, RAIL_RADIUS, pressing, task.contact_modulus);
        PatchGuess::of_ellipse(&ellipse)
    }

    /// Time in s of a motion alone, solved to a target.
    fn seconds(
        &self,
        target: f64,
        elasticity: &Elasticity,
        friction: f64,
        motion: &Motion,
    ) -> (Tractions, f64) {
        let c = (self.half[0] * self.half[1]).sqrt();
        let bound = (friction * self.force).max(f64::MIN_POSITIVE);
        let unit =
            2.0 * elasticity.shear_modulus / (1.0 - elasticity.poisson_ratio) * c * c / bound;
        let creepage = unit * motion.creepage_x.hypot(motion.creepage_y);
        let spin = unit * c * motion.spin_per_mm.abs();
        let tractions = Tractions::of(creepage, spin);
        let ratio = match self.half[0] / self.half[1] {
            // A load too small to tell a patch.
            ratio if ratio.is_nan() => 1.0,
            ratio => ratio.clamp(1.0 / RATIO_MAX, RATIO_MAX),
        };
        let slender =
            (ratio / SLENDER).max(1.0).powf(LONG_POWER) * (1.0 / ratio).max(1.0).powf(WIDE_POWER);
        (
            tractions,
            self.times * slender * tractions.time().at(target),
        )
    }
}

/// Patches of a contact, and the time in s to find region and pressure.
fn guesses(task: &NormalTask, target: Option<f64>) -> (Vec<PatchGuess>, f64) {
    match task {
        NormalTask::Hertz(ellipse) => (vec![PatchGuess::of_ellipse(ellipse)], 0.0),
        NormalTask::Given(field) => {
            let times = if field.jump().is_some() {
                JUMP_TIMES
            } else {
                1.0
            };
            let patches = field.patches();
            let guess = |patch| PatchGuess {
                times,
                ..PatchGuess::of_patch(patch)
            };
            (patches.iter().map(guess).collect(), 0.0)
        }
        NormalTask::Gap(task) => {
            let outlook = task.outlook();
            let patch = PatchGuess::of_gap(task, &outlook);
            let seconds = gap_seconds(&outlook) * task.growth(target);
            (vec![patch; outlook.summits], seconds)
        }
        NormalTask::Wheel(task) => {
            let solves = f64::from(1 + profile_points::readings_expected(task));
            (vec![PatchGuess::of_wheel(task)], WHEEL * solves)
        }
    }
}

fn gap_seconds(outlook: &GapOutlook) -> f64 {
    let turns = outlook.turns > TURNS_ROUGH;
    match (outlook.summits, turns) {
        (1, true) if outlook.teeth > TEETH_ROUGH => GAP_ROUGH,
        (1, _) => GAP_SMOOTH,
        (2, false) => GAP_TWO,
        (2, true) => GAP_UNEQUAL,
        _ => GAP_ROUGH,
    }
}

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
            (Method::BoundaryElement, Resolution::Target(target)) => {
                self.to_target(&patches, target)
            }
            (method, _) => self.on_one_mesh(method, patches.len()),
        };
        SolveTime {
            normal,
            whole: normal + tangential,
        }
    }

    /// Solves that motion `k` stands for.
    fn solves(&self, k: usize) -> f64 {
        match self.problem.forces.get(k) {
            Some(forces) if *forces != [None; 2] => 1.0 + TRIALS,
            _ => 1.0,
        }
    }

    fn to_target(&self, patches: &[PatchGuess], target: f64) -> f64 {
        let precise = match precision_of(self.run.resolution) {
            Precision::Single => 1.0,
            Precision::Double => DOUBLE_TIMES,
        };
        let problem = &self.problem;
        let friction = problem.friction.largest();
        let one = |motion: &Motion| {
            let each = patches
                .iter()
                .map(|patch| patch.seconds(target, &problem.elasticity, friction, motion));
            each.fold((Tractions::Stick, 0.0), |(_, sum), (tractions, seconds)| {
                (tractions, sum + seconds)
            })
        };
        let crowd = crowd_seconds(patches.len());
        let motions = self.problem.motions.iter().enumerate().map(|(k, motion)| {
            let (tractions, seconds) = one(motion);
            let share = match tractions {
                _ if k == 0 => 1.0,
                Tractions::Spin => SWEEP_SHARE_SPIN,
                _ => SWEEP_SHARE,
            };
            let fields = FIELDS_SECONDS_PER_CELL * self.field_cells();
            share * (precise * seconds).max(crowd) * self.solves(k) + fields
        });
        SECONDS_MIN + motions.sum::<f64>()
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
        };
        let solves: f64 = (0..self.problem.motions.len())
            .map(|k| self.solves(k))
            .sum();
        SECONDS_MIN * patches as f64
            + first
            + each * solves
            + fields * self.problem.motions.len() as f64
    }
}

/// Many patches have more cells than any target asks for, and need more steps.
fn crowd_seconds(patches: usize) -> f64 {
    let cells = patches as f64 * PATCH_CELLS_MIN;
    if cells > f64::from(CELLS_MAX) / 4.0 {
        3e-7 * cells.powi(2)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_are_told_by_creepage_and_spin() {
        assert_eq!(Tractions::of(0.0, 0.0), Tractions::Stick);
        assert_eq!(Tractions::of(0.5, 0.0), Tractions::Creep);
        assert_eq!(Tractions::of(5.0, 0.0), Tractions::Slide);
        assert_eq!(Tractions::of(1.0, 1.0), Tractions::Spin);
        assert_eq!(Tractions::of(0.0, 1.0), Tractions::Spin);
        assert_eq!(Tractions::of(50.0, 1.0), Tractions::Slide);
    }

    #[test]
    fn the_time_of_any_patch_is_a_number() {
        let elasticity = Elasticity {
            shear_modulus: 82_000.0,
            poisson_ratio: 0.28,
            difference: 0.0,
        };
        let motion = Motion {
            creepage_x: 0.001,
            creepage_y: 0.0,
            spin_per_mm: 0.001,
        };
        let lengths = [0.0, 1e-300, 1.0, 1e300, f64::INFINITY, f64::NAN];
        for (a, b) in lengths.iter().flat_map(|a| lengths.map(|b| (*a, b))) {
            for force in [0.0, 1e-300, 1.0, 1e300, f64::NAN] {
                let patch = PatchGuess {
                    half: [a, b],
                    force,
                    times: 1.0,
                };
                let (_, seconds) = patch.seconds(0.005, &elasticity, 0.3, &motion);
                assert!(seconds.is_finite(), "{patch:?}: {seconds}");
            }
        }
    }

    #[test]
    fn time_never_falls_as_the_target_does() {
        for time in [STICK, SLIDE, CREEP, SPIN] {
            let targets = [0.05, 0.02, 0.005, 0.002, 0.001, 4e-4, 1e-4];
            assert!(targets.is_sorted_by(|a, b| time.at(*a) <= time.at(*b)));
        }
    }
}
