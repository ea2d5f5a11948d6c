//! A history on one mesh, step by step.

use std::sync::Arc;

use crate::friction::coefficient_table::CoefficientTable;
use crate::friction::velocity_weakening::Softening;
use crate::half_space::strip_operator::kind::Parity;
use crate::half_space::strip_operator::operator::StripOperator;
use crate::mesh::Mesh;
use crate::monitor::{Monitor, Stop};
use crate::numerics::equilibrium::{Search, Trial};
use crate::rolling::answer::{LevelFailure, Work};
use crate::rolling::displacement_memory::LeadingEdges;
use crate::rolling::history::plan::{
    HistoryStep, HistoryTask, Pace, PointRecord, StepEquations, StepKind, memory, steady, steps,
    weights,
};
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::methods::boundary_element::task::NewtonTask;
use crate::rolling::methods::boundary_element::workspace::NewtonWorkspace;
use crate::rolling::slip_equations::{SlipEquations, SlipScratch};
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::{Motion, PrescribedForces, RollingTask};

/// The solve of a history on one mesh.
pub struct LevelRun<'a> {
    pub(super) task: &'a RollingTask<'a>,
    pub(super) history: &'a HistoryTask,
    pub(super) level: &'a StripMesh,
    pub(super) operator: Arc<StripOperator>,
    pub(super) parity: Option<Parity>,
    pub(super) edges: LeadingEdges,
    /// Number of cells with unknowns.
    pub(super) cells: usize,
    /// Bounds of the last step.
    pub(super) bound: Vec<f64>,
    pub(super) track: Option<TrackFriction>,
    pub(super) slip_friction: Option<SlipFriction>,
    /// Friction limit of the unknowns with the largest coefficient, dimensionless.
    pub(super) limit: f64,
    pub(super) area: Vec<f64>,
    /// Tolerances of the residual of the tractions and of the forces, both relative.
    pub(super) tolerance: [f64; 2],
    pub(super) workspace: &'a mut NewtonWorkspace,
    pub(super) monitor: &'a dyn Monitor,
    pub(super) state: RunState,
}

/// The state before a step.
#[derive(Debug, Clone, Default)]
pub(super) struct RunState {
    pub(super) tractions: Vec<f64>,
    /// The start of the next solve.
    pub(super) guess: Vec<f64>,
    /// Displacements at the nodes.
    pub(super) displacement: Vec<f64>,
    /// Displacements one step before.
    pub(super) earlier: Vec<f64>,
    /// Dimensionless creepages or shift of the last step.
    pub(super) motion: Motion,
    pub(super) power: Vec<f64>,
    pub(super) dissipated: Vec<f64>,
    /// Elastic energy of every patch in N·mm, now and one step before.
    pub(super) stored: Vec<[f64; 2]>,
    pub(super) work: Work,
    pub(super) saturated: bool,
}

