//! The steps of an evolution. Each is a pure function of the state before it.
//!
//! A step is the midpoint rule: the wear of the present sections moves them by half a step, and the wear of these sections moves the present ones by
//! the whole step. The change of the wear over half a step estimates the error. It decides whether the step is accepted and how long the next one
//! is. Its signed sum is the reported error of the steps.
//!
//! Waves shorter than a patch are worn down within a fraction of its depth, because a wave of the length λ changes the pressure by π E* / λ per
//! amplitude. Explicit steps are stable if the wear of a step is smoothed over a length of at least about a tenth of its depth times E* over the
//! pressure. The defaults of `smoothing_mm` and `step_depth_mm` are chosen together.

use rayon::ThreadPoolBuilder;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::error::SolveError;
use crate::evolution::pass::{BodyWear, Pass, pass};
use crate::evolution::record::{record, warnings};
use crate::evolution::section::{
    add, area_between, depths, distance, lengths, machined, moved, smoothed,
};
use crate::evolution::task::{Evolution, PlannedEvent, Sections, SolveContext};
use crate::evolution::traffic::condensed;
use crate::geometry::profile::Body;
use crate::monitor::{Monitor, MonitorPart};
use crate::numerics::roots::ROUNDING;
use crate::remark::entry::RemarkEntry;
use crate::solution::words::evolution::{
    BodyState, EvolutionRecord, EvolutionState, StateContact, WornBody,
};

/// Length of the shortest step relative to the extent.
const SHORTEST: f64 = 1e-7;
/// Most attempts at one step.
const ATTEMPTS: u32 = 8;
/// Largest share of the traffic that may have no answer.
const UNSOLVED: f64 = 0.1;
/// Stack of a thread that solves states.
const STACK_BYTES: usize = 16 << 20;
const BODIES: [Body; 2] = [Body::Rail, Body::Wheel];

impl Evolution {
    /// The state before the first step.
    pub fn begin(&self) -> EvolutionState {
        EvolutionState {
            next: 1.0 / f64::from(self.plan.records),
            bodies: self.start().map(|start| BodyState {
                worn: WornBody {
                    depth_mm: vec![0.0; start.len()],
                    damage: vec![0.0; start.len()],
                    points_mm: start.clone(),
                    ..WornBody::default()
                },
                step_change_mm: vec![0.0; start.len()],
                start_mm: start,
                ..BodyState::default()
            }),
            ..EvolutionState::default()
        }
    }

    /// Returns whether the evolution is finished.
    pub fn is_over(&self, state: &EvolutionState) -> bool {
        let is_done = state.share >= 1.0 && self.due(state).is_none();
        state.recorded && (is_done || state.ended_early.is_some())
    }

    /// The next event, if it is due.
    fn due(&self, state: &EvolutionState) -> Option<&PlannedEvent> {
        let next = state.events_done as usize;
        let event = self.events.get(next);
        event.filter(|_| self.share_of_event(next) <= state.share + ROUNDING)
    }

    /// Does one step: condenses the traffic, applies the events that are due, or advances the sections. Returns the new state, and the record of the
    /// state before if one is due. An evolution with at least one step ends early if it cannot be continued or its time is over.
    ///
    /// # Errors
    /// Returns an error if the work is cancelled, or if the first step fails: more than a tenth of the traffic has no answer, or the time is over.
    pub fn step(
        &self,
        context: &SolveContext,
        before: &EvolutionState,
        monitor: &(dyn Monitor + Sync),
    ) -> Result<(EvolutionState, Option<EvolutionRecord>), SolveError> {
        let found = self.try_step(context, before, monitor);
        found.or_else(|error| Ok((Evolution::end_early(before, error)?, None)))
    }

