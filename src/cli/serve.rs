//! `railhead serve`: the HTTP API with workers in the same process; the order of start and stop.
//!
//! Start: logs, data folder (locked, jobs of a dead process taken back), workers, listener. The event
//! `listening` with the bound address says that requests are answered.
//!
//! Stop, on SIGTERM or SIGINT: not ready and nobody waits any more, connections are still accepted for
//! `--drain-delay-s` (SIGTERM only); no new connections; open requests end; running jobs get their grace period, then go
//! back to the queue uncounted; the data folder is closed; the last spans are sent. A second signal ends the process at
//! once, which loses nothing either: the next start takes the running jobs back.

use std::net::SocketAddr;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use axum::http::HeaderValue;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio::time::{Instant, sleep_until, timeout_at};
use tokio_util::sync::CancellationToken;

use crate::cli::commands::unknown_variables;
use crate::cli::serve_args::ServeArgs;
use crate::cli::stop::{Schedule, Signals};
use crate::cli::values::Anonymous;
use crate::http::{self, HttpOptions};
use crate::jobs::attempts::heap;
use crate::jobs::engine::Engine;
use crate::jobs::{Jobs, Options};
use crate::otlp::Traces;
use crate::telemetry;

const REQUEST_THREADS_MIN: usize = 4;
/// Files that the process opens besides connections: job table, results, logs.
const OTHER_FILES: u64 = 256;
/// Exit code of a process that ends because it has to be restarted (EX_TEMPFAIL).
const START_AGAIN: u8 = 75;
/// Most connections of the listener for probes.
const PROBE_CONNECTIONS: usize = 64;

/// What a process is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// It answers requests, and solves if it has workers.
    Serve,
    /// It solves what other nodes accept, and answers probes.
    Work,
}

impl Role {
    /// Refuses settings that make no sense for it.
    fn require(self, args: &ServeArgs) -> anyhow::Result<()> {
        let shared = args.database.database_url.is_some();
        match self {
            Role::Work if !shared => {
                bail!("`railhead worker` needs the --database-url of the nodes that accept jobs")
            }
            Role::Work if args.worker_count() == 0 => {
                bail!("--workers 0 leaves `railhead worker` nothing to do")
            }
            Role::Serve if !shared && args.worker_count() == 0 => {
                bail!(
                    "--workers 0 needs a --database-url, where other nodes find the jobs to solve them"
                )
            }
            _ => Ok(()),
        }
    }
}

/// Serves until a signal says stop.
pub(super) fn run(args: &ServeArgs, role: Role) -> anyhow::Result<ExitCode> {
    heap::bound_heap();
    let log = telemetry::start(args.log.log_format, &args.log.log)?;
    for name in unknown_variables() {
        tracing::warn!(
            name,
            "this variable is not known; `railhead config` lists those that are"
        );
    }
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(request_threads())
        .enable_all()
        .thread_name("railhead-async")
        .build()
        .context("the async runtime could not be started")?;
    let served = runtime.block_on(serve(args, role));
    // The data folder is closed; computations that still run are for clients that have been cut off.
    runtime.shutdown_background();
    // Writes the last log lines.
    drop(log);
    served
}

/// Threads for requests: one per core, but at least four, so that a blocked one does not hold up all others.
fn request_threads() -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    cores.max(REQUEST_THREADS_MIN)
}

/// Starts a service, waits until it is to stop, and stops it.
async fn serve(args: &ServeArgs, role: Role) -> anyhow::Result<ExitCode> {
    role.require(args)?;
    let mut signals = Signals::listen()?;
    let traces = args.otlp_endpoint.as_ref().map(Traces::start).transpose()?;
    let jobs = open_jobs(args, traces.as_ref()).await?;
    let listener = bind(args.listen).await?;
    let address = listener.local_addr()?;
    let anonymous = args.anonymous.on(address);
    if role == Role::Serve && !anonymous && !jobs.any_key().await? {
        jobs.shutdown(Duration::ZERO).await;
        bail!(
            "nobody could use a service on {address}: there is no API key, and requests without one are only answered \
             on loopback; make a key with `railhead keys create --tenant NAME --data-dir {}`, or let everybody in who \
             reaches the port with `--anonymous always`",
            args.data_dir.display()
        );
    }
    jobs.start()?;
    let stop = CancellationToken::new();
    let mut server = start_listening(args, role, &jobs, listener, anonymous, stop.clone()).await?;
    if role == Role::Serve && anonymous && !address.ip().is_loopback() {
        tracing::warn!(%address, "whoever reaches this address may use the service without a key");
    }
    let loopback = anonymous && args.anonymous == Anonymous::Loopback;
    if role == Role::Serve && loopback && jobs.any_key().await? {
        // A proxy that adds no header about its client looks like a client of this machine.
        tracing::warn!(
            "there are keys, and requests from this machine need none; behind a proxy use `--anonymous never`"
        );
    }
    let workers = args.worker_count();
    tracing::info!(%address, workers, data_dir = %args.data_dir.display(), "listening");

    let name = tokio::select! {
        name = signals.next() => name,
        () = jobs.broken().cancelled() => "too many solver threads that do not stop",
        ended = &mut server => {
            // The listener never ends by itself; if it does the jobs are still handed back.
            jobs.shutdown(args.shutdown_grace()).await;
            ended.context("the listener failed")?;
            return Ok(ExitCode::SUCCESS);
        }
    };
    tracing::info!(signal = name, "stopping");
    let schedule = Schedule::new(args.drain_delay(name), args.shutdown_grace());
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

/// How a service that stops now ends: in good order, or to be started again.
fn exit_code(jobs: &Jobs) -> u8 {
    match jobs.broken().is_cancelled() {
        true => START_AGAIN,
        false => 0,
    }
}

/// Opens the data folder with the settings of the workers.
async fn open_jobs(args: &ServeArgs, traces: Option<&Traces>) -> anyhow::Result<Jobs> {
    let options = Options {
        data_dir: args.data_dir.clone(),
        workers: args.worker_count(),
        limits: args.case.limits(),
        retention: args.retention.0,
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

/// Answers requests until `stop`. Probes with a port of their own are answered until the process ends.
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
        // They are all that it answers, on both addresses.
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

/// Stops step by step: not ready, port closed, requests ended, jobs handed back, data folder closed.
async fn stop_service(
    jobs: &Jobs,
    schedule: Schedule,
    stop: CancellationToken,
    mut server: JoinHandle<()>,
) -> anyhow::Result<()> {
    jobs.drain();
    sleep_until(schedule.port_closes).await;
    stop.cancel();
    // Requests first, for they need the job table; running jobs go on meanwhile.
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
            "the data folder could not be closed in time; the next start takes the running jobs back"
        );
    }
    Ok(())
}

/// The limits of requests and the origins of other pages.
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
    // A connection is a file. Many systems allow few at first and more to those who ask.
    match rlimit::increase_nofile_limit(u64::MAX) {
        Ok(files) => {
            let most =
                usize::try_from(files.saturating_sub(OTHER_FILES).max(1)).unwrap_or(usize::MAX);
            if most < options.connections_max {
                tracing::warn!(
                    files,
                    connections = most,
                    "the process may open few files, so fewer connections than asked for"
                );
                options.connections_max = most;
            }
        }
        Err(error) => tracing::warn!(%error, "the number of files that may be open is not known"),
    }
    Ok((options, origins))
}
