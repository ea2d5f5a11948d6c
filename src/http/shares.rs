//! What all tenants share and none may have alone: a number of something in all, and how much of it one tenant may hold.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// A number of places, bytes or turns; clones share it.
#[derive(Debug, Clone)]
pub struct Shares {
    all: Arc<Semaphore>,
    of_tenant: usize,
    /// Tenants are made by the operator, so their number is small.
    tenants: Arc<Mutex<HashMap<Arc<str>, Arc<Semaphore>>>>,
}

/// What one request holds; given back when dropped.
#[derive(Debug)]
pub struct Share {
    _of_tenant: OwnedSemaphorePermit,
    _of_all: OwnedSemaphorePermit,
}

impl Shares {
    /// So many in all, and of one tenant.
    #[must_use]
    pub fn new(all: usize, of_tenant: usize) -> Shares {
        Shares {
            all: Arc::new(Semaphore::new(all.min(Semaphore::MAX_PERMITS))),
            of_tenant: of_tenant.min(all).min(Semaphore::MAX_PERMITS),
            tenants: Arc::default(),
        }
    }

    /// Takes so many at once if they are free.
    #[must_use]
    pub fn try_take(&self, tenant: &str, many: u32) -> Option<Share> {
        let of_tenant = self.of(tenant).try_acquire_many_owned(many).ok()?;
        let of_all = self.all.clone().try_acquire_many_owned(many).ok()?;
        Some(Share {
            _of_tenant: of_tenant,
            _of_all: of_all,
        })
    }

    fn of(&self, tenant: &str) -> Arc<Semaphore> {
        let mut tenants = self.tenants.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(own) = tenants.get(tenant) {
            return own.clone();
        }
        let own = Arc::new(Semaphore::new(self.of_tenant));
        tenants.insert(tenant.into(), own.clone());
        own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenant_gets_its_share_and_leaves_the_rest_to_others() {
        let shares = Shares::new(5, 3);
        let held = shares.try_take("a", 2).unwrap();
        assert!(shares.try_take("a", 2).is_none());
        assert!(shares.try_take("b", 4).is_none(), "three are left");
        let other = shares.try_take("b", 3);
        assert!(other.is_some() && shares.try_take("a", 1).is_none());
        drop(other);
        drop(held);
        assert!(shares.try_take("c", 3).is_some());
    }
}
