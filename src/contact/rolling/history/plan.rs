//! The steps of a history, the data of a history, and the record of a point.
//!
//! Steps are equal from point to point and shorter where a sequence begins. Each is a backward difference of second order in the displacements (BDF2) with the
//! weights for unequal steps (Hairer, Nørsett & Wanner 1993, §III.5), or of first order if no step precedes it.

use railhead_macros::{Words, keyword};

use crate::half_space::strip_operator::kind::Parity;
use crate::half_space::strip_operator::operator::StripOperator;
use crate::rolling::answer::{Resultants, Work};
use crate::rolling::displacement_memory::{DisplacementMemory, LeadingEdges};
use crate::rolling::methods::boundary_element::newton::Newton;
use crate::rolling::slip_equations::SlipEquations;
use crate::rolling::slip_rules::Rule;
use crate::rolling::strip_mesh::StripMesh;
use crate::rolling::task::Motion;

/// Largest ratio of a step to the one before; BDF2 is stable up to 1 + √2.
const GROWTH_MAX: f64 = 2.0;

/// The motion of the bodies in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepKind {
    /// Steady rolling.
    Steady,
    /// Pressing together.
    Press,
    /// A shift without rolling.
    Shift,
    /// Rolling over a distance.
    Roll {
        /// Distance in mm.
        distance: f64,
        /// Length of the step over that of the previous one; 0 if there is none.
        growth: f64,
    },
}

/// One step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryStep {
    /// The motion of the bodies.
    pub kind: StepKind,
    /// The point to which it leads.
    pub point: usize,
    /// Part of the way from the previous point that is completed after the step.
    pub share: f64,
    /// Whether it ends at the point.
    pub last: bool,
}

impl HistoryStep {
    /// Distance in mm rolled since the start of the history at the end of the step.
    pub(super) fn travelled(&self, history: &HistoryTask) -> f64 {
        let before = (self.point.checked_sub(1)).map_or(0.0, |k| history.distances[k]);
        match self.kind {
            StepKind::Roll { .. } => before + self.share * history.rolled(self.point),
            StepKind::Steady | StepKind::Press | StepKind::Shift => before,
        }
    }
}

/// Weights of a backward difference over the length of the step: of the displacement at its end, at its beginning, and one step earlier.
pub fn weights(growth: f64) -> [f64; 3] {
    [
        (1.0 + 2.0 * growth) / (1.0 + growth),
        1.0 + growth,
        growth * growth / (1.0 + growth),
    ]
}

/// The length of the steps on a mesh.
#[derive(Debug, Clone, Copy)]
pub struct Pace {
    /// Longest step on the first mesh in mm.
    pub first: f64,
    /// Number of steps over that on the first mesh. It counts from point to point, so that steps shrink from mesh to mesh however close the points are, and the
    /// change from mesh to mesh contains the error of the steps.
    pub finer: f64,
}

impl Pace {
    /// Number of steps over a distance in mm, at least `least` on the first mesh.
    fn count(self, distance: f64, least: f64) -> f64 {
        let first = (distance / self.first).ceil().max(least);
        (self.finer * first - 1e-9).ceil()
    }

    /// Steps of the same length that take no further steps between close points.
    #[must_use]
    pub fn by_length(self) -> Pace {
        Pace {
            first: self.first / self.finer,
            finer: 1.0,
        }
    }
}

