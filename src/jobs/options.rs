//! Options of the job service, most of which are flags of `serve`.

use std::fmt;
use std::ops::RangeBounds;
use std::path::PathBuf;
use std::time::Duration;

use clap::builder::TypedValueParser;
use clap::{ArgAction, Args, Command, value_parser};

use crate::clock::Clock;
use crate::result_place::url::ResultsPlace;
use crate::trace::Tracer;
use railhead_contact::case::solver::Limits;

pub use crate::store::NotifyMode;

/// A database that several processes share.
#[derive(Clone, PartialEq, Eq)]
pub struct Database {
    /// `postgres://user:password@host:port/database`.
    pub url: String,
    /// Maximum number of connections of this process, in addition to the one that receives notifications.
    pub connections: u32,
    /// Source of the notifications of other nodes.
    pub notify_mode: NotifyMode,
}

impl fmt::Debug for Database {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The URL contains a password.
        write!(f, "Database({} connections)", self.connections)
    }
}

/// Default data folder.
pub const DATA_DIR_DEFAULT: &str = "./railhead-data";

/// Options of the job service. Most of them are flags of `serve`, which are declared here.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Jobs")]
pub struct Options {
    /// Folder of the job table and the results; with a database, only of batches that are being received. It is created if it does not
    /// exist. Only one process can use it at a time.
    #[arg(long, help_heading = "Service", default_value = DATA_DIR_DEFAULT, value_name = "FOLDER")]
    pub data_dir: PathBuf,
    /// The database that stores jobs and results, if several processes share them; otherwise they are in the data folder.
    #[arg(skip)]
    pub database: Option<Database>,
    /// Location of large results, if neither the data folder nor the database.
    #[arg(skip)]
    pub results: Option<ResultsPlace>,
    /// Number of workers, each with its own solver thread.
    #[arg(skip = 1_usize)]
    pub workers: usize,
    /// Limits of one case.
    #[arg(skip)]
    pub limits: Limits,
    /// Number of attempts after which a job fails if its worker is lost each time.
    #[arg(long, default_value = "5", value_name = "N", value_parser = value_parser!(u32).range(1..))]
    pub attempts_max: u32,
    /// Maximum number of queued jobs; further jobs are refused.
    #[arg(long, default_value = "300000", value_name = "N", value_parser = value_parser!(u64).range(1..))]
    pub queue_max: u64,
    /// Maximum number of queued jobs of one tenant; further jobs are refused.
    #[arg(long, default_value = "250000", value_name = "N", value_parser = value_parser!(u64).range(1..))]
    pub tenant_queue_max: u64,
    /// Return the stored result for a case that is identical to one solved before, instead of solving it again.
    #[arg(long, default_value_t = true, value_name = "BOOL", action = ArgAction::Set)]
    pub cache: bool,
    /// Time for which ended jobs and their results are kept, such as `30d`, `30days` or `12h`; `forever`: until they are deleted.
    // The path keeps clap from taking the value for an optional one.
    #[arg(long, default_value = "forever", value_name = "TIME", value_parser = retention)]
    pub retention: std::option::Option<Duration>,
    /// Maximum size in MB of the stored profiles of one tenant; beyond it: 429.
    #[arg(long = "tenant-profiles-mb", default_value = "64", value_name = "MB", value_parser = mib(1..=65536))]
    pub tenant_profiles_max_bytes: u64,
    /// Maximum solver time of a case in seconds: the largest `time_limit_s`, and the limit of cases without it.
    #[arg(long = "time-limit-s", default_value = "86400", value_name = "SECONDS", value_parser = seconds(1..))]
    pub time_limit: Duration,
    /// Lease of a job in seconds. A worker renews it three times in this time; if it does not, another worker takes the job.
    #[arg(long = "lease-s", default_value = "30", value_name = "SECONDS", value_parser = seconds(1..=3600))]
    pub lease: Duration,
    /// Solver time in seconds after which a job yields to others that wait.
    #[arg(long = "slice-s", default_value = "2", value_name = "SECONDS", value_parser = part_of_a_day)]
    pub slice: Duration,
    /// Maximum number of solver threads that ignore a stop request. With more, the process ends with exit code 75 so that it can be
    /// restarted.
    #[arg(long, default_value = "3", value_name = "N", value_parser = value_parser!(u16).map(usize::from))]
    pub abandoned_max: usize,
    /// Bounds of the batches that are being received.
    #[command(flatten)]
    pub staging: StagingBounds,
    /// Maximum size in MB of the stored cases, templates and results of one tenant; beyond it: 507 [default: no limit].
    #[arg(long = "tenant-stored-mb", value_name = "MB", value_parser = mib(..))]
    pub tenant_stored_max_bytes: Option<u64>,
    /// Maximum number of small jobs that a worker claims together; 1: no groups.
    #[arg(skip = 256_usize)]
    pub group_max: usize,
    /// Maximum size in bytes of results in the database; larger ones are stored outside.
    #[arg(skip = 32_usize << 10)]
    pub small_result_max_bytes: usize,
    /// Clock of leases, job times and expiry.
    #[arg(skip = Clock::system())]
    pub clock: Clock,
    /// Records spans of jobs, if they are collected.
    #[arg(skip)]
    pub tracer: Option<Tracer>,
}