impl<'a> LevelRun<'a> {
    /// A history that begins without tractions.
    ///
    /// # Errors
    /// The monitor may stop the work.
    pub fn new(
        task: &'a RollingTask<'a>,
        history: &'a HistoryTask,
        level: &'a StripMesh,
        tolerance: [f64; 2],
        workspace: &'a mut NewtonWorkspace,
        monitor: &'a dyn Monitor,
    ) -> Result<LevelRun<'a>, Stop> {
        let operator = level.operator(monitor)?;
        let parity = level.parity(&every_motion(task, history));
        let padded = operator.padded(parity);
        let resized = |values: &[f64]| {
            let mut values = values.to_vec();
            values.resize(padded.max(values.len()), 0.0);
            values
        };
        let patches = task.footprint.patches().len();
        let zero = vec![0.0; 2 * padded];
        let cells = match parity {
            Some(_) => level.mesh.cells() / 2,
            None => level.mesh.cells(),
        };
        let (bound, area) = (resized(&level.bound), resized(&level.normalised.areas()));
        let forces = area.iter().zip(&bound).take(cells);
        let law = task.friction.along();
        Ok(LevelRun {
            cells,
            limit: forces.map(|(area, bound)| area * bound).sum(),
            track: law.map(|law| TrackFriction::new(law, &level.mesh, cells, &bound)),
            slip_friction: (task.bound_fall(0, level.scale.slip()))
                .map(|fall| SlipFriction::new(fall, &bound)),
            edges: LeadingEdges::new(&level.normalised, level.poisson_ratio, parity),
            bound,
            area,
            state: RunState {
                tractions: zero.clone(),
                guess: zero.clone(),
                displacement: zero.clone(),
                earlier: zero,
                power: vec![0.0; patches],
                dissipated: vec![0.0; patches],
                stored: vec![[0.0; 2]; patches],
                ..RunState::default()
            },
            task,
            history,
            level,
            operator,
            parity,
            tolerance,
            workspace,
            monitor,
        })
    }

    /// Solves all points.
    ///
    /// # Errors
    /// The point to which a step did not converge, or at which the monitor stopped the work.
    pub fn run(mut self, pace: Pace) -> Result<Vec<PointRecord>, (usize, LevelFailure)> {
        let forced = self.task.forces.iter().any(|forces| *forces != [None; 2]);
        // The creepages of prescribed forces are less accurate with short steps.
        let pace = if forced { pace.by_length() } else { pace };
        let steps = steps(self.history, pace, forced);
        let mut points = Vec::with_capacity(self.history.distances.len());
        let (level, operator) = (self.level, Arc::clone(&self.operator));
        let (parity, edges) = (self.parity, self.edges.clone());
        let mut done = 0.0;
        for alike in steps.chunk_by(|a, b| a.kind == b.kind) {
            let kind = alike[0].kind;
            let equations = steady(Rule::ThreePoint, (level, &operator, parity));
            let equations = equations.with_memory(memory(kind, &edges, level.scale.length));
            let gain = self.gain(&equations);
            if let (Some(friction), StepKind::Roll { .. }) = (&mut self.slip_friction, kind) {
                friction.damp(&gain, equations.memory_factor() / level.scale.length);
            }
            let newton = Newton::new(&equations)
                .falling(&self.bound, self.fall(kind))
                .far_reaching(&gain);
            let of = StepEquations {
                kind,
                equations: &equations,
                newton: &newton,
            };
            let mut search = self.search(kind);
            for step in alike {
                let watched = self.monitor.go_on(done / steps.len() as f64);
                watched.map_err(|stop| (step.point, stop.into()))?;
                done += 1.0;
                self.step(&of, step, &mut search)
                    .map_err(|failure| (step.point, failure))?;
                if step.last {
                    points.push(self.record(&of));
                }
            }
        }
        Ok(points)
    }

    /// The decrease of the slip of each cell through the displacements of a step if all tractions grow by one.
    fn gain(&self, equations: &SlipEquations) -> Vec<f64> {
        let mut even = vec![0.0; self.state.tractions.len()];
        even[..self.cells].fill(1.0);
        let mut gain = vec![0.0; even.len()];
        equations.displacement(&even, &mut gain, &mut SlipScratch::default());
        gain.truncate(self.cells);
        gain.iter_mut()
            .for_each(|u| *u *= equations.memory_factor());
        gain
    }

    /// The search for the forces of steps of a kind.
    fn search(&self, kind: StepKind) -> Search<2> {
        let limit = self.limit;
        let patch = self.task.footprint.patches()[0].extent;
        // The tangential stiffness of a circular patch of both bodies over shear modulus and radius (Mindlin 1949). Later trials use the stiffness found.
        let stiffness = 4.0 / (2.0 - self.level.poisson_ratio) / limit;
        let reach = match kind {
            StepKind::Shift | StepKind::Press => 1.0,
            StepKind::Roll { distance, growth } => {
                distance / (self.level.scale.length * weights(growth)[0])
            }
            // Creepage produces most of its force within half of the length.
            StepKind::Steady => 0.5 * (patch[1] - patch[0]) / self.level.scale.length,
        };
        let scale = self.task.forces[0].map(|force| force.map(|_| 1.0 / (stiffness * reach)));
        Search::new(scale, [f64::INFINITY; 2])
    }

    /// Solves one step with its motion, or with the motion that gives its forces.
    fn step(
        &mut self,
        of: &StepEquations,
        step: &HistoryStep,
        search: &mut Search<2>,
    ) -> Result<(), LevelFailure> {
        if let Some(track) = &self.track {
            track.set_bounds(step.travelled(self.history), &mut self.bound);
        }
        if let Some(friction) = &self.slip_friction {
            friction.set_bounds(of.kind, &mut self.bound);
        }
        if of.kind == StepKind::Press {
            return self.press(of);
        }
        let (given, forces) = self.asked(step);
        let memory = self.memory(of);
        if forces == [None; 2] {
            let tractions = self.solve(of, &given, &memory)?;
            self.advance(of, given, tractions);
            return Ok(());
        }
        let limit = self.task.friction.limit_of_all(self.task.footprint);
        let wanted = forces.map(|force| force.unwrap_or(0.0) / limit);
        let start = match of.kind {
            StepKind::Shift => given,
            _ => self.state.motion,
        };
        let tolerance = self.tolerance[1];
        let found = search.find([start.creepage_x, start.creepage_y], |place| {
            let motion = Motion {
                creepage_x: forces[0].map_or(given.creepage_x, |_| place[0]),
                creepage_y: forces[1].map_or(given.creepage_y, |_| place[1]),
                ..given
            };
            let tractions = self.solve(of, &motion, &memory)?;
            let forces = self.forces(&tractions);
            Ok::<_, LevelFailure>(Trial {
                residual: [0, 1].map(|k| forces[k] - wanted[k]),
                tolerance,
                value: (motion, tractions),
            })
        })?;
        self.state.saturated |= found.residual > 10.0 * tolerance;
        let (motion, tractions) = found.value;
        self.advance(of, motion, tractions);
        Ok(())
    }

    /// Dimensionless motion and forces of a step.
    fn asked(&self, step: &HistoryStep) -> (Motion, PrescribedForces) {
        let RollingTask {
            motions, forces, ..
        } = self.task;
        let scale = self.level.scale;
        let point = step.point;
        let before = point.saturating_sub(1);
        let (share, rest) = (step.share, 1.0 - step.share);
        let between = |a: f64, b: f64| rest * a + share * b;
        let (from, to) = (&forces[before], &forces[point]);
        let forces = [0, 1].map(|k| to[k].map(|to| between(from[k].unwrap_or(to), to)));
        if step.kind == StepKind::Shift {
            let shift = self.history.shifts[point];
            // A force that is applied before the bodies roll has no given shift.
            let shift = if step.last { shift } else { Motion::default() };
            let shift = scale.motion(&shift);
            let length = scale.length;
            let shift = Motion::of(shift.components().map(|part| part / length));
            return (shift, self.task.forces[point]);
        }
        let [from, to] = [before, point].map(|k| motions[k].components());
        let motion = Motion::of([0, 1, 2].map(|k| between(from[k], to[k])));
        (scale.motion(&motion), forces)
    }

    /// The slip from the displacements before the step.
    fn memory(&self, of: &StepEquations) -> [Vec<f64>; 2] {
        let RunState {
            displacement,
            earlier,
            ..
        } = &self.state;
        let part: Vec<f64> = match of.kind {
            StepKind::Steady | StepKind::Press => vec![0.0; displacement.len()],
            StepKind::Shift => displacement.clone(),
            StepKind::Roll { distance, growth } => {
                let unit = self.level.scale.length / distance;
                let [_, last, before] = weights(growth).map(|w| w * unit);
                let both = displacement.iter().zip(earlier);
                both.map(|(u, earlier)| last * u - before * earlier)
                    .collect()
            }
        };
        let (x, y) = part.split_at(part.len() / 2);
        [x.to_vec(), y.to_vec()]
    }

    /// Tractions of a step under a dimensionless motion.
    pub(super) fn solve(
        &mut self,
        of: &StepEquations,
        motion: &Motion,
        [x, y]: &[Vec<f64>; 2],
    ) -> Result<Vec<f64>, LevelFailure> {
        let mut rigid = self.rigid(of, motion);
        self.add_to_cells(&mut rigid, [x, y]);
        let law = NewtonTask {
            rigid: &rigid,
            bound: &self.bound,
            fall: self.fall(of.kind),
            area: &self.area,
            scale: 1.0,
            tolerance: self.tolerance[0],
            accepts_start: true,
        };
        let mut tractions = self.state.guess.clone();
        let mut report = of
            .newton
            .solve(&law, &mut tractions, self.workspace, self.monitor)?;
        let mut work = of.newton.work(&report);
        if !report.converged {
            // The start may prevent convergence.
            tractions.fill(0.0);
            report = of
                .newton
                .solve(&law, &mut tractions, self.workspace, self.monitor)?;
            work.add(of.newton.work(&report));
        }
        self.state.work.add(work);
        if !report.converged {
            return Err(LevelFailure::NotConverged {
                work: self.state.work,
                tolerance: self.tolerance[0],
                advice: report.advice(),
            });
        }
        self.state.guess.clone_from(&tractions);
        Ok(tractions)
    }

    /// Forces of the unknowns over the friction limit.
    fn forces(&self, tractions: &[f64]) -> [f64; 2] {
        let (x, y) = tractions.split_at(tractions.len() / 2);
        let sum = |values: &[f64]| {
            (0..self.cells)
                .map(|i| self.area[i] * values[i])
                .sum::<f64>()
        };
        let limit = self.limit;
        [sum(x) / limit, sum(y) / limit]
    }

    /// Makes the tractions of a step the present state.
    fn advance(&mut self, of: &StepEquations, motion: Motion, tractions: Vec<f64>) {
        let mut displacement = vec![0.0; tractions.len()];
        let mut scratch = SlipScratch::default();
        of.equations
            .displacement(&tractions, &mut displacement, &mut scratch);
        let state = &mut self.state;
        state.earlier = match of.kind {
            // Before steady rolling, displacements do not change.
            StepKind::Steady => displacement.clone(),
            _ => std::mem::take(&mut state.displacement),
        };
        state.displacement = displacement;
        let from = std::mem::replace(&mut state.tractions, tractions);
        let moved = std::mem::replace(&mut state.motion, motion);
        self.dissipate(of, (&from, moved));
        self.follow_slips(of);
    }

    /// The weakening of the bounds within a step, which only steady rolling has.
    fn fall(&self, kind: StepKind) -> Option<Softening> {
        let friction = self.slip_friction.as_ref()?;
        (kind == StepKind::Steady).then_some(friction.fall)
    }

    /// Updates bounds that weaken with slip by the slips of a step.
    fn follow_slips(&mut self, of: &StepEquations) {
        let Some(friction) = &mut self.slip_friction else {
            return;
        };
        let slip = self.workspace.slip();
        let half = slip.len() / 2;
        let slides = |i: usize| of.newton.slips(&self.bound, &self.state.tractions, slip, i);
        let size = |i: usize| match slides(i) {
            true => slip[i].hypot(slip[half + i]),
            false => 0.0,
        };
        let sizes: Vec<f64> = (0..self.cells).map(size).collect();
        friction.follow(of.kind, &sizes);
        if of.kind == StepKind::Steady {
            self.bound.copy_from_slice(&friction.next);
        }
    }
}

