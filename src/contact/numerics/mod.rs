//! General numerical algorithms, independent of contact mechanics; one implementation of each.
//!
//! | For | There is |
//! | --- | --- |
//! | unknowns at which loads, forces, heights and torques balance | [`equilibrium`] |
//! | the root of a monotone function in a bracket, the boundary of a condition, the largest value in an interval | [`roots`] |
//! | values between nodes | [`interpolation`] |
//! | integrals; evenly spread samples, normal distribution | [`quadrature`] |
//! | linear equations; few unknowns fitted to samples | [`lu`], [`gmres`] |
//! | connected cells | [`flood_fill`] |
//! | the instruction set of the kernels, logarithms in bulk | [`simd`] |
//!
//! Some iterations of the physics resemble one of these, and stay where they are because what they do beside the iteration differs:
//!
//! - [`rigid_touch`](crate::geometry::rigid_touch) starts within 0.02 mm of the root and takes four steps untested; where the rail
//!   is upright, it keeps the start instead of failing.
//! - [`spline`](crate::rolling::methods::table::spline) of the creep table always takes six steps, without a test in
//!   between, because it is evaluated for millions of rows.

pub mod equilibrium;
pub mod flood_fill;
pub mod gmres;
pub mod interpolation;
pub mod lu;
pub mod quadrature;
pub mod roots;
pub mod simd;
