//! Keys that are bound to labels: they open only what carries these labels, and what they make gets them.

use std::sync::Arc;

use crate::contact::error::{Fault, FaultCode};
use crate::jobs::error::JobsError;
use crate::jobs::handle::Jobs;
use crate::jobs::model::labels::Labels;

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
    pub(crate) fn require_unbound(&self, action: &'static str) -> Result<(), JobsError> {
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
