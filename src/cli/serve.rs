//! `railhead serve` and `railhead worker`: start and stop of a service.
use std::net::SocketAddr;
use std::process::{ExitCode, exit};
use std::thread::available_parallelism;
use std::time::Duration;

use anyhow::{Context, bail};
use axum::http::HeaderValue;
use tokio::net::TcpListener;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep_until, timeout_at};
use tokio_util::sync::CancellationToken;

use crate::cli::commands::{Anonymous, ServeArgs, unknown_variables};
use crate::http::{self, HttpOptions};
use crate::jobs::attempts::attempt;
use crate::jobs::engine::Engine;
use crate::jobs::{Jobs, Options};
use crate::otlp::Traces;
use crate::telemetry;

/// Runs a future to its end on this thread.
pub(super) fn block_on<T>(work: impl Future<Output = T>) -> anyhow::Result<T> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .context("the async runtime could not be started")?;
    Ok(runtime.block_on(work))
}

/// Minimum and maximum time for open requests to end after the port is closed.
const REQUESTS_END_WITHIN: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(5)];
/// Additional time of the steps after the grace period.
const BEYOND_GRACE: Duration = Duration::from_secs(5);
/// Minimum time of the steps after the port is closed.
const BEYOND_DRAIN: Duration = Duration::from_secs(3);
/// Time of the last step, the exit.
const LAST_STEP: Duration = Duration::from_millis(500);
/// Exit code of a process that was stopped twice, which shells use for SIGINT.
const STOPPED_AT_ONCE: i32 = 130;

/// The times at which the steps of a stop end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Schedule {
    /// Time at which the port closes.
    pub port_closes: Instant,
    /// Time at which open requests are aborted.
    pub requests_end: Instant,
    /// Time at which running jobs return to the queue.
    pub grace_ends: Instant,
    /// Time limit of closing the data folder.
    pub folder_closed: Instant,
    last_moment: Instant,
}

impl Schedule {
    /// The schedule of a stop that begins now.
    pub(super) fn new(drain: Duration, grace: Duration) -> Schedule {
        let now = Instant::now();
        let [least, most] = REQUESTS_END_WITHIN;
        let last_moment = now + (grace + BEYOND_GRACE).max(drain + BEYOND_DRAIN);
        let folder_closed = last_moment - LAST_STEP;
        Schedule {
            port_closes: now + drain,
            requests_end: (now + drain + grace.clamp(least, most)).min(folder_closed - LAST_STEP),
            grace_ends: now + grace,
            folder_closed,
            last_moment,
        }
    }

    /// Ends the process with this exit code at the last moment, from a thread outside the async runtime.
    pub(super) fn enforce(self, code: u8) {
        let enforced = std::thread::Builder::new().name("railhead-stop".to_owned());
        let enforced = enforced.spawn(move || {
            std::thread::sleep(self.last_moment.saturating_duration_since(Instant::now()));
            exit(code.into());
        });
        if let Err(error) = enforced {
            tracing::warn!(%error, "the time of the stop is not limited");
        }
    }
}

/// The signals that stop a service.
pub(super) struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    pub(super) fn listen() -> anyhow::Result<Signals> {
        Ok(Signals {
            terminate: signal(SignalKind::terminate()).context("SIGTERM cannot be received")?,
            interrupt: signal(SignalKind::interrupt()).context("SIGINT cannot be received")?,
        })
    }

    /// Waits for the next signal and returns its name.
    pub(super) async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }

    /// Ends the process at the next signal.
    pub(super) fn end_at_next(mut self) {
        tokio::spawn(async move {
            let name = self.next().await;
            tracing::warn!(signal = name, "stopping at once");
            exit(STOPPED_AT_ONCE);
        });
    }
}

/// Minimum number of request threads, so that a blocked one does not delay all others; otherwise there is one per core.
const REQUEST_THREADS_MIN: usize = 4;
/// Number of files that the process opens besides connections: job table, results, logs.
const OTHER_FILES: u64 = 256;
/// Exit code of a process that has to be restarted (EX_TEMPFAIL).
const START_AGAIN: u8 = 75;
/// Maximum number of connections of the listener for probes.
const PROBE_CONNECTIONS: usize = 64;

/// The role of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Answers requests, and solves if it has workers.
    Serve,
    /// Solves the jobs that other nodes accept, and answers probes.
    Work,
}

impl Role {
    /// Rejects settings that do not fit the role.
    fn require(self, args: &ServeArgs) -> anyhow::Result<()> {
        let shared = args.database.database_url.is_some();
        match self {
            Role::Work if !shared => {
                bail!("`railhead worker` needs the --database-url of the nodes that accept jobs")
            }
            Role::Work if args.worker_count() == 0 => {
                bail!(
                    "`railhead worker` needs at least one worker; --workers 0 is for `railhead serve`"
                )
            }
            Role::Serve if !shared && args.worker_count() == 0 => {
                bail!(
                    "--workers 0 requires a --database-url, because other nodes must solve the jobs"
                )
            }
            _ => Ok(()),
        }
    }
}

