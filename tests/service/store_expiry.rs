//! Tests the removal of expired work with all its data.

use railhead::jobs::model::Kind;
use railhead::jobs::store::{Claim, NewBatch, NewJob, RetentionRule};

use crate::store::*;

conformance!(the_chunks_of_a_run_expire_together_with_the_last_of_them);

async fn end(table: &Table, claim: &Claim, now: i64) {
    let ends = [(claim.clone(), success())];
    assert_eq!(table.store.finish(&ends, now).await.unwrap().len(), 1);
}

/// Removes jobs that ended at this time or before. Returns their number.
async fn expire(table: &Table, ended_before: i64) -> u64 {
    let rule = RetentionRule {
        now: ended_before,
        ended_before,
        forget_before: 0,
        jobs: 100,
    };
    table.store.expire(rule).await.unwrap()
}

async fn the_chunks_of_a_run_expire_together_with_the_last_of_them(kind: StoreKind) {
    let table = Table::new(kind).await;
    let job = table.add(new_job()).await;
    let begun = job.created_at;
    let claim = table.claim(begun).await.unwrap();
    end(&table, &claim, begun + 1000).await;

    let run = NewBatch {
        kind: Kind::Rows,
        ..new_batch("anonymous", 3)
    };
    let chunk = || NewJob {
        kind: Kind::Rows,
        ..new_job()
    };
    begin(&*table.store, &run, [chunk(), chunk(), chunk()]).await;
    table.store.complete_batch(run.id).await.unwrap();
    let claims = claim_up_to(&*table.store, begun, 100 * LEASE, 3).await;
    assert_eq!(claims.len(), 3);
    end(&table, &claims[0], begun + 1000).await;
    end(&table, &claims[1], begun + 5000).await;
    assert_eq!(expire(&table, begun + 2000).await, 1, "the job alone");
    // The last chunk is still running.
    assert_eq!(expire(&table, begun + 6000).await, 0);
    end(&table, &claims[2], begun + 9000).await;
    assert_eq!(expire(&table, begun + 8999).await, 0);
    let there = async || {
        let found = table.store.batch("anonymous", Kind::Rows, run.id).await;
        found.unwrap().is_some()
    };
    assert!(there().await);
    assert_eq!(expire(&table, begun + 9000).await, 3);
    assert!(!there().await);
    assert!(table.store.has_expired("anonymous", run.id).await.unwrap());
}
