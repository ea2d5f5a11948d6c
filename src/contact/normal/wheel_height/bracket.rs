//! Brackets the height of a wheel that carries a load, and names how the search for it ends.
//!
//! Steps are those of the secant in `N^(2/3)`, which for Hertz's contacts is proportional to the lowering, kept within what
//! is known to carry too little and too much.

use crate::contact::remark::list::Remark;

/// A bracket narrower than this fraction of the lowering is closed: it holds a jump of the force, or only differences between grids.
/// 5e-5 and 1e-3 change nothing on the wheels of `cargo bench --bench calibrate profiles`, whose searches end before that.
const BRACKET_MIN: f64 = 2e-4;
/// Steps in a row that may leave the bracket more than half as wide. Keeps the numbers safe; not tuned.
const SLOW_MAX: u32 = 3;
/// The search ends when it comes this close, relatively, to a lowering that cannot be solved. 0.005 and 0.05
/// change nothing on the same wheels.
const CLOSE: f64 = 0.02;
/// A closed bracket holds a jump of the force if the force is missed by more than this fraction; differences between grids are smaller. Chosen by
/// judgement; how much it matters was not measured.
const JUMP_MIN: f64 = 5e-3;

/// How the search for a height ends, with the part by which the force is missed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum HeightExit {
    /// The force is met within the tolerance.
    Met { missed: f64 },
    /// The bracket closed where the force jumps.
    Jump { factor: f64 },
    /// The bracket closed, and the force is missed by what differs between grids.
    Closed { missed: f64, tolerance: f64 },
}

impl HeightExit {
    /// The exit of a closed bracket at which the force is to be multiplied by `factor`.
    pub(crate) fn closed(factor: f64, tolerance: f64) -> HeightExit {
        let missed = (1.0 / factor - 1.0).abs();
        if missed > JUMP_MIN {
            HeightExit::Jump { factor }
        } else {
            HeightExit::Closed { missed, tolerance }
        }
    }

    /// Part by which the force is missed before it is corrected.
    pub(crate) fn missed(self) -> f64 {
        match self {
            HeightExit::Met { missed } | HeightExit::Closed { missed, .. } => missed,
            HeightExit::Jump { factor } => (1.0 / factor - 1.0).abs(),
        }
    }

    pub(crate) fn converged(self) -> bool {
        matches!(self, HeightExit::Met { .. })
    }

    /// What the client should know of an exit that did not converge.
    pub(crate) fn remark(self) -> Option<Remark> {
        match self {
            HeightExit::Met { .. } => None,
            HeightExit::Jump { factor } => Some(Remark::ForceJumps { factor }),
            HeightExit::Closed { missed, tolerance } => Some(Remark::IterationInexact {
                iteration: "height of the wheel",
                reason: "the bracket closed on the differences between grids",
                residual: missed,
                tolerance,
            }),
        }
    }
}

/// What is known of the height sought.
#[derive(Debug, Default)]
pub(crate) struct Bracket {
    /// Lowering with too little force.
    low: f64,
    /// Lowering with too much force, or one that could not be solved.
    high: Option<f64>,
    /// Why `high` could not be solved.
    refused: Option<String>,
    /// The height before, with the power 2/3 of its force.
    before: Option<[f64; 2]>,
    /// The width at the step before, and steps in a row that hardly changed it.
    width_before: f64,
    slow: u32,
    /// Derivative of the force by the lowering between the last two heights, where it can be trusted.
    pub(crate) slope: Option<f64>,
    /// The same from elsewhere, for the next step.
    known: Option<f64>,
}

impl Bracket {
    /// Is it so narrow that no other height is worth a try?
    pub(crate) fn is_closed(&self, lowering: f64) -> bool {
        self.width() < BRACKET_MIN * lowering
    }

    fn width(&self) -> f64 {
        self.high.map_or(f64::INFINITY, |high| high - self.low)
    }

    /// The next lowering to try, after one that carries a force.
    pub(crate) fn next(&mut self, lowering: f64, carried: f64, target: f64, slope: f64) -> f64 {
        const POWER: f64 = 2.0 / 3.0;
        let [here, wanted] = [carried, target].map(|force| force.powf(POWER));
        if carried < target {
            self.low = lowering;
        } else {
            self.high = Some(lowering);
            self.refused = None;
        }
        let estimate = POWER * here / carried * self.known.take().unwrap_or(slope);
        let secant = self
            .before
            .map(|[at, value]| (here - value) / (lowering - at))
            // Between heights that are nearly the same the difference is that of their grids.
            .filter(|secant| (0.7..1.5).contains(&(secant / estimate)));
        self.before = Some([lowering, here]);
        self.slope = secant.map(|secant| secant / POWER * carried / here);
        let next = lowering + (wanted - here) / secant.unwrap_or(estimate);
        let next = next.clamp(0.25 * lowering, 4.0 * lowering);
        self.within(next)
    }

