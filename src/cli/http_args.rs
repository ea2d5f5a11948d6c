//! The flags that limit what requests and connections may cost.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::cli::values::address;
use crate::http::{AddressRange, HttpOptions};

/// Limits of requests and connections.
#[derive(Debug, Clone, Args)]
pub(super) struct HttpArgs {
    /// Address and port of a second listener that answers `/healthz`, `/readyz` and `/metrics` only; without it they are
    /// answered on the first one alone, where a few places are kept for them.
    #[arg(long, env = "RAILHEAD_PROBE_LISTEN", value_name = "ADDRESS:PORT", value_parser = address)]
    pub probe_listen: Option<SocketAddr>,
    /// Maximum number of open connections. A further one replaces the connection that has waited longest for a request. Lowered
    /// if the process may not open so many files.
    #[arg(long, env = "RAILHEAD_CONNECTIONS_MAX", default_value_t = 4096, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub connections_max: u32,
    /// The same for the connections of one address (IPv6: of one network of 64 bits), loopback included.
    #[arg(long, env = "RAILHEAD_ADDRESS_CONNECTIONS_MAX", default_value_t = 1024, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub address_connections_max: u32,
    /// Requests of one tenant under way, streams of events and waits aside; beyond: 429.
    #[arg(long, env = "RAILHEAD_TENANT_REQUESTS_MAX", default_value_t = 512, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub tenant_requests_max: u32,
    /// Streams of events open in all; beyond: 429.
    #[arg(
        long,
        env = "RAILHEAD_STREAMS_MAX",
        default_value_t = 1024,
        value_name = "N"
    )]
    pub streams_max: u32,
    /// Streams of events of one tenant; beyond: 429.
    #[arg(
        long,
        env = "RAILHEAD_TENANT_STREAMS_MAX",
        default_value_t = 256,
        value_name = "N"
    )]
    pub tenant_streams_max: u32,
    /// Requests that wait for the end of a job or a batch; beyond, a job is answered without waiting, a batch by 429.
    #[arg(
        long,
        env = "RAILHEAD_WAITS_MAX",
        default_value_t = 1024,
        value_name = "N"
    )]
    pub waits_max: u32,
    /// The same of one tenant.
    #[arg(
        long,
        env = "RAILHEAD_TENANT_WAITS_MAX",
        default_value_t = 256,
        value_name = "N"
    )]
    pub tenant_waits_max: u32,
    /// Seconds for the head of the first request on a connection.
    #[arg(long, env = "RAILHEAD_FIRST_HEAD_TIMEOUT_S", default_value_t = 10, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub first_head_timeout_s: u32,
    /// Seconds for the head of each further request, idle time included.
    #[arg(long, env = "RAILHEAD_HEAD_TIMEOUT_S", default_value_t = 75, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub head_timeout_s: u32,
    /// Seconds for the body of a case, or between two pieces of that of a batch, a run or an evaluation.
    #[arg(long, env = "RAILHEAD_BODY_TIMEOUT_S", default_value_t = 60, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub body_timeout_s: u32,
    /// Seconds in which a client must take a piece of its answer.
    #[arg(long, env = "RAILHEAD_WRITE_TIMEOUT_S", default_value_t = 60, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub write_timeout_s: u32,
    /// Memory in MiB that bodies, parsed cases and answers of all requests may take; further ones wait or get 503.
    #[arg(long, env = "RAILHEAD_REQUEST_MEMORY_MB", default_value_t = 512, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(64..=1 << 20))]
    pub request_memory_mb: u32,
    /// The part of it that one tenant may take.
    #[arg(long, env = "RAILHEAD_TENANT_REQUEST_MEMORY_MB", default_value_t = 256, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(64..=1 << 20))]
    pub tenant_request_memory_mb: u32,
    /// Memory in MiB that one case may take once it is parsed; beyond: 413.
    #[arg(long, env = "RAILHEAD_PARSED_CASE_MAX_MB", default_value_t = 96, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub parsed_case_max_mb: u32,
    /// Body of one case in MiB, or of one case of a batch; beyond: 413.
    #[arg(long, env = "RAILHEAD_BODY_MAX_MIB", default_value_t = 8, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub body_max_mib: u32,
    /// Body of one batch in MiB; beyond: 413.
    #[arg(long, env = "RAILHEAD_BATCH_MAX_MIB", default_value_t = 1024, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub batch_max_mib: u32,
    /// Cases of one batch; beyond: 413.
    #[arg(long, env = "RAILHEAD_BATCH_MAX_CASES", default_value_t = 200_000, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub batch_max_cases: u32,
    /// Milliseconds for which `/v1/cases/check` solves a case to find out how long it takes; 0: it is told by formulas alone.
    #[arg(long, env = "RAILHEAD_CHECK_TRIAL_MS", default_value_t = 200, value_name = "MS",
          value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub check_trial_ms: u32,
    /// Pictures, grids and tables made at the same time [default: half of the cores, at least 1].
    #[arg(long, env = "RAILHEAD_RENDERINGS", value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub renderings: Option<u16>,
    /// Requests that wait for their turn at that, half as many of one tenant; beyond: 503.
    #[arg(long, env = "RAILHEAD_RENDERINGS_WAITING_MAX", default_value_t = 512, value_name = "N",
          value_parser = clap::value_parser!(u32).range(2..))]
    pub renderings_waiting_max: u32,
    /// Samples of a regular grid (`?grid=NXxNY`); beyond: 400.
    #[arg(long, env = "RAILHEAD_GRID_MAX_SAMPLES", default_value_t = 250_000, value_name = "N",
          value_parser = clap::value_parser!(u32).range(4..=1_000_000))]
    pub grid_max_samples: u32,
    /// Body of `POST /v1/evaluate` in MiB; beyond: 413.
    #[arg(long, env = "RAILHEAD_EVALUATE_MAX_MIB", default_value_t = 64, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub evaluate_max_mib: u32,
    /// Rows of one such body; beyond: 422.
    #[arg(long, env = "RAILHEAD_EVALUATE_MAX_ROWS", default_value_t = 1_000_000, value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub evaluate_max_rows: u32,
    /// Body of `POST /v1/runs` in MiB; beyond: 413.
    #[arg(long, env = "RAILHEAD_RUN_MAX_MIB", default_value_t = 1024, value_name = "MIB",
          value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub run_max_mib: u32,
    /// Rows of one run; beyond: 413.
    #[arg(long, env = "RAILHEAD_RUN_MAX_ROWS", default_value_t = 10_000_000, value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    pub run_max_rows: u64,
    /// Addresses of proxies, separated by commas, such as `10.0.0.0/8`, that are believed when they name the addresses of their clients
    /// in `Forwarded` or `X-Forwarded-For`. Wrong keys and requests without a key are then counted by these addresses, and
    /// `--address-connections-max` does not hold for the proxies.
    #[arg(
        long,
        env = "RAILHEAD_TRUSTED_PROXIES",
        value_delimiter = ',',
        value_name = "ADDRESSES"
    )]
    pub trusted_proxies: Vec<AddressRange>,
    /// Computing seconds that the reading of one batch, run or table, or the evaluation of its rows, may take; beyond: 413.
    #[arg(long, env = "RAILHEAD_TABLE_TIME_S", default_value_t = 300, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub table_time_s: u32,
    /// Seconds in which the solver must answer the rows of one evaluation; beyond: 422.
    #[arg(long, env = "RAILHEAD_EVALUATE_TIME_S", default_value_t = 10, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub evaluate_time_s: u32,
    /// Names of the service, separated by commas, by which it may be asked without a key; addresses and `localhost` always
    /// may. Others are refused, as a web page could make its own name lead here.
    #[arg(
        long,
        env = "RAILHEAD_ALLOWED_HOST",
        value_delimiter = ',',
        value_name = "NAME"
    )]
    pub allowed_host: Vec<String>,
    /// Folder that the files of the page at `/` are read from for each request, for those who change it.
    #[arg(long, env = "RAILHEAD_PAGE_DIR", value_name = "FOLDER", hide = true)]
    pub page_dir: Option<PathBuf>,
}