/// A motion with every component that occurs in a motion or shift of a history.
fn every_motion(task: &RollingTask, history: &HistoryTask) -> Motion {
    let mut every = [0.0; 3];
    for motion in task.motions.iter().chain(&history.shifts) {
        let parts = every.iter_mut().zip(motion.components());
        parts.for_each(|(every, part)| *every += part.abs());
    }
    for forces in task.forces {
        let parts = every.iter_mut().zip(forces);
        parts.for_each(|(every, force)| *every += f64::from(u8::from(force.is_some())));
    }
    Motion::of(every)
}

/// Ratio of the distance over which bounds follow slips to the distance above which disturbances decay. The weight 1.5 of the displacements at the end of a step
/// counts against it. With 2 a mesh of 16 × 32 is off by up to 0.029 of the friction limit, with 4 by 0.016, in the three histories of
/// `cargo test --test physics -- history_falling::finer --nocapture`.
const DAMPING: f64 = 4.0;

/// Bounds of the cells with unknowns that weaken with slip. In rolling they follow the slip of earlier steps with a lag.
pub(super) struct SlipFriction {
    fall: Softening,
    /// Bounds without slip.
    rest: Vec<f64>,
    /// Bounds of the next step of rolling.
    next: Vec<f64>,
    /// The distance in mm by which bounds lag behind slips.
    lag: f64,
}

