//! How much of the queue is taken: counted by triggers of the database, compared with the bounds in the transaction that
//! inserts.

use super::engine::{Db, DbConnection};
use super::rows::{push_list, read_count, read_id};
use sqlx::QueryBuilder;
use std::collections::{HashMap, HashSet};

use uuid::Uuid;

use crate::jobs::store::submission::{NewJob, QueueBounds, Refusal};
use crate::jobs::store_error::StoreError;

/// Queued jobs of a tenant with the chunks of its runs (of all tenants if it is NULL), and the places reserved for batches that are being filled.
const TAKEN: &str = "SELECT (SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts \
     WHERE state = 'queued' AND (tenant = $1 OR $1 IS NULL)) + \
     (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0 AND (tenant = $1 OR $1 IS NULL)) AS taken";

/// Places still free, as one transaction sees them and takes them.
pub(crate) struct Places<'a> {
    connection: &'a mut DbConnection,
    bounds: QueueBounds,
    all: Option<u64>,
    of_tenants: HashMap<String, u64>,
    /// Bytes that tenants have stored.
    stored: HashMap<String, u64>,
}

impl Places<'_> {
    /// Nothing is read before the first place is asked for.
    pub(crate) fn new(connection: &mut DbConnection, bounds: QueueBounds) -> Places<'_> {
        Places {
            connection,
            bounds,
            all: None,
            of_tenants: HashMap::new(),
            stored: HashMap::new(),
        }
    }

    /// Takes as many places as there are, at most `most`; a refusal if there is not even one.
    pub(crate) async fn take(
        &mut self,
        tenant: &str,
        most: u64,
    ) -> Result<Result<u64, Refusal>, StoreError> {
        let all = match self.all {
            Some(all) => all,
            None => taken(self.connection, None).await?,
        };
        let of_tenant = match self.of_tenants.get(tenant) {
            Some(taken) => *taken,
            None => taken(self.connection, Some(tenant)).await?,
        };
        let places = most
            .min(self.bounds.all.saturating_sub(all))
            .min(self.bounds.tenant.saturating_sub(of_tenant));
        self.all = Some(all + places);
        self.of_tenants
            .insert(tenant.to_owned(), of_tenant + places);
        if places > 0 || most == 0 {
            return Ok(Ok(places));
        }
        Ok(Err(self.refusal_of(tenant)))
    }

    /// Counts bytes that are about to be stored; a refusal if the tenant would have more than it may. Nothing is read without a bound.
    pub(crate) async fn store(
        &mut self,
        tenant: &str,
        bytes: u64,
    ) -> Result<Option<Refusal>, StoreError> {
        let Some(bytes_max) = self.bounds.stored else {
            return Ok(None);
        };
        let stored = match self.stored.get(tenant) {
            Some(stored) => *stored,
            None => stored(self.connection, tenant).await?,
        };
        if stored + bytes > bytes_max {
            return Ok(Some(Refusal::Stored));
        }
        self.stored.insert(tenant.to_owned(), stored + bytes);
        Ok(None)
    }

    /// Which bound has no place left.
    pub(crate) fn refusal_of(&self, tenant: &str) -> Refusal {
        let of_tenant = self.of_tenants.get(tenant);
        let of_tenant = of_tenant.copied().unwrap_or(0);
        if of_tenant >= self.bounds.tenant {
            Refusal::Quota
        } else {
            Refusal::Queue
        }
    }
}

/// Bytes of cases, templates and results that a tenant has stored.
pub(crate) async fn stored(connection: &mut DbConnection, tenant: &str) -> Result<u64, StoreError> {
    let row = sqlx::query(
        "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) AS bytes FROM stored_bytes WHERE tenant = $1",
    )
    .bind(tenant)
    .fetch_one(connection)
    .await?;
    read_count(&row, "bytes")
}

async fn taken(connection: &mut DbConnection, tenant: Option<&str>) -> Result<u64, StoreError> {
    let row = sqlx::query(TAKEN)
        .bind(tenant)
        .fetch_one(connection)
        .await?;
    read_count(&row, "taken")
}

/// Those of these jobs whose source is still there, so that they end at once and need no place.
pub(crate) async fn with_living_source(
    connection: &mut DbConnection,
    jobs: &[&NewJob],
) -> Result<HashSet<Uuid>, StoreError> {
    let sources: Vec<_> = jobs.iter().filter_map(|job| Some(job.source?.0)).collect();
    if sources.is_empty() {
        return Ok(HashSet::new());
    }
    let mut query = QueryBuilder::<Db>::new(concat!(
        "SELECT id FROM jobs WHERE ",
        bare!("state"),
        " = 'succeeded' AND id IN ("
    ));
    push_list(&mut query, &sources);
    query.push(")");
    let rows = query.build().fetch_all(connection).await?;
    let living = rows
        .iter()
        .map(read_id)
        .collect::<Result<HashSet<_>, _>>()?;
    let with = jobs.iter().filter(|job| {
        job.source
            .is_some_and(|(source, _)| living.contains(&source))
    });
    Ok(with.map(|job| job.id).collect())
}
