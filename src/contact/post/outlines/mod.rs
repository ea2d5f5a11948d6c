//! Borders of patches and zones as closed curves.

pub mod loops;
pub mod outline;
