//! [`Jobs`], the handle through which other crates submit, read and control jobs.
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use prometheus_client::registry::Registry;
use serde_json::Value;
use tokio::time::timeout;
use uuid::Uuid;

use crate::error::{JobsError, Result};
use crate::metrics::state_label;
use crate::model::{Job, Kind, Labels, State};
use crate::options::Options;
use crate::runtime_probe::{ProbedTime, probe};
use crate::shared::Shared;
use crate::storage_fault::StoragePlace;
use crate::store::Usage;
use crate::sync::lock;
use crate::trace::Tracer;
use railhead_contact::case::rail_pair::KnownPair;
use railhead_contact::error::{CaseError, Fault, FaultCode};
use railhead_contact::problem::checked_case::CheckedCase;

/// Maximum number of entries of a list page.
pub const PAGE_MAX: u32 = 1000;
/// Maximum number of entries of a page of batches, whose jobs are counted.
pub const BATCH_PAGE_MAX: u32 = 100;

/// How long a readiness check waits for the database.
const READY_WITHIN: Duration = Duration::from_secs(2);

/// Submits, reads, lists, cancels and deletes jobs, and waits for them. Clones are cheap and share all state.
#[derive(Debug, Clone)]
pub struct Jobs {
    pub(crate) shared: Arc<Shared>,
    /// The tenant whose jobs this handle creates and sees.
    pub(crate) tenant: Arc<str>,
    /// The kind of work that this handle reads and controls.
    pub(crate) kind: Kind,
    /// Labels that restrict this handle: it sees only work with these labels, and its submissions get them.
    pub(crate) bound: Arc<Labels>,
}

impl Jobs {
    /// A handle for another tenant.
    #[must_use]
    pub fn of(&self, tenant: Arc<str>) -> Jobs {
        Jobs {
            shared: self.shared.clone(),
            tenant,
            kind: Kind::Case,
            bound: Arc::default(),
        }
    }

    /// A handle for another kind of work of the same tenant.
    #[must_use]
    pub fn of_kind(&self, kind: Kind) -> Jobs {
        Jobs {
            kind,
            ..self.clone()
        }
    }

    /// The tenant of this handle.
    #[must_use]
    pub fn tenant(&self) -> &str {
        &self.tenant
    }