impl SlipFriction {
    /// The state before any slip, with the bounds without slip.
    pub(super) fn new(fall: Softening, rest: &[f64]) -> SlipFriction {
        SlipFriction {
            fall,
            rest: rest.to_vec(),
            next: rest.to_vec(),
            lag: 0.0,
        }
    }

    /// Sets the lag. `gain` is the decrease of the slip of each cell in a step if all tractions grow by one, and `per_mm` its part per mm of displacement.
    pub(super) fn damp(&mut self, gain: &[f64], per_mm: f64) {
        let steepest = self.fall.steepest();
        let of_cell = |(gain, rest): (&f64, &f64)| steepest * rest * gain.abs();
        let most = gain.iter().zip(&self.rest).map(of_cell);
        self.lag = DAMPING * most.fold(0.0, f64::max) / per_mm;
    }

    /// Sets the bounds of a step; those without slip in a shift, which is slow.
    pub(super) fn set_bounds(&self, kind: StepKind, bounds: &mut [f64]) {
        bounds.copy_from_slice(match kind {
            StepKind::Roll { .. } => &self.next,
            StepKind::Steady | StepKind::Press | StepKind::Shift => &self.rest,
        });
    }

    /// Updates the bounds by the sizes of the slips after a step, 0 where cells stick.
    pub(super) fn follow(&mut self, kind: StepKind, slips: &[f64]) {
        let share = match kind {
            StepKind::Shift | StepKind::Press => return self.next.clone_from(&self.rest),
            StepKind::Steady => 1.0,
            // With this share the bounds lag behind the slips by `lag` on average, for steps of any length.
            StepKind::Roll { distance, .. } => (distance / self.lag).min(1.0),
        };
        let cells = self.next.iter_mut().zip(&self.rest).zip(slips);
        for ((next, rest), slip) in cells {
            *next += share * (rest * self.fall.at(*slip).0 - *next);
        }
    }
}

