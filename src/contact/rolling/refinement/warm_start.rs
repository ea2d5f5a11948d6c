//! Warm starts: the answers of the last motions on each level, from which the next motion of a sweep starts.

use crate::contact::numerics::length::length;
use crate::contact::rolling::answer::LevelAnswer;
use crate::contact::rolling::mesh_plan::MeshPlan;
use crate::contact::rolling::methods::boundary_element::task::LevelTask;
use crate::contact::rolling::methods::fastsim;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::refinement::interpolate;
use crate::contact::rolling::start::Start;
use crate::contact::rolling::strip_mesh::StripMesh;
use crate::contact::rolling::task::RollingTask;

/// A start is extrapolated only for motions on the line through the last two, or through the last one from rest; the distance from it may be this fraction of the step.
/// Numeric safety, not tuned.
const STRAIGHT: f64 = 1e-6;
/// Longest step that is extrapolated, in steps between the last two motions: equal steps with some room. 1.1 and 2.5 are alike on sweeps
/// of equal steps.
const STEP_MAX: f64 = 1.5;
/// Answers remembered on every level. Starts from three, by a parabola, take 8 to 15 % more products on creep curves of 51 points and maps of
/// 1000.
const STEPS: usize = 2;
/// Motions in a row for which half the cells would be enough, before a sweep goes on with them. 1 takes 3 % more products on a creep map of
/// 1000 motions at 0.005 and two thirds more on a curve of 41 under a spin of 0.0015/mm, 2 takes 1 and 6 % more, 6 is alike.
const SLACK_MOTIONS: usize = 4;
/// Longest step, relative to the motion, over which the last tractions serve as a start unchanged. On 12 sweeps of 9 motions on ellipses
/// of `benches/calibrate`, 0.12 takes 6 % more products and 0.5 takes 6 % fewer; on 40 straight sweeps, where starts are extrapolated, 0.5
/// changes products by less than 0.3 %.
const NEAR: f64 = 0.25;

/// What the motions of a sweep left for the next one.
#[derive(Debug, Default)]
pub struct SweepState {
    /// The answers of the last motions on every level.
    steps: Vec<Remembered>,
    /// The same of motions that began lines, of which the rows of a grid are made.
    heads: Vec<Remembered>,
    /// The mesh on which the next such motion may begin.
    pub begin_head: Option<MeshPlan>,
    /// The levels on which the last motion was solved, coarse to fine.
    pub path: Vec<usize>,
    /// The mesh on which the next motion may begin.
    pub begin: Option<MeshPlan>,
    /// Motions in a row for which half the cells would have been enough.
    slack: usize,
    companions: Vec<RememberedCompanion>,
}

#[derive(Debug, Clone)]
struct Remembered {
    level: usize,
    /// Dimensionless, about the level's origin.
    motion: Motion,
    three_point: [Vec<f64>; 2],
    trapezoid: [Vec<f64>; 2],
}

/// How the last answer on a companion differs from that on its level.
#[derive(Debug)]
struct RememberedCompanion {
    /// The numbers of the level and of the companion.
    levels: [usize; 2],
    /// Dimensionless, about the companion's origin.
    motion: Motion,
    /// Tractions of the companion less those interpolated from the level.
    apart: [Vec<f64>; 2],
}

impl SweepState {
    /// Remembers an answer; the last but one on the level is forgotten.
    pub fn remember(&mut self, number: usize, motion: Motion, answer: &LevelAnswer) {
        if let Some(second) = &answer.second {
            self.remember_rules(number, motion, second.clone(), answer.traction.clone());
        }
    }

    /// The same where the trapezoid rule alone was solved: the tractions of the other rule are taken to be `apart` from its own.
    pub fn remember_alone(
        &mut self,
        number: usize,
        motion: Motion,
        traction: &[Vec<f64>; 2],
        apart: &[Vec<f64>; 2],
    ) {
        let three_point = [0, 1].map(|k| {
            let pairs = traction[k].iter().zip(&apart[k]);
            pairs.map(|(t, apart)| t + apart).collect()
        });
        self.remember_rules(number, motion, three_point, traction.clone());
    }

    /// Have half the cells been enough for some motions in a row? Errors change their signs along a sweep, so that one small error says
    /// little of the next.
    pub fn is_coarser_enough(&mut self, here: bool) -> bool {
        self.slack = if here { self.slack + 1 } else { 0 };
        let enough = self.slack >= SLACK_MOTIONS;
        if enough {
            self.slack = 0;
        }
        enough
    }

    /// The level that was solved last.
    #[must_use]
    pub fn last_level(&self) -> Option<usize> {
        self.steps.last().map(|step| step.level)
    }

