//! The attempts of this process, found by their jobs.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};

use uuid::Uuid;

use crate::jobs::attempts::attempt_control::AttemptControl;
use crate::jobs::sync::lock;

/// The attempts of this process; clones share them.
#[derive(Debug, Clone, Default)]
pub(crate) struct RunningAttempts(Arc<Mutex<HashMap<Uuid, Arc<AttemptControl>>>>);

/// An entry in the list of running attempts, as long as it lives.
#[derive(Debug)]
pub(crate) struct RunningEntry {
    attempts: RunningAttempts,
    id: Uuid,
    control: Arc<AttemptControl>,
}

impl RunningAttempts {
    /// Lists an attempt at a job until the entry is dropped.
    pub(crate) fn enter(&self, id: Uuid, control: &Arc<AttemptControl>) -> RunningEntry {
        self.lock().insert(id, control.clone());
        RunningEntry {
            attempts: self.clone(),
            id,
            control: control.clone(),
        }
    }

    /// The attempt at a job, if this process makes one.
    pub(crate) fn get(&self, id: Uuid) -> Option<Arc<AttemptControl>> {
        self.lock().get(&id).cloned()
    }

    /// The jobs of all attempts.
    pub(crate) fn ids(&self) -> Vec<Uuid> {
        self.lock().keys().copied().collect()
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Uuid, Arc<AttemptControl>>> {
        lock(&self.0)
    }
}

impl Drop for RunningEntry {
    fn drop(&mut self) {
        let mut attempts = self.attempts.lock();
        // Another worker may have taken the job over meanwhile; its entry stays.
        if attempts
            .get(&self.id)
            .is_some_and(|control| Arc::ptr_eq(control, &self.control))
        {
            attempts.remove(&self.id);
        }
    }
}
