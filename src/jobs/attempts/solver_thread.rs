//! The thread on which arithmetic runs.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock, mpsc};
use std::time::{Duration, Instant};

use crate::jobs::attempts::heap::give_memory_back;
use crate::jobs::error::JobsError;

/// After tasks of at least this length free memory is given back to the system, which takes a walk over the whole heap.
const LONG: Duration = Duration::from_secs(1);

/// Stack of a solver thread.
const STACK_BYTES: usize = 16 << 20;

/// Something to compute.
pub(crate) type Task = Box<dyn FnOnce() + Send>;

/// A thread that does arithmetic, one task after the other, until its handle is dropped.
#[derive(Debug)]
pub(crate) struct SolverThread {
    tasks: mpsc::Sender<Task>,
    /// Set when it is left behind; it then counts as such until it ends.
    pub(crate) left: Arc<OnceLock<Counted>>,
}

/// One of a number, as long as it lives.
#[derive(Debug)]
pub(crate) struct Counted(pub(crate) Arc<AtomicUsize>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

impl SolverThread {
    /// Starts a thread of this name.
    pub(crate) fn start(name: &str) -> Result<SolverThread, JobsError> {
        let (tasks, todo) = mpsc::channel::<Task>();
        let left = Arc::new(OnceLock::new());
        let until_the_end = left.clone();
        std::thread::Builder::new()
            .name(name.to_owned())
            .stack_size(STACK_BYTES)
            .spawn(move || {
                while let Ok(task) = todo.recv() {
                    let began = Instant::now();
                    task();
                    if began.elapsed() >= LONG {
                        give_memory_back();
                    }
                }
                drop(until_the_end);
            })
            .map_err(JobsError::Thread)?;
        Ok(SolverThread { tasks, left })
    }

    /// Hands a task over; `false` if the thread is gone.
    pub(crate) fn give(&self, task: Task) -> bool {
        self.tasks.send(task).is_ok()
    }
}
