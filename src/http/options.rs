//! What requests and connections may cost, and who may send them.

use std::net::IpAddr;
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

use crate::jobs::runtime_probe::USUAL_LIMIT;

/// The limits of a service; every one is a flag of `serve`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HttpOptions {
    /// Largest body of one case in bytes.
    pub body_max_bytes: usize,
    /// Time for the first head on a new connection to arrive.
    pub first_head_timeout: Duration,
    /// Time for the next request's head to arrive on a connection, idle time included.
    pub head_timeout: Duration,
    /// Time for the body of a case to arrive whole; for a larger body, time between two pieces, and the head start over its lowest rate.
    pub body_timeout: Duration,
    /// Time in which a client must take a piece of its answer.
    pub write_timeout: Duration,
    /// Most open connections. A further one replaces the connection that has waited longest for a request.
    pub connections_max: usize,
    /// Most open connections of one address (IPv6: of one network of 64 bits), loopback included.
    pub address_connections_max: usize,
    /// Most requests of one tenant under way, streams of events and waits aside.
    pub tenant_requests_max: usize,
    /// Most streams of events.
    pub streams_max: usize,
    /// Most streams of events of one tenant.
    pub tenant_streams_max: usize,
    /// Most requests that wait for the end of a job or a batch.
    pub waits_max: usize,
    /// The same of one tenant.
    pub tenant_waits_max: usize,
    /// Memory in bytes that bodies, parsed cases and answers of all requests may take.
    pub memory_max_bytes: usize,
    /// The same for one tenant.
    pub tenant_memory_max_bytes: usize,
    /// Estimated memory of one parsed case in bytes.
    pub parsed_max_bytes: usize,
    /// How long a case is solved to find out how long it takes; 0: not at all.
    pub check_trial: Duration,
    /// Pictures, grids and tables that are made at the same time, large grids apart.
    pub renderings: usize,
    /// Requests that wait for one of these; of one tenant half as many.
    pub renderings_waiting_max: usize,
    /// Most samples of a regular grid.
    pub grid_max_samples: usize,
    /// Largest body of a batch in bytes.
    pub batch_max_bytes: u64,
    /// Most cases of a batch.
    pub batch_max_cases: u32,
    /// Largest body of rows in bytes.
    pub evaluate_max_bytes: usize,
    /// Most rows of a body.
    pub evaluate_max_rows: usize,
    /// Time in which the solver must answer the rows of an evaluation.
    pub evaluate_time: Duration,
    /// Largest body of a run in bytes.
    pub run_max_bytes: u64,
    /// Most rows of a run.
    pub run_max_rows: u64,
    /// Computing time that reading one table, or evaluating its rows, may take.
    pub table_time: Duration,
    /// Requests without a key are answered, as those of a tenant of their own.
    pub anonymous: bool,
    /// The same for those that came through a proxy.
    pub anonymous_proxied: bool,
    /// Addresses of proxies that are believed when they name the addresses of their clients.
    pub trusted_proxies: Arc<[AddressRange]>,
    /// Names of the service for requests without a key, besides addresses and `localhost`.
    pub allowed_hosts: Arc<[String]>,
    /// Origins of web pages that may read answers and change things.
    pub origins: Arc<[String]>,
    /// Requests per second of one key, or of one address without a key; 0 for any number.
    pub requests_per_second: u32,
    /// Folder that the files of the page are read from, while it is worked on; none: those in the program.
    pub page_dir: Option<Arc<Path>>,
}

