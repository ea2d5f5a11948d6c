//! Submission: places in the queue, insertion of jobs, and group commit of single submissions.
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use railhead_macros::store_trait;
use tokio::sync::{mpsc, oneshot};
use uuid::Uuid;

use super::engine::{self, DbConnection, DbPool, Row, SqlStore, built, query};
use super::finish::{Sources, end_with_sources, find_sources};
use super::rows::{count, job_columns, read_count, read_job, to_json, values};
use crate::error::StoreError;
use crate::model::Job;
use crate::store::{CacheKey, Enqueued, NewJob, QueueBounds, Refusal, Result};

/// Free places in the queue as read by one transaction, which takes some of them.
pub(crate) struct Places {
    bounds: QueueBounds,
    /// Number of queued jobs of all tenants, including reserved places.
    all: u64,
    /// Number of queued jobs and reserved places of each tenant, and its stored bytes.
    of_tenants: HashMap<String, (u64, u64)>,
}

impl Places {
    /// Reads the places that these tenants have taken.
    pub(crate) async fn of<'a>(
        connection: &mut DbConnection,
        tenants: impl IntoIterator<Item = &'a str>,
        bounds: QueueBounds,
    ) -> Result<Places> {
        let tenants: Vec<_> = tenants.into_iter().map(|tenant| [tenant]).collect();
        let rows = sql!(fetch_all, connection,
            concat!(
                "WITH asked AS (SELECT value ->> 0 AS tenant FROM ",
                json_rows!("$1"),
                ") SELECT tenant, \
                 (SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts WHERE state = 'queued' AND job_counts.tenant = asked.tenant) + \
                 (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0 AND batches.tenant = asked.tenant) AS taken, \
                 (SELECT CAST(COALESCE(SUM(number), 0) AS bigint) FROM job_counts WHERE state = 'queued') + \
                 (SELECT CAST(COALESCE(SUM(reserved), 0) AS bigint) FROM batches WHERE complete = 0) AS taken_by_all, \
                 (SELECT CAST(COALESCE(SUM(bytes), 0) AS bigint) FROM stored_bytes WHERE stored_bytes.tenant = asked.tenant) AS stored FROM asked"
            );
            to_json(&tenants)?
        )?;
        let mut places = Places {
            bounds,
            all: 0,
            of_tenants: HashMap::new(),
        };
        for row in &rows {
            places.all = read_count(row, "taken_by_all")?;
            let of_tenant = (read_count(row, "taken")?, read_count(row, "stored")?);
            places.of_tenants.insert(row.try_get("tenant")?, of_tenant);
        }
        Ok(places)
    }

    /// Takes this many places; a refusal if there are fewer.
    pub(crate) fn take(&mut self, tenant: &str, places: u32) -> Result<(), Refusal> {
        let (of_tenant, stored) = self.taken_by(tenant);
        let (of_tenant, all) = (of_tenant + u64::from(places), self.all + u64::from(places));
        if of_tenant > self.bounds.tenant {
            return Err(Refusal::Quota);
        }
        if all > self.bounds.all {
            return Err(Refusal::Queue);
        }
        self.all = all;
        self.of_tenants
            .insert(tenant.to_owned(), (of_tenant, stored));
        Ok(())
    }

    /// Adds bytes to be stored; a refusal if the tenant would exceed its bound.
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
}

/// Number of jobs in one statement; with 20 values each far below the limit of SQLite.
const ROWS_PER_STATEMENT: usize = 250;

/// Inserts jobs within the caller's transaction; jobs of a batch with their indices in it. Returns the jobs that ended at
/// once with the result of one of the sources.
pub(crate) async fn insert_jobs(
    connection: &mut DbConnection,
    batch: Option<Uuid>,
    jobs: &[(Option<u32>, &NewJob)],
    sources: &Sources,
) -> Result<Vec<Uuid>> {
    let mut ended = Vec::new();
    let batch = batch.map(|id| id.to_string());
    for some in jobs.chunks(ROWS_PER_STATEMENT) {
        let mut rows = built(format!(
            "INSERT INTO jobs (id, state, name, labels, method, created_at, updated_at, batch_id, batch_index, cost_us, slice_us, outputs, \
             cache_key, tenant, bypass_cache, rank, deadline, traceparent, case_bytes, kind) {}",
            values(some.len(), 20)
        ));
        let mut cases = built(format!(
            "INSERT INTO cases (job_id, row, body) {}",
            values(some.len(), 3)
        ));
        for (index, job) in some {
            bind!(rows;
                job.id.to_string(), "queued", &job.name, to_json(&job.labels)?, &job.method,
                job.created_at, job.created_at, &batch, index.map(i64::from),
                i64::from(job.cost_us), i64::from(job.slice_us), &job.outputs,
                job.cache_key.as_ref().map(CacheKey::as_slice), &*job.tenant,
                i64::from(job.options.bypass_cache), job.options.priority.rank(), job.deadline(),
                job.traceparent.as_deref(), count(job.body.len()), job.kind.name()
            );
            bind!(cases; job.id.to_string(), i64::from(job.row), job.body.as_ref());
        }
        rows.execute(&mut *connection).await?;
        cases.execute(&mut *connection).await?;
        let labelled = some.iter().filter(|(_, job)| !job.labels.is_empty());
        let labelled: Vec<Uuid> = labelled.map(|(_, job)| job.id).collect();
        if !labelled.is_empty() {
            sql!(execute, &mut *connection, INSERT_LABELS; to_json(&labelled)?)?;
        }
        let jobs = some.iter().map(|(_, job)| *job);
        ended.extend(end_with_sources(&mut *connection, jobs, sources).await?);
    }
    Ok(ended)
}

