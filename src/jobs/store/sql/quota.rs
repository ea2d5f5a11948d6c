//! How much of the queue is taken: counted by triggers of the database, compared with the bounds in the transaction that
//! inserts.

use super::engine::{DbConnection, QueryBuilder, Row, query};
use super::rows::{push_list, read_count, read_id};
use std::collections::{HashMap, HashSet};

use uuid::Uuid;

use crate::jobs::store::submission::{QueueBounds, Refusal};
use crate::jobs::store_error::StoreError;

/// Places still free, as one transaction has read them and takes them.
pub(crate) struct Places {
    bounds: QueueBounds,
    /// Queued jobs of all tenants with the places that are reserved for batches being filled.
    all: u64,
    /// Queued jobs and reserved places of each tenant, and its stored bytes.
    of_tenants: HashMap<String, (u64, u64)>,
}

impl Places {
    /// What these tenants have taken.
    pub(crate) async fn of<'a>(
        connection: &mut DbConnection,
        tenants: impl IntoIterator<Item = &'a str>,
        bounds: QueueBounds,
    ) -> Result<Places, StoreError> {
        let mut query = QueryBuilder::new("WITH asked (tenant) AS (");
        query.push_values(tenants, |mut row, tenant| {
            row.push_bind(tenant);
        });
        query.push(
            ") SELECT tenant, \
             (SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts WHERE state = 'queued' AND job_counts.tenant = asked.tenant) + \
             (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0 AND batches.tenant = asked.tenant) AS taken, \
             (SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts WHERE state = 'queued') + \
             (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0) AS taken_by_all, \
             (SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) FROM stored_bytes WHERE stored_bytes.tenant = asked.tenant) AS stored FROM asked",
        );
        let mut places = Places {
            bounds,
            all: 0,
            of_tenants: HashMap::new(),
        };
        for row in &query.build().fetch_all(connection).await? {
            places.all = read_count(row, "taken_by_all")?;
            let of_tenant = (read_count(row, "taken")?, read_count(row, "stored")?);
            places.of_tenants.insert(row.try_get("tenant")?, of_tenant);
        }
        Ok(places)
    }

    /// Takes as many places as there are, at most `most`; a refusal if there is not even one.
    pub(crate) fn take(&mut self, tenant: &str, most: u64) -> Result<u64, Refusal> {
        let (of_tenant, stored) = self.taken_by(tenant);
        let places = most
            .min(self.bounds.all.saturating_sub(self.all))
            .min(self.bounds.tenant.saturating_sub(of_tenant));
        if places == 0 && most > 0 {
            return Err(self.refusal_of(tenant));
        }
        self.all += places;
        self.of_tenants
            .insert(tenant.to_owned(), (of_tenant + places, stored));
        Ok(places)
    }

    /// Counts bytes that are about to be stored; a refusal if the tenant would have more than it may.
    pub(crate) fn store(&mut self, tenant: &str, bytes: u64) -> Result<(), Refusal> {
        let (of_tenant, stored) = self.taken_by(tenant);
        if self.bounds.stored.is_some_and(|most| stored + bytes > most) {
            return Err(Refusal::Stored);
        }
        self.of_tenants
            .insert(tenant.to_owned(), (of_tenant, stored + bytes));
        Ok(())
    }

    fn taken_by(&self, tenant: &str) -> (u64, u64) {
        self.of_tenants.get(tenant).copied().unwrap_or((0, 0))
    }

    /// Which bound has no place left.
    pub(crate) fn refusal_of(&self, tenant: &str) -> Refusal {
        if self.taken_by(tenant).0 >= self.bounds.tenant {
            Refusal::Quota
        } else {
            Refusal::Queue
        }
    }
}

/// Bytes of cases, templates and results that a tenant has stored.
pub(crate) async fn stored(connection: &mut DbConnection, tenant: &str) -> Result<u64, StoreError> {
    let row = query(
        "SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) AS bytes FROM stored_bytes WHERE tenant = $1",
    )
    .bind(tenant)
    .fetch_one(connection)
    .await?;
    read_count(&row, "bytes")
}

/// Those of these jobs that have succeeded.
pub(crate) async fn succeeded(
    connection: &mut DbConnection,
    ids: &[Uuid],
) -> Result<HashSet<Uuid>, StoreError> {
    if ids.is_empty() {
        return Ok(HashSet::new());
    }
    let mut query = QueryBuilder::new(concat!(
        "SELECT id FROM jobs WHERE ",
        bare!("state"),
        " = 'succeeded' AND id IN ("
    ));
    push_list(&mut query, ids);
    query.push(")");
    let rows = query.build().fetch_all(connection).await?;
    rows.iter().map(read_id).collect()
}
