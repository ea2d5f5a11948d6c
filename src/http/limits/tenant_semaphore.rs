//! A semaphore that all tenants share, of which one tenant may hold a part.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::timeout;

use crate::jobs::sync::lock;

/// Units of memory, requests or turns, in all and for each tenant. Clones share the semaphore.
#[derive(Debug, Clone)]
pub(crate) struct TenantSemaphore {
    all: Arc<Semaphore>,
    of_tenant: usize,
    /// Tenants are made by the operator, so their number is small.
    tenants: Arc<Mutex<HashMap<Arc<str>, Arc<Semaphore>>>>,
}

/// Units that one request holds; they are released on drop.
#[derive(Debug)]
pub struct Permit {
    of_tenant: OwnedSemaphorePermit,
    of_all: OwnedSemaphorePermit,
}

impl TenantSemaphore {
    /// A semaphore of `all` units, of which a tenant may hold `of_tenant`.
    #[must_use]
    pub(crate) fn new(all: usize, of_tenant: usize) -> TenantSemaphore {
        TenantSemaphore {
            all: Arc::new(Semaphore::new(all.min(Semaphore::MAX_PERMITS))),
            of_tenant: of_tenant.min(all).min(Semaphore::MAX_PERMITS),
            tenants: Arc::default(),
        }
    }

    /// The most that one tenant may hold.
    #[must_use]
    pub(crate) fn of_one(&self) -> usize {
        self.of_tenant
    }

    /// Takes `many` units at once, if they are free.
    #[must_use]
    pub(crate) fn try_take(&self, tenant: &str, many: u32) -> Option<Permit> {
        let of_tenant = self.of(tenant).try_acquire_many_owned(many).ok()?;
        let of_all = self.all.clone().try_acquire_many_owned(many).ok()?;
        Some(Permit { of_tenant, of_all })
    }

    /// Waits for `many` units, first come, first served. Returns `None` if they are not free within the time, or never can be.
    pub(crate) async fn take(&self, tenant: &str, many: u32, within: Duration) -> Option<Permit> {
        if many as usize > self.of_tenant {
            return None;
        }
        let both = async {
            let of_tenant = self.of(tenant).acquire_many_owned(many).await.ok()?;
            let of_all = self.all.clone().acquire_many_owned(many).await.ok()?;
            Some(Permit { of_tenant, of_all })
        };
        timeout(within, both).await.ok().flatten()
    }

    fn of(&self, tenant: &str) -> Arc<Semaphore> {
        let mut tenants = lock(&self.tenants);
        if let Some(own) = tenants.get(tenant) {
            return own.clone();
        }
        let own = Arc::new(Semaphore::new(self.of_tenant));
        tenants.insert(tenant.into(), own.clone());
        own
    }
}

impl Permit {
    /// Releases all but `many` units.
    pub fn shrink_to_units(&mut self, many: usize) {
        let surplus = self.of_all.num_permits().saturating_sub(many);
        drop(self.of_all.split(surplus));
        drop(self.of_tenant.split(surplus));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenant_gets_its_share_and_leaves_the_rest_to_others() {
        let shares = TenantSemaphore::new(5, 3);
        let mut held = shares.try_take("a", 3).unwrap();
        assert!(shares.try_take("a", 1).is_none());
        assert!(shares.try_take("b", 3).is_none(), "two are left");
        let other = shares.try_take("b", 2).unwrap();
        held.shrink_to_units(1);
        assert!(shares.try_take("a", 3).is_none());
        assert!(shares.try_take("a", 2).is_some());
        drop((held, other));
        assert!(shares.try_take("c", 3).is_some());
    }

    #[tokio::test]
    async fn what_is_not_free_in_time_is_not_waited_for_any_longer() {
        let shares = TenantSemaphore::new(2, 2);
        let held = shares.try_take("a", 2).unwrap();
        let soon = Duration::from_millis(20);
        assert!(shares.take("b", 1, soon).await.is_none());
        assert!(shares.take("b", 3, Duration::MAX).await.is_none());
        let (later, ()) = tokio::join!(shares.take("b", 1, Duration::from_secs(60)), async {
            drop(held);
        });
        assert!(later.is_some());
    }
}
