//! Conversion of rows of the job table to the types of [`model`](crate::model), and of values to columns.

use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;
use uuid::Uuid;

use super::engine::{self, DbRow, Row};
use crate::codec::result::EncodedResult;
use crate::error::StoreError;
use crate::model::{Job, Kind, Priority, State};
use crate::store::{CacheKey, Claim, Result, StoredResult};

/// The columns of a [`Job`].
macro_rules! job_columns {
    () => {
        "id, tenant, kind, state, name, labels, batch_id, created_at, updated_at, started_at, ended_at, attempt, progress, remarks, failure, cached, version, rank, deadline"
    };
}
pub(crate) use job_columns;

/// Reads a row with the columns of `job_columns`.
pub(crate) fn read_job(row: &DbRow) -> Result<Job> {
    Ok(Job {
        id: read_id(row)?,
        tenant: row.try_get("tenant")?,
        kind: read_kind(row)?,
        state: read_state(row)?,
        name: row.try_get("name")?,
        labels: read_json(row, "labels")?,
        batch_id: read_optional_id(row, "batch_id")?,
        priority: Priority::from_rank(read_small(row, "rank")?)
            .ok_or_else(|| StoreError::Corrupt("a rank is none of 0 to 2".to_owned()))?,
        created_at: row.try_get("created_at")?,
        updated_at: row.try_get("updated_at")?,
        started_at: row.try_get("started_at")?,
        ended_at: row.try_get("ended_at")?,
        deadline: row.try_get("deadline")?,
        expires_at: None,
        attempt: read_small(row, "attempt")?,
        progress: row.try_get("progress")?,
        remarks: read_json(row, "remarks")?,
        failure: match row.try_get::<Option<String>, _>("failure")? {
            Some(_) => Some(read_json(row, "failure")?),
            None => None,
        },
        cached: read_flag(row, "cached")?,
        version: read_count(row, "version")?,
        queue: None,
    })
}

pub(crate) fn read_id(row: &DbRow) -> Result<Uuid> {
    let id = read_optional_id(row, "id")?;
    id.ok_or_else(|| StoreError::Corrupt("a row without an id".to_owned()))
}

/// Reads an optional id.
pub(crate) fn read_optional_id(row: &DbRow, column: &str) -> Result<Option<Uuid>> {
    let text: Option<String> = row.try_get(column)?;
    let id = text.as_deref().map(Uuid::try_parse).transpose();
    id.map_err(|error| StoreError::Corrupt(format!("{column} {text:?}: {error}")))
}

/// Reads an optional cache key.
pub(crate) fn read_cache_key(row: &DbRow) -> Result<Option<CacheKey>> {
    let key: Option<Vec<u8>> = row.try_get("cache_key")?;
    key.map(CacheKey::try_from)
        .transpose()
        .map_err(|_| StoreError::Corrupt("a cache key has a wrong length".to_owned()))
}

/// Reads the optional reference to a blob.
pub(crate) fn read_blob_id(row: &DbRow) -> Result<Option<i64>> {
    let id = row.try_get("blob_id")?;
    Ok(id)
}

/// Reads the references of rows to blobs.
pub(crate) fn read_blob_ids(rows: &[DbRow]) -> Result<Vec<i64>> {
    rows.iter()
        .filter_map(|row| read_blob_id(row).transpose())
        .collect()
}

/// Reads bytes.
pub(crate) fn read_bytes(row: &DbRow, column: &str) -> Result<Bytes> {
    Ok(row.try_get::<Vec<u8>, _>(column)?.into())
}

/// Reads optional bytes.
pub(crate) fn read_optional_bytes(row: &DbRow, column: &str) -> Result<Option<Bytes>> {
    Ok(row.try_get::<Option<Vec<u8>>, _>(column)?.map(Bytes::from))
}

/// Reads a result from the columns `blob_key`, `blob_bytes`, `solution` and `fields`.
pub(crate) fn read_result(row: &DbRow) -> Result<StoredResult> {
    if let Some(key) = row.try_get::<Option<String>, _>("blob_key")? {
        return Ok(StoredResult::Blob(key, read_count(row, "blob_bytes")?));
    }
    Ok(StoredResult::Inline(EncodedResult {
        solution: read_bytes(row, "solution")?,
        fields: read_optional_bytes(row, "fields")?,
    }))
}