/// Lengths of the steps that roll to a point.
fn rolled(distance: f64, pace: Pace, before: Option<f64>) -> Vec<f64> {
    // The first step of a sequence is divided. With a second step, the last one shrinks from mesh to mesh too.
    let count = pace.count(distance, if before.is_none() { 2.0 } else { 1.0 });
    let even = distance / count;
    let count = count as usize;
    match before {
        // The first step of a sequence is divided, because it is of first order.
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

/// Number of steps of a history.
pub fn count(history: &HistoryTask, pace: Pace) -> f64 {
    let steps = (0..history.distances.len()).map(|k| match history.rolled(k) {
        distance if distance > 0.0 => pace.count(distance, 1.0),
        _ => 1.0,
    });
    3.0 + steps.sum::<f64>()
}

/// Whether the bodies shift at a first point without rolling to it.
fn begins_with_shift(history: &HistoryTask, forced: bool) -> bool {
    match history.start {
        HistoryStart::Steady => false,
        HistoryStart::Rest => true,
        HistoryStart::Pressed => forced || !history.only_presses(),
    }
}

/// The steps of a history. With `forced`, a force that is prescribed at the start is applied by a shift before the bodies roll.
pub fn steps(history: &HistoryTask, pace: Pace, forced: bool) -> Vec<HistoryStep> {
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
            let lengths = rolled(distance, pace, before);
            let mut done = 0.0;
            for length in lengths {
                done += length;
                let growth = before.map_or(0.0, |before| length / before);
                // Rounding would prevent steps from sharing their equations.
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

/// The equations of steps of one kind.
pub(super) struct StepEquations<'e> {
    pub(super) kind: StepKind,
    pub(super) equations: &'e SlipEquations<'e>,
    pub(super) newton: &'e Newton<'e>,
}

/// The memory of displacements in steps of this kind, for a unit of length in mm.
pub(super) fn memory(kind: StepKind, edges: &LeadingEdges, unit: f64) -> DisplacementMemory<'_> {
    let (factor, rolls) = match kind {
        StepKind::Steady => (0.0, true),
        StepKind::Shift => (1.0, false),
        StepKind::Press => (weights(1.0)[0], false),
        StepKind::Roll { distance, growth } => (weights(growth)[0] * unit / distance, true),
    };
    DisplacementMemory {
        edges,
        factor,
        rolls,
    }
}

/// The equations of steady rolling by a rule.
pub(super) fn steady<'e>(
    rule: Rule,
    (level, operator, parity): (&StripMesh, &'e StripOperator, Option<Parity>),
) -> SlipEquations<'e> {
    SlipEquations::new(rule, &level.normalised, operator, parity)
        .with_layer(&level.normalised, level.layer)
}

/// The state in which a history begins.
#[keyword(Default, Words)]
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

/// A sequence of motions over the distance rolled; creepages, spin and forces change linearly between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistoryTask {
    /// The initial state.
    pub start: HistoryStart,
    /// Distance rolled since the start in mm, motion by motion, not decreasing. Where it does not increase, or is 0 at first, the bodies do not roll but are
    /// shifted.
    pub distances: Vec<f64>,
    /// Displacements of the upper body relative to the lower one at these points, in mm and rad. A component with a prescribed force is found.
    pub shifts: Vec<Motion>,
}

impl HistoryTask {
    /// Whether pressing is all that is requested.
    pub fn only_presses(&self) -> bool {
        self.start == HistoryStart::Pressed
            && self.distances == [0.0]
            && self.shifts == [Motion::default()]
    }

    /// Distance rolled from the previous point to point `index`; 0 for a shift.
    pub fn rolled(&self, index: usize) -> f64 {
        let before = index.checked_sub(1).map_or(0.0, |k| self.distances[k]);
        self.distances[index] - before
    }
}

/// A solved point of a history on one mesh.
#[derive(Debug, Clone, Default)]
pub struct PointRecord {
    /// Creepages and spin, in the units of the case; those found where forces are prescribed.
    pub motion: Motion,
    /// The shift without rolling that leads to the point, in mm and rad.
    pub shift: Motion,
    /// Resultants of every patch about the origin of the case.
    pub resultants: Vec<Resultants>,
    /// Power of friction over the rolling speed in N, for every patch; 0 in a shift.
    pub power: Vec<f64>,
    /// Energy dissipated by friction since the start in N·mm, for every patch.
    pub dissipated: Vec<f64>,
    /// Sum of the lengths of all tractions over the friction limit.
    pub carried: f64,
    /// Elastic energy of all tangential displacements in N·mm.
    pub elastic: f64,
    /// Tractions, dimensionless.
    pub traction: [Vec<f64>; 2],
    /// Slips, dimensionless.
    pub slip: [Vec<f64>; 2],
    /// Slip flags of the cells.
    pub slips: Vec<bool>,
    /// Whether a prescribed force could not be reached.
    pub saturated: bool,
    /// Work since the previous point.
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
        let pace = Pace {
            first: 1.05,
            finer: 1.5,
        };
        let steps = steps(&history, pace, false);
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