    /// The state of an evolution that ends because of an error, with the records that it has.
    ///
    /// # Errors
    /// Returns the error if no step is done, or if the work is cancelled.
    pub fn end_early(
        state: &EvolutionState,
        error: SolveError,
    ) -> Result<EvolutionState, SolveError> {
        if state.share == 0.0 || matches!(error, SolveError::Cancelled) {
            return Err(error);
        }
        let reason = match error {
            // The motions are those of one state.
            SolveError::OutOfTime { limit_s, .. } => SolveError::OutOfTime {
                limit_s,
                motions: None,
            },
            other => other,
        };
        Ok(EvolutionState {
            ended_early: Some(reason.to_string()),
            recorded: true,
            ..state.clone()
        })
    }

    fn try_step(
        &self,
        context: &SolveContext,
        before: &EvolutionState,
        monitor: &(dyn Monitor + Sync),
    ) -> Result<(EvolutionState, Option<EvolutionRecord>), SolveError> {
        let solver = Solver {
            task: self,
            context,
            monitor,
            share: before.share,
        };
        let mut state = before.clone();
        if before.traffic.states.is_empty() {
            let on = sections(&before.bodies, before.friction, 0.0);
            state.traffic = condensed(self, &mut |states| {
                state.solves += states.len() as u32;
                solver.passes(on, states)
            })?;
            return Ok((state, None));
        }
        let (now, states, remarks) = solver.evaluate(before, &before.bodies)?;
        state.solves += states.len() as u32;
        state.wheel_y = touched(&states, &before.wheel_y);
        let found = (!before.recorded).then(|| record(self, before, states, remarks, monitor));
        let found = found.transpose()?;
        state.recorded = true;
        if self.due(&state).is_some() {
            while let Some(event) = self.due(&state) {
                happen(event, &mut state);
            }
            state.recorded = false;
        } else if state.share < 1.0 && state.ended_early.is_none() {
            self.advance(&solver, &now, &mut state)?;
        }
        Ok((state, found))
    }

    /// Does steps until there is a record, the evolution is finished or `most` steps are done. Returns the new state, and the record.
    ///
    /// # Errors
    /// Returns the errors of [`Evolution::step`].
    pub fn steps(
        &self,
        context: &SolveContext,
        mut state: EvolutionState,
        most: u32,
        monitor: &(dyn Monitor + Sync),
    ) -> Result<(EvolutionState, Option<EvolutionRecord>), SolveError> {
        let mut found = None;
        for _ in 0..most {
            (state, found) = self.step(context, &state, monitor)?;
            if found.is_some() || self.is_over(&state) {
                break;
            }
        }
        Ok((state, found))
    }

    /// Advances the sections by a step.
    fn advance(
        &self,
        solver: &Solver,
        now: &[BodyWear; 2],
        state: &mut EvolutionState,
    ) -> Result<(), SolveError> {
        let (accuracy, begin) = (&self.plan.accuracy, state.share);
        let bodies = state.bodies.clone();
        let depths = [0, 1].map(|k| depths(&bodies[k].worn.points_mm, &now[k].area));
        let deepest = depths.iter().flatten().copied().fold(0.0, f64::max);
        let allowed = accuracy.step_depth_mm / deepest.max(f64::MIN_POSITIVE);
        let stop = self.next_stop(begin);
        let left = stop - begin;
        let mut length = state.next.min(allowed).max(SHORTEST);
        for attempt in 1..=ATTEMPTS {
            // The step must not end just before the stop.
            let step = if length >= left {
                left
            } else if length > 0.6 * left {
                0.5 * left
            } else {
                length
            };
            let half = [0, 1].map(|k| moved_body(BODIES[k], &bodies[k], &now[k], 0.5 * step));
            let (then, states, _) = solver.evaluate(state, &half)?;
            state.solves += states.len() as u32;
            let changes = [0, 1].map(|k| change(&now[k].area, &then[k].area));
            let error = 0.5 * changes[0].max(changes[1]);
            let better = (0.8 * accuracy.step_tolerance / error.max(1e-6)).clamp(0.4, 2.0);
            if error > accuracy.step_tolerance && step > SHORTEST && attempt < ATTEMPTS {
                state.rejected += 1;
                length = step * better.min(0.7);
                continue;
            }
            state.bodies = [0, 1].map(|k| {
                let mut body = moved_body(BODIES[k], &bodies[k], &then[k], step);
                let lengths = lengths(&body.worn.points_mm);
                for (i, sum) in body.step_change_mm.iter_mut().enumerate() {
                    *sum += 0.5 * step * (then[k].area[i] - now[k].area[i]) / lengths[i];
                }
                body
            });
            state.steps += 1;
            state.wheel_y = touched(&states, &state.wheel_y);
            let least = if step < length { length } else { 0.0 };
            state.next = least.max(step * better);
            state.share = begin + step;
            if (stop - state.share).abs() < ROUNDING {
                state.share = stop;
                state.recorded = false;
            }
            let most = accuracy.steps_max;
            if state.share < 1.0 && state.steps >= most {
                state.ended_early = Some(format!("steps_max = {most} steps are done"));
                state.recorded = false;
            }
            break;
        }
        Ok(())
    }

