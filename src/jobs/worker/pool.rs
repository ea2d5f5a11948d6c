//! Workers: each takes one turn after the other until the service drains.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::sleep;
use uuid::Uuid;

use crate::jobs::attempts::attempt::{Phase, TimeSpentOn};
use crate::jobs::attempts::solver_thread::SolverThread;
use crate::jobs::error::JobsError;
use crate::jobs::model::job::State;
use crate::jobs::shared::Shared;

/// How often an idle worker asks for jobs although nothing has woken it.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// One worker. It has at most one solver at work.
#[derive(Debug)]
pub struct Worker {
    pub(crate) shared: Arc<Shared>,
    pub(crate) name: String,
    /// A thread without work.
    pub(crate) thread: Option<SolverThread>,
}

/// What became of one [`Worker::step`].
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct StepReport {
    /// There was something to be done.
    pub busy: bool,
    /// Jobs that ended, with their states.
    pub ended: Vec<(Uuid, State)>,
    /// Jobs that went back to the queue, their attempts uncounted.
    pub handed_back: Vec<Uuid>,
    /// Jobs that had been given away; their outcomes were discarded.
    pub lost: Vec<Uuid>,
    /// Jobs whose solve waits for its next turn.
    pub parked: Vec<Uuid>,
}

/// How a turn ended.
pub(crate) enum Turn {
    /// The solver is done, or was left behind.
    Over,
    /// The solver waits at its pause point.
    Held,
}

impl Worker {
    pub(crate) fn new(shared: Arc<Shared>, name: &str) -> Result<Worker, JobsError> {
        Ok(Worker {
            thread: Some(SolverThread::start(name)?),
            shared,
            name: name.to_owned(),
        })
    }

    /// Steps until the service drains and nothing waits at a pause point.
    pub(crate) async fn run(mut self) {
        let shared = self.shared.clone();
        let recovered = shared.recovered.wait();
        let _ = shared.draining.run_until_cancelled(recovered).await;
        while !shared.draining.is_cancelled() || shared.turns.parked().0 > 0 {
            match self.step().await {
                Ok(step) if step.busy => continue,
                Ok(_) => {}
                Err(error) => tracing::error!(worker = self.name, %error, "worker step failed"),
            }
            tokio::select! {
                () = shared.wake.notified() => {}
                () = sleep(POLL_INTERVAL) => {}
                () = shared.draining.cancelled() => {}
            }
        }
    }

    /// Takes one turn: claims or resumes, solves, and writes down what became of each job. The pool calls this, and tests do.
    ///
    /// # Errors
    /// The database failed; claimed jobs are given back if that is possible, or taken back when their leases run out.
    pub async fn step(&mut self) -> Result<StepReport, JobsError> {
        let Some(mut attempt) = self.next_turn().await? else {
            return Ok(StepReport::default());
        };
        let mut step = StepReport {
            busy: true,
            ..StepReport::default()
        };
        let done = self.turn(&mut attempt, &mut step).await;
        match done {
            Ok(Turn::Held) => {
                let held = attempt.claims(|phase| matches!(phase, Phase::Solving));
                step.parked = held.iter().map(|claim| claim.id).collect();
                attempt.on = TimeSpentOn::Parked;
                self.shared.turns.park(attempt);
                self.shared.wake.notify_one();
            }
            Ok(Turn::Over) => {}
            Err(error) => {
                self.give_up(&mut attempt).await;
                return Err(error);
            }
        }
        Ok(step)
    }
}