const INSERT_LABELS: &str = concat!(
    "INSERT INTO job_labels (of_tenant, key, value, job_id, state) \
     SELECT jobs.tenant, label.key, label.value, jobs.id, jobs.state FROM jobs, ",
    pairs_of_labels!(),
    " AS label WHERE jobs.id",
    in_list!("$1")
);

/// Maximum number of jobs stored in one transaction.
const GROUP_MAX: usize = 256;

/// Selects the job of an idempotency key.
pub(crate) const BY_KEY: &str = concat!(
    "SELECT ",
    job_columns!(),
    ", digest FROM idempotency_keys JOIN jobs ON jobs.id = idempotency_keys.job_id WHERE of_tenant = $1 AND key = $2"
);

/// A job whose submitter waits for the reply.
#[derive(Debug)]
pub(crate) struct Submission {
    pub(crate) new: NewJob,
    pub(crate) bounds: QueueBounds,
    pub(crate) reply: oneshot::Sender<Result<Enqueued>>,
}

/// A handle of the task that stores submitted jobs; the task ends with its last handle.
#[derive(Debug, Clone)]
pub(crate) struct GroupCommit(pub(crate) mpsc::Sender<Submission>);

impl GroupCommit {
    /// Starts the task.
    pub(crate) fn start(writer: DbPool) -> Result<GroupCommit> {
        let (sender, waiting) = mpsc::channel(GROUP_MAX);
        engine::spawn(store_all(writer, waiting))?;
        Ok(GroupCommit(sender))
    }
}

async fn store_all(writer: DbPool, mut waiting: mpsc::Receiver<Submission>) {
    let mut group = Vec::with_capacity(GROUP_MAX);
    while waiting.recv_many(&mut group, GROUP_MAX).await > 0 {
        while !group.is_empty() {
            let later = set_aside_repeated_keys(&mut group);
            store_some(&writer, std::mem::replace(&mut group, later)).await;
        }
    }
}

/// Removes jobs whose idempotency key occurs earlier in the group: they depend on the outcome of the earlier job.
fn set_aside_repeated_keys(group: &mut Vec<Submission>) -> Vec<Submission> {
    let mut seen = HashSet::new();
    let keyed = |waiting: &Submission| {
        let key = waiting.new.idempotency.as_ref()?.0.clone();
        Some((waiting.new.tenant.clone(), key))
    };
    group
        .extract_if(.., |waiting| {
            keyed(waiting).is_some_and(|key| !seen.insert(key))
        })
        .collect()
}

async fn store_some(writer: &DbPool, group: Vec<Submission>) {
    let jobs: Vec<&NewJob> = group.iter().map(|waiting| &waiting.new).collect();
    let Some(bounds) = group.first().map(|waiting| waiting.bounds) else {
        return;
    };
    let stored = engine::again(|| store_together(writer, &jobs, bounds)).await;
    let alone = group.len() == 1;
    match stored {
        Ok(answers) => {
            for (waiting, answer) in group.into_iter().zip(answers) {
                // The receiver is closed if the submitter has stopped waiting.
                let _ = waiting.reply.send(Ok(answer));
            }
        }
        // A storage fault affects all of them.
        Err(error) if alone || error.storage_fault().is_some() => {
            for waiting in group {
                let _ = waiting.reply.send(Err(error.clone()));
            }
        }
        Err(_) => {
            for waiting in group {
                let one = [&waiting.new];
                let stored = engine::again(|| store_together(writer, &one, bounds)).await;
                let answer = stored.and_then(|mut answers| answers.pop().ok_or_else(lost));
                let _ = waiting.reply.send(answer);
            }
        }
    }
}

