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
//! [`telemetry`] decides where logs and spans go and is used by [`cli`] only.
//!
//! Inside [`contact`] a case passes these stages, each of which returns a type of its own:
//!
//! 1. [`contact::check`]: the text becomes a [`Case`](contact::case::Case), every fault named at once, and then a
//!    [`Problem`](contact::problem::Problem): materials combined, region and pressure known ([`contact::normal`]),
//!    limits enforced.
//! 2. [`contact::solve`]: [`Level`](contact::tangential::level::Level)s, coarse to fine: strips fitted to the patches
//!    ([`contact::mesh`]), pressures of their cells, and how their surfaces give ([`contact::influence`]).
//! 3. For every motion a [`Point`](contact::tangential::point::Point): tractions and slips
//!    ([`contact::tangential`]: [`boundary_element`](contact::tangential::boundary_element),
//!    [`liu_hsu`](contact::tangential::liu_hsu) or [`fastsim`](contact::tangential::fastsim)) with an estimate of their error.
//! 4. [`contact::outputs`]: resultants, zones and fields become a [`Solution`](contact::solution::Solution).
//!
//! Files are named after what a user can choose: a method, a route, a command, a store is a file of that name.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

pub mod cli;
pub mod contact;
pub mod http;
pub mod jobs;
pub mod telemetry;
