//! A lazily initialised field that equality ignores.

use std::sync::OnceLock;

/// A lazily initialised field. Its value is a pure function of the other fields of its struct, so two instances always compare equal.
#[derive(Debug, Clone)]
pub struct LazyField<T>(OnceLock<T>);

impl<T> Default for LazyField<T> {
    fn default() -> LazyField<T> {
        LazyField(OnceLock::new())
    }
}

impl<T> PartialEq for LazyField<T> {
    fn eq(&self, _: &LazyField<T>) -> bool {
        true
    }
}

impl<T> LazyField<T> {
    /// Returns the value, which the first call computes.
    pub fn get_or_make(&self, make: impl FnOnce() -> T) -> &T {
        self.0.get_or_init(make)
    }
}
