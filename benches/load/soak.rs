//! Submits many small jobs one by one, which are removed some seconds after their end, and checks that memory, files and the job table stay in
//! proportion to the stored jobs.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use crate::Row;
use crate::cases::meshed;
use crate::client::Client;
use crate::mixed::memory;
use crate::service::{Service, Usage};

const CLIENTS: usize = 64;
/// Number of jobs before the observed ones, which fill the bounded caches.
const BEFORE: usize = 40_000;
/// Retention of ended jobs.
const KEPT: &str = "5s";
const SAMPLE: Duration = Duration::from_millis(500);
/// Maximum time of the end, and of the removal of the last jobs.
const ENDS_WITHIN: Duration = Duration::from_secs(60);

/// Runs the soak test and returns its figures.
pub async fn run(workers: usize, jobs: usize) -> Vec<Row> {
    let service = Service::start(workers, &["--retention", KEPT]);
    let before = service.usage();
    let (watched, jobs) = (jobs, BEFORE + jobs);
    let start = Instant::now();
    let next = Arc::new(AtomicUsize::new(0));
    let clients: Vec<_> = (0..CLIENTS)
        .map(|_| tokio::spawn(submit_all(service.url.clone(), next.clone(), jobs)))
        .collect();
    let mut samples = Vec::new();
    let mut watch = Client::new(&service.url);
    let mut kept_max = 0.0_f64;
    let mut ended = 0.0;
    while ended < jobs as f64 {
        assert!(
            start.elapsed() < 4 * ENDS_WITHIN,
            "{ended} of {jobs} jobs have ended"
        );
        tokio::time::sleep(SAMPLE).await;
        ended = jobs_ended(&mut watch, "succeeded").await;
        kept_max = kept_max.max(kept(&mut watch).await);
        if ended >= BEFORE as f64 {
            samples.push(service.usage());
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    for client in clients {
        client.await.expect("a client without errors");
    }
    let after = emptied(&service, &mut watch).await;
    let largest = |of: fn(&Usage) -> f64| samples.iter().map(of).fold(0.0, f64::max);
    let failed = jobs_ended(&mut watch, "failed").await;
    let ended_all = (ended, failed) == (jobs as f64, 0.0);
    assert!(
        ended_all,
        "of {jobs} jobs {ended} succeeded, {failed} failed"
    );
    vec![
        Row::plain(
            "soak: small jobs submitted one by one, all ended",
            format!("{jobs} in {seconds:.0} s, {:.0}/s", jobs as f64 / seconds),
        ),
        memory(
            &format!("soak: memory at 25, 50, 75, 100 % of the last {watched} jobs"),
            &samples,
        ),
        Row::plain(
            "soak: jobs kept at most; data folder before, at most, after all were removed",
            format!(
                "{kept_max:.0}; {:.1}, {:.1}, {:.1} MB",
                before.stored_mb,
                largest(|usage| usage.stored_mb),
                after.stored_mb
            ),
        ),
        Row::judged(
            "soak: files before, at most, after; descriptors at most, after",
            format!(
                "{}, {:.0}, {}; {:.0}, {}",
                before.files,
                largest(|usage| usage.files as f64),
                after.files,
                largest(|usage| usage.descriptors as f64),
                after.descriptors
            ),
            "bounded",
            largest(|usage| usage.files as f64) <= 10.0 && after.descriptors < 2 * CLIENTS,
        ),
    ]
}

/// Returns the number of jobs that have ended in this state.
async fn jobs_ended(watch: &mut Client, state: &str) -> f64 {
    let metric = format!("railhead_jobs_ended_total{{state=\"{state}\"}}");
    watch.metric(&metric).await
}

/// Waits until the last jobs have expired, and returns the usage of the service.
async fn emptied(service: &Service, watch: &mut Client) -> Usage {
    let last = Instant::now();
    while kept(watch).await > 0.0 {
        assert!(last.elapsed() < ENDS_WITHIN, "expired jobs are removed");
        tokio::time::sleep(SAMPLE).await;
    }
    // The log of the table and its free pages are released in portions.
    let mut after = service.usage();
    while after.stored_mb > 90.0 && last.elapsed() < ENDS_WITHIN {
        tokio::time::sleep(SAMPLE).await;
        after = service.usage();
    }
    after
}

/// Returns the number of jobs in the table, in any state.
async fn kept(watch: &mut Client) -> f64 {
    let mut kept = 0.0;
    for state in ["queued", "running", "succeeded", "failed", "cancelled"] {
        kept += watch
            .metric(&format!("railhead_jobs{{state=\"{state}\"}}"))
            .await;
    }
    kept
}

async fn submit_all(url: String, next: Arc<AtomicUsize>, jobs: usize) {
    let mut client = Client::new(&url);
    loop {
        let number = next.fetch_add(1, Ordering::Relaxed);
        if number >= jobs {
            return;
        }
        client.submit(&meshed(number, 4), None).await;
    }
}
