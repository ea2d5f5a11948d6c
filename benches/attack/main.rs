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

const ATTACKS: [&str; 7] = ["N1", "N2", "N3", "N4", "N5", "N6", "N7"];

/// One check: the checked property, the finding, and whether the property holds. A check that cannot run here has no verdict.
pub struct Check {
    what: String,
    found: String,
    holds: Option<bool>,
}

impl Check {
    /// Returns a check with its outcome.
    pub fn judged(what: impl Into<String>, found: impl Into<String>, holds: bool) -> Check {
        Check {
            what: what.into(),
            found: found.into(),
            holds: Some(holds),
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, and then it does nothing.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    let named = |attack: &str| arguments.iter().any(|argument| argument == attack);
    let all = !ATTACKS.into_iter().any(named);
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .expect("a runtime");
    println!("| attack | check | found | |\n|---|---|---|---|");
    let mut failed = false;
    for attack in ATTACKS.into_iter().filter(|attack| all || named(attack)) {
        let checks = runtime.block_on(async {
            match attack {
                "N1" => attacks::tables().await,
                "N2" => attacks::idempotency().await,
                "N3" => attacks::full_disk().await,
                "N4" => attacks::wrong_keys().await,
                "N5" => attacks::formulas().await,
                "N6" => attacks::stored_bytes().await,
                _ => attacks::revoked().await,
            }
        });
        for Check { what, found, holds } in checks {
            let verdict = match holds {
                Some(true) => "holds",
                Some(false) => "FAILS",
                None => "skipped",
            };
            failed |= holds == Some(false);
            println!("| {attack} | {what} | {found} | {verdict} |");
        }
    }
    match failed {
        true => ExitCode::FAILURE,
        false => ExitCode::SUCCESS,
    }
}
