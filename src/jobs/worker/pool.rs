//! Workers: each takes one turn after the other until the service drains.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::sleep;
use uuid::Uuid;

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
    /// It serves short jobs while every other worker is at a long solve.
    pub(crate) spare: bool,
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
}

impl Worker {
    pub(crate) fn new(shared: Arc<Shared>, name: &str) -> Result<Worker, JobsError> {
        Ok(Worker {
            thread: Some(SolverThread::start(name)?),
            shared,
            name: name.to_owned(),
            spare: false,
        })
    }

    /// Steps until the service drains.
    pub(crate) async fn run(mut self) {
        let shared = self.shared.clone();
        let recovered = shared.recovered.wait();
        let _ = shared.draining.run_until_cancelled(recovered).await;
        let wake = match self.spare {
            true => &shared.wake_spare,
            false => &shared.wake,
        };
        while !shared.draining.is_cancelled() {
            match self.step().await {
                Ok(step) if step.busy => continue,
                Ok(_) => {}
                Err(error) => tracing::error!(worker = self.name, %error, "worker step failed"),
            }
            tokio::select! {
                () = wake.notified() => {}
                () = sleep(POLL_INTERVAL) => {}
                () = shared.draining.cancelled() => {}
            }
        }
    }

    /// Takes one turn: claims, solves, and writes down what became of each job. The pool calls this, and tests do.
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
        if let Err(error) = self.turn(&mut attempt, &mut step).await {
            self.give_up(&mut attempt).await;
            return Err(error);
        }
        Ok(step)
    }
}
