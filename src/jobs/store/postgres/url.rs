//! Database URLs, interpreted as by libpq. Parameters that would be ignored are rejected.
//!
//! `sslmode` has the meaning of libpq (PostgreSQL 15, 34.19.1): `require` encrypts, `verify-ca` also checks the signature
//! of the server's certificate, `verify-full` also its name. Where libpq trusts the authorities of one file, this service
//! also trusts those of the system; without `sslrootcert` it trusts only those.

use std::str::FromStr;

use sqlx::postgres::{PgConnectOptions, PgSslMode};

use crate::error::JobsError;

/// Supported parameters, in addition to `options[…]`.
const KNOWN: [&str; 12] = [
    "sslmode",
    "sslrootcert",
    "sslcert",
    "sslkey",
    "host",
    "hostaddr",
    "port",
    "dbname",
    "user",
    "password",
    "application_name",
    "options",
];

/// Ignored parameters: they request the default behaviour.
const HARMLESS: [(&str, &str); 3] = [
    ("connect_timeout", ""),
    ("gssencmode", "disable"),
    ("channel_binding", "prefer"),
];

/// Parses the URL of a database.
///
/// # Errors
/// [`JobsError::BadDatabaseUrl`] if it is invalid or has an unsupported parameter.
pub(crate) fn read(text: &str) -> Result<PgConnectOptions, JobsError> {
    let bad = |why: &str| JobsError::BadDatabaseUrl(why.to_owned());
    let (front, query) = text.split_once('?').unwrap_or((text, ""));
    let mut kept = Vec::new();
    let (mut system_roots, mut own_roots) = (false, false);
    for pair in query.split('&').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        let harmless = HARMLESS
            .iter()
            .any(|(name, only)| *name == key && (only.is_empty() || *only == value));
        match (key, value) {
            ("sslrootcert", "system") => system_roots = true,
            _ if harmless => {}
            _ if KNOWN.contains(&key) || key.starts_with("options[") => kept.push(pair),
            _ => return Err(bad(&format!("`{pair}` is not supported"))),
        }
        own_roots |= key == "sslrootcert" && value != "system";
    }
    let kept = match kept.is_empty() {
        true => front.to_owned(),
        false => format!("{front}?{}", kept.join("&")),
    };
    let options = PgConnectOptions::from_str(&kept).map_err(|error| bad(&error.to_string()))?;
    match options.get_ssl_mode() {
        PgSslMode::Allow => Err(bad(
            "sslmode=allow is not supported: use disable, prefer, require, verify-ca or verify-full",
        )),
        PgSslMode::VerifyFull => Ok(options),
        _ if system_roots => Err(bad(
            "sslrootcert=system needs sslmode=verify-full, for anybody may have a certificate of a public authority",
        )),
        // As in libpq: a named authority implies that the certificate is checked.
        PgSslMode::Require if own_roots => Ok(options.ssl_mode(PgSslMode::VerifyCa)),
        _ => Ok(options),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(query: &str) -> String {
        match read(&format!("postgres://u:hush@h/d?{query}")) {
            Ok(options) => format!("{:?}", options.get_ssl_mode()),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn a_mode_means_what_it_means_in_libpq() {
        assert_eq!(said(""), "Prefer");
        assert_eq!(said("sslmode=require&connect_timeout=3"), "Require");
        assert_eq!(said("sslmode=require&sslrootcert=/ca.pem"), "VerifyCa");
        assert_eq!(said("sslmode=verify-full&sslrootcert=system"), "VerifyFull");
    }

    #[test]
    fn what_is_not_done_is_refused_and_not_left_out() {
        for (query, word) in [
            ("sslmode=allow", "sslmode=allow"),
            ("sslmode=require&sslrootcert=system", "verify-full"),
            ("sslcrl=/crl.pem", "sslcrl"),
            ("channel_binding=require", "channel_binding"),
            ("gssencmode=require", "gssencmode"),
            ("target_session_attrs=read-write", "target_session_attrs"),
            ("sslmode=strict", "strict"),
        ] {
            let said = said(query);
            assert!(
                said.contains(word) && said.contains("postgres://"),
                "{said}"
            );
            assert!(!said.contains("hush"), "{said}");
        }
    }
}
