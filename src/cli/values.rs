//! Values of flags that are more than a number or a text, and how they are read.

use std::net::SocketAddr;
use std::time::Duration;

use crate::http::extract::labels;
use crate::http::extract::query::ReadTexts;

/// How long ended jobs are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Retention(pub Option<Duration>);

/// Reads a time such as `30d`, `1w` or `90m`, or `forever`.
pub(super) fn retention(text: &str) -> Result<Retention, String> {
    if text == "forever" {
        return Ok(Retention(None));
    }
    let wrong = "allowed are `forever` or a time of at least 1 s such as `12h`, `30d`, `8w`";
    let span: jiff::Span = text.parse().map_err(|_| wrong.to_owned())?;
    let seconds = span
        .total((
            jiff::Unit::Second,
            jiff::SpanRelativeTo::days_are_24_hours(),
        ))
        .map_err(|_| wrong.to_owned())?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if time >= Duration::from_secs(1) => Ok(Retention(Some(time))),
        _ => Err(wrong.to_owned()),
    }
}

/// When requests without an API key are answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Anonymous {
    /// While the service listens on a loopback address.
    Loopback,
    /// On every address: whoever reaches the port may use the service.
    Always,
    /// Not at all.
    Never,
}

impl Anonymous {
    /// Are requests without a key answered on this address?
    #[must_use]
    pub(super) fn on(self, address: SocketAddr) -> bool {
        match self {
            Anonymous::Loopback => address.ip().is_loopback(),
            Anonymous::Always => true,
            Anonymous::Never => false,
        }
    }
}

/// Reads an origin: scheme and authority, nothing else.
pub(super) fn origin(text: &str) -> Result<String, String> {
    let rest = text
        .strip_prefix("https://")
        .or_else(|| text.strip_prefix("http://"));
    let plain = |rest: &str| {
        !rest.is_empty()
            && rest
                .bytes()
                .all(|byte| byte.is_ascii_graphic() && !b"/*?#@".contains(&byte))
    };
    if rest.is_some_and(plain) {
        return Ok(text.to_owned());
    }
    Err(
        "an origin is `http://` or `https://` and a host, perhaps with a port, and no path"
            .to_owned(),
    )
}

/// Reads an address to listen on.
pub(super) fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| {
        "allowed is an IP address with a port, such as `127.0.0.1:8080`, `0.0.0.0:8080` or `[::1]:8080`; names are not looked up"
            .to_owned()
    })
}

/// Reads a label of a key, by the rule for labels of cases.
pub(super) fn bound_label(text: &str) -> Result<(String, String), String> {
    let label = labels::new_label();
    label
        .read(&[text])
        .map_err(|(_, allowed)| allowed.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_retention_is_a_time_with_its_unit_or_forever() {
        let days = |days: u64| Ok(Retention(Some(Duration::from_secs(days * 24 * 3600))));
        assert_eq!(retention("forever"), Ok(Retention(None)));
        assert_eq!(retention("30d"), days(30));
        assert_eq!(retention("2w"), days(14));
        assert_eq!(retention("24h"), days(1));
        for wrong in ["", "30", "0s", "-1d", "1 month", "soon"] {
            assert!(retention(wrong).is_err(), "{wrong:?}");
        }
    }
}
