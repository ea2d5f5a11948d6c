//! Which creepages give the tangential forces that were asked for?
//!
//! The friction law is monotone: while the other components are kept, a force grows with its creepage. A single force is therefore
//! bracketed between a creepage that gives too little and one that gives too much; two forces are sought together, see
//! `numerics::pair_root`. The unknown is not the creepage but its *place*, see `force_places`.

use std::time::Duration;

use crate::contact::error::SolveError;
use crate::contact::method::Method;
use crate::contact::monitor::Monitor;
use crate::contact::numerics::bracketed_root::{RootExit, find_root};
use crate::contact::numerics::pair_root::find_pair;
use crate::contact::remark::list::Remark;
use crate::contact::rolling::answer::Work;
use crate::contact::rolling::force_places::{ForcePlaces, total};
use crate::contact::rolling::mesh_plan::MeshPlan;
use crate::contact::rolling::motion::{Motion, PrescribedForces};
use crate::contact::rolling::motion_answer::MotionAnswer;
use crate::contact::rolling::refinement::level_solve::MotionTask;
use crate::contact::rolling::refinement::refine;
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::resolution::Resolution;
use crate::contact::rolling::resultants::Resultants;
use crate::contact::rolling::task::RollingTask;

/// A prescribed force may be missed by this part of the target error. Chosen by judgement; how much it matters was not measured.
const SHARE_OF_TARGET: f64 = 0.02;
/// Smallest tolerance of a force with a target, relative to μN: ten times the residual to which tractions are solved, because a
/// starting iterate that meets this residual is accepted unchanged.
const MISSED_FOR_TARGET: f64 = 1e-5;
/// The same of the first search, on the coarsest level. 0.003 and 0.03 take 1 % more work on the 118 prescribed forces of `cargo bench --bench
/// stress -- --only times`, and no such search five times as much, most of it in a few slender ellipses.
const MISSED_ON_COARSEST: f64 = 0.01;
/// Tolerance of a force on an explicit mesh and for the simplified theory, relative to μN.
const MISSED: f64 = 1e-6;
/// Near μN the creepage depends on the small remainder `1 − force/μN`; the tolerance is at most this multiple of the remainder. Chosen by
/// judgement; how much it matters was not measured.
const NEAR_LIMIT: f64 = 10.0;
/// No force is sought more closely than this, relative to μN or, if they are smaller, to the forces of the first motion tried: where
/// everything slips, elastic slip still turns the tractions by this much. Chosen by judgement; how much it matters was not measured.
const MISSED_LEAST: f64 = 2e-7;
/// How often the levels are chosen anew because the motion that was found does not meet its target on them. Keeps the numbers safe; not tuned.
const LEVEL_CHOICES_MAX: u32 = 3;
/// How often a search is corrected by what the answer judged at its end was extrapolated. Keeps the numbers safe; not tuned: the
/// extrapolation changes by some per cent of the change of the force, so that two corrections suffice.
const CORRECTIONS_MAX: u32 = 5;

/// Solves motion `index` of a problem; where forces are prescribed, finds the creepages that give them. `before` is the answer to
/// the motion before.
///
/// # Errors
/// Why there is no answer.
pub fn solve(
    task: &RollingTask,
    state: &mut RefinementState,
    index: usize,
    before: Option<&MotionAnswer>,
    monitor: &dyn Monitor,
) -> Result<MotionAnswer, SolveError> {
    let motion = task.motions[index];
    if task.forces[index] == [None; 2] || task.friction.is_frictionless() {
        return refine::solve(task, state, MotionTask { index, motion }, monitor);
    }
    let began = monitor.elapsed();
    let mut search = ForceSearch::new(task, state, index, monitor);
    let mut place = search.places.start(&task.motions[index], before);
    if search.extrapolates && search.state.sweep.begin.is_none() {
        place = search.start_on_coarsest(place)?;
    }
    for _ in 0..LEVEL_CHOICES_MAX {
        // Refinement chooses the levels; on them the force is one function of the creepage.
        search.path.clear();
        search.plain = false;
        place = search.find_judged(place)?;
        // Where the force jumps, or cannot be extrapolated, other levels do not help either.
        let jumps = search.exit == RootExit::BracketClosed;
        if search.met() || search.saturated || search.plain || jumps {
            break;
        }
    }
    search.finish(place, began)
}