/// Friction coefficients along the track under the cells.
pub(super) struct TrackFriction {
    law: CoefficientTable,
    /// Trailing and leading edge of each cell with unknowns in mm, before any rolling.
    cells: Vec<[f64; 2]>,
    /// Bounds with the largest coefficient.
    largest: Vec<f64>,
}

impl TrackFriction {
    /// The friction of a track under the first `cells` cells of a mesh in mm. `largest` are the bounds with the largest coefficient everywhere.
    pub(super) fn new(
        law: &CoefficientTable,
        mesh: &Mesh,
        cells: usize,
        largest: &[f64],
    ) -> TrackFriction {
        let edges = mesh.left.iter().zip(&mesh.right).take(cells);
        TrackFriction {
            law: law.clone(),
            cells: edges.map(|(left, right)| [*left, *right]).collect(),
            largest: largest.to_vec(),
        }
    }

    /// Sets the bounds after rolling `travelled` mm towards larger x.
    pub(super) fn set_bounds(&self, travelled: f64, bounds: &mut [f64]) {
        let most = self.law.largest();
        let cells = self.cells.iter().zip(&self.largest);
        for (bound, ([left, right], largest)) in bounds.iter_mut().zip(cells) {
            let mean = self.law.mean_between(left + travelled, right + travelled);
            *bound = largest * (mean / most);
        }
    }
}
