//! Large results that nobody refers to any more.

use super::blob_refs::{VALUES_PER_STATEMENT, leave_to_collector, push_keys};
use super::engine::{self, QueryBuilder, Row, SqlStore, query_scalar};
use super::rows::{push_list, read_id};
use std::collections::HashSet;
use uuid::Uuid;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::store::Orphans;
use crate::jobs::store::ResultKeys;
use crate::jobs::store_error::StoreError;

#[repeat_conflicts]
#[async_trait]
impl ResultKeys for SqlStore {
    async fn released_blobs(&self, done: &[String], limit: u32) -> Result<Vec<String>, StoreError> {
        for some in done.chunks(VALUES_PER_STATEMENT) {
            let mut forget = QueryBuilder::new("DELETE FROM blob_outbox WHERE key IN (");
            push_keys(&mut forget, some);
            forget.build().execute(&self.writer).await?;
        }
        let keys = query_scalar("SELECT key FROM blob_outbox ORDER BY key LIMIT $1")
            .bind(i64::from(limit))
            .fetch_all(&self.readers)
            .await?;
        Ok(keys)
    }

    async fn abandon_blob(&self, key: &str) -> Result<(), StoreError> {
        let mut connection = self.writer.acquire().await?;
        leave_to_collector(&mut connection, &[key.to_owned()]).await
    }

    async fn orphans(&self, results: &[(Uuid, String)]) -> Result<Orphans, StoreError> {
        let mut orphans = Orphans::default();
        for some in results.chunks(VALUES_PER_STATEMENT) {
            // In this order: what a running job has written is known by its key before the job no longer runs.
            let running = self.running(some).await?;
            let mut query = QueryBuilder::new("SELECT key FROM blobs WHERE key IN (");
            let keys: Vec<String> = some.iter().map(|(_, key)| key.clone()).collect();
            push_keys(&mut query, &keys);
            let known = query.build().fetch_all(&self.readers).await?;
            let known = known.iter().map(|row| row.try_get("key"));
            let known: HashSet<String> = known.collect::<Result<_, _>>()?;
            for result in some.iter().filter(|(_, key)| !known.contains(key)) {
                if running.contains(&result.0) {
                    orphans.undecided.push(result.clone());
                } else {
                    orphans.certain.push(result.1.clone());
                }
            }
        }
        Ok(orphans)
    }
}

impl SqlStore {
    async fn running(&self, results: &[(Uuid, String)]) -> Result<HashSet<Uuid>, StoreError> {
        let mut query =
            QueryBuilder::new("SELECT id FROM jobs WHERE state = 'running' AND id IN (");
        let ids: Vec<Uuid> = results.iter().map(|(id, _)| *id).collect();
        push_list(&mut query, &ids);
        query.push(")");
        let rows = query.build().fetch_all(&self.readers).await?;
        rows.iter().map(read_id).collect()
    }
}