impl HttpArgs {
    /// The options that these flags stand for; what concerns access is left at its default.
    pub(super) fn options(&self) -> HttpOptions {
        let count = |number: u32| number as usize;
        let bytes = |mib: u32| (mib as usize) << 20;
        let seconds = |number: u32| Duration::from_secs(number.into());
        let default = HttpOptions::default();
        HttpOptions {
            first_head_timeout: seconds(self.first_head_timeout_s),
            head_timeout: seconds(self.head_timeout_s),
            body_timeout: seconds(self.body_timeout_s),
            write_timeout: seconds(self.write_timeout_s),
            connections_max: count(self.connections_max),
            address_connections_max: count(self.address_connections_max),
            tenant_requests_max: count(self.tenant_requests_max),
            streams_max: count(self.streams_max),
            tenant_streams_max: count(self.tenant_streams_max),
            waits_max: count(self.waits_max),
            tenant_waits_max: count(self.tenant_waits_max),
            memory_max_bytes: bytes(self.request_memory_mb),
            tenant_memory_max_bytes: bytes(self.tenant_request_memory_mb),
            parsed_max_bytes: bytes(self.parsed_case_max_mb),
            check_trial: Duration::from_millis(self.check_trial_ms.into()),
            renderings: self.renderings.map_or(default.renderings, usize::from),
            renderings_waiting_max: count(self.renderings_waiting_max),
            body_max_bytes: bytes(self.body_max_mib),
            batch_max_bytes: u64::from(self.batch_max_mib) << 20,
            batch_max_cases: self.batch_max_cases,
            grid_max_samples: count(self.grid_max_samples),
            evaluate_max_bytes: bytes(self.evaluate_max_mib),
            evaluate_max_rows: count(self.evaluate_max_rows),
            run_max_bytes: u64::from(self.run_max_mib) << 20,
            run_max_rows: self.run_max_rows,
            trusted_proxies: self.trusted_proxies.as_slice().into(),
            table_time: seconds(self.table_time_s),
            evaluate_time: seconds(self.evaluate_time_s),
            allowed_hosts: self.allowed_host.as_slice().into(),
            page_dir: self.page_dir.as_deref().map(Into::into),
            ..default
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Debug, Parser)]
    struct Only {
        #[command(flatten)]
        http: HttpArgs,
    }

    #[test]
    fn the_defaults_of_the_flags_are_those_of_the_options() {
        let given = Only::try_parse_from(["x"]).unwrap();
        assert_eq!(given.http.options(), HttpOptions::default());
    }

    #[test]
    fn sizes_of_bodies_and_batches_are_flags() {
        let flags = ["--body-max-mib", "--batch-max-mib", "--batch-max-cases"];
        let words = flags.iter().flat_map(|flag| [*flag, "3"]);
        let given = Only::try_parse_from(std::iter::once("x").chain(words)).unwrap();
        let options = given.http.options();
        assert_eq!(
            (
                options.body_max_bytes,
                options.batch_max_bytes,
                options.batch_max_cases
            ),
            (3 << 20, 3 << 20, 3)
        );
    }
}