    /// Remembers tractions of both rules, or where a motion is to start.
    pub(crate) fn remember_rules(
        &mut self,
        number: usize,
        motion: Motion,
        three_point: [Vec<f64>; 2],
        trapezoid: [Vec<f64>; 2],
    ) {
        let step = Remembered {
            level: number,
            motion,
            three_point,
            trapezoid,
        };
        push(&mut self.steps, step);
    }

    /// Motions and tractions that are remembered on a level, the newest last.
    pub(crate) fn trapezoids(&self, number: usize) -> Vec<(Motion, [Vec<f64>; 2])> {
        let steps = self.steps.iter().filter(|step| step.level == number);
        steps
            .map(|step| (step.motion, step.trapezoid.clone()))
            .collect()
    }

    /// Forgets a level.
    pub fn forget(&mut self, number: usize) {
        self.steps.retain(|step| step.level != number);
        self.heads.retain(|step| step.level != number);
        self.path.retain(|on_path| *on_path != number);
        self.companions.retain(|c| !c.levels.contains(&number));
    }

    /// Remembers the answer `found` on a companion of a level; `nested` are the level's tractions, interpolated to the companion.
    pub fn remember_companion(
        &mut self,
        levels: [usize; 2],
        motion: Motion,
        nested: &[Vec<f64>; 2],
        found: &[Vec<f64>; 2],
    ) {
        self.companions.retain(|c| c.levels != levels);
        let apart = [0, 1].map(|k| {
            let pairs = found[k].iter().zip(&nested[k]);
            pairs.map(|(found, nested)| found - nested).collect()
        });
        self.companions.push(RememberedCompanion {
            levels,
            motion,
            apart,
        });
    }

    /// A start on a companion of a level from the level's tractions, interpolated to it: if the last motion there is near, they differ
    /// from those of the companion nearly as they did then.
    #[must_use]
    pub fn companion_start(
        &self,
        levels: [usize; 2],
        motion: &Motion,
        mut nested: [Vec<f64>; 2],
        bound: &[f64],
    ) -> [Vec<f64>; 2] {
        let last = self.companions.iter().find(|c| c.levels == levels);
        if let Some(last) = last.filter(|last| is_near(motion, &last.motion)) {
            for (nested, apart) in nested.iter_mut().zip(&last.apart) {
                nested.iter_mut().zip(apart).for_each(|(t, d)| *t += d);
            }
            shrink(&mut nested, bound);
        }
        nested
    }

    /// A start for a motion on a level: the last answers extrapolated, or the last answer itself if its motion is near; else the same from
    /// the motions that began lines of the sweep.
    #[must_use]
    pub fn start(&self, number: usize, level: &StripMesh, motion: &Motion) -> Option<Start> {
        let way = self.way(number, motion)?;
        Some(Start {
            three_point: way.traction(|step| &step.three_point, &level.bound),
            trapezoid: Some(way.traction(|step| &step.trapezoid, &level.bound)),
        })
    }

    /// The same of the trapezoid rule alone.
    #[must_use]
    pub(crate) fn start_of_one_rule(
        &self,
        number: usize,
        level: &StripMesh,
        motion: &Motion,
    ) -> Option<[Vec<f64>; 2]> {
        let way = self.way(number, motion)?;
        Some(way.traction(|step| &step.trapezoid, &level.bound))
    }

    fn way(&self, number: usize, motion: &Motion) -> Option<Way<'_>> {
        let from = |steps| Way::of(steps, number, motion);
        from(&self.steps).or_else(|| from(&self.heads))
    }

    /// Does a motion follow from the last ones on a level?
    #[must_use]
    pub fn follows(&self, number: usize, motion: &Motion) -> bool {
        Way::of(&self.steps, number, motion).is_some()
    }

    /// Remembers the last answer on a level as one that began a line, and where the next such motion may begin.
    pub fn remember_head(&mut self, number: usize, begin: MeshPlan) {
        self.begin_head = Some(begin);
        if let Some(last) = self.steps.iter().rev().find(|step| step.level == number) {
            push(&mut self.heads, last.clone());
        }
    }
}

/// Remembers an answer in place of where it started; of those on its level the oldest is forgotten.
fn push(steps: &mut Vec<Remembered>, step: Remembered) {
    steps.retain(|s| s.level != step.level || s.motion != step.motion);
    if steps.iter().filter(|s| s.level == step.level).count() == STEPS
        && let Some(oldest) = steps.iter().position(|s| s.level == step.level)
    {
        steps.remove(oldest);
    }
    steps.push(step);
}

/// How the start of a motion follows from the last ones on its level: the last tractions times a number, or beyond those before.
struct Way<'a> {
    last: &'a Remembered,
    times: f64,
    /// And how many of the last step to go on.
    before: Option<(&'a Remembered, f64)>,
}

