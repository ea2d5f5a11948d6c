//! Rolling contact of elastic bodies with friction: forces, tractions, stick and slip zones, each resultant with an estimate of its error.
//!
//! Lengths are in mm, forces in N, stresses in MPa. x is the rolling direction, y points left, z up. Forces act on the lower body.
//!
//! A case states two materials, their friction, where they touch, the load and the motion:
//!
//! ```
//! use railhead_contact::{Case, Contact, Friction, Load, Material, Motion};
//!
//! let solution = Case::new(Material::steel(), Friction::coulomb(0.3), Contact::radii(460.0, 300.0))
//!     .load(Load::normal_force(100e3))
//!     .motion(Motion::creepages(0.001, 0.0, 0.0))
//!     .solve()?;
//! let point = &solution.patches[0].points[0];
//! println!("{:.0} N, +-{:.0} N", point.force_x_n, point.error_estimate.unwrap().force_x_n);
//! # Ok::<(), railhead_contact::Error>(())
//! ```
//!
//! A case as JSON, as the HTTP API takes it, is read by [`check`] and solved by [`solve`]:
//!
//! ```
//! use railhead_contact::{Limits, Unmonitored, check, solve};
//!
//! let case = serde_json::json!({
//!     "material": { "shear_modulus_mpa": 82000, "poisson_ratio": 0.28 },
//!     "friction": { "coefficient": 0.3 },
//!     "contact": { "type": "radii", "rolling_mm": 460, "lateral_mm": 300 },
//!     "load": { "normal_force_n": 100e3 },
//!     "motion": { "creepage_x": 0.001 }
//! });
//! let (solution, fields) = solve(&check(&case, &Limits::default())?, &Unmonitored)?;
//! assert_eq!(solution.patches.len(), fields.patches.len());
//! # Ok::<(), railhead_contact::Error>(())
//! ```
//!
//! `examples/` has a Hertz contact, a creep curve and a wheel on a rail. [`contact`] holds the modules, in the order in which a case passes them.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![warn(unreachable_pub, unused_qualifications)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]
// Clocks, files, environment, network and output, listed in `clippy.toml` of this folder.
#![cfg_attr(
    not(test),
    warn(
        clippy::disallowed_macros,
        clippy::disallowed_methods,
        clippy::disallowed_types
    )
)]

#[path = "mod.rs"]
pub mod contact;

pub use contact::case::solver::Limits;
pub use contact::case::words::contact::{
    Contact, InfluenceName as SurfaceInfluence, Load, SideName as Side,
    SurfaceName as ReferenceSurface,
};
pub use contact::case::words::cross_section::{CrossSection, FormatName as Format};
pub use contact::case::words::friction::Friction;
pub use contact::case::words::material::{Elastic, Material};
pub use contact::case::words::motion::{AskedMotion as Motion, Motions, Wheelset};
pub use contact::case::words::solver::Case;
pub use contact::case::words::solver::{MethodName as Method, Output, Solver};
pub use contact::error::{CaseError, Fault, SolveError};
pub use contact::facade::Error;
pub use contact::monitor::{Monitor, Unmonitored};
pub use contact::problem::checked_case::CheckedCase;
pub use contact::solution::words::answer::Fields;
pub use contact::solution::words::answer::Solution;
pub use contact::{check, solve};
