//! What the commands print: results to standard output, errors to standard error.

use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Writes to standard output; a reader that has gone away is no fault of ours.
pub fn print(text: &str) -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// An error with its causes; a cause that was told already is not told again.
pub fn reasons(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Writes one line to standard error.
pub fn print_error(text: &str) {
    // If even standard error is closed there is nobody left to tell.
    let _ = writeln!(std::io::stderr(), "railhead: {text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_told_once() {
        let inner = anyhow::anyhow!("no such file");
        let error = inner.context("the folder: no such file").context("backup");
        assert_eq!(reasons(&error), "backup: the folder: no such file");
    }
}