impl<'a> Way<'a> {
    fn of(steps: &'a [Remembered], number: usize, motion: &Motion) -> Option<Way<'a>> {
        let mut steps = steps.iter().rev().filter(|s| s.level == number);
        let last = steps.next()?;
        let to_go = difference(motion, &last.motion);
        let before = steps.next().and_then(|before| {
            let step = difference(&last.motion, &before.motion);
            let along = on_line(to_go, step)?;
            (along > 0.0 && along <= STEP_MAX).then_some((before, along))
        });
        let times = match before {
            Some(_) => 1.0,
            None => from_rest(motion, &last.motion)
                .or_else(|| is_near(motion, &last.motion).then_some(1.0))?,
        };
        Some(Way {
            last,
            times,
            before,
        })
    }

    /// The tractions of a rule, within their discs.
    fn traction(&self, rule: fn(&Remembered) -> &[Vec<f64>; 2], bound: &[f64]) -> [Vec<f64>; 2] {
        let mut values = [0, 1].map(|k| -> Vec<f64> {
            let last = &rule(self.last)[k];
            match self.before {
                None => last.iter().map(|t| self.times * t).collect(),
                Some((before, along)) => {
                    let pairs = last.iter().zip(&rule(before)[k]);
                    pairs.map(|(t, before)| t + along * (t - before)).collect()
                }
            }
        });
        shrink(&mut values, bound);
        values
    }
}

/// How many of a step a way is, if both lie on one line.
fn on_line(way: [f64; 3], step: [f64; 3]) -> Option<f64> {
    let along = dot(way, step) / dot(step, step);
    let aside = [0, 1, 2].map(|k| way[k] - along * step[k]);
    (dot(aside, aside).sqrt() <= STRAIGHT * dot(way, way).sqrt()).then_some(along)
}

/// How many times the last motion this one is, if both lie on a line from rest and are not far apart: tractions that stick grow in proportion.
fn from_rest(motion: &Motion, last: &Motion) -> Option<f64> {
    let along = on_line(components(motion), components(last))?;
    (1.0 / (1.0 + STEP_MAX)..=1.0 + STEP_MAX)
        .contains(&along)
        .then_some(along)
}

/// Is a motion so near the last one that what was found there serves it?
fn is_near(motion: &Motion, last: &Motion) -> bool {
    let (whole, to_go) = (components(motion), difference(motion, last));
    dot(to_go, to_go) <= NEAR * NEAR * dot(whole, whole)
}

/// Brings tractions into their discs.
fn shrink(traction: &mut [Vec<f64>; 2], bound: &[f64]) {
    let [x, y] = traction;
    for ((x, y), bound) in x.iter_mut().zip(y.iter_mut()).zip(bound) {
        let long = length(*x, *y);
        if long > *bound {
            *x *= bound / long;
            *y *= bound / long;
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

/// A start from the simplified theory, where nothing better is known: its zones are nearly those of the answer. Bounds that depend on the slip are
/// left out, because which of several solutions is found depends on the start.
///
/// On the 400 ellipses of `cargo bench --bench calibrate ellipse` it saves 19, 10 and 4 % of the products at the targets 0.02, 0.005 and 0.001. Motions
/// scaled by 0.8 to 2, by which the share that sticks can be made that of the table of creep forces, change products by less than 3 %.
pub(crate) fn simplified(task: &RollingTask, of_level: LevelTask) -> Option<Start> {
    let LevelTask {
        level,
        motion,
        fall: None,
        passage: None,
        ..
    } = of_level
    else {
        return None;
    };
    Some(Start {
        three_point: fastsim::tractions(task, level, motion),
        trapezoid: None,
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_companion_starts_as_far_from_its_level_as_the_last_near_motion_was_and_within_its_discs() {
        let motion = |creepage_x: f64| Motion {
            creepage_x,
            creepage_y: 0.0,
            spin_per_mm: 0.1,
        };
        let mut sweep = SweepState::default();
        let nested = [vec![0.2, 0.9], vec![0.1, 0.0]];
        let found = [vec![0.25, 1.0], vec![0.05, 0.0]];
        sweep.remember_companion([3, 4], motion(1.0), &nested, &found);
        let bound = [1.0, 1.0];
        let now = [vec![0.3, 0.95], vec![0.2, 0.0]];
        let start = |levels, creepage| {
            sweep.companion_start(levels, &motion(creepage), now.clone(), &bound)
        };
        let near = start([3, 4], 1.1);
        let known = [[0.35, 1.0], [0.15, 0.0]];
        for (near, known) in near.iter().flatten().zip(known.as_flattened()) {
            assert!((near - known).abs() < 1e-12, "{near} {known}");
        }
        assert_eq!(start([3, 4], 2.0), now);
        assert_eq!(start([4, 3], 1.1), now);
        sweep.forget(4);
        assert!(sweep.companions.is_empty());
    }
}
