//! In which steps a history is solved: equal ones from point to point, short ones where it begins anew.
//!
//! Each step is a backward difference of second order in the displacements (BDF2) with the weights for unequal steps (Hairer, Nørsett &
//! Wanner 1993, §III.5), or of first order where no step was before it.
//!
//! The slip equations of the steps of one kind.
//!
//! What a history asks beside its motions and forces.
//!
//! What is kept of a point of a history.

use railhead_macros::Words;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::half_space::strip_operator::kind::Parity;
use crate::half_space::strip_operator::operator::StripOperator;
use crate::rolling::answer::{Resultants, Work};
use crate::rolling::displacement_memory::{DisplacementMemory, LeadingEdges};
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::slip_equations::SlipEquations;
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// A step may be longer than the one before by this factor at most; BDF2 is stable up to 1 + √2.
const GROWTH_MAX: f64 = 2.0;

/// Weights in the slip of a step of pressing: of the displacements at its end, and with the sign turned of those one and two steps smaller.
pub(super) const PRESS_WEIGHTS: [f64; 3] = [1.5, 2.0, -0.5];

/// What the bodies do in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepKind {
    /// They roll in the state that belongs to the motion.
    Steady,
    /// They are pressed together.
    Press,
    /// They are shifted without rolling.
    Shift,
    /// They roll a distance in mm; the step before was longer by 1/growth, which is 0 if there was none.
    Roll {
        /// The distance.
        distance: f64,
        /// Length over that of the step before.
        growth: f64,
    },
}

/// One step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryStep {
    /// What it is.
    pub kind: StepKind,
    /// The point that it leads to.
    pub point: usize,
    /// Which part of the way from the point before is done after it.
    pub share: f64,
    /// Does it end at the point?
    pub last: bool,
}

impl HistoryStep {
    /// Distance in mm rolled since the start of a history when this step of it ends.
    pub(super) fn travelled(&self, history: &HistoryTask) -> f64 {
        let before = (self.point.checked_sub(1)).map_or(0.0, |k| history.distances[k]);
        match self.kind {
            StepKind::Roll { .. } => before + self.share * history.rolled(self.point),
            StepKind::Steady | StepKind::Press | StepKind::Shift => before,
        }
    }
}

/// Weights of a backward difference, over the length of the step: of the displacement at its end, at its beginning, and a step earlier.
pub fn weights(growth: f64) -> [f64; 3] {
    [
        (1.0 + 2.0 * growth) / (1.0 + growth),
        1.0 + growth,
        growth * growth / (1.0 + growth),
    ]
}

/// Steps of a point that is rolled to.
fn rolled(distance: f64, longest: f64, before: Option<f64>) -> Vec<f64> {
    let count = (distance / longest).ceil().max(1.0);
    let even = distance / count;
    let count = count as usize;
    match before {
        // The first of a sequence is divided, since it is of first order.
        None => {
            let mut steps = vec![0.25 * even, 0.25 * even, 0.5 * even];
            steps.extend(std::iter::repeat_n(even, count - 1));
            steps
        }
        Some(before) if even > GROWTH_MAX * before => {
            let mut steps = Vec::new();
            let (mut left, mut last) = (distance, before);
            while left > 0.0 {
                last = (GROWTH_MAX * last).min(even);
                let more = (left / last - 1e-9).ceil();
                if last >= even || more <= 1.0 {
                    steps.extend(std::iter::repeat_n(left / more, more as usize));
                    break;
                }
                steps.push(last);
                left -= last;
            }
            steps
        }
        Some(_) => vec![even; count],
    }
}

/// Steps in a history of these distances, none longer than `longest` mm.
pub fn count(history: &HistoryTask, longest: f64) -> f64 {
    let points = 0..history.distances.len();
    let steps = points.map(|k| (history.rolled(k) / longest).ceil().max(1.0));
    3.0 + steps.sum::<f64>()
}

/// Do the bodies shift at a first point to which they do not roll?
fn begins_with_shift(history: &HistoryTask, forced: bool) -> bool {
    match history.start {
        HistoryStart::Steady => false,
        HistoryStart::Rest => true,
        HistoryStart::Pressed => forced || !history.only_presses(),
    }
}

/// The steps of a history, none longer than `longest` mm. With `forced`, where a force is prescribed, one that is there at once is
/// brought up by a shift before the bodies roll.
pub fn steps(history: &HistoryTask, longest: f64, forced: bool) -> Vec<HistoryStep> {
    let mut steps = Vec::new();
    let whole = |kind, point| HistoryStep {
        kind,
        point,
        share: 1.0,
        last: false,
    };
    match history.start {
        HistoryStart::Steady => steps.push(whole(StepKind::Steady, 0)),
        HistoryStart::Pressed => steps.push(whole(StepKind::Press, 0)),
        HistoryStart::Rest => {}
    }
    if forced && history.rolled(0) > 0.0 && history.start != HistoryStart::Steady {
        steps.push(whole(StepKind::Shift, 0));
    }
    let mut before = None;
    for point in 0..history.distances.len() {
        let distance = history.rolled(point);
        if distance > 0.0 {
            let lengths = rolled(distance, longest, before);
            let mut done = 0.0;
            for length in lengths {
                done += length;
                let growth = before.map_or(0.0, |before| length / before);
                // Rounding would make every step one of its own kind.
                let growth = if (growth - 1.0).abs() < 1e-9 {
                    1.0
                } else {
                    growth
                };
                let kind = StepKind::Roll {
                    distance: length,
                    growth,
                };
                steps.push(HistoryStep {
                    share: (done / distance).min(1.0),
                    ..whole(kind, point)
                });
                before = Some(length);
            }
        } else if point > 0 || begins_with_shift(history, forced) {
            steps.push(whole(StepKind::Shift, point));
            before = None;
        }
        if let Some(step) = steps.last_mut() {
            step.last = true;
            step.share = 1.0;
        }
    }
    steps
}