/// Serves until a signal arrives.
pub(super) fn run(args: &ServeArgs, role: Role) -> anyhow::Result<ExitCode> {
    attempt::bound_heap();
    let log = telemetry::start(args.log.log_format, &args.log.log)?;
    for name in unknown_variables() {
        tracing::warn!(
            name,
            "this variable is not known; `railhead config` lists the known ones"
        );
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(
            available_parallelism()
                .map_or(1, usize::from)
                .max(REQUEST_THREADS_MIN),
        )
        .enable_all()
        .thread_name("railhead-async")
        .build()
        .context("the async runtime could not be started")?;
    let served = runtime.block_on(serve(args, role));
    // The data folder is closed; remaining computations belong to requests that were aborted.
    runtime.shutdown_background();
    // Writes the last log lines.
    drop(log);
    served
}

/// Refuses names that no request can have in `Host`.
fn require_host_names(names: &[String]) -> anyhow::Result<()> {
    let is_plain = |of: char| of.is_ascii_alphanumeric() || "-._".contains(of);
    let strange = |name: &&String| name.is_empty() || !name.chars().all(is_plain);
    match names.iter().find(strange) {
        Some(name) => bail!(
            "--allowed-host: `{name}` is not a host name; give it without scheme, port and blanks"
        ),
        None => Ok(()),
    }
}

/// Starts a service, waits for a signal, and stops it.
async fn serve(args: &ServeArgs, role: Role) -> anyhow::Result<ExitCode> {
    role.require(args)?;
    require_host_names(&args.allowed_host)?;
    let mut signals = Signals::listen()?;
    let traces = args.otlp_endpoint.as_ref().map(Traces::start).transpose()?;
    let jobs = open_jobs(args, traces.as_ref()).await?;
    let listener = bind(args.listen).await?;
    let address = listener.local_addr()?;
    let anonymous = args.anonymous.on(address);
    if role == Role::Serve && !anonymous && !jobs.any_key().await? {
        jobs.shutdown(Duration::ZERO).await;
        let answered = match args.anonymous {
            Anonymous::Never => "not answered (`--anonymous never`)",
            Anonymous::Loopback | Anonymous::Always => "only answered on loopback",
        };
        bail!(
            "no client could use a service on {address}: there is no API key, and requests without one are {answered}; \
             create a key with `railhead keys create --tenant NAME --data-dir {}`, or answer everyone who can reach the port \
             with `--anonymous always`",
            args.jobs.data_dir.display()
        );
    }
    jobs.start()?;
    let stop = CancellationToken::new();
    let mut server = start_listening(args, role, &jobs, listener, anonymous, stop.clone()).await?;
    if role == Role::Serve && anonymous && !address.ip().is_loopback() {
        tracing::warn!(%address, "everyone who can reach this address can use the service without a key");
    }
    let loopback = anonymous && args.anonymous == Anonymous::Loopback;
    if role == Role::Serve && loopback && jobs.any_key().await? {
        // A proxy that adds no header about its client looks like a client of this machine.
        tracing::warn!(
            "there are keys, and requests from this machine need none; behind a proxy use `--anonymous never`"
        );
    }
    let workers = args.worker_count();
    tracing::info!(%address, workers, data_dir = %args.jobs.data_dir.display(), "listening");

    let name = tokio::select! {
        name = signals.next() => name,
        () = jobs.broken().cancelled() => "too many solver threads that do not stop",
        ended = &mut server => {
            // The listener never ends by itself; if it fails, the jobs still return to the queue.
            jobs.shutdown(args.shutdown_grace).await;
            ended.context("the listener failed")?;
            return Ok(ExitCode::SUCCESS);
        }
    };
    tracing::info!(signal = name, "stopping");
    let schedule = Schedule::new(args.drain_delay(name), args.shutdown_grace);
    let code = exit_code(&jobs);
    schedule.enforce(code);
    signals.end_at_next();
    stop_service(&jobs, schedule, stop, server).await?;
    if let Some(traces) = traces {
        traces.stop().await;
    }
    tracing::info!("stopped");
    Ok(ExitCode::from(code.max(exit_code(&jobs))))
}

/// The exit code of a service that stops now.
fn exit_code(jobs: &Jobs) -> u8 {
    match jobs.broken().is_cancelled() {
        true => START_AGAIN,
        false => 0,
    }
}

/// Opens the data folder.
async fn open_jobs(args: &ServeArgs, traces: Option<&Traces>) -> anyhow::Result<Jobs> {
    let options = Options {
        workers: args.worker_count(),
        limits: args.case.limits(),
        tracer: traces.map(Traces::tracer),
        database: args.database.database(),
        results: args.database.results.place(),
        ..args.jobs.clone()
    };
    let recipe = Engine::with_operators(args.case.operators());
    Ok(Jobs::open_with(options, recipe).await?)
}

async fn bind(address: SocketAddr) -> anyhow::Result<TcpListener> {
    let listener = TcpListener::bind(address).await;
    listener.with_context(|| format!("cannot listen on {address}"))
}

/// Answers requests until `stop` is cancelled. A separate listener for probes runs until the process ends.
async fn start_listening(
    args: &ServeArgs,
    role: Role,
    jobs: &Jobs,
    listener: TcpListener,
    anonymous: bool,
    stop: CancellationToken,
) -> anyhow::Result<JoinHandle<()>> {
    let (options, origins) = http_options(args, anonymous)?;
    let probe_listener = match args.probe_listen {
        Some(address) => Some(bind(address).await?),
        None => None,
    };
    let probe_address = probe_listener.as_ref().map(TcpListener::local_addr);
    let probe_address = probe_address.transpose()?;
    let probes_anonymous = match role {
        Role::Serve => probe_address.is_some_and(|address| args.anonymous.on(address)),
        // On both addresses a worker node answers probes only.
        Role::Work => anonymous && probe_address.is_none_or(|address| args.anonymous.on(address)),
    };
    let [router, probes] = http::routers(
        jobs.clone(),
        options.clone(),
        probes_anonymous,
        telemetry::dropped_lines,
    );
    let router = match role {
        Role::Serve => http::allow_origins(router, origins),
        Role::Work => probes.clone(),
    };
    if let (Some(listener), Some(address)) = (probe_listener, probe_address) {
        tracing::info!(%address, "listening for probes");
        let few = HttpOptions {
            connections_max: PROBE_CONNECTIONS,
            address_connections_max: PROBE_CONNECTIONS,
            ..options.clone()
        };
        tokio::spawn(http::serve(listener, probes, few, CancellationToken::new()));
    }
    Ok(tokio::spawn(http::serve(listener, router, options, stop)))
}

/// Stops step by step: not ready, port closed, requests ended, jobs returned, data folder closed.
async fn stop_service(
    jobs: &Jobs,
    schedule: Schedule,
    stop: CancellationToken,
    mut server: JoinHandle<()>,
) -> anyhow::Result<()> {
    jobs.drain();
    sleep_until(schedule.port_closes).await;
    stop.cancel();
    // Requests end first, because they need the job table; running jobs continue in the meantime.
    match timeout_at(schedule.requests_end, &mut server).await {
        Ok(ended) => ended.context("the listener failed")?,
        Err(_) => {
            tracing::warn!("some requests did not end and are cut off");
            server.abort();
        }
    }
    let grace = schedule
        .grace_ends
        .saturating_duration_since(Instant::now());
    let closed = timeout_at(schedule.folder_closed, jobs.shutdown(grace)).await;
    if closed.is_err() {
        tracing::warn!(
            "the data folder could not be closed in time; the next start returns the running jobs to the queue"
        );
    }
    Ok(())
}

/// The options of the HTTP server, and the allowed origins.
fn http_options(
    args: &ServeArgs,
    anonymous: bool,
) -> anyhow::Result<(HttpOptions, Vec<HeaderValue>)> {
    let origins = args.cors_origin.iter().map(|origin| origin.parse());
    let origins = origins.collect::<Result<_, _>>().context("--cors-origin")?;
    let mut options = HttpOptions {
        anonymous,
        anonymous_proxied: args.anonymous == Anonymous::Always,
        origins: args.cors_origin.as_slice().into(),
        requests_per_second: args.rate_limit,
        trusted_proxies: args.trusted_proxies.as_slice().into(),
        allowed_hosts: args.allowed_host.as_slice().into(),
        ..args.http.clone()
    };
    // Each connection is an open file. The soft limit is often lower than the hard limit.
    match rlimit::increase_nofile_limit(u64::MAX) {
        Ok(files) => {
            let most =
                usize::try_from(files.saturating_sub(OTHER_FILES).max(1)).unwrap_or(usize::MAX);
            if most < options.connections_max {
                tracing::warn!(
                    files,
                    connections = most,
                    "the process may open few files, so the number of connections is lower than configured"
                );
                options.connections_max = most;
            }
        }
        Err(error) => tracing::warn!(%error, "the number of files that may be open is not known"),
    }
    Ok((options, origins))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_ends_five_seconds_after_the_grace_period_or_three_after_the_drain() {
        let seconds = Duration::from_secs;
        for (drain, grace, last) in [(0, 0, 5), (2, 0, 5), (2, 10, 15), (30, 10, 33)] {
            let schedule = Schedule::new(seconds(drain), seconds(grace));
            let begun = schedule.port_closes.checked_sub(seconds(drain)).unwrap();
            assert_eq!(
                schedule.last_moment - begun,
                seconds(last),
                "{drain} {grace}"
            );
            assert!(schedule.port_closes < schedule.requests_end);
            assert!(schedule.requests_end < schedule.last_moment);
            assert!(schedule.grace_ends < schedule.folder_closed);
        }
    }
}
