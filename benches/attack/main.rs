//! Checks whether known attacks on the service still work.
//!
//! `cargo bench --bench attack [-- N1 … N7]` starts the real program on loopback with separate data folders and repeats the attacks. N1: one tenant
//! blocks the parsing of tables. N2: one idempotency key creates several runs. N3: a full disk is not reported. N4: wrong keys lock out valid ones.
//! N5: formulas in CSV. N6: small requests that store large data. N7: truncated results that look complete. It prints a line for each check and
//! exits with 1 if one fails. N3 mounts a small file system and is skipped where this is not allowed.

mod attacks;
#[path = "../service.rs"]
#[allow(dead_code, reason = "other benches use the rest")]
mod process;
mod service;

use std::process::ExitCode;

/// One check: the attack, the checked property, the finding, and whether the check holds.
pub struct Check {
    attack: &'static str,
    what: String,
    found: String,
    holds: Option<bool>,
}

impl Check {
    /// Returns a check with its outcome.
    pub fn judged(
        attack: &'static str,
        what: impl Into<String>,
        found: impl Into<String>,
        holds: bool,
    ) -> Check {
        Check {
            attack,
            what: what.into(),
            found: found.into(),
            holds: Some(holds),
        }
    }

    /// Returns a check that cannot run here.
    pub fn skipped(attack: &'static str, why: impl Into<String>) -> Check {
        Check {
            attack,
            what: "not tried".to_owned(),
            found: why.into(),
            holds: None,
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it does nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    let wanted = |name: &str| {
        let named = || arguments.iter().filter(|one| one.starts_with('N'));
        named().next().is_none() || named().any(|one| one == name)
    };
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .expect("a runtime");
    println!("| attack | check | found | |\n|---|---|---|---|");
    let mut failed = false;
    let mut print = |checks: Vec<Check>| {
        for Check {
            attack,
            what,
            found,
            holds,
        } in checks
        {
            let verdict = match holds {
                Some(true) => "holds",
                Some(false) => "FAILS",
                None => "skipped",
            };
            failed |= holds == Some(false);
            println!("| {attack} | {what} | {found} | {verdict} |");
        }
    };
    if wanted("N1") {
        print(runtime.block_on(attacks::tables()));
    }
    if wanted("N2") {
        print(runtime.block_on(attacks::idempotency()));
    }
    if wanted("N3") {
        print(runtime.block_on(attacks::full_disk()));
    }
    if wanted("N4") {
        print(runtime.block_on(attacks::wrong_keys()));
    }
    if wanted("N5") {
        print(runtime.block_on(attacks::formulas()));
    }
    if wanted("N6") {
        print(runtime.block_on(attacks::stored_bytes()));
    }
    if wanted("N7") {
        print(runtime.block_on(attacks::revoked()));
    }
    match failed {
        true => ExitCode::FAILURE,
        false => ExitCode::SUCCESS,
    }
}