/// Equations of steps of one kind.
pub(super) struct StepEquations<'e> {
    pub(super) kind: StepKind,
    pub(super) equations: &'e SlipEquations<'e>,
    pub(super) newton: &'e Newton<'e>,
}

/// How the displacements enter the slip of a step of this kind, for a unit of length in mm.
pub(super) fn memory(kind: StepKind, edges: &LeadingEdges, unit: f64) -> DisplacementMemory<'_> {
    let (factor, rolls) = match kind {
        StepKind::Steady => (0.0, true),
        StepKind::Shift => (1.0, false),
        StepKind::Press => (PRESS_WEIGHTS[0], false),
        StepKind::Roll { distance, growth } => (weights(growth)[0] * unit / distance, true),
    };
    DisplacementMemory {
        edges,
        factor,
        rolls,
    }
}

/// Equations of steady rolling by a rule.
pub(super) fn steady<'e>(
    rule: Rule,
    (level, operator, parity): (&StripMesh, &'e StripOperator, Option<Parity>),
) -> SlipEquations<'e> {
    SlipEquations::new(rule, &level.normalised, operator, parity)
        .with_layer(&level.normalised, level.layer)
}

/// The state in which a history begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, Words)]
#[serde(rename_all = "snake_case")]
#[schema(as = HistoryStartName)]
pub enum HistoryStart {
    /// Pressed together without tangential tractions.
    #[default]
    Rest,
    /// In steady rolling with the motion or forces of the first point.
    Steady,
    /// Pressed together under friction without rolling: bodies that differ have tangential tractions then. For `radii` and `ellipse`.
    Pressed,
}

/// A sequence of motions in the distance rolled; creepages, spin and forces change linearly between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistoryTask {
    /// Where it begins.
    pub start: HistoryStart,
    /// Distance rolled since the start in mm, motion by motion, never less than the one before. Where it is the same as before, or 0 at
    /// first, the bodies do not roll: they are shifted.
    pub distances: Vec<f64>,
    /// Displacements of the upper body against the lower one at these points, in mm and rad; a component is found where its force is
    /// prescribed.
    pub shifts: Vec<Motion>,
}

impl HistoryTask {
    /// Is pressing all that is asked for?
    pub fn only_presses(&self) -> bool {
        self.start == HistoryStart::Pressed
            && self.distances == [0.0]
            && self.shifts == [Motion::default()]
    }

    /// Distance rolled from the point before to point `index`; 0 of a shift.
    pub fn rolled(&self, index: usize) -> f64 {
        let before = index.checked_sub(1).map_or(0.0, |k| self.distances[k]);
        self.distances[index] - before
    }
}

/// A solved point of a history on one level.
#[derive(Debug, Clone, Default)]
pub struct PointRecord {
    /// Creepages and spin, in the units of the case; found where forces are prescribed.
    pub motion: Motion,
    /// The shift that led here without rolling, in mm and rad.
    pub shift: Motion,
    /// Resultants of every patch about the origin of the case.
    pub resultants: Vec<Resultants>,
    /// Power of friction of every patch over the rolling speed, in N; 0 of a shift.
    pub power: Vec<f64>,
    /// What friction has dissipated since the start, of every patch, in N·mm.
    pub dissipated: Vec<f64>,
    /// Sum of the lengths of all tractions over the friction limit.
    pub carried: f64,
    /// Elastic energy of all tangential displacements in N·mm.
    pub elastic: f64,
    /// Tractions, slips, and which cells slip, dimensionless on the level.
    pub traction: [Vec<f64>; 2],
    /// See [`PointRecord::traction`].
    pub slip: [Vec<f64>; 2],
    /// See [`PointRecord::traction`].
    pub slips: Vec<bool>,
    /// Whether a prescribed force could not be reached.
    pub saturated: bool,
    /// Work since the point before.
    pub work: Work,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rolling::task::Motion;

    fn history(distances: &[f64]) -> HistoryTask {
        HistoryTask {
            start: HistoryStart::Rest,
            distances: distances.to_vec(),
            shifts: vec![Motion::default(); distances.len()],
        }
    }

    #[test]
    fn steps_end_at_every_point_and_grow_by_two_at_most() {
        let history = history(&[0.0, 0.3, 5.0, 5.0, 5.01, 9.0, 100.0]);
        let steps = steps(&history, 0.7, false);
        let (mut done, mut points) = (0.0, Vec::new());
        for step in &steps {
            if let StepKind::Roll { distance, growth } = step.kind {
                assert!(growth <= GROWTH_MAX + 1e-9, "{step:?}");
                assert!(distance <= 0.7 + 1e-12);
                done += distance;
            }
            if step.last {
                assert!((done - history.distances[step.point]).abs() < 1e-9);
                points.push(step.point);
            }
        }
        assert_eq!(points, [0, 1, 2, 3, 4, 5, 6]);
    }

    #[test]
    fn backward_differences_are_exact_for_parabolas() {
        for (step, before) in [(0.3, 0.2), (1.0, 1.0), (0.1, 0.5)] {
            let [now, last, earlier] = weights(step / before);
            let u = |q: f64| 2.0 * q * q - q;
            let slope = (now * u(step) - last * u(0.0) + earlier * u(-before)) / step;
            assert!((slope - (4.0 * step - 1.0)).abs() < 1e-12, "{slope}");
        }
    }
}