    /// The next share of the extent with a record or an event.
    fn next_stop(&self, share: f64) -> f64 {
        let records = f64::from(self.plan.records);
        let record = ((share + ROUNDING) * records).floor() + 1.0;
        let events = (0..self.events.len()).map(|k| self.share_of_event(k));
        let events = events.filter(|at| *at > share + ROUNDING);
        events.fold((record / records).min(1.0), f64::min)
    }
}

/// Wear of rail and wheel, the contact of each state, and the warnings of the states.
type Evaluated = ([BodyWear; 2], Vec<StateContact>, Vec<RemarkEntry>);

/// Solves the states of a step.
struct Solver<'a> {
    task: &'a Evolution,
    context: &'a SolveContext,
    monitor: &'a (dyn Monitor + Sync),
    /// Share of the extent that is done.
    share: f64,
}

impl Solver<'_> {
    /// The wear of all states of an evolution on some sections, over the whole extent and smoothed.
    fn evaluate(
        &self,
        of: &EvolutionState,
        bodies: &[BodyState; 2],
    ) -> Result<Evaluated, SolveError> {
        let on = sections(bodies, of.friction, radius_change(of, &bodies[1]));
        let mut wear = BodyWear::none(on);
        let mut states = Vec::with_capacity(of.traffic.states.len());
        let values: Vec<&[f64]> = of.traffic.states.iter().map(|s| &*s.values).collect();
        let passes = self.passes(on, &values)?;
        let warnings = warnings(&of.traffic, &passes);
        for (state, pass) in of.traffic.states.iter().zip(passes) {
            let share = state.share;
            for (k, own) in pass.wear.into_iter().enumerate() {
                wear[k].add(share, &own.spread(state.spread_mm[k]));
            }
            states.push(StateContact {
                share,
                ..pass.contact
            });
        }
        let mut failed = states.iter().filter(|state| state.failure.is_some());
        let unsolved: f64 = failed.clone().map(|state| state.share).sum();
        if unsolved > UNSOLVED {
            let first = failed.next().and_then(|state| state.failure.as_deref());
            let reason = format!(
                "{:.0} % of the traffic have no answer; the first of these states: {}",
                100.0 * unsolved,
                first.unwrap_or_default()
            );
            return Err(SolveError::NormalProblem { reason });
        }
        let mut all = BodyWear::none(on);
        for (k, all) in all.iter_mut().enumerate() {
            all.add(self.task.amounts[k], &wear[k]);
            all.area = smoothed(&all.area, self.task.plan.accuracy.smoothing_mm);
        }
        Ok((all, states, warnings))
    }

    /// Solves the states with these values independently, on the threads of the context.
    fn passes(&self, on: Sections, states: &[&[f64]]) -> Result<Vec<Pass>, SolveError> {
        let solve = |values: &&[f64]| {
            let monitor = MonitorPart::new(self.monitor, self.share, 0.0);
            pass(self.task, self.context, on, values, &monitor)
        };
        let threads = self.context.threads;
        let pool = ThreadPoolBuilder::new().num_threads(threads);
        match pool.stack_size(STACK_BYTES).build() {
            Ok(pool) if threads > 1 => pool.install(|| states.par_iter().map(solve).collect()),
            // With one thread, or without a pool, the calling thread solves all states.
            _ => states.iter().map(solve).collect(),
        }
    }
}