    /// The options of the service.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.shared.options
    }

    /// Checks a case against the limits of this service.
    ///
    /// # Errors
    /// Every fault of the case.
    pub fn check(&self, case: &Value) -> Result<CheckedCase, CaseError> {
        self.check_next(&self.shared.engine.known, case)
    }

    /// As [`Jobs::check`], with cached profile pairs.
    ///
    /// # Errors
    /// Every fault of the case.
    pub(crate) fn check_next(
        &self,
        known: &KnownPair,
        case: &Value,
    ) -> Result<CheckedCase, CaseError> {
        (self.shared.engine.check)(known, case, &self.shared.options.limits)
    }

    /// Estimates the solve time of a case on this machine by solving it for at most about `limit`.
    #[must_use]
    pub fn probe(&self, checked: &CheckedCase, limit: Duration) -> ProbedTime {
        let engine = &self.shared.engine;
        probe(checked, limit, |monitor| {
            let mut slices = (engine.slices)(checked).into_iter();
            slices.try_for_each(|slice| (engine.solve)(checked, slice, monitor).map(drop))
        })
    }

    /// Usage of the tenant: jobs by state, reserved places, staged and stored bytes.
    ///
    /// # Errors
    /// The database failed.
    pub async fn usage(&self) -> Result<Usage> {
        let usage = self.shared.store.usage(&self.tenant).await?;
        Ok(Usage {
            staged_bytes: self.shared.staged.of(&self.tenant),
            ..usage
        })
    }

    /// Checks that the service can take requests: makes a round trip to the database, and requires that storage accepts writes.
    ///
    /// # Errors
    /// [`JobsError::Draining`], or a database that fails or does not answer in time.
    pub async fn ready(&self) -> Result<()> {
        if self.shared.draining.is_cancelled() {
            return Err(JobsError::Draining);
        }
        timeout(READY_WITHIN, self.shared.store.ready(false))
            .await
            .unwrap_or_else(|_| Err(self.shared.silent_store()))?;
        self.shared.require_storage().await
    }

    /// A handle that is restricted to work with these labels.
    #[must_use]
    pub fn bound_to(self, labels: Arc<Labels>) -> Jobs {
        Jobs {
            bound: labels,
            ..self
        }
    }

    /// The labels that restrict this handle.
    #[must_use]
    pub fn bound(&self) -> &Labels {
        &self.bound
    }

    /// Whether work with these labels is visible to this handle.
    pub(crate) fn sees(&self, labels: &Labels) -> bool {
        let mut bound = self.bound.iter();
        bound.all(|(key, value)| labels.get(key) == Some(value))
    }

    /// Rejects an action on the whole tenant if this handle is restricted by labels.
    ///
    /// # Errors
    /// [`JobsError::BoundKey`].
    pub(crate) fn require_unbound(&self, action: &'static str) -> Result<()> {
        if self.bound.is_empty() {
            return Ok(());
        }
        let labels = self.bound.iter();
        let labels: Vec<String> = labels
            .map(|(key, value)| format!("`{key}:{value}`"))
            .collect();
        Err(JobsError::BoundKey {
            labels: labels.join(", "),
            action,
        })
    }

    /// Adds the labels of the key to the labels of new work.
    ///
    /// # Errors
    /// A label has another value already.
    pub fn bind(&self, labels: &mut Labels) -> Result<(), Vec<Fault>> {
        let mut faults = Vec::new();
        for (key, value) in &*self.bound {
            let given = labels.entry(key.clone()).or_insert_with(|| value.clone());
            if given != value {
                faults.push(other_value(key, given, value));
            }
        }
        if faults.is_empty() {
            Ok(())
        } else {
            Err(faults)
        }
    }

    /// A filter by labels, restricted to what this handle sees.
    pub(crate) fn narrowed(&self, labels: &[(String, String)]) -> Vec<(String, String)> {
        let own = self.bound.iter();
        let own = own.map(|(key, value)| (key.clone(), value.clone()));
        let mut all = labels.to_vec();
        for label in own {
            if !all.contains(&label) {
                all.push(label);
            }
        }
        all
    }

    /// The digest of a request for its idempotency key. It depends on the labels of the key.
    pub(crate) fn bound_digest(&self, digest: [u8; 32]) -> [u8; 32] {
        if self.bound.is_empty() {
            return digest;
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(&digest);
        // Quotes separate the texts.
        hasher.update(format!("{:?}", self.bound).as_bytes());
        *hasher.finalize().as_bytes()
    }

    /// Sets the time at which the job expires.
    pub(crate) fn dated(&self, mut job: Job) -> Job {
        job.expires_at = self.shared.expires_at(&job);
        job
    }

    /// Sets the time at which the job expires. Fails if it has expired, or belongs to a batch that was never acknowledged.
    pub(crate) fn unexpired(&self, job: Job) -> Result<Job> {
        let job = self.dated(job);
        if let Some(batch) = &job.batch_id
            && lock(&self.shared.batches).abandoned.contains(batch)
        {
            return Err(JobsError::NotFound(self.kind));
        }
        let now = self.shared.now_ms();
        let now = job
            .ended_at
            .map_or(now, |ended| self.shared.clock_step().now_for(ended, now));
        match job.expires_at {
            Some(time) if time <= now => Err(JobsError::Expired),
            _ => Ok(job),
        }
    }

    /// The error for an id that does not exist: [`JobsError::Expired`] if it did, else [`JobsError::NotFound`].
    pub(crate) async fn missing(&self, id: Uuid) -> JobsError {
        match self.shared.store.has_expired(&self.tenant, id).await {
            Ok(true) => JobsError::Expired,
            Ok(false) => JobsError::NotFound(self.kind),
            Err(error) => error.into(),
        }
    }

    /// The registry of the metrics of this crate.
    #[must_use]
    pub fn metrics(&self) -> &Registry {
        &self.shared.registry
    }

    /// Updates the metrics that are read from the store, not counted as they happen.
    ///
    /// # Errors
    /// The database failed.
    pub async fn refresh_metrics(&self) -> Result<()> {
        let metrics = &self.shared.metrics;
        metrics.workers.set(gauge(self.shared.options.workers));
        let abandoned = self.shared.abandoned.load(Ordering::Acquire);
        metrics.abandoned.set(gauge(abandoned));
        let stats = self.shared.store.stats().await.map_err(JobsError::from);
        if stats.is_err() {
            self.shared.observe_storage(StoragePlace::Table, &stats);
        }
        metrics.storage_failing(self.shared.storage.any());
        let stats = match stats {
            // The alert for this must not fail with it.
            Err(error) if error.storage_fault().is_some() => return Ok(()),
            stats => stats?,
        };
        let queued = stats.jobs.get(&State::Queued).copied().unwrap_or(0);
        #[expect(clippy::cast_precision_loss, reason = "an estimate")]
        metrics
            .queue_cost_seconds
            .set(queued as f64 * stats.mean_cost_us * 1e-6);
        for (state, jobs) in stats.jobs {
            let jobs_in_state = metrics.jobs.get_or_create_owned(&state_label(state));
            jobs_in_state.set(gauge(jobs));
        }
        let age_ms = stats
            .oldest_queued_at
            .map_or(0, |created| (self.shared.now_ms() - created).max(0));
        #[expect(clippy::cast_precision_loss, reason = "an age is far below 2^53 ms")]
        metrics.oldest_queued_seconds.set(age_ms as f64 / 1000.0);
        metrics.database_bytes.set(gauge(stats.database_bytes));
        metrics.result_bytes.set(gauge(stats.result_bytes));
        let operators = self.shared.engine.operators.bytes();
        metrics.operator_bytes.set(gauge(operators));
        Ok(())
    }

    /// The tracer, if spans are collected.
    #[must_use]
    pub fn tracer(&self) -> Option<&Tracer> {
        self.shared.options.tracer.as_ref()
    }
}

fn other_value(key: &str, given: &str, bound: &str) -> Fault {
    let pointer = format!("/labels/{}", key.replace('~', "~0").replace('/', "~1"));
    let detail =
        format!("the label `{key}` is `{given}`; the key of this request is bound to `{bound}`");
    let mut fault = Fault::new(pointer, detail);
    fault.figures.code = FaultCode::Invalid;
    fault.figures.value = Some(given.into());
    fault.figures.allowed = vec![bound.to_owned()];
    fault
}

/// The value of a gauge.
fn gauge(number: impl TryInto<i64>) -> i64 {
    number.try_into().unwrap_or(i64::MAX)
}
