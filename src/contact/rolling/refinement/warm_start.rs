//! Warm starts: the answers of the last motions on each level, from which the next motion of a sweep starts.

use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::mesh_plan::MeshPlan;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::interpolate;
use crate::contact::rolling::start::Start;
use crate::contact::rolling::strip_mesh::StripMesh;

/// A start is extrapolated only for motions on the line through the last two; the distance from it may be this fraction of the step.
/// Numeric safety, not tuned.
const STRAIGHT: f64 = 1e-6;
/// Longest step that is extrapolated, in steps between the last two motions: equal steps with some room. 1.1 and 2.5 are alike on sweeps
/// of equal steps.
const STEP_MAX: f64 = 1.5;
/// Longest step, relative to the motion, over which the last tractions serve as a start unchanged. On 12 sweeps of 9 motions on ellipses
/// of `benches/calibrate`, 0.12 takes 6 % more products and 0.5 takes 6 % fewer; on 40 straight sweeps, where starts are extrapolated, 0.5
/// changes products by less than 0.3 %.
const NEAR: f64 = 0.25;

/// What the motions of a sweep left for the next one.
#[derive(Debug, Default)]
pub struct SweepState {
    /// The answers of the last two motions on every level.
    steps: Vec<Remembered>,
    /// The levels on which the last motion was solved, coarse to fine.
    pub path: Vec<usize>,
    /// The mesh on which the next motion may begin.
    pub begin: Option<MeshPlan>,
}

#[derive(Debug)]
struct Remembered {
    level: usize,
    /// Dimensionless, about the level's origin.
    motion: Motion,
    three_point: [Vec<f64>; 2],
    trapezoid: [Vec<f64>; 2],
}

impl SweepState {
    /// Remembers an answer; the last but one on the level is forgotten.
    pub fn remember(&mut self, number: usize, motion: Motion, answer: &LevelAnswer) {
        let Some(second) = &answer.second else {
            return;
        };
        if self.steps.iter().filter(|s| s.level == number).count() == 2
            && let Some(oldest) = self.steps.iter().position(|s| s.level == number)
        {
            self.steps.remove(oldest);
        }
        self.steps.push(Remembered {
            level: number,
            motion,
            three_point: second.clone(),
            trapezoid: answer.traction.clone(),
        });
    }

    /// Forgets a level.
    pub fn forget(&mut self, number: usize) {
        self.steps.retain(|step| step.level != number);
        self.path.retain(|on_path| *on_path != number);
    }

    /// A start for a motion on a level: the last two answers extrapolated, or the last answer itself if its motion is near.
    #[must_use]
    pub fn start(&self, number: usize, level: &StripMesh, motion: &Motion) -> Option<Start> {
        let mut steps = self.steps.iter().rev().filter(|s| s.level == number);
        let last = steps.next()?;
        let to_go = difference(motion, &last.motion);
        let line = steps.next().and_then(|before| {
            let step = difference(&last.motion, &before.motion);
            let along = dot(to_go, step) / dot(step, step);
            let aside = [0, 1, 2].map(|k| to_go[k] - along * step[k]);
            let straight = dot(aside, aside).sqrt() <= STRAIGHT * dot(to_go, to_go).sqrt();
            (straight && along > 0.0 && along <= STEP_MAX).then_some((before, along))
        });
        if let Some((before, along)) = line {
            let beyond = |here: &[Vec<f64>; 2], past: &[Vec<f64>; 2]| {
                let mut values = [0, 1].map(|k| -> Vec<f64> {
                    let pairs = here[k].iter().zip(&past[k]);
                    pairs.map(|(h, p)| h + along * (h - p)).collect()
                });
                shrink(&mut values, &level.bound);
                values
            };
            return Some(Start {
                three_point: beyond(&last.three_point, &before.three_point),
                trapezoid: Some(beyond(&last.trapezoid, &before.trapezoid)),
            });
        }
        let whole = components(motion);
        (dot(to_go, to_go) <= NEAR * NEAR * dot(whole, whole)).then(|| Start {
            three_point: last.three_point.clone(),
            trapezoid: Some(last.trapezoid.clone()),
        })
    }
}

/// Brings tractions into their discs.
fn shrink(traction: &mut [Vec<f64>; 2], bound: &[f64]) {
    let [x, y] = traction;
    for ((x, y), bound) in x.iter_mut().zip(y.iter_mut()).zip(bound) {
        let length = x.hypot(*y);
        if length > *bound {
            *x *= bound / length;
            *y *= bound / length;
        }
    }
}

fn components(motion: &Motion) -> [f64; 3] {
    [motion.creepage_x, motion.creepage_y, motion.spin_per_mm]
}

fn difference(a: &Motion, b: &Motion) -> [f64; 3] {
    let (a, b) = (components(a), components(b));
    [0, 1, 2].map(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A start from the answer on a coarser level.
pub(crate) fn from_coarser(coarse: &StripMesh, answer: &LevelAnswer, level: &StripMesh) -> Start {
    let second = answer.second.as_ref().unwrap_or(&answer.traction);
    Start {
        three_point: nested_tractions(coarse, second, level),
        trapezoid: None,
    }
}

/// Tractions of one level interpolated to another. Interpolated are their ratios to the friction bound, which vary less.
pub(crate) fn nested_tractions(
    from: &StripMesh,
    traction: &[Vec<f64>; 2],
    to: &StripMesh,
) -> [Vec<f64>; 2] {
    let relative = |values: &[f64]| -> Vec<f64> {
        values
            .iter()
            .zip(&from.bound)
            .map(|(t, g)| if *g > 0.0 { t / g } else { 0.0 })
            .collect()
    };
    [0, 1].map(|k| {
        let mut values = interpolate::interpolate(&from.mesh, &relative(&traction[k]), &to.mesh);
        values.iter_mut().zip(&to.bound).for_each(|(t, g)| *t *= g);
        values
    })
}