fn happen((planned, sections): &PlannedEvent, state: &mut EvolutionState) {
    for ((body, target), kind) in state.bodies.iter_mut().zip(sections).zip(BODIES) {
        let Some(target) = target else { continue };
        let before = &body.worn.points_mm;
        let after = machined(kind, before, target, planned.depth_mm);
        body.worn.machined_area_mm2 += area_between(kind, before, &after);
        // Cracks are removed with the material.
        for (k, damage) in body.worn.damage.iter_mut().enumerate() {
            if after[k] != before[k] {
                *damage = 0.0;
            }
        }
        body.worn.points_mm = after;
    }
    state.friction = planned.friction_coefficient.or(state.friction);
    state.events_done += 1;
}

fn sections(bodies: &[BodyState; 2], friction: Option<f64>, radius: f64) -> Sections<'_> {
    Sections {
        points: [0, 1].map(|k| bodies[k].worn.points_mm.as_slice()),
        friction,
        radius,
    }
}

/// y on the wheel's section of the patch with the largest load in each state. For a state that was not solved, the value before is kept.
fn touched(states: &[StateContact], before: &[f64]) -> Vec<f64> {
    let of_state = |(k, state): (usize, &StateContact)| {
        let patches = state.patches.iter();
        let most = patches.max_by(|a, b| a.normal_force_n.total_cmp(&b.normal_force_n));
        let most = most.map(|patch| patch.wheel_mm[0]);
        most.or(before.get(k).copied()).unwrap_or(0.0)
    };
    states.iter().enumerate().map(of_state).collect()
}

/// Mean change of the wheel's radius in mm at the contacts of all states. The free rolling radius changes by this.
fn radius_change(of: &EvolutionState, wheel: &BodyState) -> f64 {
    let up = |points: &[[f64; 2]], y: f64| distance(points, [y, 1e3], [0.0, -1.0]);
    let parts = of.traffic.states.iter().zip(&of.wheel_y).map(|(state, y)| {
        let [before, after] = [&wheel.start_mm, &wheel.worn.points_mm].map(|points| up(points, *y));
        let change = before.zip(after).map(|(before, after)| before - after);
        change.map_or(0.0, |change| state.share * change)
    });
    parts.sum()
}

/// Sum of the absolute differences of two distributions, relative to the sum of the second.
fn change(now: &[f64], then: &[f64]) -> f64 {
    let all: f64 = then.iter().sum();
    let pairs = now.iter().zip(then);
    let off: f64 = pairs.map(|(now, then)| (then - now).abs()).sum();
    if all > 0.0 { off / all } else { 0.0 }
}

/// A body after a share of the extent under this wear.
fn moved_body(body: Body, before: &BodyState, wear: &BodyWear, share: f64) -> BodyState {
    let areas: Vec<f64> = wear.area.iter().map(|area| share * area).collect();
    let (points, depth) = moved(body, &before.worn.points_mm, &areas);
    let mut state = before.clone();
    let worn = &mut state.worn;
    worn.worn_area_mm2 += area_between(body, &before.worn.points_mm, &points);
    worn.points_mm = points;
    add(&mut worn.depth_mm, 1.0, &depth);
    let damage = worn.damage.iter_mut().zip(&wear.damage);
    damage.for_each(|(sum, damage)| *sum = (*sum + share * damage).max(0.0));
    add(&mut state.regimes_mm2, share, &wear.regimes);
    state.contact_mm2 += share * wear.open;
    state
}
