//! Limits of requests and connections, and who may send them.

use std::net::IpAddr;
use std::ops::RangeBounds;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use std::thread::available_parallelism;
use std::time::Duration;

use clap::builder::{PathBufValueParser, TypedValueParser};
use clap::{Args, value_parser};
use ipnet::IpNet;

use railhead_jobs::options::{defaults, mib, seconds};

/// The limits of a service. Nearly all of them are flags of `serve`.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Requests")]
pub struct HttpOptions {
    /// Maximum number of open connections. A further one replaces the connection that has waited longest for a request. The number is
    /// lowered if the process may not open so many files.
    #[arg(long, default_value = "4096", value_name = "N", value_parser = count(1..))]
    pub connections_max: usize,
    /// Maximum number of open connections of one address, loopback included. For IPv6, the addresses of a /64 network count together.
    #[arg(long, default_value = "1024", value_name = "N", value_parser = count(1..))]
    pub address_connections_max: usize,
    /// Maximum number of concurrent requests of one tenant, except event streams and waits; beyond it: 429.
    #[arg(long, default_value = "512", value_name = "N", value_parser = count(1..))]
    pub tenant_requests_max: usize,
    /// Maximum number of open event streams; beyond it: 429.
    #[arg(long, default_value = "1024", value_name = "N", value_parser = count(..))]
    pub streams_max: usize,
    /// Maximum number of open event streams of one tenant; beyond it: 429.
    #[arg(long, default_value = "256", value_name = "N", value_parser = count(..))]
    pub tenant_streams_max: usize,
    /// Maximum number of requests that wait for the end of a job or a batch. Beyond it, a request for a job is answered without
    /// waiting, and one for a batch with 429.
    #[arg(long, default_value = "1024", value_name = "N", value_parser = count(..))]
    pub waits_max: usize,
    /// Maximum number of waiting requests of one tenant; beyond it, as for `--waits-max`.
    #[arg(long, default_value = "256", value_name = "N", value_parser = count(..))]
    pub tenant_waits_max: usize,
    /// Seconds within which the head of the first request on a connection must arrive.
    #[arg(long = "first-head-timeout-s", default_value = "10", value_name = "SECONDS", value_parser = seconds(1..))]
    pub first_head_timeout: Duration,
    /// Seconds within which the head of each further request must arrive, including idle time.
    // The default is longer than common proxies keep an idle connection, so that the proxy closes it.
    #[arg(long = "head-timeout-s", default_value = "75", value_name = "SECONDS", value_parser = seconds(1..))]
    pub head_timeout: Duration,
    /// Seconds within which the body of a case must arrive. For a batch, a run or an evaluation: maximum time between two parts of the
    /// body.
    #[arg(long = "body-timeout-s", default_value = "60", value_name = "SECONDS", value_parser = seconds(1..))]
    pub body_timeout: Duration,
    /// Seconds within which a client must read each part of a response.
    #[arg(long = "write-timeout-s", default_value = "60", value_name = "SECONDS", value_parser = seconds(1..))]
    pub write_timeout: Duration,
    /// Maximum memory in MiB for bodies, parsed cases and responses of all requests; beyond it, requests wait or get 503.
    #[arg(long = "request-memory-mb", default_value = "512", value_name = "MIB", value_parser = memory(64..=1 << 20))]
    pub memory_max_bytes: usize,
    /// Maximum memory in MiB for bodies, parsed cases and responses of the requests of one tenant.
    #[arg(long = "tenant-request-memory-mb", default_value = "256", value_name = "MIB", value_parser = memory(64..=1 << 20))]
    pub tenant_memory_max_bytes: usize,
    /// Maximum memory in MiB of one parsed case; beyond it: 413.
    #[arg(long = "parsed-case-max-mb", default_value = "96", value_name = "MIB", value_parser = memory(1..=1 << 20))]
    pub parsed_max_bytes: usize,
    /// Maximum size in MiB of the body of one case, or of one case in a batch; beyond it: 413.
    #[arg(long = "body-max-mib", default_value = "8", value_name = "MIB", value_parser = memory(1..=1024))]
    pub body_max_bytes: usize,
    /// Maximum size in MiB of the body of a batch; beyond it: 413.
    #[arg(long = "batch-max-mib", default_value = "1024", value_name = "MIB", value_parser = mib(1..=65536))]
    pub batch_max_bytes: u64,
    /// Maximum number of cases in a batch; beyond it: 413.
    #[arg(long, default_value = "200000", value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub batch_max_cases: u32,
    /// Milliseconds for which `/v1/cases/check` solves a case to estimate its solve time; 0: formulas alone give the estimate.
    #[arg(long = "check-trial-ms", default_value = "200", value_name = "MS", value_parser = milliseconds(..=10_000))]
    pub check_trial: Duration,
    /// Number of pictures, grids and tables rendered at the same time [default: half of the cores, at least 1].
    #[arg(long, default_value_t = half_of_the_cores(), hide_default_value = true, value_name = "N",
          value_parser = value_parser!(u16).range(1..).map(usize::from))]
    pub renderings: usize,
    /// Maximum number of requests that wait to be rendered, half as many for one tenant; beyond it: 503.
    #[arg(long, default_value = "512", value_name = "N", value_parser = count(2..))]
    pub renderings_waiting_max: usize,
    /// Maximum number of samples of a regular grid (`?grid=NXxNY`); beyond it: 400.
    #[arg(long, default_value = "250000", value_name = "N", value_parser = count(4..=1_000_000))]
    pub grid_max_samples: usize,
    /// Maximum size in MiB of the body of `POST /v1/evaluate`; beyond it: 413.
    #[arg(long = "evaluate-max-mib", default_value = "64", value_name = "MIB", value_parser = memory(1..=1024))]
    pub evaluate_max_bytes: usize,
    /// Maximum number of rows of `POST /v1/evaluate`; beyond it: 422.
    #[arg(long, default_value = "1000000", value_name = "N", value_parser = count(1..))]
    pub evaluate_max_rows: usize,
    /// Maximum size in MiB of the body of `POST /v1/runs`; beyond it: 413.
    #[arg(long = "run-max-mib", default_value = "1024", value_name = "MIB", value_parser = mib(1..=65536))]
    pub run_max_bytes: u64,
    /// Maximum number of rows of a run; beyond it: 413.
    #[arg(long, default_value = "10000000", value_name = "N", value_parser = value_parser!(u64).range(1..=1_000_000_000))]
    pub run_max_rows: u64,
    /// Maximum processor time in seconds for reading a batch, run or table, or for evaluating its rows; beyond it: 413.
    // The default is ten times what the largest usual table takes on a slow core; a judgement.
    #[arg(long = "table-time-s", default_value = "300", value_name = "SECONDS", value_parser = seconds(1..))]
    pub table_time: Duration,
    /// Maximum solver time in seconds for the rows of one evaluation; beyond it: 422.
    #[arg(long = "evaluate-time-s", default_value = "10", value_name = "SECONDS", value_parser = seconds(1..))]
    pub evaluate_time: Duration,
    /// Folder from which the files of the page at `/` are read for each request, for development of the page.
    #[arg(long, value_name = "FOLDER", hide = true,
          value_parser = PathBufValueParser::new().map(|path: PathBuf| Arc::<Path>::from(path)))]
    pub page_dir: Option<Arc<Path>>,
    /// Addresses of proxies whose headers with the addresses of their clients are trusted.
    #[arg(skip)]
    pub trusted_proxies: Arc<[AddressRange]>,
    /// Names of the service that are allowed in requests without a key, besides addresses and `localhost`.
    #[arg(skip)]
    pub allowed_hosts: Arc<[String]>,
    /// Origins of web pages that may read responses and send changes.
    #[arg(skip)]
    pub origins: Arc<[String]>,
    /// Whether requests without a key are answered, as those of the tenant `anonymous`.
    #[arg(skip = true)]
    pub anonymous: bool,
    /// Whether requests without a key that came through a proxy are answered too.
    #[arg(skip)]
    pub anonymous_proxied: bool,
    /// Requests per second of one key, or of one address without a key; 0: no limit.
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

/// A range of addresses with the same leading bits, written as `10.0.0.0/8`; a single address is a range too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddressRange(IpNet);

impl AddressRange {
    /// Whether the range contains an address. An IPv4-mapped IPv6 address counts as IPv4.
    #[must_use]
    pub fn contains(&self, address: IpAddr) -> bool {
        self.0.contains(&address.to_canonical())
    }
}

impl FromStr for AddressRange {
    type Err = String;

    fn from_str(text: &str) -> Result<AddressRange, String> {
        let address = || {
            text.parse()
                .map(|address: IpAddr| address.to_canonical().into())
        };
        let range = text.parse().or_else(|_| address());
        range.map(AddressRange).map_err(|_| {
            "allowed is an address or a range of addresses, such as `10.0.0.0/8`, `192.0.2.7` or `fd00::/8`; names are not looked up"
                .to_owned()
        })
    }
}

#[cfg(test)]
mod tests {
    use clap::{Command, FromArgMatches};

    use super::*;
    use railhead_jobs::runtime_probe::USUAL_LIMIT;

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
