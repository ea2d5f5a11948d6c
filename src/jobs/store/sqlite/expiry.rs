//! Removal of what has expired, and of the space it took, in the embedded job table.

use sqlx::{QueryBuilder, Row, Sqlite};
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::store::list::first_id_at;
use crate::jobs::store::sqlite::SqliteStore;
use crate::jobs::store::sqlite::rows::read_id;

/// Ids grow with the time of submission, so the oldest rows are looked at and no others.
const EXPIRED: &str = "SELECT id, COALESCE(result_owner, id) AS owner FROM jobs \
     WHERE id < $1 AND ended_at <= $2 ORDER BY id LIMIT $3";

/// What is to be removed. Times are epoch milliseconds.
#[derive(Debug, Clone, Copy)]
pub struct Expiry {
    /// The present.
    pub now: i64,
    /// Jobs that ended at this time or before have expired.
    pub ended_before: i64,
    /// Ids of what was removed at this time or before are forgotten.
    pub forget_before: i64,
    /// Most jobs to remove.
    pub jobs: u32,
}

/// What was removed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Expired {
    /// Number of jobs.
    pub jobs: u64,
    /// Jobs whose stored results nobody needs any more.
    pub orphans: Vec<Uuid>,
}

impl SqliteStore {
    /// Removes expired jobs, complete batches of that age without jobs, and ids remembered long enough.
    ///
    /// # Errors
    /// The database failed; nothing changed.
    pub async fn expire(&self, expiry: Expiry) -> Result<Expired, JobsError> {
        let mut transaction = self.writer.begin_with("BEGIN IMMEDIATE").await?;
        let young = first_id_at(expiry.ended_before.saturating_add(1)).to_string();
        let rows = sqlx::query(EXPIRED)
            .bind(&young)
            .bind(expiry.ended_before)
            .bind(expiry.jobs)
            .fetch_all(&mut *transaction)
            .await?;
        let mut owners = Vec::with_capacity(rows.len());
        for some in rows.chunks(250) {
            let ids = some.iter().map(read_id).collect::<Result<Vec<_>, _>>()?;
            for row in some {
                let owner: &str = row.try_get("owner")?;
                owners.extend(Uuid::try_parse(owner));
            }
            let mut bury = QueryBuilder::<Sqlite>::new(
                "INSERT OR REPLACE INTO tombstones (id, tenant, gone_at) SELECT id, tenant, ",
            );
            bury.push_bind(expiry.now);
            bury.push(" FROM jobs WHERE id IN (");
            push_ids(&mut bury, &ids);
            bury.build().execute(&mut *transaction).await?;
            let mut delete = QueryBuilder::<Sqlite>::new("DELETE FROM jobs WHERE id IN (");
            push_ids(&mut delete, &ids);
            delete.build().execute(&mut *transaction).await?;
        }
        let mut orphans = Vec::new();
        for owner in owners {
            let needed: bool = sqlx::query_scalar(
                "SELECT EXISTS (SELECT 1 FROM jobs WHERE id = $1) OR EXISTS (SELECT 1 FROM jobs WHERE result_owner = $1)",
            )
            .bind(owner.to_string())
            .fetch_one(&mut *transaction)
            .await?;
            if !needed {
                orphans.push(owner);
            }
        }
        sqlx::query(
            "INSERT OR REPLACE INTO tombstones (id, tenant, gone_at) SELECT id, tenant, $1 FROM batches \
             WHERE id < $2 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)",
        )
        .bind(expiry.now)
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        sqlx::query(
            "DELETE FROM batches \
             WHERE id < $1 AND complete = 1 AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)",
        )
        .bind(&young)
        .execute(&mut *transaction)
        .await?;
        sqlx::query("DELETE FROM tombstones WHERE id < $1 AND gone_at <= $2")
            .bind(first_id_at(expiry.forget_before.saturating_add(1)).to_string())
            .bind(expiry.forget_before)
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(Expired {
            jobs: rows.len() as u64,
            orphans,
        })
    }

    /// Was there a job or a batch of this tenant with this id that has expired?
    ///
    /// # Errors
    /// The database failed.
    pub async fn has_expired(&self, id: Uuid, tenant: &str) -> Result<bool, JobsError> {
        let found = sqlx::query("SELECT 1 FROM tombstones WHERE id = $1 AND tenant = $2")
            .bind(id.to_string())
            .bind(tenant)
            .fetch_optional(&self.readers)
            .await?;
        Ok(found.is_some())
    }

    /// Gives at most `step` free pages of the file back, if there are more than `spare`; says whether it did.
    ///
    /// # Errors
    /// The database failed.
    pub async fn shrink(&self, spare: i64, step: u32) -> Result<bool, JobsError> {
        let free: i64 = sqlx::query_scalar("PRAGMA freelist_count")
            .fetch_one(&self.readers)
            .await?;
        if free <= spare {
            return Ok(false);
        }
        let step = i64::from(step).min(free - spare);
        sqlx::query(sqlx::AssertSqlSafe(format!(
            "PRAGMA incremental_vacuum({step})"
        )))
        .fetch_all(&self.writer)
        .await?;
        let left: i64 = sqlx::query_scalar("PRAGMA freelist_count")
            .fetch_one(&self.writer)
            .await?;
        Ok(left < free)
    }
}

fn push_ids(query: &mut QueryBuilder<Sqlite>, ids: &[Uuid]) {
    let mut list = query.separated(", ");
    for id in ids {
        list.push_bind(id.to_string());
    }
    query.push(")");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::jobs::store::sqlite::lists::tests::plan;

    #[tokio::test]
    async fn the_sweep_looks_at_old_jobs_only() {
        let folder = tempfile::tempdir().unwrap();
        let store = SqliteStore::open(&folder.path().join("jobs.db"))
            .await
            .unwrap();
        let steps = plan(&store, EXPIRED).await;
        assert_eq!(steps, ["SEARCH jobs USING PRIMARY KEY (id<?)"]);
    }
}