/// The search for the creepages of one motion.
struct ForceSearch<'a, 'p> {
    task: &'a RollingTask<'a>,
    state: &'a mut RefinementState<'p>,
    index: usize,
    monitor: &'a dyn Monitor,
    forces: PrescribedForces,
    /// μN of all patches in N.
    limit: f64,
    places: ForcePlaces<'a>,
    /// The levels to solve on, coarse to fine; chosen by the next answer that is judged if empty.
    path: Vec<MeshPlan>,
    /// The forces of an answer are extrapolated from companion meshes.
    extrapolates: bool,
    /// By how much the forces of the answer judged last exceed those of its tractions, relative to μN. It hardly changes with
    /// the motion, so that trials need no companions.
    shift: [f64; 2],
    /// Forces are sought on the coarsest level, to find where to begin.
    rough: bool,
    /// Forces are not extrapolated, because a companion mesh has answers for some of the motions only.
    plain: bool,
    /// The answer nearest to the forces, and how far it is from them, relative to μN.
    best: Option<(f64, MotionAnswer)>,
    /// Largest force of the first trial, relative to μN.
    first: Option<f64>,
    saturated: bool,
    /// How the last search ended.
    exit: RootExit,
    work: Work,
}

impl<'a, 'p> ForceSearch<'a, 'p> {
    fn new(
        task: &'a RollingTask<'a>,
        state: &'a mut RefinementState<'p>,
        index: usize,
        monitor: &'a dyn Monitor,
    ) -> ForceSearch<'a, 'p> {
        let limit = task.friction.limit_of_all(task.footprint);
        ForceSearch {
            task,
            places: ForcePlaces::new(task, state, limit, task.forces[index]),
            state,
            index,
            monitor,
            forces: task.forces[index],
            limit,
            path: Vec::new(),
            extrapolates: task.method == Method::BoundaryElement
                && matches!(task.resolution, Resolution::Target(_)),
            shift: [0.0; 2],
            rough: false,
            plain: false,
            best: None,
            first: None,
            saturated: false,
            exit: RootExit::Found,
            work: Work::default(),
        }
    }

    /// Finds the places on the coarsest level, roughly; the start if they are not found there. The levels are then chosen, and the fine ones
    /// solved, for a motion near the one that is sought.
    fn start_on_coarsest(&mut self, start: [f64; 2]) -> Result<[f64; 2], SolveError> {
        self.path = vec![self.state.policy.first()];
        self.rough = true;
        let found = match self.find(start) {
            Ok(place) if self.exit == RootExit::Found => place,
            // What the coarsest level cannot answer may have an answer all the same.
            Ok(_) | Err(SolveError::NotConverged { .. } | SolveError::Unmeshable { .. }) => start,
            Err(error) => return Err(error),
        };
        self.rough = false;
        self.end(RootExit::Found);
        Ok(found)
    }

    /// Finds the places at which the forces are as prescribed, with an answer that is judged there.
    fn find_judged(&mut self, start: [f64; 2]) -> Result<[f64; 2], SolveError> {
        self.best = None;
        if !self.extrapolates {
            return self.find(start);
        }
        let mut place = start;
        let mut off = self.judge(place)?;
        for _ in 0..CORRECTIONS_MAX {
            if length(off) <= self.tolerance() {
                self.end(RootExit::Found);
                return Ok(place);
            }
            let shift = self.shift;
            place = self.find(place)?;
            off = self.judge(place)?;
            let corrected = length([0, 1].map(|k| self.shift[k] - shift[k]));
            if self.exit != RootExit::Found && corrected <= self.tolerance() {
                return Ok(place);
            }
        }
        if self.exit == RootExit::Found && length(off) > self.tolerance() {
            self.end(RootExit::TrialsUsedUp);
        }
        Ok(place)
    }

    /// Finds the places at which the forces are as prescribed, or as near to that as can be.
    fn find(&mut self, start: [f64; 2]) -> Result<[f64; 2], SolveError> {
        match self.forces {
            [Some(_), Some(_)] => {
                let root = find_pair(start, |place, tolerance| {
                    let off = self.trial(place)?;
                    *tolerance = self.tolerance();
                    Ok::<[f64; 2], SolveError>(off)
                })?;
                self.end(root.exit);
                Ok(root.place)
            }
            forces => {
                let k = usize::from(forces[0].is_none());
                let mut place = start;
                let root = find_root(start[k], |at, tolerance| {
                    place[k] = at;
                    let off = self.trial(place)?[k];
                    *tolerance = self.tolerance();
                    Ok::<f64, SolveError>(off)
                })?;
                place[k] = root.place;
                self.end(root.exit);
                Ok(place)
            }
        }
    }

    fn end(&mut self, exit: RootExit) {
        self.saturated = exit == RootExit::SignKept;
        self.exit = exit;
    }

    /// The remark if the forces are neither met nor out of reach.
    fn inexact(&self) -> Option<Remark> {
        let (residual, _) = self.best.as_ref()?;
        let tolerance = self.tolerance();
        (!self.saturated && *residual > tolerance).then(|| Remark::IterationInexact {
            iteration: "the search for the creepages of the prescribed force",
            reason: self.exit.reason(),
            residual: *residual,
            tolerance,
        })
    }

