//! What requests and connections may cost, and who may send them.

use std::net::IpAddr;
use std::ops::RangeBounds;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, value_parser};

use crate::jobs::options::{defaults, mib, seconds};

/// The limits of a service; nearly every one is a flag of `serve`, declared here.
#[derive(Debug, Clone, Args)]
pub struct HttpOptions {
    /// Maximum number of open connections. A further one replaces the connection that has waited longest for a request. Lowered
    /// if the process may not open so many files.
    #[arg(long, env = "RAILHEAD_CONNECTIONS_MAX", default_value = "4096", value_name = "N", value_parser = count(1..))]
    pub connections_max: usize,
    /// The same for the connections of one address (IPv6: of one network of 64 bits), loopback included.
    #[arg(long, env = "RAILHEAD_ADDRESS_CONNECTIONS_MAX", default_value = "1024", value_name = "N", value_parser = count(1..))]
    pub address_connections_max: usize,
    /// Requests of one tenant under way, streams of events and waits aside; beyond: 429.
    #[arg(long, env = "RAILHEAD_TENANT_REQUESTS_MAX", default_value = "512", value_name = "N", value_parser = count(1..))]
    pub tenant_requests_max: usize,
    /// Streams of events open in all; beyond: 429.
    #[arg(long, env = "RAILHEAD_STREAMS_MAX", default_value = "1024", value_name = "N", value_parser = count(..))]
    pub streams_max: usize,
    /// Streams of events of one tenant; beyond: 429.
    #[arg(long, env = "RAILHEAD_TENANT_STREAMS_MAX", default_value = "256", value_name = "N", value_parser = count(..))]
    pub tenant_streams_max: usize,
    /// Requests that wait for the end of a job or a batch; beyond, a job is answered without waiting, a batch by 429.
    #[arg(long, env = "RAILHEAD_WAITS_MAX", default_value = "1024", value_name = "N", value_parser = count(..))]
    pub waits_max: usize,
    /// The same of one tenant.
    #[arg(long, env = "RAILHEAD_TENANT_WAITS_MAX", default_value = "256", value_name = "N", value_parser = count(..))]
    pub tenant_waits_max: usize,
    /// Seconds for the head of the first request on a connection.
    #[arg(long = "first-head-timeout-s", env = "RAILHEAD_FIRST_HEAD_TIMEOUT_S", default_value = "10", value_name = "SECONDS", value_parser = seconds(1..))]
    pub first_head_timeout: Duration,
    /// Seconds for the head of each further request, idle time included.
    // By default longer than the usual proxies keep an idle connection, so that they close it first.
    #[arg(long = "head-timeout-s", env = "RAILHEAD_HEAD_TIMEOUT_S", default_value = "75", value_name = "SECONDS", value_parser = seconds(1..))]
    pub head_timeout: Duration,
    /// Seconds for the body of a case, or between two pieces of that of a batch, a run or an evaluation.
    #[arg(long = "body-timeout-s", env = "RAILHEAD_BODY_TIMEOUT_S", default_value = "60", value_name = "SECONDS", value_parser = seconds(1..))]
    pub body_timeout: Duration,
    /// Seconds in which a client must take a piece of its answer.
    #[arg(long = "write-timeout-s", env = "RAILHEAD_WRITE_TIMEOUT_S", default_value = "60", value_name = "SECONDS", value_parser = seconds(1..))]
    pub write_timeout: Duration,
    /// Memory in MiB that bodies, parsed cases and answers of all requests may take; further ones wait or get 503.
    #[arg(long = "request-memory-mb", env = "RAILHEAD_REQUEST_MEMORY_MB", default_value = "512", value_name = "MIB", value_parser = memory(64..=1 << 20))]
    pub memory_max_bytes: usize,
    /// The part of it that one tenant may take.
    #[arg(long = "tenant-request-memory-mb", env = "RAILHEAD_TENANT_REQUEST_MEMORY_MB", default_value = "256", value_name = "MIB", value_parser = memory(64..=1 << 20))]
    pub tenant_memory_max_bytes: usize,
    /// Memory in MiB that one case may take once it is parsed; beyond: 413.
    #[arg(long = "parsed-case-max-mb", env = "RAILHEAD_PARSED_CASE_MAX_MB", default_value = "96", value_name = "MIB", value_parser = memory(1..=1 << 20))]
    pub parsed_max_bytes: usize,
    /// Body of one case in MiB, or of one case of a batch; beyond: 413.
    #[arg(long = "body-max-mib", env = "RAILHEAD_BODY_MAX_MIB", default_value = "8", value_name = "MIB", value_parser = memory(1..=1024))]
    pub body_max_bytes: usize,
    /// Body of one batch in MiB; beyond: 413.
    #[arg(long = "batch-max-mib", env = "RAILHEAD_BATCH_MAX_MIB", default_value = "1024", value_name = "MIB", value_parser = mib(1..=65536))]
    pub batch_max_bytes: u64,
    /// Cases of one batch; beyond: 413.
    #[arg(long, env = "RAILHEAD_BATCH_MAX_CASES", default_value = "200000", value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub batch_max_cases: u32,
    /// Milliseconds for which `/v1/cases/check` solves a case to find out how long it takes; 0: it is told by formulas alone.
    #[arg(long = "check-trial-ms", env = "RAILHEAD_CHECK_TRIAL_MS", default_value = "200", value_name = "MS", value_parser = milliseconds(..=10_000))]
    pub check_trial: Duration,
    /// Pictures, grids and tables made at the same time [default: half of the cores, at least 1].
    #[arg(long, env = "RAILHEAD_RENDERINGS", default_value_t = half_of_the_cores(), hide_default_value = true, value_name = "N",
          value_parser = value_parser!(u16).range(1..).map(usize::from))]
    pub renderings: usize,
    /// Requests that wait for their turn at that, half as many of one tenant; beyond: 503.
    #[arg(long, env = "RAILHEAD_RENDERINGS_WAITING_MAX", default_value = "512", value_name = "N", value_parser = count(2..))]
    pub renderings_waiting_max: usize,
    /// Samples of a regular grid (`?grid=NXxNY`); beyond: 400.
    #[arg(long, env = "RAILHEAD_GRID_MAX_SAMPLES", default_value = "250000", value_name = "N", value_parser = count(4..=1_000_000))]
    pub grid_max_samples: usize,
    /// Body of `POST /v1/evaluate` in MiB; beyond: 413.
    #[arg(long = "evaluate-max-mib", env = "RAILHEAD_EVALUATE_MAX_MIB", default_value = "64", value_name = "MIB", value_parser = memory(1..=1024))]
    pub evaluate_max_bytes: usize,
    /// Rows of one such body; beyond: 422.
    #[arg(long, env = "RAILHEAD_EVALUATE_MAX_ROWS", default_value = "1000000", value_name = "N", value_parser = count(1..))]
    pub evaluate_max_rows: usize,
    /// Body of `POST /v1/runs` in MiB; beyond: 413.
    #[arg(long = "run-max-mib", env = "RAILHEAD_RUN_MAX_MIB", default_value = "1024", value_name = "MIB", value_parser = mib(1..=65536))]
    pub run_max_bytes: u64,
    /// Rows of one run; beyond: 413.
    #[arg(long, env = "RAILHEAD_RUN_MAX_ROWS", default_value = "10000000", value_name = "N", value_parser = value_parser!(u64).range(1..=1_000_000_000))]
    pub run_max_rows: u64,
    /// Computing seconds that the reading of one batch, run or table, or the evaluation of its rows, may take; beyond: 413.
    // The default is ten times what the largest usual table takes on a slow core; a judgement.
    #[arg(long = "table-time-s", env = "RAILHEAD_TABLE_TIME_S", default_value = "300", value_name = "SECONDS", value_parser = seconds(1..))]
    pub table_time: Duration,
    /// Seconds in which the solver must answer the rows of one evaluation; beyond: 422.
    #[arg(long = "evaluate-time-s", env = "RAILHEAD_EVALUATE_TIME_S", default_value = "10", value_name = "SECONDS", value_parser = seconds(1..))]
    pub evaluate_time: Duration,
    /// Folder that the files of the page at `/` are read from for each request, for those who change it.
    #[arg(long, env = "RAILHEAD_PAGE_DIR", value_name = "FOLDER", hide = true,
          value_parser = PathBufValueParser::new().map(|path: PathBuf| Arc::<Path>::from(path)))]
    pub page_dir: Option<Arc<Path>>,
    /// Addresses of proxies that are believed when they name the addresses of their clients.
    #[arg(skip)]
    pub trusted_proxies: Arc<[AddressRange]>,
    /// Names of the service for requests without a key, besides addresses and `localhost`.
    #[arg(skip)]
    pub allowed_hosts: Arc<[String]>,
    /// Origins of web pages that may read answers and change things.
    #[arg(skip)]
    pub origins: Arc<[String]>,
    /// Requests without a key are answered, as those of a tenant of their own.
    #[arg(skip = true)]
    pub anonymous: bool,
    /// Requests without a key that came through a proxy are answered too.
    #[arg(skip)]
    pub anonymous_proxied: bool,
    /// Requests per second of one key, or of one address without a key; 0 for any number.
    #[arg(skip)]
    pub requests_per_second: u32,
}

