//! What a key may be bound to.

use std::collections::BTreeMap;

/// Labels that a key is bound to: it opens only what carries them, and what it makes gets them.
pub type Labels = BTreeMap<String, String>;

/// Most labels that a key may be bound to.
pub const BOUND_MAX: usize = 8;
