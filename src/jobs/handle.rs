//! The handle through which the outside submits, reads and controls jobs.
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;
use tokio::time::timeout;

use crate::error::{JobsError, Result};
use crate::model::{Kind, Labels};
use crate::options::Options;
use crate::runtime_probe::{ProbedTime, probe};
use crate::shared::Shared;
use crate::store::Usage;
use railhead_contact::case::solver::KnownPair;
use railhead_contact::error::{CaseError, Fault, FaultCode};
use railhead_contact::problem::checked_case::CheckedCase;

/// Longest list page.
pub const PAGE_MAX: u32 = 1000;
/// Longest list page of batches, whose jobs are counted.
pub const BATCH_PAGE_MAX: u32 = 100;

/// How long a readiness check waits for the database.
const READY_WITHIN: Duration = Duration::from_secs(2);

/// Submits, reads, lists, cancels and deletes jobs, and waits for them. A cheap handle; clones share everything.
#[derive(Debug, Clone)]
pub struct Jobs {
    pub(crate) shared: Arc<Shared>,
    /// Whose jobs this handle makes and sees.
    pub(crate) tenant: Arc<str>,
    /// The kind of the work that this handle reads and controls.
    pub(crate) kind: Kind,
    /// What this handle sees carries these labels, and what it makes gets them.
    pub(crate) bound: Arc<Labels>,
}

impl Jobs {
    /// The same jobs as one tenant sees them: its own and no others.
    #[must_use]
    pub fn of(&self, tenant: Arc<str>) -> Jobs {
        Jobs {
            shared: self.shared.clone(),
            tenant,
            kind: Kind::Case,
            bound: Arc::default(),
        }
    }

    /// The same for the tenant's work of another kind.
    #[must_use]
    pub fn of_kind(&self, kind: Kind) -> Jobs {
        Jobs {
            kind,
            ..self.clone()
        }
    }

    /// Whose jobs these are.
    #[must_use]
    pub fn tenant(&self) -> &str {
        &self.tenant
    }

    /// How jobs are kept and worked on here.
    #[must_use]
    pub fn options(&self) -> &Options {
        &self.shared.options
    }

    /// Checks a case against the limits of this service.
    ///
    /// # Errors
    /// Every fault of the case.
    pub fn check(&self, case: &Value) -> Result<CheckedCase, CaseError> {
        self.check_next(self.known_pairs(), case)
    }

    /// As [`Jobs::check`], for one of many cases.
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

    /// Pairs of cross-sections that were read before.
    pub(crate) fn known_pairs(&self) -> &KnownPair {
        &self.shared.engine.known
    }

    /// Solve time of a case on this machine, found by solving it for at most about `limit`.
    #[must_use]
    pub fn probe(&self, checked: &CheckedCase, limit: Duration) -> ProbedTime {
        let engine = &self.shared.engine;
        probe(checked, limit, |monitor| {
            let mut slices = (engine.slices)(checked).into_iter();
            slices.try_for_each(|slice| (engine.solve)(checked, slice, monitor).map(drop))
        })
    }

    /// What the tenant has here.
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

    /// Can this service take requests? A round trip to the database, which must also take data.
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
}

impl Jobs {
    /// The same jobs as a key sees them that is bound to these labels; all of them without labels.
    #[must_use]
    pub fn bound_to(self, labels: Arc<Labels>) -> Jobs {
        Jobs {
            bound: labels,
            ..self
        }
    }

    /// The labels that this handle is bound to.
    #[must_use]
    pub fn bound(&self) -> &Labels {
        &self.bound
    }

    /// Does something with these labels exist for this handle?
    pub(crate) fn sees(&self, labels: &Labels) -> bool {
        let mut bound = self.bound.iter();
        bound.all(|(key, value)| labels.get(key) == Some(value))
    }

    /// Refuses what concerns the whole tenant to a handle that is bound to labels.
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

    /// Adds the labels of the key to those of something new.
    ///
    /// # Errors
    /// It has another value for one of them.
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

    /// A filter by labels, narrowed to what this handle sees.
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

    /// The digest of a request with an idempotency key: the same request under a key with other labels is another one.
    pub(crate) fn bound_digest(&self, digest: [u8; 32]) -> [u8; 32] {
        if self.bound.is_empty() {
            return digest;
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(&digest);
        // Quotes say where a text ends.
        hasher.update(format!("{:?}", self.bound).as_bytes());
        *hasher.finalize().as_bytes()
    }
}

fn other_value(key: &str, given: &str, bound: &str) -> Fault {
    let pointer = format!("/labels/{}", key.replace('~', "~0").replace('/', "~1"));
    let detail = format!("is `{given}`; the key of this request is bound to `{bound}`");
    let mut fault = Fault::new(pointer, detail);
    fault.figures.code = FaultCode::Invalid;
    fault.figures.value = Some(given.into());
    fault.figures.allowed = vec![bound.to_owned()];
    fault
}
