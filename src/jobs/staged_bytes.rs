//! What cases of batches may take on the disk before they are queued: bytes counted as expanded, a row of a table with
//! its template, per tenant and in all.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use crate::error::{JobsError, Result};
use crate::options::StagingBounds;
use crate::sync::lock;

/// The bytes that are staged at present.
#[derive(Debug, Default)]
pub(crate) struct StagedBytes(Mutex<HashMap<Arc<str>, u64>>);

impl StagedBytes {
    /// Counts more bytes of a tenant, or says which bound they would pass.
    pub(crate) fn add(&self, tenant: &str, bytes: u64, bounds: StagingBounds) -> Result<()> {
        let mut staged = lock(&self.0);
        let of_tenant = staged.get(tenant).copied().unwrap_or(0);
        if of_tenant + bytes > bounds.tenant {
            return Err(JobsError::StagingQuotaExceeded(bounds.tenant));
        }
        if staged.values().sum::<u64>() + bytes > bounds.all {
            return Err(JobsError::StagingFull(bounds.all));
        }
        staged.insert(tenant.into(), of_tenant + bytes);
        Ok(())
    }

    /// The bytes of a tenant.
    pub(crate) fn of(&self, tenant: &str) -> u64 {
        let staged = lock(&self.0);
        staged.get(tenant).copied().unwrap_or(0)
    }

    /// Gives bytes of a tenant back.
    pub(crate) fn give_back(&self, tenant: &str, bytes: u64) {
        let mut staged = lock(&self.0);
        let left = staged.get(tenant).map_or(0, |of| of.saturating_sub(bytes));
        if left == 0 {
            staged.remove(tenant);
        } else {
            staged.insert(tenant.into(), left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_bounded_per_tenant_and_in_all_and_come_back() {
        let staged = StagedBytes::default();
        let bounds = StagingBounds {
            all: 150,
            tenant: 100,
        };
        let (a, b): (Arc<str>, Arc<str>) = ("a".into(), "b".into());
        staged.add(&a, 100, bounds).unwrap();
        let refused = staged.add(&a, 1, bounds);
        assert!(matches!(refused, Err(JobsError::StagingQuotaExceeded(100))));
        let refused = staged.add(&b, 51, bounds);
        assert!(matches!(refused, Err(JobsError::StagingFull(150))));
        staged.add(&b, 50, bounds).unwrap();
        staged.give_back(&a, 100);
        staged.add(&b, 50, bounds).unwrap();
        staged.add(&a, 50, bounds).unwrap();
    }
}
