//! How solver time and the room for batches are shared: flags of `serve`.

use std::time::Duration;

use clap::Args;

use crate::cli::values::positive;
use crate::jobs::Options;
use crate::jobs::staged_bytes::StagingBounds;

/// Settings of workers and of batches that are being received.
#[derive(Debug, Clone, Args)]
pub(super) struct WorkerArgs {
    /// Most solver seconds of a case: for those that name no `time_limit_s`, and the most that one may name.
    #[arg(long, env = "RAILHEAD_TIME_LIMIT_S", default_value_t = 86_400, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub time_limit_s: u32,
    /// Seconds after which the jobs of a worker that shows no sign of life are given to another; it shows one three times
    /// as often.
    #[arg(long, env = "RAILHEAD_LEASE_S", default_value_t = 30, value_name = "SECONDS",
          value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub lease_s: u32,
    /// Solver seconds after which a solve makes room for others that wait.
    #[arg(long, env = "RAILHEAD_SLICE_S", default_value = "2", value_name = "SECONDS", value_parser = positive)]
    pub slice_s: f64,
    /// Solver threads that do not stop when they are told to, beyond which the process ends with code 75, to be started again.
    #[arg(
        long,
        env = "RAILHEAD_ABANDONED_MAX",
        default_value_t = 3,
        value_name = "N"
    )]
    pub abandoned_max: u16,
    /// Most MB that batches being received stand for, a row of a table counted with its template.
    #[arg(
        long,
        env = "RAILHEAD_STAGED_MB",
        default_value_t = 16_384,
        value_name = "MB"
    )]
    pub staged_mb: u32,
    /// The same of one tenant.
    #[arg(
        long,
        env = "RAILHEAD_TENANT_STAGED_MB",
        default_value_t = 4096,
        value_name = "MB"
    )]
    pub tenant_staged_mb: u32,
    /// Size in MB of the cases, templates and results that one tenant may have stored; further submissions get 507 [default: any size].
    #[arg(long, env = "RAILHEAD_TENANT_STORED_MB", value_name = "MB")]
    pub tenant_stored_mb: Option<u32>,
}

impl WorkerArgs {
    /// The options with these settings.
    #[must_use]
    pub(super) fn apply(&self, options: Options) -> Options {
        let bytes = |mb: u32| u64::from(mb) << 20;
        Options {
            lease: Duration::from_secs(self.lease_s.into()),
            time_limit: Duration::from_secs(self.time_limit_s.into()),
            slice: Duration::from_secs_f64(self.slice_s),
            abandoned_max: self.abandoned_max.into(),
            staging: StagingBounds {
                all: bytes(self.staged_mb),
                tenant: bytes(self.tenant_staged_mb),
            },
            tenant_stored_max_bytes: self.tenant_stored_mb.map(bytes),
            ..options
        }
    }
}