    /// How far the forces of the tractions, moved by what the last judged answer was extrapolated, are from those prescribed, relative to
    /// μN, at two places.
    fn trial(&mut self, place: [f64; 2]) -> Result<[f64; 2], SolveError> {
        if !self.extrapolates {
            return self.judge(place);
        }
        let asked = self.asked(place);
        let sums = self.sums(asked)?;
        let forces = self.relative(&sums);
        Ok(self.off([0, 1].map(|k| forces[k] + self.shift[k])))
    }

    /// Solves the motion of two places with an estimate of its error; how far its forces are from those prescribed, relative to μN.
    fn judge(&mut self, place: [f64; 2]) -> Result<[f64; 2], SolveError> {
        let asked = self.asked(place);
        let path = &self.path;
        let found = refine::on_levels(self.task, self.state, asked, path, self.monitor)?;
        let (mut point, missing) = match found {
            Some(found) => found,
            None => (
                refine::solve(self.task, self.state, asked, self.monitor)?,
                false,
            ),
        };
        if self.path.is_empty() {
            let plan = |number: &usize| self.state.levels.get(*number).plan;
            self.path = self.state.sweep.path.iter().map(plan).collect();
        }
        self.work.add(point.work);
        let forces = self.relative(&point.resultants);
        self.first.get_or_insert(length(forces));
        if self.extrapolates {
            let sums = self.sums(asked)?;
            // What was extrapolated at other places cannot be here.
            self.plain |= missing && length(self.shift) > 0.0;
            if self.plain {
                point.resultants.clone_from(&sums);
            }
            let (found, summed) = (self.relative(&point.resultants), self.relative(&sums));
            self.shift = [0, 1].map(|k| found[k] - summed[k]);
        }
        let off = self.off(self.relative(&point.resultants));
        let least = self.best.as_ref().map(|(least, _)| *least);
        if self.plain || least.is_none_or(|least| length(off) <= least) {
            self.best = Some((length(off), point));
        }
        Ok(off)
    }

    /// Resultants of the tractions of a motion on the finest level of the path.
    fn sums(&mut self, asked: MotionTask) -> Result<Vec<Resultants>, SolveError> {
        let path = &self.path;
        let (sums, work) =
            refine::sums_on_finest(self.task, self.state, asked, path, self.monitor)?;
        self.work.add(work);
        Ok(sums)
    }

    fn asked(&self, place: [f64; 2]) -> MotionTask {
        MotionTask {
            index: self.index,
            motion: self.motion(place),
        }
    }

    /// The sum of resultants, relative to μN.
    fn relative(&self, resultants: &[Resultants]) -> [f64; 2] {
        let sum = total(resultants);
        [sum.force_x / self.limit, sum.force_y / self.limit]
    }

    /// How far forces are from those prescribed.
    fn off(&self, forces: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.forces[k].map_or(0.0, |f| forces[k] - f / self.limit))
    }

    /// By how much forces may be missed, relative to μN.
    fn tolerance(&self) -> f64 {
        let most = match self.task.resolution {
            Resolution::Target(target) if self.task.method != Method::Fastsim => {
                (SHARE_OF_TARGET * target).max(MISSED_FOR_TARGET)
            }
            _ => MISSED,
        };
        let wanted = length(self.forces.map(|f| f.unwrap_or(0.0) / self.limit));
        // Where pressure alone pulls, the forces of the first motion tried say nothing of the size of those to be sought.
        let first = self.first.filter(|_| !self.task.is_coupled());
        let scale = first.unwrap_or(1.0).max(wanted).min(1.0);
        let left = (NEAR_LIMIT * (1.0 - wanted)).max(0.0);
        let most = if self.rough {
            MISSED_ON_COARSEST.max(most)
        } else {
            most
        };
        (most * scale.min(left)).max(MISSED_LEAST * scale)
    }

    fn motion(&self, place: [f64; 2]) -> Motion {
        self.places.motion(place, &self.task.motions[self.index])
    }

    /// Does the best answer meet the target? Yes if its method or an explicit mesh has none to meet.
    fn met(&self) -> bool {
        let Resolution::Target(target) = self.task.resolution else {
            return true;
        };
        let chosen = self.task.method == Method::BoundaryElement;
        let error = self.best.as_ref().and_then(|(_, point)| point.error());
        !chosen || error.is_some_and(|error| error <= target)
    }

    fn finish(mut self, place: [f64; 2], began: Duration) -> Result<MotionAnswer, SolveError> {
        let asked = self.asked(place);
        let inexact = self.inexact();
        let mut point = match self.best.take() {
            Some((_, point)) => point,
            None => refine::solve(self.task, self.state, asked, self.monitor)?,
        };
        point.remarks.extend(inexact);
        point.work = self.work;
        point.saturated = self.saturated;
        point.seconds = (self.monitor.elapsed() - began).as_secs_f64();
        Ok(point)
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}
