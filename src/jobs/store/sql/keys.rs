//! API keys in the embedded job table.

use super::engine::{self, DbRow, Row, SqlStore, query};
use super::rows::{read_flag, read_json, to_json};
use async_trait::async_trait;
use railhead_macros::repeat_conflicts;

use crate::jobs::model::key::Key;
use crate::jobs::store::KeyStore;
use crate::jobs::store_error::StoreError;
use std::sync::Arc;

const ALL: &str =
    "SELECT id, hash, tenant, name, created_at, revoked_at, read_only, labels FROM api_keys";

const ONE: &str = "SELECT id, hash, tenant, name, created_at, revoked_at, read_only, labels FROM api_keys WHERE id = $1";

#[repeat_conflicts]
#[async_trait]
impl KeyStore for SqlStore {
    async fn add_key(&self, key: &Key) -> Result<(), StoreError> {
        query(
            "INSERT INTO api_keys (id, hash, tenant, name, created_at, revoked_at, read_only, labels) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)",
        )
        .bind(&key.id)
        .bind(key.hash.as_bytes().as_slice())
        .bind(&*key.tenant)
        .bind(&key.name)
        .bind(key.created_at)
        .bind(key.revoked_at)
        .bind(i64::from(key.read_only))
        .bind(to_json(&*key.labels)?)
        .execute(&self.writer)
        .await?;
        Ok(())
    }

    async fn key(&self, id: &str) -> Result<Option<Key>, StoreError> {
        let row = query(ONE).bind(id).fetch_optional(&self.readers).await?;
        row.as_ref().map(read_key).transpose()
    }

    async fn keys(&self) -> Result<Vec<Key>, StoreError> {
        let rows = query(ALL).fetch_all(&self.readers).await?;
        let mut keys = rows.iter().map(read_key).collect::<Result<Vec<_>, _>>()?;
        keys.sort_by(|a, b| (a.created_at, &a.id).cmp(&(b.created_at, &b.id)));
        Ok(keys)
    }

    async fn revoke_key(&self, id: &str, now: i64) -> Result<Option<Key>, StoreError> {
        query("UPDATE api_keys SET revoked_at = $1 WHERE id = $2 AND revoked_at IS NULL")
            .bind(now)
            .bind(id)
            .execute(&self.writer)
            .await?;
        self.key(id).await
    }
}

fn read_key(row: &DbRow) -> Result<Key, StoreError> {
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
