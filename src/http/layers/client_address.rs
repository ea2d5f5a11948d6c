//! The address of the client behind a trusted proxy.
//!
//! A proxy opens the connections of all its clients, so their addresses are only in the headers that it adds: `Forwarded` (RFC 7239) or
//! `X-Forwarded-For`. Every client can send these headers. They are therefore used only from the proxies in `--trusted-proxies`, and only
//! the part that trusted proxies wrote: from the right, up to the first address that is not a trusted proxy.

use std::net::IpAddr;

use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, header};
use axum::middleware::Next;
use axum::response::Response;

use crate::options::{AddressRange, HttpOptions};
use crate::server::connections::Peer;

const X_FORWARDED_FOR: HeaderName = HeaderName::from_static("x-forwarded-for");

/// Layer that replaces the address of a trusted proxy by the address of its client.
pub(crate) async fn resolve(
    State(options): State<HttpOptions>,
    mut request: Request,
    next: Next,
) -> Response {
    if let Some(Peer(peer)) = request.extensions().get() {
        let client = client_of(*peer, request.headers(), &options.trusted_proxies);
        request.extensions_mut().insert(Peer(client));
    }
    next.run(request).await
}

/// Returns the address of the client of a request from `peer`.
fn client_of(peer: IpAddr, headers: &HeaderMap, trusted: &[AddressRange]) -> IpAddr {
    let is_trusted = |address: IpAddr| trusted.iter().any(|range| range.contains(address));
    if !is_trusted(peer) {
        return peer;
    }
    // Reads the addresses of a header from the right, up to one that cannot be parsed.
    let nearest = |addresses: Vec<Option<IpAddr>>| {
        let mut client = peer;
        for address in addresses.into_iter().rev() {
            match address {
                Some(address) => client = address,
                None => break,
            }
            if !is_trusted(client) {
                break;
            }
        }
        client
    };
    let forwarded = listed(headers, &header::FORWARDED, forwarded_for).map(nearest);
    let x_forwarded = listed(headers, &X_FORWARDED_FOR, node).map(nearest);
    match (forwarded, x_forwarded) {
        (Some(client), None) | (None, Some(client)) => client,
        (Some(client), Some(same)) if client == same => client,
        // A proxy writes one of the headers; the other one may come from the client.
        _ => peer,
    }
}

/// Returns the elements of a header as addresses, in order; `None` if the header is absent.
fn listed(
    headers: &HeaderMap,
    name: &HeaderName,
    read: fn(&str) -> Option<IpAddr>,
) -> Option<Vec<Option<IpAddr>>> {
    let values = headers.get_all(name).iter();
    let mut elements = Vec::new();
    for value in values {
        match value.to_str() {
            Ok(text) => elements.extend(text.split(',').map(|element| read(element.trim()))),
            Err(_) => elements.push(None),
        }
    }
    (!elements.is_empty()).then_some(elements)
}

/// Returns the address in the parameter `for` of an element of `Forwarded`.
fn forwarded_for(element: &str) -> Option<IpAddr> {
    let pairs = element.split(';').filter_map(|pair| pair.split_once('='));
    let mut nodes = pairs.filter(|(name, _)| name.trim().eq_ignore_ascii_case("for"));
    node(nodes.next()?.1.trim().trim_matches('"'))
}

/// Parses an address with or without a port; an IPv6 address with a port is in brackets.
fn node(text: &str) -> Option<IpAddr> {
    let bracketed = text.strip_prefix('[').and_then(|rest| rest.split_once(']'));
    let address = match bracketed {
        Some((address, _)) => address.parse().ok(),
        None => text.parse().ok().or_else(|| {
            let (address, _port) = text.split_once(':')?;
            address.parse().ok()
        }),
    };
    address.map(|address: IpAddr| address.to_canonical())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(peer: &str, headers: &[(&str, &str)]) -> String {
        let trusted = ["10.0.0.0/8", "fd00::/8"].map(|range| range.parse().unwrap());
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name: HeaderName = name.parse().unwrap();
            map.append(name, value.parse().unwrap());
        }
        client_of(peer.parse().unwrap(), &map, &trusted).to_string()
    }

    #[test]
    fn only_trusted_proxies_name_their_clients() {
        let told = [("x-forwarded-for", "198.51.100.1")];
        assert_eq!(client("10.1.2.3", &told), "198.51.100.1");
        assert_eq!(client("::ffff:10.1.2.3", &told), "198.51.100.1");
        assert_eq!(client("fd00::7", &told), "198.51.100.1");
        assert_eq!(client("192.0.2.1", &told), "192.0.2.1");
        assert_eq!(client("10.1.2.3", &[]), "10.1.2.3");
    }

    #[test]
    fn what_a_client_wrote_itself_is_not_believed() {
        let one = [("x-forwarded-for", "203.0.113.9, 198.51.100.1, 10.9.9.9")];
        assert_eq!(client("10.1.2.3", &one), "198.51.100.1");
        let lines = [
            ("x-forwarded-for", "203.0.113.9"),
            ("x-forwarded-for", "198.51.100.1"),
        ];
        assert_eq!(client("10.1.2.3", &lines), "198.51.100.1");
        let both = [
            ("forwarded", "for=203.0.113.9"),
            ("x-forwarded-for", "198.51.100.1"),
        ];
        assert_eq!(client("10.1.2.3", &both), "10.1.2.3");
        let unread = [("x-forwarded-for", "203.0.113.9, unknown, 10.9.9.9")];
        assert_eq!(client("10.1.2.3", &unread), "10.9.9.9");
    }

    #[test]
    fn both_headers_are_read_in_every_spelling() {
        for (name, value, address) in [
            (
                "forwarded",
                "For=\"[2001:db8::1]:4711\";proto=https",
                "2001:db8::1",
            ),
            (
                "forwarded",
                "proto=http; for=198.51.100.1:99",
                "198.51.100.1",
            ),
            (
                "forwarded",
                "for=203.0.113.9, for=198.51.100.1",
                "198.51.100.1",
            ),
            ("forwarded", "for=_hidden", "10.1.2.3"),
            ("forwarded", "by=10.0.0.1", "10.1.2.3"),
            ("x-forwarded-for", "2001:db8::1", "2001:db8::1"),
            ("x-forwarded-for", "[2001:db8::1]:80", "2001:db8::1"),
            ("x-forwarded-for", "198.51.100.1:80", "198.51.100.1"),
            ("x-forwarded-for", "", "10.1.2.3"),
        ] {
            assert_eq!(client("10.1.2.3", &[(name, value)]), address, "{value}");
        }
    }
}