/// Reads a kind.
pub(crate) fn read_kind(row: &DbRow) -> Result<Kind> {
    let name: String = row.try_get("kind")?;
    Kind::from_name(&name).ok_or_else(|| StoreError::Corrupt(format!("kind {name:?}")))
}

pub(crate) fn read_state(row: &DbRow) -> Result<State> {
    let name: String = row.try_get("state")?;
    State::from_name(&name).ok_or_else(|| StoreError::Corrupt(format!("job state {name:?}")))
}

/// Reads the id of a job and its new state; `from` is the state before, for an assertion.
pub(crate) fn read_move(row: &DbRow, from: State) -> Result<(Uuid, State)> {
    let to = read_state(row)?;
    debug_assert!(from.may_become(to), "{from:?} became {to:?}");
    Ok((read_id(row)?, to))
}

pub(crate) fn read_count(row: &DbRow, column: &str) -> Result<u64> {
    let count: i64 = row.try_get(column)?;
    u64::try_from(count).map_err(|_| StoreError::Corrupt(format!("{column} is {count}")))
}

/// Reads a small number.
pub(crate) fn read_small<T: TryFrom<i64>>(row: &DbRow, column: &str) -> Result<T> {
    let count: i64 = row.try_get(column)?;
    T::try_from(count).map_err(|_| StoreError::Corrupt(format!("{column} is {count}")))
}

/// Reads a flag, 0 or 1.
pub(crate) fn read_flag(row: &DbRow, column: &str) -> Result<bool> {
    Ok(row.try_get::<i64, _>(column)? != 0)
}

pub(crate) fn to_json<T: Serialize + ?Sized>(value: &T) -> Result<String> {
    serde_json::to_string(value).map_err(|error| StoreError::Corrupt(error.to_string()))
}

pub(crate) fn read_json<T: DeserializeOwned>(row: &DbRow, column: &str) -> Result<T> {
    let text: String = row.try_get(column)?;
    serde_json::from_str(&text).map_err(|error| StoreError::Corrupt(format!("{text:.80}: {error}")))
}

/// Restricts a list to entries whose `name` contains a text, which is a parameter in lower case.
macro_rules! and_name {
    ($parameter:literal) => {
        concat!(
            " AND ",
            place_in!(),
            "(lower(COALESCE(name, '')), ",
            $parameter,
            ") > 0"
        )
    };
}
pub(crate) use and_name;

/// Restricts a list to entries that have all labels of a parameter, a JSON array of keys and values. `$has` selects a label
/// of an entry that equals `wanted_key` and `wanted_value`.
macro_rules! and_labels {
    ($parameter:literal, $($has:expr),+) => {
        concat!(
            " AND NOT EXISTS (SELECT 1 FROM (SELECT value ->> 0 AS wanted_key, value ->> 1 AS wanted_value FROM ",
            json_rows!($parameter),
            ") AS wanted WHERE NOT EXISTS (",
            $($has),+,
            "))"
        )
    };
}
pub(crate) use and_labels;

/// `VALUES` with this many rows of parameters.
pub(crate) fn values(rows: usize, columns: usize) -> String {
    let mut text = "VALUES ".to_owned();
    for number in 0..rows * columns {
        text.push_str(match (number, number % columns) {
            (0, _) => "(",
            (_, 0) => "), (",
            _ => ", ",
        });
        engine::push_placeholder(&mut text, number + 1);
    }
    text + ")"
}

/// A count as a column value.
pub(crate) fn count(number: impl TryInto<i64>) -> i64 {
    number.try_into().unwrap_or(i64::MAX)
}

/// The fencing token as a column value.
pub(crate) fn fence(claim: &Claim) -> i64 {
    count(claim.lease_token)
}

/// Selects one job.
pub(crate) const GET: &str = concat!(
    "SELECT ",
    job_columns!(),
    " FROM jobs WHERE id = $1 AND tenant = $2 AND kind <> 'rows'"
);
