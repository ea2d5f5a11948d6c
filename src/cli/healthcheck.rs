//! `railhead healthcheck`: checks that a running service is ready, for containers without other tools.

use std::io::{Read, Write};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpStream, ToSocketAddrs};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use axum::http::Uri;
use axum::http::uri::PathAndQuery;

use crate::cli::commands::HealthcheckArgs;

/// Time limit of each step.
const STEP_TIMEOUT: Duration = Duration::from_secs(3);
/// Number of bytes of the response that are read, which include the status line.
const ANSWER_BYTES: u64 = 1024;

/// Checks that the service is ready; succeeds if the status is 200.
pub(super) fn run(args: &HealthcheckArgs) -> anyhow::Result<ExitCode> {
    let own = || url(args.probe_listen.unwrap_or(args.listen));
    let url = &args.url.clone().unwrap_or_else(own);
    let (authority, path) = parse(url)?;
    let status = ask(&authority, &path).with_context(|| format!("no answer from {url}"))?;
    if status != 200 {
        bail!("{url} answered {status}");
    }
    Ok(ExitCode::SUCCESS)
}

/// The URL of the readiness probe of a service that listens on this address. The unspecified address is replaced by the
/// loopback address.
fn url(listen: SocketAddr) -> String {
    let mut address = listen;
    match listen.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => address.set_ip(Ipv4Addr::LOCALHOST.into()),
        IpAddr::V6(ip) if ip.is_unspecified() => address.set_ip(Ipv6Addr::LOCALHOST.into()),
        _ => {}
    }
    format!("http://{address}/readyz")
}

/// Splits `http://host[:port][/path]` into `host:port` and path.
fn parse(url: &str) -> anyhow::Result<(String, String)> {
    let uri: Uri = url
        .parse()
        .with_context(|| format!("{url:?} is not a URL"))?;
    let (Some("http"), Some(authority)) = (uri.scheme_str(), uri.authority()) else {
        bail!("{url:?} does not begin with http://");
    };
    let port = authority.port_u16().unwrap_or(80);
    let path = uri.path_and_query().map_or("/", PathAndQuery::as_str);
    Ok((format!("{}:{port}", authority.host()), path.to_owned()))
}

fn ask(authority: &str, path: &str) -> anyhow::Result<u16> {
    let mut reason = anyhow::anyhow!("{authority} has no address");
    for address in authority.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, STEP_TIMEOUT) {
            Ok(stream) => return status(stream, authority, path),
            Err(error) => reason = error.into(),
        }
    }
    Err(reason)
}

fn status(mut stream: TcpStream, authority: &str, path: &str) -> anyhow::Result<u16> {
    stream.set_read_timeout(Some(STEP_TIMEOUT))?;
    stream.set_write_timeout(Some(STEP_TIMEOUT))?;
    write!(
        stream,
        "GET {path} HTTP/1.1\r\nHost: {authority}\r\nConnection: close\r\n\r\n"
    )?;
    let mut answer = Vec::new();
    stream.take(ANSWER_BYTES).read_to_end(&mut answer)?;
    let line = String::from_utf8_lossy(&answer);
    let code = line
        .strip_prefix("HTTP/1.")
        .and_then(|rest| rest.split_whitespace().nth(1));
    code.and_then(|code| code.parse().ok())
        .context("the answer is not HTTP")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_service_is_asked_where_it_listens() {
        for (listen, asked) in [
            ("127.0.0.1:18081", "http://127.0.0.1:18081/readyz"),
            ("0.0.0.0:80", "http://127.0.0.1:80/readyz"),
            ("[::]:80", "http://[::1]:80/readyz"),
            ("192.0.2.1:8080", "http://192.0.2.1:8080/readyz"),
        ] {
            assert_eq!(url(listen.parse().unwrap()), asked);
        }
    }

    #[test]
    fn hosts_ports_and_paths_are_distinguished() {
        for (url, authority, path) in [
            ("http://127.0.0.1:8080/readyz", "127.0.0.1:8080", "/readyz"),
            ("http://localhost", "localhost:80", "/"),
            ("http://[::1]/readyz", "[::1]:80", "/readyz"),
            ("http://[::1]:81/a/b?c", "[::1]:81", "/a/b?c"),
        ] {
            assert_eq!(parse(url).unwrap(), (authority.to_owned(), path.to_owned()));
        }
        for url in [
            "https://localhost",
            "localhost:80",
            "http://",
            "http://a b/",
            "http://a/\r\nX: y",
        ] {
            assert!(parse(url).is_err(), "{url:?}");
        }
    }
}