impl Default for HttpOptions {
    fn default() -> Self {
        defaults()
    }
}

fn half_of_the_cores() -> usize {
    available_parallelism().map_or(1, |cores| (cores.get() / 2).max(1))
}

fn count(allowed: impl RangeBounds<i64>) -> impl TypedValueParser<Value = usize> {
    let number = value_parser!(u32).range(allowed);
    number.map(|number| number as usize)
}

fn memory(allowed: impl RangeBounds<i64>) -> impl TypedValueParser<Value = usize> {
    mib(allowed).map(|bytes| bytes as usize)
}

fn milliseconds(allowed: impl RangeBounds<i64>) -> impl TypedValueParser<Value = Duration> {
    let number = value_parser!(u32).range(allowed);
    number.map(|number| Duration::from_millis(number.into()))
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
    use clap::{Command, FromArgMatches};

    use super::*;
    use crate::jobs::runtime_probe::USUAL_LIMIT;

    #[test]
    fn sizes_and_times_are_read_in_the_units_of_their_flags() {
        let flags = [
            "",
            "--body-max-mib=3",
            "--batch-max-mib=3",
            "--batch-max-cases=3",
            "--table-time-s=3",
        ];
        let mut command = HttpOptions::augment_args(Command::new(""));
        let given =
            HttpOptions::from_arg_matches(&command.try_get_matches_from_mut(flags).unwrap())
                .unwrap();
        assert_eq!(
            (given.body_max_bytes, given.batch_max_bytes),
            (3 << 20, 3 << 20)
        );
        assert_eq!(
            (given.batch_max_cases, given.table_time),
            (3, Duration::from_secs(3))
        );
        assert_eq!(HttpOptions::default().check_trial, USUAL_LIMIT);
        assert!(HttpOptions::default().anonymous);
    }

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
