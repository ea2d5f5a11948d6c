//! The physics of railhead as a package of its own: its paths read the same here as in the service, which re-exports [`contact`].

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![warn(unreachable_pub, unused_qualifications)]
#![cfg_attr(not(test), warn(clippy::unwrap_used))]

#[path = "mod.rs"]
pub mod contact;
