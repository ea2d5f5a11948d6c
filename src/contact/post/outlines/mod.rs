//! Borders of patches and zones as closed curves.

pub mod outline;
