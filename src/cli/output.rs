//! Output of the commands: results to standard output, errors to standard error.

use std::io::{ErrorKind, Write};
use std::process::ExitCode;

/// Writes to standard output. A closed pipe is not an error.
pub(super) fn print(text: &str) -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{}", text.trim_end()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// An error and its causes in one line. A cause that the text already contains is omitted.
pub(super) fn reasons(error: &anyhow::Error) -> String {
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
pub(super) fn print_error(text: &str) {
    // If standard error is closed too, the error cannot be reported.
    let _ = writeln!(std::io::stderr(), "railhead: {text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_named_once() {
        let inner = anyhow::anyhow!("no such file");
        let error = inner.context("the folder: no such file").context("backup");
        assert_eq!(reasons(&error), "backup: the folder: no such file");
    }
}
