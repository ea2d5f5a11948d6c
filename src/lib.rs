//! railhead: a rolling-contact stress service. This page is the map of the house.
//!
//! Four rooms, each uses only those before it:
//!
//! | room | answers |
//! |---|---|
//! | [`contact`] | what is the physics? Plain synchronous arithmetic, no clock but the caller's, no files, no network |
//! | [`jobs`] | who solves what, when, and what became of it? Store, workers, results |
//! | [`http`] | what may a client ask, and how is it answered? |
//! | [`cli`] | what can be started, with which settings? Then `main` |
//!
//! [`telemetry`] writes the log and [`otlp`] sends spans; only [`cli`] uses them.
//!
//! Inside [`contact`] a case passes these stages, each returns a type of its own; [`contact`] has the recipe:
//!
//! 1. [`contact::case`]: [`contact::check`] turns the text into a [`Case`](contact::case::words::solver::Case), names every fault at once,
//!    and makes a [`Problem`](contact::problem::physics::Problem) of checked numbers.
//! 2. [`contact::normal`]: patches and pressures, known in closed form or found from a gap or from profiles
//!    ([`contact::geometry`], [`contact::normal_stage`]): a [`NormalTask`](contact::normal::footprint::NormalTask) becomes a [`Footprint`](contact::normal::footprint::Footprint).
//! 3. [`contact::rolling`]: for every motion, [`refinement`](contact::rolling::refinement) makes meshes from coarse to fine
//!    ([`contact::mesh`]) and takes their operators ([`contact::half_space`]); a [method](contact::rolling::methods) solves each under
//!    the law of [`friction`](contact::friction) until the estimate of the error meets the target.
//! 4. [`contact::solution`]: resultants, zones and fields ([`contact::post`]) become a
//!    [`Solution`](contact::solution::words::answer::Solution) in the words a client reads.
//!
//! Files are named after what a user can choose: a method, a route, a command, a store is a file of that name.

#![warn(unreachable_pub)]
#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod cli;
pub mod http;
pub mod jobs;
#[cfg(feature = "otlp")]
pub mod otlp;
#[cfg(not(feature = "otlp"))]
#[path = "no_otlp.rs"]
pub mod otlp;
pub mod telemetry;

pub use railhead_contact::contact;
