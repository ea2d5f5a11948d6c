//! Whether starts of the motions of a stretch are worth a trial.

/// Largest number of motions that are solved in the usual way after a failed start, before another start is tried. Of 80 rays and curves of
/// `benches/calibrate` at 0.005 the slowest takes 6 % more products than without borrowing, 14 % without a pause.
const PAUSE_MAX: usize = 16;

/// What came of the last trials.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Trials {
    /// Number of motions in a row whose start failed.
    vain: u32,
    /// Motions to solve in the usual way before a start is tried again.
    pause: usize,
}

impl Trials {
    /// May a start be tried, and not only after a pause?
    pub(super) fn may_try(&mut self) -> bool {
        let paused = self.pause > 0;
        self.pause = self.pause.saturating_sub(1);
        !paused
    }

    /// Takes note of a start that was tried; after every one that fails the pause is twice as long.
    pub(super) fn tried(&mut self, successful: bool) {
        if successful {
            self.vain = 0;
        } else {
            self.pause = (1 << self.vain.min(8)).min(PAUSE_MAX);
            self.vain += 1;
        }
    }
}
