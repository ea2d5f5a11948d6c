//! Stretches of a sweep: nearby motions on a line that the same mesh serves. Some of them are compared with the companion meshes; those in
//! between are solved with one rule only and borrow the result of the comparison from their neighbours.

use std::ops::ControlFlow;

use crate::contact::error::SolveError;
use crate::contact::monitor::Monitor;
use crate::contact::rolling::answer::Work;
use crate::contact::rolling::mesh_plan::Regime;
use crate::contact::rolling::motion::Motion;
use crate::contact::rolling::motion_answer::MotionAnswer;
use crate::contact::rolling::refinement::error_estimate::Indicators;
use crate::contact::rolling::refinement::finer_by_table;
use crate::contact::rolling::refinement::lender::{Lender, apart, borrow, next_stride};
use crate::contact::rolling::refinement::level_solve::{
    JudgedAnswer, MotionTask, SolvedLevel, add_three_point, indicators_on,
};
use crate::contact::rolling::refinement::refine::{self, ComparedAnswer};
use crate::contact::rolling::refinement::state::RefinementState;
use crate::contact::rolling::refinement::sweep_line::SweepLine;
use crate::contact::rolling::refinement::swept_level::{self, LevelStart};
use crate::contact::rolling::refinement::trials::Trials;
use crate::contact::rolling::refinement::waiting::{Compared, Waiting};
use crate::contact::rolling::skip::Skip;
use crate::contact::rolling::task::RollingTask;

/// Number of motions from one comparison to the next at the beginning of a stretch: motions are solved ahead, the last one is compared, and then others between, until what they lend is exact
/// enough. With 1 a map of 1000 motions at fixed spin takes 20 % more products, and the sweeps of `cargo bench --bench calibrate -- sweeps` 0 to 13 %
/// more, but for curves of the fit half at 0.02, which take 11 % fewer; 4 lies between. As many estimates hold.
const STRIDE_FIRST: usize = 8;

/// The stretch that the last motions of a sweep belong to.
#[derive(Debug, Default)]
pub struct Stretch {
    /// The first motion.
    first: Option<Motion>,
    /// The place of the last motion, once there is one.
    last: Option<f64>,
    /// Through the first motion and the second.
    line: Option<SweepLine>,
    /// The number of the level.
    level: usize,
    /// Up to three motions compared last, in order.
    lenders: Vec<Lender>,
    /// By how much the tractions of the three-point rule differ from those of the trapezoid rule, in the last motion that has both.
    apart: [Vec<f64>; 2],
    /// Motions since the last of them.
    waiting: Vec<Waiting>,
    /// Number of motions from one comparison to the next.
    stride: usize,
    /// Work that led to no answer.
    lost: Work,
    trials: Trials,
    /// The table told nothing on the finer mesh either.
    finer_in_vain: bool,
}

