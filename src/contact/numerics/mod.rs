//! General numerical algorithms, independent of contact mechanics; one implementation of each.
//!
//! | For | There is |
//! | --- | --- |
//! | unknowns at which loads, forces, heights and torques balance | [`equilibrium`] |
//! | the root of a monotone function in a bracket, the boundary of a condition, the maximum in an interval | [`roots`] |
//! | values between nodes | [`interpolation`] |
//! | integrals; evenly distributed samples, normal distribution | [`quadrature`] |
//! | linear equations; least-squares fits of few functions | [`lu`], [`gmres`] |
//! | connected cells | [`flood_fill`] |
//! | the instruction set of the kernels, logarithms in bulk | [`simd`] |
//!
//! Some iterations of the physics are not here because they need no general algorithm:
//!
//! - [`rigid_touch`](crate::geometry::rigid_touch) starts within 0.02 mm of the root and takes four steps without a test; where the rail is upright, it keeps the start
//!   instead of failing.
//! - [`spline`](crate::rolling::methods::table::spline) of the creep table takes a fixed number of steps without a test, because it is evaluated for millions of rows.

/// Largest number of iterations of searches with few unknowns, which usually take fewer than ten. It only prevents endless loops.
pub(crate) const ITERATIONS_MAX: usize = 40;

pub mod equilibrium;
pub mod flood_fill;
pub mod gmres;
pub mod interpolation;
pub mod lu;
pub mod quadrature;
pub mod roots;
pub mod simd;