    /// The next lowering to try, after one that could not be solved.
    pub(crate) fn refuse(&mut self, lowering: f64, reason: String) -> Result<f64, String> {
        self.high = Some(lowering);
        if lowering - self.low < CLOSE * lowering || lowering < 1e-6 {
            return Err(reason);
        }
        self.refused = Some(reason);
        Ok(0.5 * (self.low + lowering))
    }

    /// The same without its sides, except for what could not be solved, and with a derivative that is known.
    pub(crate) fn opened(self, slope: f64) -> Bracket {
        Bracket {
            high: self.high.filter(|_| self.refused.is_some()),
            refused: self.refused,
            slope: Some(slope),
            known: Some(slope),
            ..Bracket::default()
        }
    }

    /// Why nothing deeper could be solved, once the bracket has closed on it from below.
    pub(crate) fn closed_on_refusal(&self, lowering: f64) -> Option<String> {
        let closed = self.width() < CLOSE * lowering;
        self.refused.clone().filter(|_| closed)
    }

    /// The next lowering, in the middle of the bracket if it lies outside or the bracket does not shrink.
    fn within(&mut self, next: f64) -> f64 {
        let Some(high) = self.high else {
            return next;
        };
        let width = high - self.low;
        self.slow = if width > 0.5 * self.width_before {
            self.slow + 1
        } else {
            0
        };
        self.width_before = width;
        if next < high && next > self.low && self.slow < SLOW_MAX {
            return next;
        }
        self.slow = 0;
        0.5 * (self.low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force of lowering^1.5 with a jump at 0.5.
    fn force(lowering: f64, jump: f64) -> f64 {
        lowering.powf(1.5) + if lowering > 0.5 { jump } else { 0.0 }
    }

    fn sought(target: f64, jump: f64, start: f64) -> (f64, u32) {
        let mut bracket = Bracket::default();
        let mut lowering = start;
        for count in 1..100 {
            let carried = force(lowering, jump);
            let next = bracket.next(lowering, carried, target, 1.3 * lowering.sqrt());
            if (carried / target - 1.0).abs() < 5e-3 || bracket.is_closed(lowering) {
                return (lowering, count);
            }
            lowering = next;
        }
        panic!("not found")
    }

    #[test]
    fn a_height_that_misses_its_force_is_remarked_on() {
        let code = |exit: HeightExit| exit.remark().map(|remark| remark.code());
        assert_eq!(code(HeightExit::Met { missed: 1e-5 }), None);
        let jump = HeightExit::closed(1.1, 1e-4);
        assert_eq!(code(jump), Some("force-jumps"));
        assert!((jump.missed() - 0.1 / 1.1).abs() < 1e-12);
        let closed = HeightExit::closed(1.002, 1e-4);
        assert_eq!(code(closed), Some("iteration-inexact"));
        assert!(!closed.converged());
    }

    #[test]
    fn hertzian_forces_are_met_in_a_few_steps_from_far_away() {
        for start in [0.01, 0.2, 0.9, 7.0] {
            let (lowering, count) = sought(0.2, 0.0, start);
            assert!((force(lowering, 0.0) / 0.2 - 1.0).abs() < 5e-3);
            assert!(count <= 8, "{count} steps from {start}");
        }
        assert!(sought(0.2, 0.0, 0.33).1 <= 3);
    }

    #[test]
    fn a_jump_of_the_force_is_closed_in_on() {
        let (lowering, count) = sought(0.4, 0.2, 0.3);
        assert!((lowering - 0.5).abs() < 2e-4, "{lowering}");
        assert!(count < 40, "{count}");
    }

    #[test]
    fn what_cannot_be_solved_bounds_the_search_and_is_the_reason_in_the_end() {
        let mut bracket = Bracket::default();
        let mut lowering = 1.0;
        let reason = loop {
            match bracket.refuse(lowering, "cut off".to_owned()) {
                Ok(next) => lowering = next,
                Err(reason) => break reason,
            }
        };
        assert_eq!(reason, "cut off");
    }
}
