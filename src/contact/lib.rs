//! The physics of railhead as a package of its own: its paths read the same here as in the service, which re-exports [`contact`].

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
