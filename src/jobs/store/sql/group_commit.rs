//! Jobs submitted one by one, stored together: all that wait at a moment share one transaction, and so one write to the disk,
//! which takes longer than everything else about them.

use super::engine::{self, DbConnection, DbPool, Row, query};
use super::insert::insert_jobs;
use super::quota::{Places, succeeded};
use super::rows::{GET, job_columns, read_job};
use std::collections::{HashMap, HashSet};

use tokio::sync::{mpsc, oneshot};
use uuid::Uuid;

use crate::jobs::model::job::{Job, State};
use crate::jobs::store::submission::{Enqueued, NewJob, QueueBounds};
use crate::jobs::store_error::StoreError;

/// Most jobs stored together.
const GROUP_MAX: usize = 256;

/// What an idempotency key of a tenant stands for.
pub(crate) const BY_KEY: &str = concat!(
    "SELECT ",
    job_columns!(),
    ", digest FROM idempotency_keys JOIN jobs ON jobs.id = idempotency_keys.job_id WHERE of_tenant = $1 AND key = $2"
);

/// A job whose submitter waits.
#[derive(Debug)]
pub(crate) struct Submission {
    pub(crate) new: NewJob,
    pub(crate) bounds: QueueBounds,
    pub(crate) reply: oneshot::Sender<Result<Enqueued, StoreError>>,
}

/// The way to the task that stores jobs; it ends with the last of these.
#[derive(Debug, Clone)]
pub(crate) struct GroupCommit(pub(crate) mpsc::Sender<Submission>);

impl GroupCommit {
    /// Starts the task.
    pub(crate) fn start(writer: DbPool) -> GroupCommit {
        let (sender, waiting) = mpsc::channel(GROUP_MAX);
        tokio::spawn(store_all(writer, waiting));
        GroupCommit(sender)
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

/// Takes out jobs whose idempotency key another of the group has: they have to see what became of that one.
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
                // The submitter may have stopped waiting.
                let _ = waiting.reply.send(Ok(answer));
            }
        }
        // What is wrong with the disk is wrong for all of them.
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
) -> Result<Vec<Enqueued>, StoreError> {
    let mut transaction = engine::begin(writer).await?;
    engine::lock_admission(&mut transaction).await?;
    let tenants: HashSet<&str> = jobs.iter().map(|job| &*job.tenant).collect();
    let mut places = Places::of(&mut transaction, tenants, bounds).await?;
    let sources: Vec<Uuid> = jobs.iter().filter_map(|job| Some(job.source?.0)).collect();
    let living = succeeded(&mut transaction, &sources).await?;
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
            .source
            .is_some_and(|(source, _)| living.contains(&source));
        let taken = match ends {
            true => Ok(0),
            false => places.take(&job.tenant, 1),
        };
        let room = taken.and_then(|_| places.store(&job.tenant, job.body.len() as u64));
        if let Err(refusal) = room {
            known.insert(job.id, Enqueued::Refused(refusal));
        }
    }
    added.retain(|(_, job)| !known.contains_key(&job.id));
    if added.is_empty() {
        transaction.commit().await?;
        return answers(jobs, known);
    }
    let ended = insert_jobs(&mut transaction, None, &added).await?;
    for (_, job) in added {
        if let Some((key, digest)) = &job.idempotency {
            query("INSERT INTO idempotency_keys (of_tenant, key, digest, job_id) VALUES ($1, $2, $3, $4)")
                .bind(&*job.tenant)
                .bind(key)
                .bind(digest.as_slice())
                .bind(job.id.to_string())
                .execute(&mut *transaction)
                .await?;
        }
        let as_it_is = if ended.contains(&job.id) {
            read_back(&mut transaction, job).await?
        } else {
            queued(job)
        };
        known.insert(job.id, Enqueued::Created(as_it_is));
    }
    transaction.commit().await?;
    answers(jobs, known)
}

/// The answers in the order of the jobs.
fn answers(
    jobs: &[&NewJob],
    mut known: HashMap<Uuid, Enqueued>,
) -> Result<Vec<Enqueued>, StoreError> {
    jobs.iter()
        .map(|job| known.remove(&job.id).ok_or_else(lost))
        .collect()
}

fn lost() -> StoreError {
    StoreError::Corrupt("a job was stored and not answered".to_owned())
}

/// What an idempotency key of a tenant stands for, if it was used.
pub(crate) async fn by_key(
    connection: &mut DbConnection,
    tenant: &str,
    key: &str,
    digest: &[u8; 32],
) -> Result<Option<Enqueued>, StoreError> {
    let row = query(BY_KEY)
        .bind(tenant)
        .bind(key)
        .fetch_optional(connection)
        .await?;
    let Some(row) = row else { return Ok(None) };
    let stored: Vec<u8> = row.try_get("digest")?;
    Ok(Some(if stored == digest {
        Enqueued::Existing(read_job(&row)?)
    } else {
        Enqueued::Conflict
    }))
}

async fn read_back(connection: &mut DbConnection, job: &NewJob) -> Result<Job, StoreError> {
    let row = query(GET)
        .bind(job.id.to_string())
        .bind(&*job.tenant)
        .fetch_one(connection)
        .await?;
    read_job(&row)
}

/// A job as its row is right after it was added.
fn queued(new: &NewJob) -> Job {
    Job {
        id: new.id,
        tenant: new.tenant.to_string(),
        kind: new.kind,
        state: State::Queued,
        name: new.name.clone(),
        labels: new.labels.clone(),
        batch_id: None,
        priority: new.options.priority,
        created_at: new.created_at,
        updated_at: new.created_at,
        started_at: None,
        ended_at: None,
        deadline: new.deadline(),
        expires_at: None,
        attempt: 0,
        progress: 0.0,
        remarks: Vec::new(),
        failure: None,
        cached: false,
        version: 1,
        queue: None,
    }
}
