//! API keys: which tenant a request belongs to.

pub mod bound;
pub mod key;
pub mod keyring;
pub mod lookup;
