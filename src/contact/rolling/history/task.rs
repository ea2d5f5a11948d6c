//! What a history asks beside its motions and forces.

use crate::contact::rolling::motion::Motion;

/// The state at the distance 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HistoryStart {
    /// No tangential tractions: the bodies were just pressed together.
    #[default]
    Rest,
    /// Steady rolling with the first motion.
    Steady,
    /// Pressed together under friction, without rolling.
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
    #[must_use]
    pub fn only_presses(&self) -> bool {
        self.start == HistoryStart::Pressed
            && self.distances == [0.0]
            && self.shifts == [Motion::default()]
    }

    /// Distance rolled from the point before to point `index`; 0 of a shift.
    #[must_use]
    pub fn rolled(&self, index: usize) -> f64 {
        let before = index.checked_sub(1).map_or(0.0, |k| self.distances[k]);
        self.distances[index] - before
    }
}