/// Stores jobs in one transaction; the answers are in their order. Idempotency keys must differ.
async fn store_together(
    writer: &DbPool,
    jobs: &[&NewJob],
    bounds: QueueBounds,
) -> Result<Vec<Enqueued>> {
    let mut transaction = engine::begin(writer).await?;
    let sources = find_sources(&mut transaction, jobs.iter().copied()).await?;
    engine::lock_admission(&mut transaction).await?;
    let tenants: HashSet<&str> = jobs.iter().map(|job| &*job.tenant).collect();
    let mut places = Places::of(&mut transaction, tenants, bounds).await?;
    let mut known = HashMap::new();
    for job in jobs {
        if let Some((key, digest)) = &job.idempotency
            && let Some(found) = by_key(&mut transaction, &job.tenant, key, digest).await?
        {
            known.insert(job.id, found);
        }
    }
    let mut added: Vec<_> = jobs
        .iter()
        .filter(|job| !known.contains_key(&job.id))
        .map(|job| (None, *job))
        .collect();
    for (_, job) in &added {
        // A job that ends at once with the result of its source needs no place.
        let ends = job
            .lookup_key()
            .is_some_and(|key| sources.contains_key(&key));
        let taken = match ends {
            true => Ok(()),
            false => places.take(&job.tenant, 1),
        };
        let room = taken.and_then(|()| places.store(&job.tenant, job.body.len() as u64));
        if let Err(refusal) = room {
            known.insert(job.id, Enqueued::Refused(refusal));
        }
    }
    added.retain(|(_, job)| !known.contains_key(&job.id));
    if added.is_empty() {
        transaction.commit().await?;
        return answers(jobs, known);
    }
    insert_jobs(&mut transaction, None, &added, &sources).await?;
    for (_, job) in &added {
        if let Some((key, digest)) = &job.idempotency {
            sql!(execute, &mut *transaction,
                "INSERT INTO idempotency_keys (of_tenant, key, digest, job_id) VALUES ($1, $2, $3, $4)";
                &*job.tenant, key, digest.as_slice(), job.id.to_string()
            )?;
        }
    }
    for job in read_back(&mut transaction, &added).await? {
        known.insert(job.id, Enqueued::Created(job));
    }
    transaction.commit().await?;
    answers(jobs, known)
}

/// The answers in the order of the jobs.
fn answers(jobs: &[&NewJob], mut known: HashMap<Uuid, Enqueued>) -> Result<Vec<Enqueued>> {
    jobs.iter()
        .map(|job| known.remove(&job.id).ok_or_else(lost))
        .collect()
}

fn lost() -> StoreError {
    StoreError::Corrupt("a job was stored and not answered".to_owned())
}

/// Finds the job of an idempotency key, if it was used.
pub(crate) async fn by_key(
    connection: &mut DbConnection,
    tenant: &str,
    key: &str,
    digest: &[u8; 32],
) -> Result<Option<Enqueued>> {
    let row = sql!(fetch_optional, connection, BY_KEY; tenant, key)?;
    let Some(row) = row else { return Ok(None) };
    let stored: Vec<u8> = row.try_get("digest")?;
    Ok(Some(if stored == digest {
        Enqueued::Existing(read_job(&row)?)
    } else {
        Enqueued::Conflict
    }))
}

/// Reads the inserted jobs.
async fn read_back(
    connection: &mut DbConnection,
    added: &[(Option<u32>, &NewJob)],
) -> Result<Vec<Job>> {
    let tenants: HashSet<&str> = added.iter().map(|(_, job)| &*job.tenant).collect();
    let ids: Vec<Uuid> = added.iter().map(|(_, job)| job.id).collect();
    let rows = sql!(fetch_all, connection,
        concat!(
            "SELECT ",
            job_columns!(),
            " FROM jobs WHERE id",
            in_list!("$1"),
            " AND ",
            bare!("tenant"),
            in_list!("$2")
        );
        to_json(&ids)?, to_json(&tenants)?
    )?;
    rows.iter().map(read_job).collect()
}

/// Submission of single jobs.
#[store_trait]
impl SubmitJobs for SqlStore {
    /// Inserts a job if the bounds permit it, or finds the job of its idempotency key. A job for whose cache key there is a
    /// result ends at once and needs no place in the queue. Dropping the future does not cancel the call.
    #[once]
    async fn enqueue(&self, new: &NewJob, bounds: QueueBounds) -> Result<Enqueued> {
        let gone = || {
            StoreError::Failed(Arc::new(std::io::Error::other(
                "the task that stores jobs has ended",
            )))
        };
        let (reply, answer) = oneshot::channel();
        let waiting = Submission {
            new: new.clone(),
            bounds,
            reply,
        };
        self.group_commit
            .0
            .send(waiting)
            .await
            .map_err(|_| gone())?;
        answer.await.map_err(|_| gone())?
    }

    /// Frees an idempotency key of a tenant.
    async fn forget_key(&self, tenant: &str, key: &str) -> Result<()> {
        sql!(execute, &self.writer,
            "DELETE FROM idempotency_keys WHERE of_tenant = $1 AND key = $2";
            tenant, key
        )?;
        Ok(())
    }

    /// Finds the job of an idempotency key, or the conflict if the key has another digest.
    async fn job_by_key(
        &self,
        tenant: &str,
        key: &str,
        digest: &[u8; 32],
    ) -> Result<Option<Enqueued>> {
        let mut connection = self.readers.acquire().await?;
        by_key(&mut connection, tenant, key, digest).await
    }
}
