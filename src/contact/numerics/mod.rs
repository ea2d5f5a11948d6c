//! Numerical tools that know nothing of contact: one of each.

pub mod bracketed_root;
pub mod cubic;
pub mod dense_lu;
pub mod gmres;
pub mod simd_ln;
