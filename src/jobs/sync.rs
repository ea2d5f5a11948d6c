//! Mutexes, and work outside the threads of the runtime.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{JobsError, Result};

/// Locks a mutex, ignoring poisoning.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs work that takes long or waits for the disk on a thread for blocking calls.
///
/// # Errors
/// [`JobsError::Damaged`] if the work panics.
pub async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T> {
    let done = tokio::task::spawn_blocking(work).await;
    done.map_err(|error| JobsError::Damaged(error.to_string()))
}
