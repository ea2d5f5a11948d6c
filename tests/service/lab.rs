//! A service in this process with a solver that a test controls.

use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use railhead::contact::error::SolveError;
use railhead::contact::monitor::Monitor;
use railhead::contact::solve;
use railhead::jobs::engine::Engine;
use railhead::jobs::model::Job;
use railhead::jobs::{Jobs, Options, State};
use serde_json::Value;
use tempfile::TempDir;
use uuid::Uuid;

pub const AT_MOST: Duration = Duration::from_secs(60);

/// A gate that holds solvers until it is opened.
#[derive(Clone, Default)]
pub struct Gate {
    open: Arc<AtomicBool>,
    begun: Arc<AtomicUsize>,
    /// The number of solvers held now, and the largest number so far.
    ticking: Arc<[AtomicUsize; 2]>,
    deaf: Arc<Mutex<BTreeSet<String>>>,
}

impl Gate {
    pub fn set_open(&self, open: bool) {
        self.open.store(open, Ordering::SeqCst);
    }

    /// Returns the number of solves that have begun.
    pub fn begun(&self) -> usize {
        self.begun.load(Ordering::SeqCst)
    }

    /// Returns the largest number of solvers that were held at once.
    pub fn most(&self) -> usize {
        self.ticking[1].load(Ordering::SeqCst)
    }

    /// Ticks until the gate is open.
    pub fn hold(&self, monitor: &dyn Monitor) -> Result<(), SolveError> {
        while !self.open.load(Ordering::SeqCst) {
            if let ControlFlow::Break(stop) = monitor.tick(0.5) {
                return Err(stop.into());
            }
            let now = self.ticking[0].fetch_add(1, Ordering::SeqCst) + 1;
            self.ticking[1].fetch_max(now, Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(1));
            self.ticking[0].fetch_sub(1, Ordering::SeqCst);
        }
        Ok(())
    }

    /// Returns an engine that acts on the name of a case. Cases named `long…` tick until the gate is open. Cases named `deaf…` do not tick until
    /// then at their first attempt.
    fn engine(&self) -> Engine {
        let gate = self.clone();
        Engine::contact().solving(move |case, monitor| {
            gate.begun.fetch_add(1, Ordering::SeqCst);
            let name = case.label.name.as_deref().unwrap_or_default();
            if name.starts_with("long") {
                gate.hold(monitor)?;
            }
            if name.starts_with("deaf") && gate.deaf.lock().unwrap().insert(name.to_owned()) {
                while !gate.open.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
            }
            solve(case, monitor)
        })
    }
}

pub struct Lab {
    pub jobs: Jobs,
    pub gate: Gate,
    pub folder: TempDir,
    pub options: Options,
    engine: Engine,
}

impl Lab {
    /// Opens a service without a cache that does not solve until it is started.
    pub async fn idle(change: impl FnOnce(&mut Options)) -> Lab {
        let gate = Gate::default();
        Lab::of(gate.clone(), gate.engine(), change).await
    }

    pub async fn start(change: impl FnOnce(&mut Options)) -> Lab {
        let lab = Lab::idle(change).await;
        lab.jobs.start().unwrap();
        lab
    }

    /// Opens a service with an engine that uses this gate.
    pub async fn of(gate: Gate, engine: Engine, change: impl FnOnce(&mut Options)) -> Lab {
        let folder = tempfile::tempdir().unwrap();
        let mut options = Options::new(folder.path());
        options.cache = false;
        change(&mut options);
        let jobs = Jobs::open_with(options.clone(), engine.clone()).await;
        Lab {
            jobs: jobs.unwrap(),
            gate,
            folder,
            options,
            engine,
        }
    }

    /// Shuts the service down within a grace period and opens it again.
    pub async fn reopen(&mut self, grace: Duration) {
        self.jobs.shutdown(grace).await;
        let again = Jobs::open_with(self.options.clone(), self.engine.clone());
        self.jobs = again.await.unwrap();
    }

    pub async fn submit(&self, case: Value) -> Uuid {
        self.jobs.submit(case, None).await.unwrap().id
    }

    /// Submits a case and waits until a solver has begun with it.
    pub async fn begin(&self, case: Value) -> Uuid {
        let before = self.gate.begun();
        let id = self.submit(case).await;
        while self.gate.begun() == before {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
        id
    }

    pub async fn get(&self, id: Uuid) -> Job {
        self.jobs.get(id).await.unwrap()
    }

    /// Waits until a job has ended, and returns it.
    pub async fn wait(&self, id: Uuid) -> Job {
        self.jobs.wait(id, AT_MOST).await.unwrap()
    }

    /// Waits until a job has ended, and asserts that it succeeded at its first attempt.
    pub async fn succeeds_at_once(&self, id: Uuid) {
        let job = self.wait(id).await;
        assert_eq!((job.state, job.attempt), (State::Succeeded, 1));
    }

    /// Opens the gate and shuts down with a grace period for the solvers.
    pub async fn end(self) {
        self.gate.set_open(true);
        self.jobs.shutdown(Duration::from_secs(10)).await;
    }
}
