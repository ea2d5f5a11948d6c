//! General numerical algorithms, independent of contact mechanics; one implementation of each.
//!
//! | For | There is |
//! | --- | --- |
//! | a root between two bounds, with slopes | [`monotone_root`] |
//! | a root of an increasing function without bounds, without slopes | [`bracketed_root`] |
//! | two arguments at which two values are 0, without bounds, without slopes | [`pair_root`] |
//! | the boundary of a condition | [`bracketed_root`] |
//! | the largest value in an interval | [`bracketed_root`] |
//! | values between nodes | [`cubic`] (one interval), [`hermite`] (given slopes, or slopes without overshoot), [`spline`] (smoothing), [`lagrange`] (one polynomial) |
//! | integrals | [`quadrature`] |
//! | evenly spread samples, normal distribution | [`sampling`] |
//! | linear equations | [`dense_lu`], up to 32 unknowns [`small_lu`], [`gmres`]; few unknowns fitted to samples: [`least_squares`] |
//! | lengths of vectors in inner loops | [`length`] |
//! | connected cells | [`flood_fill`] |
//! | logarithms in bulk | [`simd_ln`] |
//! | the instruction set of the kernels | [`simd`] |
//!
//! Some iterations of the physics resemble one of these, and stay where they are because what they do beside the iteration differs:
//!
//! - [`rigid_touch`](crate::contact::geometry::rigid_touch) starts within 0.02 mm of the root and takes four steps untested; where the rail
//!   is upright, it keeps the start instead of failing.
//! - [`coordinates`](crate::contact::rolling::methods::table::spline) of the creep table always takes six steps, without a test in
//!   between, because it is evaluated for millions of rows.
//! - The [search](crate::contact::rolling::history::plan) of a history looks for two creepages at once as [`pair_root`] does, and keeps its
//!   compliance from step to step.

pub mod flood_fill;
pub mod gmres;
pub mod interpolation;
pub mod lu;
pub mod quadrature;
pub mod roots;
pub mod simd;
