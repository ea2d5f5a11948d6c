//! Following everything that is a tenant's: jobs that were submitted alone, evolutions, batches and runs.
//!
//! The store is asked again and again what changed since a moment; nothing is kept for a client. Changes are ordered by their
//! time, but may become visible a little later than they say, so each poll reaches back, and what was told already is left out.

use std::collections::{HashMap, VecDeque};
use std::time::Duration;

use tokio::time::sleep;
use uuid::Uuid;

use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::job::{Job, State};
use crate::jobs::model::kind::Kind;
use crate::jobs::store::list::{Change, Filter, Membership};
use crate::jobs::work::Work;

/// Time between two polls of the store.
const PAUSE: Duration = Duration::from_millis(250);
/// How far each poll reaches back, in ms.
const REACH_MS: i64 = 2000;
/// Changes read at once; a poll that finds more reads on. Chosen by judgement: a hundred kilobytes, far more than a poll usually finds.
const AT_ONCE: u32 = 1000;
/// Running jobs whose progress is followed.
const RUNNING_MAX: u32 = 100;

/// Where somebody who follows a tenant stands.
#[derive(Debug)]
pub struct Follower {
    jobs: Jobs,
    /// Everything that changed before this time was told.
    since: i64,
    told: VecDeque<(Work, i64)>,
    /// What was told of what changed lately: version of a job with its progress, counts of a batch or run.
    known: HashMap<Uuid, (i64, String)>,
}

impl Jobs {
    /// Follows the tenant from a moment on (epoch milliseconds), or from now on.
    #[must_use]
    pub fn follow(&self, since: Option<i64>) -> Follower {
        Follower {
            jobs: self.clone(),
            since: since.unwrap_or_else(|| self.shared.now_ms()),
            told: VecDeque::new(),
            known: HashMap::new(),
        }
    }
}

impl Follower {
    /// The moment up to which everything was told, from which another one can go on.
    #[must_use]
    pub fn since(&self) -> i64 {
        self.since
    }

    /// Waits for the next change, with the moment up to which everything was told with it; `None` when the service is about to
    /// stop.
    ///
    /// # Errors
    /// The database failed.
    pub async fn next(&mut self) -> Result<Option<(Work, i64)>, JobsError> {
        let shared = self.jobs.shared.clone();
        loop {
            if let Some(next) = self.told.pop_front() {
                return Ok(Some(next));
            }
            self.poll().await?;
            if self.told.is_empty() {
                tokio::select! {
                    () = sleep(PAUSE) => {}
                    () = shared.draining.cancelled() => return Ok(None),
                }
            }
        }
    }

    async fn poll(&mut self) -> Result<(), JobsError> {
        let from = self.since.saturating_sub(REACH_MS);
        self.poll_changes(from).await?;
        self.tell_progress().await?;
        let horizon = self.since.saturating_sub(2 * REACH_MS);
        self.known.retain(|_, (at, _)| *at >= horizon);
        Ok(())
    }

    async fn poll_changes(&mut self, mut from: i64) -> Result<(), JobsError> {
        let mut after = None;
        let mut batches: HashMap<(Kind, Uuid), i64> = HashMap::new();
        loop {
            let store = &self.jobs.shared.store;
            let changes = store
                .changes(&self.jobs.tenant, from, after, AT_ONCE)
                .await?;
            for change in &changes {
                match change.batch {
                    Some(batch) => {
                        let latest = batches.entry((change.kind, batch)).or_insert(change.at);
                        *latest = change.at.max(*latest);
                    }
                    None => self.tell_job(*change).await?,
                }
                self.since = self.since.max(change.at);
            }
            let Some(last) = changes.last().filter(|_| changes.len() == AT_ONCE as usize) else {
                break;
            };
            (from, after) = (last.at, Some(last.id));
        }
        for ((of_job, batch), at) in batches {
            let kind = match of_job {
                Kind::Rows => Kind::Rows,
                _ => Kind::Cases,
            };
            self.emit_batch(kind, batch, at).await?;
        }
        Ok(())
    }

    async fn tell_job(&mut self, change: Change) -> Result<(), JobsError> {
        let job = match self.jobs.recent(change.id, PAUSE).await {
            Ok(job) => job,
            Err(JobsError::NotFound | JobsError::Expired) => return Ok(()),
            Err(error) => return Err(error),
        };
        self.tell(job.id, change.at, tag(&job), job.into());
        Ok(())
    }

    async fn emit_batch(&mut self, kind: Kind, id: Uuid, at: i64) -> Result<(), JobsError> {
        // Not acknowledged yet, or gone.
        let gone = |error| match error {
            JobsError::BatchNotFound(_) | JobsError::Expired => Ok(()),
            error => Err(error),
        };
        let batch = match self.jobs.recent_batch(kind, id, PAUSE).await {
            Ok(batch) => batch,
            Err(error) => return gone(error),
        };
        let tag = batch.change_tag();
        if self.is_known(id, &tag) {
            // The head of a run need not be read.
            self.known.insert(id, (at, tag));
            return Ok(());
        }
        match self.jobs.work_of(batch).await {
            Ok(work) => self.tell(id, at, tag, work),
            Err(error) => return gone(error),
        }
        Ok(())
    }

    async fn tell_progress(&mut self) -> Result<(), JobsError> {
        let filter = Filter {
            states: vec![State::Running],
            member: Some(Membership::Alone),
            ..Filter::default()
        };
        for kind in [Kind::Case, Kind::Evolution] {
            let jobs = self.jobs.of_kind(kind);
            let running = jobs.list(&filter, None, RUNNING_MAX).await?.entries;
            for job in running {
                let at = self.since.max(job.updated_at);
                self.tell(job.id, at, tag(&job), job.into());
            }
        }
        Ok(())
    }

    fn is_known(&self, id: Uuid, tag: &str) -> bool {
        self.known.get(&id).is_some_and(|(_, known)| known == tag)
    }

    fn tell(&mut self, id: Uuid, at: i64, tag: String, changed: Work) {
        let known = self.is_known(id, &tag);
        self.known.insert(id, (at, tag));
        if !known {
            self.told.push_back((changed, self.since));
        }
    }
}

fn tag(job: &Job) -> String {
    format!("{} {:.2}", job.version, job.progress)
}
