//! Tests encryption and certificate checks of database connections as requested by the URL.

use railhead::jobs::store::postgres::doctor::examine;
use sqlx::{Connection, PgConnection};

use crate::cluster::postgres::{encrypted, with_parameter};
use crate::cluster::tables;

/// Connects to a database. Returns the error as text, or an empty text on success.
async fn connect(url: &str) -> String {
    match examine(url).await {
        Ok(_) => String::new(),
        Err(error) => error.to_string(),
    }
}

#[tokio::test]
async fn a_connection_is_encrypted_and_the_certificate_checked_as_the_url_asks_for() {
    let (port, authority) = or_skip!(encrypted());
    let plain = tables().await.unwrap();
    let (_, name) = plain.rsplit_once('/').unwrap();
    let name = name.split('?').next().unwrap();
    let at = |host: &str, query: &str| format!("postgres://railhead@{host}:{port}/{name}?{query}");
    let own = format!("sslrootcert={}", authority.display());

    for (host, query) in [
        ("127.0.0.1", "sslmode=require".to_owned()),
        ("127.0.0.1", format!("sslmode=verify-ca&{own}")),
        ("127.0.0.1", format!("sslmode=require&{own}")),
        ("localhost", format!("sslmode=verify-full&{own}")),
    ] {
        let url = at(host, &query);
        assert_eq!(connect(&url).await, "", "{url}");
    }
    let query = "SELECT ssl FROM pg_stat_ssl WHERE pid = pg_backend_pid()";
    for (url, encrypted) in [
        (at("127.0.0.1", "sslmode=require"), true),
        (plain.clone(), false),
    ] {
        let mut connection = PgConnection::connect(&url).await.unwrap();
        let ssl: bool = sqlx::query_scalar(query)
            .fetch_one(&mut connection)
            .await
            .unwrap();
        assert_eq!(ssl, encrypted, "{url}");
    }

    // These certificates are signed by an unknown authority, issued for another name, or signed by another authority.
    let other = tempfile::NamedTempFile::new().unwrap();
    let stranger = rcgen::generate_simple_self_signed(vec!["localhost".to_owned()]).unwrap();
    std::fs::write(other.path(), stranger.cert.pem()).unwrap();
    let strange = format!("sslrootcert={}", other.path().display());
    for (host, query) in [
        ("localhost", "sslmode=verify-full".to_owned()),
        ("127.0.0.1", format!("sslmode=verify-full&{own}")),
        ("localhost", format!("sslmode=verify-full&{strange}")),
        ("localhost", format!("sslmode=require&{strange}")),
    ] {
        let url = at(host, &query);
        let said = connect(&url).await;
        assert!(
            said.contains("not encrypted as its URL asks"),
            "{url}: {said}"
        );
        assert!(said.contains("certificate"), "{url}: {said}");
    }
    let said = connect(&with_parameter(&at("localhost", &own), "sslmode=allow")).await;
    assert!(said.contains("sslmode=allow is not supported"), "{said}");
}
