//! API keys and stored profiles.
use std::sync::Arc;

use railhead_macros::store_trait;

use super::engine::{self, DbRow, Row, SqlStore, query};
use super::rows::{read_bytes, read_count, read_flag, read_json, to_json};
use crate::error::StoreError;
use crate::model::Key;
use crate::store::{Page, ProfileCursor, ProfileEntry, ProfileKept, Result, StoredProfile, Total};

/// Selects the columns of a [`Key`].
macro_rules! select_keys {
    ($condition:literal) => {
        concat!(
            "SELECT id, hash, tenant, name, created_at, revoked_at, read_only, labels FROM api_keys",
            $condition
        )
    };
}

/// API keys.
#[store_trait]
impl KeyStore for SqlStore {
    /// Stores a key. Fails if the id exists.
    async fn add_key(&self, key: &Key) -> Result<()> {
        sql!(execute, &self.writer,
            "INSERT INTO api_keys (id, hash, tenant, name, created_at, revoked_at, read_only, labels) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
            &key.id, key.hash.as_bytes().as_slice(), &*key.tenant, &key.name, key.created_at,
            key.revoked_at, i64::from(key.read_only), to_json(&*key.labels)?
        )?;
        Ok(())
    }

    /// A key by its id.
    async fn key(&self, id: &str) -> Result<Option<Key>> {
        let row = sql!(fetch_optional, &self.readers, select_keys!(" WHERE id = $1"); id)?;
        row.as_ref().map(read_key).transpose()
    }

    /// All keys, oldest first, including revoked ones.
    async fn keys(&self) -> Result<Vec<Key>> {
        let rows = sql!(fetch_all, &self.readers, select_keys!(""))?;
        let mut keys = rows.iter().map(read_key).collect::<Result<Vec<_>, _>>()?;
        keys.sort_by(|a, b| (a.created_at, &a.id).cmp(&(b.created_at, &b.id)));
        Ok(keys)
    }

    /// Revokes a key; `None` if it does not exist. The first time of revocation is kept.
    async fn revoke_key(&self, id: &str, now: i64) -> Result<Option<Key>> {
        sql!(execute, &self.writer,
            "UPDATE api_keys SET revoked_at = $1 WHERE id = $2 AND revoked_at IS NULL";
            now, id
        )?;
        self.key(id).await
    }
}

fn read_key(row: &DbRow) -> Result<Key> {
    let hash: Vec<u8> = row.try_get("hash")?;
    let tenant: String = row.try_get("tenant")?;
    Ok(Key {
        id: row.try_get("id")?,
        hash: blake3::Hash::from_slice(&hash)
            .map_err(|error| StoreError::Corrupt(format!("hash of a key: {error}")))?,
        tenant: tenant.into(),
        name: row.try_get("name")?,
        created_at: row.try_get("created_at")?,
        revoked_at: row.try_get("revoked_at")?,
        read_only: read_flag(row, "read_only")?,
        labels: Arc::new(read_json(row, "labels")?),
    })
}

/// Stored profiles of tenants.
#[store_trait]
impl Profiles for SqlStore {
    /// Stores a profile of a tenant, unless it exists or the total size would exceed `max_bytes`.
    async fn add_profile(
        &self,
        tenant: &str,
        new: &StoredProfile,
        max_bytes: u64,
    ) -> Result<ProfileKept> {
        let mut transaction = engine::begin(&self.writer).await?;
        engine::lock_admission(&mut transaction).await?;
        let known = sql!(fetch_optional, &mut *transaction,
            "SELECT digest, body, created_at FROM profiles WHERE tenant = $1 AND digest = $2";
            tenant, &new.digest
        )?;
        if let Some(row) = known {
            return Ok(ProfileKept::Existing(read_profile(&row)?));
        }
        let row = sql!(fetch_one, &mut *transaction,
            "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) AS bytes FROM profiles WHERE tenant = $1";
            tenant
        )?;
        let bytes = new.body.len() as u64;
        if read_count(&row, "bytes")? + bytes > max_bytes {
            return Ok(ProfileKept::Full);
        }
        sql!(execute, &mut *transaction,
            "INSERT INTO profiles (tenant, digest, body, bytes, created_at) VALUES ($1, $2, $3, $4, $5)";
            tenant, &new.digest, new.body.as_ref(), i64::try_from(bytes).unwrap_or(i64::MAX),
            new.created_at
        )?;
        transaction.commit().await?;
        Ok(ProfileKept::Added)
    }

    /// Reads a profile by its digest.
    async fn profile(&self, tenant: &str, digest: &str) -> Result<Option<StoredProfile>> {
        let row = sql!(fetch_optional, &self.readers,
            "SELECT digest, body, created_at FROM profiles WHERE tenant = $1 AND digest = $2";
            tenant, digest
        )?;
        row.as_ref().map(read_profile).transpose()
    }

    /// One page of the profiles of a tenant, newest first.
    async fn profiles(
        &self,
        tenant: &str,
        after: Option<&ProfileCursor>,
        limit: u32,
    ) -> Result<Page<ProfileEntry>> {
        let (time, digest) = match after {
            Some(ProfileCursor(time, digest)) => (*time, digest.as_str()),
            None => (i64::MAX, ""),
        };
        let rows = sql!(fetch_all, &self.readers,
            "SELECT digest, bytes, created_at FROM profiles WHERE tenant = $1 \
             AND (created_at < $2 OR created_at = $2 AND substr(digest, 1, 28) > $3) \
             ORDER BY created_at DESC, digest LIMIT $4";
            tenant, time, digest, i64::from(limit) + 1
        )?;
        let read = |row: &DbRow| {
            Ok(ProfileEntry {
                digest: row.try_get("digest")?,
                bytes: read_count(row, "bytes")?,
                created_at: row.try_get("created_at")?,
            })
        };
        let mut entries = rows.iter().map(read).collect::<Result<Vec<_>>>()?;
        let more = entries.len() > limit as usize;
        entries.truncate(limit as usize);
        let last = entries.last().filter(|_| more);
        Ok(Page {
            next_cursor: last.map(|entry| ProfileCursor::after(entry).to_string()),
            total: Total::AtLeast(entries.len() as u64),
            entries,
        })
    }

    /// Deletes a profile; `false` if it does not exist.
    async fn delete_profile(&self, tenant: &str, digest: &str) -> Result<bool> {
        let gone = sql!(execute, &self.writer,
            "DELETE FROM profiles WHERE tenant = $1 AND digest = $2";
            tenant, digest
        )?;
        Ok(gone.rows_affected() > 0)
    }
}

fn read_profile(row: &DbRow) -> Result<StoredProfile> {
    Ok(StoredProfile {
        digest: row.try_get("digest")?,
        body: read_bytes(row, "body")?,
        created_at: row.try_get("created_at")?,
    })
}
