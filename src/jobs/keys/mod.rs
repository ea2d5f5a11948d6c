//! API keys: which tenant a request belongs to.

pub mod keyring;
pub mod lookup;
