//! A run as clients read it.

use crate::jobs::model::batch::{Batch, RunRecord};
use crate::jobs::model::job::State;
use crate::jobs::run::head::RunHead;

/// A run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Its chunks as jobs of a batch.
    pub chunks: Batch,
    /// Its case, columns and sizes.
    pub head: RunHead,
    /// Rows of ended chunks that have no answer, those of chunks without a result included.
    pub without_answer: u64,
    /// The part that is done, 0 to 1.
    pub progress: f64,
}

impl Run {
    /// A run from what is kept of it.
    #[must_use]
    pub fn new(chunks: Batch, head: RunHead, record: &RunRecord) -> Run {
        let each = u64::from(head.chunk_rows);
        let lost = chunks.in_state(State::Failed) + chunks.in_state(State::Cancelled);
        let (ended, all) = chunks.ended();
        #[expect(clippy::cast_precision_loss, reason = "far fewer chunks than 2^53")]
        let progress = (ended as f64 + record.running) / all.max(1) as f64;
        Run {
            without_answer: (record.without_answer + lost * each).min(head.rows),
            progress: if ended == all { 1.0 } else { progress.min(1.0) },
            chunks,
            head,
        }
    }

    /// Where it stands.
    #[must_use]
    pub fn state(&self) -> State {
        let number = |state| self.chunks.in_state(state);
        let (ended, all) = self.chunks.ended();
        if ended < all {
            let begun = ended + number(State::Running) > 0;
            return if begun { State::Running } else { State::Queued };
        }
        if number(State::Cancelled) > 0 {
            State::Cancelled
        } else if number(State::Succeeded) == 0 && number(State::Failed) > 0 {
            State::Failed
        } else {
            State::Succeeded
        }
    }

    /// Rows of chunks that have ended.
    #[must_use]
    pub fn rows_done(&self) -> u64 {
        let (ended, _) = self.chunks.ended();
        (ended * u64::from(self.head.chunk_rows)).min(self.head.rows)
    }
}
