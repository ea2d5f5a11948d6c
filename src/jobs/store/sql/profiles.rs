//! Cross-sections that tenants keep.

use super::engine::{self, DbRow, QueryBuilder, Row, SqlStore, query};
use super::rows::read_count;

use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::store::Profiles;
use crate::jobs::store::list::{Page, Total};
use crate::jobs::store::profile::{ProfileCursor, ProfileEntry, ProfileKept, StoredProfile};
use crate::jobs::store_error::StoreError;

#[repeat_conflicts]
#[async_trait]
impl Profiles for SqlStore {
    async fn add_profile(
        &self,
        tenant: &str,
        new: &StoredProfile,
        max_bytes: u64,
    ) -> Result<ProfileKept, StoreError> {
        let mut transaction = engine::begin(&self.writer).await?;
        engine::lock_admission(&mut transaction).await?;
        let known = query(
            "SELECT digest, body, created_at FROM profiles WHERE tenant = $1 AND digest = $2",
        )
        .bind(tenant)
        .bind(&new.digest)
        .fetch_optional(&mut *transaction)
        .await?;
        if let Some(row) = known {
            return Ok(ProfileKept::Existing(read_profile(&row)?));
        }
        let row = query(
            "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) AS bytes FROM profiles WHERE tenant = $1",
        )
        .bind(tenant)
        .fetch_one(&mut *transaction)
        .await?;
        let bytes = new.body.len() as u64;
        if read_count(&row, "bytes")? + bytes > max_bytes {
            return Ok(ProfileKept::Full);
        }
        query(
            "INSERT INTO profiles (tenant, digest, body, bytes, created_at) VALUES ($1, $2, $3, $4, $5)",
        )
        .bind(tenant)
        .bind(&new.digest)
        .bind(new.body.as_ref())
        .bind(i64::try_from(bytes).unwrap_or(i64::MAX))
        .bind(new.created_at)
        .execute(&mut *transaction)
        .await?;
        transaction.commit().await?;
        Ok(ProfileKept::Added)
    }

    async fn profile(
        &self,
        tenant: &str,
        digest: &str,
    ) -> Result<Option<StoredProfile>, StoreError> {
        let row = query(
            "SELECT digest, body, created_at FROM profiles WHERE tenant = $1 AND digest = $2",
        )
        .bind(tenant)
        .bind(digest)
        .fetch_optional(&self.readers)
        .await?;
        row.as_ref().map(read_profile).transpose()
    }

    async fn profiles(
        &self,
        tenant: &str,
        after: Option<&ProfileCursor>,
        limit: u32,
    ) -> Result<Page<ProfileEntry>, StoreError> {
        let mut query =
            QueryBuilder::new("SELECT digest, bytes, created_at FROM profiles WHERE tenant = ");
        query.push_bind(tenant.to_owned());
        if let Some(ProfileCursor(time, digest)) = after {
            query.push(" AND (created_at < ").push_bind(*time);
            query.push(" OR created_at = ").push_bind(*time);
            query.push(" AND substr(digest, 1, 28) > ");
            query.push_bind(digest.clone()).push(")");
        }
        query.push(" ORDER BY created_at DESC, digest LIMIT ");
        query.push_bind(i64::from(limit) + 1);
        let rows = query.build().fetch_all(&self.readers).await?;
        let read = |row: &DbRow| {
            Ok(ProfileEntry {
                digest: row.try_get("digest")?,
                bytes: read_count(row, "bytes")?,
                created_at: row.try_get("created_at")?,
            })
        };
        let entries: Result<Vec<_>, StoreError> = rows.iter().map(read).collect();
        let mut entries = entries?;
        let more = entries.len() > limit as usize;
        entries.truncate(limit as usize);
        let last = entries.last().filter(|_| more);
        let next_cursor = last.map(|entry| ProfileCursor::after(entry).to_string());
        Ok(Page {
            next_cursor,
            total: Total::AtLeast(entries.len() as u64),
            entries,
        })
    }

    async fn delete_profile(&self, tenant: &str, digest: &str) -> Result<bool, StoreError> {
        let gone = query("DELETE FROM profiles WHERE tenant = $1 AND digest = $2")
            .bind(tenant)
            .bind(digest)
            .execute(&self.writer)
            .await?;
        Ok(gone.rows_affected() > 0)
    }
}

fn read_profile(row: &DbRow) -> Result<StoredProfile, StoreError> {
    let body: Vec<u8> = row.try_get("body")?;
    Ok(StoredProfile {
        digest: row.try_get("digest")?,
        body: body.into(),
        created_at: row.try_get("created_at")?,
    })
}