impl Stretch {
    /// Solves the next motion of a sweep, which [`may_borrow`](crate::contact::rolling::refinement::lender::may_borrow). Gives the motions whose answers are known now, in order; others wait.
    ///
    /// # Errors
    /// Why there is no answer.
    pub fn solve(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        asked: MotionTask,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<MotionAnswer>, SolveError> {
        let place = self.place(state, &asked.motion);
        let mut begun = None;
        if place.is_some() && self.trials.may_try() {
            begun = self.begin(task, state, asked, monitor)?;
            self.trials.tried(begun.is_some());
        }
        if let Some((place, solved)) = place.zip(begun) {
            self.last = Some(place);
            let solved = match self.by_table(task, state, asked, solved, target, monitor)? {
                ControlFlow::Break(told) => {
                    let point = self.settled(task, state, told, asked, target, monitor)?;
                    self.follow(state)?;
                    return Ok(vec![point]);
                }
                ControlFlow::Continue(solved) => solved,
            };
            self.waiting.push(Waiting {
                asked,
                place,
                solved,
                compared: None,
            });
            if self.waiting.len() < self.stride {
                return Ok(Vec::new());
            }
            return self.settle(task, state, target, monitor);
        }
        let mut done = self.settle(task, state, target, monitor)?;
        let mut found = refine::to_target(task, state, asked, target, monitor)?;
        let work = &mut found.answer.point.work;
        work.add_lost(std::mem::take(&mut self.lost));
        self.begin_anew(state, asked, &found, target);
        done.push(found.answer.point.into());
        Ok(done)
    }

    /// Is nothing left to be settled?
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Ends the stretch before a motion that cannot belong to it, or with the sweep; gives the answers that waited.
    ///
    /// # Errors
    /// Why there is no answer.
    pub fn end(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<MotionAnswer>, SolveError> {
        let done = self.settle(task, state, target, monitor)?;
        *self = Stretch::default();
        Ok(done)
    }

    /// The place of a motion that may follow on the line and the mesh of the stretch.
    fn place(&mut self, state: &RefinementState, motion: &Motion) -> Option<f64> {
        let last = self.last?;
        let plan = state.sweep.begin?;
        if state.levels.get(self.level).plan != plan {
            return None;
        }
        if self.line.is_none() {
            self.line = SweepLine::through(self.first.as_ref()?, motion);
        }
        self.line?.place(motion).filter(|place| *place > last)
    }

    /// Solves a motion with the trapezoid rule on the mesh of the stretch, if there is a start and the mesh serves it.
    fn begin(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        asked: MotionTask,
        monitor: &dyn Monitor,
    ) -> Result<Option<JudgedAnswer>, SolveError> {
        let level = state.levels.used(self.level);
        let motion = level.scale.motion(&asked.motion);
        let sweep = &state.sweep;
        let Some(traction) = sweep.start_of_one_rule(self.level, &level, &motion) else {
            return Ok(None);
        };
        let start = LevelStart {
            level: self.level,
            traction,
            apart: &self.apart,
        };
        let found = swept_level::solve(task, state, asked, &start, &mut self.lost, monitor)?;
        let Some(solved) = found else {
            return Ok(None);
        };
        let serves = match solved.indicators {
            Indicators::ByTable { .. } => true,
            Indicators::Known(_) => false,
            Indicators::Measured(_) => {
                let found = refine::regime_of(state, asked, &solved.point);
                level.plan.regime == Regime::Unknown || level.plan.serves(found)
            }
        };
        if !serves {
            self.lost.add(solved.point.work);
            return Ok(None);
        }
        Ok(Some(solved))
    }

    /// Begins a stretch with a motion that was solved in the usual way.
    fn begin_anew(
        &mut self,
        state: &RefinementState,
        asked: MotionTask,
        found: &ComparedAnswer,
        target: f64,
    ) {
        debug_assert!(self.waiting.is_empty());
        *self = Stretch {
            stride: STRIDE_FIRST,
            lost: self.lost,
            trials: self.trials,
            ..Stretch::default()
        };
        let point = &found.answer.point;
        let level = state.levels.get(point.level);
        let lender = Lender::new(0.0, &level, &found.answer, &found.companions);
        let told = found.answer.indicators.is_by_table();
        if found.met(target) && (lender.is_some() || told) {
            self.first = Some(asked.motion);
            self.last = Some(0.0);
            self.level = point.level;
            self.apart = apart(&point.tangential);
            self.lenders.extend(lender);
        }
    }

    /// The answer of a motion if the table tells that its error meets the target, here or on a finer mesh, with which the stretch goes on.
    fn by_table(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        asked: MotionTask,
        solved: JudgedAnswer,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<ControlFlow<JudgedAnswer, JudgedAnswer>, SolveError> {
        if !self.waiting.is_empty() {
            return Ok(ControlFlow::Continue(solved));
        }
        if solved.indicators.is_by_table() {
            return Ok(ControlFlow::Break(solved));
        }
        if self.finer_in_vain {
            return Ok(ControlFlow::Continue(solved));
        }
        let lost = &mut self.lost;
        let finer = finer_by_table::solve(task, state, asked, &solved, target, lost, monitor)?;
        let Some(finer) = finer else {
            self.finer_in_vain = true;
            return Ok(ControlFlow::Continue(solved));
        };
        self.go_on_with(state, finer.point.level);
        Ok(ControlFlow::Break(finer))
    }

    /// Goes on with the mesh that the next motion is to begin on, if it is another one.
    fn follow(&mut self, state: &mut RefinementState) -> Result<(), SolveError> {
        let here = state.levels.get(self.level).plan;
        if let Some(next) = state.sweep.begin.filter(|next| *next != here) {
            let number = state.levels.level(next)?;
            state.carry_steps([self.level, number], true);
            self.go_on_with(state, number);
        }
        Ok(())
    }

    /// Goes on with another mesh, on which nothing was compared.
    fn go_on_with(&mut self, state: &RefinementState, number: usize) {
        let cells = state.levels.get(number).mesh.cells();
        self.level = number;
        self.apart = [0, 1].map(|_| vec![0.0; cells]);
        self.lenders.clear();
        self.stride = STRIDE_FIRST;
        self.finer_in_vain = false;
    }

    /// Compares the last motion that waits, and as many of the others as it takes; all others borrow.
    fn settle(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<Vec<MotionAnswer>, SolveError> {
        let mut waiting = std::mem::take(&mut self.waiting);
        let Some(last) = waiting.len().checked_sub(1) else {
            return Ok(Vec::new());
        };
        let mut lenders = std::mem::take(&mut self.lenders);
        if waiting[last].is_open() {
            self.compare(task, state, &mut waiting[last], &mut lenders, monitor)?;
        }
        while let Some(k) = self.wrong(task, state, &mut waiting, &lenders, target) {
            self.compare(task, state, &mut waiting[k], &mut lenders, monitor)?;
        }
        let each = (waiting[last].place - waiting[0].place) / last.max(1) as f64;
        let mut done = Vec::with_capacity(waiting.len());
        for (k, one) in waiting.into_iter().enumerate() {
            let ends = (k == last).then_some(&mut lenders);
            done.push(self.close(task, state, one, ends, target, monitor)?);
        }
        lenders.drain(..lenders.len().saturating_sub(3));
        self.lenders = lenders;
        self.stride = next_stride(task, &self.lenders, self.stride, each, target);
        Ok(done)
    }

    /// The answer of a motion that waited. From the last one, which gets the lenders, the stretch goes on or begins anew.
    fn close(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        one: Waiting,
        lenders: Option<&mut Vec<Lender>>,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<MotionAnswer, SolveError> {
        if one.solved.indicators.is_by_table() {
            return self.settled(task, state, one.solved, one.asked, target, monitor);
        }
        let Some(Compared::Lends(found) | Compared::Alone(found)) = one.compared else {
            return self.borrowed(task, state, one, monitor);
        };
        let met = found.met(target);
        let mut found = if met {
            state.sweep.begin = Some(refine::next_begin(state, &found.answer, target));
            found
        } else {
            refine::refined(task, state, one.asked, target, found, monitor)?
        };
        let work = &mut found.answer.point.work;
        work.add_lost(std::mem::take(&mut self.lost));
        if let Some(lenders) = lenders {
            let on_level = found.answer.point.level == self.level;
            let lends = lenders.last().is_some_and(|l| l.place == one.place);
            if on_level && met && lends {
                self.apart = apart(&found.answer.point.tangential);
            } else {
                self.begin_anew(state, one.asked, &found, target);
                *lenders = std::mem::take(&mut self.lenders);
            }
        }
        Ok(found.answer.point.into())
    }

    /// Solves a motion that waits with the other rule and on the companions.
    fn compare(
        &self,
        task: &RollingTask,
        state: &mut RefinementState,
        one: &mut Waiting,
        lenders: &mut Vec<Lender>,
        monitor: &dyn Monitor,
    ) -> Result<(), SolveError> {
        let mut solved = one.solved.clone();
        self.add_slips(task, state, &mut solved.point, one.asked, monitor)?;
        let level = state.levels.used(self.level);
        solved.indicators = indicators_on(task, state, &level, &solved.point, None);
        solved.point.errors = solved.indicators.errors();
        let companions = refine::judge(task, state, one.asked, &mut solved, None, monitor)?;
        let lender = Lender::new(one.place, &level, &solved, &companions);
        let found = ComparedAnswer {
            answer: solved,
            companions,
        };
        one.compared = Some(match lender {
            Some(lender) => {
                let at = lenders.partition_point(|other| other.place < lender.place);
                lenders.insert(at, lender);
                Compared::Lends(found)
            }
            None => Compared::Alone(found),
        });
        Ok(())
    }

    /// Lends to all motions between those compared; the number of one that has to be compared itself, if there is any.
    fn wrong(
        &self,
        task: &RollingTask,
        state: &RefinementState,
        waiting: &mut [Waiting],
        lenders: &[Lender],
        target: f64,
    ) -> Option<usize> {
        let alone = waiting
            .iter()
            .any(|one| matches!(one.compared, Some(Compared::Alone(_))));
        for k in 0..waiting.len() {
            if !waiting[k].is_open() {
                continue;
            }
            let end = lenders.partition_point(|lender| lender.place < waiting[k].place);
            let lent = match (alone, end.checked_sub(1), lenders.get(end)) {
                (false, Some(begin), Some(_)) => {
                    let one = &mut waiting[k];
                    let mut solved = one.solved.clone();
                    let fine = borrow(task, state, target, &mut solved, one.place, lenders, begin);
                    let met = solved.point.error().is_some_and(|error| error <= target);
                    if fine && met {
                        one.solved.indicators = solved.indicators;
                        one.solved.point = solved.point;
                    }
                    fine && met
                }
                _ => false,
            };
            if !lent {
                // The middle one of those between the same lenders.
                let between = |one: &&Waiting| {
                    one.is_open()
                        && lenders.partition_point(|lender| lender.place < one.place) == end
                };
                let count = waiting[k..].iter().take_while(between).count();
                return Some(k + (count - 1) / 2);
            }
        }
        None
    }

    /// The answer of a motion whose error the table told.
    fn settled(
        &mut self,
        task: &RollingTask,
        state: &mut RefinementState,
        solved: JudgedAnswer,
        asked: MotionTask,
        target: f64,
        monitor: &dyn Monitor,
    ) -> Result<MotionAnswer, SolveError> {
        state.sweep.begin = Some(refine::next_begin(state, &solved, target));
        let mut point = solved.point;
        if task.wants_slips {
            self.add_slips(task, state, &mut point, asked, monitor)?;
        }
        point.work.add_lost(std::mem::take(&mut self.lost));
        Ok(point.into())
    }

    /// The answer of a motion that has borrowed.
    fn borrowed(
        &self,
        task: &RollingTask,
        state: &mut RefinementState,
        one: Waiting,
        monitor: &dyn Monitor,
    ) -> Result<MotionAnswer, SolveError> {
        let mut solved = one.solved;
        if task.wants_slips {
            self.add_slips(task, state, &mut solved.point, one.asked, monitor)?;
        }
        let mut answer = MotionAnswer::from(solved.point);
        answer.skips.push(Skip::Companions);
        Ok(answer)
    }

    /// Adds the three-point rule, started as far from the other rule as in the last motion that has both.
    fn add_slips(
        &self,
        task: &RollingTask,
        state: &mut RefinementState,
        solved: &mut SolvedLevel,
        asked: MotionTask,
        monitor: &dyn Monitor,
    ) -> Result<(), SolveError> {
        add_three_point(task, state, solved, asked, &self.apart, monitor)
    }
}
