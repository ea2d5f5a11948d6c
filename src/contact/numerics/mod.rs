//! General numerical algorithms, independent of contact mechanics; one implementation of each.

pub mod bisection;
pub mod bracketed_root;
pub mod cubic;
pub mod dense_lu;
pub mod flood_fill;
pub mod gmres;
pub mod hermite;
pub mod lagrange;
pub mod least_squares;
pub mod maximum;
pub mod monotone_root;
pub mod quadrature;
pub mod simd_ln;
pub mod spline;