impl Default for HttpOptions {
    fn default() -> Self {
        HttpOptions {
            body_max_bytes: 8 << 20,
            first_head_timeout: Duration::from_secs(10),
            // Longer than the usual proxies keep an idle connection, so that they close it first.
            head_timeout: Duration::from_secs(75),
            body_timeout: Duration::from_secs(60),
            write_timeout: Duration::from_secs(60),
            connections_max: 4096,
            address_connections_max: 1024,
            tenant_requests_max: 512,
            streams_max: 1024,
            tenant_streams_max: 256,
            waits_max: 1024,
            tenant_waits_max: 256,
            memory_max_bytes: 512 << 20,
            tenant_memory_max_bytes: 256 << 20,
            parsed_max_bytes: 96 << 20,
            check_trial: USUAL_LIMIT,
            renderings: std::thread::available_parallelism()
                .map_or(1, |cores| (cores.get() / 2).max(1)),
            renderings_waiting_max: 512,
            grid_max_samples: 250_000,
            batch_max_bytes: 1 << 30,
            batch_max_cases: 200_000,
            evaluate_max_bytes: 64 << 20,
            evaluate_max_rows: 1_000_000,
            evaluate_time: Duration::from_secs(10),
            run_max_bytes: 1 << 30,
            run_max_rows: 10_000_000,
            // Ten times what the largest usual table takes on a slow core; a judgement.
            table_time: Duration::from_secs(300),
            anonymous: true,
            anonymous_proxied: false,
            trusted_proxies: Arc::default(),
            allowed_hosts: Arc::default(),
            origins: Arc::default(),
            requests_per_second: 0,
            page_dir: None,
        }
    }
}

/// Addresses that begin with the same bits, written as `10.0.0.0/8`; an address alone is a range by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddressRange {
    first: IpAddr,
    bits: u32,
}

impl AddressRange {
    /// Is this one of the addresses? IPv4 addresses written as IPv6 ones count as IPv4.
    #[must_use]
    pub fn contains(&self, address: IpAddr) -> bool {
        match (self.first, address.to_canonical()) {
            (IpAddr::V4(first), IpAddr::V4(address)) => {
                let differs = first.to_bits() ^ address.to_bits();
                differs.leading_zeros() >= self.bits
            }
            (IpAddr::V6(first), IpAddr::V6(address)) => {
                let differs = first.to_bits() ^ address.to_bits();
                differs.leading_zeros() >= self.bits
            }
            _ => false,
        }
    }
}

impl FromStr for AddressRange {
    type Err = String;

    fn from_str(text: &str) -> Result<AddressRange, String> {
        let (address, bits) = match text.split_once('/') {
            Some((address, bits)) => (address, Some(bits)),
            None => (text, None),
        };
        let read = || {
            let first = address.parse::<IpAddr>().ok()?.to_canonical();
            let most = if first.is_ipv4() { 32 } else { 128 };
            let bits = match bits {
                Some(bits) => bits.parse().ok().filter(|bits| *bits <= most)?,
                None => most,
            };
            Some(AddressRange { first, bits })
        };
        read().ok_or_else(|| {
            "allowed is an address or a range of addresses, such as `10.0.0.0/8`, `192.0.2.7` or `fd00::/8`; names are not looked up"
                .to_owned()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_holds_the_addresses_that_begin_with_its_bits() {
        let holds = |range: &str, address: &str| {
            let range: AddressRange = range.parse().unwrap();
            range.contains(address.parse().unwrap())
        };
        for (range, inside, outside) in [
            ("10.0.0.0/8", "10.255.0.1", "11.0.0.0"),
            ("10.0.0.0/8", "::ffff:10.0.0.1", "::10.0.0.1"),
            ("192.0.2.7", "192.0.2.7", "192.0.2.6"),
            ("192.0.2.128/25", "192.0.2.200", "192.0.2.127"),
            ("0.0.0.0/0", "203.0.113.1", "2001:db8::1"),
            ("2001:db8::/32", "2001:db8:ffff::1", "2001:db9::1"),
            ("::1", "::1", "127.0.0.1"),
        ] {
            assert!(holds(range, inside), "{range} {inside}");
            assert!(!holds(range, outside), "{range} {outside}");
        }
        for wrong in [
            "",
            "10.0.0.0/33",
            "fd00::/129",
            "proxy.example",
            "10.0.0.0/",
            "10.0.0.0/-1",
        ] {
            assert!(wrong.parse::<AddressRange>().is_err(), "{wrong:?}");
        }
    }
}
