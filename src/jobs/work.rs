//! [`Work`], the common type of jobs, batches, runs and evolutions, and a cache of recent reads.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::time::Instant;
use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::model::{Batch, Job, Kind, Labels};
use crate::run::model::Run;
use crate::sync::lock;

/// Work that a client has submitted.
#[derive(Debug, Clone)]
pub enum Work {
    /// A job or an evolution.
    Job(Box<Job>),
    /// A batch.
    Batch(Box<Batch>),
    /// A run.
    Run(Box<Run>),
}

impl From<Job> for Work {
    fn from(job: Job) -> Work {
        Work::Job(Box::new(job))
    }
}

impl From<Batch> for Work {
    fn from(batch: Batch) -> Work {
        Work::Batch(Box::new(batch))
    }
}

impl Work {
    /// Id, a UUIDv7.
    #[must_use]
    pub fn id(&self) -> Uuid {
        match self {
            Work::Job(job) => job.id,
            Work::Batch(batch) => batch.id,
            Work::Run(run) => run.chunks.id,
        }
    }

    /// Kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Work::Job(job) => job.kind,
            Work::Batch(batch) => batch.kind,
            Work::Run(_) => Kind::Rows,
        }
    }

    /// Labels.
    #[must_use]
    pub fn labels(&self) -> &Labels {
        match self {
            Work::Job(job) => &job.labels,
            Work::Batch(batch) => &batch.labels,
            Work::Run(run) => &run.chunks.labels,
        }
    }

    /// Whether the state is final.
    #[must_use]
    pub fn ended(&self) -> bool {
        let (ended, all) = match self {
            Work::Job(job) => return job.state.ended(),
            Work::Batch(batch) => batch.ended(),
            Work::Run(run) => run.chunks.ended(),
        };
        ended == all
    }

    /// A text that differs between any two states that clients can distinguish, not counting progress.
    #[must_use]
    pub fn version(&self) -> String {
        match self {
            Work::Job(job) => job.version.to_string(),
            Work::Batch(batch) => batch.change_tag(),
            Work::Run(run) => run.chunks.change_tag(),
        }
    }

    /// The job or evolution.
    ///
    /// # Errors
    /// [`JobsError::NotFound`] if it is a batch or a run.
    pub fn job(self) -> Result<Job> {
        match self {
            Work::Job(job) => Ok(*job),
            _ => Err(JobsError::NotFound(Kind::Case)),
        }
    }
}

/// Tenant, kind and id of work.
type OwnedId = (Arc<str>, Kind, Uuid);
type SharedRead<T> = Arc<tokio::sync::Mutex<Option<(Instant, T)>>>;

/// Recent reads of work, which are shared among callers: however many clients follow a batch, the store is queried once.
#[derive(Debug, Default)]
pub(crate) struct RecentReads<T>(Mutex<HashMap<OwnedId, SharedRead<T>>>);

impl<T: Clone> RecentReads<T> {
    /// Returns the result of `read`, or that of a read at most `age` ago. Concurrent callers wait for one read.
    pub(crate) async fn at<E>(
        &self,
        id: OwnedId,
        age: Duration,
        read: impl Future<Output = Result<T, E>>,
    ) -> Result<T, E> {
        if age.is_zero() {
            return read.await;
        }
        let last = {
            let mut all = lock(&self.0);
            Arc::clone(all.entry(id).or_default())
        };
        let mut seen = last.lock().await;
        if let Some((when, found)) = seen.as_ref()
            && when.elapsed() < age
        {
            return Ok(found.clone());
        }
        let found = read.await?;
        *seen = Some((Instant::now(), found.clone()));
        drop(seen);
        drop(last);
        self.forget(age);
        Ok(found)
    }

    /// Removes reads that are not in use.
    fn forget(&self, age: Duration) {
        let mut all = lock(&self.0);
        all.retain(|_, read| {
            Arc::strong_count(read) > 1
                || read.try_lock().is_ok_and(|seen| {
                    seen.as_ref()
                        .is_some_and(|(when, _)| when.elapsed() < 4 * age)
                })
        });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;

    #[tokio::test]
    async fn a_thousand_clients_that_ask_for_the_same_cause_a_few_reads() {
        let reads = Arc::new(RecentReads::<u64>::default());
        let asked = Arc::new(AtomicU64::new(0));
        let tenant: Arc<str> = "t".into();
        let (id, age) = (Uuid::now_v7(), Duration::from_millis(200));
        for round in 1..=2 {
            let (before, began) = (asked.load(Ordering::SeqCst), Instant::now());
            let all = (0..1000).map(|_| {
                let (reads, asked, tenant) = (reads.clone(), asked.clone(), tenant.clone());
                tokio::spawn(async move {
                    let read = async {
                        tokio::time::sleep(Duration::from_millis(5)).await;
                        Ok::<_, ()>(asked.fetch_add(1, Ordering::SeqCst) + 1)
                    };
                    reads.at((tenant, Kind::Case, id), age, read).await
                })
            });
            for found in all.collect::<Vec<_>>() {
                assert!(found.await.unwrap().unwrap() > before, "older than allowed");
            }
            // A read serves all callers until it is too old.
            let made = asked.load(Ordering::SeqCst) - before;
            let most = 1 + began.elapsed().as_millis() / age.as_millis();
            assert!(u128::from(made) <= most, "round {round}: {made}");
            tokio::time::sleep(age).await;
        }
        // A failed read is the answer of its caller alone, and what is not followed is forgotten.
        let failed = reads
            .at((tenant.clone(), Kind::Case, id), age, async {
                Err::<u64, _>("away")
            })
            .await;
        assert_eq!(failed, Err("away"));
        let other = reads.at((tenant, Kind::Case, Uuid::now_v7()), age, async {
            Ok::<_, ()>(7)
        });
        assert_eq!(other.await, Ok(7));
        tokio::time::sleep(5 * age).await;
        reads.forget(age);
        assert!(reads.0.lock().unwrap().is_empty());
    }
}