/// Bounds of the bytes of batches that are being received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Args)]
#[command(next_help_heading = "Jobs")]
pub struct StagingBounds {
    /// Maximum size in MB of all batches that are being received; a row of a table counts with its template.
    #[arg(id = "staged", long = "staged-mb", default_value = "16384", value_name = "MB", value_parser = mib(..))]
    pub all: u64,
    /// Maximum size in MB of the batches of one tenant that are being received.
    #[arg(id = "tenant_staged", long = "tenant-staged-mb", default_value = "4096", value_name = "MB", value_parser = mib(..))]
    pub tenant: u64,
}

impl Options {
    /// The default options for a data folder: defaults of the flags, one worker, no expiry, the system's clock, no spans.
    #[must_use]
    pub fn new(data_dir: impl Into<PathBuf>) -> Options {
        Options {
            data_dir: data_dir.into(),
            ..defaults()
        }
    }
}

/// The default values of flags.
///
/// # Panics
/// Panics if a flag has no default.
pub fn defaults<T: Args>() -> T {
    let mut command = T::augment_args(Command::new(""));
    let none = command
        .try_get_matches_from_mut([""])
        .expect("no flag is needed");
    T::from_arg_matches(&none).expect("every flag has a default")
}

/// Parses a number of MiB; the value is in bytes.
pub fn mib(allowed: impl RangeBounds<i64>) -> impl TypedValueParser<Value = u64> {
    let number = value_parser!(u32).range(allowed);
    number.map(|number| u64::from(number) << 20)
}

/// Parses a whole number of seconds.
pub fn seconds(allowed: impl RangeBounds<i64>) -> impl TypedValueParser<Value = Duration> {
    let number = value_parser!(u32).range(allowed);
    number.map(|number| Duration::from_secs(number.into()))
}

/// Parses a time such as `30d`, `1w` or `90m`, or `forever`.
fn retention(text: &str) -> Result<Option<Duration>, String> {
    if text == "forever" {
        return Ok(None);
    }
    let wrong =
        || "allowed are `forever` or a time of at least 1 s such as `12h`, `30d`, `8w`".to_owned();
    let span: jiff::Span = text.parse().map_err(|_| wrong())?;
    let days = jiff::SpanRelativeTo::days_are_24_hours();
    let seconds = span.total((jiff::Unit::Second, days));
    let time = seconds
        .ok()
        .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    time.filter(|time| time.as_secs() > 0)
        .map(Some)
        .ok_or_else(wrong)
}

/// Parses a time from 1 ms to one day, in seconds.
fn part_of_a_day(text: &str) -> Result<Duration, String> {
    match text.parse() {
        Ok(seconds) if (0.001..=86_400.0).contains(&seconds) => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err("a number of seconds from 0.001 to 86400".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_retention_is_a_time_with_its_unit_or_forever() {
        let days = |days: u64| Ok(Some(Duration::from_secs(days * 24 * 3600)));
        assert_eq!(retention("forever"), Ok(None));
        assert_eq!(retention("30d"), days(30));
        assert_eq!(retention("2w"), days(14));
        assert_eq!(retention("24h"), days(1));
        for wrong in ["", "30", "0s", "-1d", "1 month", "soon"] {
            assert!(retention(wrong).is_err(), "{wrong:?}");
        }
        assert_eq!(Options::new("folder").retention, None);
    }
}
