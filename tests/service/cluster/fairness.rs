//! Tests that tenants get equal shares of two nodes that do not exchange notifications or scheduler state, whatever the duration of their jobs.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use railhead::contact::error::SolveError;
use railhead::jobs::engine::Engine;
use railhead::jobs::options::{Database, NotifyMode};
use railhead::jobs::{Jobs, Options};
use sqlx::{Connection, PgConnection};

use crate::cluster::postgres::schema;
use crate::support::{case, pause};

/// Timeout of a test that hangs.
const WITHIN: Duration = Duration::from_secs(120);

/// Name, duration of a job in ms, and number of jobs of each tenant. The number exceeds the tenant's share.
const TENANTS: [(&str, u64, i32); 3] = [("a", 2, 2500), ("b", 20, 250), ("c", 200, 30)];

/// The total solver time in µs at which the comparison of shares begins and ends. The mean is compared, because long jobs arrive one by one.
const LOOKED_AT: (u64, u64) = (4_000_000, 9_000_000);

/// The largest allowed deviation from an equal share. With equal numbers of jobs the shares would be 0.03, 0.27 and 2.7.
const SHARE_TOLERANCE: f64 = 0.25;

/// Copies the submitted job of a tenant, with its expected cost.
const MULTIPLY: &str = "WITH ids AS MATERIALIZED (SELECT CAST(gen_random_uuid() AS text) AS id FROM generate_series(1, $2)), \
     more AS (INSERT INTO jobs SELECT (jsonb_populate_record(jobs, jsonb_build_object('id', ids.id, 'cost_us', $3, 'slice_us', $3))).* \
     FROM jobs, ids WHERE tenant = $1) \
     INSERT INTO cases SELECT (jsonb_populate_record(cases, jsonb_build_object('job_id', ids.id))).* FROM jobs \
     JOIN cases ON cases.job_id = jobs.id, ids WHERE tenant = $1";

/// Starts a node with one worker that sleeps for the duration of a job and adds it to `spent`. It solves nothing.
async fn node(url: &str, folder: &Path, spent: Arc<[AtomicU64; 3]>) -> Jobs {
    let options = Options {
        database: Some(Database {
            url: url.to_owned(),
            connections: 4,
            notify_mode: NotifyMode::Off,
        }),
        cache: false,
        ..Options::new(folder)
    };
    let engine = Engine::contact().solving(move |checked, _| {
        let name = checked.label.name.as_deref();
        let tenant = TENANTS.iter().position(|tenant| Some(tenant.0) == name);
        let tenant = tenant.expect("a tenant");
        let since = Instant::now();
        std::thread::sleep(Duration::from_millis(TENANTS[tenant].1));
        // On a busy machine a sleep takes longer. The actual time counts.
        let taken = u64::try_from(since.elapsed().as_micros()).expect("a number");
        spent[tenant].fetch_add(taken, Ordering::Relaxed);
        Err(SolveError::Unmeshable {
            strips: 1,
            patch: 0,
        })
    });
    Jobs::open_with(options, engine).await.unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn tenants_share_two_nodes_equally_with_jobs_of_1_10_and_100_times_the_length() {
    let url = or_skip!(schema().await);
    let spent: Arc<[AtomicU64; 3]> = Arc::default();
    let folders = [0, 1].map(|_| tempfile::tempdir().unwrap());
    let one = node(&url, folders[0].path(), spent.clone()).await;
    let other = node(&url, folders[1].path(), spent.clone()).await;
    let mut table = PgConnection::connect(&url).await.unwrap();
    for (tenant, ms, jobs) in TENANTS {
        one.of(tenant.into())
            .submit(case(tenant), None)
            .await
            .unwrap();
        let multiplied = sqlx::query(MULTIPLY)
            .bind(tenant)
            .bind(jobs)
            .bind(i64::try_from(ms * 1000).unwrap());
        multiplied.execute(&mut table).await.unwrap();
    }
    one.start().unwrap();
    other.start().unwrap();
    let since = Instant::now();
    let (mut looks, mut sums) = (0.0, [0.0; 3]);
    loop {
        assert!(since.elapsed() < WITHIN, "{spent:?}");
        pause().await;
        #[expect(clippy::cast_precision_loss, reason = "seconds")]
        let each = [0, 1, 2].map(|tenant| spent[tenant].load(Ordering::Relaxed) as f64);
        let all: f64 = each.iter().sum();
        #[expect(clippy::cast_precision_loss, reason = "seconds")]
        let (from, to) = (LOOKED_AT.0 as f64, LOOKED_AT.1 as f64);
        if all >= from {
            looks += 1.0;
            (0..3).for_each(|tenant| sums[tenant] += each[tenant] / all);
        }
        if all >= to {
            break;
        }
    }
    for (share, tenant) in sums.iter().zip(TENANTS) {
        let of_its_own = 3.0 * share / looks;
        assert!(
            (of_its_own - 1.0).abs() < SHARE_TOLERANCE,
            "{}: {of_its_own:.2} of an equal share, {spent:?}",
            tenant.0
        );
    }
    one.shutdown(Duration::ZERO).await;
    other.shutdown(Duration::ZERO).await;
}
