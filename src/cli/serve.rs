//! The HTTP API with local workers: start and stop order.
//!
//! Start: logs, data folder (locked, migrated, jobs of a dead process taken back), workers, listener. The event
//! `listening` with the bound address says that requests are answered.
//!
//! Stop, on SIGTERM or SIGINT: not ready and nobody waits any more; no new connections; open requests end; running jobs
//! get their grace period, then go back to the queue uncounted; the data folder is closed; the last spans are sent. A
//! second signal ends the process at once, which loses nothing either: the next start takes the running jobs back.

use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use tokio::net::TcpListener;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::{Instant, timeout};
use tokio_util::sync::CancellationToken;

use crate::cli::{Anonymous, ServeArgs};
use crate::http::{self, HttpOptions};
use crate::jobs::trace::Tracer;
use crate::jobs::{Jobs, Options};
use crate::telemetry::{self, Traces};

/// How long open requests may take to end once the service stops.
const REQUESTS_END_WITHIN: Duration = Duration::from_secs(5);
const REQUEST_THREADS_MIN: usize = 4;
/// Exit code of a process that was told to stop twice, as shells count a SIGINT.
const STOPPED_AT_ONCE: i32 = 130;

/// Serves until a signal says stop.
pub(super) fn run(args: &ServeArgs) -> anyhow::Result<ExitCode> {
    telemetry::start(args.log.log_format, &args.log.log)?;
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(request_threads())
        .enable_all()
        .thread_name("railhead-async")
        .build()
        .context("the async runtime could not be started")?
        .block_on(serve(args))?;
    Ok(ExitCode::SUCCESS)
}

/// Threads for requests: one per core, but not so few that one which writes a log line keeps the others waiting.
fn request_threads() -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    cores.max(REQUEST_THREADS_MIN)
}

async fn serve(args: &ServeArgs) -> anyhow::Result<()> {
    let mut signals = Signals::listen()?;
    let workers = args.worker_count();
    let traces = args.otlp_endpoint.as_ref().map(Traces::start).transpose()?;
    let jobs = Jobs::open(Options {
        workers,
        limits: args.case.limits(),
        attempts_max: args.attempts_max,
        queue_max: args.queue_max,
        cache: args.cache,
        retention: args.retention.0,
        tenant_queue_max: args.tenant_queue_max,
        tracer: traces.as_ref().map(|traces| Tracer::new(traces.tracer())),
        ..Options::new(&args.data_dir)
    })
    .await?;
    let listener = TcpListener::bind(args.listen)
        .await
        .with_context(|| format!("cannot listen on {}", args.listen))?;
    let address = listener.local_addr()?;
    let anonymous = match args.anonymous {
        Anonymous::Loopback => address.ip().is_loopback(),
        Anonymous::Always => true,
        Anonymous::Never => false,
    };
    if !anonymous && !jobs.any_key().await? {
        jobs.shutdown(Duration::ZERO).await;
        bail!(
            "nobody could use a service on {address}: there is no API key, and requests without one are only answered \
             on loopback; make a key with `railhead keys create --tenant NAME --data-dir {}`, or let everybody in who \
             reaches the port with `--anonymous always`",
            args.data_dir.display()
        );
    }
    jobs.start()?;
    tracing::info!(%address, workers, data_dir = %args.data_dir.display(), "listening");
    if anonymous && !address.ip().is_loopback() {
        tracing::warn!(%address, "whoever reaches this address may use the service without a key");
    }

    let stop = CancellationToken::new();
    let options = HttpOptions {
        anonymous,
        requests_per_second: args.rate_limit,
        ..HttpOptions::default()
    };
    let origins = args.cors_origin.iter().map(|origin| origin.parse());
    let origins = origins.collect::<Result<_, _>>().context("--cors-origin")?;
    let router = http::allow_origins(http::router(jobs.clone(), options), origins);
    let mut server = tokio::spawn(http::serve(listener, router, options, stop.clone()));

    let name = tokio::select! {
        name = signals.next() => name,
        ended = &mut server => {
            // The listener never ends by itself; if it does the jobs are still handed back.
            jobs.shutdown(args.shutdown_grace()).await;
            return ended.context("the listener failed");
        }
    };
    tracing::info!(signal = name, "stopping");
    tokio::spawn(async move {
        let name = signals.next().await;
        tracing::warn!(signal = name, "stopping at once");
        std::process::exit(STOPPED_AT_ONCE);
    });
    let start = Instant::now();
    jobs.drain();
    stop.cancel();
    // Requests first, for they need the job table; running jobs go on meanwhile.
    match timeout(REQUESTS_END_WITHIN, &mut server).await {
        Ok(ended) => ended.context("the listener failed")?,
        Err(_) => {
            tracing::warn!("some requests did not end and are cut off");
            server.abort();
        }
    }
    jobs.shutdown(args.shutdown_grace().saturating_sub(start.elapsed()))
        .await;
    if let Some(traces) = traces {
        traces.stop().await;
    }
    tracing::info!("stopped");
    Ok(())
}

/// The signals that stop a service.
struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    fn listen() -> anyhow::Result<Signals> {
        Ok(Signals {
            terminate: signal(SignalKind::terminate()).context("SIGTERM cannot be received")?,
            interrupt: signal(SignalKind::interrupt()).context("SIGINT cannot be received")?,
        })
    }

    async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }
}
