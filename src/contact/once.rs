//! Something computed when it is first asked for, and kept with what it follows from.

use std::sync::OnceLock;

/// Something computed at the first call. It follows from the rest of what holds it, so that two of them never make holders differ.
#[derive(Debug, Clone)]
pub struct Once<T>(OnceLock<T>);

impl<T> Default for Once<T> {
    fn default() -> Once<T> {
        Once(OnceLock::new())
    }
}

impl<T> PartialEq for Once<T> {
    fn eq(&self, _: &Once<T>) -> bool {
        true
    }
}

impl<T> Once<T> {
    /// It; made at the first call.
    pub fn get_or_make(&self, make: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(make)
    }
}
